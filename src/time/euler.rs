//! Explicit Euler.

use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, scratch};
use crate::error::Result;

/// Explicit Euler: u^(n+1) = u^n + dt f(t_n, u^n).
///
/// Order 1; u' = lambda u stays bounded for |1 + lambda dt| <= 1: on [-2, 0] of the real axis and nowhere else on the
/// imaginary one. One evaluation a step, two states of working memory.
///
/// ```
/// use parops::{Euler, Stepper};
/// let mut u = vec![1.0, 2.0];
/// Euler::new().step(0.0, 0.5, &mut u, &mut |_, u, du| {
///     du.clone_from(u);
///     Ok(())
/// })?;
/// assert_eq!(u, [1.5, 3.0]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 3.8 and 3.46.
/// See also: [`Rk4`](crate::Rk4), which also bears central advection.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Euler<S> {
    #[cfg_attr(feature = "serde", serde(skip))]
    du: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    next: Option<S>,
}

impl<S> Euler<S> {
    /// Explicit Euler without working memory yet.
    pub const fn new() -> Self {
        Self { du: None, next: None }
    }
}

impl<S> Default for Euler<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: State> Stepper<S> for Euler<S> {
    fn order(&self) -> u32 {
        1
    }

    fn negative_real_interval(&self) -> f64 {
        2.0
    }

    fn imaginary_interval(&self) -> f64 {
        0.0
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        check_step(t, dt)?;
        check_finite(u, 1, t)?;
        let (du, next) = (scratch(&mut self.du, u), scratch(&mut self.next, u));
        evaluate(rhs, 1, t, u, du)?;
        next.set_sum(u, dt, du);
        check_finite(next, 2, t + dt)?;
        std::mem::swap(u, next);
        Ok(())
    }
}
