//! The figures of the study.

use std::error::Error;
use std::path::Path;

use parops::Histogram;
use plotters::prelude::*;

use crate::figure::{Axes, Curve, Mark, draw};
use crate::study::Record;

type Drawn = Result<(), Box<dyn Error>>;

/// Relative error of the Laplacian against h, one panel per set, with the slopes h^r for comparison.
pub fn errors(path: &Path, records: &[Record]) -> Drawn {
    let panel = |set: &'static str, title, y, error: fn(&Record) -> f64| {
        let mut curves = curves(records, set, Record::h, error);
        let all = || records.iter().filter(|r| (r.set, r.operator, r.dim) == (set, "laplacian", 2));
        for order in [2, 4, 6] {
            let series: Vec<&Record> = all().filter(|r| r.order == order).collect();
            if let (Some(first), Some(last)) = (series.first(), series.last()) {
                let at = |h: f64| (h, 1.5 * error(first) * (h / first.h()).powi(order as i32));
                let points = vec![at(first.h()), at(last.h())];
                let name = if order == 2 { "h^2, h^4, h^6".into() } else { String::new() };
                curves.push(Curve { name, points, mark: Mark::Line, color: 7 });
            }
        }
        (Axes { title, x: "h = N^(-1/D)", y, logarithmic: true }, curves)
    };
    let jittered = panel("jittered", "Laplacian, jittered set", "relative L2 error, interior", |r| r.l2);
    let middle = "relative L2 error, |x_i - 1/2| <= 1/4";
    let clustered = panel("clustered", "Laplacian, clustered set", middle, |r| r.l2_middle);
    draw(path, &[jittered, clustered])
}

/// Relative error of the Laplacian against the time of one build and one application.
pub fn cost(path: &Path, records: &[Record]) -> Drawn {
    let panel = |set: &'static str, title| {
        let seconds = |r: &Record| 1e-9 * (r.build + r.apply) * r.particles as f64;
        let curves = curves(records, set, seconds, |r| r.l2);
        (Axes { title, x: "seconds, rows built and applied once", y: "relative L2 error", logarithmic: true }, curves)
    };
    draw(path, &[panel("jittered", "Laplacian, jittered set"), panel("clustered", "Laplacian, clustered set")])
}

fn curves(records: &[Record], set: &'static str, x: impl Fn(&Record) -> f64, y: fn(&Record) -> f64) -> Vec<Curve> {
    let mut curves = Vec::new();
    for dim in [2, 3] {
        for order in [2, 4, 6] {
            let key = (dim, set, "laplacian", order);
            let points: Vec<(f64, f64)> = records.iter().filter(|r| r.key() == key).map(|r| (x(r), y(r))).collect();
            let mark = if points.len() == 1 {
                Mark::Crosses
            } else if dim == 2 {
                Mark::Circles
            } else {
                Mark::Triangles
            };
            if !points.is_empty() {
                let color = order as usize / 2 - 1 + if dim == 3 { 3 } else { 0 };
                curves.push(Curve { name: format!("{dim}D, r = {order}"), points, mark, color });
            }
        }
    }
    curves
}

/// Share of the rows per decade of condition number and residual, for the Laplacian on the finest jittered set.
pub fn certificates(path: &Path, records: &[Record]) -> Drawn {
    let panel = |title, x, spread: fn(&Record) -> &Histogram| {
        let finest = finest(records).into_iter().filter(|r| (r.set, r.operator) == ("jittered", "laplacian"));
        let curve = |r: &Record| {
            // The middle of a decade, on a logarithmic axis.
            let share = |(low, rows): (f64, usize)| (low * 10.0_f64.sqrt(), rows as f64 / r.particles as f64);
            let points = spread(r).decades().filter(|&(low, _)| low >= LOWEST).map(share).collect();
            let mark = if r.dim == 2 { Mark::Circles } else { Mark::Triangles };
            let color = r.order as usize / 2 - 1 + if r.dim == 3 { 3 } else { 0 };
            Curve { name: format!("{}D, r = {}", r.dim, r.order), points, mark, color }
        };
        (Axes { title, x, y: "share of the rows per decade", logarithmic: true }, finest.map(curve).collect())
    };
    let condition = panel("Condition numbers, finest jittered set", "cond(B), estimated", |r| &r.condition_spread);
    let residual = panel("Residuals, finest jittered set", "largest miss, scaled units", |r| &r.residual_spread);
    draw(path, &[condition, residual])
}

/// Residuals below are those of rows that miss nothing at all.
const LOWEST: f64 = 1e-20;

/// The finest set of every series.
fn finest(records: &[Record]) -> Vec<&Record> {
    let last = |&(i, r): &(usize, &Record)| records.get(i + 1).is_none_or(|next| next.key() != r.key());
    records.iter().enumerate().filter(last).map(|(_, r)| r).collect()
}

const NAMES: [&str; 5] = ["LU", "Cholesky", "Cholesky, corrected", "QR", "pivoted QR"];
const COLORS: [RGBColor; 5] = [
    RGBColor(130, 130, 130),
    RGBColor(31, 87, 166),
    RGBColor(0, 139, 149),
    RGBColor(206, 77, 38),
    RGBColor(122, 62, 157),
];

/// Share of the rows each solver found, for the finest set of every series.
pub fn rungs(path: &Path, records: &[Record]) -> Drawn {
    let mut svg = String::new();
    bars(&mut svg, &finest(records)).map_err(|error| error.to_string())?;
    std::fs::write(path, svg)?;
    Ok(())
}

fn bars<'a>(svg: &'a mut String, finest: &[&Record]) -> Result<(), Box<dyn Error + 'a>> {
    let height = 110 + 22 * finest.len() as u32;
    let root = SVGBackend::with_string(svg, (900, height)).into_drawing_area();
    root.fill(&WHITE)?;
    let count = finest.len() as f64;
    let mut chart = ChartBuilder::on(&root)
        .caption("Solvers of the certificates, finest set", ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(270)
        .build_cartesian_2d(0.0..1.6, 0.0..count)?;
    let name = |y: &f64| {
        let record = finest.get((count - y).floor().max(0.0) as usize);
        record
            .filter(|_| y.fract() != 0.0)
            .map_or(String::new(), |r| format!("{}D {} {} r = {}", r.dim, r.set, r.operator, r.order))
    };
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc("share of the rows")
        .x_label_formatter(&|x| if *x <= 1.0 { format!("{x:.1}") } else { String::new() })
        .y_labels(0)
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 16))
        .draw()?;
    for (i, record) in finest.iter().enumerate() {
        let (low, high) = (count - i as f64 - 0.85, count - i as f64 - 0.15);
        let rows = record.particles as f64;
        let mut from = 0.0;
        for (share, color) in record.rungs.iter().map(|&rung| rung as f64 / rows).zip(COLORS) {
            let to = from + share;
            chart.draw_series([Rectangle::new([(from, low), (to, high)], color.filled())])?;
            from = to;
        }
        let place = chart.backend_coord(&(0.0, 0.5 * (low + high)));
        let text = Text::new(name(&(0.5 * (low + high))), (place.0 - 262, place.1 - 7), ("sans-serif", 14));
        root.draw(&text)?;
    }
    for (name, color) in NAMES.iter().zip(COLORS) {
        chart
            .draw_series(LineSeries::new(std::iter::empty::<(f64, f64)>(), color))?
            .label(*name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 6), (x + 22, y + 6)], color.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 14))
        .draw()?;
    root.present()?;
    Ok(())
}
