//! The classical Runge-Kutta scheme of order 4.

use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, evaluate_shape, refuse_not_finite, scratch};
use crate::error::Result;

/// End of the negative real interval of RK4: the root of 1 + z/2 + z^2/6 + z^3/24 = 0, z = -2.785...
const NEGATIVE_REAL: f64 = 2.785293563405282;

/// The classical Runge-Kutta scheme: u^(n+1) = u^n + dt/6 (k_1 + 2 k_2 + 2 k_3 + k_4) with
/// k_1 = f(t, u), k_2 = f(t + dt/2, u + dt/2 k_1), k_3 = f(t + dt/2, u + dt/2 k_2), k_4 = f(t + dt, u + dt k_3).
///
/// Order 4; u' = lambda u stays bounded for lambda dt in [-2.785293563405282, 0] and in i [-2 sqrt 2, 2 sqrt 2].
/// Four evaluations a step, three states of working memory.
///
/// Source: notes 001, eq. 3.17 to 3.21; errata 56 for the intervals. Example: [`Stepper`].
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Rk4<S> {
    #[cfg_attr(feature = "serde", serde(skip))]
    k: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    sum: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    stage: Option<S>,
}

impl<S> Rk4<S> {
    /// RK4 without working memory yet.
    pub const fn new() -> Self {
        Self { k: None, sum: None, stage: None }
    }
}

impl<S> Default for Rk4<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: State> Stepper<S> for Rk4<S> {
    fn order(&self) -> u32 {
        4
    }

    fn negative_real_interval(&self) -> f64 {
        NEGATIVE_REAL
    }

    fn imaginary_interval(&self) -> f64 {
        2.0 * std::f64::consts::SQRT_2
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        check_step(t, dt)?;
        check_finite(u, 1, t)?;
        let (k, sum, stage) = (scratch(&mut self.k, u), scratch(&mut self.sum, u), scratch(&mut self.stage, u));
        let (half, middle, end) = (dt / 2.0, t + dt / 2.0, t + dt);

        evaluate(rhs, 1, t, u, sum)?;
        stage.set_sum(u, half, sum);

        for (n, length) in [(2, half), (3, dt)] {
            evaluate_shape(rhs, middle, stage, k)?;
            refuse_not_finite(stage.set_sum_and_add(u, length, k, sum, 2.0), n, middle)?;
        }

        evaluate(rhs, 4, end, stage, k)?;
        sum.add_scaled(1.0, k);
        stage.set_sum(u, dt / 6.0, sum);
        check_finite(stage, 5, end)?;
        std::mem::swap(u, stage);
        Ok(())
    }
}
