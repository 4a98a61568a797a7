//! DC-PSE as one writes it down first: normal equations, no check of rank, condition or residual.

use nalgebra::{DMatrix, DVector};

/// A row of a derivative in two dimensions.
pub struct Naive {
    pub weights: Vec<f64>,
    /// Condition number of the windowed monomials, by their singular values.
    pub condition: f64,
    /// The largest miss of a moment condition, in units of epsilon.
    pub miss: f64,
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

/// The row of D^beta at a particle whose neighbors are at these separations x_p - x_q, scaled by epsilon.
pub fn row(separations: &[[f64; 2]], beta: [u32; 2], order: u32, epsilon: f64) -> Naive {
    let conditions = conditions(beta, order);
    let power = |z: &[f64; 2], alpha: &[u32; 2]| z[0].powi(alpha[0] as i32) * z[1].powi(alpha[1] as i32);
    let z: Vec<[f64; 2]> = separations.iter().map(|s| s.map(|s| s / epsilon)).collect();
    let reach = z.iter().map(|z| z[0].hypot(z[1])).fold(0.0, f64::max);
    // The window falls to exp(-4.84) at the farthest neighbor, as that of the library does.
    let root: Vec<f64> =
        z.iter().map(|z| (-0.5 * 4.84 * (z[0] * z[0] + z[1] * z[1]) / (reach * reach)).exp()).collect();
    let windowed = DMatrix::from_fn(z.len(), conditions.len(), |q, i| root[q] * power(&z[q], &conditions[i]));
    let required = |alpha: &[u32; 2]| {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let sign = if (beta[0] + beta[1]).is_multiple_of(2) { 1.0 } else { -1.0 };
        if *alpha == beta { sign * factorial(beta[0]) * factorial(beta[1]) } else { 0.0 }
    };
    let b = DVector::from_iterator(conditions.len(), conditions.iter().map(required));
    let normal = windowed.transpose() * &windowed;
    let coefficients = normal.lu().solve(&b).unwrap_or_else(|| DVector::zeros(conditions.len()));
    let scaled: Vec<f64> = (&windowed * coefficients).iter().zip(&root).map(|(w, root)| w * root).collect();
    let moment = |alpha: &[u32; 2]| z.iter().zip(&scaled).map(|(z, w)| w * power(z, alpha)).sum::<f64>();
    let miss = conditions.iter().map(|alpha| (moment(alpha) - required(alpha)).abs()).fold(0.0, f64::max);
    let singular = windowed.singular_values();
    let degree = (beta[0] + beta[1]) as i32;
    Naive {
        weights: scaled.iter().map(|w| w / epsilon.powi(degree)).collect(),
        condition: singular.max() / singular.min(),
        miss,
    }
}

/// The largest miss of a moment of degree k, over h^(k - m), by least squares on raw monomials that drop singular values
/// below rounding of the largest.
pub fn least_squares(separations: &[[f64; 2]], beta: [u32; 2], order: u32, h: f64) -> f64 {
    let conditions = conditions(beta, order);
    let power = |s: &[f64; 2], alpha: &[u32; 2]| s[0].powi(alpha[0] as i32) * s[1].powi(alpha[1] as i32);
    let moments = DMatrix::from_fn(conditions.len(), separations.len(), |i, q| power(&separations[q], &conditions[i]));
    let b =
        DVector::from_iterator(conditions.len(), conditions.iter().map(|alpha| if *alpha == beta { 2.0 } else { 0.0 }));
    let cut = f64::EPSILON * separations.len() as f64 * moments.singular_values().max();
    let weights = moments.clone().svd(true, true).solve(&b, cut).unwrap_or_else(|_| DVector::zeros(separations.len()));
    let degree = (beta[0] + beta[1]) as i32;
    (moments * weights - b)
        .iter()
        .zip(&conditions)
        .map(|(miss, alpha)| miss.abs() * h.powi(degree - (alpha[0] + alpha[1]) as i32))
        .fold(0.0, f64::max)
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
