//! What one-sided rows have at every particle, side by side: how fast their modes are, and whether they are there at all.

use crate::error::{Error, Result, SolverError};
use crate::scalar::length;
use crate::stencil::Side;

/// The row sums sum_q |A_pq| of d/dx_i at particle p from the left and from the right; 0 where a side has no row.
#[derive(Clone, Debug)]
pub(super) struct Sides<const D: usize> {
    sums: Vec<[[f64; 2]; D]>,
    /// Components up to this are rounding of the flow.
    still: f64,
}

/// Rounding of a velocity, in units of the fastest one: what sin(pi x) leaves at x = 1, some times over.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Components of a flow up to this are its rounding.
pub(super) fn still<const D: usize>(flow: impl Iterator<Item = [f64; D]>) -> f64 {
    ROUNDING * flow.map(|v| length(&v)).filter(|v| v.is_finite()).fold(0.0, f64::max)
}

impl<const D: usize> Sides<D> {
    /// The row sums that `sums(p)` gives, of a flow whose components up to `still` are rounding.
    pub(super) fn new(particles: usize, still: f64, sums: impl FnMut(usize) -> [[f64; 2]; D]) -> Self {
        Self { sums: (0..particles).map(sums).collect(), still }
    }

    /// The row sum of the side that the component v of an axis comes from.
    #[inline(always)]
    fn sum(&self, p: usize, axis: usize, v: f64) -> f64 {
        self.sums.get(p).map_or(0.0, |sums| sums[axis][usize::from(Side::upwind(v) == Some(Side::Right))])
    }

    /// Whether the component v of an axis comes from a side that has a row, or from none.
    #[inline(always)]
    pub(super) fn serve(&self, p: usize, axis: usize, v: f64) -> bool {
        v.abs() <= self.still || self.sum(p, axis, v) > 0.0
    }

    /// sum_i |v_i| times the row sum of the side it comes from.
    ///
    /// # Errors
    /// [`SolverError::NoUpstream`] where that side has no row.
    pub(super) fn rate(&self, p: usize, v: &[f64; D]) -> Result<f64> {
        let mut rate = 0.0;
        for (axis, &velocity) in v.iter().enumerate() {
            if !self.serve(p, axis, velocity) {
                return Err(Error::from(SolverError::NoUpstream { axis, velocity }).at(p));
            }
            rate += velocity.abs() * self.sum(p, axis, velocity);
        }
        Ok(rate)
    }
}
