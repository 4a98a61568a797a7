//! Which method is worth its time.

use super::sample::Sample;

/// The errors that a page answers for.
pub const TARGETS: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// All samples that do the same work: one scene, dimension and set. Never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Task<'a> {
    samples: Vec<&'a Sample>,
}

impl<'a> Task<'a> {
    pub(super) fn new(first: &'a Sample) -> Self {
        Self { samples: vec![first] }
    }

    pub(super) fn add(&mut self, sample: &'a Sample) {
        self.samples.push(sample);
    }

    /// The samples in the order they were added.
    pub fn samples(&self) -> &[&'a Sample] {
        &self.samples
    }

    /// The samples by series, each in the order they were added.
    pub fn series(&self) -> Vec<Vec<&'a Sample>> {
        let mut all: Vec<Vec<&Sample>> = Vec::new();
        for &sample in &self.samples {
            match all.iter_mut().find(|series| series[0].same_series(sample)) {
                Some(series) => series.push(sample),
                None => all.push(vec![sample]),
            }
        }
        all
    }

    /// The samples that no other beats in both error and total time, fastest first; see [`pareto_front`].
    pub fn front(&self) -> Vec<&'a Sample> {
        let points: Vec<(f64, f64)> = self.samples.iter().map(|s| (s.seconds.total(), s.error_l2)).collect();
        pareto_front(&points).into_iter().map(|i| self.samples[i]).collect()
    }

    /// The fastest sample whose L2 error is at most `target`, `None` where none is. Nothing is interpolated: what is named
    /// was run.
    pub fn cheapest(&self, target: f64) -> Option<&'a Sample> {
        let good = self.samples.iter().copied().filter(|sample| sample.error_l2 <= target);
        good.min_by(|a, b| a.seconds.total().total_cmp(&b.seconds.total()))
    }
}

/// The indices of the points (cost, error) that no other point beats: none costs at most as much with at most that error,
/// and less of one. By rising cost; of equal points the first; points with NaN never.
///
/// ```
/// let points = [(1.0, 0.5), (2.0, 0.6), (2.0, 0.1), (3.0, 0.1), (0.5, f64::NAN)];
/// assert_eq!(parops::report::pareto_front(&points), [0, 2]);
/// ```
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|&i| !points[i].0.is_nan() && !points[i].1.is_nan()).collect();
    order.sort_by(|&i, &j| points[i].0.total_cmp(&points[j].0).then(points[i].1.total_cmp(&points[j].1)));
    let mut least = f64::INFINITY;
    // The sort is stable, so of equal points the first comes first.
    order.retain(|&i| {
        let better = points[i].1 < least;
        least = least.min(points[i].1);
        better
    });
    order
}
