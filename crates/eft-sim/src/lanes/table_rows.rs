//! Look-up of eight numbers in the tables of their lanes.

use std::array;

use eft_core::{CELLS, Row};

use crate::lanes::Num;

/// The mark of a cell with several rows: all bits set, which no row's beginning has.
const CROWDED: u16 = u16::MAX;
/// Number of rows that contain each indexed row and the one after it.
const ROWS: usize = 64;
/// Distance between rows, in numbers.
const STRIDE: usize = 3 * 8;

/// Beginnings of the lanes' rows in their tables, or the mark of a crowded cell.
#[inline(always)]
pub(super) fn cells(mut row: impl FnMut(usize) -> u8) -> [u16; 8] {
    array::from_fn(|lane| {
        let row = usize::from(row(lane));
        // The row after it must exist as well.
        if row < ROWS - 1 { (row * STRIDE) as u16 } else { CROWDED }
    })
}

/// For each lane a cell of the index, by the place of its first entry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Index([u32; 8]);

impl Index {
    /// # Safety
    /// Each place is eight times a number below [`CELLS`].
    #[inline(always)]
    pub(super) unsafe fn new(places: [u32; 8]) -> Self {
        Self(places)
    }
}

/// [`Scalar::row`](eft_core::Scalar::row) of eight numbers.
///
/// # Safety
/// `S` is eight doubles, and `cells` are from [`cells`].
#[inline(always)]
pub(super) unsafe fn row<S: Num, const N: usize>(
    value: S,
    cells: &[[u16; 8]; CELLS],
    rows: &[Row<S>; N],
    Index(places): Index,
) -> Row<S> {
    let entries = cells.as_flattened();
    let mut first = [0; 8];
    let mut all = 0;
    for lane in 0..8 {
        // SAFETY: from each place of an `Index` there are eight entries.
        first[lane] = usize::from(unsafe { *entries.get_unchecked(places[lane] as usize + lane) });
        all |= first[lane];
    }
    if N < ROWS || all == usize::from(CROWDED) {
        // A copy and an array, because values behind a reference cannot stay in registers.
        let copy = value;
        let [start, value, slope] = Row::search(rows, &copy);
        return Row { start, value, slope };
    }
    let table: *const f64 = rows.as_ptr().cast();
    // One number per lane, at an offset from the first number of the lane's row.
    let column = |at: usize| {
        // SAFETY: there are at least ROWS rows, each of three times eight doubles in the order of its fields.
        // A row of the index is below ROWS − 1, and `at` below two rows.
        S::from_lanes(|lane| unsafe { *table.add(first[lane] + at + lane) })
    };
    let far = column(STRIDE);
    let here = value.lt(far);
    Row {
        start: S::select(here, column(0), far),
        value: S::select(here, column(8), column(STRIDE + 8)),
        slope: S::select(here, column(16), column(STRIDE + 16)),
    }
}
