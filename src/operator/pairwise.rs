//! What PSE and SPH share: a fixed kernel, weighted by the volumes, with overlap and moments checked per row.

use super::method::{Allowance, Breach, RowReport, spread};
use crate::error::{MultiIndexError, OperatorError, Result};
use crate::kernel::Kernel;
use crate::multi_index::{MultiIndex, Term, common_degree};
use crate::scale::{Epsilon, Volumes};
use crate::stencil::Stencil;

/// Relative defect of the discrete moments above which a row is refused unless the caller sets another value.
pub const MOMENT_TOLERANCE: f64 = 0.05;

/// An overlap limit is a design figure; a spacing computed from a volume may exceed it by round-off.
const ROUND_OFF: f64 = 1e-12;

/// How the two values of a pair enter: with e = eps^(-D-m) eta(z), the term of a pair is
/// V_q e (f_q + sigma f_p), or V_p e f_q + sigma V_q e f_p in strengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pairing {
    /// sigma = -1.
    Difference,
    /// sigma = +1.
    Sum,
    /// sigma = 0, and the center itself is a source: the plain sum over all particles.
    Summation,
}

/// A method whose weight depends on the pair alone: kernels of one degree, one per output.
#[derive(Clone, Debug)]
pub(super) struct Pairwise<K, const N: usize> {
    kernels: [K; N],
    degree: u32,
    support: f64,
    overlap_limit: f64,
    epsilon: Epsilon,
    volumes: Volumes,
    pub(super) pairing: Pairing,
    pub(super) strengths: bool,
    pub(super) tolerance: f64,
    pub(super) allowance: Allowance,
}

/// Working memory: scaled separations, V_q epsilon^-D, and eta of every output, neighbor after neighbor.
#[derive(Clone, Debug, Default)]
pub struct PairScratch<const D: usize> {
    z: Vec<[f64; D]>,
    volume: Vec<f64>,
    eta: Vec<f64>,
}

impl<K, const N: usize> Pairwise<K, N> {
    pub(super) fn new<const D: usize>(
        kernels: [K; N],
        epsilon: Epsilon,
        volumes: &Volumes,
        pairing: impl FnOnce(u32) -> Pairing,
    ) -> Result<Self>
    where
        K: Kernel<f64, D>,
    {
        let mut degree = None;
        let (mut support, mut overlap_limit) = (0.0_f64, f64::INFINITY);
        for kernel in &kernels {
            let other = common_degree(kernel.terms())?;
            let first = *degree.get_or_insert(other);
            if other != first {
                return Err(MultiIndexError::UnequalDegree { first, other }.into());
            }
            support = support.max(kernel.support());
            overlap_limit = overlap_limit.min(kernel.overlap_limit());
        }
        let degree = degree.ok_or(MultiIndexError::Empty { output: 0 })?;
        Ok(Self {
            kernels,
            degree,
            support: positive(support)?,
            overlap_limit,
            epsilon,
            volumes: volumes.clone(),
            pairing: pairing(degree),
            strengths: false,
            tolerance: MOMENT_TOLERANCE,
            allowance: Allowance::Nowhere,
        })
    }

    pub(super) fn degree(&self) -> u32 {
        self.degree
    }

    pub(super) fn epsilon(&self) -> &Epsilon {
        &self.epsilon
    }

    pub(super) fn support(&self) -> f64 {
        self.support
    }

    pub(super) fn set_support(&mut self, radius: f64) -> Result<()> {
        self.support = positive(radius)?;
        Ok(())
    }

    pub(super) fn set_tolerance(&mut self, tolerance: f64) -> Result<()> {
        self.tolerance = positive(tolerance)?;
        Ok(())
    }

    /// Value at the center, V_p epsilon^-D eta(0), where the center exists.
    fn own<const D: usize>(&self, kernel: &K, row: &Stencil<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let Some(center) = row.center() else { return Ok(0.0) };
        let inverse = 1.0 / self.epsilon.get(row.target())?;
        Ok(times(self.volumes.get(center)?, inverse, D) * kernel.value(&[0.0; D]))
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

    /// The defect of one kernel's moments: the M_beta of its terms relative to the largest one required, and M_0
    /// where the pairing leaves M_0 f_p in the result.
    fn moment_defect<const D: usize>(&self, n: usize, row: &Stencil<D>, scratch: &PairScratch<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let kernel = &self.kernels[n];
        let moment = |beta: MultiIndex<D>| -> f64 {
            let pairs = scratch.z.iter().zip(&scratch.volume).enumerate();
            // Where the kernel underflows z^beta may overflow: zero times infinity must not enter.
            let weights = pairs.map(|(i, (z, volume))| (z, volume * scratch.eta[i * N + n]));
            weights.filter(|&(_, weight)| weight != 0.0).map(|(z, weight)| weight * beta.power(z)).sum()
        };
        let (mut defect, mut largest) = (0.0_f64, 0.0_f64);
        if self.degree > 0 {
            for &Term { index, factor } in kernel.terms() {
                let required = f64::from(index.sign()) * factor * index.factorial()? as f64;
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
    /// 2 sum_q V_q |eta|.
    fn spectral_bound<const D: usize>(&self, row: &Stencil<D>, scratch: &PairScratch<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let (low, high) = self.epsilon.range();
        let scale = times(1.0, 1.0 / self.epsilon.get(row.target())?, self.degree as usize);
        let mut bound = 0.0_f64;
        for (n, kernel) in self.kernels.iter().enumerate() {
            let sum = |map: fn(f64) -> f64| -> f64 {
                let pairs = scratch.volume.iter().enumerate();
                pairs.map(|(i, volume)| volume * map(scratch.eta[i * N + n])).sum()
            };
            let symmetric = self.pairing == Pairing::Difference && low == high;
            let total = if symmetric && kernel.positive_definite() {
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

impl<K, const N: usize> Pairwise<K, N> {
    /// The weights of one row, see [`Method::weights`](super::Method::weights).
    pub(super) fn weights<const D: usize>(
        &self,
        row: &Stencil<D>,
        scratch: &mut PairScratch<D>,
        w: &mut [[f64; N]],
        diagonal: &mut [f64; N],
    ) -> Result<()>
    where
        K: Kernel<f64, D>,
    {
        *diagonal = [0.0; N];
        if row.center().is_none() && self.pairing != Pairing::Summation {
            return Err(OperatorError::NoCenter { neighbors: row.len() }.into());
        }
        let epsilon = self.epsilon.get(row.target())?;
        let inverse = 1.0 / epsilon;
        scratch.z.clear();
        scratch.z.extend(row.separations().iter().map(|s| s.map(|x| x * inverse)));
        scratch.volume.clear();
        match self.volumes.common() {
            Some(volume) => scratch.volume.resize(row.len(), times(volume, inverse, D)),
            None => {
                for &q in row.sources() {
                    scratch.volume.push(times(self.volumes.get(q as usize)?, inverse, D));
                }
            }
        }
        self.evaluate(scratch);
        // eps^-m comes last: it alone can overflow.
        let scale = times(1.0, inverse, self.degree as usize);
        let own_volume = match row.center() {
            Some(center) => times(self.volumes.get(center)?, inverse, D),
            None => 0.0,
        };
        let sigma = match self.pairing {
            Pairing::Difference => -1.0,
            Pairing::Sum => 1.0,
            Pairing::Summation => 0.0,
        };
        let pairs = w.iter_mut().zip(row.signs()).zip(&scratch.volume).zip(scratch.eta.chunks_exact(N));
        for (((w, &sign), &volume), eta) in pairs {
            let receiver = if self.strengths { own_volume } else { volume };
            for n in 0..N {
                let e = eta[n] * scale;
                let (weight, share) = spread(receiver * e, sigma * volume * e, sign);
                w[n] = weight;
                diagonal[n] += share;
            }
        }
        if self.pairing == Pairing::Summation {
            for (own, kernel) in diagonal.iter_mut().zip(&self.kernels) {
                *own = if row.center().is_some() { *own + self.own(kernel, row)? * scale } else { 0.0 };
            }
        }
        finite(row, w, diagonal)
    }

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
        }
        report.negative_weights = scratch.eta.iter().filter(|&&eta| eta < 0.0).count();
        report.spectral_bound = self.spectral_bound(row, scratch)?;
        report.breach = self.breach(report.h_over_epsilon, report.moment_defect);
        report.allowed = report.breach.is_some() && self.allowance.covers(row.target());
        Ok(report)
    }

    /// eta of every output at every neighbor; one output needs no shuffling.
    fn evaluate<const D: usize>(&self, scratch: &mut PairScratch<D>)
    where
        K: Kernel<f64, D>,
    {
        let PairScratch { z, eta, .. } = scratch;
        eta.clear();
        eta.resize(z.len() * N, 0.0);
        if let [kernel] = self.kernels.as_slice() {
            kernel.values(z, eta);
            return;
        }
        for (z, eta) in z.iter().zip(eta.chunks_exact_mut(N)) {
            for (kernel, eta) in self.kernels.iter().zip(eta) {
                *eta = kernel.value(z);
            }
        }
    }
}

/// `value` * `factor`^`count`, one factor at a time, so that a small volume over a small epsilon^D stays in range.
#[inline(always)]
fn times(value: f64, factor: f64, count: usize) -> f64 {
    (0..count).fold(value, |product, _| product * factor)
}

/// The larger of two defects, NaN being the largest of all.
#[inline(always)]
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

fn positive(value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(OperatorError::Setting { value }.into()) }
}

fn finite<const D: usize, const N: usize>(row: &Stencil<D>, w: &[[f64; N]], diagonal: &[f64; N]) -> Result<()> {
    let own = (row.center().unwrap_or(row.target()), diagonal);
    let pairs = row.sources().iter().map(|&q| q as usize).zip(w);
    for (q, weights) in pairs.chain([own]) {
        if let Some(&weight) = weights.iter().find(|weight| !weight.is_finite()) {
            return Err(OperatorError::Weight { q, weight }.into());
        }
    }
    Ok(())
}

/// The settings and the [`Method`](super::Method) that every method built on [`Pairwise`] has, for a tuple struct
/// around one.
macro_rules! pairwise_method {
    ($name:ident<$k:ident $(, $d:ident)?>, $bound:ident) => {
        impl<$k, $(const $d: usize,)? const N: usize> $name<$k, $($d,)? N> {
            /// Cuts the kernel off at `radius` (in units of epsilon) in place of its own support radius.
            ///
            /// # Errors
            /// [`OperatorError::Setting`](crate::OperatorError::Setting) where it is not positive.
            pub fn support(mut self, radius: f64) -> Result<Self> {
                self.0.set_support(radius)?;
                Ok(self)
            }

            /// Sets the largest relative defect of the discrete moments, 0.05 by default.
            ///
            /// # Errors
            /// [`OperatorError::Setting`](crate::OperatorError::Setting) where it is not positive.
            pub fn moment_tolerance(mut self, tolerance: f64) -> Result<Self> {
                self.0.set_tolerance(tolerance)?;
                Ok(self)
            }

            /// Allows rows to break the overlap and moment limits; the report counts them.
            #[must_use]
            pub fn allow(mut self, allowance: Allowance) -> Self {
                self.0.allowance = allowance;
                self
            }

            /// The cutoff a provider must be built with: the support radius times the largest epsilon.
            pub fn cutoff(&self) -> Cutoff {
                self.0.epsilon().cutoff(self.0.support())
            }
        }

        impl<$k: $bound<f64, D>, const D: usize, const N: usize> Method<D> for $name<$k, $($d,)? N> {
            type Out = [f64; N];
            type Scratch = PairScratch<D>;

            fn scratch(&self) -> Result<PairScratch<D>> {
                Ok(PairScratch::default())
            }

            fn cutoff(&self, p: usize) -> Result<Option<f64>> {
                Ok(Some(self.0.epsilon().get(p)? * self.0.support()))
            }

            fn weights(
                &self,
                row: &Stencil<D>,
                scratch: &mut PairScratch<D>,
                w: &mut [[f64; N]],
                diagonal: &mut [f64; N],
            ) -> Result<()> {
                self.0.weights(row, scratch, w, diagonal)
            }

            fn report(
                &self,
                row: &Stencil<D>,
                scratch: &PairScratch<D>,
                w: &[[f64; N]],
                diagonal: &[f64; N],
            ) -> Result<RowReport> {
                self.0.report(row, scratch, w, diagonal)
            }
        }
    };
}

pub(super) use pairwise_method;
