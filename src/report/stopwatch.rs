//! Where the time goes.

use std::cell::Cell;
use std::time::Instant;

/// What is being timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Finding neighbors.
    Neighbors,
    /// Making the operator: kernels, rows, matrices, checks.
    Build,
    /// Applying it to fields.
    Apply,
    /// Stepping in time, or solving, without the applications timed as such.
    Step,
}

/// Seconds of each phase; 0 of one that was not timed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// In [`Phase::Neighbors`].
    pub neighbors: f64,
    /// In [`Phase::Build`].
    pub build: f64,
    /// In [`Phase::Apply`].
    pub apply: f64,
    /// In [`Phase::Step`].
    pub step: f64,
}

impl Seconds {
    /// Their sum.
    pub fn total(&self) -> f64 {
        self.neighbors + self.build + self.apply + self.step
    }

    /// The median of each phase: the middle one of the runs, the mean of the two middle ones of an even number; zero
    /// without runs.
    pub fn medians(runs: &[Self]) -> Self {
        let median = |of: fn(&Self) -> f64| {
            let mut values: Vec<f64> = runs.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            let middle = values.len() / 2;
            match values[..] {
                [] => 0.0,
                _ if values.len().is_multiple_of(2) => 0.5 * (values[middle - 1] + values[middle]),
                _ => values[middle],
            }
        };
        Self {
            neighbors: median(|run| run.neighbors),
            build: median(|run| run.build),
            apply: median(|run| run.apply),
            step: median(|run| run.step),
        }
    }

    fn of(&mut self, phase: Phase) -> &mut f64 {
        match phase {
            Phase::Neighbors => &mut self.neighbors,
            Phase::Build => &mut self.build,
            Phase::Apply => &mut self.apply,
            Phase::Step => &mut self.step,
        }
    }
}

/// A stopwatch of phases. A phase within another takes its time out of the outer one, so nothing counts twice, and what
/// stands outside of all phases counts nowhere.
///
/// ```
/// use parops::report::{Phase, Stopwatch};
/// let watch = Stopwatch::default();
/// let sum = watch.time(Phase::Step, || (0..100).map(|i| watch.time(Phase::Apply, || i)).sum::<u64>());
/// assert_eq!(sum, 4950);
/// assert!(watch.seconds().apply > 0.0 && watch.seconds().step > 0.0 && watch.seconds().build == 0.0);
/// ```
#[derive(Debug, Default)]
pub struct Stopwatch {
    /// The phase that runs, and since when.
    running: Cell<Option<(Phase, Instant)>>,
    seconds: Cell<Seconds>,
}

impl Stopwatch {
    /// Runs `work` and counts its time towards the phase.
    pub fn time<R>(&self, phase: Phase, work: impl FnOnce() -> R) -> R {
        let outer = self.switch(Some(phase));
        let result = work();
        self.switch(outer);
        result
    }

    /// The seconds of each phase so far; of one that still runs, those up to its last inner phase.
    pub fn seconds(&self) -> Seconds {
        self.seconds.get()
    }

    /// Credits the phase that runs, starts another, and returns the one before.
    fn switch(&self, next: Option<Phase>) -> Option<Phase> {
        let now = Instant::now();
        let before = self.running.replace(next.map(|phase| (phase, now)));
        before.map(|(phase, since)| {
            let mut seconds = self.seconds.get();
            *seconds.of(phase) += now.duration_since(since).as_secs_f64();
            self.seconds.set(seconds);
            phase
        })
    }
}
