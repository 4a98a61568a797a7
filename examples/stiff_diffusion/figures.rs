//! Error against run time and against applies, and applies against the diffusion number.

use std::error::Error;
use std::path::Path;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::scheme::{EXPLICIT, Record, STIFF, Scheme};

/// Draws every figure into the folder.
pub fn draw_all(folder: &Path, costs: &[Record], numbers: &[Record]) -> Result<(), Box<dyn Error>> {
    let error = |r: &Record| r.error;
    for (set, name) in [("lattice", "PSE on a lattice"), ("scattered", "DC-PSE on scattered particles")] {
        let title = |of: &str| format!("{name}: {of}");
        let titles = [title("run time"), title("applies")];
        let panel = |i: usize, x, curves| {
            (Axes { title: &titles[i], x, y: "relative L2 error in time", logarithmic: true }, curves)
        };
        draw(
            &folder.join(format!("stiff_diffusion_{set}.svg")),
            &[
                panel(0, "seconds", curves(costs, set, |r| r.seconds, error)),
                panel(1, "applies", curves(costs, set, |r| r.applies as f64, error)),
            ],
        )?;
    }
    let panel = |title, set| {
        let axes = Axes { title, x: "diffusion number of one step", y: "applies", logarithmic: true };
        (axes, curves(numbers, set, |r| r.number, |r| r.applies as f64))
    };
    draw(
        &folder.join("stiff_diffusion_numbers.svg"),
        &[panel("One step: PSE on a lattice", "lattice"), panel("One step: DC-PSE, scattered", "scattered")],
    )
}

/// A curve a scheme, of the runs that were not refused.
fn curves(records: &[Record], set: &str, x: fn(&Record) -> f64, y: fn(&Record) -> f64) -> Vec<Curve> {
    let curve = |(color, scheme): (usize, Scheme)| {
        let of = |r: &&Record| r.set == set && r.scheme == scheme && r.refused.is_none();
        let mark = match scheme {
            Scheme::Euler | Scheme::SspRk3 | Scheme::Rk4 => Mark::Crosses,
            Scheme::Rkl2 => Mark::Triangles,
            Scheme::ImplicitEulerLu | Scheme::CrankNicolsonLu => Mark::Circles,
            Scheme::ImplicitEulerBiCgStab | Scheme::CrankNicolsonBiCgStab => Mark::Line,
        };
        let points = records.iter().filter(of).map(|r| (x(r), y(r))).collect();
        Curve { name: scheme.name().into(), points, mark, color }
    };
    EXPLICIT.into_iter().chain(STIFF).enumerate().map(curve).collect()
}
