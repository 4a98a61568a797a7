//! What a scene works with.

use std::path::PathBuf;

use parops::report::{Repeats, Sample, Stopwatch, Table, measure};

use crate::counting;

/// The table so far, and what the scenes claim about it.
pub struct Bench {
    pub quick: bool,
    /// Whether every piece of work is run once, for its errors alone.
    once: bool,
    /// Where a scene may write files of its own.
    pub out: PathBuf,
    pub table: Table,
    /// Figures of a scene besides its own: scene and file.
    pub figures: Vec<(String, PathBuf)>,
    /// Claims: scene, whether it holds, and the sentence.
    pub claims: Vec<(String, bool, String)>,
}

impl Bench {
    pub fn new(quick: bool, once: bool, out: PathBuf) -> Self {
        Self { quick, once, out, table: Table::default(), figures: Vec::new(), claims: Vec::new() }
    }

    /// Runs a piece of work several times, adds the sample to the table and prints it.
    ///
    /// `work` times its phases by the stopwatch and fills in the errors and whatever else it knows.
    pub fn sample(
        &mut self,
        what: Sample,
        work: impl FnMut(&Stopwatch, &mut Sample) -> parops::Result<()>,
    ) -> parops::Result<Sample> {
        let repeats = match (self.once, self.quick) {
            (true, _) => Repeats { least: 1, most: 1, seconds: 0.0 },
            (_, true) => Repeats { least: 1, most: 3, seconds: 0.03 },
            // What takes half a second is run once more or not at all: its time does not hang on one interruption.
            _ => Repeats { least: 1, most: 15, seconds: 0.4 },
        };
        let sample = self.table.push(measure(what, repeats, Some(counting::peak), work)?)?.clone();
        let order = sample.observed_order.map_or("-".to_string(), |order| format!("{order:.2}"));
        println!(
            "{:<26} {}D {:<12} {:<22} {:>7} {:>7.1} {:>10.3e} {order:>6} {:>10.3e} s {:>11} B",
            sample.scene,
            sample.dim,
            sample.set,
            sample.label(),
            sample.n,
            sample.neighbors,
            sample.error_l2,
            sample.seconds.total(),
            sample.peak_bytes.unwrap_or(0)
        );
        Ok(sample)
    }

    /// States what the samples of a scene must show, next to its figure and in the output.
    pub fn claim(&mut self, scene: &str, holds: bool, text: String) {
        println!("{} {text}", if holds { "holds " } else { "FAILS " });
        self.claims.push((scene.to_string(), holds, text));
    }
}
