//! Smoothed particle hydrodynamics: one smoothing kernel, differentiated.

use super::allowance::Allowance;
use super::expression::{Operator, collect};
use super::method::Method;
use super::pairwise::{PairScratch, Pairing, Pairwise, pairwise_method};
use super::row_report::RowReport;
use crate::error::{OperatorError, Result};
use crate::kernel::{Kernel, SmoothingKernel};
use crate::multi_index::Term;
use crate::scale::{Cutoff, Epsilon, Volumes};
use crate::stencil::Stencil;

/// sum_i c_i D^beta_i W of a smoothing kernel W, as a kernel of its own.
///
/// Integration by parts gives it the moments (-1)^m c_i beta_i! of an exchange kernel for the same operator, so SPH
/// is checked by the same moments as PSE.
#[derive(Clone, Debug)]
pub struct Differentiated<W, const D: usize> {
    kernel: W,
    terms: Vec<Term<D>>,
}

impl<W: SmoothingKernel<f64, D>, const D: usize> Differentiated<W, D> {
    /// sum_i c_i D^beta_i W.
    ///
    /// # Errors
    /// [`KernelError::Regularity`](crate::KernelError::Regularity) where W is not differentiable that often.
    pub fn new(kernel: W, terms: Vec<Term<D>>) -> Result<Self> {
        for term in &terms {
            kernel.derivative(term.index, &[0.0; D])?;
        }
        Ok(Self { kernel, terms })
    }
}

impl<W: SmoothingKernel<f64, D>, const D: usize> Kernel<f64, D> for Differentiated<W, D> {
    fn value(&self, z: &[f64; D]) -> f64 {
        let mut out = [0.0];
        self.values(std::slice::from_ref(z), &mut out);
        out[0]
    }

    fn values(&self, z: &[[f64; D]], out: &mut [f64]) {
        // `new` has seen every term differentiated; a kernel that fails here after all gives no number.
        if self.kernel.combination(&self.terms, z, out).is_err() {
            out.fill(f64::NAN);
        }
    }

    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }

    fn order(&self) -> u32 {
        self.kernel.order()
    }

    fn support(&self) -> f64 {
        self.kernel.support()
    }

    fn overlap_limit(&self) -> f64 {
        self.kernel.overlap_limit()
    }
}

/// Which sum approximates the integral.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SphForm {
    /// sum_q V_q f_q D^beta W, the center included: eq. 5.8 and 5.9; also at points that are no particles.
    #[default]
    Summation,
    /// sum_q V_q (f_q - f_p) D^beta W: exact for constants on any set; only at particles.
    Difference,
}

/// Smoothed particle hydrodynamics with N outputs,
/// D^beta f(x_p) ~ epsilon^-m sum_q V_q f_q (D^beta W)_epsilon(x_p - x_q).
///
/// With degree 0 and targets of the caller's choice it is the smooth approximation of the field (eq. 5.7). The error
/// is O(epsilon^r) + epsilon^-m O((h/epsilon)^s) (errata 9): on lattices of fixed overlap it converges with r until
/// the second part shows, **on scattered particles it does not converge**, which the checks of the rows show. Does not
/// conserve. Needs volumes. Rows are checked as those of [`Pse`](super::Pse); in the summation form also M_0.
///
/// ```
/// use parops::{Apply, CellList, D1, Domain, Gaussian, Particles, Spacing, Sph};
/// let particles = Particles::lattice([0.0], [1.0], [50])?;
/// let field: Vec<f64> = particles.points().iter().map(|x| (6.0 * x[0]).sin()).collect();
/// let sph = Sph::new(D1::<0>::default(), Gaussian::<1>::new(), Spacing(0.02).epsilon(1.5)?, particles.volumes()?)?;
/// let between = CellList::build_at(&[[0.503]], &particles, &Domain::open(), sph.cutoff())?;
/// let mut value = [0.0];
/// sph.assemble(&between)?.apply(&field, &mut value)?;
/// assert!((value[0] - (6.0_f64 * 0.503).sin()).abs() < 0.02);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 5.7 to 5.9, with errata 1 and 9.
#[derive(Clone, Debug)]
pub struct Sph<W, const D: usize, const N: usize = 1>(Pairwise<Differentiated<W, D>, N>);

impl<W: SmoothingKernel<f64, D> + Clone, const D: usize, const N: usize> Sph<W, D, N> {
    /// SPH of `operator` with the smoothing kernel W, in the summation form.
    ///
    /// # Errors
    /// [`MultiIndexError`](crate::MultiIndexError) for an operator without terms or of unequal degrees;
    /// [`KernelError::Regularity`](crate::KernelError::Regularity) where W is not differentiable that often.
    pub fn new<Op: Operator<D, Out = [f64; N]>>(
        operator: Op,
        kernel: W,
        epsilon: Epsilon,
        volumes: &Volumes,
    ) -> Result<Self> {
        let terms = collect(&operator)?;
        let kernels =
            terms.into_iter().map(|terms| Differentiated::new(kernel.clone(), terms)).collect::<Result<Vec<_>>>()?;
        let outputs = kernels.len();
        let kernels = kernels.try_into().map_err(|_| OperatorError::Length { found: outputs, index: N })?;
        Ok(Self(Pairwise::new(kernels, epsilon, volumes, |_| Pairing::Summation)?))
    }
}

impl<W, const D: usize, const N: usize> Sph<W, D, N> {
    /// Sets which sum is taken.
    ///
    /// # Errors
    /// [`OperatorError::Degree`] for the difference form with degree 0, which would be zero for every constant.
    pub fn form(mut self, form: SphForm) -> Result<Self> {
        self.0.pairing = match form {
            SphForm::Summation => Pairing::Summation,
            SphForm::Difference if self.0.degree == 0 => {
                return Err(OperatorError::Degree { degree: 0, low: 1 }.into());
            }
            SphForm::Difference => Pairing::Difference,
        };
        Ok(self)
    }
}

pairwise_method!(Sph<W, D>, SmoothingKernel);
