//! The moment conditions of a polynomial times exp(-|z|^2), solved exactly.
//!
//! Split z^beta, |beta| = n, into |z|^2j h_(n-2j) with harmonic h. A harmonic of degree l, times any radial function,
//! only meets the moments |z|^2j H_l, and pi^(-D/2) Int h H |z|^2m exp(-|z|^2) = 2^-l <h, H> (l + D/2)_m, with <p, q> =
//! p(D) q and the rising factorial (a)_m = a (a+1) ... (a+m-1). So P = sum_l h_l(z) sum_k c_lk |z|^2k has
//!
//! sum_k c_lk 2^-l (l + D/2)_(j+k) = (-1)^n 4^j j! (l + D/2)_j where l + 2j = n, else 0, for 1 <= l + 2j <= n + r - 1
//!
//! to satisfy (from 0 for n = 0): for each l as many equations as coefficients. Their matrix is the moment matrix of
//! the weight s^(a-1) exp(-s), hence its inverse is a sum over Laguerre polynomials, which [`radial`] writes out.

use super::polynomial::ExactPolynomial;
use super::rational::Rational;

/// The harmonics of p, homogeneous of degree n: p = sum_j |z|^2j h_(n-2j), entry j holds h_(n-2j).
pub(super) fn harmonics<const D: usize>(p: ExactPolynomial<D>, n: u32) -> Option<Vec<ExactPolynomial<D>>> {
    let mut parts = Vec::new();
    // Laplacian^j p / (4^j j!)
    let mut image = p;
    for j in 0..=n / 2 {
        let l = n - 2 * j;
        let mut part = projection(image.clone(), l)?;
        for i in 0..j {
            part = part.checked_scale(Rational::ONE.checked_div(half(2 * (l + i), D)?)?)?;
        }
        parts.push(part);
        image = image.laplacian()?.checked_scale(Rational::new(1, 4 * (i128::from(j) + 1))?)?;
    }
    Some(parts)
}

/// The harmonic part of p, homogeneous of degree l:
/// sum_k (-1)^k |z|^2k Laplacian^k p / (4^k k! (a-1)(a-2)...(a-k)), a = l + D/2 - 1.
fn projection<const D: usize>(p: ExactPolynomial<D>, l: u32) -> Option<ExactPolynomial<D>> {
    let mut sum = p.clone();
    let mut image = p;
    for k in 1..=l / 2 {
        let factor = half(2 * (l - k - 1), D)?.checked_mul(Rational::integer(-4 * i128::from(k)))?;
        image = image.laplacian()?.checked_scale(Rational::ONE.checked_div(factor)?)?;
        let mut term = image.clone();
        for _ in 0..k {
            term = term.times_square()?;
        }
        sum = sum.checked_add(&term)?;
    }
    Some(sum)
}

/// The coefficients c_lk, k = 0, 1, ..., of the harmonic of degree l = n - 2j in D = `dim`, order r.
///
/// With a = l + D/2 and K conditions, c_lk = (-1)^(n+j+k) 2^n sum_(i=max(j,k))^(K-1) C(i,k) (a+k)_(i-k) / (i-j)!.
/// Where l = 0 < n the condition of degree 0 is absent: then a = D/2 + 1, one j less, and a factor j.
pub(super) fn radial(dim: usize, n: u32, j: u32, order: u32) -> Option<Vec<Rational>> {
    let free = n > 0 && n == 2 * j;
    let conditions = j + order / 2 - u32::from(free);
    let twice_a = 2 * (n - 2 * j) + 2 * u32::from(free);
    let (row, multiple) = if free { (j - 1, j) } else { (j, 1) };
    let power = Rational::integer(2_i128.checked_pow(n)?.checked_mul(multiple.into())?);
    (0..conditions)
        .map(|k| {
            let mut sum = Rational::ZERO;
            for i in row.max(k)..conditions {
                let mut term = Rational::ONE;
                for step in 0..i - k {
                    // C(i,k) (a+k)_(i-k) = prod_(step) (k + step + 1) (a + k + step) / (step + 1)
                    let factor = Rational::new(i128::from(k + step) + 1, i128::from(step) + 1)?;
                    term = term.checked_mul(factor)?.checked_mul(half(twice_a + 2 * (k + step), dim)?)?;
                }
                for factor in 1..=i - row {
                    term = term.checked_mul(Rational::new(1, factor.into())?)?;
                }
                sum = sum.checked_add(term)?;
            }
            let sign = if (n + row + k).is_multiple_of(2) { 1 } else { -1 };
            sum.checked_mul(power)?.checked_mul(Rational::integer(sign))
        })
        .collect()
}

/// (twice + D)/2.
fn half(twice: u32, dim: usize) -> Option<Rational> {
    Rational::new(i128::from(twice) + i128::try_from(dim).ok()?, 2)
}
