//! Diffusion tensors: which are legal, and how a symmetric one is packed.

use crate::error::{ParticleError, Result};

/// By how much, in units of the largest entry, a tensor may miss symmetry, and its smallest eigenvalue zero: a product
/// R diag(d) R^T misses both by some roundings an entry.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The entries D_ii, and D_ij + D_ji for i < j, row by row of the upper triangle, of a symmetric tensor without negative
/// eigenvalue.
///
/// # Errors
/// [`ParticleError::TensorEntry`], [`ParticleError::Asymmetric`] and [`ParticleError::Indefinite`] otherwise.
pub(super) fn pack<const D: usize, const K: usize>(tensor: &[[f64; D]; D]) -> Result<[f64; K]> {
    let entries = tensor
        .iter()
        .enumerate()
        .flat_map(|(row, entries)| entries.iter().enumerate().map(move |(column, &entry)| (row, column, entry)));
    if let Some((row, column, entry)) = entries.clone().find(|(_, _, entry)| !entry.is_finite()) {
        return Err(ParticleError::TensorEntry { row, column, entry }.into());
    }
    let size = entries.clone().fold(0.0, |size: f64, (_, _, entry)| size.max(entry.abs()));
    for (row, column, upper) in entries.filter(|&(row, column, _)| row < column) {
        let lower = tensor[column][row];
        // Half of each, as their difference may overflow.
        if !((0.5 * upper - 0.5 * lower).abs() <= 0.5 * ROUNDING * size) {
            return Err(ParticleError::Asymmetric { row, column, upper, lower }.into());
        }
    }
    if size > 0.0 {
        let scaled = tensor.map(|row| row.map(|entry| entry / size));
        let (smallest, largest) = extreme_eigenvalues(scaled);
        if !(smallest >= -ROUNDING) {
            return Err(ParticleError::Indefinite { smallest: smallest * size, largest: largest * size }.into());
        }
    }
    let mut packed = [0.0; K];
    let pairs = (0..D).flat_map(|i| (i..D).map(move |j| (i, j)));
    for (packed, (i, j)) in packed.iter_mut().zip(pairs) {
        *packed = if i == j { tensor[i][i] } else { tensor[i][j] + tensor[j][i] };
    }
    Ok(packed)
}

/// The smallest and the largest eigenvalue of a symmetric matrix of entries up to 1, by Jacobi's rotations.
fn extreme_eigenvalues<const D: usize>(mut a: [[f64; D]; D]) -> (f64, f64) {
    // Convergence is quadratic; for D <= 6 eight sweeps leave nothing.
    for _ in 0..8 {
        for i in 0..D {
            for j in i + 1..D {
                rotate(&mut a, i, j);
            }
        }
    }
    (0..D).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), i| (low.min(a[i][i]), high.max(a[i][i])))
}

/// The rotation of the axes i and j that makes a_ij vanish.
fn rotate<const D: usize>(a: &mut [[f64; D]; D], i: usize, j: usize) {
    let off = 0.5 * (a[i][j] + a[j][i]);
    if off == 0.0 {
        return;
    }
    let theta = (a[j][j] - a[i][i]) / (2.0 * off);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for row in a.iter_mut() {
        (row[i], row[j]) = (cosine * row[i] - sine * row[j], sine * row[i] + cosine * row[j]);
    }
    let (upper, lower) = a.split_at_mut(j);
    for (x, y) in upper[i].iter_mut().zip(&mut lower[0]) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::extreme_eigenvalues;

    #[test]
    fn eigenvalues_are_those_of_known_matrices() {
        let path = [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let (low, high) = extreme_eigenvalues(path);
        let root = 2.0_f64.sqrt();
        assert!((low + root).abs() < 1e-15 && (high - root).abs() < 1e-15, "{low} {high}");
        assert_eq!(extreme_eigenvalues([[0.25]]), (0.25, 0.25));
        let ones = [[1.0; 6]; 6];
        let (low, high) = extreme_eigenvalues(ones);
        assert!(low.abs() < 1e-15 && (high - 6.0).abs() < 1e-14, "{low} {high}");
    }
}
