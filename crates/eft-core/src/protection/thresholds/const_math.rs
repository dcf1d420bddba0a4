//! Functions that a constant may call.

/// Natural logarithm, rounded up to a multiple of that of 2.
pub(super) const fn logarithm(value: f64) -> f64 {
    let exponent = ((value.to_bits() >> 52) & 0x7ff) as f64 - 1022.0;
    exponent * core::f64::consts::LN_2
}

/// Square root of a number within [1, 1e4], to the last digits, in a constant.
pub(super) const fn root(square: f64) -> f64 {
    let (mut root, mut n) = (square, 0);
    while n < 40 {
        root = 0.5 * (root + square / root);
        n += 1;
    }
    root
}

/// e to the power of a negative number, in a constant.
pub(super) const fn exponential(power: f64) -> f64 {
    let (mut value, mut halvings) = (power, 0);
    while value < -0.5 {
        value *= 0.5;
        halvings += 1;
    }
    // Taylor's series by Horner's scheme.
    let (mut result, mut n) = (1.0, 8.0);
    while n > 0.5 {
        result = 1.0 + result * value / n;
        n -= 1.0;
    }
    while halvings > 0 {
        result *= result;
        halvings -= 1;
    }
    result
}

/// Coefficient of a first-order low-pass, at most 1.
pub(super) const fn share(corner: f64, rate: f64) -> f64 {
    let angle = core::f64::consts::TAU * corner / rate;
    let share = angle / (1.0 + 0.5 * angle);
    if share < 1.0 { share } else { 1.0 }
}
