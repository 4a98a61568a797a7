//! Stored rows seen from outside: their arrays, without a copy.

use super::Field;
use super::rows::{Centers, Rows};
use crate::operator::Outputs;

/// The arrays of stored rows, borrowed: compressed rows of *differences*.
///
/// With the pairs i in `offsets[p]..offsets[p + 1]`, q = `columns[i]` and w = `weights[i]`,
/// out_p = d_p f_p + sum_i w (f_q - f_p) where target p is a source ([`Rows::center`]), and
/// out_p = sum_i w f_q where it is none. So this is not the matrix: the diagonal lacks -sum_i w, which is
/// [`Rows::to_csr`]'s to add. Pairs stand in the order of summation, and a source stands once for each of its images.
///
/// For one output, `weights.as_flattened()` is a slice of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawRows<'a, W> {
    /// Where each row begins, and where the last one ends: one more than targets.
    pub offsets: &'a [usize],
    /// The sources q, pair by pair.
    pub columns: &'a [u32],
    /// The weights w_pq, K values a pair.
    pub weights: &'a [W],
    /// The diagonal d_p, K values a target; empty where all are zero.
    pub diagonal: &'a [W],
}

impl<S: Outputs, T: Field> Rows<S, T> {
    /// The arrays of the rows, without a copy.
    ///
    /// ```
    /// use parops::{CellList, Domain, Laplacian, Particles, Pse, Result};
    /// # fn main() -> Result<()> {
    /// let particles = Particles::lattice([0.0], [1.0], [64])?;
    /// let laplacian = Pse::new(Laplacian::<1>, 2, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
    /// let torus = Domain::periodic([0.0], [1.0])?;
    /// let rows = laplacian.assemble(&CellList::build(&particles, &torus, laplacian.cutoff())?)?;
    /// let raw = rows.raw();
    /// let sum: f64 = raw.weights.as_flattened()[raw.offsets[3]..raw.offsets[4]].iter().sum();
    /// let own = rows.to_csr(0)?.triplets().find(|entry| (entry.0, entry.1) == (3, 3)).unwrap().2;
    /// assert!((own + sum).abs() < 1e-12 * sum);
    /// # Ok(())
    /// # }
    /// ```
    pub fn raw(&self) -> RawRows<'_, S::Of<T>> {
        RawRows { offsets: &self.offsets, columns: &self.columns, weights: &self.weights, diagonal: &self.diagonal }
    }

    /// The source that is target p; `None` where it is none, and beyond the targets.
    pub fn center(&self, p: usize) -> Option<usize> {
        match &self.centers {
            Centers::Same => (p < self.targets()).then_some(p),
            Centers::Each(centers) => centers.get(p)?.map(|q| q as usize),
        }
    }
}
