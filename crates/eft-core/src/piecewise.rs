//! A strictly increasing piecewise linear map, evaluated without a divide and in bounded time.
//!
//! A coarse index of equal cells gives the segment to start from; the rest is at most `walk` comparisons,
//! one for a table whose knots are not crowded. Beyond its ends the map is constant.

use core::array;

use crate::error::{ConfigError, LARGEST, check, within};
use crate::scalar::{Real, Scalar};

/// Cells of the index: a power of two, so that an index wraps instead of being checked.
pub const CELLS: usize = 64;

/// A strictly increasing map through up to `N` knots.
#[derive(Debug, Clone, Copy)]
pub struct PiecewiseLinear<S: Scalar, const N: usize> {
    lowest: S,
    highest: S,
    cells_per_unit: S,
    walk: usize,
    first: [S::Index; CELLS],
    starts: [S; N],
    ends: [S; N],
    values: [S; N],
    slopes: [S; N],
}

impl<S: Scalar, const N: usize> PiecewiseLinear<S, N> {
    /// The value at `x`, held constant beyond the ends.
    ///
    /// # NaN
    /// NaN reads the lower end: the result is finite for every input.
    ///
    /// # Cost
    /// Six additions and multiplications and `walk` comparisons (one for a table without crowded knots).
    #[inline(always)]
    pub fn eval(&self, x: S) -> S {
        let x = x.limit(self.lowest, self.highest);
        let cell = ((x - self.lowest) * self.cells_per_unit).truncate();
        let mut i = S::index_at(&self.first, cell);
        for _ in 0..self.walk {
            i = S::advance(i, x.ge(S::at(&self.ends, i)));
        }
        S::at(&self.values, i) + (x - S::at(&self.starts, i)) * S::at(&self.slopes, i)
    }

    /// Where `x` lies beyond the table (NaN does).
    #[inline(always)]
    pub fn beyond(&self, x: S) -> S::Mask {
        !(x.ge(self.lowest) & x.le(self.highest))
    }

    /// The largest number of comparisons one evaluation makes.
    pub const fn walk(&self) -> usize {
        self.walk
    }

    /// Maps of single rigs side by side: lane `i` is `lanes[i]`.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a PiecewiseLinear<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        let walks = (0..S::LANES).map(|i| lane(i).walk);
        Self {
            lowest: S::from_lanes(|i| lane(i).lowest),
            highest: S::from_lanes(|i| lane(i).highest),
            cells_per_unit: S::from_lanes(|i| lane(i).cells_per_unit),
            walk: walks.fold(0, |most, w| if w > most { w } else { most }),
            first: array::from_fn(|c| S::index_from_lanes(|i| lane(i).first.get(c).copied().unwrap_or(0))),
            starts: pack_row(|i| &lane(i).starts),
            ends: pack_row(|i| &lane(i).ends),
            values: pack_row(|i| &lane(i).values),
            slopes: pack_row(|i| &lane(i).slopes),
        }
    }
}

impl<S: Real, const N: usize> PiecewiseLinear<S, N> {
    /// The knots: abscissae and values.
    pub fn knots(&self) -> impl Iterator<Item = (S, S)> + '_ {
        let used = self.ends.iter().take_while(|e| e.is_finite()).count() + 1;
        self.starts.iter().copied().zip(self.values.iter().copied()).take(used)
    }
}

fn pack_row<'a, S: Scalar, const N: usize>(row: impl Fn(usize) -> &'a [S::Element; N]) -> [S; N]
where
    S::Element: 'a,
{
    array::from_fn(|n| S::from_lanes(|i| row(i).get(n).copied().unwrap_or_default()))
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> PiecewiseLinear<$t, N> {
            /// A map through the knots `(x[i], y[i])`, each rounded once to the scalar in use.
            ///
            /// # Errors
            /// Fewer than two knots, more than `N`, different lengths, entries that are not finite or beyond
            /// ±[`LARGEST`], that do not increase strictly (after rounding), or whose slope
            /// overflows, naming the table and the index. In a `const` context each is a compile error.
            // Every index below is bounded by `len <= N`; `get` is not constant yet.
            #[allow(clippy::indexing_slicing)]
            pub const fn new(
                x_name: &'static str,
                x: &[f64],
                y_name: &'static str,
                y: &[f64],
            ) -> Result<Self, ConfigError> {
                let len = x.len();
                let longest = if N < 256 { N } else { 255 };
                if len < 2 || len > longest {
                    return Err(ConfigError::Length { parameter: x_name, length: len, shortest: 2, longest });
                }
                if y.len() != len {
                    return Err(ConfigError::Length {
                        parameter: y_name,
                        length: y.len(),
                        shortest: len,
                        longest: len,
                    });
                }
                let mut map = Self {
                    lowest: 0.0,
                    highest: 0.0,
                    cells_per_unit: 0.0,
                    walk: 0,
                    first: [0; CELLS],
                    starts: [<$t>::INFINITY; N],
                    ends: [<$t>::INFINITY; N],
                    values: [0.0; N],
                    slopes: [0.0; N],
                };
                let mut i = 0;
                while i < len {
                    map.starts[i] = check!(within(x_name, x[i], -LARGEST, LARGEST)) as $t;
                    map.values[i] = check!(within(y_name, y[i], -LARGEST, LARGEST)) as $t;
                    if i > 0 {
                        if map.starts[i] <= map.starts[i - 1] {
                            return Err(ConfigError::NotIncreasing { parameter: x_name, index: i });
                        }
                        if map.values[i] <= map.values[i - 1] {
                            return Err(ConfigError::NotIncreasing { parameter: y_name, index: i });
                        }
                        map.ends[i - 1] = map.starts[i];
                        let run = map.starts[i] - map.starts[i - 1];
                        // Between the knots as rounded, so that the segment meets both of them.
                        let rise = map.values[i] as f64 - map.values[i - 1] as f64;
                        let mut slope = (rise / (map.starts[i] as f64 - map.starts[i - 1] as f64)) as $t;
                        if !slope.is_finite() {
                            return Err(ConfigError::TooSteep { parameter: y_name, index: i });
                        }
                        // Rounded down until the segment ends at or below the next knot: the map is then
                        // monotone to the last bit, not only up to rounding.
                        while map.values[i - 1] + run * slope > map.values[i] {
                            slope = slope.next_down();
                        }
                        map.slopes[i - 1] = slope;
                    }
                    i += 1;
                }
                map.lowest = map.starts[0];
                map.highest = map.starts[len - 1];
                // Half a cell short of the full count, so that rounding cannot reach past the last cell.
                let span = map.starts[len - 1] as f64 - map.starts[0] as f64;
                map.cells_per_unit = ((CELLS as f64 - 0.5) / span) as $t;
                map.index(len);
                Ok(map)
            }

            /// Fills the index in the arithmetic of `eval` itself. The cell is a monotone function of `x`, so
            /// every knot in an earlier cell lies at or below `x` whatever the rounding.
            #[allow(clippy::indexing_slicing)]
            const fn index(&mut self, len: usize) {
                let mut cell = 0;
                while cell < CELLS {
                    let mut inside = 0;
                    let mut i = 1;
                    while i < len {
                        let at = self.cell(self.starts[i]);
                        if at < cell {
                            self.first[cell] = i as u8;
                        } else if at == cell {
                            inside += 1;
                        }
                        i += 1;
                    }
                    if inside > self.walk {
                        self.walk = inside;
                    }
                    cell += 1;
                }
            }

            const fn cell(&self, x: $t) -> usize {
                ((x - self.lowest) * self.cells_per_unit) as u8 as usize & (CELLS - 1)
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
