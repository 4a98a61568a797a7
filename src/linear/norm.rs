//! Inner products and norms of vectors of any scale.

/// The inner product, in four sums so that they run side by side.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest = a_rest.iter().zip(b_rest).fold(0.0, |sum, (a, b)| sum + a * b);
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// A sum of squares above which none that counts is subnormal.
const LEAST_SQUARE: f64 = 1e-250;

/// The Euclidean norm, of vectors of any scale: b is scaled, A need not be.
pub(super) fn norm(x: &[f64]) -> f64 {
    let square = dot(x, x);
    if square > LEAST_SQUARE && square.is_finite() {
        return square.sqrt();
    }
    let scale = inverse_power(x.iter().fold(0.0, |largest, x| x.abs().max(largest)));
    x.iter().fold(0.0, |sum, x| sum + (x * scale) * (x * scale)).sqrt() / scale
}

/// The power of two that brings a positive number into [1, 2), as far as normal numbers reach.
pub(super) fn inverse_power(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) as i64 - 1023).clamp(-1000, 1000);
    f64::from_bits(((1023 - exponent) as u64) << 52)
}

/// |a|_2 / |b|_2 for vectors of any scale.
pub(super) fn ratio(a: &[f64], b: &[f64]) -> f64 {
    let largest = |x: &[f64]| x.iter().fold(f64::MIN_POSITIVE, |largest, x| largest.max(x.abs()));
    let scale = inverse_power(largest(a).max(largest(b)));
    let norm = |x: &[f64]| x.iter().fold(0.0, |sum, x| sum + (x * scale) * (x * scale)).sqrt();
    norm(a) / norm(b)
}
