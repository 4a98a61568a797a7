//! Cells that turn in themselves, are carried by a wind, and decay.

use std::f64::consts::TAU;

/// D.
pub const DIFFUSIVITY: f64 = 0.01;

/// The wind, and the greatest speed within a cell.
const WIND: [f64; 2] = [0.8, 0.5];
const TURNING: f64 = 0.4;

/// The velocity: the wind, and with it the cells (sin(2 pi y'), ..) whose stream function is the field itself.
pub fn velocity(x: &[f64; 2], t: f64) -> [f64; 2] {
    let [a, b] = phase(x, t);
    [WIND[0] + TURNING * a.sin() * b.cos(), WIND[1] - TURNING * a.cos() * b.sin()]
}

/// The field: u = 1 + exp(-8 pi^2 D t) sin(2 pi (x - c_1 t)) sin(2 pi (y - c_2 t)).
///
/// It is constant along the lines on which the cells turn, so that only wind and diffusion change it.
pub fn exact(x: &[f64; 2], t: f64) -> f64 {
    let [a, b] = phase(x, t);
    1.0 + (-2.0 * TAU * TAU * DIFFUSIVITY * t).exp() * a.sin() * b.sin()
}

fn phase(x: &[f64; 2], t: f64) -> [f64; 2] {
    std::array::from_fn(|i| TAU * (x[i] - WIND[i] * t))
}
