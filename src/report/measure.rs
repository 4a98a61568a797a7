//! A piece of work run several times.

use std::time::Instant;

use super::sample::Sample;
use super::stopwatch::{Seconds, Stopwatch};
use crate::error::{ReportError, Result};

/// Tells the most bytes in use at once since it was last called, beyond those in use then.
///
/// Counting takes an allocator of the caller's own; the example `work_precision` has one.
pub type PeakMeter = fn() -> usize;

/// How often a piece of work is run: `least` times, and on until `seconds` have gone by in all, `most` times at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    /// Fewest runs, at least 1.
    pub least: usize,
    /// Most runs, at least `least`.
    pub most: usize,
    /// Seconds after which no more are begun beyond the fewest.
    pub seconds: f64,
}

impl Default for Repeats {
    /// 3 to 25 runs, for 20 ms.
    fn default() -> Self {
        Self { least: 3, most: 25, seconds: 0.02 }
    }
}

/// Runs `work` several times on copies of `sample` and returns the last one with the medians of its phases and the largest
/// peak.
///
/// `work` times its phases by the stopwatch and writes the errors and what else it knows. It is the same work each time:
/// its randomness comes from a fixed seed. Memory is what `work` takes beyond what was in use before it.
///
/// # Errors
/// [`ReportError::Repeats`] unless 1 <= `least` <= `most`; the errors of `work`, unchanged.
pub fn measure(
    sample: Sample,
    repeats: Repeats,
    peak: Option<PeakMeter>,
    mut work: impl FnMut(&Stopwatch, &mut Sample) -> Result<()>,
) -> Result<Sample> {
    let Repeats { least, most, seconds } = repeats;
    if !(1..=most).contains(&least) {
        return Err(ReportError::Repeats { least, most }.into());
    }
    let (start, mut runs, mut last, mut bytes) = (Instant::now(), Vec::new(), sample.clone(), None);
    while runs.len() < least || (runs.len() < most && start.elapsed().as_secs_f64() < seconds) {
        last = sample.clone();
        let watch = Stopwatch::default();
        peak.map(|peak| peak());
        work(&watch, &mut last)?;
        bytes = bytes.max(peak.map(|peak| peak()));
        runs.push(watch.seconds());
    }
    Ok(Sample { seconds: Seconds::medians(&runs), peak_bytes: bytes, ..last })
}
