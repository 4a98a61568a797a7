//! Particle strength exchange: kernels that satisfy the moment conditions of the operator itself.

use super::allowance::Allowance;
use super::expression::{Operator, collect};
use super::method::Method;
use super::pairwise::{PairScratch, Pairing, Pairwise, pairwise_method};
use super::row_report::RowReport;
use crate::error::{OperatorError, Result};
use crate::kernel::{AnisotropicGaussian, Exchange, Kernel};
use crate::scale::{Cutoff, Epsilon, Volumes};
use crate::stencil::Stencil;

/// The sign between the two values of a pair, for operators of odd degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sign {
    /// f_q - f_p: exact for constants on any set; for scattered sets and boundaries. Always taken for even degrees.
    Minus,
    /// f_q + f_p: conserves sum_p V_p (Q f)_p on any volumes, but leaves 2 M_0 f_p / epsilon wherever the zeroth
    /// discrete moment is not zero; for lattices.
    #[default]
    Plus,
}

/// What the rows act on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Values f_p.
    #[default]
    Values,
    /// Strengths F_p = V_p f_p: the result is V_p (Q f)_p and its sum is zero for a closed set, whatever the volumes.
    Strengths,
}

/// The order of a method, its smallest epsilon, and the largest legal h/epsilon.
pub(crate) struct Design {
    pub(crate) order: u32,
    pub(crate) epsilon: f64,
    pub(crate) overlap_limit: f64,
}

/// Particle strength exchange with N outputs,
/// (Q f)_p = epsilon^-m sum_q V_q (f_q -/+ f_p) eta_epsilon(x_p - x_q), eta_epsilon(x) = epsilon^-D eta(x/epsilon).
///
/// Exact for constants with '-'. The error is O(epsilon^r) + epsilon^(1-m) O((h/epsilon)^s): on lattices the second
/// part is below round-off from h/epsilon = 1/2 on; **on scattered particles it does not fall with h**, it grows: by M_1
/// f'/epsilon for a second derivative, see [`RowReport::lower_moment`](crate::RowReport::lower_moment). Conserves sum_p
/// V_p (Q f)_p to round-off for one global epsilon ('-' even, '+' odd). Needs volumes. Costs one exponential a pair and
/// output.
///
/// At build every row is checked: h/epsilon against the limit of the kernel (errata 7), and the discrete moments
/// M_beta (images counted without their sign; with '+' also |M_0|) against [`moment_tolerance`](Self::moment_tolerance).
/// A breach is a typed error naming the worst particle unless [`allow`](Self::allow) covers it.
///
/// ```
/// use parops::{Apply, CellList, Domain, Laplacian, Particles, Pse, Spacing};
/// let particles = Particles::lattice([0.0], [1.0], [64])?;
/// let h = Spacing(1.0 / 64.0);
/// let pse = Pse::new(Laplacian::<1>, 4, h.epsilon(2.0)?, particles.volumes()?)?;
/// let neighbors = CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?;
/// let rows = pse.assemble(&neighbors)?;
/// let wave = |x: &[f64; 1]| (std::f64::consts::TAU * x[0]).sin();
/// let f: Vec<f64> = particles.points().iter().map(wave).collect();
/// let mut lap = vec![0.0; 64];
/// rows.apply(&f, &mut lap)?;
/// let exact = -std::f64::consts::TAU.powi(2) * f[5];
/// assert!((lap[5] / exact - 1.0).abs() < 1e-3);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 5.30 and 5.31, with errata 10 to 13; notes 000, eq. 26. See also: [`Sph`](super::Sph), which
/// differentiates one smoothing kernel.
#[derive(Clone, Debug)]
pub struct Pse<K, const N: usize = 1>(pub(super) Pairwise<K, N>);

impl<const D: usize, const N: usize> Pse<Exchange<D>, N> {
    /// PSE of `order` 2, 4, 6 or 8 with the kernels derived from the moment conditions of `operator`.
    ///
    /// # Errors
    /// As [`Exchange::new`]; [`MultiIndexError`](crate::MultiIndexError) for an operator without terms or of unequal
    /// degrees; [`OperatorError::Degree`] for degree 0.
    pub fn new<Op: Operator<D, Out = [f64; N]>>(
        operator: Op,
        order: u32,
        epsilon: Epsilon,
        volumes: &Volumes,
    ) -> Result<Self> {
        let terms = collect(&operator)?;
        let kernels = terms.iter().map(|terms| Exchange::new(terms, order)).collect::<Result<Vec<_>>>()?;
        let outputs = kernels.len();
        // `collect` hands out one list of terms per output, so the lengths agree.
        let kernels = kernels.try_into().map_err(|_| OperatorError::Length { found: outputs, index: N })?;
        Self::with_kernels(kernels, epsilon, volumes)
    }
}

impl<const D: usize, const N: usize> Pse<AnisotropicGaussian<D>, N> {
    /// PSE of order 2 with the kernels 4 pi^(-D/2) (z . m z) exp(-|z|^2) of second derivatives: of `Hessian` for
    /// [`DivTensorGrad`](super::DivTensorGrad).
    ///
    /// # Errors
    /// As [`AnisotropicGaussian::new`].
    pub fn anisotropic<Op: Operator<D, Out = [f64; N]>>(
        operator: Op,
        epsilon: Epsilon,
        volumes: &Volumes,
    ) -> Result<Self> {
        let terms = collect(&operator)?;
        let kernels = terms.iter().map(|terms| AnisotropicGaussian::new(terms)).collect::<Result<Vec<_>>>()?;
        let outputs = kernels.len();
        let kernels = kernels.try_into().map_err(|_| OperatorError::Length { found: outputs, index: N })?;
        Self::with_kernels(kernels, epsilon, volumes)
    }
}

impl<K, const N: usize> Pse<K, N> {
    /// PSE with kernels of the caller's choice, one an output, all of one degree m >= 1.
    ///
    /// # Errors
    /// [`MultiIndexError`](crate::MultiIndexError) where the kernels name no terms or unequal degrees;
    /// [`OperatorError::Degree`] for degree 0; [`OperatorError::Setting`] for a support that is not positive.
    pub fn with_kernels<const D: usize>(kernels: [K; N], epsilon: Epsilon, volumes: &Volumes) -> Result<Self>
    where
        K: Kernel<f64, D>,
    {
        let default = |degree: u32| if degree.is_multiple_of(2) { Pairing::Difference } else { Pairing::Sum };
        let pairwise = Pairwise::new(kernels, epsilon, volumes, default)?;
        if pairwise.degree == 0 {
            return Err(OperatorError::Degree { degree: 0, low: 1 }.into());
        }
        Ok(Self(pairwise))
    }

    /// Sets the sign between the two values of a pair. The default is '-' for even degrees and '+' for odd ones.
    ///
    /// # Errors
    /// [`OperatorError::PlusEven`] for '+' with an even degree.
    pub fn sign(mut self, sign: Sign) -> Result<Self> {
        self.0.pairing = match sign {
            Sign::Minus => Pairing::Difference,
            Sign::Plus if self.0.degree.is_multiple_of(2) => {
                return Err(OperatorError::PlusEven { degree: self.0.degree }.into());
            }
            Sign::Plus => Pairing::Sum,
        };
        Ok(self)
    }

    /// What a lattice must have for this method.
    pub(crate) fn design<const D: usize>(&self) -> Design
    where
        K: Kernel<f64, D>,
    {
        let order = self.0.kernels.iter().map(Kernel::<f64, D>::order).min().unwrap_or(0);
        Design { order, epsilon: self.0.epsilon.range().0, overlap_limit: self.0.overlap_limit }
    }

    /// Takes other volumes.
    pub(crate) fn replace_volumes(&mut self, volumes: &Volumes) {
        self.0.volumes = volumes.clone();
    }

    /// Sets what the rows act on.
    ///
    /// # Errors
    /// [`OperatorError::VariableEpsilon`] for strengths with an epsilon that varies: the exchange between two
    /// particles would then not be one number.
    pub fn form(mut self, form: Form) -> Result<Self> {
        let (low, high) = self.0.epsilon.range();
        if form == Form::Strengths && low != high {
            return Err(OperatorError::VariableEpsilon { low, high }.into());
        }
        self.0.strengths = form == Form::Strengths;
        Ok(self)
    }
}

pairwise_method!(Pse<K>, Kernel);
