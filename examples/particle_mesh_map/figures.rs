//! The maps side by side, as one SVG.

use std::error::Error;
use std::path::Path;

use parops::Mesh;
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::map::{Cloud, Map};

/// Width of a panel with its margin, and height of a row.
const PANEL: (i32, i32) = (250, 290);
/// Side of a map, and the room above and to the left of it.
const SIDE: i32 = 220;
const ABOVE: i32 = 44;
const LEFT: i32 = 30;
/// Room for the color scale of a row.
const SCALE: i32 = 110;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A row per cloud: its maps, the exact density where there is one, and the scale of the row.
pub fn draw(path: &Path, mesh: &Mesh<2>, clouds: &[Cloud], maps: &[Map]) -> Result<(), Box<dyn Error>> {
    let mut svg = String::new();
    drawing(&mut svg, mesh, clouds, maps).map_err(|error| error.to_string())?;
    std::fs::write(path, svg)?;
    Ok(())
}

fn drawing<'a>(svg: &'a mut String, mesh: &Mesh<2>, clouds: &[Cloud], maps: &[Map]) -> Result<(), Box<dyn Error + 'a>> {
    let kernels = maps.len() / clouds.len().max(1);
    let size = (PANEL.0 * (kernels as i32 + 1) + SCALE, PANEL.1 * clouds.len() as i32 + 10);
    let root = SVGBackend::with_string(svg, (size.0 as u32, size.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    for (row, (cloud, maps)) in clouds.iter().zip(maps.chunks(kernels)).enumerate() {
        let exact: Option<Vec<f64>> = mesh.points().map(|x| cloud.density(&x)).collect();
        let all = || maps.iter().flat_map(|map| &map.density).chain(exact.iter().flatten()).copied();
        let scale = Colors { low: all().fold(0.0, f64::min), high: all().fold(0.0, f64::max) };
        let y = PANEL.1 * row as i32;
        for (column, map) in maps.iter().enumerate() {
            let n = map.drawn;
            let title = match map.error {
                Some([l2, _]) => format!("{}, N = {n}: error {:.1} %", map.kernel, 100.0 * l2),
                None => format!("{}, one particle", map.kernel),
            };
            let corner = (PANEL.0 * column as i32, y);
            panel(&root, corner, &title, mesh, &map.density, &scale)?;
            if n == 1 {
                for x in &cloud.points {
                    let place = pixel(mesh, corner, *x);
                    root.draw(&Cross::new(place, 5, RGBColor(200, 0, 0).stroke_width(2)))?;
                }
            }
        }
        let corner = (PANEL.0 * kernels as i32, y);
        if let Some(exact) = &exact {
            panel(&root, corner, "exact density", mesh, exact, &scale)?;
        }
        // Without a map of the exact density its room stays empty, so that columns and scales stand below each other.
        legend(&root, (corner.0 + PANEL.0, y), &scale)?;
    }
    root.present()?;
    Ok(())
}

/// Where a point of the box is drawn: x to the right, y upward.
fn pixel(mesh: &Mesh<2>, corner: (i32, i32), x: [f64; 2]) -> (i32, i32) {
    let (lower, widths) = (mesh.domain().lower(), mesh.domain().widths());
    let share = |axis: usize| (x[axis] - lower[axis]) / widths[axis] * f64::from(SIDE);
    (corner.0 + LEFT + share(0).round() as i32, corner.1 + ABOVE + SIDE - share(1).round() as i32)
}

fn panel<'a>(
    root: &Area<'a>,
    corner: (i32, i32),
    title: &str,
    mesh: &Mesh<2>,
    density: &[f64],
    scale: &Colors,
) -> Result<(), Box<dyn Error + 'a>> {
    let half = mesh.spacings().map(|h| 0.5 * h);
    for (x, &value) in mesh.points().zip(density).filter(|(_, value)| **value != 0.0) {
        let from = pixel(mesh, corner, [x[0] - half[0], x[1] - half[1]]);
        let to = pixel(mesh, corner, [x[0] + half[0], x[1] + half[1]]);
        root.draw(&Rectangle::new([from, to], scale.color(value).filled()))?;
    }
    let (lower, upper) = (mesh.domain().lower(), mesh.domain().upper());
    let frame = [pixel(mesh, corner, lower), pixel(mesh, corner, upper)];
    root.draw(&Rectangle::new(frame, BLACK.mix(0.6)))?;
    let font = ("sans-serif", 15);
    root.draw(&Text::new(title.to_string(), (corner.0 + LEFT, corner.1 + ABOVE - 22), font))?;
    for tick in [lower[0], 0.0, upper[0]] {
        let (x, _) = pixel(mesh, corner, [tick, 0.0]);
        let (_, y) = pixel(mesh, corner, [0.0, tick]);
        let text = format!("{tick:.0}");
        let width = 7 * text.len() as i32;
        root.draw(&Text::new(text.clone(), (x - width / 2, corner.1 + ABOVE + SIDE + 4), ("sans-serif", 12)))?;
        root.draw(&Text::new(text, (corner.0 + LEFT - width - 4, y - 7), ("sans-serif", 12)))?;
    }
    Ok(())
}

fn legend<'a>(root: &Area<'a>, corner: (i32, i32), scale: &Colors) -> Result<(), Box<dyn Error + 'a>> {
    const STEPS: i32 = 110;
    let (left, top) = (corner.0 + 20, corner.1 + ABOVE);
    let value = |share: f64| scale.low + share * (scale.high - scale.low);
    for step in 0..STEPS {
        let y = |step: i32| top + SIDE - SIDE * step / STEPS;
        let color = scale.color(value((f64::from(step) + 0.5) / f64::from(STEPS)));
        root.draw(&Rectangle::new([(left, y(step)), (left + 18, y(step + 1))], color.filled()))?;
    }
    root.draw(&Rectangle::new([(left, top), (left + 18, top + SIDE)], BLACK.mix(0.6)))?;
    root.draw(&Text::new("density", (left, top - 22), ("sans-serif", 15)))?;
    let zero = -scale.low / (scale.high - scale.low);
    let mut shares = vec![zero, 0.5 * (1.0 + zero), 1.0];
    if zero > 0.05 {
        shares.push(0.0);
    }
    for share in shares {
        let y = top + SIDE - (share * f64::from(SIDE)).round() as i32;
        let text = format!("{:.4}", value(share) + 0.0);
        root.draw(&Text::new(text, (left + 24, y - 7), ("sans-serif", 12)))?;
    }
    Ok(())
}

/// The colors of one row: white at zero, through blue to black above it, through orange to brown below.
struct Colors {
    low: f64,
    high: f64,
}

impl Colors {
    fn color(&self, value: f64) -> RGBColor {
        const ABOVE: [[f64; 3]; 5] = [
            [255.0, 255.0, 255.0],
            [158.0, 202.0, 225.0],
            [49.0, 130.0, 189.0],
            [8.0, 64.0, 129.0],
            [10.0, 16.0, 50.0],
        ];
        const BELOW: [[f64; 3]; 3] = [[255.0, 255.0, 255.0], [253.0, 174.0, 97.0], [166.0, 54.0, 3.0]];
        // Both sides on the scale of the larger one, but negative values, which are small, four times as deep.
        let share = value / self.high.max(-self.low).max(f64::MIN_POSITIVE);
        if value >= 0.0 { ramp(&ABOVE, share) } else { ramp(&BELOW, (-4.0 * share).min(1.0)) }
    }
}

fn ramp(stops: &[[f64; 3]], share: f64) -> RGBColor {
    let place = share * (stops.len() - 1) as f64;
    let i = (place.floor() as usize).min(stops.len() - 2);
    let at = |c: usize| (stops[i][c] + (place - i as f64) * (stops[i + 1][c] - stops[i][c])).round() as u8;
    RGBColor(at(0), at(1), at(2))
}
