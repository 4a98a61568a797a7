//! Exchange kernels eta^beta of any multi-index, and of sums of one degree, derived exactly.

use std::array;
use std::collections::BTreeSet;

use super::decay::{decay, in_lanes};
use super::derivation::{harmonics, radial};
use super::harmonic::Harmonic;
use super::polynomial::ExactPolynomial;
use super::rational::Rational;
use super::{Kernel, gaussian_constant};
use crate::error::{Error, KernelError, Result};
use crate::multi_index::{MultiIndex, Term, common_degree};
use crate::scalar::Scalar;

/// The exchange kernel eta(z) = pi^(-D/2) P(z) exp(-|z|^2) of L = sum_i c_i D^beta_i, all of one degree m, to order
/// r = 2, 4, 6 or 8.
///
/// P is derived from the moment conditions of [`Kernel`] in exact rational arithmetic. It is the one solution of the
/// form P = sum_l Y_l(z) sum_k c_lk |z|^2k, with the harmonics Y_l, l = m, m-2, ..., of z^beta_1 c_1 + z^beta_2 c_2 +
/// ..., and for each l as many coefficients c_lk as there are conditions. So a Laplacian has a purely radial kernel,
/// 4 for r = 2 (the narrow Gaussian of notes 000, eq. 20; the wide one is [`WideGaussian`](crate::WideGaussian)),
/// and 12 - 4|z|^2 for r = 4, D = 2. m = 0 gives the identity kernels.
///
/// The kernel is even for even m and odd for odd m; its argument is z = (x_p - x_q)/epsilon. A value costs one `exp`
/// and allocates nothing.
///
/// ```
/// use parops::{Exchange, Kernel, MultiIndex, Term};
/// let laplacian = [[2, 0], [0, 2]].map(|beta| Term { index: MultiIndex::new(beta), factor: 1.0 });
/// let eta = Exchange::new(&laplacian, 4)?;
/// let expected = (12.0 - 4.0 * 0.25) * f64::exp(-0.25) / std::f64::consts::PI;
/// assert!((eta.value(&[0.3, 0.4]) - expected).abs() < 1e-15);
/// assert_eq!(eta.moment(MultiIndex::new([2, 0]))?.to_string(), "2");
/// assert_eq!(eta.moment(MultiIndex::new([2, 2]))?.to_string(), "0");
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 000, eq. 16 to 20 (conditions and form), extended from single kernels to any beta; errata 4 and 10.
#[derive(Clone, Debug)]
pub struct Exchange<const D: usize> {
    terms: Vec<Term<D>>,
    degree: u32,
    order: u32,
    pieces: Vec<Piece<D>>,
    exact: Option<Vec<ExactPiece<D>>>,
}

/// Y_l(z) sum_k c_lk |z|^2k, ready to evaluate.
#[derive(Clone, Debug)]
struct Piece<const D: usize> {
    harmonic: Harmonic<D>,
    radial: Vec<f64>,
}

/// The same in rational numbers.
type ExactPiece<const D: usize> = (ExactPolynomial<D>, Vec<Rational>);

impl<const D: usize> Exchange<D> {
    /// The largest degree m up to which the derivation fits 128 bits, whatever the multi-index, for D <= 3 and r <= 8.
    ///
    /// Beyond it derivations that overflow are refused; the others still succeed. A value is within rounding of the
    /// absolute terms of P, which cancel ever more with growing m.
    pub const DEGREE_LIMIT: u32 = 41;

    /// The largest number of monomials of degree m that the derivation can meet.
    ///
    /// It meets those that differ from some beta_i by even numbers: for each parity that occurs among the beta_i, with
    /// n odd exponents, C((m - n)/2 + D - 1, D - 1). Enough for any sum up to [`DEGREE_LIMIT`](Self::DEGREE_LIMIT) for
    /// D <= 3, and for single multi-indices up to degree 33 for D = 4, 21 for D = 5 and 15 for D = 6.
    pub const MONOMIAL_LIMIT: usize = 1024;

    /// The kernel of sum_i c_i D^beta_i to order r = `order`.
    ///
    /// The factors c_i are taken as the binary fractions they are, so that a sum of harmonics that cancels is
    /// exactly zero. Where they lie so far apart that this leaves 128 bits, each term is still derived exactly, and
    /// the sum over the terms alone is rounded.
    ///
    /// # Errors
    /// [`KernelError::Order`] where r is not 2, 4, 6 or 8, [`KernelError::Overflow`] where the exact derivation
    /// of a term does not fit 128 bits or that of the sum [`MONOMIAL_LIMIT`](Self::MONOMIAL_LIMIT) monomials (neither
    /// up to [`DEGREE_LIMIT`](Self::DEGREE_LIMIT) for D <= 3), and the refusals of [`common_degree`].
    pub fn new(terms: &[Term<D>], order: u32) -> Result<Self> {
        let degree = common_degree(terms)?;
        if !matches!(order, 2 | 4 | 6 | 8) {
            return Err(KernelError::Order { order }.into());
        }
        let overflow = || Error::from(KernelError::Overflow { degree, order });
        // Before the first expansion, which alone may take hours.
        if monomials(terms, degree) > Self::MONOMIAL_LIMIT as f64 {
            return Err(overflow());
        }
        // A power of two of the size of the largest factor is taken out and put back at the end.
        let largest = terms.iter().fold(0.0, |largest: f64, term| largest.max(term.factor.abs()));
        let scale = f64::from_bits(largest.to_bits() & (0x7ff << 52));
        let scale = if scale.is_normal() { scale } else { 1.0 };
        let derived = combined(terms, scale).and_then(|polynomial| derive(polynomial, degree, order));
        let mut pieces = Vec::new();
        let exact = match derived {
            Some(parts) => {
                for (polynomial, radial) in &parts {
                    pieces.push(Piece::new(
                        Harmonic::new(polynomial.iter().map(|(l, c)| (l, c.to_f64()))),
                        radial,
                        scale,
                    ));
                }
                Rational::from_f64(scale).and_then(|scale| {
                    let scaled = |(harmonic, radial): ExactPiece<D>| Some((harmonic.checked_scale(scale)?, radial));
                    parts.into_iter().map(scaled).collect()
                })
            }
            None => {
                for term in terms {
                    let parts = derive(ExactPolynomial::monomial(term.index, Rational::ONE), degree, order);
                    for (polynomial, radial) in parts.ok_or_else(overflow)? {
                        let harmonic = Harmonic::new(polynomial.iter().map(|(l, c)| (l, c.to_f64())));
                        pieces.push(Piece::new(harmonic, &radial, term.factor));
                    }
                }
                None
            }
        };
        Ok(Self { terms: terms.to_vec(), degree, order, pieces, exact })
    }

    /// The polynomial P, exactly; `None` where it does not fit 128-bit rationals.
    pub fn exact(&self) -> Option<ExactPolynomial<D>> {
        let mut sum = ExactPolynomial::zero();
        for (harmonic, radial) in self.exact.as_ref()? {
            let mut power = harmonic.clone();
            for (k, &coefficient) in radial.iter().enumerate() {
                if k > 0 {
                    power = power.times_square()?;
                }
                sum = sum.checked_add(&power.checked_scale(coefficient)?)?;
            }
        }
        Some(sum)
    }

    /// The moment M_alpha = Int z^alpha eta(z) dz, exactly.
    ///
    /// # Errors
    /// [`KernelError::Overflow`] where it, or [`exact`](Self::exact), does not fit 128-bit rationals.
    pub fn moment(&self, alpha: MultiIndex<D>) -> Result<Rational> {
        let moment = self.exact().and_then(|polynomial| polynomial.gaussian_moment(alpha));
        moment.ok_or_else(|| KernelError::Overflow { degree: self.degree, order: self.order }.into())
    }

    /// eta at L points.
    #[inline(always)]
    fn at<T: Scalar, const L: usize>(&self, z: &[[T; D]; L]) -> [T; L] {
        let (s, decay) = decay(z, 1.0);
        let mut sum = [T::zero(); L];
        for piece in &self.pieces {
            let radial = horner_lanes(&piece.radial, &s);
            for i in 0..L {
                sum[i] += piece.harmonic.value(&z[i]) * radial[i];
            }
        }
        array::from_fn(|i| sum[i] * decay[i])
    }

    /// The coefficients of P in |z|^2, with pi^(-D/2), where P is radial.
    pub(super) fn radial(&self) -> Option<&[f64]> {
        match self.pieces.as_slice() {
            [piece] if piece.harmonic.is_constant() => Some(&piece.radial),
            _ => None,
        }
    }
}

/// How many monomials of this degree the Laplacian and |z|^2 can make of those of the terms; see
/// [`Exchange::MONOMIAL_LIMIT`].
fn monomials<const D: usize>(terms: &[Term<D>], degree: u32) -> f64 {
    let parities: BTreeSet<_> = terms.iter().map(|term| term.index.exponents().map(|n| n % 2)).collect();
    let counts = parities.iter().map(|parity| {
        let pairs = (degree - parity.iter().map(|&odd| u32::from(odd)).sum::<u32>()) / 2;
        // C(pairs + D - 1, D - 1), one dimension after another.
        (1..D).fold(1.0, |count, axis| count * f64::from(pairs) / axis as f64 + count)
    });
    counts.sum()
}

/// sum_i (c_i / scale) z^beta_i.
fn combined<const D: usize>(terms: &[Term<D>], scale: f64) -> Option<ExactPolynomial<D>> {
    terms.iter().try_fold(ExactPolynomial::zero(), |sum, term| {
        sum.checked_add_monomial(term.index, Rational::from_f64(term.factor / scale)?)
    })
}

/// The harmonics of p, homogeneous of degree m, that do not vanish, with their radial coefficients.
fn derive<const D: usize>(p: ExactPolynomial<D>, m: u32, order: u32) -> Option<Vec<ExactPiece<D>>> {
    let mut parts = Vec::new();
    for (harmonic, j) in harmonics(p, m)?.into_iter().zip(0..) {
        if !harmonic.is_zero() {
            parts.push((harmonic, radial(D, m, j, order)?));
        }
    }
    Some(parts)
}

impl<const D: usize> Piece<D> {
    fn new(harmonic: Harmonic<D>, radial: &[Rational], factor: f64) -> Self {
        let (harmonic, constant) = harmonic.normalized();
        let front = constant * gaussian_constant::<D>(std::f64::consts::PI) * factor;
        Self { harmonic, radial: radial.iter().map(|c| c.to_f64() * front).collect() }
    }
}

/// exp(-|z|^2) sum_k c_k |z|^2k.
#[inline(always)]
pub(super) fn radial_profile<T: Scalar, const D: usize, const L: usize>(radial: &[f64], z: &[[T; D]; L]) -> [T; L] {
    let (s, decay) = decay(z, 1.0);
    let polynomial = horner_lanes(radial, &s);
    array::from_fn(|i| polynomial[i] * decay[i])
}

/// sum_k c_k s^k.
#[inline(always)]
pub(super) fn horner<T: Scalar>(coefficients: &[f64], s: T) -> T {
    let [sum] = horner_lanes(coefficients, &[s]);
    sum
}

/// sum_k c_k s^k for several s side by side.
#[inline(always)]
pub(super) fn horner_lanes<T: Scalar, const L: usize>(coefficients: &[f64], s: &[T; L]) -> [T; L] {
    // Begun with the last coefficient, a constant stays one where s overflows.
    let Some((&last, others)) = coefficients.split_last() else { return [T::zero(); L] };
    others.iter().rev().fold([T::lift(last); L], |sum, &c| array::from_fn(|i| sum[i] * s[i] + T::lift(c)))
}

impl<T: Scalar, const D: usize> Kernel<T, D> for Exchange<D> {
    #[inline]
    fn value(&self, z: &[T; D]) -> T {
        let [value] = self.at(&[*z]);
        value
    }

    fn values(&self, z: &[[T; D]], out: &mut [T]) {
        if let Some(radial) = self.radial() {
            in_lanes(z, out, |z| radial_profile(radial, z));
        } else {
            in_lanes(z, out, |z| self.at(z));
        }
    }

    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }

    fn order(&self) -> u32 {
        self.order
    }

    /// 6, and from m = 6 on sqrt(3.75 m + 1.8 r) where that is more: outside lies less than 1e-5 alpha! max |c_i|
    /// of any moment M_alpha with a condition.
    fn support(&self) -> f64 {
        // Fitted to the radii at which 1e-5 is reached, for m <= 20.
        (3.75 * f64::from(self.degree) + 1.8 * f64::from(self.order)).max(36.0).sqrt()
    }

    /// 2/3, and 1/2 for r = 8 (errata 7); from m = 3 on 1/sqrt(0.36 m + 0.23 r + 0.5) where that is less. There a
    /// lattice misses no condition by more than 1e-4 alpha! max |c_i|.
    fn overlap_limit(&self) -> f64 {
        let known: f64 = if self.order <= 6 { 2.0 / 3.0 } else { 0.5 };
        if self.degree <= 2 {
            return known;
        }
        // Fitted to the spacings at which 1e-5 is reached, for m <= 20; the promise leaves a factor of 10.
        known.min(1.0 / (0.36 * f64::from(self.degree) + 0.23 * f64::from(self.order) + 0.5).sqrt())
    }

    /// True for the identity and for positive multiples of the Laplacian, of any order: their transforms are
    /// exp(-s) sum_(j<r/2) q_j s^j, s = |k|^2/4, with q_j = 1/j! and q_j = (2r - 4j)/j!.
    fn positive_definite(&self) -> bool {
        self.degree <= 2 && self.radial().is_some_and(|radial| radial.first().is_some_and(|&c| c > 0.0))
    }
}
