//! How far left of an eigenvalue a small change of its matrix may move it.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Steps of inverse iteration: the estimate is from above, and within a fifth where singular values stand apart.
const STEPS: usize = 3;

/// The largest d such that z = lambda - d is still an eigenvalue of [T; w^T] + E for some |E| <= change, as all between are;
/// lambda is entry i of the diagonal of the triangle T, of norm 1 at most, and w what of A V = V T + v w^T lies outside of
/// V. To a factor 2, and at least 2 change.
///
/// A chain of k equal eigenvalues gives change^(1/k), and a simple one its condition times change: the pseudospectrum knows
/// no difference.
///
/// Source: L. N. Trefethen and M. Embree, Spectra and Pseudospectra, 2005, section 2 (smallest singular value) and 40 (the
/// row below).
pub(super) fn reach(triangle: &DMatrix<C>, below: &[C], i: usize, change: f64) -> f64 {
    let mut left = 2.0 * change;
    while left < 1.0 && !(smallest(triangle, below, triangle[(i, i)] - left, change) > change) {
        left *= 2.0;
    }
    left.min(1.0)
}

/// The smallest singular value of [T - z; w^T]; NaN where it is too small for numbers.
fn smallest(triangle: &DMatrix<C>, below: &[C], z: C, change: f64) -> f64 {
    let size = triangle.nrows();
    let mut r = triangle.clone();
    (0..size).for_each(|i| r[(i, i)] -= z);
    let mut below = below.to_vec();
    for i in 0..below.len() {
        fold(&mut r, &mut below, i);
    }
    // A zero would stop the substitution.
    let least = f64::EPSILON * change;
    for i in 0..size {
        let pivot = &mut r[(i, i)];
        if pivot.norm_sqr() < least * least {
            *pivot = C::new(least, 0.0);
        }
    }
    let mut x = vec![C::new(1.0, 0.0); size];
    let mut value = 0.0;
    for _ in 0..STEPS {
        let unit = 1.0 / length(&x);
        x.iter_mut().for_each(|x| *x *= unit);
        // R* y = x, then R x = y.
        for j in 0..size {
            let column = &r.as_slice()[j * size..][..=j];
            let sum = column[..j].iter().zip(&x).fold(x[j], |sum, (r, x)| sum - r.conj() * x);
            x[j] = sum / column[j].conj();
        }
        value = 1.0 / length(&x);
        x.iter_mut().for_each(|x| *x *= value);
        for j in (0..size).rev() {
            let column = &r.as_slice()[j * size..][..=j];
            x[j] /= column[j];
            let last = x[j];
            x.iter_mut().zip(&column[..j]).for_each(|(x, r)| *x -= r * last);
        }
    }
    value
}

fn length(x: &[C]) -> f64 {
    x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt()
}

/// Turns row i of a triangle and the row below it such that entry i of the latter is 0.
fn fold(r: &mut DMatrix<C>, below: &mut [C], i: usize) {
    let (p, q) = (r[(i, i)], below[i]);
    let hypotenuse = (p.norm_sqr() + q.norm_sqr()).sqrt();
    if hypotenuse == 0.0 {
        return;
    }
    let (p, q) = (p / hypotenuse, q / hypotenuse);
    for j in i..below.len() {
        let (x, y) = (r[(i, j)], below[j]);
        r[(i, j)] = p.conj() * x + q.conj() * y;
        below[j] = p * y - q * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::Random;

    /// A triangle of random entries with a diagonal of -i/size, and a row below.
    fn random(size: usize, seed: u64) -> (DMatrix<C>, Vec<C>) {
        let mut random = Random::new(seed);
        let mut entry = || C::new(random.uniform() - 0.5, random.uniform() - 0.5) / size as f64;
        let t = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => entry(),
            std::cmp::Ordering::Equal => C::new(-(i as f64) / size as f64, 0.0),
            std::cmp::Ordering::Greater => C::new(0.0, 0.0),
        });
        (t, (0..size).map(|_| entry() * 1e-3).collect())
    }

    #[test]
    fn smallest_singular_value_is_that_of_a_full_decomposition() {
        for seed in 0..40 {
            let size = 3 + seed as usize % 20;
            let (t, below) = random(size, seed);
            for (z, below) in [(-0.01, &below[..]), (-0.2, &below), (-0.01, &[]), (1e-9, &[])] {
                let whole = DMatrix::from_fn(size + 1, size, |i, j| match () {
                    () if i == size => below.get(j).copied().unwrap_or_default(),
                    () if i == j => t[(i, i)] - z,
                    () => t[(i, j)],
                });
                let exact = whole.singular_values().min();
                let found = smallest(&t, below, C::new(z, 0.0), 1e-14);
                assert!((1.0 - 1e-9..1.2).contains(&(found / exact)), "{seed} {z}: {found:e} for {exact:e}");
            }
        }
    }

    #[test]
    fn what_lies_outside_of_the_subspace_shortens_the_reach() {
        // [T - z; w^T] with w along the vector of a chain: |w| bounds the smallest singular value from below.
        let chain = DMatrix::from_fn(3, 3, |i, j| C::new(f64::from(u8::from(j == i + 1)), 0.0));
        let below = [C::new(1e-3, 0.0), C::new(0.0, 0.0), C::new(0.0, 0.0)];
        assert!(reach(&chain, &[], 0, 1e-6) > 1e-2);
        assert_eq!(reach(&chain, &below, 0, 1e-6), 2e-6);
        assert!(reach(&chain, &below, 0, 2e-3) > 0.1);
    }

    #[test]
    fn reach_is_the_root_of_the_change_for_a_chain_and_the_change_for_an_eigenvalue_alone() {
        for size in 2..7 {
            let chain = DMatrix::from_fn(size, size, |i, j| C::new(f64::from(u8::from(j == i + 1)), 0.0));
            let alone =
                DMatrix::from_fn(size, size, |i, j| C::new(if i == j { -(i as f64) / size as f64 } else { 0.0 }, 0.0));
            for change in [1e-14_f64, 1e-9] {
                let root = change.powf(1.0 / size as f64);
                let found = reach(&chain, &[], 0, change) / root;
                assert!((1.0..2.1).contains(&found), "{size} {change:e}: {found}");
                assert_eq!(reach(&alone, &[], 0, change), 2.0 * change);
            }
        }
    }
}
