//! The parts of a type of eight numbers that do not depend on the instructions.

/// Comparison of numbers and flags, and the number zero, by the module's `doubles` and `words`.
macro_rules! eight {
    () => {
        impl PartialEq for Eight {
            fn eq(&self, other: &Self) -> bool {
                doubles(self.0) == doubles(other.0)
            }
        }
        impl PartialEq for EightFlags {
            fn eq(&self, other: &Self) -> bool {
                words(self.0) == words(other.0)
            }
        }

        impl Default for Eight {
            #[inline(always)]
            fn default() -> Self {
                Self::splat(0.0)
            }
        }
    };
    // `Num::append` and `append_flags`.
    (append) => {
        #[inline(always)]
        fn append(to: &mut Vec<f64>, from: &[Self], lane: usize) {
            // SAFETY: a number has the size of eight doubles and a larger alignment, and every bit pattern is
            // valid.
            let doubles: &[[f64; 8]] =
                unsafe { core::slice::from_raw_parts(from.as_ptr().cast(), from.len()) };
            assert!(lane < 8);
            to.extend(doubles.iter().map(|lanes| lanes[lane]));
        }
    };
    // The types of `Scalar`, its lanes and its tables.
    (scalar) => {
        type Element = f64;
        type Mask = EightMask;
        type Flags = EightFlags;
        /// Beginning of each lane's row in its table, or the mark of a crowded cell.
        type Cell = [u16; 8];
        type Index = Index;
        const LANES: usize = 8;

        #[inline(always)]
        fn from_lanes(mut f: impl FnMut(usize) -> f64) -> Self {
            let mut lanes = [0.0; 8];
            for (i, lane) in lanes.iter_mut().enumerate() {
                *lane = f(i);
            }
            Self(from_doubles(lanes))
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> f64 {
            doubles(self.0).get(lane).copied().unwrap_or(0.0)
        }
        #[inline(always)]
        fn cell_from_lanes(f: impl FnMut(usize) -> u8) -> [u16; 8] {
            table_rows::cells(f)
        }
        #[inline(always)]
        fn row<const N: usize>(
            self,
            cells: &[[u16; 8]; CELLS],
            rows: &[Row<Self>; N],
            cell: Index,
        ) -> Row<Self> {
            // SAFETY: the type is eight doubles, and its cells are from `table_rows`.
            unsafe { table_rows::row(self, cells, rows, cell) }
        }
    };
}

pub(super) use eight;
