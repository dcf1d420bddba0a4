//! What the constructor establishes of a table, which the proofs of the evaluation (`proofs/lemmas/tables.py`) are
//! given.

extern crate std;

use std::vec::Vec;

use super::*;

const N: usize = 21;

/// Numbers of all sizes, the same each time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    /// Increasing knots: even, crowded near the middle, or over many decades.
    fn knots(&mut self, count: usize, kind: usize) -> Vec<f64> {
        let mut at = -self.next();
        (0..count)
            .map(|n| {
                let step = match kind {
                    0 => 0.1,
                    1 => 1e-6 + 0.1 * libm::fabs(n as f64 - count as f64 / 2.0) * self.next(),
                    _ => libm::pow(10.0, -6.0 + 6.0 * self.next()),
                };
                at += step;
                at
            })
            .collect()
    }
}

macro_rules! holds {
    ($t:ty, $map:expr) => {{
        let map: &PiecewiseLinear<$t, N> = $map;
        let (len, rows) = (map.len as usize, &map.rows);
        let scale = map.cells_per_unit;
        assert!(scale > 0.0 && scale.is_finite() && map.origin.abs() <= 1e13);
        assert!(map.below.is_finite() && map.above.is_finite() && map.below <= map.above);
        for (n, row) in rows.iter().enumerate() {
            if n >= len {
                assert!(row.start == <$t>::INFINITY && row.value.abs() <= 1e12 && row.slope == 0.0);
                continue;
            }
            assert!(row.start.abs() <= 1e12 && row.value >= map.below && row.value <= map.above);
            assert!(row.slope >= 0.0 && row.slope.is_finite());
            if n + 1 < len {
                let next = &rows[n + 1];
                assert!(
                    row.start < next.start && row.value + row.slope * (next.start - row.start) <= next.value
                );
            } else {
                assert!(row.slope == 0.0);
            }
        }
        assert!(map.cell(rows[0].start.next_down()) < 0 && map.cell(rows[len - 1].start) < CELLS as i32);
        for (cell, &entry) in map.cells.iter().enumerate() {
            let first = entry as usize;
            if entry == CROWDED {
                continue;
            }
            assert!(first + 2 <= len, "cell {cell} leads beyond the last knot");
            assert!(first == 0 || map.cell(rows[first].start) < cell as i32);
            assert!(first + 2 >= len || map.cell(rows[first + 2].start) > cell as i32);
        }
    }};
}

#[test]
fn what_the_proofs_take_for_granted() {
    let mut random = Random(1);
    let mut tables = 0;
    for n in 0..3000 {
        let count = 2 + n % (N - 1);
        let (x, y) = (random.knots(count, n % 3), random.knots(count, (n / 3) % 3));
        let level = [0.0, 0.5, 1.0, 1.5][n % 4];
        if let Ok(mut map) = PiecewiseLinear::<f32, N>::new("x", &x, "y", &y) {
            holds!(f32, &map);
            if map.scale_to_limit(level, 1.0).is_ok() {
                holds!(f32, &map);
                assert!(map.below >= -1.0 && map.above <= 1.0);
                tables += 1;
            }
        }
        if let Ok(mut map) = PiecewiseLinear::<f64, N>::new("x", &x, "y", &y) {
            holds!(f64, &map);
            if map.scale_to_limit(level, 1.0).is_ok() {
                holds!(f64, &map);
                assert!(map.below >= -1.0 && map.above <= 1.0);
                tables += 1;
            }
        }
    }
    assert!(tables > 3000, "only {tables} tables");
}

/// Where a table is narrower than its index, rounding can put its last knot before the last cell.
#[test]
fn the_index_of_a_table_of_neighbouring_numbers_stays_within_it() {
    let mut early = 0;
    for first in [1.0_f32, -1.0, 1000.0] {
        let mut last = first;
        for _ in 0..60 {
            last = last.next_up();
            let x = [first, last].map(f64::from);
            let map = PiecewiseLinear::<f32, N>::new("x", &x, "y", &[0.0, 1e-9]).unwrap();
            holds!(f32, &map);
            early += u32::from(map.cell(last) < CELLS as i32 - 1);
        }
    }
    assert!(early > 0);
}
