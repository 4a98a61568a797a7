//! Rows whose length is not the one counted: those of a widened support, and those left empty.

use super::Field;
use super::rows::Rows;
use crate::error::{ParticleError, Result};
use crate::operator::Outputs;

/// A row that does not fit the room counted for it.
pub(super) struct Stray<W> {
    pub(super) p: usize,
    pub(super) columns: Vec<u32>,
    pub(super) weights: Vec<W>,
}

impl<S: Outputs, T: Field> Rows<S, T> {
    /// Gives every stray row its room; `strays` are in the order of their targets. Works in place, because doubling all
    /// rows for a few would double the peak memory.
    ///
    /// # Errors
    /// [`ParticleError::Memory`] where the longer rows do not fit; the rows are then as they were.
    pub(super) fn splice(&mut self, strays: &[Stray<S::Of<T>>]) -> Result<()> {
        if strays.is_empty() {
            return Ok(());
        }
        let added: usize = strays.iter().map(|stray| stray.columns.len()).sum();
        let room: usize = strays.iter().map(|stray| self.offsets[stray.p + 1] - self.offsets[stray.p]).sum();
        let more = added.saturating_sub(room);
        let memory = |_| ParticleError::Memory { count: more };
        self.columns.try_reserve_exact(more).map_err(memory)?;
        self.weights.try_reserve_exact(more).map_err(memory)?;

        // Forward: every stray loses the room it has.
        let mut coming = strays.iter().map(|stray| stray.p).peekable();
        let (mut from, mut kept) = (0, 0);
        for p in 0..self.offsets.len() - 1 {
            let past = self.offsets[p + 1];
            if coming.next_if_eq(&p).is_none() {
                self.columns.copy_within(from..past, kept);
                self.weights.copy_within(from..past, kept);
                kept += past - from;
            }
            from = past;
            self.offsets[p + 1] = kept;
        }

        // Backward: every stray gets the room it needs.
        let zero = S::ZERO.map(T::lift);
        self.columns.resize(kept + added, 0);
        self.weights.resize(kept + added, zero);
        let (mut coming, mut to) = (strays.iter().rev().peekable(), kept + added);
        for p in (0..self.offsets.len() - 1).rev() {
            let row = self.offsets[p]..self.offsets[p + 1];
            self.offsets[p + 1] = to;
            if let Some(stray) = coming.next_if(|stray| stray.p == p) {
                to -= stray.columns.len();
                self.columns[to..][..stray.columns.len()].copy_from_slice(&stray.columns);
                self.weights[to..][..stray.weights.len()].copy_from_slice(&stray.weights);
            } else {
                to -= row.len();
                self.columns.copy_within(row.clone(), to);
                self.weights.copy_within(row, to);
            }
        }
        Ok(())
    }
}
