//! Polynomials in D variables with exact rational coefficients.

use std::collections::BTreeMap;

use super::rational::Rational;
use crate::multi_index::MultiIndex;

/// A polynomial P(z) = sum_alpha p_alpha z^alpha with rational coefficients.
///
/// Operations give `None` where a coefficient does not fit [`Rational`], or an exponent exceeds 255.
///
/// ```
/// use parops::{ExactPolynomial, MultiIndex, Rational};
/// let p = ExactPolynomial::monomial(MultiIndex::new([4, 0]), Rational::ONE);
/// let laplacian = p.laplacian().unwrap();
/// assert_eq!(laplacian.coefficient(MultiIndex::new([2, 0])), Rational::integer(12));
/// assert_eq!(p.gaussian_moment(MultiIndex::ZERO), Rational::new(3, 4));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExactPolynomial<const D: usize>(BTreeMap<MultiIndex<D>, Rational>);

impl<const D: usize> ExactPolynomial<D> {
    /// The polynomial 0.
    pub fn zero() -> Self {
        Self(BTreeMap::new())
    }

    /// p z^alpha.
    pub fn monomial(alpha: MultiIndex<D>, p: Rational) -> Self {
        let mut terms = BTreeMap::new();
        if !p.is_zero() {
            terms.insert(alpha, p);
        }
        Self(terms)
    }

    /// Whether this is the polynomial 0.
    pub fn is_zero(&self) -> bool {
        self.0.is_empty()
    }

    /// The coefficient p_alpha, 0 where the monomial does not occur.
    pub fn coefficient(&self, alpha: MultiIndex<D>) -> Rational {
        self.0.get(&alpha).copied().unwrap_or(Rational::ZERO)
    }

    /// The monomials that occur, with their coefficients, in the order of the exponents.
    pub fn iter(&self) -> impl Iterator<Item = (MultiIndex<D>, Rational)> + '_ {
        self.0.iter().map(|(&alpha, &p)| (alpha, p))
    }

    /// P + p z^alpha.
    pub fn checked_add_monomial(mut self, alpha: MultiIndex<D>, p: Rational) -> Option<Self> {
        let sum = self.coefficient(alpha).checked_add(p)?;
        if sum.is_zero() {
            self.0.remove(&alpha);
        } else {
            self.0.insert(alpha, sum);
        }
        Some(self)
    }

    /// P + Q.
    pub fn checked_add(self, other: &Self) -> Option<Self> {
        other.iter().try_fold(self, |sum, (alpha, p)| sum.checked_add_monomial(alpha, p))
    }

    /// factor * P.
    pub fn checked_scale(&self, factor: Rational) -> Option<Self> {
        self.map(|alpha, p| Some((alpha, p.checked_mul(factor)?)))
    }

    /// The Laplacian sum_i d^2 P / dz_i^2.
    pub fn laplacian(&self) -> Option<Self> {
        (0..D).try_fold(Self::zero(), |sum, axis| {
            let second = self.map(|alpha, p| {
                let mut exponents = alpha.exponents();
                let n = i128::from(exponents[axis]);
                exponents[axis] = exponents[axis].saturating_sub(2);
                Some((MultiIndex::new(exponents), p.checked_mul(Rational::integer(n * (n - 1)))?))
            })?;
            sum.checked_add(&second)
        })
    }

    /// |z|^2 P.
    pub fn times_square(&self) -> Option<Self> {
        (0..D).try_fold(Self::zero(), |sum, axis| {
            let shifted = self.map(|alpha, p| {
                let mut exponents = alpha.exponents();
                exponents[axis] = exponents[axis].checked_add(2)?;
                Some((MultiIndex::new(exponents), p))
            })?;
            sum.checked_add(&shifted)
        })
    }

    /// pi^(-D/2) Int z^alpha P(z) exp(-|z|^2) dz.
    ///
    /// By axis, pi^(-1/2) Int x^(2n) exp(-x^2) dx = (1/2)(3/2)...(n - 1/2), and odd powers vanish.
    pub fn gaussian_moment(&self, alpha: MultiIndex<D>) -> Option<Rational> {
        self.iter().try_fold(Rational::ZERO, |sum, (beta, p)| {
            let exponents =
                alpha.exponents().into_iter().zip(beta.exponents()).map(|(a, b)| i128::from(a) + i128::from(b));
            if exponents.clone().any(|n| n % 2 != 0) {
                return Some(sum);
            }
            let mut factors = exponents.flat_map(|n| (1..n).step_by(2));
            sum.checked_add(factors.try_fold(p, |product, odd| product.checked_mul(Rational::new(odd, 2)?))?)
        })
    }

    /// Maps monomials that stay different, dropping those that vanish.
    fn map(&self, image: impl Fn(MultiIndex<D>, Rational) -> Option<(MultiIndex<D>, Rational)>) -> Option<Self> {
        let mut terms = BTreeMap::new();
        for (alpha, p) in self.iter() {
            let (alpha, p) = image(alpha, p)?;
            if !p.is_zero() {
                terms.insert(alpha, p);
            }
        }
        Some(Self(terms))
    }
}
