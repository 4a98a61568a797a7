//! The figures: errors against h, fields and errors at the end, and what the ledger says of the mass.

use std::error::Error;
use std::path::Path;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::map::{self, Panel};
use crate::record::Record;
use crate::runs::{Method, Solved};

type Drawn = Result<(), Box<dyn Error>>;

fn mark(method: Method) -> Mark {
    match method {
        Method::Upwind => Mark::Crosses,
        Method::DcPse(_) => Mark::Circles,
        Method::Moving(_) => Mark::Triangles,
    }
}

/// Relative error at the end against 1/h, with the slopes h, h^2 and h^4.
pub fn order(path: &Path, records: &[Record]) -> Drawn {
    let mut curves: Vec<Curve> = Vec::new();
    for (color, series) in records.chunk_by(|a, b| a.method == b.method).enumerate() {
        let (Some(first), Some(last)) = (series.first(), series.last()) else { continue };
        let points = series.iter().map(|record| (record.n as f64, record.l2)).collect();
        curves.push(Curve { name: first.method.name(), points, mark: mark(first.method), color });
        if !matches!(first.method, Method::Moving(_)) {
            let at = |n: usize| {
                let ratio = first.n as f64 / n as f64;
                (n as f64, 1.4 * first.l2 * ratio.powi(first.method.order() as i32))
            };
            let name = if color == 0 { "h, h^2, h^4".into() } else { String::new() };
            let points = vec![at(first.n), at(last.n)];
            curves.push(Curve { name, points, mark: Mark::Line, color: 7 });
        }
    }
    let axes = Axes { title: "advection and diffusion, t = 0.5", x: "1/h", y: "relative L2 error", logarithmic: true };
    draw(path, &[(axes, curves)])
}

/// The field at the end by DC-PSE, and the errors of three methods.
pub fn fields(path: &Path, shown: &[Solved]) -> Drawn {
    let panel = |method: Method, errors: bool| {
        let solved = shown.iter().find(|solved| solved.method == method)?;
        let moment = solved.moments.last()?;
        let values = if errors { moment.errors() } else { moment.u.clone() };
        let dots = moment.particles.points().iter().copied().zip(values).collect();
        let title = format!("{}, {}", method.name(), if errors { "error" } else { "u" });
        Some(Panel { title, dots, h: 1.0 / solved.n as f64 })
    };
    let chosen = [
        panel(Method::DcPse(4), false),
        panel(Method::DcPse(4), true),
        panel(Method::Upwind, true),
        panel(Method::Moving(4), true),
    ];
    let drawn: Vec<Panel> = chosen.into_iter().flatten().collect();
    map::draw(path, [0.0, 1.0], &drawn)
}

/// |drift| of the mass over the mass against time; a drift of zero has no point.
pub fn drift(path: &Path, shown: &[Solved]) -> Drawn {
    let curve = |(color, solved): (usize, &Solved)| {
        let rows = solved.ledger.rows();
        let every = rows.len().div_ceil(40).max(1);
        let points = rows.iter().step_by(every).filter_map(|row| {
            let field = row.fields.first()?;
            (field.drift != 0.0).then(|| (row.t, (field.drift / field.mass).abs()))
        });
        Curve { name: solved.method.name(), points: points.collect(), mark: mark(solved.method), color }
    };
    let mut curves: Vec<Curve> = shown.iter().enumerate().map(curve).collect();
    if let Some(scattered) = shown.iter().find(|solved| solved.method == Method::DcPse(4)) {
        let points = scattered.ledger.rows().iter().map(|row| (row.t, scattered.drift_of_exact(row.t).abs())).collect();
        let name = "exact, at the particles that stay".into();
        curves.push(Curve { name, points, mark: Mark::Line, color: 7 });
    }
    let axes = Axes { title: "drift of the mass", x: "t", y: "|mass - mass at the start| / mass", logarithmic: true };
    draw(path, &[(axes, curves)])
}
