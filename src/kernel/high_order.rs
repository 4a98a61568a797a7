//! Smoothing kernels of order above 2: the identity kernels, a polynomial times exp(-|z|^2).

use super::decay::{damp, decay, in_lanes};
use super::exchange::{Exchange, horner, radial_profile};
use super::{Kernel, SmoothingKernel, gaussian_constant};
use crate::error::{KernelError, Result};
use crate::multi_index::{MultiIndex, Term};
use crate::scalar::{Scalar, square};

/// The smoothing kernel W(z) = pi^(-D/2) P(|z|^2) exp(-|z|^2) of order r = 2, 4, 6 or 8: the identity kernel.
///
/// P has degree r/2 - 1 and is [`Exchange`] for beta = 0: 1 for r = 2, D/2 + 1 - |z|^2 for r = 4. All orders share one
/// width, so that one epsilon serves them; it is narrower by sqrt(2) than [`Gaussian`](crate::Gaussian). From r = 4 on
/// W is negative at a distance.
///
/// Derivatives are those of a function g of s = |z|^2,
/// D^beta W = sum_(2k <= beta) prod_i (beta_i! / (k_i! (beta_i - 2k_i)!)) (2z)^(beta - 2k) g^(|beta| - |k|)(s), and
/// allocate nothing. f32 overflows to infinity in high degrees, from about 40 on.
///
/// ```
/// use parops::{HighOrderGaussian, Kernel, SmoothingKernel};
/// let w = HighOrderGaussian::<2>::new(4)?;
/// assert!((w.value(&[0.0, 0.0]) - 2.0 / std::f64::consts::PI).abs() < 1e-15);
/// assert_eq!(w.gradient(&[0.0, 0.0])?, [0.0, 0.0]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 000, eq. 18 for beta = 0; notes 001, sec. 5.1 for what a smoothing kernel must satisfy.
#[derive(Clone, Debug)]
pub struct HighOrderGaussian<const D: usize> {
    identity: Exchange<D>,
    /// How many coefficients P has, r/2.
    coefficients: usize,
    /// g(s) exp(s) = sum_k profile_k s^k and its first three derivatives; P has at most four coefficients.
    profiles: [[f64; 4]; 4],
}

impl<const D: usize> HighOrderGaussian<D> {
    /// The highest |beta| of a derivative: beyond it factorials leave the range of `f64`.
    pub const DERIVATIVE_LIMIT: u32 = 255;

    /// The kernel of order r = `order`.
    ///
    /// # Errors
    /// [`KernelError::Order`] where r is not 2, 4, 6 or 8.
    pub fn new(order: u32) -> Result<Self> {
        let identity = Exchange::new(&[Term { index: MultiIndex::ZERO, factor: 1.0 }], order)?;
        let mut profiles = [[0.0; 4]; 4];
        for (profile, &coefficient) in profiles[0].iter_mut().zip(identity.radial().unwrap_or(&[])) {
            *profile = coefficient;
        }
        for j in 1..4 {
            profiles[j] = std::array::from_fn(|k| if k < 3 { profiles[j - 1][k + 1] * (k + 1) as f64 } else { 0.0 });
        }
        Ok(Self { identity, coefficients: order as usize / 2, profiles })
    }

    /// The same kernel among the exchange kernels, with its exact polynomial and moments.
    pub fn as_exchange(&self) -> &Exchange<D> {
        &self.identity
    }

    /// The coefficients of exp(s) g^(m)(s) = (d/ds - 1)^m P = sum_j C(m,j) (-1)^(m-j) P^(j).
    #[inline]
    fn differentiated(&self, m: u32) -> [f64; 4] {
        let m = f64::from(m);
        let binomials = [1.0, -m, m * (m - 1.0) / 2.0, -m * (m - 1.0) * (m - 2.0) / 6.0];
        let sign = if m % 2.0 == 0.0 { 1.0 } else { -1.0 };
        std::array::from_fn(|k| {
            let sum: f64 = self.profiles.iter().zip(binomials).map(|(profile, binomial)| profile[k] * binomial).sum();
            sign * sum
        })
    }
}

impl<T: Scalar, const D: usize> Kernel<T, D> for HighOrderGaussian<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        let [value] = radial_profile(&self.profiles[0][..self.coefficients], &[*z]);
        value
    }

    fn values(&self, z: &[[T; D]], out: &mut [T]) {
        let radial = &self.profiles[0][..self.coefficients];
        in_lanes(z, out, |z| radial_profile(radial, z));
    }

    fn terms(&self) -> &[Term<D>] {
        Kernel::<T, D>::terms(&self.identity)
    }

    fn order(&self) -> u32 {
        Kernel::<T, D>::order(&self.identity)
    }

    fn support(&self) -> f64 {
        Kernel::<T, D>::support(&self.identity)
    }

    fn overlap_limit(&self) -> f64 {
        Kernel::<T, D>::overlap_limit(&self.identity)
    }

    fn positive_definite(&self) -> bool {
        true
    }
}

impl<T: Scalar, const D: usize> SmoothingKernel<T, D> for HighOrderGaussian<D> {
    fn derivative(&self, beta: MultiIndex<D>, z: &[T; D]) -> Result<T> {
        let mut out = [T::zero()];
        self.combination(&[Term { index: beta, factor: 1.0 }], std::slice::from_ref(z), &mut out)?;
        Ok(out[0])
    }

    fn derivatives(&self, beta: MultiIndex<D>, z: &[[T; D]], out: &mut [T]) -> Result<()> {
        self.combination(&[Term { index: beta, factor: 1.0 }], z, out)
    }

    fn combination(&self, terms: &[Term<D>], z: &[[T; D]], out: &mut [T]) -> Result<()> {
        out.fill(T::zero());
        for &Term { index, factor } in terms {
            let degree = index.degree();
            if degree > Self::DERIVATIVE_LIMIT {
                return Err(KernelError::Regularity {
                    kernel: "HighOrderGaussian",
                    degree,
                    limit: Self::DERIVATIVE_LIMIT,
                }
                .into());
            }
            for_each_half(index, |halves, taken| {
                let radial = self.differentiated(degree - taken);
                let radial = &radial[..self.coefficients];
                let mut front = T::lift(factor);
                let mut exponents = index.exponents();
                for (n, &k) in exponents.iter_mut().zip(halves) {
                    front *= T::lift(constant(*n, k));
                    *n -= 2 * k;
                }
                let monomial = MultiIndex::new(exponents);
                for (z, out) in z.iter().zip(&mut *out) {
                    *out += front * monomial.power(z) * horner(radial, square(z));
                }
            });
        }
        damp(z, out);
        Ok(())
    }

    fn gradient(&self, z: &[T; D]) -> Result<[T; D]> {
        let ([s], [decay]) = decay(&[*z], 1.0);
        let slope = (horner(&self.profiles[1], s) - horner(&self.profiles[0], s)) * T::lift(2.0) * decay;
        Ok(z.map(|x| x * slope))
    }

    fn normalization(&self) -> f64 {
        gaussian_constant::<D>(std::f64::consts::PI)
    }
}

/// Calls `visit(k, |k|)` for all k with 2k <= beta.
#[inline]
pub(super) fn for_each_half<const D: usize>(beta: MultiIndex<D>, mut visit: impl FnMut(&[u8; D], u32)) {
    let exponents = beta.exponents();
    let mut halves = [0_u8; D];
    loop {
        visit(&halves, halves.iter().map(|&k| u32::from(k)).sum());
        let Some(axis) = (0..D).find(|&axis| 2 * u32::from(halves[axis]) + 2 <= u32::from(exponents[axis])) else {
            return;
        };
        halves[axis] += 1;
        halves[..axis].fill(0);
    }
}

/// 2^(n - 2k) n! / (k! (n - 2k)!).
#[inline]
pub(super) fn constant(n: u8, k: u8) -> f64 {
    let (n, k) = (u32::from(n), u32::from(k));
    let mut factor = 1.0;
    for i in 0..k {
        // n! / (n - 2k)! has two factors for each one of k!.
        factor *= f64::from((n - 2 * i) * (n - 2 * i - 1)) / f64::from(i + 1);
    }
    (0..n - 2 * k).fold(factor, |product, _| product + product)
}
