//! Figures of the examples: curves with markers, on linear or logarithmic axes, as SVG.

use std::error::Error;
use std::path::Path;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::element::DashedPathElement;
use plotters::prelude::*;

/// One curve.
pub struct Curve {
    /// Its name in the legend; no entry where empty.
    pub name: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
    /// How they are drawn.
    pub mark: Mark,
    /// Index into the palette.
    pub color: usize,
}

/// How the points of a curve are drawn.
#[derive(Clone, Copy, PartialEq)]
pub enum Mark {
    Line,
    Dashed,
    Circles,
    Triangles,
    Crosses,
    CirclesAlone,
    Squares,
}

/// Titles and kind of axes of one panel.
pub struct Axes<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub logarithmic: bool,
}

const SIZE: (u32, u32) = (760, 560);
const PALETTE: [RGBColor; 10] = [
    RGBColor(31, 87, 166),
    RGBColor(206, 77, 38),
    RGBColor(35, 133, 72),
    RGBColor(122, 62, 157),
    RGBColor(20, 20, 20),
    RGBColor(178, 130, 0),
    RGBColor(0, 139, 149),
    RGBColor(130, 130, 130),
    RGBColor(214, 99, 168),
    RGBColor(128, 84, 60),
];

/// Where a panel is drawn.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Draws panels side by side into one SVG file.
pub fn draw(path: &Path, panels: &[(Axes, Vec<Curve>)]) -> Result<(), Box<dyn Error>> {
    let mut svg = String::new();
    drawing(&mut svg, panels).map_err(|error| error.to_string())?;
    std::fs::write(path, svg)?;
    Ok(())
}

fn drawing<'a>(svg: &'a mut String, panels: &[(Axes, Vec<Curve>)]) -> Result<(), Box<dyn Error + 'a>> {
    let width = SIZE.0 * panels.len() as u32;
    let root = SVGBackend::with_string(svg, (width, SIZE.1)).into_drawing_area();
    root.fill(&WHITE)?;
    for ((axes, curves), area) in panels.iter().zip(root.split_evenly((1, panels.len()))) {
        panel_of(&area, axes, curves, 1.0)?;
    }
    root.present()?;
    Ok(())
}

/// Draws one panel into an area; the ends of a logarithmic axis are at least the factor `span` apart.
pub fn panel_of<'a>(area: &Area<'a>, axes: &Axes, curves: &[Curve], span: f64) -> Result<(), Box<dyn Error + 'a>> {
    let [x, y] = [bounds(curves, axes.logarithmic, |p| p.0), bounds(curves, axes.logarithmic, |p| p.1)];
    if axes.logarithmic {
        let [x, y] = [x, y].map(|(low, high)| {
            let more = (span * low / high).max(1.0).sqrt();
            (low / more, high * more)
        });
        panel(area, axes, curves, (x.0..x.1).log_scale(), (y.0..y.1).log_scale(), power_of_ten)
    } else {
        panel(area, axes, curves, x.0..x.1, y.0..y.1, plain)
    }
}

/// The color of this index.
pub fn color(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

fn panel<'a, X, Y>(
    area: &Area<'a>,
    axes: &Axes,
    curves: &[Curve],
    x: X,
    y: Y,
    label: fn(&f64) -> String,
) -> Result<(), Box<dyn Error + 'a>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(area)
        .caption(axes.title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(axes.x)
        .y_desc(axes.y)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .draw()?;
    for curve in curves {
        let color = color(curve.color);
        let points = || curve.points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
        if curve.mark == Mark::Dashed {
            let dashes = DashedLineSeries::new(points(), 6, 5, color.stroke_width(1));
            chart.draw_series(dashes)?;
        } else if curve.mark != Mark::CirclesAlone {
            chart.draw_series(LineSeries::new(points(), color.stroke_width(2)))?;
        }
        match curve.mark {
            Mark::Circles | Mark::CirclesAlone => {
                chart.draw_series(points().map(|p| Circle::new(p, 4, color.filled())))?;
            }
            Mark::Triangles => {
                chart.draw_series(points().map(|p| TriangleMarker::new(p, 6, color.filled())))?;
            }
            Mark::Crosses => {
                chart.draw_series(points().map(|p| Cross::new(p, 5, color.stroke_width(2))))?;
            }
            Mark::Line | Mark::Dashed | Mark::Squares => {}
        }
        if curve.mark == Mark::Squares {
            chart.draw_series(points().map(|p| EmptyElement::at(p) + square((0, 0), 4, color)))?;
        }
        if !curve.name.is_empty() {
            let mark = curve.mark;
            // An empty series carries the legend entry, so that every curve has one, whatever it is drawn with.
            chart
                .draw_series(LineSeries::new(std::iter::empty::<(f64, f64)>(), color))?
                .label(&curve.name)
                .legend(move |(x, y)| legend(x, y, mark, color));
        }
    }
    if curves.iter().all(|curve| curve.name.is_empty()) {
        return Ok(());
    }
    let (columns, rows) = chart.plotting_area().get_pixel_range();
    let drawn: Vec<(i32, i32)> = curves
        .iter()
        .flat_map(|curve| dense(&curve.points, axes.logarithmic))
        .map(|p| chart.backend_coord(&p))
        .collect();
    // About what the legend takes.
    let names = || curves.iter().map(|curve| curve.name.len()).filter(|&length| length > 0);
    let size = (70 + 8 * names().max().unwrap_or(0) as i32, 20 + 20 * names().count() as i32);
    let (right, low) = (columns.end - size.0, rows.end - size.1);
    let middle = (rows.start + rows.end - size.1) / 2;
    let places = [
        (SeriesLabelPosition::LowerLeft, columns.start, low),
        (SeriesLabelPosition::UpperRight, right, rows.start),
        (SeriesLabelPosition::LowerRight, right, low),
        (SeriesLabelPosition::UpperLeft, columns.start, rows.start),
        (SeriesLabelPosition::MiddleLeft, columns.start, middle),
        (SeriesLabelPosition::MiddleRight, right, middle),
    ];
    // The place where it hides least.
    let hidden = |&(_, left, top): &(SeriesLabelPosition, i32, i32)| {
        let under = |p: &&(i32, i32)| (left..left + size.0).contains(&p.0) && (top..top + size.1).contains(&p.1);
        drawn.iter().filter(under).count()
    };
    let position = places.into_iter().min_by_key(hidden).map_or(SeriesLabelPosition::UpperRight, |place| place.0);
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 15))
        .draw()?;
    Ok(())
}

/// Points along a curve, a few between any two of its own.
fn dense(points: &[(f64, f64)], logarithmic: bool) -> impl Iterator<Item = (f64, f64)> {
    let between = move |a: f64, b: f64, t: f64| if logarithmic { a * (b / a).powf(t) } else { a + (b - a) * t };
    points
        .windows(2)
        .flat_map(move |pair| {
            let [a, b] = [pair[0], pair[1]];
            (0..=8).map(move |i| f64::from(i) / 8.0).map(move |t| (between(a.0, b.0, t), between(a.1, b.1, t)))
        })
        .filter(|p| p.0.is_finite() && p.1.is_finite())
}

/// What a curve looks like in a legend, at a place.
pub fn legend<'a>(x: i32, y: i32, mark: Mark, color: RGBColor) -> DynElement<'static, SVGBackend<'a>, (i32, i32)> {
    let line = |width| PathElement::new(vec![(x, y), (x + 22, y)], color.stroke_width(width)).into_dyn();
    match mark {
        Mark::Circles | Mark::CirclesAlone => Circle::new((x + 11, y), 5, color.filled()).into_dyn(),
        Mark::Triangles => TriangleMarker::new((x + 11, y), 7, color.filled()).into_dyn(),
        Mark::Squares => square((x + 11, y), 5, color).into_dyn(),
        Mark::Crosses => Cross::new((x + 11, y), 6, color.stroke_width(2)).into_dyn(),
        Mark::Line => line(2),
        Mark::Dashed => DashedPathElement::new([(x, y), (x + 22, y)], 6, 3, color.stroke_width(1)).into_dyn(),
    }
}

/// A square of twice this side.
fn square((x, y): (i32, i32), half: i32, color: RGBColor) -> Rectangle<(i32, i32)> {
    Rectangle::new([(x - half, y - half), (x + half, y + half)], color.filled())
}

/// The range of all points with a margin, in the measure of the axis.
fn bounds(curves: &[Curve], logarithmic: bool, coordinate: impl Fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let values = curves.iter().flat_map(|curve| &curve.points).map(coordinate).filter(|v| v.is_finite());
    let (low, high) = values
        .filter(|v| !logarithmic || *v > 0.0)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if !(low <= high) {
        return (0.1, 1.0);
    }
    if logarithmic {
        let (low, high) = (low / 1.6, high * 1.6);
        // An axis without a power of ten would have no label.
        let (below, above) = (10.0_f64.powf(low.log10().floor()), 10.0_f64.powf(high.log10().ceil()));
        let bare = below * 10.0 > high;
        if !bare {
            (low, high)
        } else if low / below < above / high {
            (0.999 * below, high)
        } else {
            (low, 1.001 * above)
        }
    } else {
        let margin = 0.05 * (high - low).max(f64::MIN_POSITIVE);
        (low - margin, high + margin)
    }
}

fn power_of_ten(value: &f64) -> String {
    // Ticks are powers, and off by rounding.
    let thousandths = (1000.0 * value).round();
    if (100.0..1e7).contains(&thousandths) { format!("{}", thousandths / 1000.0) } else { format!("{value:.0e}") }
}

fn plain(value: &f64) -> String {
    // A tick at zero may be off by rounding, on either side.
    let cents = (100.0 * value).round() + 0.0;
    format!("{:.2}", 0.01 * cents)
}
