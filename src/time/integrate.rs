//! A whole run of equal steps.

use super::plan::Plan;
use super::state::State;
use super::stepper::Stepper;
use crate::error::Result;

/// What a finished run did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Number of steps.
    pub steps: u64,
    /// The step.
    pub dt: f64,
    /// The largest stable step of the stepper; infinite without a limit.
    pub limit: f64,
    /// Whether the step kept the limit. Nothing is promised about stability where it did not.
    pub within_limit: bool,
}

/// Advances u' = f(t, u) from the start to the end of `plan`, which the last step meets exactly.
///
/// `progress(n, t, u)` is called after every step with the number of steps done. The stepper is reset first. The run
/// works on a copy (one allocation) that replaces `u` at the end: after an error, or a panic in a closure, `u` is what
/// it was; what has been computed until then `progress` has seen.
///
/// # Errors
/// [`TimeError::Limit`](crate::TimeError::Limit) where the step is above the limit of the plan and was not allowed to
/// be, before anything is computed; and as [`Stepper::step`].
///
/// ```
/// use parops::{Plan, Rk4, integrate};
/// let mut u = vec![1.0, 2.0];
/// let decay = |_: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
///     du.iter_mut().zip(u).for_each(|(du, u)| *du = -u);
///     Ok(())
/// };
/// let run = integrate(&mut Rk4::new(), &mut u, &Plan::new(0.0, 1.0, 0.1)?, decay, |_, _, _| {})?;
/// assert_eq!(run.steps, 10);
/// assert!((u[1] - 2.0 * (-1.0_f64).exp()).abs() < 1e-6);
/// # parops::Result::Ok(())
/// ```
pub fn integrate<S: State>(
    stepper: &mut (impl Stepper<S> + ?Sized),
    u: &mut S,
    plan: &Plan,
    mut rhs: impl FnMut(f64, &S, &mut S) -> Result<()>,
    mut progress: impl FnMut(u64, f64, &S),
) -> Result<Run> {
    let within_limit = plan.check(stepper)?;
    let limit = plan.step_limit().step(stepper);
    stepper.reset();
    let mut moving = u.clone();
    for n in 0..plan.steps() {
        stepper.step(plan.time(n), plan.dt(), &mut moving, &mut rhs)?;
        progress(n + 1, plan.time(n + 1), &moving);
    }
    *u = moving;
    Ok(Run { steps: plan.steps(), dt: plan.dt(), limit, within_limit })
}
