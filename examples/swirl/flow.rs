//! A vortex that winds up a blob until half of the time has passed, and unwinds it again.

use std::f64::consts::{PI, TAU};

/// The time after which every particle is back.
pub const PERIOD: f64 = 1.0;

/// The greatest speed at any time.
pub const FASTEST: f64 = 1.0;

/// The velocity, of period 1 in x and y: (sin^2(pi x) sin(2 pi y), -sin^2(pi y) sin(2 pi x)) cos(pi t/T).
pub fn velocity(x: &[f64; 2], t: f64) -> [f64; 2] {
    let strength = (PI * t / PERIOD).cos();
    let [(a, b), (c, d)] = x.map(|x| ((PI * x).sin().powi(2), (TAU * x).sin()));
    [a * d * strength, -c * b * strength]
}

/// The blob at t = 0 and t = T, smooth and of period 1; close to a Gaussian of deviation 0.09.
pub fn start(x: &[f64; 2]) -> f64 {
    const WIDTH: f64 = 0.09 * TAU;
    let bell = |x: f64, middle: f64| ((TAU * (x - middle)).cos() - 1.0) / (WIDTH * WIDTH);
    (bell(x[0], 0.5) + bell(x[1], 0.75)).exp()
}

/// The blob at any time up to T: what was at the start where the flow comes from, within 1e-9.
pub fn exact(x: &[f64; 2], t: f64) -> f64 {
    const STEPS: u32 = 64;
    let dt = -t.min(PERIOD - t) / f64::from(STEPS);
    // The flow takes the same way back after T/2.
    let (mut x, mut t) = (*x, t.min(PERIOD - t));
    let ahead = |x: &[f64; 2], v: &[f64; 2], dt: f64| [x[0] + dt * v[0], x[1] + dt * v[1]];
    for _ in 0..STEPS {
        let a = velocity(&x, t);
        let b = velocity(&ahead(&x, &a, 0.5 * dt), t + 0.5 * dt);
        let c = velocity(&ahead(&x, &b, 0.5 * dt), t + 0.5 * dt);
        let d = velocity(&ahead(&x, &c, dt), t + dt);
        x = std::array::from_fn(|i| x[i] + dt / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        t += dt;
    }
    start(&x)
}
