//! Equal steps that land on the end.

use super::limit::{Policy, StepLimit};
use super::state::State;
use super::stepper::Stepper;
use crate::error::{Result, TimeError};

/// The largest number of steps that are counted exactly, 2^53.
const MOST: f64 = 9_007_199_254_740_992.0;

/// Equal steps from a start to an end, and the limit they keep.
///
/// ```
/// use parops::{Euler, Plan, StepLimit};
/// let plan = Plan::new(0.0, 1.0, 0.3)?;
/// assert_eq!((plan.steps(), plan.dt()), (4, 0.25));
/// let plan = plan.limit(StepLimit::from_spectral_bound(20.0, 1.0)?).cut_for(&Euler::<f64>::new())?;
/// assert_eq!((plan.steps(), plan.dt()), (10, 0.1));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    start: f64,
    end: f64,
    dt: f64,
    steps: u64,
    limit: StepLimit,
    policy: Policy,
}

impl Plan {
    /// The fewest equal steps from `start` to `end` that are not longer than `dt` but for rounding; no limit.
    ///
    /// Where `end` is `start` there are no steps.
    ///
    /// # Errors
    /// [`TimeError::Step`] where dt is not positive and finite; [`TimeError::Span`] where a time, or the span, is not
    /// finite or `end` is before `start`; [`TimeError::NoProgress`] where a step would not change the time somewhere.
    pub fn new(start: f64, end: f64, dt: f64) -> Result<Self> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let span = end - start;
        if !(span >= 0.0 && span.is_finite()) {
            return Err(TimeError::Span { start, end }.into());
        }
        // 1.1 / 0.1 is 11 and a rounding error: that is eleven steps.
        let steps = (span / dt * (1.0 - 4.0 * f64::EPSILON)).ceil();
        let plan = Self { start, end, dt, steps: 0, limit: StepLimit::NONE, policy: Policy::Refuse };
        plan.with_steps(steps)
    }

    fn with_steps(self, steps: f64) -> Result<Self> {
        if steps == 0.0 {
            return Ok(self);
        }
        let dt = (self.end - self.start) / steps;
        let t = if self.start.abs() > self.end.abs() { self.start } else { self.end };
        // Rounding is coarsest where |t| is largest.
        if steps > MOST || t + dt == t {
            return Err(TimeError::NoProgress { t, dt }.into());
        }
        Ok(Self { dt, steps: steps as u64, ..self })
    }

    /// The same steps under a limit, which [`integrate`](crate::integrate) checks.
    #[must_use]
    pub fn limit(self, limit: StepLimit) -> Self {
        Self { limit, ..self }
    }

    /// The same steps, with what is to happen above the limit.
    #[must_use]
    pub fn policy(self, policy: Policy) -> Self {
        Self { policy, ..self }
    }

    /// The fewest equal steps that also keep the limit of `stepper`.
    ///
    /// # Errors
    /// [`TimeError::Limit`] where no step is stable; [`TimeError::NoProgress`] where the steps would be too short to
    /// change the time.
    pub fn cut_for<S: State>(self, stepper: &(impl Stepper<S> + ?Sized)) -> Result<Self> {
        let limit = self.limit.step(stepper);
        if self.dt <= limit {
            return Ok(self);
        }
        if limit <= 0.0 {
            return Err(TimeError::Limit { dt: self.dt, limit }.into());
        }
        if self.steps == 0 {
            return Ok(Self { dt: limit, ..self });
        }
        let span = self.end - self.start;
        let mut steps = (span / limit).ceil();
        if span / steps > limit {
            steps += 1.0;
        }
        self.with_steps(steps)
    }

    /// The start.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// The end.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// The step.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The limit the steps are to keep.
    pub fn step_limit(&self) -> StepLimit {
        self.limit
    }

    /// The time after n steps; exactly the end after the last.
    pub fn time(&self, n: u64) -> f64 {
        if n == self.steps { self.end } else { self.start + n as f64 * self.dt }
    }

    /// Whether the step may be taken with `stepper`; true where it keeps the limit, false where it is above the limit
    /// and [`Policy::Allow`] was chosen.
    ///
    /// # Errors
    /// [`TimeError::Limit`] where it is above the limit and the policy is [`Policy::Refuse`].
    pub fn check<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> Result<bool> {
        match (self.limit.check(self.dt, stepper), self.policy) {
            (Ok(()), _) => Ok(true),
            (Err(_), Policy::Allow) => Ok(false),
            (Err(error), Policy::Refuse) => Err(error),
        }
    }
}
