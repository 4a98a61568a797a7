//! How much hyperviscosity an advection operator needs, by estimates of its spectrum.

use std::borrow::Borrow;

use super::spectrum::{Spectrum, SpectrumEstimator};
use crate::apply::{Hyperviscosity, Rows};
use crate::error::{LinearError, Result};
use crate::scalar::length;

/// The weakest hyperviscosity tried, but for halvings.
const WEAKEST: f64 = 1.0 / 4096.0;
/// From one trial to the next, up or down.
const STEP: f64 = 4.0;
/// Such steps from the weakest to the strongest.
const RUNGS: i32 = 6;
/// The strongest one tried.
const STRONGEST: f64 = 1.0;
/// Times the last interval, a factor of [`STEP`], is halved.
const HALVINGS: usize = 3;
/// Times the least that is enough by all eigenvalues.
const MARGIN: f64 = 1.25;
/// Times the least that is enough by an estimate, which comes from below: with it 1.25 was too little by up to 1.6.
pub(crate) const OPEN: f64 = 2.5;

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
    /// of 4^(1/8) = 1.19, times 1.25 where the spectra are exact and 2.5 where not. Cost: 1 to 11 spectra, mostly 6, each of
    /// some hundred evaluations of both operators, or one a particle. A `growth` of 1e-3 lets a mode grow by exp(1e-3 |v| t/h);
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
        let unit = self.fastest(velocities);
        let before = self.gamma();
        let found = least(unit, growth, |gamma| self.spectrum(estimator, velocities, &mut advection, gamma));
        let found = found.map(|found| {
            let margin = if found.stabilized.exact { MARGIN } else { OPEN };
            Tuning { gamma: margin * found.gamma, ..found }
        });
        self.set_gamma(found.as_ref().map_or(before, |found| found.gamma))?;
        found
    }

    /// Sets the first of `gamma`, twice that and so on with which an estimate finds no mode that grows faster; as
    /// [`tune`](Self::tune) otherwise.
    pub(crate) fn raise<const D: usize>(
        &mut self,
        estimator: &SpectrumEstimator,
        velocities: &[[f64; D]],
        mut advection: impl FnMut(&[f64], &mut [f64]) -> Result<()>,
        growth: f64,
        gamma: f64,
    ) -> Result<()> {
        let limit = growth * self.fastest(velocities);
        let mut gamma = gamma.min(STRONGEST);
        loop {
            let Spectrum { abscissa, .. } = self.spectrum(estimator, velocities, &mut advection, gamma)?;
            if abscissa <= limit {
                return Ok(());
            }
            if gamma >= STRONGEST {
                return Err(LinearError::Growing { abscissa, limit, gamma }.into());
            }
            gamma = (2.0 * gamma).clamp(WEAKEST, STRONGEST);
        }
    }

    /// The spectrum with this gamma, which is set.
    fn spectrum<const D: usize>(
        &mut self,
        estimator: &SpectrumEstimator,
        velocities: &[[f64; D]],
        advection: &mut impl FnMut(&[f64], &mut [f64]) -> Result<()>,
        gamma: f64,
    ) -> Result<Spectrum> {
        self.set_gamma(gamma)?;
        let targets = self.laplacian().targets();
        estimator.estimate(targets, |u, du| {
            advection(u, du)?;
            if gamma > 0.0 { self.add(velocities, u, du) } else { Ok(()) }
        })
    }

    /// |v|_max / h.
    fn fastest<const D: usize>(&self, velocities: &[[f64; D]]) -> f64 {
        velocities.iter().map(length).fold(0.0, f64::max) / self.spacing().0
    }
}

/// The least gamma, to a factor of 4^(1/8), with which no mode grows faster than `growth` times `unit`, |v|_max / h.
///
/// # Errors
/// [`LinearError::Growing`] where gamma = 1 is not enough, and those of `spectrum`.
pub(crate) fn least(unit: f64, growth: f64, mut spectrum: impl FnMut(f64) -> Result<Spectrum>) -> Result<Tuning> {
    let limit = growth * unit;
    let mut trials = 0;
    let mut spectrum = |gamma: f64| {
        trials += 1;
        spectrum(gamma)
    };
    let bare = spectrum(0.0)?;
    if bare.abscissa <= limit {
        return Ok(Tuning { gamma: 0.0, bare, stabilized: bare, trials });
    }
    // What damps the shortest waves as fast as modes grow is often nearly enough.
    let rung = (bare.abscissa / (unit * WEAKEST)).log(STEP).round().clamp(0.0, f64::from(RUNGS));
    let mut gamma = WEAKEST * STEP.powi(rung as i32);
    let mut stabilized = spectrum(gamma)?;
    if stabilized.abscissa > limit {
        while stabilized.abscissa > limit {
            if gamma >= STRONGEST {
                return Err(LinearError::Growing { abscissa: stabilized.abscissa, limit, gamma }.into());
            }
            gamma *= STEP;
            stabilized = spectrum(gamma)?;
        }
    } else {
        while gamma > WEAKEST {
            let weaker = spectrum(gamma / STEP)?;
            if weaker.abscissa > limit {
                break;
            }
            (gamma, stabilized) = (gamma / STEP, weaker);
        }
    }
    let mut step = STEP;
    for _ in 0..HALVINGS {
        step = step.sqrt();
        let weaker = spectrum(gamma / step)?;
        if weaker.abscissa <= limit {
            (gamma, stabilized) = (gamma / step, weaker);
        }
    }
    Ok(Tuning { gamma, bare, stabilized, trials })
}
