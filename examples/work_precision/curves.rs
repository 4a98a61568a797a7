//! The figure of a scene: error over time, a panel a dimension and set, the Pareto front marked.

use std::error::Error;
use std::fs;
use std::path::Path;

use parops::report::{Sample, Table, Task};

use crate::figure::{Axes, Curve, Mark};
use crate::grid;
use crate::tags::{self, Series};

const MARKS: [Mark; 4] = [Mark::Circles, Mark::Triangles, Mark::Crosses, Mark::Squares];
/// The black of the palette, kept for the front.
const BLACK: usize = 4;
/// A task of more series than this is drawn stepper by stepper.
const CROWD: usize = 12;

/// Draws all samples of a scene: methods by marks, orders and steppers by colors; of one method alone the steppers by marks.
pub fn draw(path: &Path, table: &Table, scene: &str) -> Result<(), Box<dyn Error>> {
    let mut tasks: Vec<Task> = table.tasks().into_iter().filter(|task| task.samples()[0].scene == scene).collect();
    tasks.sort_by_key(|task| task.samples()[0].dim);
    let of_scene = || table.samples().iter().filter(|sample| sample.scene == scene);
    let methods = distinct(of_scene().map(|sample| sample.method.clone()));
    let steppers = distinct(of_scene().map(|sample| sample.stepper.clone()).filter(|stepper| !stepper.is_empty()));
    let crowded = steppers.len() > 1 && tasks.iter().any(|task| task.series().len() > CROWD);
    // More methods than marks are told apart by colors too.
    let many = methods.len() > MARKS.len();
    let alone = methods.len() == 1;
    let kind = |sample: &Sample| {
        let Sample { method, order, stepper, scalar, .. } = sample;
        let order = if many { format!("{method} {order}") } else { order.to_string() };
        if crowded || alone { format!("{order} {scalar}") } else { format!("{order} {stepper} {scalar}") }
    };
    let kinds = distinct(of_scene().map(kind));
    let place = |names: &[String], name: &str| names.iter().position(|other| other == name).unwrap_or(0);
    let marked = |s: &Sample| if alone { place(&steppers, &s.stepper) } else { place(&methods, &s.method) };
    let curve = |series: &Vec<&Sample>| {
        let color = place(&kinds, &kind(series[0]));
        let whole = series[0].label();
        let without = || Sample { stepper: String::new(), ..series[0].clone() }.label();
        Curve {
            name: if crowded { without() } else { whole },
            points: series.iter().filter_map(|sample| point(sample)).collect(),
            mark: MARKS[marked(series[0]) % MARKS.len()],
            color: color + usize::from(color >= BLACK),
        }
    };
    let groups = if crowded { steppers.iter().map(Some).collect() } else { vec![None] };
    let numbered = |samples: &[&Sample]| -> Vec<usize> {
        let drawn = samples.iter().filter(|sample| point(sample).is_some());
        drawn.filter_map(|sample| of_scene().position(|other| std::ptr::eq(other, *sample))).collect()
    };
    let (mut panels, mut drawn) = (Vec::new(), Vec::new());
    for task in &tasks {
        for &stepper in &groups {
            let first = task.samples()[0];
            let title = format!("{}, {}D, {}", scene.replace('_', " "), first.dim, first.set);
            let title = stepper.map_or(title.clone(), |stepper| format!("{title}, {stepper}"));
            // What has no stepper is to be compared with each.
            let here = |s: &Sample| stepper.is_none_or(|stepper| s.stepper == *stepper || s.stepper.is_empty());
            let (all, front) = (task.series(), task.front());
            let shown = || all.iter().filter(|series| here(series[0]));
            drawn.extend(shown().map(|series| Series::Curve(numbered(series))));
            drawn.push(Series::Front(numbered(&front)));
            let mut curves: Vec<Curve> = shown().map(curve).collect();
            let front = front.into_iter().filter_map(point).collect();
            curves.push(Curve { name: "Pareto front".to_string(), points: front, mark: Mark::Dashed, color: BLACK });
            panels.push((title, curves));
        }
    }
    let axes = |title| Axes { title, x: "seconds", y: "L2 error", logarithmic: true };
    let sets = distinct(of_scene().map(|sample| sample.set.clone())).len();
    let titles: Vec<String> = panels.iter().map(|(title, _)| title.clone()).collect();
    let panels = panels.into_iter().zip(&titles).map(|((_, curves), title)| (axes(title), curves)).collect();
    let columns = match (crowded, sets) {
        (true, _) => groups.len(),
        (false, 1) => titles.len(),
        (false, sets) => sets,
    };
    grid::draw(path, columns.min(titles.len()), panels)?;
    Ok(fs::write(path, tags::tag(&fs::read_to_string(path)?, &drawn)?)?)
}

/// Time and error; an error of zero has no place on a logarithmic axis.
fn point(sample: &Sample) -> Option<(f64, f64)> {
    (sample.error_l2 > 0.0).then(|| (sample.seconds.total(), sample.error_l2))
}

fn distinct(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut all = Vec::new();
    names.for_each(|name| {
        if !all.contains(&name) {
            all.push(name);
        }
    });
    all
}
