//! The figure of a scene: error over time, a panel a dimension and set, the Pareto front marked.

use std::error::Error;
use std::path::Path;

use parops::report::{Sample, Table, Task};

use crate::figure::{Axes, Curve, Mark};
use crate::grid;

const MARKS: [Mark; 4] = [Mark::Circles, Mark::Triangles, Mark::Crosses, Mark::CirclesAlone];
/// The black of the palette, kept for the front.
const BLACK: usize = 4;

/// Draws all samples of a scene.
pub fn draw(path: &Path, table: &Table, scene: &str) -> Result<(), Box<dyn Error>> {
    let mut tasks: Vec<Task> = table.tasks().into_iter().filter(|task| task.samples()[0].scene == scene).collect();
    tasks.sort_by_key(|task| task.samples()[0].dim);
    let of_scene = || table.samples().iter().filter(|sample| sample.scene == scene);
    let methods = distinct(of_scene().map(|sample| sample.method.clone()));
    let kinds = distinct(of_scene().map(kind));
    let columns = distinct(of_scene().map(|sample| sample.set.clone())).len().min(tasks.len());
    let titles: Vec<String> = tasks.iter().map(|task| title(task.samples()[0])).collect();
    let panels = tasks.iter().zip(&titles).map(|(task, title)| {
        let axes = Axes { title, x: "seconds", y: "L2 error", logarithmic: true };
        let mut curves: Vec<Curve> = task
            .series()
            .iter()
            .map(|series| {
                let place = |names: &[String], name: &str| names.iter().position(|other| other == name).unwrap_or(0);
                let color = place(&kinds, &kind(series[0]));
                Curve {
                    name: series[0].label(),
                    points: series.iter().filter_map(|sample| point(sample)).collect(),
                    mark: MARKS[place(&methods, &series[0].method) % MARKS.len()],
                    color: color + usize::from(color >= BLACK),
                }
            })
            .collect();
        let front = task.front().into_iter().filter_map(point).collect();
        curves.push(Curve { name: "Pareto front".to_string(), points: front, mark: Mark::Dashed, color: BLACK });
        (axes, curves)
    });
    grid::draw(path, columns, panels.collect())
}

fn title(sample: &Sample) -> String {
    format!("{}, {}D, {}", sample.scene.replace('_', " "), sample.dim, sample.set)
}

/// What gives a series its color.
fn kind(sample: &Sample) -> String {
    format!("{} {} {}", sample.order, sample.stepper, sample.scalar)
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
