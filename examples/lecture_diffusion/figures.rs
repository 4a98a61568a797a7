//! The figures of the benchmark.

use std::error::Error;
use std::path::Path;

use crate::benchmark::{Record, T, exact};
use crate::figure::{Axes, Curve, Mark, draw};

type Drawn = Result<(), Box<dyn Error>>;

/// Figure 5.1: both solutions at time T with N = 50, over the exact one.
pub fn solutions(path: &Path, walk: &[(f64, f64)], exchange: &[(f64, f64)]) -> Drawn {
    let fine = || (0..=400).map(|i| f64::from(i) / 100.0).map(|x| (x, exact(x, T))).collect();
    let panel = |title, name: &str, points: &[(f64, f64)], color| {
        let points = points.iter().copied().filter(|p| p.0 <= 4.0).collect();
        let exact = Curve { name: "exact".into(), points: fine(), mark: Mark::Line, color: 4 };
        let computed = Curve { name: name.into(), points, mark: Mark::CirclesAlone, color };
        (Axes { title, x: "x", y: "u(x, T)", logarithmic: false }, vec![exact, computed])
    };
    let walk = panel("Random walk, N = 50, 20 bins", "random walk", walk, 1);
    let exchange = panel("PSE order 2, N = 50", "PSE", exchange, 0);
    draw(path, &[walk, exchange])
}

/// Figure 5.2: error against the number of particles.
pub fn convergence(path: &Path, records: &[Record]) -> Drawn {
    let axes = Axes { title: "Error at T = 10", x: "number of particles N", y: "L2 error", logarithmic: true };
    draw(path, &[(axes, curves(records, |r| r.n as f64))])
}

/// Error against run time, everything included: neighbors, rows, steps.
pub fn cost(path: &Path, records: &[Record]) -> Drawn {
    let axes = Axes { title: "Error against run time", x: "seconds for one run", y: "L2 error", logarithmic: true };
    draw(path, &[(axes, curves(records, |r| r.seconds))])
}

fn curves(records: &[Record], x: impl Fn(&Record) -> f64) -> Vec<Curve> {
    let curve = |name: &str, wanted: (&str, &str, u32, &str), mark, color| Curve {
        name: name.into(),
        points: records
            .iter()
            .filter(|r| (r.method, r.scalar, r.order, r.stepper) == wanted)
            .map(|r| (x(r), r.l2))
            .collect(),
        mark,
        color,
    };
    vec![
        curve("random walk, rms of 10", ("rw", "f64", 0, "euler"), Mark::Triangles, 1),
        curve("PSE 2, Euler", ("pse", "f64", 2, "euler"), Mark::Crosses, 6),
        curve("PSE 2, RK4", ("pse", "f64", 2, "rk4"), Mark::Circles, 0),
        curve("PSE 4, RK4", ("pse", "f64", 4, "rk4"), Mark::Circles, 2),
        curve("PSE 6, RK4", ("pse", "f64", 6, "rk4"), Mark::Circles, 3),
        curve("PSE 8, RK4", ("pse", "f64", 8, "rk4"), Mark::Circles, 5),
        curve("PSE 2, RK4, f32", ("pse", "f32", 2, "rk4"), Mark::Crosses, 7),
    ]
}
