//! Figures of fields: panels of colored dots above the scale of their colors, as SVG.

use std::error::Error;
use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

/// A dot: its place in the plane and its value.
pub type Dot = ([f64; 2], f64);

/// One panel: particles of spacing h in a square, with their values.
pub struct Panel {
    pub title: String,
    pub dots: Vec<Dot>,
    pub h: f64,
}

/// Draws panels side by side into one SVG file; `range` is that of both axes.
pub fn draw(path: &Path, range: [f64; 2], panels: &[Panel]) -> Result<(), Box<dyn Error>> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (520 * panels.len() as u32, 560)).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        for (drawn, area) in panels.iter().zip(root.split_evenly((1, panels.len()))) {
            panel(&area, drawn, range).map_err(|error| error.to_string())?;
        }
        root.present().map_err(|error| error.to_string())?;
    }
    std::fs::write(path, svg)?;
    Ok(())
}

/// One panel of colored dots above the scale of its colors.
fn panel<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    Panel { title, dots, h }: &Panel,
    range: [f64; 2],
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
    let label = |x: &f64| format!("{:.1}", x + 0.0);
    let mut mesh = chart.configure_mesh();
    mesh.disable_mesh().x_label_formatter(&label).y_label_formatter(&label).label_style(("sans-serif", 14)).draw()?;
    let (width, _) = chart.plotting_area().dim_in_pixel();
    let radius = (0.4 * h / (range[1] - range[0]) * f64::from(width)).max(1.0);
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
