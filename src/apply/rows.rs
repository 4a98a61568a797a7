//! Stored rows: the weights of any method, for any number of applications.

use super::blocks::each_row;
use super::sweep::Sweep;
use super::{Apply, Field, Report, check, check_results, scalars};
use crate::error::{ApplyError, Result};
use crate::operator::Outputs;

/// The stored result of any method, one row a target,
/// out_p = d_p f_p + sum_q w_pq (f_q - f_p) at particles, out_p = sum_q w_pq f_q elsewhere.
///
/// `S` is `[f64; K]` for K outputs, `T` the type of fields and weights. Memory: per pair 4 bytes and K values, per row
/// 8 bytes and, where any d_p is not zero, K values. Made by `assemble` of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows<S: Outputs = [f64; 1], T: Field = f64> {
    pub(super) offsets: Vec<usize>,
    pub(super) columns: Vec<u32>,
    pub(super) weights: Vec<S::Of<T>>,
    /// Empty where all are zero.
    pub(super) diagonal: Vec<S::Of<T>>,
    pub(super) centers: Centers,
    pub(super) sources: usize,
    pub(super) generation: u64,
    pub(super) report: Report,
}

/// One stored row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<'a, W> {
    /// The neighbors q, in the order of summation; a source stands once for each of its images within the cutoff.
    pub sources: &'a [u32],
    /// Their weights w_pq.
    pub weights: &'a [W],
    /// The diagonal d_p.
    pub diagonal: W,
}

/// Which source is target p.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Centers {
    /// Source p.
    Same,
    /// The one named, or none.
    Each(Vec<Option<u32>>),
}

impl Centers {
    #[inline(always)]
    pub(super) fn get(&self, p: usize) -> Option<usize> {
        match self {
            Self::Same => Some(p),
            Self::Each(centers) => centers[p].map(|q| q as usize),
        }
    }
}

impl<S: Outputs, T: Field> Rows<S, T> {
    /// Number of targets.
    pub fn targets(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        self.sources
    }

    /// What the build found.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Row p; `None` beyond the targets.
    pub fn row(&self, p: usize) -> Option<Row<'_, S::Of<T>>> {
        let range = *self.offsets.get(p)?..*self.offsets.get(p + 1)?;
        let diagonal = self.diagonal.get(p).copied().unwrap_or_else(|| S::ZERO.map(T::lift));
        Some(Row { sources: &self.columns[range.clone()], weights: &self.weights[range], diagonal })
    }

    /// Bytes held by the rows.
    pub fn bytes(&self) -> usize {
        let centers = match &self.centers {
            Centers::Same => 0,
            Centers::Each(centers) => size_of_val(centers.as_slice()),
        };
        size_of_val(self.offsets.as_slice())
            + size_of_val(self.columns.as_slice())
            + size_of_val(self.weights.as_slice())
            + size_of_val(self.diagonal.as_slice())
            + centers
    }

    /// Checks that the rows were made for this generation of a particle set.
    ///
    /// # Errors
    /// [`ApplyError::Stale`] where they were not.
    pub fn validate(&self, generation: u64) -> Result<()> {
        if self.generation == generation {
            Ok(())
        } else {
            Err(ApplyError::Stale { rows: self.generation, set: generation }.into())
        }
    }
}

/// A stored row, ready to be summed.
pub(super) struct Stored<'a, T, const K: usize> {
    sources: &'a [u32],
    weights: &'a [[T; K]],
    diagonal: Option<[T; K]>,
    center: Option<usize>,
}

impl<T: Field, const K: usize> Sweep<T, K> for Stored<'_, T, K> {
    #[inline(always)]
    fn center(&self) -> Option<usize> {
        self.center
    }

    #[inline(always)]
    fn diagonal(&self) -> Option<[T; K]> {
        self.diagonal
    }

    #[inline(always)]
    fn pairs(&self) -> impl Iterator<Item = (usize, [T; K])> {
        self.sources.iter().zip(self.weights).map(|(&q, &w)| (q as usize, w))
    }
}

impl<const K: usize, T: Field> Rows<[f64; K], T> {
    #[inline(always)]
    pub(super) fn stored(&self, p: usize) -> Stored<'_, T, K> {
        let range = self.offsets[p]..self.offsets[p + 1];
        Stored {
            sources: &self.columns[range.clone()],
            weights: &self.weights[range],
            diagonal: self.diagonal.get(p).copied(),
            center: self.centers.get(p),
        }
    }

    /// All K outputs of a scalar field, `out[p][k]` = (L_k f)_p.
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn apply_all(&self, f: &[T], out: &mut [[T; K]]) -> Result<()> {
        check(scalars(f), self.sources, out, self.targets())?;
        each_row(out, |p| self.stored(p).all(f));
        check_results(out)
    }

    /// The contraction with a vector field, `out[p]` = sum_k (L_k f_k)_p: the divergence, for gradient rows.
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn apply_dot(&self, f: &[[T; K]], out: &mut [T]) -> Result<()> {
        check(f, self.sources, out, self.targets())?;
        each_row(out, |p| self.stored(p).dot(f));
        check_results(scalars(out))
    }

    /// The derivative along a vector per target, `out[p]` = sum_k v_k(p) (L_k f)_p: v . grad f, for gradient rows.
    ///
    /// # Errors
    /// As [`Apply::apply`]; [`ApplyError::Input`] also where `v` does not hold one vector per target, and
    /// [`ApplyError::Field`] where one is not finite.
    pub fn apply_along(&self, v: &[[T; K]], f: &[T], out: &mut [T]) -> Result<()> {
        check(scalars(f), self.sources, out, self.targets())?;
        check(v, self.targets(), out, self.targets())?;
        each_row(out, |p| self.stored(p).along(&v[p], f));
        check_results(scalars(out))
    }
}

impl<T: Field> Apply<T> for Rows<[f64; 1], T> {
    fn targets(&self) -> usize {
        self.offsets.len() - 1
    }

    fn sources(&self) -> usize {
        self.sources
    }

    fn apply(&self, f: &[T], out: &mut [T]) -> Result<()> {
        self.apply_all(f, out.as_chunks_mut().0)
    }
}
