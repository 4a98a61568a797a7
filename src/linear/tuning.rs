//! How much hyperviscosity an advection operator needs, by estimates of its spectrum.

use std::borrow::Borrow;

use super::spectrum::{Spectrum, SpectrumEstimator};
use crate::apply::{Hyperviscosity, Rows};
use crate::error::{LinearError, Result};

/// The strongest hyperviscosity tried.
const STRONGEST: f64 = 1.0;
/// The weakest but none.
const WEAKEST: f64 = 1.0 / 4096.0;
/// From one trial to the next, until one is enough.
const STEP: f64 = 4.0;
/// Times the last interval, a factor of [`STEP`], is halved.
const HALVINGS: usize = 3;
/// Times the least that is enough by all eigenvalues.
const MARGIN: f64 = 1.25;
/// Times the least that is enough by an estimate, which comes from below: with it 1.25 was too little by up to 1.6.
const OPEN: f64 = 2.5;

/// What a search for gamma found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Tuning {
    /// gamma: 0 where none is needed.
    pub gamma: f64,
    /// The spectrum without hyperviscosity.
    pub bare: Spectrum,
    /// The spectrum at the least gamma found to be enough; the gamma set is a quarter above it, 2.5 times it where the
    /// spectrum is not exact.
    pub stabilized: Spectrum,
    /// Spectra estimated.
    pub trials: usize,
}

impl<L: Borrow<Rows>> Hyperviscosity<L> {
    /// Finds and sets the gamma with which no mode grows faster than `growth` |v|_max / h, and says what it found.
    ///
    /// `advection(u, du)` writes the bare operator, du = -v . grad u, for these velocities. gamma is the least to a factor
    /// of 4^(1/8) = 1.19, times 1.25 where the spectra are exact and 2.5 where not. Cost: 4 to 11 spectra, each of some
    /// hundred evaluations of both operators, or one a particle. A `growth` of 1e-3 lets a mode grow by exp(1e-3 |v| t/h);
    /// smaller values are stricter where spectra are exact, and beyond their resolution elsewhere: see
    /// [`SpectrumEstimator`].
    ///
    /// # Errors
    /// [`LinearError::Growing`] where gamma = 1 is not enough; [`LinearError::Setting`] for a growth that is not positive;
    /// those of `advection`, of [`add`](Self::add) and of [`SpectrumEstimator::estimate`]. gamma is then as it was.
    pub fn tune<const D: usize>(
        &mut self,
        estimator: &SpectrumEstimator,
        velocities: &[[f64; D]],
        mut advection: impl FnMut(&[f64], &mut [f64]) -> Result<()>,
        growth: f64,
    ) -> Result<Tuning> {
        if !(growth > 0.0 && growth.is_finite()) {
            return Err(LinearError::Setting { value: growth, low: 0.0, high: f64::MAX }.into());
        }
        let squared = |v: &[f64; D]| v.iter().map(|v| v * v).sum::<f64>();
        let fastest = velocities.iter().map(squared).fold(0.0, f64::max).sqrt();
        let limit = growth * fastest / self.spacing().0;
        let before = self.gamma();
        let found = self.search(estimator, velocities, &mut advection, limit);
        self.set_gamma(found.as_ref().map_or(before, |found| found.gamma))?;
        found
    }

    fn search<const D: usize>(
        &mut self,
        estimator: &SpectrumEstimator,
        velocities: &[[f64; D]],
        advection: &mut impl FnMut(&[f64], &mut [f64]) -> Result<()>,
        limit: f64,
    ) -> Result<Tuning> {
        let mut trials = 0;
        let mut spectrum = |gamma: f64| {
            trials += 1;
            self.set_gamma(gamma)?;
            let targets = self.laplacian().targets();
            estimator.estimate(targets, |u, du| {
                advection(u, du)?;
                if gamma > 0.0 { self.add(velocities, u, du) } else { Ok(()) }
            })
        };
        let bare = spectrum(0.0)?;
        if bare.abscissa <= limit {
            return Ok(Tuning { gamma: 0.0, bare, stabilized: bare, trials });
        }
        let mut gamma = WEAKEST;
        let mut stabilized = spectrum(gamma)?;
        while stabilized.abscissa > limit {
            if gamma >= STRONGEST {
                return Err(LinearError::Growing { abscissa: stabilized.abscissa, limit, gamma }.into());
            }
            gamma = (STEP * gamma).min(STRONGEST);
            stabilized = spectrum(gamma)?;
        }
        let mut step = STEP;
        for _ in 0..HALVINGS {
            step = step.sqrt();
            let weaker = spectrum(gamma / step)?;
            if weaker.abscissa <= limit {
                (gamma, stabilized) = (gamma / step, weaker);
            }
        }
        let margin = if stabilized.exact { MARGIN } else { OPEN };
        Ok(Tuning { gamma: margin * gamma, bare, stabilized, trials })
    }
}
