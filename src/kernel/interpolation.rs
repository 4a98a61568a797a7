//! The polynomial pieces of Lambda_{P,R}, solved exactly.
//!
//! On j <= s <= j + 1 the kernel is a polynomial of degree 2R + 1 in t = s - j, fixed by its derivatives 0 to R at both
//! ends. Differentiating sum_k k^a Lambda(x - k) = x^a m times at x = 0 shows that Lambda^(m)(j) are the weights of the
//! central difference of P + 1 points for the m-th derivative. So Lambda^(m)(j)/m! is the coefficient of x^m in the
//! Lagrange polynomial of node -j among -P/2..=P/2, and 0 beyond them.

use super::rational::Rational;

/// The pieces j = 0..=P/2, each as the coefficients of t^0 to t^(2R+1); `None` where one does not fit.
pub(super) fn pieces(p: usize, r: usize) -> Option<Vec<Vec<Rational>>> {
    let half = i128::try_from(p / 2).ok()?;
    let nodes: Vec<Vec<Rational>> = (0..=half).map(|j| taylor(j, half, r)).collect::<Option<_>>()?;
    let zero = vec![Rational::ZERO; r + 1];
    let ends = nodes.iter().skip(1).chain([&zero]);
    nodes.iter().zip(ends).map(|(left, right)| hermite(left, right)).collect()
}

/// Lambda^(m)(j)/m! for m = 0..=r: prod_(i != -j) (x - i)/(-j - i), |i| <= half, modulo x^(r+1).
fn taylor(j: i128, half: i128, r: usize) -> Option<Vec<Rational>> {
    let mut product = vec![Rational::ZERO; r + 1];
    *product.first_mut()? = Rational::ONE;
    for i in (-half..=half).filter(|&i| i != -j) {
        let (slope, constant) = (Rational::new(1, -j - i)?, Rational::new(-i, -j - i)?);
        for m in (0..=r).rev() {
            let below = if m > 0 { product[m - 1].checked_mul(slope)? } else { Rational::ZERO };
            product[m] = product[m].checked_mul(constant)?.checked_add(below)?;
        }
    }
    Some(product)
}

/// The polynomial of degree 2R + 1 on [0, 1] with the Taylor coefficients a_m at 0 and b_m at 1, m = 0..=R:
/// sum_m a_m A_m(t) + (-1)^m b_m A_m(1 - t), A_m(t) = (1 - t)^(R+1) sum_(i <= R-m) C(R+i, i) t^(m+i).
fn hermite(a: &[Rational], b: &[Rational]) -> Option<Vec<Rational>> {
    let r = a.len() - 1;
    let mut sum = vec![Rational::ZERO; 2 * r + 2];
    // Of t^0 to t^R only a_m is left; the others come from both ends.
    for (m, (&a, &b)) in a.iter().zip(b).enumerate() {
        let b = if m % 2 == 0 { b } else { Rational::ZERO.checked_add(Rational::integer(-1).checked_mul(b)?)? };
        let mut factor = Rational::ONE;
        for i in 0..=r - m {
            // a C(R+i,i) t^(m+i) (1-t)^(R+1) and b C(R+i,i) (1-t)^(m+i) t^(R+1)
            spread(&mut sum, a.checked_mul(factor)?, m + i, r + 1)?;
            spread(&mut sum, b.checked_mul(factor)?, r + 1, m + i)?;
            let step = Rational::new(i128::try_from(r + i + 1).ok()?, i128::try_from(i + 1).ok()?)?;
            factor = factor.checked_mul(step)?;
        }
    }
    Some(sum)
}

/// Adds factor t^power (1 - t)^n.
fn spread(sum: &mut [Rational], factor: Rational, power: usize, n: usize) -> Option<()> {
    let mut term = factor;
    for k in 0..=n {
        let entry = sum.get_mut(power + k)?;
        *entry = entry.checked_add(term)?;
        // C(n, k+1) = C(n, k) (n - k)/(k + 1)
        term = term.checked_mul(Rational::new(-i128::try_from(n - k).ok()?, i128::try_from(k + 1).ok()?)?)?;
    }
    Some(())
}

/// The same polynomial in powers of t - 1/2.
pub(super) fn centered(coefficients: &[Rational]) -> Option<Vec<Rational>> {
    let half = Rational::new(1, 2)?;
    let mut shifted = coefficients.to_vec();
    for i in 0..shifted.len() {
        for k in (i..shifted.len() - 1).rev() {
            shifted[k] = shifted[k].checked_add(half.checked_mul(shifted[k + 1])?)?;
        }
    }
    Some(shifted)
}
