//! A map from its knots.

use crate::error::{ConfigError, LARGEST, check};
use crate::number::{CELLS, CROWDED, Row};
use crate::table::PiecewiseLinear;

/// An entry of a list, which must lie within ±[`LARGEST`].
#[allow(clippy::indexing_slicing)]
const fn item(parameter: &'static str, list: &[f64], index: usize) -> Result<f64, ConfigError> {
    let value = if index < list.len() { list[index] } else { f64::NAN };
    if value >= -LARGEST && value <= LARGEST {
        return Ok(value);
    }
    Err(ConfigError::Entry { parameter, index, value, lowest: -LARGEST, highest: LARGEST })
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> PiecewiseLinear<$t, N> {
            const NOWHERE: Row<$t> = Row { start: <$t>::INFINITY, value: 0.0, slope: 0.0 };
            /// No knots yet.
            pub(crate) const EMPTY: Self = Self {
                rows: [Self::NOWHERE; N],
                cells: [0; CELLS],
                origin: 0.0,
                cells_per_unit: 0.0,
                middle: 0.0,
                below: 0.0,
                above: 0.0,
                len: 0,
            };

            /// A map through the knots `(x[i], y[i])`, each rounded once to the scalar in use.
            ///
            /// # Errors
            /// Fewer than two knots, more than `N`, different lengths, entries that are not finite or beyond
            /// ±[`LARGEST`], that do not increase strictly (after rounding), or whose slope overflows, naming the
            /// table and the index. In a `const` context each is a compile error.
            pub const fn new(
                x_name: &'static str,
                x: &[f64],
                y_name: &'static str,
                y: &[f64],
            ) -> Result<Self, ConfigError> {
                let mut map = Self::EMPTY;
                check!(map.fill(x_name, x, y_name, y));
                Ok(map)
            }

            /// As [`new`](Self::new), in place, so that a constructor's stack holds no second map.
            pub(crate) const fn fill(
                &mut self,
                x_name: &'static str,
                x: &[f64],
                y_name: &'static str,
                y: &[f64],
            ) -> Result<(), ConfigError> {
                let len = x.len();
                let longest = if N < 255 { N } else { 255 };
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
                *self = Self::EMPTY;
                let mut i = 0;
                while i < len {
                    let start = check!(item(x_name, x, i)) as $t;
                    let value = check!(item(y_name, y, i)) as $t;
                    self.put(i, start, value, 0.0);
                    if i > 0 && start <= self.row(i - 1).start {
                        return Err(ConfigError::NotIncreasing { parameter: x_name, index: i });
                    }
                    if i > 0 && value <= self.row(i - 1).value {
                        return Err(ConfigError::NotIncreasing { parameter: y_name, index: i });
                    }
                    i += 1;
                }
                self.connect(len, y_name)
            }

            /// The map times `factor` (not negative), cut off where it reaches ±`end`.
            pub(crate) const fn scale_to_limit(&mut self, factor: f64, end: f64) -> Result<(), ConfigError> {
                let count = self.len as usize;
                let (mut len, mut previous) = (0, self.scaled(0, factor));
                let mut i = 0;
                while i < count {
                    let (start, value) = self.scaled(i, factor);
                    let next = self.scaled(if i + 1 == count { i } else { i + 1 }, factor);
                    // A knot beyond a limit moves along its segment to where the map crosses the limit, or goes if
                    // its neighbour towards the limit is beyond as well.
                    let (limit, neighbour) = if value < -end { (-end, next) } else { (end, previous) };
                    let beyond = value > end || value < -end;
                    let crossing = beyond && (neighbour.1 - limit) * limit < 0.0;
                    let moved = start + (limit - value) / (neighbour.1 - value) * (neighbour.0 - start);
                    let knot = if crossing { (moved as $t, limit as $t) } else { (start as $t, value as $t) };
                    // Knots that rounding puts on the same place become one.
                    if (!beyond || crossing) && (len == 0 || knot.0 > self.row(len - 1).start) {
                        self.put(len, knot.0, knot.1, 0.0);
                        len += 1;
                    }
                    previous = (start, value);
                    i += 1;
                }
                let mut i = len;
                while i < count {
                    self.put(i, <$t>::INFINITY, 0.0, 0.0);
                    i += 1;
                }
                if len < 2 {
                    return Err(ConfigError::Length {
                        parameter: "openings",
                        length: len,
                        shortest: 2,
                        longest: N,
                    });
                }
                self.connect(len, "openings")
            }

            /// A knot with its value times `factor`.
            const fn scaled(&self, i: usize, factor: f64) -> (f64, f64) {
                (self.row(i).start as f64, factor * self.row(i).value as f64)
            }

            // Explicit bounds instead of a reachable panic; `get` is not constant yet.
            #[allow(clippy::indexing_slicing)]
            const fn row(&self, i: usize) -> Row<$t> {
                if i < N { self.rows[i] } else { Self::NOWHERE }
            }

            #[allow(clippy::indexing_slicing)]
            const fn put(&mut self, i: usize, start: $t, value: $t, slope: $t) {
                if i < N {
                    self.rows[i] = Row { start, value, slope };
                }
            }

            /// Connects the first `len` rows: their starts and values are the knots; starts increase, values do not
            /// decrease.
            const fn connect(&mut self, len: usize, y_name: &'static str) -> Result<(), ConfigError> {
                let mut i = 1;
                while i < len {
                    let (row, next) = (self.row(i - 1), self.row(i));
                    // Between the knots as rounded, so that the segment meets both of them.
                    let rise = next.value as f64 - row.value as f64;
                    let mut slope = (rise / (next.start as f64 - row.start as f64)) as $t;
                    if !slope.is_finite() {
                        return Err(ConfigError::TooSteep { parameter: y_name, index: i });
                    }
                    // Rounded down until the segment ends at or below the next knot: the map is then monotone to
                    // the last bit, not only up to rounding.
                    while row.value + (next.start - row.start) * slope > next.value {
                        slope = slope.next_down();
                    }
                    self.put(i - 1, row.start, row.value, slope);
                    i += 1;
                }
                let (first, last) = (self.row(0), self.row(len - 1));
                self.put(len - 1, last.start, last.value, 0.0);
                let cells_per_unit = CELLS as f64 / (last.start as f64 - first.start as f64);
                if !(cells_per_unit as $t).is_finite() {
                    return Err(ConfigError::TooSteep { parameter: y_name, index: len - 1 });
                }
                self.origin = (first.start as f64 - 1.0 / cells_per_unit) as $t;
                self.cells_per_unit = cells_per_unit as $t;
                self.middle = (first.start as f64 / 2.0 + last.start as f64 / 2.0) as $t;
                (self.below, self.above, self.len) = (first.value, last.value, len as u32);
                // With any rounding, the last knot is inside and nothing below the table is.
                while self.cell(last.start) >= CELLS as i32 {
                    self.cells_per_unit = self.cells_per_unit.next_down();
                }
                let below = first.start.next_down();
                while self.cell(below) >= 0 {
                    // In steps that are not lost against the first knot, even where the origin itself is near zero.
                    let raised = self.origin + (first.start - below);
                    self.origin = if raised > self.origin { raised } else { self.origin.next_up() };
                }
                self.index(len);
                Ok(())
            }

            /// Fills the index in the arithmetic of `eval` itself. The cell is a monotone function of `x`, so
            /// every knot in an earlier cell lies at or below `x` for any rounding.
            #[allow(clippy::indexing_slicing)]
            const fn index(&mut self, len: usize) {
                let (mut cell, mut next) = (0, 1);
                while cell < CELLS {
                    let before = next - 1;
                    while next < len && self.cell(self.row(next).start) <= cell as i32 {
                        next += 1;
                    }
                    // The last row has no next one; the comparison with its own start leads to it as well.
                    let first = if before > len - 2 { len - 2 } else { before };
                    self.cells[cell] = if next - 1 - before > 1 { CROWDED } else { first as u8 };
                    cell += 1;
                }
            }

            /// The cell of `x`, as `eval` finds it: negative below the table.
            const fn cell(&self, x: $t) -> i32 {
                (((x - self.origin) * self.cells_per_unit) as i32).saturating_sub(1)
            }

            /// Whether some evaluations search, because knots crowd into one cell of the index.
            pub const fn is_crowded(&self) -> bool {
                let mut cell = 0;
                while cell < CELLS {
                    // Bounded by the array itself; `iter` is not constant yet.
                    #[allow(clippy::indexing_slicing)]
                    if self.cells[cell] == CROWDED {
                        return true;
                    }
                    cell += 1;
                }
                false
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
#[allow(clippy::float_cmp, clippy::indexing_slicing, reason = "exact on purpose")]
mod established;
