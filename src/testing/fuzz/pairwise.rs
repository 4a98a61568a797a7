//! PSE from bytes: weights by the formula, overlap and moments of every row.

use super::Checked;
use super::fault::{FuzzFault, close};
use super::operator::PerParticle;
use super::row::{Judge, Made};
use crate::error::{Error, ErrorKind, OperatorError};
use crate::kernel::{Exchange, Kernel};
use crate::multi_index::MultiIndex;
use crate::neighbors::{NeighborList, Neighbors};
use crate::operator::Allowance;
use crate::stencil::Stencil;

/// h/epsilon may exceed its limit by round-off: 1e-12 as documented, and some eps of ours.
const ROUND_OFF: f64 = 1.1e-12;

/// What [`Pse`](crate::Pse) was made of.
pub(super) struct Exchanged<const D: usize> {
    pub(super) kernel: Exchange<D>,
    pub(super) epsilon: PerParticle,
    pub(super) volumes: PerParticle,
    pub(super) support: f64,
    pub(super) tolerance: f64,
    pub(super) allowance: Allowance,
    /// The sign between the two values of a pair.
    pub(super) sigma: f64,
}

/// Figures of a row, and how far rounding may take the moments.
struct Figures {
    h_over_epsilon: f64,
    defect: f64,
    rounding: f64,
}

impl<const D: usize> Exchanged<D> {
    fn degree(&self) -> u32 {
        Kernel::<f64, D>::terms(&self.kernel).first().map_or(0, |term| term.index.degree())
    }

    fn limit(&self) -> f64 {
        Kernel::<f64, D>::overlap_limit(&self.kernel)
    }

    fn figures(&self, p: usize, stencil: &Stencil<D>) -> Figures {
        let inverse = 1.0 / self.epsilon.get(p);
        let volume = |q: usize| (0..D).fold(self.volumes.get(q), |v, _| v * inverse);
        let terms = Kernel::<f64, D>::terms(&self.kernel);
        // The terms of an operator here are all of one kind, so each is held to its own b_alpha = (-1)^m alpha!.
        let mut alphas: Vec<_> = terms.iter().map(|term| (term.index, true)).collect();
        if self.sigma > 0.0 {
            alphas.push((MultiIndex::ZERO, false));
        }
        let (mut defect, mut rounding) = (0.0_f64, 0.0_f64);
        for (alpha, term) in alphas {
            let factorial: f64 = alpha.exponents().iter().flat_map(|&e| 1..=e).map(f64::from).product();
            let required = if term { f64::from(alpha.sign()) * factorial } else { 0.0 };
            let (mut sum, mut size) = (0.0, 0.0);
            for neighbor in stencil.iter() {
                let z = neighbor.separation.map(|s| s * inverse);
                let weight = volume(neighbor.q) * self.kernel.value(&z);
                if weight != 0.0 {
                    sum += weight * alpha.power(&z);
                    size += (weight * alpha.power(&z)).abs();
                }
            }
            // M_0 is no condition of the kernel: it counts as it is.
            let unit = if term { factorial } else { 1.0 };
            let miss: f64 = sum - required;
            (defect, rounding) = (worse(defect, miss.abs() / unit), worse(rounding, size / unit));
        }
        let own = stencil.center().map_or(0.0, volume);
        let rounding = 8.0 * (stencil.len() as f64 + 8.0) * f64::EPSILON * rounding;
        Figures { h_over_epsilon: own.powf(1.0 / D as f64), defect, rounding }
    }

    /// Whether a limit is certainly broken, or kept.
    fn breaks(&self, figures: &Figures) -> Option<bool> {
        let Figures { h_over_epsilon, defect, rounding } = *figures;
        let overlap = h_over_epsilon / self.limit() - 1.0;
        if overlap > ROUND_OFF || defect - rounding > self.tolerance || !(overlap.is_finite() && defect.is_finite()) {
            Some(true)
        } else if overlap <= 0.0 && defect + rounding <= self.tolerance {
            Some(false)
        } else {
            None
        }
    }
}

fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl<const D: usize> Judge<D> for Exchanged<D> {
    const BUILD: &'static str = "Pse";

    fn deserves(&mut self, error: &Error, list: &NeighborList<D>) -> bool {
        let Some(p) = error.particle().filter(|&p| p < list.targets() && !self.allowance.covers(p)) else {
            return false;
        };
        let mut stencil = Stencil::default();
        list.gather(p, self.epsilon.get(p) * self.support, &mut stencil);
        let figures = self.figures(p, &stencil);
        let near =
            |found: f64, own: f64, slack: f64| !found.is_finite() && !own.is_finite() || (found - own).abs() <= slack;
        match *error.kind() {
            ErrorKind::Operator(OperatorError::Overlap { h_over_epsilon, limit }) => {
                let own = figures.h_over_epsilon;
                limit == self.limit()
                    && !(h_over_epsilon <= limit)
                    && near(h_over_epsilon, own, 8.0 * f64::EPSILON * own)
            }
            ErrorKind::Operator(OperatorError::Moment { defect, limit }) => {
                limit == self.tolerance && !(defect <= limit) && near(defect, figures.defect, 2.0 * figures.rounding)
            }
            _ => false,
        }
    }

    fn certify(&mut self, made: &Made<D>) -> Checked {
        let Made { p, stencil, weights, diagonal, report, eps, least } = *made;
        let inverse = 1.0 / self.epsilon.get(p);
        let power = |value: f64, count: u32| (0..count).fold(value, |product, _| product * inverse);
        let (mut own, mut size) = (0.0, 0.0);
        for (neighbor, &w) in stencil.iter().zip(weights) {
            let z = neighbor.separation.map(|s| s * inverse);
            let volume = power(self.volumes.get(neighbor.q), D as u32);
            let pair = volume * (self.kernel.value(&z) * power(1.0, self.degree()));
            let weight = pair * f64::from(neighbor.sign);
            // Each factor rounds once.
            let tolerance = 2.0 * f64::from(2 * self.degree() + D as u32 + 2) * eps * weight.abs() + 2.0 * least;
            close("a weight", p, w, weight, tolerance)?;
            own += weight + self.sigma * pair;
            size += 2.0 * pair.abs();
        }
        let slack = 2.0 * (stencil.len() as f64 + 8.0) * (eps * size + least);
        close("a diagonal", p, diagonal, own, slack)?;
        let figures = self.figures(p, stencil);
        if self.breaks(&figures) == Some(true) && !self.allowance.covers(p) {
            return Err(FuzzFault::Accepted { build: "Pse", p, value: figures.defect });
        }
        let reported = [
            ("h/epsilon", report.h_over_epsilon, figures.h_over_epsilon * (1.0 - 8.0 * f64::EPSILON)),
            ("the moment defect", report.moment_defect, figures.defect - 2.0 * figures.rounding),
        ];
        for (what, found, required) in reported {
            if found < required {
                return Err(FuzzFault::Number { what, p, found, required, tolerance: 0.0 });
            }
        }
        let kept = self.breaks(&figures) == Some(false);
        if kept && report.worst_rows().any(|row| row.target == p && row.breach.is_some()) {
            return Err(FuzzFault::Number {
                what: "a breach",
                p,
                found: figures.defect,
                required: 0.0,
                tolerance: self.tolerance,
            });
        }
        Ok(())
    }
}
