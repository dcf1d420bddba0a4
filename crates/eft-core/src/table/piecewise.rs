//! An increasing piecewise linear map, evaluated without a divide and in bounded time.
//!
//! An index of equal cells gives the row to start from, and one comparison decides between it and the next. Where
//! knots crowd into one cell, the rows are searched by halving. Beyond its ends the map is constant.

mod construction;

use crate::integrity::integrity;
use core::array;

use crate::number::{CELLS, Mask, Real, Row, Scalar};

integrity!(Row<T>: start, value, slope);

/// A strictly increasing map through up to `N` knots.
// The rows come first: their address is then the table's own.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct PiecewiseLinear<S: Scalar, const N: usize> {
    rows: [Row<S>; N],
    cells: [S::Cell; CELLS],
    origin: S,
    cells_per_unit: S,
    middle: S,
    below: S,
    above: S,
    len: u32,
}
integrity!(PiecewiseLinear<T, N>: rows, cells, origin, cells_per_unit, middle, below, above, len);

impl<S: Scalar, const N: usize> PiecewiseLinear<S, N> {
    /// The value at `x`, held constant beyond the ends.
    ///
    /// # NaN
    /// NaN reads the lower end: the result is finite for every input.
    ///
    /// # Cost
    /// Five additions and multiplications and two comparisons; where knots are crowded as many comparisons as `N` has
    /// bits, for any map.
    #[inline(always)]
    pub fn eval(&self, x: S) -> S {
        self.eval_flagged(x).0
    }

    /// As [`eval`](Self::eval), and where `x` lies at or beyond an end (to within rounding; NaN does).
    #[inline(always)]
    pub fn eval_flagged(&self, x: S) -> (S, S::Mask) {
        let (value, _, outside) = self.eval_with_slope(x);
        (value, outside)
    }

    /// As [`eval_flagged`](Self::eval_flagged), the slope of the segment between the value and the flag.
    #[inline(always)]
    pub fn eval_with_slope(&self, x: S) -> (S, S, S::Mask) {
        let (cell, inside) = ((x - self.origin) * self.cells_per_unit).cell();
        if inside.all() {
            let row = x.row(&self.cells, &self.rows, cell);
            return (row.at(x), row.slope, !inside);
        }
        let (outside, level) = (S::select(x.gt(self.middle), self.above, self.below), S::splat(0.0));
        if !inside.any() {
            return (outside, level, !inside);
        }
        let row = x.row(&self.cells, &self.rows, cell);
        (S::select(inside, row.at(x), outside), S::select(inside, row.slope, level), !inside)
    }

    /// Maps of single rigs in lanes: lane `i` is `lanes[i]`.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a PiecewiseLinear<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        let row = |i: usize, n: usize| lane(i).rows.get(n).copied().unwrap_or_default();
        Self {
            origin: S::from_lanes(|i| lane(i).origin),
            cells_per_unit: S::from_lanes(|i| lane(i).cells_per_unit),
            middle: S::from_lanes(|i| lane(i).middle),
            below: S::from_lanes(|i| lane(i).below),
            above: S::from_lanes(|i| lane(i).above),
            len: (0..S::LANES).fold(0, |most, i| if lane(i).len > most { lane(i).len } else { most }),
            rows: array::from_fn(|n| Row {
                start: S::from_lanes(|i| row(i, n).start),
                value: S::from_lanes(|i| row(i, n).value),
                slope: S::from_lanes(|i| row(i, n).slope),
            }),
            cells: array::from_fn(|c| S::cell_from_lanes(|i| lane(i).cells.get(c).copied().unwrap_or(0))),
        }
    }
}

impl<S: Real, const N: usize> PiecewiseLinear<S, N> {
    /// The knots: abscissae and values.
    pub fn knots(&self) -> impl Iterator<Item = (S, S)> + '_ {
        self.rows.iter().take(self.len as usize).map(|row| (row.start, row.value))
    }
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::number::{LaneMask, Lanes, search};

    #[test]
    fn beyond_its_ends_a_map_is_level_in_every_lane() {
        let map = PiecewiseLinear::<f64, 3>::new("x", &[-1.0, 0.0, 2.0], "y", &[-3.0, 0.0, 1.0]).unwrap();
        let x = [-1.5, -0.5, 1.0, 2.5];
        let (values, slopes, outside) =
            ([-3.0, -1.5, 0.5, 1.0], [0.0, 3.0, 0.5, 0.0], [true, false, false, true]);
        for (n, x) in x.into_iter().enumerate() {
            assert_eq!(map.eval_with_slope(x), (values[n], slopes[n], outside[n]));
        }
        let wide = PiecewiseLinear::<Lanes<f64, 4>, 3>::pack(&|_| &map);
        assert_eq!(wide.eval_with_slope(Lanes(x)), (Lanes(values), Lanes(slopes), LaneMask(outside)));
        assert_eq!(PiecewiseLinear::<f64, 3>::pack(&|_| &map), map);
    }

    /// The row that is found, and the number of rows that were compared.
    fn searched<const N: usize>(starts: [f32; N], x: f32) -> (f32, u32) {
        let looked = core::cell::Cell::new(0);
        let start = |start: &f32| {
            looked.set(looked.get() + 1);
            *start
        };
        (*search(&starts, start, x).unwrap(), looked.get())
    }

    #[test]
    fn a_search_takes_as_many_steps_as_the_capacity_has_bits() {
        let starts: [f32; 255] = array::from_fn(|n| if n < 200 { n as f32 } else { f32::INFINITY });
        for n in 0..200_u16 {
            let x = f32::from(n);
            assert_eq!(searched(starts, x), (x, 8));
            assert_eq!(searched(starts, x + 0.5), (x, 8));
        }
        assert_eq!((searched(starts, 1e9), searched(starts, -1.0)), ((199.0, 8), (0.0, 8)));
        // As after a memory fault: in no order, and without an end.
        let broken = array::from_fn::<_, 255, _>(|n| (n * 89 % 255) as f32);
        for x in [f32::NAN, f32::NEG_INFINITY, 0.0, 100.0, f32::MAX] {
            assert_eq!(searched(broken, x).1, 8);
        }
        assert_eq!(searched([5.0], 1.0), (5.0, 0));
        assert_eq!(searched([5.0, 6.0, 7.0], 6.5), (6.0, 2));
    }
}
