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

/// All a run of moving particles needs beside its scene to go on with the same bits.
///
/// Coordinates stand particle by particle, D to each. The places of the last search of the neighbors are among it: they
/// decide the order of every sum.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SavedParticles<E, St> {
    /// The time.
    pub t: f64,
    /// Steps done.
    pub step: u64,
    /// Substeps beyond the first, summed over the run.
    pub retries: u64,
    /// Remeshings so far.
    pub remeshings: u64,
    /// Turns to be replaced so far, see [`Trigger`](super::Trigger).
    pub turns: u64,
    /// The mass of every field at the start.
    pub start: Vec<f64>,
    /// Strength dropped so far, field by field.
    pub dropped: Vec<f64>,
    /// The same with absolute values.
    pub dropped_size: Vec<f64>,
    /// The coordinates of all particles.
    pub points: Vec<f64>,
    /// The strengths.
    pub strengths: Vec<E>,
    /// The volumes.
    pub volumes: Vec<f64>,
    /// How often the neighbors were searched anew.
    pub searches: u64,
    /// The coordinates of all particles when they were; empty without diffusion.
    pub searched_at: Vec<f64>,
    /// The search after which growth was estimated last.
    pub surveyed: u64,
    /// The growth rate found then, in 1/time; `None` where nothing was estimated or settled.
    pub growth: Option<f64>,
    /// The stepper.
    pub stepper: St,
}
