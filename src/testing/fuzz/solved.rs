//! DC-PSE from bytes: the moment conditions of every row, summed anew from its weights.

use nalgebra::DMatrix;

use super::Checked;
use super::fault::{FuzzFault, close};
use super::operator::PerParticle;
use super::row::{Judge, Made, supports};
use crate::error::{Error, ErrorKind, OperatorError};
use crate::multi_index::{MultiIndex, Term, graded};
use crate::neighbors::{NeighborList, Neighbors};
use crate::operator::CUTOFF_OVER_EPSILON;
use crate::scalar::square;
use crate::stencil::Stencil;

/// What [`DcPse`](crate::DcPse) was made of.
pub(super) struct Corrected<const D: usize> {
    pub(super) terms: Vec<Term<D>>,
    pub(super) degree: u32,
    pub(super) order: u32,
    /// The sign between the two values of a pair.
    pub(super) sigma: f64,
    pub(super) impose_zeroth: bool,
    pub(super) ratio: f64,
    pub(super) epsilon: Option<PerParticle>,
    /// Condition numbers below this are no excuse for a refusal.
    pub(super) safe: f64,
}

impl<const D: usize> Corrected<D> {
    fn low(&self, particle: bool) -> u32 {
        u32::from(particle && self.sigma < 0.0 && !self.impose_zeroth)
    }

    fn conditions(&self, particle: bool) -> usize {
        graded::<D>(self.low(particle), self.degree + self.order - 1).count()
    }

    fn epsilon(&self, stencil: &Stencil<D>) -> f64 {
        match &self.epsilon {
            Some(epsilon) => epsilon.get(stencil.target()),
            None => stencil.cutoff() / CUTOFF_OVER_EPSILON,
        }
    }

    fn needed(&self, conditions: usize) -> usize {
        (self.ratio * conditions as f64).ceil() as usize
    }

    /// b_alpha = (-1)^m c alpha!.
    fn required(&self, alpha: MultiIndex<D>) -> f64 {
        let factorial: f64 = alpha.exponents().iter().flat_map(|&e| 1..=e).map(f64::from).product();
        let own = self.terms.iter().filter(|term| term.index == alpha);
        own.map(|term| f64::from(alpha.sign()) * term.factor * factorial).sum()
    }

    fn largest(&self) -> f64 {
        self.terms.iter().fold(0.0, |largest, term| self.required(term.index).abs().max(largest))
    }

    /// The condition number of the windowed monomials, which is large on slivers and in clusters too, where weights are.
    fn condition(&self, stencil: &Stencil<D>, itself: bool) -> f64 {
        let inverse = 1.0 / self.epsilon(stencil);
        let mut z: Vec<[f64; D]> = stencil.separations().iter().map(|s| s.map(|x| x * inverse)).collect();
        if itself {
            z.push([0.0; D]);
        }
        let low = self.low(stencil.center().is_some());
        let alphas: Vec<_> = graded::<D>(low, self.degree + self.order - 1).collect();
        let matrix =
            DMatrix::from_fn(z.len(), alphas.len(), |q, j| alphas[j].power(&z[q]) * (-0.5 * square(&z[q])).exp());
        if matrix.nrows() < matrix.ncols() || !matrix.iter().all(|x| x.is_finite()) {
            return f64::INFINITY;
        }
        let values = matrix.singular_values();
        values.max() / values.min()
    }
}

impl<const D: usize> Judge<D> for Corrected<D> {
    const BUILD: &'static str = "DcPse";
    const MAY_LEAVE_EMPTY: bool = true;

    fn deserves(&mut self, error: &Error, list: &NeighborList<D>) -> bool {
        let Some(p) = error.particle().filter(|&p| p < list.targets()) else { return false };
        let stencils = supports(list, p, list.cutoff(p));
        let particle = list.center(p).is_some();
        let itself = particle && self.sigma > 0.0;
        let own = self.conditions(particle);
        let ErrorKind::Operator(kind) = error.kind() else { return false };
        match *kind {
            OperatorError::TooFew { neighbors, conditions, needed } => {
                let alike = stencils.iter().any(|stencil| stencil.len() + usize::from(itself) == neighbors);
                alike && conditions == own && needed == self.needed(own) && neighbors < needed
            }
            OperatorError::Window { ratio, low, high } => {
                let alike = stencils.iter().any(|stencil| stencil.cutoff() / self.epsilon(stencil) == ratio);
                (low, high) == (1.0, 6.0) && alike && !(low <= ratio && ratio <= high)
            }
            OperatorError::OnePlace { neighbors } => stencils
                .iter()
                .any(|stencil| stencil.len() == neighbors && stencil.separations().iter().all(|s| square(s) == 0.0)),
            OperatorError::Uncertified { neighbors, conditions, rank, condition, residual, .. } => {
                let alike = stencils.iter().rev().find(|stencil| stencil.len() == neighbors);
                // Such a residual is within all gates, because the terms add up to max|b| at least.
                let unit = f64::EPSILON * own as f64 * self.largest();
                let gates =
                    (4.0 * condition.max(1.0) * unit).min(29.0 * unit).min(f64::EPSILON.sqrt() * self.largest());
                conditions == own
                    && rank <= conditions
                    && !(residual <= gates)
                    && alike.is_some_and(|stencil| !(self.condition(stencil, itself) < self.safe))
            }
            _ => false,
        }
    }

    fn certify(&mut self, made: &Made<D>) -> Checked {
        let Made { p, stencil, weights, diagonal, report, eps, least } = *made;
        let epsilon = self.epsilon(stencil);
        let particle = stencil.center().is_some();
        let order = report.order.unwrap_or(0);
        if order > self.order || (order < self.order && report.lowered == 0) {
            let (found, required) = (f64::from(order), f64::from(self.order));
            return Err(FuzzFault::Number { what: "the order", p, found, required, tolerance: 0.0 });
        }
        let power = |value: f64| (0..self.degree).fold(value, |product, _| product * epsilon);
        let solved: Vec<f64> =
            stencil.signs().iter().zip(weights).map(|(&sign, w)| power(w * f64::from(sign))).collect();
        let least = power(least);
        let gate = f64::EPSILON.sqrt() * self.largest();
        if !(report.residual <= gate) {
            return Err(FuzzFault::Accepted { build: "DcPse", p, value: report.residual });
        }
        // Weights, powers and sums round once a factor or term.
        let count = stencil.len() as f64 + f64::from(2 * self.degree + 3 * (self.degree + order)) + 8.0;
        for alpha in graded::<D>(self.low(particle), (self.degree + order).saturating_sub(1)) {
            let (mut sum, mut size, mut lost) = (0.0, 0.0, 0.0);
            for (separation, w) in stencil.separations().iter().zip(&solved) {
                let power = alpha.power(&separation.map(|s| s / epsilon));
                sum += w * power;
                size += (w * power).abs();
                lost += least * power.abs();
            }
            if alpha == MultiIndex::ZERO && particle && self.sigma > 0.0 {
                // The particle itself stands in the conditions; what the diagonal holds beyond the pairs is twice its weight.
                let (mut pairs, mut terms) = (0.0, 0.0);
                for (&sign, w) in stencil.signs().iter().zip(&solved) {
                    pairs += w * f64::from(sign) + w;
                    terms += 2.0 * w.abs();
                }
                sum += 0.5 * (power(diagonal) - pairs);
                size += terms + power(diagonal).abs();
                lost += least;
            }
            let tolerance = 1.001 * report.residual + 2.0 * count * eps * size + 2.0 * lost;
            close("a moment", p, sum, self.required(alpha), tolerance)?;
        }
        if particle && self.sigma < 0.0 {
            // With '-' only odd images leave something: 2 sum of their weights, both parts of a pair.
            let odd = || stencil.signs().iter().zip(weights).filter(|(sign, _)| **sign < 0).map(|(_, w)| 2.0 * w);
            let tolerance = 2.0 * count * eps * odd().map(f64::abs).sum::<f64>();
            close("a diagonal", p, diagonal, odd().sum(), tolerance)?;
        }
        Ok(())
    }
}
