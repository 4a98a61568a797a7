//! Stored rows as the matrix they are.

use super::csr::CsrMatrix;
use crate::apply::{Field, Rows};
use crate::error::{MultiIndexError, Result};
use crate::operator::Outputs;

impl<S: Outputs, T: Field> Rows<S, T> {
    /// The matrix L of output k: (L f)_p = sum_q L_pq f_q.
    ///
    /// At particles L_pq sums the weights of all images of q, and L_pp besides holds d_p - sum_q w_pq; elsewhere
    /// L_pq = w_pq. Columns ascend, every particle has a diagonal entry. Sums are taken in `f64` and rounded to `T` once,
    /// so L f is [`apply`](crate::Apply::apply) to rounding; a constant, which `apply` annihilates exactly, leaves rounding.
    ///
    /// # Errors
    /// [`MultiIndexError::Output`] for an output that does not exist; [`LinearError::Entry`](crate::LinearError::Entry)
    /// naming the row where a sum is not finite in `T`; [`ParticleError::Memory`](crate::ParticleError::Memory) where
    /// there is no room.
    pub fn to_csr(&self, k: usize) -> Result<CsrMatrix<T>> {
        if k >= S::K {
            return Err(MultiIndexError::Output { output: k, outputs: S::K }.into());
        }
        let raw = self.raw();
        let mut matrix = CsrMatrix::empty(self.sources(), self.targets(), raw.columns.len() + self.targets())?;
        let mut entries: Vec<(u32, f64)> = Vec::new();
        let value = |w: &S::Of<T>| -> f64 { w.as_ref()[k].as_() };
        for (p, ends) in raw.offsets.windows(2).enumerate() {
            let range = ends[0]..ends[1];
            entries.clear();
            entries.extend(raw.columns[range.clone()].iter().copied().zip(raw.weights[range].iter().map(value)));
            if let Some(center) = self.center(p) {
                let own = raw.diagonal.get(p).map_or(0.0, value);
                entries.push((center as u32, entries.iter().fold(own, |sum, entry| sum - entry.1)));
            }
            // The sort is stable, so the images of a source keep their order.
            entries.sort_by_key(|entry| entry.0);
            entries.dedup_by(|next, sum| {
                let same = next.0 == sum.0;
                if same {
                    sum.1 += next.1;
                }
                same
            });
            matrix.push_row(entries.iter().map(|&(q, sum)| (q, T::lift(sum))))?;
        }
        Ok(matrix)
    }
}
