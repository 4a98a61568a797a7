//! The step a stable run may take, known before the run.

use super::state::State;
use super::stepper::Stepper;
use crate::error::{Result, TimeError};

/// What a [`StepLimit`] is bound by, for one stepper.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Binding {
    /// Nothing: every step is stable.
    Nothing,
    /// The fastest decay of a mode, in 1/time.
    Decay {
        /// The bound D lambda_max on the decay rate.
        rate: f64,
    },
    /// A step given as such.
    Step {
        /// The step.
        dt: f64,
    },
}

/// The largest stable step: a bound on how fast modes decay, a largest step, or both.
///
/// A semi-discrete diffusion u' = D A u whose eigenvalues lie in [-D lambda_max, 0] is stable for
/// dt <= x / (D lambda_max), x the [`negative_real_interval`](Stepper::negative_real_interval) of the stepper: 2 for
/// [`Euler`](crate::Euler), 2.785 for [`Rk4`](crate::Rk4), 0 for [`Leapfrog`](crate::Leapfrog), which no diffusion suits.
///
/// ```
/// use parops::{Euler, StepLimit};
/// let limit = StepLimit::from_spectral_bound(400.0, 0.5)?;
/// assert_eq!(limit.step(&Euler::<f64>::new()), 0.01);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 3.47 and 6.23; errata 26 and 56.
/// See also: [`LatticeSpectrum`](crate::LatticeSpectrum) and
/// [`wide_gaussian_decay`](crate::wide_gaussian_decay) for lambda_max on lattices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    decay: f64,
    step: f64,
}

impl StepLimit {
    /// No limit.
    pub const NONE: Self = Self { decay: 0.0, step: f64::INFINITY };

    /// The limit of u' = `coefficient` A u, where `bound` >= |lambda| for every eigenvalue lambda of the symmetric (or
    /// similar to symmetric) A, such as the largest row bound of an assembled operator.
    ///
    /// `bound` times `coefficient` is in 1/time; where either is 0 there is no limit.
    ///
    /// # Errors
    /// [`TimeError::Coefficient`] where one of them, or their product, is negative or not finite.
    pub fn from_spectral_bound(bound: f64, coefficient: f64) -> Result<Self> {
        for value in [bound, coefficient, bound * coefficient] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(TimeError::Coefficient { value }.into());
            }
        }
        Ok(Self { decay: bound * coefficient, ..Self::NONE })
    }

    /// The same largest step for every stepper, as a Lagrangian CFL condition sets it.
    ///
    /// # Errors
    /// [`TimeError::Step`] where `dt` is not positive and finite.
    pub fn from_step(dt: f64) -> Result<Self> {
        if dt > 0.0 && dt.is_finite() {
            Ok(Self { step: dt, ..Self::NONE })
        } else {
            Err(TimeError::Step { dt }.into())
        }
    }

    /// Both limits at once, each on its own.
    ///
    /// For a sum of two operators use [`plus`](Self::plus): its decay rates add up.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { decay: self.decay.max(other.decay), step: self.step.min(other.step) }
    }

    /// The limit of the sum of two operators: decay rates add up (the largest eigenvalue of a sum of symmetric
    /// operators is at most the sum of the largest).
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { decay: self.decay + other.decay, step: self.step.min(other.step) }
    }

    /// The bound D lambda_max on the decay rate, in 1/time; 0 where nothing decays.
    pub fn decay(&self) -> f64 {
        self.decay
    }

    /// The largest stable step of `stepper`: infinite without a limit, 0 where no step is stable.
    pub fn step<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> f64 {
        self.step_of_interval(stepper.negative_real_interval())
    }

    /// The largest stable step of a stepper with this negative real stability interval.
    pub fn step_of_interval(&self, negative_real_interval: f64) -> f64 {
        if self.decay > 0.0 { self.step.min(negative_real_interval / self.decay) } else { self.step }
    }

    /// What sets the largest stable step of `stepper`.
    pub fn binding<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> Binding {
        let dt = self.step(stepper);
        if dt == f64::INFINITY {
            Binding::Nothing
        } else if dt == self.step {
            Binding::Step { dt }
        } else {
            Binding::Decay { rate: self.decay }
        }
    }

    /// Refuses a step above the limit of `stepper`.
    ///
    /// # Errors
    /// [`TimeError::Limit`] with both, where dt is above the limit; the limit is 0 where no step is stable.
    pub fn check<S: State>(&self, dt: f64, stepper: &(impl Stepper<S> + ?Sized)) -> Result<()> {
        let limit = self.step(stepper);
        if dt <= limit { Ok(()) } else { Err(TimeError::Limit { dt, limit }.into()) }
    }
}

/// What happens to a step above the limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// It is refused before anything changes.
    #[default]
    Refuse,
    /// It is taken, and the run says so.
    Allow,
}
