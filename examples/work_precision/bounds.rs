//! The stored errors that a run is held to.

use std::error::Error;
use std::fmt::Write;

use parops::report::{Sample, Table};

const STORED: &str = include_str!("bounds.csv");
const HEADER: &str = "mode,scene,dim,set,method,order,stepper,scalar,n,error_l2";
/// An error may be this many times the stored one, or the stored one this many times the error. Seeds are fixed: what is
/// left is rounding on another processor, and what has changed in the crate.
const FACTOR: f64 = 2.0;
/// Below this a relative error is rounding, which may be any smaller.
const ROUNDING: f64 = 1e-10;

/// The last, finest, sample of each series of a table, with the line it is stored as.
fn finest(table: &Table, mode: &str) -> Vec<(String, f64)> {
    let tasks = table.tasks();
    let last = tasks.iter().flat_map(|task| task.series()).filter_map(|series| series.last().copied());
    last.map(|sample| (key(sample, mode), sample.error_l2)).collect()
}

fn key(sample: &Sample, mode: &str) -> String {
    let Sample { scene, dim, set, method, order, stepper, scalar, n, .. } = sample;
    format!("{mode},{scene},{dim},{set},{method},{order},{stepper},{scalar},{n}")
}

/// The lines of a text stored of this mode for scenes of the table.
fn stored<'a>(text: &'a str, table: &'a Table, mode: &'a str) -> impl Iterator<Item = (&'a str, f64)> {
    let scenes = table.scenes();
    text.lines().skip(1).filter_map(|line| line.rsplit_once(',')).filter_map(move |(key, error)| {
        let mut cells = key.split(',');
        let here = cells.next() == Some(mode) && cells.next().is_some_and(|scene| scenes.contains(&scene));
        if here { Some((key, error.parse().ok()?)) } else { None }
    })
}

/// What differs from the stored errors: too large, too small, not stored, or stored and not run.
pub fn faults(table: &Table, quick: bool) -> Vec<String> {
    let mode = if quick { "quick" } else { "full" };
    let (now, bounds) = (finest(table, mode), stored(STORED, table, mode).collect::<Vec<_>>());
    let mut faults = Vec::new();
    for (key, error) in &now {
        match bounds.iter().find(|(stored, _)| stored == key) {
            Some((_, bound)) if *error <= FACTOR * bound.max(ROUNDING) && FACTOR * error.max(ROUNDING) >= *bound => {}
            Some((_, bound)) => faults.push(format!("{key}: the error is {error:e}, stored is {bound:e}")),
            None => faults.push(format!("{key}: no error is stored; --record stores it")),
        }
    }
    for (stored, _) in bounds {
        if now.iter().all(|(key, _)| key != stored) {
            faults.push(format!("{stored}: stored, but not run"));
        }
    }
    faults
}

/// Replaces the stored errors of the scenes of this table and mode, in the source of this example.
pub fn record(table: &Table, quick: bool) -> Result<(), Box<dyn Error>> {
    let mode = if quick { "quick" } else { "full" };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/work_precision/bounds.csv");
    // What another run has stored since this was built stays.
    let before = std::fs::read_to_string(path)?;
    let replaced: Vec<&str> = stored(&before, table, mode).map(|(key, _)| key).collect();
    let mut text = format!("{HEADER}\n");
    for line in before.lines().skip(1) {
        if line.rsplit_once(',').is_none_or(|(key, _)| !replaced.contains(&key)) {
            writeln!(text, "{line}")?;
        }
    }
    for (key, error) in finest(table, mode) {
        writeln!(text, "{key},{error:.2e}")?;
    }
    Ok(std::fs::write(path, text)?)
}
