//! Exact rational numbers with checked 128-bit arithmetic.

use std::cmp::Ordering;
use std::fmt;

/// A rational number n/d, d > 0, in lowest terms.
///
/// Every operation is checked and gives `None` where the result does not fit 128-bit integers or is a division
/// by zero, like the `checked_` functions of the standard integers: nothing here rounds or panics.
///
/// ```
/// use parops::Rational;
/// let third = Rational::new(2, 6).unwrap();
/// assert_eq!(third.checked_add(Rational::integer(1)).unwrap().to_string(), "4/3");
/// assert_eq!(third.to_f64(), 1.0 / 3.0);
/// assert!(Rational::integer(i128::MAX).checked_add(third).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rational {
    numerator: i128,
    denominator: i128,
}

impl Rational {
    /// The number 0.
    pub const ZERO: Self = Self::integer(0);
    /// The number 1.
    pub const ONE: Self = Self::integer(1);

    /// n/1.
    pub const fn integer(n: i128) -> Self {
        Self { numerator: n, denominator: 1 }
    }

    /// n/d in lowest terms; `None` for d = 0 and where the reduced numbers do not fit.
    pub fn new(n: i128, d: i128) -> Option<Self> {
        if d == 0 {
            return None;
        }
        let divisor = gcd(n.unsigned_abs(), d.unsigned_abs());
        let numerator = i128::try_from(n.unsigned_abs() / divisor).ok()?;
        let denominator = i128::try_from(d.unsigned_abs() / divisor).ok()?;
        Some(Self { numerator: if (n < 0) == (d < 0) { numerator } else { -numerator }, denominator })
    }

    /// The value of a finite `f64`, which is a fraction whose denominator is a power of two; `None` where it does
    /// not fit.
    pub fn from_f64(x: f64) -> Option<Self> {
        if x == 0.0 {
            return Some(Self::ZERO);
        }
        if !x.is_normal() {
            return None;
        }
        let bits = x.to_bits();
        let exponent = i64::try_from((bits >> 52) & 0x7ff).ok()? - 1075;
        let mantissa = i128::from((bits & ((1 << 52) - 1)) | (1 << 52));
        let zeros = mantissa.trailing_zeros();
        let odd = if x < 0.0 { -(mantissa >> zeros) } else { mantissa >> zeros };
        let exponent = exponent + i64::from(zeros);
        let power = |e: i64| 2_i128.checked_pow(u32::try_from(e).ok()?);
        if exponent < 0 {
            Some(Self { numerator: odd, denominator: power(-exponent)? })
        } else {
            Some(Self::integer(odd.checked_mul(power(exponent)?)?))
        }
    }

    /// The numerator n, which carries the sign.
    pub const fn numerator(self) -> i128 {
        self.numerator
    }

    /// The denominator d > 0.
    pub const fn denominator(self) -> i128 {
        self.denominator
    }

    /// Whether this is 0.
    pub const fn is_zero(self) -> bool {
        self.numerator == 0
    }

    /// The sum.
    pub fn checked_add(self, other: Self) -> Option<Self> {
        let common = i128::try_from(gcd(self.denominator.unsigned_abs(), other.denominator.unsigned_abs())).ok()?;
        let scale = other.denominator / common;
        let left = self.numerator.checked_mul(scale)?;
        let right = other.numerator.checked_mul(self.denominator / common)?;
        // What the sum shares with the common denominator divides `common`: reduce before the last product.
        let sum = left.checked_add(right)?;
        let shared = i128::try_from(gcd(sum.unsigned_abs(), common.unsigned_abs())).ok()?;
        Self::new(sum / shared, (self.denominator / shared).checked_mul(scale)?)
    }

    /// The product.
    pub fn checked_mul(self, other: Self) -> Option<Self> {
        let (left, right) =
            (Self::new(self.numerator, other.denominator)?, Self::new(other.numerator, self.denominator)?);
        Some(Self {
            numerator: left.numerator.checked_mul(right.numerator)?,
            denominator: left.denominator.checked_mul(right.denominator)?,
        })
    }

    /// The quotient; `None` also for a division by 0.
    pub fn checked_div(self, other: Self) -> Option<Self> {
        self.checked_mul(Self::new(other.denominator, other.numerator)?)
    }

    /// The nearest `f64`, ties to even.
    pub fn to_f64(self) -> f64 {
        let divisor = self.denominator.unsigned_abs();
        let mut quotient = self.numerator.unsigned_abs() / divisor;
        let mut remainder = self.numerator.unsigned_abs() % divisor;
        let mut exponent = 0_u64;
        // 64 bits of quotient and a sticky bit decide the rounding; the shifts cannot overflow as remainder < 2^127.
        while quotient >> 64 == 0 && remainder != 0 {
            remainder <<= 1;
            quotient = (quotient << 1) | u128::from(remainder >= divisor);
            if remainder >= divisor {
                remainder -= divisor;
            }
            exponent += 1;
        }
        let magnitude = (quotient | u128::from(remainder != 0)) as f64 * f64::from_bits((1023 - exponent) << 52);
        if self.numerator < 0 { -magnitude } else { magnitude }
    }
}

impl From<i32> for Rational {
    fn from(n: i32) -> Self {
        Self::integer(n.into())
    }
}

impl PartialOrd for Rational {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Rational {
    /// By continued fractions, so that no product is formed that could overflow.
    fn cmp(&self, other: &Self) -> Ordering {
        let (mut a, mut b) = (*self, *other);
        let mut swapped = false;
        loop {
            let whole = |x: Self| x.numerator.div_euclid(x.denominator);
            let order = whole(a).cmp(&whole(b));
            let (rest_a, rest_b) = (a.numerator.rem_euclid(a.denominator), b.numerator.rem_euclid(b.denominator));
            let order = order.then_with(|| match (rest_a, rest_b) {
                (0, 0) => Ordering::Equal,
                (0, _) => Ordering::Less,
                (_, 0) => Ordering::Greater,
                _ => Ordering::Equal,
            });
            if order != Ordering::Equal || rest_a == 0 {
                return if swapped { order.reverse() } else { order };
            }
            // The reciprocals of the fractional parts compare the other way round.
            a = Self { numerator: a.denominator, denominator: rest_a };
            b = Self { numerator: b.denominator, denominator: rest_b };
            swapped = !swapped;
        }
    }
}

impl fmt::Display for Rational {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.denominator == 1 {
            write!(f, "{}", self.numerator)
        } else {
            write!(f, "{}/{}", self.numerator, self.denominator)
        }
    }
}

/// The greatest common divisor; 1 for two zeros, so that it can always be divided by.
fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a.max(1)
}
