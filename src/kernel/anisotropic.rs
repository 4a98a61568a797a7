//! The exchange kernel of an anisotropic second-order operator: a quadratic form times a Gaussian.

use super::decay::decay;
use super::{Kernel, gaussian_constant};
use crate::error::{KernelError, Result};
use crate::multi_index::{Term, common_degree};
use crate::scalar::Scalar;

/// The exchange kernel of sum_ij A_ij d_i d_j to order 2,
/// eta(z) = 4 pi^(-D/2) (z . m z) exp(-|z|^2), m = A - tr(A)/(D + 2) I.
///
/// It is not negative where m has no negative eigenvalue: A positive, and its smallest eigenvalue at least
/// tr(A)/(D + 2) (in 2D an anisotropy up to 3). Beyond that some pair weights are negative, and the maximum principle is
/// lost; for a constant A without negative eigenvalue every mode still decays. For A = I it is a kernel of the Laplacian,
/// (8/(D + 2)) pi^(-D/2) |z|^2 exp(-|z|^2), not the narrow Gaussian: Euler is stable to 1.0372, 0.8808 and 0.7901
/// epsilon^2 in 1D, 2D and 3D. [`Exchange`](crate::Exchange) for the same terms has negative values for any
/// anisotropy, and orders up to 8.
///
/// ```
/// use parops::{AnisotropicGaussian, Kernel, MultiIndex, Term};
/// let term = |beta, factor| Term { index: MultiIndex::new(beta), factor };
/// // A = ((2, 1/2), (1/2, 1)), m = A - 3/4 I
/// let eta = AnisotropicGaussian::new(&[term([2, 0], 2.0), term([1, 1], 1.0), term([0, 2], 1.0)])?;
/// let expected = 4.0 * (1.25 + 2.0 * 0.5 + 0.25) * f64::exp(-2.0) / std::f64::consts::PI;
/// assert!((eta.value(&[1.0, 1.0]) - expected).abs() < 1e-15);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 5.21, 5.23 and 5.24 with errata 14 and 15, for one tensor and any D.
/// See also: [`DivTensorGrad`](crate::DivTensorGrad), which makes div(D grad f) of these kernels.
#[derive(Clone, Debug)]
pub struct AnisotropicGaussian<const D: usize> {
    terms: Vec<Term<D>>,
    /// m, with 4 pi^(-D/2).
    form: [[f64; D]; D],
}

impl<const D: usize> AnisotropicGaussian<D> {
    /// The kernel of sum_i c_i D^beta_i, |beta_i| = 2; a mixed term c d_i d_j gives A_ij = A_ji = c/2.
    ///
    /// # Errors
    /// [`KernelError::NotSecond`] for another degree, and the refusals of [`common_degree`].
    pub fn new(terms: &[Term<D>]) -> Result<Self> {
        let degree = common_degree(terms)?;
        if degree != 2 {
            return Err(KernelError::NotSecond { degree }.into());
        }
        let constant = 4.0 * gaussian_constant::<D>(std::f64::consts::PI);
        let mut form = [[0.0; D]; D];
        for term in terms {
            let axes = term.index.exponents().into_iter().enumerate();
            let mut axes = axes.flat_map(|(axis, n)| std::iter::repeat_n(axis, usize::from(n)));
            if let (Some(i), Some(j)) = (axes.next(), axes.next()) {
                form[i][j] += 0.5 * constant * term.factor;
                form[j][i] += 0.5 * constant * term.factor;
            }
        }
        let share = (0..D).map(|i| form[i][i]).sum::<f64>() / (D + 2) as f64;
        (0..D).for_each(|i| form[i][i] -= share);
        Ok(Self { terms: terms.to_vec(), form })
    }
}

impl<T: Scalar, const D: usize> Kernel<T, D> for AnisotropicGaussian<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        let mut sum = T::zero();
        for (row, &x) in self.form.iter().zip(z) {
            for (&m, &y) in row.iter().zip(z) {
                sum += x * T::lift(m) * y;
            }
        }
        let (_, [decay]) = decay(&[*z], 1.0);
        sum * decay
    }

    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }

    fn order(&self) -> u32 {
        2
    }

    fn support(&self) -> f64 {
        6.0
    }

    fn overlap_limit(&self) -> f64 {
        2.0 / 3.0
    }
}
