//! Which entries stand in which cell: a dense table where cells are few, a sorted one where they are many.

use std::ops::Range;

use super::grid::Grid;
use crate::error::Result;
use crate::particles::reserved;

/// Entries sorted by cell; cells of a run along the last axis are neighbors in memory.
#[derive(Clone, Debug)]
pub(super) enum Table<const D: usize> {
    /// starts[number of the cell] with the last axis fastest.
    Dense { strides: [usize; D], starts: Vec<u32> },
    /// Occupied cells in ascending order and where each starts; one start more than cells.
    Sparse { cells: Vec<[i64; D]>, starts: Vec<u32> },
}

/// Whether a table of this many cells is worth its memory.
pub(super) fn is_dense(cells: f64, entries: usize) -> bool {
    cells <= 4.0 * entries as f64 + 64.0
}

impl<const D: usize> Table<D> {
    /// Sorts the entries by cell; returns the table and, for every entry, the slot it goes to.
    ///
    /// Entries of one cell keep their order.
    pub(super) fn build<'a>(
        grid: &Grid<D>,
        entries: impl Iterator<Item = &'a [f64; D]> + Clone,
        count: usize,
    ) -> Result<(Self, Vec<u32>)> {
        if is_dense(grid.total(), count) {
            Self::dense(grid, entries, count)
        } else {
            Self::sparse(grid, entries, count)
        }
    }

    fn dense<'a>(
        grid: &Grid<D>,
        entries: impl Iterator<Item = &'a [f64; D]>,
        count: usize,
    ) -> Result<(Self, Vec<u32>)> {
        let mut strides = [1_usize; D];
        for axis in (0..D - 1).rev() {
            strides[axis] = strides[axis + 1] * grid.counts[axis + 1] as usize;
        }
        let total = strides[0] * grid.counts[0] as usize;
        let mut starts: Vec<u32> = reserved(total + 1)?;
        starts.resize(total + 1, 0);
        let mut slots: Vec<u32> = reserved(count)?;
        for point in entries {
            let number = number(&grid.cell(point), &strides);
            slots.push(number as u32);
            starts[number + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // Placing advances every start to that of the next cell; they are moved back afterwards.
        for slot in &mut slots {
            let start = &mut starts[*slot as usize];
            *slot = *start;
            *start += 1;
        }
        starts.copy_within(..total, 1);
        starts[0] = 0;
        Ok((Self::Dense { strides, starts }, slots))
    }

    fn sparse<'a>(
        grid: &Grid<D>,
        entries: impl Iterator<Item = &'a [f64; D]>,
        count: usize,
    ) -> Result<(Self, Vec<u32>)> {
        let mut sorted: Vec<([i64; D], u32)> = reserved(count)?;
        sorted.extend(entries.zip(0..).map(|(point, entry)| (grid.cell(point), entry)));
        sorted.sort_unstable();
        let mut slots: Vec<u32> = reserved(count)?;
        slots.resize(count, 0);
        let (mut cells, mut starts) = (reserved(count)?, reserved(count + 1)?);
        for (slot, &(cell, entry)) in sorted.iter().enumerate() {
            slots[entry as usize] = slot as u32;
            if cells.last() != Some(&cell) {
                cells.push(cell);
                starts.push(slot as u32);
            }
        }
        starts.push(count as u32);
        Ok((Self::Sparse { cells, starts }, slots))
    }

    /// Calls `visit` with the slots of every run of cells that may hold points within `radius` of `point`.
    #[inline(always)]
    pub(super) fn runs(&self, grid: &Grid<D>, point: &[f64; D], radius: f64, mut visit: impl FnMut(Range<usize>)) {
        match self {
            Self::Dense { strides, starts } => grid.runs(point, radius, |cell, last| {
                let first = number(cell, strides);
                let past = first + (last - cell[D - 1]) as usize + 1;
                visit(starts[first] as usize..starts[past] as usize);
            }),
            // A radius of very many cells (the slack of far outliers) is not worth walking.
            Self::Sparse { cells, starts } if !(grid.run_count(point, radius) <= cells.len() as f64) => {
                visit(0..starts[cells.len()] as usize);
            }
            Self::Sparse { cells, starts } => {
                let mut cursor = 0;
                grid.runs(point, radius, |cell, last| {
                    cursor += cells[cursor..].partition_point(|other| other < cell);
                    let first = cursor;
                    while cells.get(cursor).is_some_and(|c| c[..D - 1] == cell[..D - 1] && c[D - 1] <= last) {
                        cursor += 1;
                    }
                    visit(starts[first] as usize..starts[cursor] as usize);
                });
            }
        }
    }
}

#[inline(always)]
fn number<const D: usize>(cell: &[i64; D], strides: &[usize; D]) -> usize {
    let mut number = 0;
    for axis in 0..D {
        number += cell[axis] as usize * strides[axis];
    }
    number
}
