//! Points at which the checkers look.

/// The origin, a point beside it, points on every axis, and 200 points spread over the cube [-radius, radius]^D.
pub(super) fn spread<const D: usize>(radius: f64) -> Vec<[f64; D]> {
    let mut points = vec![[0.0; D], [1e-160; D], [1e-9; D]];
    for axis in 0..D {
        for x in [-radius, -0.5, 0.5, 1.0, radius] {
            let mut point = [0.0; D];
            point[axis] = x;
            points.push(point);
        }
    }
    // The fractional parts of multiples of powers of 1/g, g^(D+1) = g + 1, fill the cube evenly.
    let mut g: f64 = 1.5;
    for _ in 0..40 {
        g = (1.0 + g).powf(1.0 / (D as f64 + 1.0));
    }
    for i in 1..=200 {
        let mut step = 1.0;
        points.push(std::array::from_fn(|_| {
            step /= g;
            radius * (2.0 * (0.5 + step * f64::from(i)).fract() - 1.0)
        }));
    }
    points
}

/// Directions along the axes and along the diagonal.
pub(super) fn sphere<const D: usize>() -> Vec<[f64; D]> {
    let mut directions: Vec<[f64; D]> =
        (0..D).map(|axis| std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 })).collect();
    directions.push([1.0 / (D as f64).sqrt(); D]);
    directions
}

/// Visits the points h Z^D within [-radius, radius]^D.
pub(super) fn lattice<const D: usize>(radius: f64, h: f64, mut visit: impl FnMut([f64; D])) {
    let steps = (radius / h).floor();
    let mut node = [-steps; D];
    loop {
        visit(node.map(|i| i * h));
        let Some(axis) = node.iter().position(|&i| i < steps) else { return };
        node[axis] += 1.0;
        node[..axis].fill(-steps);
    }
}
