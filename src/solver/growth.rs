//! Whether modes of a scene grow, whatever the step.

use super::fields::Fields;
use super::moving::{Moving, MovingScene};
use super::policy::GrowthPolicy;
use super::scene::Scene;
use super::semi_discrete::SemiDiscrete;
use crate::error::{ErrorKind, Limit, LinearError, Result, SolverError};
use crate::linear::{Spectrum, SpectrumEstimator};

/// The largest legal growth rate over the spectral radius, for `f64` rows; for `f32` what their rounding moves eigenvalues
/// by, if that is more.
const LIMIT: f64 = 1e-8;

/// How far right of the spectrum estimates mostly end amid the imaginary axis that are far from converged, over the radius
/// (0.003 at most, in two of 90 cases); their error where that is less.
const RESOLUTION: f64 = 0.002;

/// A residual above this, over the radius, is far from converged: the error it allows is no measure of where estimates end.
const BLURRED: f64 = 1e-6;

/// Growth over max div v that is legal beside a term u div v: no field is annihilated there, and truncation moves the
/// eigenvalue of the one that is at rest, v u = const, from zero to either side.
pub(super) const COMPRESSED: f64 = 0.1;

/// Vectors of the search where a term oscillates: amid the imaginary axis fewer miss growth.
const VECTORS: usize = 64;

/// Products after which the estimate is taken as it is.
const MOST: usize = 1000;

/// The same on a set that has moved: modes that are not found in so few grow too slowly to matter before the set is another.
const ON_THE_WAY: usize = 96;

/// Vectors of that search, few enough for the restarts without which it does not settle.
const FEW_VECTORS: usize = 24;

/// The largest legal growth rate over the spectral radius, for rows of these fields.
pub(super) fn legal<E: Fields>() -> f64 {
    LIMIT.max(ROUNDING * E::EPSILON)
}

impl<const D: usize, S: Scene<D>> SemiDiscrete<D, S> {
    /// The rightmost eigenvalue and the spectral radius of the diffusion and advection terms at time t, conditions of the
    /// boundary included with zero values; see [`SpectrumEstimator`] for what the estimate is worth. Zero without a
    /// product where the row sums of the terms say so: every eigenvalue lies in a disc left of zero then.
    ///
    /// # Errors
    /// As [`SpectrumEstimator::estimate`].
    pub fn spectrum(&mut self, t: f64) -> Result<Spectrum> {
        if self.cannot_grow() {
            return Ok(Spectrum::default());
        }
        let free: Vec<usize> = self.site().free().map(|(p, _)| p).collect();
        let count = self.site().points().len();
        let oscillates = self.oscillates(t)?;
        let (mut field, mut rate) = (vec![S::Value::ZERO; count], vec![S::Value::ZERO; count]);
        // Values beyond the range of f32 never come up: the vectors of the search have unit length.
        let apply = |u: &[f64], du: &mut [f64]| {
            free.iter().zip(u).for_each(|(&p, &u)| field[p].set(0, u));
            self.linear(t, &mut field, &mut rate)?;
            free.iter().zip(du).for_each(|(&p, du)| *du = rate[p].get(0));
            Ok(())
        };
        let vectors = if oscillates { VECTORS } else { 32 };
        let estimator = SpectrumEstimator::new().subspace(vectors).most(MOST).rounded(S::Value::EPSILON);
        if oscillates { estimator.estimate(free.len(), apply) } else { estimator.settle(free.len(), apply) }
    }

    /// Whether an advection term puts eigenvalues along the imaginary axis.
    fn oscillates(&mut self, t: f64) -> Result<bool> {
        let rate = self.linear_limits(t)?.rate(Limit::Advection);
        Ok(rate.oscillation > 0.0 || rate.modulus > 0.0)
    }

    /// The growth rate at time t as the policy wants it; NaN where nothing is to be estimated, and where neither growth is
    /// found nor excluded.
    ///
    /// # Errors
    /// [`SolverError::Growing`] where it is refused, and as [`spectrum`](Self::spectrum).
    pub(super) fn growth(&mut self, t: f64, policy: GrowthPolicy) -> Result<f64> {
        if policy == GrowthPolicy::Unknown {
            return Ok(f64::NAN);
        }
        let spectrum = self.spectrum(t)?;
        // Runs along the imaginary axis may converge to an eigenvalue that is not the rightmost.
        let oscillates = self.oscillates(t)?;
        let settled = spectrum.exact || spectrum.converged && !oscillates;
        let resolution = if oscillates { RESOLUTION } else { f64::INFINITY };
        let compressed = COMPRESSED * self.linear_limits(t)?.rate(Limit::Compression).decay;
        recorded::<S::Value>(&spectrum, settled, resolution, compressed, policy)
    }
}

/// The growth rate of a spectrum as the policy wants it; NaN where no growth is found, nor is it `settled` that there is none.
/// Estimates that are far from converged end at most `resolution` of the radius right of it; up to `compressed` it is
/// legal.
///
/// # Errors
/// [`SolverError::Growing`] where it is refused.
fn recorded<E: Fields>(
    spectrum: &Spectrum,
    settled: bool,
    resolution: f64,
    compressed: f64,
    policy: GrowthPolicy,
) -> Result<f64> {
    let (rate, radius) = (spectrum.abscissa, spectrum.radius);
    let limit = legal::<E>().max(compressed / radius);
    // What rounding and residual leave open is no proof of growth.
    let blurred = spectrum.residual > BLURRED * radius;
    let open = if blurred { spectrum.error.min(resolution * radius) } else { spectrum.error };
    match (rate - open > limit * radius, policy) {
        (true, GrowthPolicy::Refuse) => Err(SolverError::Growing { rate, radius, limit }.into()),
        (true, _) => Ok(rate),
        (false, _) => Ok(if settled && rate <= limit * radius { rate } else { f64::NAN }),
    }
}

impl<const D: usize, S: MovingScene<D>> Moving<D, S> {
    /// The growth rate of the diffusion term on the set of the start; NaN where the policy asks for none, and where neither
    /// growth is found nor excluded.
    pub(super) fn growth_at_the_start(&self, policy: GrowthPolicy) -> Result<f64> {
        self.growth(policy, SpectrumEstimator::new().most(MOST))
    }

    /// The same on a set that has moved; NaN also where no spectrum is found at all.
    pub(super) fn growth_on_the_way(&self, policy: GrowthPolicy) -> Result<f64> {
        match self.growth(policy, SpectrumEstimator::new().subspace(FEW_VECTORS).most(ON_THE_WAY)) {
            Err(error) if matches!(error.kind(), ErrorKind::Linear(LinearError::NotConverged { .. })) => Ok(f64::NAN),
            found => found,
        }
    }

    fn growth(&self, policy: GrowthPolicy, estimator: SpectrumEstimator) -> Result<f64> {
        if policy == GrowthPolicy::Unknown {
            return Ok(f64::NAN);
        }
        let spectrum = self.spectrum(estimator)?;
        recorded::<S::Value>(&spectrum, spectrum.converged, f64::INFINITY, 0.0, policy)
    }
}

/// Rounding of a row of some tens of weights.
const ROUNDING: f64 = 16.0;
