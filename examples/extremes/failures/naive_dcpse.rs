//! DC-PSE as one writes it down first: normal equations, every pivot taken, no check of rank, condition or residual.

use nalgebra::{DMatrix, DVector};

/// A row of a derivative in two dimensions.
pub struct Naive {
    pub weights: Vec<f64>,
    /// Condition number of the windowed monomials, by their singular values.
    pub condition: f64,
    /// The largest miss of a moment condition, in units of epsilon; NaN where a weight is.
    pub miss: f64,
    /// The least pivot over the largest.
    pub pivot: f64,
}

impl Naive {
    /// sum |w| in units of `length`: the gain of noise.
    pub fn gain(&self, length: f64, degree: u32) -> f64 {
        self.weights.iter().map(|w| w.abs()).sum::<f64>() * length.powi(degree as i32)
    }

    /// sum_q w_q f(x_q - x_p), where f(0) = 0.
    pub fn apply(&self, separations: &[[f64; 2]], f: impl Fn(&[f64; 2]) -> f64) -> f64 {
        separations.iter().zip(&self.weights).map(|(s, w)| w * f(&[-s[0], -s[1]])).sum()
    }
}

/// All multi-indices with 0 < |alpha| < degree + order.
pub fn conditions(beta: [u32; 2], order: u32) -> Vec<[u32; 2]> {
    let high = beta[0] + beta[1] + order;
    (1..high).flat_map(|degree| (0..=degree).map(move |second| [degree - second, second])).collect()
}

/// x of A x = b, and the least pivot over the largest: elimination with row exchanges that takes pivots as they are. One
/// that is exactly zero is divided by.
fn eliminate(mut a: DMatrix<f64>, mut b: DVector<f64>) -> (DVector<f64>, f64) {
    let n = b.len();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for k in 0..n {
        let steepest = (k..n).max_by(|&i, &j| a[(i, k)].abs().total_cmp(&a[(j, k)].abs())).unwrap_or(k);
        a.swap_rows(k, steepest);
        b.swap_rows(k, steepest);
        let pivot = a[(k, k)];
        (least, most) = (least.min(pivot.abs()), most.max(pivot.abs()));
        for i in k + 1..n {
            let factor = a[(i, k)] / pivot;
            for j in k..n {
                a[(i, j)] -= factor * a[(k, j)];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[(k, j)] * b[j]).sum();
        b[k] = (b[k] - known) / a[(k, k)];
    }
    (b, least / most)
}

fn power(z: &[f64; 2], alpha: &[u32; 2]) -> f64 {
    z[0].powi(alpha[0] as i32) * z[1].powi(alpha[1] as i32)
}

/// (-1)^|beta| beta! where alpha is beta, and 0 elsewhere.
fn required(alpha: &[u32; 2], beta: [u32; 2]) -> f64 {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    let sign = if (beta[0] + beta[1]).is_multiple_of(2) { 1.0 } else { -1.0 };
    if *alpha == beta { sign * factorial(beta[0]) * factorial(beta[1]) } else { 0.0 }
}

/// The windowed monomials of the conditions, the square roots of the window, and the moments required, for places z.
fn windowed(z: &[[f64; 2]], beta: [u32; 2], order: u32) -> (DMatrix<f64>, Vec<f64>, DVector<f64>) {
    let conditions = conditions(beta, order);
    let reach = z.iter().map(|z| z[0].hypot(z[1])).fold(0.0, f64::max);
    // The window falls to exp(-4.84) at the farthest neighbor, as that of the library does.
    let root: Vec<f64> =
        z.iter().map(|z| (-0.5 * 4.84 * (z[0] * z[0] + z[1] * z[1]) / (reach * reach)).exp()).collect();
    let monomials = DMatrix::from_fn(z.len(), conditions.len(), |q, i| root[q] * power(&z[q], &conditions[i]));
    let b = DVector::from_iterator(conditions.len(), conditions.iter().map(|alpha| required(alpha, beta)));
    (monomials, root, b)
}

fn scaled(separations: &[[f64; 2]], epsilon: f64) -> Vec<[f64; 2]> {
    separations.iter().map(|s| s.map(|s| s / epsilon)).collect()
}

/// The largest of some magnitudes; NaN if one is.
fn largest(magnitudes: impl Iterator<Item = f64>) -> f64 {
    magnitudes.fold(0.0, |most: f64, x| if x.is_nan() || x > most { x } else { most })
}

/// The row of D^beta at a particle whose neighbors are at these separations x_p - x_q, scaled by epsilon.
pub fn row(separations: &[[f64; 2]], beta: [u32; 2], order: u32, epsilon: f64) -> Naive {
    let z = scaled(separations, epsilon);
    let (monomials, root, b) = windowed(&z, beta, order);
    let (coefficients, pivot) = eliminate(monomials.transpose() * &monomials, b.clone());
    let weights: Vec<f64> = (&monomials * coefficients).iter().zip(&root).map(|(w, root)| w * root).collect();
    let moment = |alpha: &[u32; 2]| z.iter().zip(&weights).map(|(z, w)| w * power(z, alpha)).sum::<f64>();
    let miss = largest(conditions(beta, order).iter().zip(b.iter()).map(|(alpha, b)| (moment(alpha) - b).abs()));
    let singular = monomials.singular_values();
    let degree = (beta[0] + beta[1]) as i32;
    Naive {
        weights: weights.iter().map(|w| w / epsilon.powi(degree)).collect(),
        condition: singular.max() / singular.min(),
        miss,
        pivot,
    }
}

/// Whether LU and Cholesky of a library refuse the normal equations of a row.
pub fn refused(separations: &[[f64; 2]], beta: [u32; 2], order: u32, epsilon: f64) -> [bool; 2] {
    let (monomials, _, b) = windowed(&scaled(separations, epsilon), beta, order);
    let normal = monomials.transpose() * &monomials;
    [normal.clone().lu().solve(&b).is_none(), normal.cholesky().is_none()]
}

/// The row of D^beta on as many places, the particle's own among them, as there are conditions with that of constants:
/// the moment conditions solved as they stand.
pub fn interpolating(separations: &[[f64; 2]], beta: [u32; 2], order: u32, epsilon: f64) -> Naive {
    let z = scaled(separations, epsilon);
    let conditions: Vec<[u32; 2]> = [[0, 0]].into_iter().chain(conditions(beta, order)).collect();
    let moments = DMatrix::from_fn(conditions.len(), z.len(), |i, q| power(&z[q], &conditions[i]));
    let b = DVector::from_iterator(conditions.len(), conditions.iter().map(|alpha| required(alpha, beta)));
    let (weights, pivot) = eliminate(moments.clone(), b.clone());
    let singular = moments.singular_values();
    let degree = (beta[0] + beta[1]) as i32;
    Naive {
        miss: largest((&moments * &weights - b).iter().map(|miss| miss.abs())),
        weights: weights.iter().map(|w| w / epsilon.powi(degree)).collect(),
        condition: singular.max() / singular.min(),
        pivot,
    }
}

/// The largest miss of a moment of degree k, over h^(k - m), by least squares on raw monomials that drop singular values
/// below rounding of the largest.
pub fn least_squares(separations: &[[f64; 2]], beta: [u32; 2], order: u32, h: f64) -> Result<f64, &'static str> {
    let conditions = conditions(beta, order);
    let moments = DMatrix::from_fn(conditions.len(), separations.len(), |i, q| power(&separations[q], &conditions[i]));
    let b = DVector::from_iterator(conditions.len(), conditions.iter().map(|alpha| required(alpha, beta)));
    let cut = f64::EPSILON * separations.len() as f64 * moments.singular_values().max();
    let weights = moments.clone().svd(true, true).solve(&b, cut)?;
    let degree = (beta[0] + beta[1]) as i32;
    let missed = |(miss, alpha): (&f64, &[u32; 2])| miss.abs() * h.powi(degree - (alpha[0] + alpha[1]) as i32);
    Ok(largest((moments * weights - b).iter().zip(&conditions).map(missed)))
}

/// The k nearest of a point, ties in the order of the numbers: as a sort and a cut leave them.
pub fn cut(
    points: &[[f64; 2]],
    p: usize,
    k: usize,
    difference: impl Fn(&[f64; 2], &[f64; 2]) -> [f64; 2],
) -> Vec<(usize, [f64; 2])> {
    let mut others: Vec<(usize, [f64; 2])> =
        (0..points.len()).filter(|&q| q != p).map(|q| (q, difference(&points[p], &points[q]))).collect();
    let square = |s: &[f64; 2]| s[0] * s[0] + s[1] * s[1];
    others.sort_by(|a, b| square(&a.1).total_cmp(&square(&b.1)));
    others.truncate(k);
    others
}

/// x - y, and the shortest of its images on the unit torus.
pub fn plain(x: &[f64; 2], y: &[f64; 2]) -> [f64; 2] {
    [x[0] - y[0], x[1] - y[1]]
}

pub fn wrapped(x: &[f64; 2], y: &[f64; 2]) -> [f64; 2] {
    plain(x, y).map(|s| s - s.round())
}
