//! What one-sided derivatives share: the settings, and the first derivative whose weights keep their sign.

use nalgebra::SMatrix;

use super::allowance::Allowance;
use super::pair_report::worse;
use super::pairwise::{MOMENT_TOLERANCE, positive, times};
use super::row_report::{Breach, RowReport};
use crate::error::{OperatorError, ParticleError, Result};
use crate::scalar::square;
use crate::scale::{Epsilon, Volumes};
use crate::stencil::{Side, Stencil};

/// The support radius, in units of epsilon.
const SUPPORT: f64 = 6.0;

/// The farthest, in units of epsilon, that the Gaussian is moved across the axis: half its support.
const FARTHEST: f64 = 3.0;

/// The longest of Newton's steps to its center, in units of epsilon, and the most of them: six to the farthest, then
/// quadratic convergence.
const LONGEST: f64 = 0.5;
const STEPS: usize = 16;

/// First moments across below this part of their absolute terms are rounding of the sum.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A component below this part of a separation is rounding, as that of lattices which are turned.
const ACROSS: f64 = 1e-12;

/// The settings of one-sided derivatives.
#[derive(Clone, Debug)]
pub(super) struct HalfSpace {
    pub(super) epsilon: Epsilon,
    pub(super) volumes: Volumes,
    pub(super) support: f64,
    pub(super) tolerance: f64,
    pub(super) allowance: Allowance,
}

/// Scaled separations, V_q epsilon^-D, and the weights of one side.
#[derive(Clone, Debug, Default)]
pub(super) struct HalfScratch<const D: usize> {
    pub(super) z: Vec<[f64; D]>,
    pub(super) volume: Vec<f64>,
    pub(super) w: Vec<f64>,
    /// The largest first moment across, of the weights made since `prepare`.
    pub(super) defect: f64,
}

impl HalfSpace {
    pub(super) fn new(epsilon: Epsilon, volumes: &Volumes) -> Self {
        Self {
            epsilon,
            volumes: volumes.clone(),
            support: SUPPORT,
            tolerance: MOMENT_TOLERANCE,
            allowance: Allowance::Nowhere,
        }
    }

    pub(super) fn set_support(&mut self, radius: f64) -> Result<()> {
        self.support = positive(radius)?;
        Ok(())
    }

    pub(super) fn set_tolerance(&mut self, tolerance: f64) -> Result<()> {
        self.tolerance = positive(tolerance)?;
        Ok(())
    }

    pub(super) fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        for (held, needed) in [(self.epsilon.len(), targets), (self.volumes.len(), sources)] {
            if let Some(found) = held.filter(|&found| found != needed) {
                return Err(ParticleError::Length { found, needed }.into());
            }
        }
        Ok(())
    }

    /// Fills the scratch for a row and returns 1/epsilon.
    pub(super) fn prepare<const D: usize>(&self, row: &Stencil<D>, scratch: &mut HalfScratch<D>) -> Result<f64> {
        if row.center().is_none() {
            return Err(OperatorError::NoCenter { neighbors: row.len() }.into());
        }
        let inverse = 1.0 / self.epsilon.get(row.target())?;
        scratch.z.clear();
        scratch.z.extend(row.separations().iter().map(|s| s.map(|x| x * inverse)));
        scratch.volume.clear();
        for &q in row.sources() {
            scratch.volume.push(times(self.volumes.get(q as usize)?, inverse, D));
        }
        scratch.w.clear();
        scratch.w.resize(row.len(), 0.0);
        scratch.defect = 0.0;
        Ok(inverse)
    }

    /// The general report, with h/epsilon, the defect across and the breach there may be.
    pub(super) fn report<const D: usize, const K: usize>(
        &self,
        row: &Stencil<D>,
        scratch: &HalfScratch<D>,
        w: &[[f64; K]],
        diagonal: &[f64; K],
    ) -> Result<RowReport> {
        let mut report = RowReport::of(row, w, diagonal);
        if let Some(center) = row.center() {
            let volume = times(self.volumes.get(center)?, 1.0 / self.epsilon.get(row.target())?, D);
            report.h_over_epsilon = volume.powf(1.0 / D as f64);
        }
        let signed = w.iter().zip(row.signs()).flat_map(|(w, &sign)| w.map(|w| w * f64::from(sign)));
        report.negative_weights = signed.filter(|&w| w < 0.0).count();
        report.moment_defect = scratch.defect;
        let kept = scratch.defect <= self.tolerance;
        report.breach = (!kept).then_some(Breach::Moment { defect: scratch.defect, limit: self.tolerance });
        report.allowed = report.breach.is_some() && self.allowance.covers(row.target());
        Ok(report)
    }
}

impl<const D: usize> HalfScratch<D> {
    /// Writes into `w` the weights of d/dx_axis from the sources on `side`, in units of 1/epsilon,
    /// w_q = -/+ V_q |z_axis| exp(-|z - c|^2) / M (minus on the left), M being what makes sum_q w_q z_axis = -1. Every
    /// weight of a side has the same sign, and those of the other side are zero.
    ///
    /// c, across the axis, makes the first moments across vanish, so that linear functions are exact; it is zero where
    /// they do so by themselves, as on lattices. Where no |c| <= 3 does, c = 0 and the defect says what is left.
    ///
    /// # Errors
    /// [`OperatorError::EmptySide`] without a source on that side.
    pub(super) fn slope(&mut self, axis: usize, side: Side) -> Result<()> {
        let Self { z, volume, w, defect } = self;
        let mut empty = true;
        for ((w, z), &volume) in w.iter_mut().zip(z.iter()).zip(volume.iter()) {
            *w = 0.0;
            if on_side(z, axis, side) {
                empty = false;
                *w = volume * (side.sign() * z[axis]) * (-square(z)).exp();
            }
        }
        if empty {
            return Err(OperatorError::EmptySide { axis, side, neighbors: z.len() }.into());
        }
        if D > 1
            && let Some(c) = center(axis, z, w)
            && c != [0.0; D]
        {
            w.iter_mut().zip(z.iter()).for_each(|(w, z)| *w *= (2.0 * dot(&c, z)).exp());
        }
        let first: f64 = w.iter().zip(z.iter()).map(|(w, z)| w * z[axis]).sum();
        let factor = -1.0 / first;
        w.iter_mut().for_each(|w| *w *= factor);
        for across in (0..D).filter(|&across| across != axis) {
            let moment: f64 = w.iter().zip(z.iter()).map(|(w, z)| w * z[across]).sum();
            *defect = worse(*defect, moment.abs());
        }
        Ok(())
    }
}

/// Whether a separation leads to a side of an axis, and not across it but for the rounding of coordinates.
#[inline(always)]
pub(super) fn on_side<const D: usize>(z: &[f64; D], axis: usize, side: Side) -> bool {
    let along = side.sign() * z[axis];
    z.iter().all(|x| along > ACROSS * x.abs())
}

#[inline(always)]
fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The c with c_axis = 0 and sum_q g_q z_i exp(2 c . z) = 0 for every other i: where a convex function, the logarithm of
/// sum_q g_q exp(2 c . z), is least, by Newton's method from zero. `None` where |c| would exceed its limit.
fn center<const D: usize>(axis: usize, z: &[[f64; D]], g: &[f64]) -> Option<[f64; D]> {
    let mut c = [0.0; D];
    let (mut longest, mut last) = (LONGEST, SMatrix::<f64, D, 1>::zeros());
    for _ in 0..STEPS {
        let (mut total, mut size) = (0.0, 0.0);
        let mut first = SMatrix::<f64, D, 1>::zeros();
        let mut second = SMatrix::<f64, D, D>::zeros();
        for (&g, z) in g.iter().zip(z).filter(|(g, _)| **g > 0.0) {
            let g = if c == [0.0; D] { g } else { g * (2.0 * dot(&c, z)).exp() };
            total += g;
            for i in (0..D).filter(|&i| i != axis) {
                let gi = g * z[i];
                first[i] += gi;
                size += gi.abs();
                for j in (0..D).filter(|&j| j != axis) {
                    second[(i, j)] += gi * z[j];
                }
            }
        }
        // On lattices nothing is left above rounding, and the center stays.
        if first.iter().all(|moment| moment.abs() <= ROUNDING * size) {
            return Some(c);
        }
        let mean = first / total;
        let mut spread = (second / total - mean * mean.transpose()) * 2.0;
        spread[(axis, axis)] = 1.0;
        let step = spread.try_inverse()? * mean;
        // Half an epsilon a step at most, so that a step too far does not end the search; less after a step back, so that
        // sources in two groups far apart do not send it to and fro.
        if step.dot(&last) < 0.0 {
            longest *= 0.5;
        }
        last = step;
        let shorter = 1.0_f64.min(longest / step.norm());
        c.iter_mut().zip(step.iter()).for_each(|(c, step)| *c -= shorter * step);
        if !(dot(&c, &c) <= FARTHEST * FARTHEST) {
            return None;
        }
    }
    None
}

/// The settings that every method built on [`HalfSpace`] has in its field `half`.
macro_rules! half_space_settings {
    ($name:ident) => {
        impl<const D: usize> $name<D> {
            /// Cuts the kernel off at `radius` (in units of epsilon) in place of 6.
            ///
            /// # Errors
            /// [`OperatorError::Setting`](crate::OperatorError::Setting) where it is not positive.
            pub fn support(mut self, radius: f64) -> Result<Self> {
                self.half.set_support(radius)?;
                Ok(self)
            }

            /// Sets the largest first moment across the axis, relative to the one along it; 0.05 by default.
            ///
            /// # Errors
            /// [`OperatorError::Setting`](crate::OperatorError::Setting) where it is not positive.
            pub fn moment_tolerance(mut self, tolerance: f64) -> Result<Self> {
                self.half.set_tolerance(tolerance)?;
                Ok(self)
            }

            /// Allows rows to break the limit of the moments across; the report counts them.
            #[must_use]
            pub fn allow(mut self, allowance: Allowance) -> Self {
                self.half.allowance = allowance;
                self
            }

            /// The smoothing length.
            pub fn epsilon(&self) -> &Epsilon {
                &self.half.epsilon
            }

            /// The cutoff a provider must be built with: the support radius times the largest epsilon.
            pub fn cutoff(&self) -> Cutoff {
                self.half.epsilon.cutoff(self.half.support)
            }
        }
    };
}

pub(super) use half_space_settings;
