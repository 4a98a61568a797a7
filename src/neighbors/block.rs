//! Rows of a few thousand targets in flat arrays.

use super::placed::{distance_squared, within};
use crate::error::Result;
use crate::particles::reserved;
use crate::stencil::Neighbor;

/// Targets in a block.
pub(super) const ROWS: usize = 4096;

/// Consecutive rows. Lists are made of blocks, so that none of their memory is ever moved or allocated twice.
#[derive(Clone, Debug)]
pub(super) struct Block<const D: usize> {
    ends: Vec<usize>,
    neighbors: Vec<u32>,
    separations: Vec<[f64; D]>,
    signs: Vec<i8>,
}

impl<const D: usize> Block<D> {
    pub(super) fn empty() -> Self {
        Self { ends: Vec::new(), neighbors: Vec::new(), separations: Vec::new(), signs: Vec::new() }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, neighbor: Neighbor<D>) {
        self.neighbors.push(neighbor.q as u32);
        self.separations.push(neighbor.separation);
        self.signs.push(neighbor.sign);
    }

    pub(super) fn end_row(&mut self) {
        self.ends.push(self.neighbors.len());
    }

    pub(super) fn total(&self) -> usize {
        self.neighbors.len()
    }

    /// A copy without spare room; the block itself is emptied and keeps its memory.
    pub(super) fn pack(&mut self) -> Result<Self> {
        let packed = Self {
            ends: exact(&self.ends)?,
            neighbors: exact(&self.neighbors)?,
            separations: exact(&self.separations)?,
            signs: exact(&self.signs)?,
        };
        self.ends.clear();
        self.neighbors.clear();
        self.separations.clear();
        self.signs.clear();
        Ok(packed)
    }

    /// The neighbors of one row with |separation| <= `cutoff`, or all of them; none where there is no such row.
    #[inline(always)]
    pub(super) fn row(&self, row: usize, cutoff: f64, whole: bool) -> impl Iterator<Item = Neighbor<D>> + '_ {
        let past = self.ends.get(row).copied().unwrap_or(0);
        let first = if row == 0 || past == 0 { 0 } else { self.ends[row - 1] };
        let limit = within(cutoff);
        let separations = self.separations[first..past].iter();
        let row = self.neighbors[first..past].iter().zip(separations).zip(&self.signs[first..past]);
        row.filter(move |((_, separation), _)| whole || distance_squared(separation) <= limit)
            .map(|((&q, &separation), &sign)| Neighbor { q: q as usize, separation, sign })
    }
}

pub(super) fn exact<T: Copy>(entries: &[T]) -> Result<Vec<T>> {
    let mut copy = reserved(entries.len())?;
    copy.extend_from_slice(entries);
    Ok(copy)
}
