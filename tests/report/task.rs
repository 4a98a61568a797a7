//! The Pareto front and the cheapest method, against definitions tried one by one.

use parops::report::{Sample, Seconds, Table, pareto_front};
use proptest::prelude::*;

fn beats(a: (f64, f64), b: (f64, f64)) -> bool {
    a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1)
}

proptest! {
    // Few distinct values, so that ties are frequent.
    #[test]
    fn front_holds_what_nothing_beats_once(points in prop::collection::vec((0_u8..6, 0_u8..6), 0..12)) {
        let points: Vec<(f64, f64)> = points.into_iter().map(|(a, b)| (f64::from(a), f64::from(b))).collect();
        let front = pareto_front(&points);
        let expected: Vec<usize> = (0..points.len())
            .filter(|&i| points.iter().all(|&other| !beats(other, points[i])) && !points[..i].contains(&points[i]))
            .collect();
        let mut sorted = front.clone();
        sorted.sort_unstable();
        prop_assert_eq!(sorted, expected);
        prop_assert!(front.windows(2).all(|pair| points[pair[0]].0 < points[pair[1]].0));
    }
}

#[test]
fn front_leaves_out_what_is_not_a_number() {
    assert_eq!(pareto_front(&[(f64::NAN, 0.0), (1.0, f64::NAN), (f64::INFINITY, 1.0), (2.0, 3.0)]), [3, 2]);
}

fn sample(set: &str, method: &str, error_l2: f64, step: f64) -> Sample {
    Sample { error_l2, seconds: Seconds { step, ..Seconds::default() }, ..Sample::new("scene", 1, set, method, 2) }
}

#[test]
fn cheapest_is_the_fastest_that_reached_the_error() {
    let mut table = Table::default();
    for (method, error, time) in [("a", 1e-3, 1.0), ("b", 1e-4, 4.0), ("c", 1e-5, 3.0), ("d", 1e-1, 0.1)] {
        table.push(sample("lattice", method, error, time)).unwrap();
    }
    table.push(sample("jittered", "e", 1e-9, 1e-3)).unwrap();
    let tasks = table.tasks();
    assert_eq!(tasks.len(), 2);
    let cheapest = |target| tasks[0].cheapest(target).map(|best| best.method.as_str());
    assert_eq!([1e-1, 1e-2, 1e-3, 1e-4, 1e-5].map(cheapest), [Some("d"), Some("a"), Some("a"), Some("c"), Some("c")]);
    assert_eq!(cheapest(1e-6), None);
    assert_eq!(tasks[0].front().iter().map(|s| s.method.as_str()).collect::<Vec<_>>(), ["d", "a", "c"]);
    assert_eq!(tasks[1].samples().len(), 1);
}

#[test]
fn series_keep_methods_apart_and_order() {
    let mut table = Table::default();
    for (method, error) in [("a", 0.3), ("b", 0.2), ("a", 0.1)] {
        table.push(sample("lattice", method, error, 1.0)).unwrap();
    }
    let tasks = table.tasks();
    let errors: Vec<Vec<f64>> =
        tasks[0].series().iter().map(|series| series.iter().map(|sample| sample.error_l2).collect()).collect();
    assert_eq!(errors, [vec![0.3, 0.1], vec![0.2]]);
}
