//! A checksum of every number of a configuration or state, to compare with an earlier one.

/// A checksum, built up piece by piece.
///
/// Each step has an inverse, as a function of the piece and of the earlier checksum. So two values that differ in one
/// piece of 32 bits always have different checksums. Other values have the same one with a chance of about 2⁻³².
#[derive(Debug, Clone, Copy)]
pub struct Word(u32);

/// 2³² over the golden ratio: odd, so that the product has an inverse.
const FACTOR: u32 = 0x9e37_79b1;

impl Word {
    /// Of no pieces.
    pub(crate) const EMPTY: Self = Self(0);

    /// Adds a piece.
    #[inline(always)]
    pub(crate) fn add(&mut self, piece: u32) {
        self.0 = (self.0.rotate_left(5) ^ piece).wrapping_mul(FACTOR);
    }

    /// As a number.
    pub(crate) fn finish(self) -> u32 {
        self.0
    }
}

/// A value that has a checksum. Its fields are visited one by one, since the bytes between them are undefined.
pub trait Integrity {
    /// Adds its pieces.
    fn add_to(&self, word: &mut Word);
}

/// The checksum of a value.
pub(crate) fn word(of: &impl Integrity) -> u32 {
    let mut word = Word::EMPTY;
    of.add_to(&mut word);
    word.finish()
}

macro_rules! pieces {
    ($($t:ty: |$value:ident| $($piece:expr),+;)*) => {$(
        impl Integrity for $t {
            #[inline(always)]
            fn add_to(&self, word: &mut Word) {
                let $value = *self;
                $(word.add($piece);)+
            }
        }
    )*};
}
pieces! {
    bool: |value| u32::from(value);
    u8: |value| u32::from(value);
    u32: |value| value;
    u64: |value| value as u32, (value >> 32) as u32;
    f32: |value| value.to_bits();
    f64: |value| value.to_bits() as u32, (value.to_bits() >> 32) as u32;
}

impl<V: Integrity, const N: usize> Integrity for [V; N] {
    fn add_to(&self, word: &mut Word) {
        for value in self {
            value.add_to(word);
        }
    }
}

impl<V: Integrity> Integrity for Option<V> {
    fn add_to(&self, word: &mut Word) {
        word.add(u32::from(self.is_some()));
        if let Some(value) = self {
            value.add_to(word);
        }
    }
}
