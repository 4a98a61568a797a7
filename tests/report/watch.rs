//! Phases, medians, repeats and the peak.

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

use parops::report::{Phase, Repeats, Sample, Seconds, Stopwatch, measure};
use parops::{Error, ErrorKind, ReportError};

fn spin(milliseconds: u64) {
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(milliseconds) {}
}

#[test]
fn inner_phase_takes_its_time_out_of_the_outer() {
    let watch = Stopwatch::default();
    let start = Instant::now();
    spin(2);
    let result = watch.time(Phase::Step, || {
        watch.time(Phase::Apply, || spin(20));
        spin(2);
        watch.time(Phase::Apply, || spin(20));
        7
    });
    let (elapsed, seconds) = (start.elapsed().as_secs_f64(), watch.seconds());
    assert_eq!(result, 7);
    assert!(seconds.apply >= 0.040 && seconds.step >= 0.002, "{seconds:?}");
    // The first 2 ms stand outside of all phases, and nothing counts twice.
    assert!(seconds.total() <= elapsed - 0.002, "{seconds:?} of {elapsed}");
    assert_eq!((seconds.neighbors, seconds.build), (0.0, 0.0));
}

#[test]
fn median_is_taken_phase_by_phase() {
    let run = |neighbors: f64, step: f64| Seconds { neighbors, step, ..Seconds::default() };
    let medians = Seconds::medians(&[run(3.0, 10.0), run(1.0, 30.0), run(2.0, 20.0)]);
    assert_eq!(medians, run(2.0, 20.0));
    assert_eq!(Seconds::medians(&[run(1.0, 4.0), run(2.0, 3.0)]), run(1.5, 3.5));
    assert_eq!(Seconds::medians(&[]), Seconds::default());
}

fn what() -> Sample {
    Sample::new("scene", 1, "lattice", "none", 0)
}

#[test]
fn work_is_repeated_within_its_numbers() {
    let runs = Cell::new(0);
    let count = |repeats: Repeats, work: fn()| {
        runs.set(0);
        let done = measure(what(), repeats, None, |watch, sample| {
            runs.set(runs.get() + 1);
            sample.steps = runs.get();
            watch.time(Phase::Build, work);
            Ok(())
        });
        done.map(|sample| (runs.get(), sample.steps, sample.peak_bytes))
    };
    // Too long a time to end before the most, too short a one to go beyond the fewest.
    assert_eq!(count(Repeats { least: 2, most: 5, seconds: 1e3 }, || {}), Ok((5, 5, None)));
    assert_eq!(count(Repeats { least: 3, most: 500, seconds: 1e-9 }, || spin(1)), Ok((3, 3, None)));
    for (least, most) in [(0, 3), (4, 3)] {
        let refused = count(Repeats { least, most, seconds: 1.0 }, || {}).unwrap_err();
        assert_eq!(*refused.kind(), ErrorKind::Report(ReportError::Repeats { least, most }));
        assert_eq!(runs.get(), 0);
    }
}

#[test]
fn error_of_the_work_comes_back_unchanged() {
    let failed = measure(what(), Repeats::default(), None, |_, _| Err(Error::user(7)));
    assert_eq!(failed.unwrap_err(), Error::user(7));
}

static METER: AtomicUsize = AtomicUsize::new(0);

/// What was added since the last call.
fn meter() -> usize {
    METER.swap(0, Relaxed)
}

#[test]
fn peak_is_the_largest_of_the_runs_and_nothing_before() {
    METER.store(1_000_000, Relaxed);
    let runs = Cell::new(0);
    let sample = measure(what(), Repeats { least: 3, most: 3, seconds: 0.0 }, Some(meter), |_, _| {
        METER.fetch_add([10, 30, 20][runs.get()], Relaxed);
        runs.set(runs.get() + 1);
        Ok(())
    });
    assert_eq!(sample.unwrap().peak_bytes, Some(30));
}
