//! The seam of every time stepping scheme, and the checks all of them share.

use super::rkl2::RowSymmetry;
use super::state::State;
use crate::error::{Error, Result, TimeError};

/// A right-hand side f of u' = f(t, u): `rhs(t, u, du)` writes all of `du`, whose contents before are unspecified.
pub type Rhs<'a, S> = dyn FnMut(f64, &S, &mut S) -> Result<()> + 'a;

/// A scheme that advances u' = f(t, u) by one step.
///
/// The state changes only when a step succeeds: after an error, and after a panic in `rhs`, `u` is bit for bit what it
/// was and the stepper can be used again. Working memory is made in the first step and reused.
/// `parops::testing::check_stepper` (feature `testing`) tells whether a stepper keeps these promises.
///
/// ```
/// use parops::{Rk4, Stepper};
/// let mut u = 1.0;
/// Rk4::new().step(0.0, 0.1, &mut u, &mut |_, u, du| {
///     *du = -u;
///     Ok(())
/// })?;
/// assert!((u - (-0.1_f64).exp()).abs() < 1e-7);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 3.2.
pub trait Stepper<S: State> {
    /// The order of the error at a fixed end time, O(dt^order).
    fn order(&self) -> u32;

    /// The largest x for which u' = lambda u stays bounded for all lambda dt in [-x, 0]; 0 where diffusion is unstable.
    fn negative_real_interval(&self) -> f64;

    /// The supremum of the y for which u' = lambda u stays bounded for all lambda dt in i [-y, y].
    fn imaginary_interval(&self) -> f64;

    /// Advances u from t to t + dt.
    ///
    /// # Errors
    /// [`TimeError::Step`] where dt is not positive and finite; [`TimeError::Span`] where t or t + dt is not finite;
    /// [`TimeError::NoProgress`] where t + dt is t; [`TimeError::NotFinite`] with the particle, the stage (from 1; one
    /// past the last for the new state) and its time, where `u`, a rate of change or the new state is not finite;
    /// [`TimeError::Shape`] where `rhs` changed the shape of `du`; and the errors of `rhs`, unchanged.
    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()>;

    /// Refuses rows that the scheme does not suit, for what is known of them; most schemes suit all.
    ///
    /// # Errors
    /// [`TimeError::Slope`] for rows that are not symmetric and [`Rkl2`](crate::Rkl2) that counts on no slope.
    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        let _ = symmetry;
        Ok(())
    }

    /// Forgets all earlier steps; call it when `u` was changed between two steps of a multistep scheme.
    fn reset(&mut self) {}
}

impl<S: State, P: Stepper<S> + ?Sized> Stepper<S> for Box<P> {
    fn order(&self) -> u32 {
        (**self).order()
    }

    fn negative_real_interval(&self) -> f64 {
        (**self).negative_real_interval()
    }

    fn imaginary_interval(&self) -> f64 {
        (**self).imaginary_interval()
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        (**self).step(t, dt, u, rhs)
    }

    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        (**self).check_symmetry(symmetry)
    }

    fn reset(&mut self) {
        (**self).reset();
    }
}

/// Refuses a step that is no step: dt not positive and finite, times not finite, or no progress.
pub(super) fn check_step(t: f64, dt: f64) -> Result<()> {
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(TimeError::Step { dt }.into());
    }
    let end = t + dt;
    if !end.is_finite() {
        return Err(TimeError::Span { start: t, end }.into());
    }
    if end == t {
        return Err(TimeError::NoProgress { t, dt }.into());
    }
    Ok(())
}

/// Refuses a state that is not finite, as stage `stage` at time `t`.
pub(super) fn check_finite<S: State>(u: &S, stage: usize, t: f64) -> Result<()> {
    refuse_not_finite(u.first_non_finite(), stage, t)
}

/// The error for a particle where something was not finite.
pub(super) fn refuse_not_finite(particle: Option<usize>, stage: usize, t: f64) -> Result<()> {
    particle.map_or(Ok(()), |particle| Err(Error::from(TimeError::NotFinite { stage, t }).at(particle)))
}

/// du = f(t, u) of one stage, checked for shape and finiteness.
pub(super) fn evaluate<S: State>(rhs: &mut Rhs<'_, S>, stage: usize, t: f64, u: &S, du: &mut S) -> Result<()> {
    evaluate_shape(rhs, t, u, du)?;
    check_finite(du, stage, t)
}

/// du = f(t, u), checked for shape only.
pub(super) fn evaluate_shape<S: State>(rhs: &mut Rhs<'_, S>, t: f64, u: &S, du: &mut S) -> Result<()> {
    rhs(t, u, du)?;
    du.same_shape(u)
}

/// The scratch state of a stepper, with the shape of `u`; allocates in the first step only.
pub(super) fn scratch<'a, S: State>(held: &'a mut Option<S>, u: &S) -> &'a mut S {
    match held {
        Some(state) => {
            if state.same_shape(u).is_err() {
                state.assign(u);
            }
            state
        }
        None => held.insert(u.clone()),
    }
}
