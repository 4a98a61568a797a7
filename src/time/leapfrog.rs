//! The two-step leapfrog scheme.

use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, scratch};
use crate::error::Result;

/// Two-step leapfrog: u^(n+1) = u^(n-1) + 2 dt f(t_n, u^n), its first step by explicit Euler.
///
/// Order 2, also with the first-order start. u' = lambda u stays bounded for lambda = i y with |y| dt < 1, strictly (at
/// equality it grows linearly), and for no lambda of negative real part: it refuses diffusion.
/// It starts anew after [`reset`](Stepper::reset), when dt or the shape changes, and when t is not where the last step
/// ended. One evaluation a step, three states of working memory.
///
/// ```
/// use parops::{Leapfrog, Stepper};
/// let (mut leapfrog, mut u) = (Leapfrog::new(), [1.0_f64, 0.0]);
/// for n in 0..1000 {
///     leapfrog.step(0.1 * n as f64, 0.1, &mut u, &mut |_, u, du| {
///         *du = [u[1], -u[0]];
///         Ok(())
///     })?;
/// }
/// assert!((u[0] * u[0] + u[1] * u[1] - 1.0).abs() < 0.02);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 3.13; errata 52 (the old state must be kept) and 53 (start and limit).
/// See also: [`Rk4`](crate::Rk4), which bears diffusion too.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "S: serde::Serialize", deserialize = "S: serde::Deserialize<'de>"))
)]
pub struct Leapfrog<S> {
    #[cfg_attr(feature = "serde", serde(skip))]
    du: Option<S>,
    old: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    next: Option<S>,
    /// dt of the last step and the time it ended at, while `old` holds the state before it.
    last: Option<(f64, f64)>,
}

impl<S> Leapfrog<S> {
    /// Leapfrog before its first step.
    pub const fn new() -> Self {
        Self { du: None, old: None, next: None, last: None }
    }
}

impl<S> Default for Leapfrog<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: State> Leapfrog<S> {
    /// Whether a step from t by dt continues the last one. Times summed by the caller differ by rounding, times of
    /// another run by a step at least: half a step tells them apart.
    fn continues(&self, t: f64, dt: f64, u: &S) -> bool {
        let same_shape = self.old.as_ref().is_some_and(|old| old.same_shape(u).is_ok());
        same_shape && self.last.is_some_and(|(last, end)| last == dt && (t - end).abs() < dt / 2.0)
    }
}

impl<S: State> Stepper<S> for Leapfrog<S> {
    fn order(&self) -> u32 {
        2
    }

    fn negative_real_interval(&self) -> f64 {
        0.0
    }

    fn imaginary_interval(&self) -> f64 {
        1.0
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        check_step(t, dt)?;
        check_finite(u, 1, t)?;
        let continues = self.continues(t, dt, u);
        if self.old.as_ref().is_some_and(|old| old.same_shape(u).is_err()) {
            self.last = None;
        }
        let (du, next, old) = (scratch(&mut self.du, u), scratch(&mut self.next, u), scratch(&mut self.old, u));
        evaluate(rhs, 1, t, u, du)?;
        if continues {
            next.set_sum(old, 2.0 * dt, du);
        } else {
            next.set_sum(u, dt, du);
        }
        check_finite(next, 2, t + dt)?;
        std::mem::swap(old, u);
        std::mem::swap(u, next);
        self.last = Some((dt, t + dt));
        Ok(())
    }

    fn reset(&mut self) {
        self.last = None;
    }
}
