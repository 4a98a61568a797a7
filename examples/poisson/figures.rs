//! The figures: error against h, and solution and error over the particles.

use std::error::Error;
use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::solve::Solved;

type Drawn = Result<(), Box<dyn Error>>;

/// Relative L2 error against h, with the slopes h^2 and h^4.
pub fn orders(path: &Path, square: &[Solved<2>], ball: &[Solved<3>]) -> Drawn {
    let axes = |title| Axes { title, x: "h", y: "relative L2 error", logarithmic: true };
    draw(path, &[(axes("square with a hole"), curves(square)), (axes("ball"), curves(ball))])
}

fn curves<const D: usize>(all: &[Solved<D>]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (color, series) in all.chunk_by(|a, b| a.order == b.order).enumerate() {
        let (Some(first), Some(last)) = (series.first(), series.last()) else { continue };
        let points = series.iter().map(|solved| (solved.h, solved.l2)).collect();
        curves.push(Curve { name: format!("r = {}", first.order), points, mark: Mark::Circles, color });
        let at = |h: f64| (h, 1.5 * first.l2 * (h / first.h).powi(first.order as i32));
        let name = if color == 0 { "h^2, h^4".into() } else { String::new() };
        curves.push(Curve { name, points: vec![at(first.h), at(last.h)], mark: Mark::Line, color: 7 });
    }
    curves
}

/// A dot: its place in the plane and its value.
type Dot = ([f64; 2], f64);

/// u of order 4, and the errors of both orders, on the finest square.
pub fn square(path: &Path, all: &[Solved<2>]) -> Drawn {
    panels(path, all, [0.0, 1.0], |_, x| Some(*x))
}

/// The same in a slice through the center of the finest ball, a spacing thick.
pub fn ball(path: &Path, all: &[Solved<3>]) -> Drawn {
    panels(path, all, [-0.5, 0.5], |h, x| (x[1].abs() <= 0.5 * h).then_some([x[0], x[2]]))
}

fn panels<const D: usize>(
    path: &Path,
    all: &[Solved<D>],
    range: [f64; 2],
    place: impl Fn(f64, &[f64; D]) -> Option<[f64; 2]>,
) -> Drawn {
    let finest: Vec<&Solved<D>> = all.chunk_by(|a, b| a.order == b.order).filter_map(|series| series.last()).collect();
    let dots = |solved: &Solved<D>, values: &[f64]| -> Vec<Dot> {
        let places = solved.points.iter().zip(values);
        places.filter_map(|(x, &value)| Some((place(solved.h, x)?, value))).collect()
    };
    let mut drawn = Vec::new();
    if let Some(best) = finest.last() {
        drawn.push((format!("u, r = {}, N = {}", best.order, best.particles), dots(best, &best.u), best.h));
    }
    for solved in finest {
        drawn.push((format!("|error|, r = {}", solved.order), dots(solved, &solved.error), solved.h));
    }
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (520 * drawn.len() as u32, 560)).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        for ((title, dots, h), area) in drawn.iter().zip(root.split_evenly((1, drawn.len()))) {
            panel(&area, title, range, dots, *h).map_err(|error| error.to_string())?;
        }
        root.present().map_err(|error| error.to_string())?;
    }
    std::fs::write(path, svg)?;
    Ok(())
}

/// One panel of colored dots above the scale of its colors.
fn panel<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    title: &str,
    range: [f64; 2],
    dots: &[Dot],
    h: f64,
) -> Result<(), Box<dyn Error + 'a>> {
    let (low, high) = dots.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (_, v)| (l.min(*v), h.max(*v)));
    let share = |value: f64| if high > low { (value - low) / (high - low) } else { 0.5 };
    let (map, scale) = area.split_vertically(480);
    let margin = 0.03 * (range[1] - range[0]);
    let axis = || range[0] - margin..range[1] + margin;
    let mut chart = ChartBuilder::on(&map)
        .caption(title, ("sans-serif", 20))
        .margin(10)
        .x_label_area_size(26)
        .y_label_area_size(42)
        .build_cartesian_2d(axis(), axis())?;
    chart.configure_mesh().disable_mesh().label_style(("sans-serif", 14)).draw()?;
    let (width, _) = chart.plotting_area().dim_in_pixel();
    let radius = (0.5 * h / (range[1] - range[0]) * f64::from(width)).max(1.0);
    chart.draw_series(
        dots.iter().map(|&([x, y], value)| Circle::new((x, y), radius.round() as i32, color(share(value)).filled())),
    )?;
    const STEPS: i32 = 60;
    let left = 60;
    for step in 0..STEPS {
        let shade = color(f64::from(step) / f64::from(STEPS - 1)).filled();
        scale.draw(&Rectangle::new([(left + 6 * step, 12), (left + 6 * step + 6, 30)], shade))?;
    }
    for (place, value) in [(left, low), (left + 6 * STEPS - 60, high)] {
        scale.draw(&Text::new(format!("{value:.2e}"), (place, 36), ("sans-serif", 14)))?;
    }
    Ok(())
}

/// From dark blue over green to yellow, even in lightness.
fn color(share: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 5] =
        [[59.0, 15.0, 112.0], [49.0, 88.0, 143.0], [33.0, 145.0, 140.0], [110.0, 200.0, 90.0], [250.0, 230.0, 50.0]];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let first = (place as usize).min(STOPS.len() - 2);
    let part = place - first as f64;
    let [r, g, b] = std::array::from_fn(|i| (STOPS[first][i] * (1.0 - part) + STOPS[first + 1][i] * part) as u8);
    RGBColor(r, g, b)
}
