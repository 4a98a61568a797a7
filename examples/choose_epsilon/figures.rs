//! The figures: error against overlap, cutoff and neighbors, conditioning, and error against cost.

use std::error::Error;
use std::path::Path;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::study::{Record, Varied};

/// Draws every figure into the folder.
pub fn draw_all(folder: &Path, records: &[Record]) -> Result<(), Box<dyn Error>> {
    let error = |r: &Record| r.l2;
    // Ranges of less than a decade have no readable logarithmic axis.
    let digits = |r: &Record| r.l2.log10();
    let series = |method, varied, dim, scattered| Choice { records, method, varied, dim, scattered };
    let panel = |title, x, y, curves| (Axes { title, x, y, logarithmic: true }, curves);
    let plain = |title, x, y, curves| (Axes { title, x, y, logarithmic: false }, curves);
    const ERROR: &str = "relative L2 error";
    const DIGITS: &str = "log10 of the relative L2 error";

    for (name, dim, titles) in [
        ("choose_epsilon_overlap.svg", 2, ["PSE, 2D lattice", "PSE, 2D jittered"]),
        ("choose_epsilon_overlap_3d.svg", 3, ["PSE, 3D lattice", "PSE, 3D jittered"]),
    ] {
        let of = |scattered| series("PSE", Varied::Overlap, dim, scattered).curves(|r| r.epsilon_over_h, digits, "");
        let mut panels = [(titles[0], false), (titles[1], true)]
            .map(|(title, scattered)| plain(title, "epsilon / h", DIGITS, of(scattered)));
        panels[0].1.extend(slopes(&panels[0].1));
        draw(&folder.join(name), &panels)?;
    }
    let cut =
        |method, scattered| series(method, Varied::Cutoff, 2, scattered).curves(|r| r.cutoff_over_epsilon, digits, "");
    draw(
        &folder.join("choose_epsilon_cutoff.svg"),
        &[
            plain("PSE, 2D lattice, epsilon = 2 h", "cutoff / epsilon", DIGITS, cut("PSE", false)),
            plain("DC-PSE, 2D jittered, 2 l neighbors", "cutoff / epsilon", DIGITS, cut("DC-PSE", true)),
        ],
    )?;
    let dcpse = |dim, y| series("DC-PSE", Varied::Overlap, dim, true).curves(|r| r.neighbors, y, "");
    draw(
        &folder.join("choose_epsilon_neighbors.svg"),
        &[
            plain("DC-PSE, 2D jittered", "neighbors", DIGITS, dcpse(2, digits)),
            plain(
                "DC-PSE, 2D jittered",
                "neighbors",
                "log10 of the worst condition",
                dcpse(2, |r| r.condition.log10()),
            ),
            plain("DC-PSE, 2D jittered", "neighbors", "h^2 sum |w|", dcpse(2, |r| r.sum_abs)),
        ],
    )?;
    let cost = |x: fn(&Record) -> f64| {
        let mut curves = series("DC-PSE", Varied::Overlap, 2, true).curves(x, error, "DC-PSE, ");
        let shown = curves.len();
        for mut curve in series("PSE", Varied::Overlap, 2, true).curves(x, error, "PSE, ") {
            (curve.mark, curve.color) = (Mark::Crosses, curve.color + shown);
            curves.push(curve);
        }
        curves
    };
    draw(
        &folder.join("choose_epsilon_cost.svg"),
        &[
            panel("2D jittered", "build, ns per particle", ERROR, cost(|r| r.build)),
            panel("2D jittered", "apply, ns per particle", ERROR, cost(|r| r.apply)),
        ],
    )
}

/// epsilon^r through the last point of every curve, back to half its epsilon.
fn slopes(curves: &[Curve]) -> Vec<Curve> {
    let last = curves.iter().filter_map(|curve| Some((curve.name.strip_prefix("r = ")?, curve.points.last()?)));
    let ends = last.filter_map(|(order, &(x, y))| Some((order.parse::<f64>().ok()?, x, y)));
    ends.enumerate()
        .map(|(i, (order, x, y))| Curve {
            name: if i == 0 { "epsilon^r".into() } else { String::new() },
            points: (8..=16).map(|j| f64::from(j) / 16.0).map(|t| (t * x, y + order * t.log10())).collect(),
            mark: Mark::Line,
            color: 7,
        })
        .collect()
}

/// Some of the records.
struct Choice<'a> {
    records: &'a [Record],
    method: &'static str,
    varied: Varied,
    dim: usize,
    scattered: bool,
}

impl Choice<'_> {
    /// A curve an order; triangles in 3D.
    fn curves(&self, x: fn(&Record) -> f64, y: fn(&Record) -> f64, prefix: &str) -> Vec<Curve> {
        let chosen = |r: &&Record| {
            (r.method, r.varied, r.dim, r.jitter > 0.0) == (self.method, self.varied, self.dim, self.scattered)
        };
        let mark = if self.dim == 2 { Mark::Circles } else { Mark::Triangles };
        let mut curves: Vec<Curve> = Vec::new();
        for record in self.records.iter().filter(chosen) {
            let name = format!("{prefix}r = {}", record.order);
            let color = curves.len();
            match curves.last_mut().filter(|curve| curve.name == name) {
                Some(curve) => curve.points.push((x(record), y(record))),
                None => curves.push(Curve { name, points: vec![(x(record), y(record))], mark, color }),
            }
        }
        curves
    }
}
