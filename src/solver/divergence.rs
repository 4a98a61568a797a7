//! What is known of div v.

use super::coefficient::Velocity;
use super::term::Site;
use crate::error::{Error, Result, SolverError};

/// What a scene knows of div v. The unit type says that it is zero.
pub trait FlowDivergence<const D: usize>: Sync {
    /// What is kept a particle; nothing where the divergence is zero or a function.
    type Values: Default + Send + Sync;

    /// Whether it is zero everywhere.
    const ZERO: bool;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize;

    /// Computes it anew at time t, where that takes the velocity of all particles; `first` before the first step of a
    /// steady flow. `of(p, v)` is the divergence of the velocities v at particle p by the rows of the scheme.
    ///
    /// # Errors
    /// [`SolverError::Divergence`] naming the particle, with a value that is NaN where the scheme has no rows for it.
    fn refresh(
        &self,
        values: &mut Self::Values,
        site: &Site<D>,
        t: f64,
        velocity: &impl Velocity<D>,
        first: bool,
        of: impl Fn(usize, &[[f64; D]]) -> Option<f64>,
    ) -> Result<()> {
        let _ = (values, site, t, velocity, first, of);
        Ok(())
    }

    /// div v at particle p, which is at x; `None` where it is zero everywhere.
    fn at(&self, values: &Self::Values, p: usize, x: &[f64; D], t: f64) -> Option<f64>;
}

impl<const D: usize> FlowDivergence<D> for () {
    type Values = ();
    const ZERO: bool = true;
    const APPLIES: usize = 0;

    #[inline(always)]
    fn at(&self, (): &(), _: usize, _: &[f64; D], _: f64) -> Option<f64> {
        None
    }
}

/// div v as a function of x and t.
#[derive(Clone, Copy, Debug)]
pub struct GivenDivergence<F>(pub(super) F);

impl<F: Fn(&[f64; D], f64) -> f64 + Sync, const D: usize> FlowDivergence<D> for GivenDivergence<F> {
    type Values = ();
    const ZERO: bool = false;
    const APPLIES: usize = 0;

    #[inline(always)]
    fn at(&self, (): &(), _: usize, x: &[f64; D], t: f64) -> Option<f64> {
        Some(self.0(x, t))
    }
}

/// div v by the central rows of the scheme, sum_k sum_q w_k,pq (v_k,q - v_k,p): once for a steady velocity, otherwise
/// every stage.
///
/// An image behind a mirror has the velocity of its particle, normal component included. Beside mirror faces that the flow
/// does not cross, give the divergence as a function.
#[derive(Clone, Copy, Debug, Default)]
pub struct ComputedDivergence;

/// Velocities and their divergence, particle by particle.
#[derive(Clone, Debug, Default)]
pub struct DivergenceValues<const D: usize> {
    velocity: Vec<[f64; D]>,
    divergence: Vec<f64>,
}

impl<const D: usize> FlowDivergence<D> for ComputedDivergence {
    type Values = DivergenceValues<D>;
    const ZERO: bool = false;
    const APPLIES: usize = 1;

    fn refresh(
        &self,
        values: &mut DivergenceValues<D>,
        site: &Site<D>,
        t: f64,
        velocity: &impl Velocity<D>,
        first: bool,
        of: impl Fn(usize, &[[f64; D]]) -> Option<f64>,
    ) -> Result<()> {
        if velocity.steady() && !first {
            return Ok(());
        }
        let points = site.points();
        values.velocity.clear();
        values.velocity.extend(points.iter().enumerate().map(|(p, x)| velocity.at(p, x, t)));
        values.divergence.clear();
        for p in 0..points.len() {
            let value = if site.prescribed(p) { 0.0 } else { of(p, &values.velocity).unwrap_or(f64::NAN) };
            if !value.is_finite() {
                return Err(Error::from(SolverError::Divergence { value, t }).at(p));
            }
            values.divergence.push(value);
        }
        Ok(())
    }

    #[inline(always)]
    fn at(&self, values: &DivergenceValues<D>, p: usize, _: &[f64; D], _: f64) -> Option<f64> {
        values.divergence.get(p).copied()
    }
}
