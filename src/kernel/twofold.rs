//! Numbers of twice the digits of `f64`, for small systems that lose half of them.

use std::ops::{Add, Div, Mul, Sub};

/// The unevaluated sum high + low with |low| <= ulp(high)/2: about 32 digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Twofold {
    high: f64,
    low: f64,
}

impl Twofold {
    /// pi^(-1/2).
    pub(super) const FRAC_1_SQRT_PI: Self = Self { high: 0.564_189_583_547_756_3, low: 7.667_729_806_582_94e-18 };

    /// The nearest `f64`.
    pub(super) fn to_f64(self) -> f64 {
        self.high
    }

    /// a + b without error, for |a| >= |b| or a = 0.
    fn ordered(a: f64, b: f64) -> Self {
        let high = a + b;
        Self { high, low: b - (high - a) }
    }

    /// a + b without error.
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self { high, low: (a - (high - part)) + (b - part) }
    }
}

impl From<f64> for Twofold {
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl Add for Twofold {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, low) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let whole = Self::ordered(high.high, high.low + low.high);
        Self::ordered(whole.high, whole.low + low.low)
    }
}

impl Sub for Twofold {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for Twofold {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let rest = self.high.mul_add(other.high, -high);
        Self::ordered(high, rest + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Twofold {
    type Output = Self;

    /// Two digits of a long division, each of 53 bits.
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * first.into();
        Self::ordered(first, rest.high / other.high)
    }
}

/// Solves A x = b by elimination with partial pivoting; `rows` holds the rows of A, each with its entry of b behind it.
/// `None` where a pivot is zero.
pub(super) fn solve(mut rows: Vec<Vec<Twofold>>) -> Option<Vec<Twofold>> {
    let n = rows.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].high.abs().total_cmp(&rows[j][k].high.abs()))?;
        rows.swap(k, pivot);
        let (done, rest) = rows.split_at_mut(k + 1);
        let row = &done[k];
        if row[k].high == 0.0 {
            return None;
        }
        for other in rest {
            let factor = other[k] / row[k];
            for (entry, &above) in other[k..].iter_mut().zip(&row[k..]) {
                *entry = *entry - factor * above;
            }
        }
    }
    let mut x = vec![Twofold::default(); n];
    for k in (0..n).rev() {
        let known = (k + 1..n).fold(rows[k][n], |sum, j| sum - rows[k][j] * x[j]);
        x[k] = known / rows[k][k];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::{Twofold, solve};

    #[test]
    fn hilbert_system_of_order_ten_keeps_all_digits_of_a_double() {
        // The inverse of the Hilbert matrix has integer entries; its condition number is 1.6e13.
        const N: usize = 10;
        let third = |i: usize| Twofold::from(1.0) / ((i + 1) as f64).into();
        let rows = (0..N).map(|i| {
            let entries = (0..N).map(|j| third(i + j));
            entries.chain([Twofold::from(if i == 0 { 1.0 } else { 0.0 })]).collect()
        });
        let x = solve(rows.collect()).expect("regular");
        // Entries of column 0 of the inverse.
        assert_eq!(x[0].to_f64(), 100.0);
        assert_eq!(x[1].to_f64(), -4950.0);
        assert_eq!(x[9].to_f64(), -923_780.0);
    }

    #[test]
    fn quotient_times_divisor_gives_the_dividend_but_for_the_last_bits_of_two_digits() {
        // A quotient, a product and a difference, of at most 16 u^2 each, u = eps/2.
        const LAST: f64 = 12.0 * f64::EPSILON * f64::EPSILON;
        for n in 1..300 {
            let a = Twofold::from(f64::from(n)) / 7.0.into();
            for b in [Twofold::FRAC_1_SQRT_PI, Twofold::from(f64::from(n)) / 11.0.into() - Twofold::FRAC_1_SQRT_PI] {
                let off = (a / b * b - a).to_f64();
                assert!(off.abs() <= LAST * a.to_f64(), "{n}: {:e}", off / a.to_f64());
            }
        }
    }

    #[test]
    fn difference_of_neighbors_keeps_the_digits_of_what_they_differ_by() {
        let one = Twofold::from(1.0);
        for (x, y) in [(1e-17 / 3.0, 1e-20 / 7.0), (-1e-18 / 7.0, 1e-25 / 3.0)] {
            let expected = Twofold::sum(x, -y);
            assert!(expected.low != 0.0);
            assert_eq!((one + x.into()) - (one + y.into()), expected);
        }
    }

    #[test]
    fn zero_pivot_has_no_solution() {
        let one = |x: f64| Twofold::from(x);
        assert_eq!(solve(vec![vec![one(1.0), one(1.0), one(0.0)], vec![one(1.0), one(1.0), one(1.0)]]), None);
    }
}
