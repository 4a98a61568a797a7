//! What PSE and SPH share: a fixed kernel, weighted by the volumes, with overlap and moments checked per row.

use super::allowance::Allowance;
use super::draft::finite;
use super::method::spread;
use crate::error::{MultiIndexError, OperatorError, ParticleError, Result};
use crate::kernel::Kernel;
use crate::multi_index::common_degree;
use crate::scale::{Epsilon, Volumes};
use crate::stencil::Stencil;

/// Relative defect of the discrete moments above which a row is refused unless the caller sets another value.
pub const MOMENT_TOLERANCE: f64 = 0.05;

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
    pub(super) kernels: [K; N],
    pub(super) degree: u32,
    pub(super) support: f64,
    pub(super) overlap_limit: f64,
    pub(super) epsilon: Epsilon,
    pub(super) volumes: Volumes,
    pub(super) pairing: Pairing,
    pub(super) strengths: bool,
    pub(super) tolerance: f64,
    pub(super) allowance: Allowance,
}

/// Working memory: scaled separations, V_q epsilon^-D, and eta at every neighbor, output after output.
#[derive(Clone, Debug, Default)]
pub struct PairScratch<const D: usize> {
    pub(super) z: Vec<[f64; D]>,
    pub(super) volume: Vec<f64>,
    pub(super) eta: Vec<f64>,
}

impl<const D: usize> PairScratch<D> {
    /// eta of output n at every neighbor.
    #[inline(always)]
    pub(super) fn eta_of(&self, n: usize) -> &[f64] {
        &self.eta[n * self.z.len()..][..self.z.len()]
    }
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
            support = support.max(positive(kernel.support())?);
            overlap_limit = overlap_limit.min(positive(kernel.overlap_limit())?);
        }
        let degree = degree.ok_or(MultiIndexError::Empty { output: 0 })?;
        Ok(Self {
            kernels,
            degree,
            support,
            overlap_limit,
            epsilon,
            volumes: volumes.clone(),
            pairing: pairing(degree),
            strengths: false,
            tolerance: MOMENT_TOLERANCE,
            allowance: Allowance::Nowhere,
        })
    }

    /// Refuses epsilons or volumes of another number of particles.
    pub(super) fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        for (held, needed) in [(self.epsilon.len(), targets), (self.volumes.len(), sources)] {
            if let Some(found) = held.filter(|&found| found != needed) {
                return Err(ParticleError::Length { found, needed }.into());
            }
        }
        Ok(())
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
    pub(super) fn own<const D: usize>(&self, kernel: &K, row: &Stencil<D>) -> Result<f64>
    where
        K: Kernel<f64, D>,
    {
        let Some(center) = row.center() else { return Ok(0.0) };
        let inverse = 1.0 / self.epsilon.get(row.target())?;
        Ok(times(self.volumes.get(center)?, inverse, D) * kernel.value(&[0.0; D]))
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
        for n in 0..N {
            let pairs = w.iter_mut().zip(row.signs()).zip(&scratch.volume).zip(scratch.eta_of(n));
            for (((w, &sign), &volume), &eta) in pairs {
                let receiver = if self.strengths { own_volume } else { volume };
                let e = eta * scale;
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
        finite(row, w.iter().map(<[f64; N]>::as_slice), diagonal)
    }

    /// eta of every output at every neighbor.
    fn evaluate<const D: usize>(&self, scratch: &mut PairScratch<D>)
    where
        K: Kernel<f64, D>,
    {
        let PairScratch { z, eta, .. } = scratch;
        eta.clear();
        eta.resize(z.len() * N, 0.0);
        for (n, kernel) in self.kernels.iter().enumerate() {
            kernel.values(z, &mut eta[n * z.len()..][..z.len()]);
        }
    }
}

/// `value` * `factor`^`count`, one factor at a time, so that a small volume over a small epsilon^D stays in range.
#[inline(always)]
pub(super) fn times(value: f64, factor: f64, count: usize) -> f64 {
    (0..count).fold(value, |product, _| product * factor)
}

pub(super) fn positive(value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(OperatorError::Setting { value }.into()) }
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
                self.0.epsilon.cutoff(self.0.support)
            }
        }

        impl<$k: $bound<f64, D>, const D: usize, const N: usize> Method<D> for $name<$k, $($d,)? N> {
            type Out = [f64; N];
            type Scratch = PairScratch<D>;

            fn scratch(&self) -> Result<PairScratch<D>> {
                Ok(PairScratch::default())
            }

            fn validate(&self, targets: usize, sources: usize) -> Result<()> {
                self.0.validate(targets, sources)
            }

            fn cutoff(&self, p: usize) -> Result<Option<f64>> {
                Ok(Some(self.0.epsilon.get(p)? * self.0.support))
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
