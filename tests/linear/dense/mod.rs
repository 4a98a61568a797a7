//! Small operators as dense matrices, and their eigenvalues.

use nalgebra::{Complex, DMatrix, Schur};
use parops::Result;

/// The matrix of a linear map on vectors of length n.
pub fn matrix(n: usize, mut apply: impl FnMut(&[f64], &mut [f64]) -> Result<()>) -> DMatrix<f64> {
    let (mut a, mut unit) = (DMatrix::zeros(n, n), vec![0.0; n]);
    for (q, mut column) in a.column_iter_mut().enumerate() {
        unit[q] = 1.0;
        apply(&unit, column.as_mut_slice()).expect("a legal field");
        unit[q] = 0.0;
    }
    a
}

/// All eigenvalues. The shift keeps diagonal entries from zero, beside which nalgebra never takes an entry for zero.
pub fn eigenvalues(a: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let scale = a.norm();
    let mut shifted: DMatrix<f64> = a / scale;
    (0..a.nrows()).for_each(|i| shifted[(i, i)] += 2.0);
    let schur = |eps: f64| Schur::try_new(shifted.clone(), eps * f64::EPSILON, 30 * a.nrows());
    let schur = [1.0, 8.0, 64.0].into_iter().find_map(schur).expect("eigenvalues");
    schur.complex_eigenvalues().iter().map(|z| (z - Complex::new(2.0, 0.0)) * Complex::new(scale, 0.0)).collect()
}

/// max Re and max | |.
#[allow(dead_code)]
pub fn extremes(a: &DMatrix<f64>) -> (f64, f64) {
    let values = eigenvalues(a);
    let right = values.iter().fold(f64::NEG_INFINITY, |right, z| right.max(z.re));
    (right, values.iter().fold(0.0, |outer, z| outer.max(z.norm())))
}

/// The largest modulus of sum_k (dt lambda)^k / k!, k up to `stages`: Euler's step for 1, RK4 for 4.
#[allow(dead_code)]
pub fn amplification(values: &[Complex<f64>], dt: f64, stages: u32) -> f64 {
    let factor = |z: &Complex<f64>| {
        let (mut sum, mut term) = (Complex::new(1.0, 0.0), Complex::new(1.0, 0.0));
        for k in 1..=stages {
            term *= z * Complex::new(dt / f64::from(k), 0.0);
            sum += term;
        }
        sum.norm()
    };
    values.iter().map(factor).fold(0.0, f64::max)
}
