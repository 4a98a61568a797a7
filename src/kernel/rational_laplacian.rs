//! The rational exchange kernel of the Laplacian in three dimensions.

use std::f64::consts::PI;

use super::decay::square_once;
use super::{Kernel, laplacian};
use crate::multi_index::Term;
use crate::scalar::Scalar;

/// The kernel eta(z) = 15/(pi^2 (1 + |z|^10)), an exchange kernel of the Laplacian in three dimensions to order 2.
///
/// No exponential, but little else speaks for it. Second moments 2 exactly, M_0 = 6/sin(3 pi/10) = 7.416, error
/// (M_400/24) epsilon^2 Laplacian^2 f with M_400/24 = 0.0618.
///
/// - It decays like |z|^-10: beyond a radius R lies the part (2/pi) arctan(R^-5) of its second moments, see
///   [`lost`](Self::lost); 2e-4 at the support 5, where a Gaussian has lost nothing.
/// - Its poles lie 0.309 off the real axis, so lattices are poor quadratures: with cutoff 5 the second moment is off by
///   -0.04, -1.9, +4.7 % at h/epsilon = 1/4, 1/2, 0.8. The overlap limit is 1/4.
/// - Its transform has negative parts: the fastest mode decays with 7.786/epsilon^2, above M_0. It is not positive
///   definite, rows bound their eigenvalues by Gershgorin, and Euler is stable to 0.2569 epsilon^2 (integral form),
///   0.2545 on a lattice with h/epsilon = 1/2.
///
/// ```
/// use parops::{Kernel, RationalLaplacian};
/// let eta = RationalLaplacian::new();
/// let expected = 7.5 / (std::f64::consts::PI * std::f64::consts::PI);
/// assert!((eta.value(&[0.6, 0.0, 0.8]) - expected).abs() < 1e-15);
/// assert!((RationalLaplacian::lost(5.0) - 2.0e-4).abs() < 1e-5);
/// ```
///
/// Source: notes 001, sec. 5.2.1 (the kernel); errata 8 (moments, lattice, limits) and 26 (which bound does not apply).
/// See also: [`WideGaussian`](crate::WideGaussian) and [`Exchange`](crate::Exchange), more accurate with fewer
/// neighbors.
#[derive(Clone, Debug)]
pub struct RationalLaplacian([Term<3>; 3]);

impl RationalLaplacian {
    /// The kernel.
    pub fn new() -> Self {
        Self(laplacian())
    }

    /// The part of the second moments that lies beyond the radius R (in units of epsilon), (2/pi) arctan(R^-5).
    ///
    /// The diffusion coefficient of a kernel cut off at R is too small by this part.
    pub fn lost(radius: f64) -> f64 {
        2.0 / PI * radius.powi(-5).atan()
    }
}

impl Default for RationalLaplacian {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Kernel<T, 3> for RationalLaplacian {
    #[inline]
    fn value(&self, z: &[T; 3]) -> T {
        let s = square_once(z);
        let fourth = s * s;
        T::lift(15.0 / (PI * PI)) / (T::one() + fourth * fourth * s)
    }

    fn terms(&self) -> &[Term<3>] {
        &self.0
    }

    fn order(&self) -> u32 {
        2
    }

    /// 5: beyond it lie 2.0e-4 of the second moments.
    fn support(&self) -> f64 {
        5.0
    }

    /// 1/4, see errata 8.
    fn overlap_limit(&self) -> f64 {
        0.25
    }
}
