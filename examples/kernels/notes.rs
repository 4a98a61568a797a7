//! Figures 1 and 2 of notes 000.

use std::f64::consts::PI;

use parops::{Gaussian, Kernel, LatticeHat};

use crate::claim::{Claims, KINKS, curve, integral};
use crate::figure::{Axes, Curve, Mark};

/// Spacing and smoothing length of Figure 1.
const H: f64 = PI / 8.0;
const EPSILON: f64 = H;

/// The function that is approximated.
fn f(x: f64) -> f64 {
    1.2 + x.sin()
}

/// f_epsilon^h(x) = sum_p f(x_p) V_p eta_epsilon(x - x_p), eq. 9, of the particles p.
fn smooth(x: f64, particles: impl Iterator<Item = i32>) -> f64 {
    let kernel = Gaussian::<1>::new();
    let share = |p: i32| {
        let place = (f64::from(p) + 0.5) * H;
        let eta: f64 = kernel.value(&[(x - place) / EPSILON]);
        f(place) * H * eta / EPSILON
    };
    particles.map(share).sum()
}

/// Figure 1: point particles on the left, smooth particles on the right.
pub fn particles(points: usize, claims: &mut Claims) -> Vec<(Axes<'static>, Vec<Curve>)> {
    // Particles beyond the picture whose kernels reach into it.
    const BEYOND: i32 = 9;
    let exact = || Curve { name: "f(x)".into(), points: curve(0.0, 2.0 * PI, points, f), mark: Mark::Dashed, color: 4 };
    let shown = 0..16;
    let mut left = vec![exact()];
    let mut right = vec![exact()];
    for p in shown.clone() {
        let place = (f64::from(p) + 0.5) * H;
        let name = if p == 0 { "f(x_p), 0 elsewhere" } else { "" };
        let stem = curve(0.0, f(place), 50, |_| place).into_iter().map(|(y, x)| (x, y)).collect();
        left.push(Curve { name: String::new(), points: stem, mark: Mark::Line, color: 7 });
        left.push(Curve { name: name.into(), points: vec![(place, f(place))], mark: Mark::CirclesAlone, color: 0 });
    }
    for p in shown {
        let place = (f64::from(p) + 0.5) * H;
        let (low, high) = ((place - 4.0 * EPSILON).max(0.0), (place + 4.0 * EPSILON).min(2.0 * PI));
        let name = if p == 0 { "f(x_p) V_p eta(x - x_p)" } else { "" };
        let points = curve(low, high, points / 4, |x| smooth(x, std::iter::once(p)));
        right.push(Curve { name: name.into(), points, mark: Mark::Line, color: 7 });
    }
    let all = |x| smooth(x, -BEYOND..16 + BEYOND);
    right.push(Curve {
        name: "their sum".into(),
        points: curve(0.0, 2.0 * PI, points, all),
        mark: Mark::Line,
        color: 1,
    });
    // The convolution of 1.2 + sin x with the kernel is 1.2 + exp(-epsilon^2/2) sin x; a sum over a lattice has its images
    // in wave space besides, of size 2 exp(-2 pi^2 (epsilon/h)^2) and, for sin x, 2 exp(-(2 pi epsilon/h - epsilon)^2/2).
    let expected = |x: f64| 1.2 + (-0.5 * EPSILON * EPSILON).exp() * x.sin();
    let images = 2.4 * (-2.0 * PI * PI).exp() + 2.0 * (-0.5 * (2.0 * PI - EPSILON).powi(2)).exp();
    let miss = (0..=64).map(|i| f64::from(i) * PI / 32.0).map(|x| (all(x) - expected(x)).abs()).fold(0.0, f64::max);
    claims.equal("Figure 1: largest miss of the mollified function".into(), miss, 0.0, images);
    let axes = |title| Axes { title, x: "x", y: "", logarithmic: false };
    vec![(axes("Point particles"), left), (axes("Smooth particles, epsilon = h"), right)]
}

/// Figure 2: the kernel of eq. 27.
pub fn hat(claims: &mut Claims) -> Vec<(Axes<'static>, Vec<Curve>)> {
    let kernel = LatticeHat::<1>::new();
    let eta = |x: f64| -> f64 { kernel.value(&[x]) };
    let nodes: Vec<(f64, f64)> = (-3..=3).map(f64::from).map(|i| (i, eta(i))).collect();
    let moment = |n: i32| nodes.iter().map(|(i, eta)| i.powi(n) * eta).sum();
    claims.equal("hat: discrete M_1".into(), moment(1), 0.0, 0.0);
    claims.equal("hat: discrete M_2".into(), moment(2), 2.0, 0.0);
    claims.equal("hat: discrete M_3".into(), moment(3), 0.0, 0.0);
    claims.equal("hat: continuous M_2".into(), integral(2.0, |x| x * x * eta(x)), 8.0 / 3.0, KINKS);
    let line = Curve { name: "eta(x)".into(), points: curve(-3.0, 3.0, 6, eta), mark: Mark::Line, color: 0 };
    let dots = Curve { name: "on the lattice".into(), points: nodes, mark: Mark::CirclesAlone, color: 1 };
    let axes = Axes { title: "Lattice hat, notes 000, eq. 27", x: "x", y: "eta", logarithmic: false };
    vec![(axes, vec![line, dots])]
}
