//! Cells that turn in themselves, are carried by a wind, and decay, in any number of dimensions.

use std::f64::consts::TAU;

/// The diffusivity nu.
pub const DIFFUSIVITY: f64 = 0.01;

/// The wind, and the greatest speed within a cell.
const WIND: [f64; 3] = [0.8, 0.5, 0.3];
const TURNING: f64 = 0.4;

/// The velocity: the wind, and with it cells that turn in the first two axes along the lines of constant u.
pub fn velocity<const D: usize>(x: &[f64; D], t: f64) -> [f64; D] {
    let phase = phase(x, t);
    let ((sa, ca), (sb, cb)) = (phase[0].sin_cos(), phase[1].sin_cos());
    std::array::from_fn(|axis| WIND[axis] + TURNING * [sa * cb, -ca * sb, 0.0][axis])
}

/// The field: u = 1 + exp(-4 pi^2 D nu t) prod_i sin(2 pi (x_i - c_i t)).
///
/// v . grad u is that of the wind alone, so that only wind and diffusion change u.
pub fn exact<const D: usize>(x: &[f64; D], t: f64) -> f64 {
    let product: f64 = phase(x, t).iter().map(|phase| phase.sin()).product();
    1.0 + (-TAU * TAU * D as f64 * DIFFUSIVITY * t).exp() * product
}

fn phase<const D: usize>(x: &[f64; D], t: f64) -> [f64; D] {
    std::array::from_fn(|axis| TAU * (x[axis] - WIND[axis] * t))
}
