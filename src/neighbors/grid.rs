//! Cells over a bounding box, numbered so that rounding can never hide a neighbor.

use crate::error::{NeighborError, Result};

/// Cell i of an axis holds the coordinates from lower + i * width on (axis by axis). Numbers are monotone in the
/// coordinate whatever the rounding, so that a range of coordinates is always inside the range of its cells.
#[derive(Clone, Debug)]
pub(super) struct Grid<const D: usize> {
    lower: [f64; D],
    widths: [f64; D],
    inverses: [f64; D],
    pub(super) counts: [i64; D],
    /// What the search radius is widened by: more than all roundings of ghost positions and cell faces together.
    pub(super) slack: f64,
}

/// Largest number of cells along an axis: above it f64 cannot number them exactly.
const CELLS_HIGH: f64 = (1_u64 << 53) as f64;

impl<const D: usize> Grid<D> {
    /// Cells of this width over the box from `lower` to `upper` (infinite and reversed for an empty set);
    /// `magnitude` bounds every coordinate that is or will be asked for.
    pub(super) fn new(lower: [f64; D], upper: [f64; D], widths: [f64; D], cutoff: f64, magnitude: f64) -> Result<Self> {
        let mut counts = [1; D];
        let mut finite = [0.0; D];
        for axis in 0..D {
            let extent = upper[axis] - lower[axis];
            if !(extent >= 0.0) {
                continue;
            }
            let cells = (extent * (1.0 / widths[axis])).floor() + 1.0;
            if !(cells <= CELLS_HIGH) {
                return Err(NeighborError::Cells { axis, cells, limit: CELLS_HIGH }.into());
            }
            counts[axis] = cells as i64;
            finite[axis] = lower[axis];
        }
        let inverses = widths.map(|width| 1.0 / width);
        Ok(Self { lower: finite, widths, inverses, counts, slack: Self::slack(magnitude, cutoff) })
    }

    /// What all roundings together can hide at most.
    pub(super) fn slack(magnitude: f64, cutoff: f64) -> f64 {
        // A ghost is off by 2 roundings, its separation by 3, a cell face by 4, each of at most 4 magnitudes:
        // 18 eps per axis. The square root of D axes is below D.
        32.0 * f64::EPSILON * (magnitude + cutoff) * D as f64
    }

    /// The number of cells, infinite where it overflows.
    pub(super) fn total(&self) -> f64 {
        self.counts.iter().map(|&count| count as f64).product()
    }

    #[inline(always)]
    pub(super) fn number(&self, axis: usize, coordinate: f64) -> i64 {
        // The cast saturates, so that any coordinate ends in the nearest cell.
        (((coordinate - self.lower[axis]) * self.inverses[axis]) as i64).clamp(0, self.counts[axis] - 1)
    }

    #[inline(always)]
    pub(super) fn cell(&self, point: &[f64; D]) -> [i64; D] {
        std::array::from_fn(|axis| self.number(axis, point[axis]))
    }

    /// A lower bound on the squared distance along one axis from a coordinate to any particle of a cell.
    #[inline(always)]
    fn gap_squared(&self, axis: usize, cell: i64, coordinate: f64) -> f64 {
        // An edge cell also holds what the clamp put there, but nothing outside the bounding box exists.
        let from = self.lower[axis] + cell as f64 * self.widths[axis];
        let gap = (from - coordinate).max(coordinate - (from + self.widths[axis])) - self.slack;
        let gap = gap.max(0.0);
        gap * gap
    }

    /// How many runs [`runs`](Self::runs) looks at.
    pub(super) fn run_count(&self, point: &[f64; D], radius: f64) -> f64 {
        let reach = radius + self.slack;
        let along = |axis: usize| self.number(axis, point[axis] + reach) - self.number(axis, point[axis] - reach) + 1;
        (0..D - 1).map(|axis| along(axis) as f64).product()
    }

    /// Calls `visit(cell, last)` for every run of cells from `cell` to the same cell with `last` on the last axis
    /// that may hold points within `radius` of `point`, in ascending order.
    #[inline(always)]
    pub(super) fn runs(&self, point: &[f64; D], radius: f64, mut visit: impl FnMut(&[i64; D], i64)) {
        let reach = radius + self.slack;
        let limit = reach * reach;
        let low: [i64; D] = std::array::from_fn(|axis| self.number(axis, point[axis] - reach));
        let high: [i64; D] = std::array::from_fn(|axis| self.number(axis, point[axis] + reach));
        let mut cell = low;
        if D == 1 {
            return visit(&cell, high[0]);
        }
        // All axes but the last two turn like an odometer; the last but one is a plain loop, where the time goes.
        let (outer, inner) = (D - 2, D - 2);
        loop {
            let mut gap = 0.0;
            for axis in 0..outer {
                gap += self.gap_squared(axis, cell[axis], point[axis]);
            }
            for number in low[inner]..=high[inner] {
                let chord = limit - (gap + self.gap_squared(inner, number, point[inner]));
                if chord >= 0.0 {
                    cell[inner] = number;
                    // Slack again, for the rounding of the root and the ends.
                    let half = chord.sqrt() + self.slack;
                    cell[D - 1] = self.number(D - 1, point[D - 1] - half);
                    visit(&cell, self.number(D - 1, point[D - 1] + half));
                }
            }
            let Some(axis) = (0..outer).rev().find(|&axis| cell[axis] < high[axis]) else {
                return;
            };
            cell[axis] += 1;
            cell[axis + 1..outer].copy_from_slice(&low[axis + 1..outer]);
        }
    }
}
