//! What is checked and known of a row of fixed kernels: overlap, moments, eigenvalues.

use super::pairwise::{PairScratch, Pairing, Pairwise, times};
use super::row_report::{Breach, RowReport};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::moment::required_moment;
use crate::multi_index::{MultiIndex, Term, graded};
use crate::stencil::Stencil;

/// An overlap limit is a design figure; a spacing computed from a volume may exceed it by round-off.
const ROUND_OFF: f64 = 1e-12;

impl<K, const N: usize> Pairwise<K, N> {
    /// What is known of the row just written, see [`Method::report`](super::Method::report).
    pub(super) fn report<const D: usize>(
        &self,
        row: &Stencil<D>,
        scratch: &PairScratch<D>,
        w: &[[f64; N]],
        diagonal: &[f64; N],
    ) -> Result<RowReport>
    where
        K: Kernel<f64, D>,
    {
        let mut report = RowReport::of(row, w, diagonal);
        report.h_over_epsilon = self.h_over_epsilon(row, scratch)?;
        for n in 0..N {
            report.moment_defect = worse(report.moment_defect, self.moment_defect(n, row, scratch)?);
            report.lower_moment = worse(report.lower_moment, self.lower_moment(n, scratch)?);
        }
        report.negative_weights = scratch.eta.iter().filter(|&&eta| eta < 0.0).count();
        report.spectral_bound = self.spectral_bound(row, scratch)?;
        report.breach = self.breach(report.h_over_epsilon, report.moment_defect);
        report.allowed = report.breach.is_some() && self.allowance.covers(row.target());
        Ok(report)
    }

    /// h/epsilon at the target: h from its own volume, or from the mean volume of its neighbors off the particles.
    fn h_over_epsilon<const D: usize>(&self, row: &Stencil<D>, scratch: &PairScratch<D>) -> Result<f64> {
        let inverse = 1.0 / self.epsilon.get(row.target())?;
        let volume = match row.center() {
            Some(center) => times(self.volumes.get(center)?, inverse, D),
            None => scratch.volume.iter().sum::<f64>() / (row.len().max(1) as f64),
        };
        Ok(volume.powf(1.0 / D as f64))
    }

    /// M_alpha = sum_q V_q epsilon^-D z_q^alpha eta(z_q) of output n, images without their sign.
    fn moment<const D: usize>(&self, n: usize, alpha: MultiIndex<D>, scratch: &PairScratch<D>) -> f64 {
        let pairs = scratch.z.iter().zip(&scratch.volume).zip(scratch.eta_of(n));
        // Where the kernel underflows z^alpha may overflow: zero times infinity must not enter.
        let weights = pairs.map(|((z, volume), eta)| (z, volume * eta));
        weights.filter(|&(_, weight)| weight != 0.0).map(|(z, weight)| weight * alpha.power(z)).sum()
    }

    /// The largest moment below the degree of the operator, relative to the largest required one.
    fn lower_moment<const D: usize>(&self, n: usize, scratch: &PairScratch<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let terms = self.kernels[n].terms();
        let mut largest = 0.0;
        for term in terms {
            largest = worse(largest, required_moment(terms, term.index)?.abs());
        }
        let lower = graded(1, self.degree.saturating_sub(1)).map(|alpha| self.moment(n, alpha, scratch).abs());
        let lower = lower.fold(0.0, worse);
        Ok(if largest > 0.0 { lower / largest } else { lower })
    }

    /// The defect of one kernel's moments: the M_beta of its terms relative to the largest one required, and M_0
    /// where the pairing leaves M_0 f_p in the result.
    fn moment_defect<const D: usize>(&self, n: usize, row: &Stencil<D>, scratch: &PairScratch<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let kernel = &self.kernels[n];
        let moment = |alpha| self.moment(n, alpha, scratch);
        let (mut defect, mut largest) = (0.0_f64, 0.0_f64);
        if self.degree > 0 {
            for &Term { index, .. } in kernel.terms() {
                let required = required_moment(kernel.terms(), index)?;
                largest = largest.max(required.abs());
                defect = worse(defect, (moment(index) - required).abs());
            }
            // A zero operator requires nothing but zeros: then the defect is absolute.
            if largest > 0.0 {
                defect /= largest;
            }
        }
        let zeroth = match self.pairing {
            Pairing::Difference => 0.0,
            Pairing::Sum => moment(MultiIndex::ZERO),
            Pairing::Summation => {
                let required = if self.degree == 0 { 1.0 } else { 0.0 };
                moment(MultiIndex::ZERO) + self.own(kernel, row)? - required
            }
        };
        Ok(worse(defect, zeroth.abs()))
    }

    /// Bound on the eigenvalues: S_p = sum_q V_q eta (q = p included) for a positive definite kernel of one epsilon
    /// (errata 26; its matrix K has no negative eigenvalue, so diag(S) - K has none above S), otherwise Gershgorin's
    /// 2 sum_q V_q |eta|. A kernel cut off inside its own support is no longer positive definite.
    fn spectral_bound<const D: usize>(&self, row: &Stencil<D>, scratch: &PairScratch<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let (low, high) = self.epsilon.range();
        let scale = times(1.0, 1.0 / self.epsilon.get(row.target())?, self.degree as usize);
        let mut bound = 0.0_f64;
        for (n, kernel) in self.kernels.iter().enumerate() {
            let sum = |map: fn(f64) -> f64| -> f64 {
                scratch.volume.iter().zip(scratch.eta_of(n)).map(|(volume, &eta)| volume * map(eta)).sum()
            };
            let symmetric = self.pairing == Pairing::Difference && low == high;
            let whole = self.support >= kernel.support();
            let total = if symmetric && whole && kernel.positive_definite() {
                sum(|eta| eta) + self.own(kernel, row)?
            } else if self.pairing == Pairing::Summation {
                sum(f64::abs) + self.own(kernel, row)?.abs()
            } else {
                2.0 * sum(f64::abs)
            };
            bound = worse(bound, total * scale);
        }
        Ok(bound)
    }

    /// What the row breaks, overlap before moments: without overlap the moments are no use to anybody.
    fn breach(&self, h_over_epsilon: f64, defect: f64) -> Option<Breach> {
        let limit = self.overlap_limit;
        let (overlap, moments) = (h_over_epsilon <= limit * (1.0 + ROUND_OFF), defect <= self.tolerance);
        match (overlap, moments) {
            (false, _) => Some(Breach::Overlap { h_over_epsilon, limit }),
            (true, false) => Some(Breach::Moment { defect, limit: self.tolerance }),
            (true, true) => None,
        }
    }
}

/// The larger of two defects, NaN being the largest of all.
#[inline(always)]
pub(super) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}
