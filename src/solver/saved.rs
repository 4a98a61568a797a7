//! A run put aside and taken up again.

/// All a run needs beside its scene to go on with the same bits: time, steps done, masses at the start, the field, and the
/// stepper with what it remembers of earlier steps.
///
/// With the feature `serde` it can be written to and read from any format that keeps `f64` values exactly.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SavedRun<E, St> {
    /// The time.
    pub t: f64,
    /// Steps done.
    pub step: u64,
    /// Substeps beyond the first, summed over the run.
    pub retries: u64,
    /// The mass of every field at the start; empty before the first step.
    pub start: Vec<f64>,
    /// The field.
    pub u: Vec<E>,
    /// The stepper.
    pub stepper: St,
}
