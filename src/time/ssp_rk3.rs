//! The strong-stability-preserving Runge-Kutta scheme of order 3.

use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, scratch};
use crate::error::Result;

/// End of the negative real interval: the root of 2 + z + z^2/2 + z^3/6 = 0, z = -2.512...
const NEGATIVE_REAL: f64 = 2.512745326618329;

/// The Runge-Kutta scheme of Shu and Osher: u_1 = u + dt f(t, u), u_2 = 3/4 u + 1/4 (u_1 + dt f(t + dt, u_1)),
/// u^(n+1) = 1/3 u + 2/3 (u_2 + dt f(t + dt/2, u_2)).
///
/// Order 3. Every stage is a mean of explicit Euler steps of length dt, so whatever bound Euler keeps at a step (no new
/// extrema, no negative values) it keeps at that step too. It is computed from the rates, u_2 = u + dt/4 (k_1 + k_2) and
/// u^(n+1) = u + dt/6 (k_1 + k_2 + 4 k_3), so that a state at rest keeps its bits.
/// u' = lambda u stays bounded for lambda dt in [-2.512745326618329, 0] and in i [-sqrt 3, sqrt 3].
/// Three evaluations a step, three states of working memory.
///
/// ```
/// use parops::{SspRk3, Stepper};
/// let mut u = 1.0_f64;
/// SspRk3::new().step(0.0, 0.5, &mut u, &mut |_, u, du| {
///     *du = -u;
///     Ok(())
/// })?;
/// assert!((u - (1.0 - 0.5 + 0.125 - 0.125 / 6.0)).abs() < 1e-15);
/// # parops::Result::Ok(())
/// ```
///
/// Source: C.-W. Shu and S. Osher, 1988, eq. 2.18; errata 56 for the intervals.
/// See also: [`Rk4`](crate::Rk4), a longer step an evaluation for smooth fields.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct SspRk3<S> {
    #[cfg_attr(feature = "serde", serde(skip))]
    k: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    sum: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    stage: Option<S>,
}

impl<S> SspRk3<S> {
    /// The scheme without working memory yet.
    pub const fn new() -> Self {
        Self { k: None, sum: None, stage: None }
    }
}

impl<S> Default for SspRk3<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: State> Stepper<S> for SspRk3<S> {
    fn order(&self) -> u32 {
        3
    }

    fn negative_real_interval(&self) -> f64 {
        NEGATIVE_REAL
    }

    fn imaginary_interval(&self) -> f64 {
        3.0_f64.sqrt()
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        check_step(t, dt)?;
        check_finite(u, 1, t)?;
        let (k, sum, stage) = (scratch(&mut self.k, u), scratch(&mut self.sum, u), scratch(&mut self.stage, u));
        let (middle, end) = (t + dt / 2.0, t + dt);

        evaluate(rhs, 1, t, u, sum)?;
        stage.set_sum(u, dt, sum);

        evaluate(rhs, 2, end, stage, k)?;
        sum.add_scaled(1.0, k);
        stage.set_sum(u, dt / 4.0, sum);

        evaluate(rhs, 3, middle, stage, k)?;
        sum.add_scaled(4.0, k);
        stage.set_sum(u, dt / 6.0, sum);
        check_finite(stage, 4, end)?;
        std::mem::swap(u, stage);
        Ok(())
    }
}
