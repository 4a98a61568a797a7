//! Many panels in rows and columns over one legend.

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;

use crate::figure::{Axes, Curve, legend, panel_of};

const PANEL: (u32, u32) = (440, 370);
/// Axes this long have labels at powers of ten alone, which do not touch.
const SPAN: f64 = 300.0;
/// Least width, and height, of an entry of the legend.
const ENTRY: (u32, u32) = (220, 24);
/// Widths of a letter, and of the mark with its margins.
const LETTER: u32 = 8;
const BESIDE: u32 = 48;

/// Draws panels, row after row, and below them an entry for each name among their curves, the dashed ones last: those of one
/// name are to look alike.
pub fn draw(path: &Path, columns: usize, panels: Vec<(Axes, Vec<Curve>)>) -> Result<(), Box<dyn Error>> {
    let mut svg = String::new();
    drawing(&mut svg, columns, panels).map_err(|error| error.to_string())?;
    std::fs::write(path, svg)?;
    Ok(())
}

fn drawing<'a>(
    svg: &'a mut String,
    columns: usize,
    mut panels: Vec<(Axes, Vec<Curve>)>,
) -> Result<(), Box<dyn Error + 'a>> {
    let mut entries: Vec<(String, crate::figure::Mark, usize)> = Vec::new();
    for curve in panels.iter_mut().flat_map(|(_, curves)| curves) {
        // Without names no panel draws a legend of its own.
        let name = std::mem::take(&mut curve.name);
        if !name.is_empty() && entries.iter().all(|entry| entry.0 != name) {
            entries.push((name, curve.mark, curve.color));
        }
    }
    // What is dashed is there to compare with.
    entries.sort_by_key(|(_, mark, _)| *mark == crate::figure::Mark::Dashed);
    let rows = panels.len().div_ceil(columns);
    let width = PANEL.0 * columns as u32;
    let longest = entries.iter().map(|entry| entry.0.len() as u32).max().unwrap_or(0);
    let each = ENTRY.0.max(LETTER * longest + BESIDE);
    let across = (width / each).max(1) as usize;
    let strip = ENTRY.1 * entries.len().div_ceil(across) as u32 + 20;
    let root = SVGBackend::with_string(svg, (width, PANEL.1 * rows as u32 + strip)).into_drawing_area();
    root.fill(&WHITE)?;
    let (upper, lower) = root.split_vertically(PANEL.1 * rows as u32);
    for ((axes, curves), area) in panels.iter().zip(upper.split_evenly((rows, columns))) {
        panel_of(&area, axes, curves, SPAN)?;
    }
    for (i, (name, mark, color)) in entries.into_iter().enumerate() {
        let (x, y) = ((i % across) as i32 * each as i32 + 24, (i / across) as i32 * ENTRY.1 as i32 + 14);
        lower.draw(&legend(x, y, mark, crate::figure::color(color)))?;
        lower.draw(&Text::new(name, (x + 32, y - 7), ("sans-serif", 15)))?;
    }
    root.present()?;
    Ok(())
}
