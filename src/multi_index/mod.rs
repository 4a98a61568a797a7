//! Multi-indices beta: which derivative is meant, how many conditions it takes, in which order they are counted.

mod graded;
mod typed;

pub use graded::{condition_count, graded};
pub use typed::{Beta, D1, D2, D3, Exponents, HasLen, SameDegree};

use std::fmt;

use crate::error::{MultiIndexError, Result};
use crate::scalar::Scalar;

/// A multi-index beta = (beta_1, ..., beta_D), known at run time.
///
/// D^beta = d^|beta| / (dx_1^beta_1 ... dx_D^beta_D). The compile-time counterpart is [`Beta`]; both enter the same
/// numerics and give identical bits.
///
/// ```
/// use parops::{D2, MultiIndex};
/// let beta = MultiIndex::from(D2::<2, 1>::default());
/// assert_eq!(beta, MultiIndex::new([2, 1]));
/// assert_eq!((beta.degree(), beta.factorial()?, beta.is_even()), (3, 2, false));
/// assert_eq!(beta.to_string(), "D^(2,1)");
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 5.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MultiIndex<const D: usize>([u8; D]);

impl<const D: usize> MultiIndex<D> {
    /// The multi-index 0: the function itself.
    pub const ZERO: Self = Self([0; D]);

    /// The multi-index with these exponents.
    pub const fn new(exponents: [u8; D]) -> Self {
        Self(exponents)
    }

    /// The first derivative along `axis`.
    ///
    /// # Errors
    /// [`MultiIndexError::Output`] where the axis is not below D.
    pub fn unit(axis: usize) -> Result<Self> {
        let mut exponents = [0; D];
        match exponents.get_mut(axis) {
            Some(exponent) => *exponent = 1,
            None => return Err(MultiIndexError::Output { output: axis, outputs: D }.into()),
        }
        Ok(Self(exponents))
    }

    /// The exponents beta_i.
    pub const fn exponents(&self) -> [u8; D] {
        self.0
    }

    /// |beta| = sum_i beta_i.
    pub const fn degree(&self) -> u32 {
        let (mut sum, mut i) = (0, 0);
        while i < D {
            sum += self.0[i] as u32;
            i += 1;
        }
        sum
    }

    /// Whether |beta| is even.
    pub const fn is_even(&self) -> bool {
        self.degree().is_multiple_of(2)
    }

    /// (-1)^|beta|.
    pub const fn sign(&self) -> i32 {
        if self.is_even() { 1 } else { -1 }
    }

    /// beta! = prod_i beta_i!, exact.
    ///
    /// # Errors
    /// [`MultiIndexError::Degree`] where it does not fit 128 bits (34! is the last single factorial that does).
    pub fn factorial(&self) -> Result<u128> {
        let mut factors = self.0.iter().flat_map(|&exponent| 1..=u128::from(exponent));
        factors
            .try_fold(1_u128, u128::checked_mul)
            .ok_or_else(|| MultiIndexError::Degree { degree: self.degree(), limit: 34 }.into())
    }

    /// The monomial z^beta = prod_i z_i^beta_i, by repeated multiplication from the first axis on.
    #[inline]
    pub fn power<T: Scalar>(&self, z: &[T; D]) -> T {
        let mut product = T::one();
        for (&x, &exponent) in z.iter().zip(&self.0) {
            for _ in 0..exponent {
                product *= x;
            }
        }
        product
    }
}

impl<const D: usize> fmt::Display for MultiIndex<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("D^(")?;
        for (i, exponent) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str(",")?;
            }
            write!(f, "{exponent}")?;
        }
        f.write_str(")")
    }
}

/// One term of a linear differential operator: `factor` * D^`index`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term<const D: usize> {
    /// Which derivative.
    pub index: MultiIndex<D>,
    /// Its factor.
    pub factor: f64,
}

/// The common degree |beta| of the terms of one operator.
///
/// # Errors
/// [`MultiIndexError::Empty`] without terms, [`MultiIndexError::UnequalDegree`] where two degrees differ,
/// [`MultiIndexError::Factor`] where a factor is not finite.
pub fn common_degree<const D: usize>(terms: &[Term<D>]) -> Result<u32> {
    let Some(first) = terms.first().map(|term| term.index.degree()) else {
        return Err(MultiIndexError::Empty { output: 0 }.into());
    };
    for term in terms {
        let other = term.index.degree();
        if other != first {
            return Err(MultiIndexError::UnequalDegree { first, other }.into());
        }
        if !term.factor.is_finite() {
            return Err(MultiIndexError::Factor { factor: term.factor }.into());
        }
    }
    Ok(first)
}
