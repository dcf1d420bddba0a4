//! The rows of a piecewise linear map, one number or several in lanes.

/// Cells of the index.
pub const CELLS: usize = 62;
/// The entry of a cell with more than one knot; no table is so long.
pub(crate) const CROWDED: u8 = 255;

/// The map from `start` on is `value + (x - start)·slope`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Row<S> {
    /// Abscissa of the knot.
    pub start: S,
    /// Value there.
    pub value: S,
    /// Slope up to the next knot.
    pub slope: S,
}

/// The last of `N` ordered rows that starts at or below `x`, or the first if none does. The number of steps is that of
/// the bits of `N`, for any rows. Rows beyond the last knot start at infinity.
#[inline(always)]
pub(crate) fn search<R, S: PartialOrd, const N: usize>(
    rows: &[R; N],
    start: impl Fn(&R) -> S,
    x: S,
) -> Option<&R> {
    let mut rows = rows.as_slice();
    while rows.len() > 1 {
        let half = rows.len() / 2;
        // Both halves have the same length, so that the number of steps is known. Halves of an even number share a row.
        let (below, above) = (rows.get(..rows.len() - half)?, rows.get(half..)?);
        rows = if start(above.first()?) <= x { above } else { below };
    }
    rows.first()
}
