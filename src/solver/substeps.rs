//! A step that is cut into substeps, each within the limit of its own moment.

use super::policy::StepPolicy;
use crate::error::{Limit, Result, SolverError};

/// The longest step that is legal from t on, from the limit of a step of a given length, its ends looked at: of
/// decreasing ones the first that its own limit admits.
pub(super) fn longest(t: f64, mut limit: impl FnMut(f64) -> Result<f64>) -> Result<f64> {
    let mut dt = limit(0.0)?;
    for turn in 0.. {
        if !(dt > 0.0 && dt.is_finite()) {
            break;
        }
        let found = match limit(dt) {
            // Flow or coefficients may not be defined so far ahead.
            Err(_) if t + 0.5 * dt != t => 0.5 * dt,
            found => found?,
        };
        if !(found < dt) {
            break;
        }
        // Limits change with time, but not at once: a step short enough is legal. What binds far ahead need not bind here.
        dt = if turn < TURNS { found.max(0.5 * dt) } else { 0.5 * dt };
    }
    Ok(dt)
}

/// Steps that are tried before they are halved.
const TURNS: usize = 8;

/// What is left of a step.
pub(super) struct Substeps {
    /// The time reached.
    pub(super) t: f64,
    /// Substeps taken.
    pub(super) taken: u32,
    end: f64,
    dt: f64,
    most: u32,
}

impl Substeps {
    /// A step of length dt from t to `end`.
    pub(super) fn new(policy: StepPolicy, t: f64, dt: f64, end: f64) -> Self {
        let most = if let StepPolicy::Adapt { most } = policy { most } else { 0 };
        Self { t, taken: 0, end, dt, most }
    }

    /// How much is left.
    pub(super) fn rest(&self) -> f64 {
        self.end - self.t
    }

    /// The length of the next substep where steps up to `limit` are legal: the rest in equal parts.
    ///
    /// # Errors
    /// [`SolverError::Substeps`] where that takes more of them than are left.
    pub(super) fn next(&mut self, limit: f64, binding: Option<Limit>) -> Result<f64> {
        // Rounding of the times is no reason for one part more.
        let rounding =
            f64::EPSILON * (4.0 * self.rest() + 2.0 * self.t.abs().max(self.end.abs()) * f64::from(self.taken + 1));
        let parts = ((self.rest() - rounding) / limit).ceil().max(1.0);
        if !(parts <= f64::from(self.most - self.taken.min(self.most))) {
            let binding = binding.unwrap_or(Limit::Diffusion);
            return Err(SolverError::Substeps { dt: self.dt, limit, binding, most: self.most }.into());
        }
        let length = self.rest() / parts;
        self.taken += 1;
        self.t = if parts == 1.0 { self.end } else { self.t + length };
        Ok(length)
    }

    /// Whether the end is reached.
    pub(super) fn done(&self) -> bool {
        self.t == self.end
    }
}
