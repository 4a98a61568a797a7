//! v . grad f with the sources of every axis on the side the velocity comes from.

use std::sync::Arc;

use super::allowance::Allowance;
use super::draft::finite;
use super::half_space::{HalfScratch, HalfSpace, half_space_settings, on_side};
use super::method::{Method, spread};
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, ParticleError, Result};
use crate::scale::{Cutoff, Epsilon, Volumes};
use crate::stencil::{Side, Stencil};

/// v . grad f for a velocity per target, each axis from the side its component comes from,
/// (Q f)_p = sum_i v_i(p) (d_i f)_p, with d_i f from the left where v_i > 0 and from the right where v_i < 0, to order 1:
/// [`OneSided`](super::OneSided) of d/dx_i.
///
/// No weight is positive, so u' = -Q u keeps the maximum principle under Euler up to dt = 1/sum |w|, the largest row sum of
/// the report; on lattices |v_1| + ... + |v_D| <= 1.128 epsilon/dt is stable. The error is the viscosity
/// |v_i| epsilon/sqrt(pi) along the axis i and half of it across. Constants are annihilated exactly, linear functions
/// reproduced on any set. An axis with v_i = 0 needs no neighbors and has no weights.
///
/// [`set_velocities`](Self::set_velocities) changes the velocities for the next build; for velocities that change from step
/// to step over one list, [`UpwindGradient`] is built once.
///
/// ```
/// use parops::{Apply, CellList, Domain, Particles, Upwind};
/// let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
/// let turning: Vec<_> = set.points().iter().map(|x| [0.5 - x[1], x[0] - 0.5]).collect();
/// let upwind = Upwind::new(turning, set.spacing()?.epsilon(1.0)?, set.volumes()?)?;
/// let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
/// let rows = upwind.assemble(&CellList::build(&set, &torus, upwind.cutoff())?)?;
/// let mut out = vec![1.0; set.len()];
/// rows.apply(&vec![2.0; set.len()], &mut out)?;
/// assert!(out.iter().all(|&out| out == 0.0));
/// assert!((0..set.len()).all(|p| rows.row(p).unwrap().weights.iter().all(|w| w[0] <= 0.0)));
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 6.27 and 6.28 with errata 28 (f_q - f_p), 30 (the step), 31 (discrete moments), 35 (viscosity).
#[derive(Clone, Debug)]
pub struct Upwind<const D: usize> {
    half: HalfSpace,
    velocities: Arc<[[f64; D]]>,
}

impl<const D: usize> Upwind<D> {
    /// The operator for these velocities, one per target.
    ///
    /// # Errors
    /// [`ParticleError::Velocity`] naming the first particle and axis whose component is not finite.
    pub fn new(velocities: impl Into<Arc<[[f64; D]]>>, epsilon: Epsilon, volumes: &Volumes) -> Result<Self> {
        let mut upwind = Self { half: HalfSpace::new(epsilon, volumes), velocities: Arc::new([]) };
        upwind.set_velocities(velocities)?;
        Ok(upwind)
    }

    /// Replaces the velocities, for rows built from now on.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn set_velocities(&mut self, velocities: impl Into<Arc<[[f64; D]]>>) -> Result<()> {
        let velocities = velocities.into();
        for (p, v) in velocities.iter().enumerate() {
            if let Some((axis, &velocity)) = v.iter().enumerate().find(|(_, v)| !v.is_finite()) {
                return Err(Error::from(ParticleError::Velocity { axis, velocity }).at(p));
            }
        }
        self.velocities = velocities;
        Ok(())
    }

    /// The velocities.
    pub fn velocities(&self) -> &[[f64; D]] {
        &self.velocities
    }
}

half_space_settings!(Upwind);

/// Working memory of [`Upwind`] and [`UpwindGradient`].
#[derive(Clone, Debug, Default)]
pub struct UpwindScratch<const D: usize>(HalfScratch<D>);

impl<const D: usize> Method<D> for Upwind<D> {
    type Out = [f64; 1];
    type Scratch = UpwindScratch<D>;

    fn scratch(&self) -> Result<UpwindScratch<D>> {
        Ok(UpwindScratch::default())
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        let found = self.velocities.len();
        if found != targets {
            return Err(ParticleError::Length { found, needed: targets }.into());
        }
        self.half.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        Ok(Some(self.half.epsilon.get(p)? * self.half.support))
    }

    /// # Errors
    /// [`OperatorError::EmptySide`] where nothing is on the side a component comes from.
    fn weights(
        &self,
        row: &Stencil<D>,
        UpwindScratch(half): &mut UpwindScratch<D>,
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        let inverse = self.half.prepare(row, half)?;
        let found = self.velocities.len();
        let velocity = self.velocities.get(row.target()).ok_or(OperatorError::Length { found, index: row.target() })?;
        w.fill([0.0]);
        for (axis, &v) in velocity.iter().enumerate() {
            let Some(side) = Side::upwind(v) else { continue };
            half.slope(axis, side)?;
            for (w, &slope) in w.iter_mut().zip(&half.w) {
                w[0] += v * (slope * inverse);
            }
        }
        diagonal[0] = 0.0;
        for (w, &sign) in w.iter_mut().zip(row.signs()) {
            let (weight, share) = spread(w[0], -w[0], sign);
            w[0] = weight;
            diagonal[0] += share;
        }
        finite(row, w.iter().map(<[f64; 1]>::as_slice), diagonal)
    }

    fn report(
        &self,
        row: &Stencil<D>,
        UpwindScratch(half): &UpwindScratch<D>,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
    ) -> Result<RowReport> {
        let mut report = self.half.report(row, half, w, diagonal)?;
        report.order = Some(1);
        Ok(report)
    }
}

/// The derivatives along all axes from both sides, to order 1: what [`UpwindRows`](crate::UpwindRows) holds, for
/// velocities given with every application.
///
/// Output i at a source on the left is the weight of d/dx_i from the left, below zero, and on the right that from the
/// right, above zero: its sign tells the side, so that D weights a pair serve every velocity. As the sum of two
/// derivatives the rows themselves are none; that is why they are wrapped.
#[derive(Clone, Debug)]
pub struct UpwindGradient<const D: usize> {
    half: HalfSpace,
    /// Where there is one, sides that it does not come from have no weights.
    flow: Option<Arc<[[f64; D]]>>,
}

impl<const D: usize> UpwindGradient<D> {
    /// The derivatives with this smoothing length and these volumes.
    pub fn new(epsilon: Epsilon, volumes: &Volumes) -> Self {
        Self { half: HalfSpace::new(epsilon, volumes), flow: None }
    }

    /// The derivatives from the sides alone that these velocities, one per target, come from: a flow that stays has no use for
    /// the others, however irregular they are.
    pub(crate) fn of_flow(&self, velocities: Vec<[f64; D]>) -> Self {
        Self { flow: Some(velocities.into()), ..self.clone() }
    }
}

half_space_settings!(UpwindGradient);

impl<const D: usize> Method<D> for UpwindGradient<D> {
    type Out = [f64; D];
    type Scratch = UpwindScratch<D>;

    fn scratch(&self) -> Result<UpwindScratch<D>> {
        Ok(UpwindScratch::default())
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        self.half.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        Ok(Some(self.half.epsilon.get(p)? * self.half.support))
    }

    /// # Errors
    /// [`OperatorError::OddImage`] for an image behind an odd number of odd mirrors, whose sign would hide the side.
    fn weights(
        &self,
        row: &Stencil<D>,
        UpwindScratch(half): &mut UpwindScratch<D>,
        w: &mut [[f64; D]],
        diagonal: &mut [f64; D],
    ) -> Result<()> {
        let inverse = self.half.prepare(row, half)?;
        if let Some(odd) = row.iter().find(|neighbor| neighbor.sign != 1) {
            return Err(OperatorError::OddImage { q: odd.q }.into());
        }
        let velocity = self.flow.as_ref().and_then(|flow| flow.get(row.target()));
        *diagonal = [0.0; D];
        w.fill([0.0; D]);
        for axis in 0..D {
            for side in [Side::Left, Side::Right] {
                let wanted = velocity.is_none_or(|v| Side::upwind(v[axis]) == Some(side));
                // An empty side is refused when a velocity asks for it.
                if wanted && half.z.iter().any(|z| on_side(z, axis, side)) {
                    half.slope(axis, side)?;
                    w.iter_mut().zip(&half.w).for_each(|(w, &slope)| w[axis] += slope * inverse);
                }
            }
        }
        finite(row, w.iter().map(<[f64; D]>::as_slice), diagonal)
    }

    fn report(
        &self,
        row: &Stencil<D>,
        UpwindScratch(half): &UpwindScratch<D>,
        w: &[[f64; D]],
        diagonal: &[f64; D],
    ) -> Result<RowReport> {
        let mut report = self.half.report(row, half, w, diagonal)?;
        report.order = Some(1);
        Ok(report)
    }
}
