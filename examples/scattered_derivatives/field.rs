//! The field: two plane waves, f = sum_j sin(k_j . x + phi_j), whose derivatives of any multi-index are waves again.

use parops::{MultiIndex, Operator};

/// |k| = 8, a little more than a wavelength in the box: the leading error is the same everywhere but for its phase.
const LENGTH: f64 = 8.0;
/// Directions of the waves and their phases; no component vanishes and none is equal to another.
const WAVES: [([f64; 3], f64); 2] = [([2.0, 3.0, 1.5], 0.3), ([-3.0, 1.2, 2.2], 1.1)];

/// D^beta f = sum_j k_j^beta sin(k_j . x + phi_j + |beta| pi/2).
pub fn derivative<const D: usize>(beta: MultiIndex<D>, x: &[f64; D]) -> f64 {
    let wave = |(direction, phase): &([f64; 3], f64)| {
        let norm = direction[..D].iter().map(|k| k * k).sum::<f64>().sqrt();
        let k: [f64; D] = std::array::from_fn(|axis| LENGTH * direction[axis] / norm);
        let along: f64 = k.iter().zip(x).map(|(k, x)| k * x).sum();
        beta.power(&k) * (along + phase + f64::from(beta.degree()) * std::f64::consts::FRAC_PI_2).sin()
    };
    WAVES.iter().map(wave).sum()
}

/// All outputs of an operator at x.
pub fn exact<const D: usize, const K: usize>(operator: &impl Operator<D, Out = [f64; K]>, x: &[f64; D]) -> [f64; K] {
    let mut values = [0.0; K];
    operator.terms(&mut |output, index, factor| values[output] += factor * derivative(index, x));
    values
}
