//! The stored errors that a run is held to.

use std::collections::{HashMap, HashSet};
use std::error::Error;

use parops::report::{Sample, Table};

const STORED: &str = include_str!("bounds.csv");
const HEADER: &str = "mode,scene,dim,set,method,order,stepper,scalar,n,place,error_l2,error_linf";
/// An error may be this many times the stored one, or the stored one this many times the error. Seeds are fixed: what is
/// left is rounding on another processor, and what has changed in the crate.
const FACTOR: f64 = 2.0;
/// Below this a relative error is rounding, which may be any smaller.
const ROUNDING: f64 = 1e-13;

/// The errors of a sample in L2 and L-inf.
type Errors = [f64; 2];

/// Every sample of a table by what its errors are stored under: what it is, and its place in its series.
fn errors(table: &Table, mode: &str) -> Vec<(String, Errors)> {
    let tasks = table.tasks();
    let series = tasks.iter().flat_map(|task| task.series());
    let placed = series.flat_map(|series| series.into_iter().enumerate());
    placed.map(|(place, sample)| (key(sample, mode, place), [sample.error_l2, sample.error_linf])).collect()
}

fn key(sample: &Sample, mode: &str, place: usize) -> String {
    let Sample { scene, dim, set, method, order, stepper, scalar, n, .. } = sample;
    format!("{mode},{scene},{dim},{set},{method},{order},{stepper},{scalar},{n},{place}")
}

/// A stored line: its key and its errors.
fn split(line: &str) -> Option<(&str, Errors)> {
    let (rest, largest) = line.rsplit_once(',')?;
    let (key, mean) = rest.rsplit_once(',')?;
    Some((key, [mean.parse().ok()?, largest.parse().ok()?]))
}

/// The lines of a text stored of this mode for scenes of the table.
fn stored<'a>(text: &'a str, table: &'a Table, mode: &'a str) -> impl Iterator<Item = (&'a str, Errors)> {
    let scenes = table.scenes();
    text.lines().skip(1).filter_map(split).filter(move |(key, _)| {
        let mut cells = key.split(',');
        cells.next() == Some(mode) && cells.next().is_some_and(|scene| scenes.contains(&scene))
    })
}

/// What differs from the stored errors: too large, too small, not stored, or stored and not run.
pub fn faults(table: &Table, quick: bool) -> Vec<String> {
    let mode = if quick { "quick" } else { "full" };
    let now = errors(table, mode);
    let bounds: HashMap<&str, Errors> = stored(STORED, table, mode).collect();
    let near = |error: f64, bound: f64| error <= FACTOR * bound.max(ROUNDING) && FACTOR * error.max(ROUNDING) >= bound;
    let mut faults = Vec::new();
    for (key, errors) in &now {
        match bounds.get(key.as_str()) {
            Some(bounds) if errors.iter().zip(bounds).all(|(&error, &bound)| near(error, bound)) => {}
            Some(bounds) => faults.push(format!("{key}: the errors are {errors:?}, stored are {bounds:?}")),
            None => faults.push(format!("{key}: no errors are stored; --record stores them")),
        }
    }
    let run: HashSet<&str> = now.iter().map(|(key, _)| key.as_str()).collect();
    let gone = stored(STORED, table, mode).filter(|(key, _)| !run.contains(key));
    faults.extend(gone.map(|(key, _)| format!("{key}: stored, but not run")));
    faults
}

/// Stores the errors of this table and mode in the source of this example: lines of its scenes keep their places.
pub fn record(table: &Table, quick: bool) -> Result<(), Box<dyn Error>> {
    let mode = if quick { "quick" } else { "full" };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/work_precision/bounds.csv");
    let line = |key: &str, [mean, largest]: Errors| format!("{key},{mean:.2e},{largest:.2e}");
    let now = errors(table, mode);
    let mut left: HashMap<&str, Errors> = now.iter().map(|(key, errors)| (key.as_str(), *errors)).collect();
    // What another run has stored since this was built stays.
    let before = std::fs::read_to_string(path)?;
    let replaced: HashSet<&str> = stored(&before, table, mode).map(|(key, _)| key).collect();
    let mut lines = vec![HEADER.to_string()];
    for old in before.lines().skip(1) {
        match split(old) {
            Some((key, _)) if replaced.contains(key) => lines.extend(left.remove(key).map(|errors| line(key, errors))),
            _ => lines.push(old.to_string()),
        }
    }
    let new = now.iter().filter(|(key, _)| left.contains_key(key.as_str()));
    lines.extend(new.map(|(key, errors)| line(key, *errors)));
    Ok(std::fs::write(path, lines.join("\n") + "\n")?)
}
