//! What a scene works with.

use std::path::PathBuf;
use std::time::Instant;

use parops::report::{Repeats, Sample, Seconds, Stopwatch, Table, measure};

use crate::counting;

/// How often a piece of work is run: at least three times, and on until these seconds have gone by, so many times at most;
/// once where its first run takes longer than `long`.
struct Runs {
    most: usize,
    seconds: f64,
    long: f64,
}

/// The fewest runs of what is not long: the median of three is none that was interrupted.
const FEWEST: usize = 3;

/// The table so far, and what the scenes claim about it.
pub struct Bench {
    pub quick: bool,
    runs: Runs,
    /// Samples timed once.
    once: usize,
    /// Where a scene may write files of its own.
    pub out: PathBuf,
    pub table: Table,
    /// Figures of a scene besides its own: scene and file.
    pub figures: Vec<(String, PathBuf)>,
    /// Sentences about a scene.
    pub notes: Vec<(String, String)>,
    /// Claims: scene, whether it holds, and the sentence.
    pub claims: Vec<(String, bool, String)>,
}

impl Bench {
    /// `once` runs every piece of work once, for its errors alone.
    pub fn new(quick: bool, once: bool, out: PathBuf) -> Self {
        let runs = match (once, quick) {
            (true, _) => Runs { most: 1, seconds: 0.0, long: 0.0 },
            (_, true) => Runs { most: FEWEST, seconds: 0.0, long: 0.02 },
            _ => Runs { most: 15, seconds: 0.1, long: 0.2 },
        };
        let (table, once) = (Table::default(), 0);
        Self { quick, runs, once, out, table, figures: Vec::new(), notes: Vec::new(), claims: Vec::new() }
    }

    /// Runs a piece of work several times, adds the sample to the table and prints it.
    ///
    /// `work` times its phases by the stopwatch and fills in the errors and whatever else it knows.
    pub fn sample(
        &mut self,
        what: Sample,
        mut work: impl FnMut(&Stopwatch, &mut Sample) -> parops::Result<()>,
    ) -> parops::Result<Sample> {
        let once = Repeats { least: 1, most: 1, seconds: 0.0 };
        let start = Instant::now();
        let mut last = measure(what.clone(), once, Some(counting::peak), &mut work)?;
        let mut seconds = vec![last.seconds];
        let fewest = if last.seconds.total() > self.runs.long { 1 } else { FEWEST.min(self.runs.most) };
        let early = || start.elapsed().as_secs_f64() < self.runs.seconds;
        while seconds.len() < fewest || (seconds.len() < self.runs.most && early()) {
            let peak = last.peak_bytes;
            last = measure(what.clone(), once, Some(counting::peak), &mut work)?;
            last.peak_bytes = last.peak_bytes.max(peak);
            seconds.push(last.seconds);
        }
        self.once += usize::from(seconds.len() == 1);
        let sample = self.table.push(Sample { seconds: Seconds::medians(&seconds), ..last })?.clone();
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

    /// How samples were timed, and how many of them once.
    pub fn timing(&self) -> String {
        let Runs { most, seconds, long } = self.runs;
        let (once, all) = (self.once, self.table.samples().len());
        let runs =
            if most > FEWEST { format!("{FEWEST} to {most} runs, for {seconds} s") } else { format!("{FEWEST} runs") };
        match most {
            1 => "one run a sample".to_string(),
            _ => format!("medians of {runs}; one run where it takes over {long} s, as of {once} of {all} samples"),
        }
    }

    /// Says something about a scene, next to its figure.
    pub fn note(&mut self, scene: &str, text: &str) {
        self.notes.push((scene.to_string(), text.to_string()));
    }

    /// States what the samples of a scene must show, next to its figure and in the output.
    pub fn claim(&mut self, scene: &str, holds: bool, text: String) {
        println!("{} {text}", if holds { "holds " } else { "FAILS " });
        self.claims.push((scene.to_string(), holds, text));
    }
}
