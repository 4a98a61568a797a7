//! The numbers that kernels and single-stencil numerics are generic over.

use nalgebra::RealField;

/// A real scalar: `f32`, `f64`, or a dual number that carries derivatives.
///
/// Everything that evaluates a kernel at one point is generic over it, so that automatic differentiation
/// passes straight through a kernel. It is implemented for every copyable [`nalgebra::RealField`].
///
/// ```
/// use parops::Scalar;
/// assert_eq!(f32::lift(0.5), 0.5_f32);
/// ```
pub trait Scalar: RealField + Copy {
    /// The scalar nearest to the given `f64`.
    #[inline(always)]
    fn lift(x: f64) -> Self {
        nalgebra::convert(x)
    }
}

impl<T: RealField + Copy> Scalar for T {}

/// The squared Euclidean length |z|^2 = sum_i z_i^2, summed from the first axis on.
#[inline(always)]
pub(crate) fn square<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    let mut s = T::zero();
    for &x in z {
        s += x * x;
    }
    s
}
