//! The figures: error against h, and solution and error over the particles.

use std::error::Error;
use std::path::Path;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::map::{self, Dot, Panel};
use crate::solve::Solved;

type Drawn = Result<(), Box<dyn Error>>;

/// Relative L2 and largest errors against 1/h, with the slopes h^2 and h^4.
pub fn orders(path: &Path, square: &[Solved<2>], ball: &[Solved<3>]) -> Drawn {
    let axes = |title| Axes { title, x: "1/h", y: "relative error", logarithmic: true };
    let square = (axes("square with a hole"), curves(square, Mark::Circles));
    draw(path, &[square, (axes("ball"), curves(ball, Mark::Triangles))])
}

fn curves<const D: usize>(all: &[Solved<D>], mark: Mark) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (color, series) in all.chunk_by(|a, b| a.order == b.order).enumerate() {
        let (Some(first), Some(last)) = (series.first(), series.last()) else { continue };
        let of = |error: fn(&Solved<D>) -> f64| series.iter().map(|solved| (1.0 / solved.h, error(solved))).collect();
        let order = first.order;
        curves.push(Curve { name: format!("r = {order}, L2"), points: of(|solved| solved.l2), mark, color });
        let largest = of(|solved| solved.linf);
        curves.push(Curve { name: format!("r = {order}, largest"), points: largest, mark: Mark::Crosses, color });
        let at = |h: f64| (1.0 / h, 0.6 * first.l2 * (h / first.h).powi(order as i32));
        let name = if color == 0 { "h^2, h^4".into() } else { String::new() };
        curves.push(Curve { name, points: vec![at(first.h), at(last.h)], mark: Mark::Line, color: 7 });
    }
    curves
}

/// Particles in one panel at most, so that the file stays small.
const MOST: usize = 5000;

/// u of order 4, and the errors of both orders, on the finest square of at most [`MOST`] particles.
pub fn square(path: &Path, all: &[Solved<2>]) -> Drawn {
    panels(path, all, [0.0, 1.0], |_, x| Some(*x))
}

/// The same in a slice through the center of a ball, a spacing thick.
pub fn ball(path: &Path, all: &[Solved<3>]) -> Drawn {
    panels(path, all, [-0.5, 0.5], |h, x| (x[1].abs() <= 0.5 * h).then_some([x[0], x[2]]))
}

fn panels<const D: usize>(
    path: &Path,
    all: &[Solved<D>],
    range: [f64; 2],
    place: impl Fn(f64, &[f64; D]) -> Option<[f64; 2]>,
) -> Drawn {
    let finest: Vec<&Solved<D>> = all
        .chunk_by(|a, b| a.order == b.order)
        .filter_map(|series| series.iter().rev().find(|solved| solved.particles <= MOST))
        .collect();
    let dots = |solved: &Solved<D>, values: &[f64]| -> Vec<Dot> {
        let places = solved.points.iter().zip(values);
        places.filter_map(|(x, &value)| Some((place(solved.h, x)?, value))).collect()
    };
    let mut drawn = Vec::new();
    if let Some(best) = finest.last() {
        let title = format!("u, r = {}, N = {}", best.order, best.particles);
        drawn.push(Panel { title, dots: dots(best, &best.u), h: best.h });
    }
    for solved in finest {
        let title = format!("|error|, r = {}", solved.order);
        drawn.push(Panel { title, dots: dots(solved, &solved.error), h: solved.h });
    }
    map::draw(path, range, &drawn)
}
