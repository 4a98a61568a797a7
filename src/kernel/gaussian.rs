//! The Gaussian smoothing kernel exp(-|z|^2/2), and the wide Gaussian exp(-|z|^2/4) of the diffusion operator.

use std::f64::consts::{PI, SQRT_2};

use super::decay::{decay, in_lanes};
use super::{Kernel, SmoothingKernel, gaussian_constant, laplacian};
use crate::error::Result;
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::Scalar;

/// The Gaussian smoothing kernel W(z) = (2 pi)^(-D/2) exp(-|z|^2/2), of order 2.
///
/// epsilon is its standard deviation. D^beta W = (-1)^|beta| He_beta(z) W(z) for any beta, with the Hermite polynomials
/// He_(n+1)(x) = x He_n(x) - n He_(n-1)(x). f32 overflows to infinity in high degrees, from about 40 on.
///
/// Not the identity kernel of order 2, pi^(-D/2) exp(-|z|^2), which is [`HighOrderGaussian`](crate::HighOrderGaussian)
/// and is narrower by sqrt(2).
///
/// ```
/// use parops::{Gaussian, Kernel, MultiIndex, SmoothingKernel};
/// let w = Gaussian::<1>::new();
/// let top: f64 = w.value(&[0.0]);
/// assert!((top - 0.3989422804014327).abs() < 1e-16);
/// let second: f64 = w.derivative(MultiIndex::new([2]), &[2.0])?;
/// assert!((second - 3.0 * w.value(&[2.0])).abs() < 1e-16);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 5.1; notes 000, eq. 10 with errata 1 (epsilon stands outside the root).
#[derive(Clone, Debug)]
pub struct Gaussian<const D: usize> {
    term: [Term<D>; 1],
    constant: f64,
}

impl<const D: usize> Gaussian<D> {
    /// The kernel.
    pub fn new() -> Self {
        Self { term: [Term { index: MultiIndex::ZERO, factor: 1.0 }], constant: gaussian_constant::<D>(2.0 * PI) }
    }
}

impl<const D: usize> Default for Gaussian<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar, const D: usize> Kernel<T, D> for Gaussian<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        let [value] = profile(&[*z], 0.5, self.constant);
        value
    }

    fn values(&self, z: &[[T; D]], out: &mut [T]) {
        in_lanes(z, out, |z| profile(z, 0.5, self.constant));
    }

    fn terms(&self) -> &[Term<D>] {
        &self.term
    }

    fn order(&self) -> u32 {
        2
    }

    /// 8.5, the 6 of exp(-|z|^2) times sqrt(2), rounded up.
    fn support(&self) -> f64 {
        8.5
    }

    /// sqrt(2) 2/3.
    fn overlap_limit(&self) -> f64 {
        SQRT_2 * 2.0 / 3.0
    }

    fn positive_definite(&self) -> bool {
        true
    }
}

impl<T: Scalar, const D: usize> SmoothingKernel<T, D> for Gaussian<D> {
    fn derivative(&self, beta: MultiIndex<D>, z: &[T; D]) -> Result<T> {
        let mut product = self.value(z);
        for (&x, n) in z.iter().zip(beta.exponents()) {
            product *= signed_hermite(n, x);
        }
        Ok(product)
    }

    fn combination(&self, terms: &[Term<D>], z: &[[T; D]], out: &mut [T]) -> Result<()> {
        self.values(z, out);
        for (z, out) in z.iter().zip(out) {
            let value = *out;
            *out = T::zero();
            for term in terms {
                let mut product = value;
                for (&x, n) in z.iter().zip(term.index.exponents()) {
                    if n > 0 {
                        product *= signed_hermite(n, x);
                    }
                }
                *out += T::lift(term.factor) * product;
            }
        }
        Ok(())
    }

    fn gradient(&self, z: &[T; D]) -> Result<[T; D]> {
        let value = self.value(z);
        Ok(z.map(|x| -x * value))
    }

    fn normalization(&self) -> f64 {
        self.constant
    }
}

/// c exp(-a |z|^2).
#[inline(always)]
fn profile<T: Scalar, const D: usize, const L: usize>(z: &[[T; D]; L], a: f64, constant: f64) -> [T; L] {
    decay(z, a).1.map(|value| value * T::lift(constant))
}

/// (-1)^n He_n(x), by g_(n+1) = -x g_n - n g_(n-1).
#[inline]
fn signed_hermite<T: Scalar>(n: u8, x: T) -> T {
    let (mut previous, mut current) = (T::zero(), T::one());
    for k in 0..n {
        (previous, current) = (current, -x * current - previous * T::lift(f64::from(k)));
    }
    current
}

/// The wide Gaussian eta(z) = (2 sqrt(pi))^-D exp(-|z|^2/4), an exchange kernel of the Laplacian to order 2.
///
/// It is the narrow kernel 4 pi^(-D/2) exp(-|z|^2), [`Exchange`](crate::Exchange) of the Laplacian to order 2, with
/// epsilon replaced by 2 epsilon (the same operator): M_0 = 1, error (epsilon^2/2) u''''. A radius, a spacing or a step
/// limit of one must not be used with the other. Take this one to follow the diffusion kernels of the lecture notes,
/// the narrow one where every order shall share one epsilon.
///
/// ```
/// use parops::{Kernel, WideGaussian};
/// let eta = WideGaussian::<2>::new();
/// let expected = f64::exp(-0.25) / (4.0 * std::f64::consts::PI);
/// assert!((eta.value(&[0.6, 0.8]) - expected).abs() < 1e-16);
/// ```
///
/// Source: notes 001, eq. 5.27 and 6.9; errata 4 (the two widths) and 5 (the radius).
#[derive(Clone, Debug)]
pub struct WideGaussian<const D: usize> {
    terms: [Term<D>; D],
    constant: f64,
}

impl<const D: usize> WideGaussian<D> {
    /// The kernel.
    pub fn new() -> Self {
        Self { terms: laplacian(), constant: gaussian_constant::<D>(4.0 * PI) }
    }
}

impl<const D: usize> Default for WideGaussian<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar, const D: usize> Kernel<T, D> for WideGaussian<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        let [value] = profile(&[*z], 0.25, self.constant);
        value
    }

    fn values(&self, z: &[[T; D]], out: &mut [T]) {
        in_lanes(z, out, |z| profile(z, 0.25, self.constant));
    }

    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }

    fn order(&self) -> u32 {
        2
    }

    /// 8: what lies outside holds 5e-7 of the second moment for D = 1, 6e-6 for D = 3. At the 5 of the notes it is up
    /// to 3 %.
    fn support(&self) -> f64 {
        8.0
    }

    /// 4/3, twice that of the narrow kernel.
    fn overlap_limit(&self) -> f64 {
        4.0 / 3.0
    }

    fn positive_definite(&self) -> bool {
        true
    }
}
