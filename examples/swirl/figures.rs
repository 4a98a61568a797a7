//! The figures: error against seconds and against h, and the blob on its way.

use std::error::Error;
use std::path::Path;

use crate::SHOWN;
use crate::figure::{Axes, Curve, Mark, draw};
use crate::map::{self, Panel};
use crate::record::{Moment, Record};
use crate::runs::Method;

type Drawn = Result<(), Box<dyn Error>>;

/// Errors at T/2 and at T against seconds.
pub fn cost(path: &Path, records: &[Record]) -> Drawn {
    draw(path, &panels(records, "seconds, rows built and one period", Record::seconds))
}

/// Errors at T/2 and at T against h, with the slopes h^2 and h^4.
pub fn order(path: &Path, records: &[Record]) -> Drawn {
    let h = |record: &Record| 1.0 / record.n as f64;
    let mut drawn = panels(records, "h", h);
    let (Some(first), Some(last)) = (records.first().map(h), records.last().map(h)) else { return Ok(()) };
    for order in [2, 4] {
        let at = |h: f64| (h, 0.02 * (h / first).powi(order));
        let name = if order == 2 { "h^2, h^4".into() } else { String::new() };
        let slope = |name| Curve { name, points: vec![at(first), at(last)], mark: Mark::Line, color: 7 };
        drawn[0].1.push(slope(String::new()));
        drawn[1].1.push(slope(name));
    }
    draw(path, &drawn)
}

fn panels<'a>(records: &[Record], x: &'a str, of: fn(&Record) -> f64) -> [(Axes<'a>, Vec<Curve>); 2] {
    let panel = |title, named: bool, error: fn(&Record) -> f64| {
        let curves = records.chunk_by(|a, b| a.method == b.method).enumerate().filter_map(|(color, series)| {
            let method = series.first()?.method;
            let mark = match method {
                Method::Late | Method::Free => Mark::Crosses,
                _ if method.stays() => Mark::Circles,
                _ => Mark::Triangles,
            };
            let points = series.iter().map(|record| (of(record), error(record))).collect();
            let name = if named { method.name() } else { String::new() };
            // Slopes have color 7.
            Some(Curve { name, points, mark, color: if color < 7 { color } else { color + 1 } })
        });
        (Axes { title, x, y: "relative L2 error", logarithmic: true }, curves.collect())
    };
    [panel("wound up, t = T/2", false, |record| record.half), panel("back again, t = T", true, |record| record.l2)]
}

/// The blob at T/2 by three methods, and what the upwind scheme left of it at T.
pub fn fields(path: &Path, shown: &[(Method, Vec<Moment>)]) -> Drawn {
    let chosen = [
        (Method::Remeshed(4, 2), 2, "T/2"),
        (Method::Free, 2, "T/2"),
        (Method::Central(2), 2, "T/2"),
        (Method::Upwind, 4, "T"),
    ];
    let panel = |(method, quarter, when): (Method, usize, &str)| {
        let (_, moments) = shown.iter().find(|(own, _)| *own == method)?;
        let moment = moments.get(quarter)?;
        let dots = moment.particles.points().iter().copied().zip(moment.u.iter().copied()).collect();
        Some(Panel { title: format!("{}, t = {when}", method.name()), dots, h: 1.0 / SHOWN as f64 })
    };
    let drawn: Vec<Panel> = chosen.into_iter().filter_map(panel).collect();
    map::draw(path, [0.0, 1.0], &drawn)
}
