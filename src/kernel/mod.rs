//! Kernels: smoothing W, exchange eta^beta, mesh kernels. A kernel is unscaled (epsilon = 1, or the spacing of the mesh);
//! methods and meshes scale it.

mod anisotropic;
mod assignment;
mod compact;
mod decay;
mod derivation;
mod exchange;
mod gaussian;
mod harmonic;
mod high_order;
mod interpolation;
mod lambda;
mod lattice_hat;
mod mesh_kernel;
mod one_sided;
mod polynomial;
mod rational;
mod rational_laplacian;
mod spline;
mod twofold;
mod wendland;

pub use anisotropic::AnisotropicGaussian;
pub use assignment::{Cic, Ngp, Tsc};
pub use exchange::Exchange;
pub use gaussian::{Gaussian, WideGaussian};
pub use high_order::HighOrderGaussian;
pub use lambda::Lambda;
pub use lattice_hat::LatticeHat;
pub use mesh_kernel::MeshKernel;
pub use one_sided::OneSidedGaussian;
pub(crate) use one_sided::along_axis;
pub use polynomial::ExactPolynomial;
pub use rational::Rational;
pub use rational_laplacian::RationalLaplacian;
pub use spline::{CubicSpline, QuinticSpline};
pub use wendland::{WendlandC2, WendlandC4, WendlandC6};

use crate::error::Result;
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::Scalar;

/// Points per block of a combination; small enough for the stack.
const BLOCK: usize = 64;

/// A kernel eta(z), z = (x_p - x_q)/epsilon, that approximates a differential operator of one degree.
///
/// With eta_epsilon(x) = epsilon^-D eta(x/epsilon), the integral
/// epsilon^-m Int (f(y) -/+ f(x)) eta_epsilon(x - y) dy approximates L f(x) = sum_i c_i D^beta_i f(x), m = |beta_i|,
/// to O(epsilon^r), because the moments M_alpha = Int z^alpha eta(z) dz are (-1)^m c_i beta_i! for alpha = beta_i and
/// zero for the other 1 <= |alpha| <= m + r - 1 (from |alpha| = 0 where m = 0).
///
/// The scalar stands on the trait, so that `dyn Kernel<f64, 2>` exists and dual numbers pass through.
/// Implement it for a kernel of your own and it can be used wherever ours are;
/// `parops::testing::check_kernel` (feature `testing`) tells whether it keeps its promises.
///
/// Source: notes 001, eq. 5.30; notes 000, eq. 16 and 18; errata 10 for the argument.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no kernel in {D} dimensions",
    label = "expected a kernel in {D} dimensions",
    note = "the kernel, the operator, the particles and the provider must agree on the number of dimensions"
)]
pub trait Kernel<T: Scalar, const D: usize>: Send + Sync {
    /// eta(z). Far beyond the support, where powers of |z| overflow, it may be NaN in place of 0.
    fn value(&self, z: &[T; D]) -> T;

    /// eta at many points; `out` is as long as `z`. Override it where many points are cheaper together.
    fn values(&self, z: &[[T; D]], out: &mut [T]) {
        for (z, out) in z.iter().zip(out) {
            *out = self.value(z);
        }
    }

    /// The terms c_i D^beta_i this kernel approximates, all of one degree m. A smoothing kernel has the one term D^0.
    fn terms(&self) -> &[Term<D>];

    /// The order r of the error O(epsilon^r) in integral form.
    fn order(&self) -> u32;

    /// The radius, in units of epsilon, at which the kernel is or may be cut off.
    fn support(&self) -> f64;

    /// The largest h/epsilon at which the sum over a lattice still replaces the integral.
    fn overlap_limit(&self) -> f64;

    /// Whether the Fourier transform of eta is nowhere negative, so that the matrix eta(x_p - x_q) has no negative
    /// eigenvalue. It makes the step limit of errata 26 hold on any particle set.
    fn positive_definite(&self) -> bool {
        false
    }
}

/// A smoothing kernel W: even, Int W = 1, differentiable.
///
/// Usable overlap, as h/epsilon: from above sums over a lattice bound it; from below pairs do, where particles move along
/// -grad sum_q W (measured in two dimensions).
///
/// | kernel | largest h/epsilon for D = 1, 2, 3 | pairs form below |
/// |---|---|---|
/// | [`Gaussian`](crate::Gaussian) | 0.94, 0.94, 0.94 | never |
/// | [`WendlandC2`](crate::WendlandC2) | 0.93, 0.76, 0.77 | never |
/// | [`WendlandC4`](crate::WendlandC4) | 1.00, 0.79, 0.79 | never |
/// | [`WendlandC6`](crate::WendlandC6) | 0.93, 0.77, 0.75 | never |
/// | [`CubicSpline`](crate::CubicSpline) | 1.00, 1.00, 1.00 | 0.77 |
/// | [`QuinticSpline`](crate::QuinticSpline) | 1.00, 1.00, 1.00 | 0.71 |
///
/// Source: notes 001, sec. 5.1; pairing as in Dehnen and Aly 2012, sec. 3.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no smoothing kernel in {D} dimensions",
    label = "expected a smoothing kernel in {D} dimensions",
    note = "the kernel, the operator, the particles and the provider must agree on the number of dimensions"
)]
pub trait SmoothingKernel<T: Scalar, const D: usize>: Kernel<T, D> {
    /// D^beta W(z).
    ///
    /// # Errors
    /// [`KernelError::Regularity`](crate::KernelError::Regularity) beyond the degree the kernel is differentiable to.
    fn derivative(&self, beta: MultiIndex<D>, z: &[T; D]) -> Result<T>;

    /// D^beta W at many points; `out` is as long as `z`. Override it where the work per call can be shared.
    ///
    /// # Errors
    /// As [`derivative`](Self::derivative).
    fn derivatives(&self, beta: MultiIndex<D>, z: &[[T; D]], out: &mut [T]) -> Result<()> {
        for (z, out) in z.iter().zip(out) {
            *out = self.derivative(beta, z)?;
        }
        Ok(())
    }

    /// sum_i c_i D^beta_i W at many points; `out` is as long as `z`. Override it where the terms share their profile.
    ///
    /// # Errors
    /// As [`derivative`](Self::derivative).
    fn combination(&self, terms: &[Term<D>], z: &[[T; D]], out: &mut [T]) -> Result<()> {
        let mut derivative = [T::zero(); BLOCK];
        for (z, out) in z.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            out.fill(T::zero());
            for term in terms {
                let derivative = &mut derivative[..z.len()];
                self.derivatives(term.index, z, derivative)?;
                for (out, &derivative) in out.iter_mut().zip(&*derivative) {
                    *out += T::lift(term.factor) * derivative;
                }
            }
        }
        Ok(())
    }

    /// grad W(z).
    ///
    /// # Errors
    /// As [`derivative`](Self::derivative), for degree 1.
    fn gradient(&self, z: &[T; D]) -> Result<[T; D]> {
        let mut gradient = [T::zero(); D];
        for (axis, component) in gradient.iter_mut().enumerate() {
            *component = self.derivative(MultiIndex::unit(axis)?, z)?;
        }
        Ok(gradient)
    }

    /// The constant in front of the profile that makes Int W = 1.
    fn normalization(&self) -> f64;
}

/// The terms of the Laplacian, sum_i D^2_i.
fn laplacian<const D: usize>() -> [Term<D>; D] {
    std::array::from_fn(|axis| {
        let mut exponents = [0; D];
        exponents[axis] = 2;
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    })
}

/// a^(-D/2), rounded about once, for the constant in front of a Gaussian.
fn gaussian_constant<const D: usize>(a: f64) -> f64 {
    let root = a.sqrt().recip();
    let square = root * root;
    // What the root and its square lack, so that the roundings do not add up over the product.
    let lost = root.mul_add(root, -square);
    let rest = 0.5 * root * ((-a).mul_add(square, 1.0) - a * lost);
    let (high, low) = (0..D).fold((1.0, 0.0), |(high, low): (f64, f64), _| {
        let product = high * root;
        (product, high.mul_add(root, -product) + (high * rest + low * root))
    });
    high + low
}

#[cfg(test)]
mod tests {
    use super::gaussian_constant;
    use super::twofold::Twofold;

    #[test]
    fn constants_of_gaussians_are_rounded_about_once_in_any_dimension() {
        fn once<const D: usize>(a: f64) {
            let constant = Twofold::from(gaussian_constant::<D>(a));
            let square = (0..D).fold(constant * constant, |product, _| product * a.into());
            // c^2 a^D - 1 is twice the relative error of c, which one rounding keeps to eps/2.
            let off = (square - 1.0.into()).to_f64();
            assert!(off.abs() <= 1.001 * f64::EPSILON, "D = {D}, a = {a}: {:.3} roundings", off / f64::EPSILON);
        }
        for a in (1..=200).map(|i| f64::from(i) * 0.1).chain([1.0, 2.0, 4.0].map(|n| n * std::f64::consts::PI)) {
            once::<1>(a);
            once::<2>(a);
            once::<3>(a);
            once::<8>(a);
        }
    }
}
