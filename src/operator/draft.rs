//! A row while it is made: the stencil that goes into a method, and what comes out.

use num_traits::AsPrimitive;

use super::expression::Outputs;
use super::row_report::RowReport;
use crate::error::{OperatorError, Result};
use crate::stencil::Stencil;

/// One target on its way through a [`Method`](super::Method).
#[derive(Clone, Debug)]
pub struct Draft<const D: usize, S> {
    /// The neighbors.
    pub stencil: Stencil<D>,
    /// Their weights w_pq, as many as neighbors.
    pub weights: Vec<S>,
    /// The diagonal d_p.
    pub diagonal: S,
    /// What is known of the row, or why there is none.
    pub report: Result<RowReport>,
}

impl<const D: usize, S: Outputs> Default for Draft<D, S> {
    fn default() -> Self {
        let (stencil, weights, diagonal) = (Stencil::default(), Vec::new(), S::ZERO);
        let report = Ok(RowReport::of(&stencil, &weights, &diagonal));
        Self { stencil, weights, diagonal, report }
    }
}

impl<const D: usize, S: Outputs> Draft<D, S> {
    /// Makes room for the weights of the stencil it holds, all zero.
    pub fn clear(&mut self) {
        self.weights.clear();
        self.weights.resize(self.stencil.len(), S::ZERO);
        self.diagonal = S::ZERO;
    }

    /// Refuses weights that are not finite.
    ///
    /// # Errors
    /// [`OperatorError::Weight`] naming the first such neighbor.
    pub fn finite(&self) -> Result<()> {
        finite(&self.stencil, self.weights.iter().map(S::as_slice), self.diagonal.as_slice())
    }
}

/// Refuses weights that are not finite: those of a method, or those that a shorter type cannot hold.
pub(crate) fn finite<'a, const D: usize, T: AsPrimitive<f64>>(
    row: &Stencil<D>,
    weights: impl Iterator<Item = &'a [T]>,
    diagonal: &[T],
) -> Result<()> {
    let bad = |w: &[T]| w.iter().map(|w| w.as_()).find(|w| !w.is_finite());
    let pair = row.sources().iter().zip(weights).find_map(|(&q, w)| Some((q as usize, bad(w)?)));
    let own = || Some((row.center().unwrap_or(row.target()), bad(diagonal)?));
    match pair.or_else(own) {
        Some((q, weight)) => Err(OperatorError::Weight { q, weight }.into()),
        None => Ok(()),
    }
}
