//! Upwind derivatives from bytes: one sign, one side, and linear functions.

use super::Checked;
use super::fault::{FuzzFault, close};
use super::operator::PerParticle;
use super::row::{Judge, Made};
use crate::error::{Error, ErrorKind, OperatorError};
use crate::neighbors::{NeighborList, Neighbors};
use crate::operator::Allowance;
use crate::stencil::{Side, Stencil};

/// What [`Upwind`](crate::Upwind) was made of.
pub(super) struct OneWay<const D: usize> {
    pub(super) velocities: Vec<[f64; D]>,
    pub(super) epsilon: PerParticle,
    pub(super) support: f64,
    pub(super) tolerance: f64,
    pub(super) allowance: Allowance,
}

impl<const D: usize> Judge<D> for OneWay<D> {
    const BUILD: &'static str = "Upwind";

    fn deserves(&mut self, error: &Error, list: &NeighborList<D>) -> bool {
        let Some(p) = error.particle().filter(|&p| p < list.targets()) else { return false };
        let mut stencil = Stencil::default();
        list.gather(p, self.epsilon.get(p) * self.support, &mut stencil);
        let inverse = 1.0 / self.epsilon.get(p);
        match *error.kind() {
            ErrorKind::Operator(OperatorError::EmptySide { axis, side, neighbors }) => {
                let on = stencil.separations().iter().any(|s| {
                    let along = side.sign() * (s[axis] * inverse);
                    s.iter().all(|x| along > 1e-12 * (x * inverse).abs())
                });
                neighbors == stencil.len() && Side::upwind(self.velocities[p][axis]) == Some(side) && !on
            }
            ErrorKind::Operator(OperatorError::Moment { defect, limit }) => {
                limit == self.tolerance && !(defect <= limit) && !self.allowance.covers(p) && D > 1
            }
            _ => false,
        }
    }

    fn certify(&mut self, made: &Made<D>) -> Checked {
        let Made { p, stencil, weights, diagonal, report, eps, least } = *made;
        let v = self.velocities[p];
        let signed: Vec<f64> = stencil.signs().iter().zip(weights).map(|(&sign, w)| w * f64::from(sign)).collect();
        let lost: f64 = stencil.signs().iter().zip(&signed).filter(|(sign, _)| **sign < 0).map(|(_, w)| -2.0 * w).sum();
        close("a diagonal", p, diagonal, lost, 2.0 * (stencil.len() as f64 + 2.0) * eps * lost.abs())?;
        for (separation, &w) in stencil.separations().iter().zip(&signed) {
            let along = |axis: usize| Side::upwind(v[axis]).map_or(0.0, Side::sign) * separation[axis];
            let upwind = (0..D).any(|axis| along(axis) > 0.0);
            if w > 0.0 || (w != 0.0 && !upwind) {
                return Err(FuzzFault::Accepted { build: "Upwind", p, value: w });
            }
        }
        if self.allowance == Allowance::Nowhere && !(report.moment_defect <= self.tolerance) {
            return Err(FuzzFault::Accepted { build: "Upwind", p, value: report.moment_defect });
        }
        for axis in 0..D {
            let slopes = || stencil.separations().iter().zip(&signed).map(|(s, w)| -w * s[axis]);
            let others: f64 = (0..D).filter(|&other| other != axis).map(|other| v[other].abs()).sum();
            let size: f64 = slopes().map(f64::abs).sum::<f64>() + v[axis].abs();
            // Each weight is a sum of D products of five factors, and the moment a sum of n terms; of a velocity near the
            // least number only multiples of that are left.
            let lost: f64 = stencil.separations().iter().map(|s| 1.0 + (D + 1) as f64 * s[axis].abs()).sum();
            let rounding = 4.0 * (stencil.len() as f64 + 8.0) * eps * size + lost * least;
            close("a slope", p, slopes().sum(), v[axis], others * report.moment_defect * 1.001 + rounding)?;
        }
        Ok(())
    }
}
