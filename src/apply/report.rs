//! What is known about all rows of an operator together.

use super::histogram::Histogram;
use crate::error::Result;
use crate::operator::RowReport;

/// Number of rows a [`Report`] names.
const WORST: usize = 8;

/// What a build found: the extremes over all rows, how they are spread, and the worst rows.
///
/// Being in the rows themselves, it costs nothing to ask again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Report {
    /// Number of rows.
    pub rows: usize,
    /// Number of neighbors, summed over all rows.
    pub pairs: usize,
    /// Fewest neighbors of a row.
    pub fewest: usize,
    /// Most neighbors of a row.
    pub most: usize,
    /// Largest h/epsilon.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub h_over_epsilon: f64,
    /// Largest relative defect of the discrete moments.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub moment_defect: f64,
    /// Largest moment below the degree of the operator, see [`RowReport::lower_moment`]: where it is not zero, the
    /// error of PSE and SPH grows under refinement.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub lower_moment: f64,
    /// Largest sum of absolute weights.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub sum_abs: f64,
    /// Negative pair weights, summed over all rows.
    pub negative_weights: usize,
    /// Bound on the modulus of the eigenvalues of the operator: the largest over the rows.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub spectral_bound: f64,
    /// Rows that break a limit with the caller's leave.
    pub allowed: usize,
    /// Largest estimated condition number of a moment system; 0 where none was solved.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub condition: f64,
    /// Largest miss of a moment condition, in scaled units.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub residual: f64,
    /// Rows per solver, in the order of [`Rung`](crate::Rung).
    pub rungs: [usize; 5],
    /// The lowest convergence order of a row, empty rows apart; `None` where no row states one.
    pub order: Option<u32>,
    /// Rows of a widened support.
    pub grown: usize,
    /// Rows of a lower order than asked for.
    pub lowered: usize,
    /// Rows left without weights.
    pub empty: usize,
    /// Largest contrast of the diffusivities in a stencil, see [`RowReport::contrast`].
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub contrast: f64,
    /// Rows in which modes may grow, see [`RowReport::growing`].
    pub growing: usize,
    /// Rows per decade of the condition number.
    pub conditions: Histogram,
    /// Rows per decade of the residual.
    pub residuals: Histogram,
    /// Rows per decade of the sum of absolute weights.
    pub sums: Histogram,
    worst: [Option<RowReport>; WORST],
}

impl Report {
    /// At most 8 rows, the worst first: those that break a limit without leave, then empty rows, then those of the lowest
    /// order, then those that break a limit by most, then those with the largest moment defect, then condition number.
    pub fn worst_rows(&self) -> impl Iterator<Item = &RowReport> {
        self.worst.iter().flatten()
    }

    /// The first of [`worst_rows`](Self::worst_rows).
    pub fn worst(&self) -> Option<&RowReport> {
        self.worst_rows().next()
    }

    /// Names the targets anew, where they are some of a larger set.
    pub(crate) fn rename(&mut self, name: impl Fn(usize) -> usize) {
        self.worst.iter_mut().flatten().for_each(|row| row.target = name(row.target));
    }

    pub(super) fn add(&mut self, row: &RowReport) {
        self.fewest = if self.rows == 0 { row.neighbors } else { self.fewest.min(row.neighbors) };
        self.most = self.most.max(row.neighbors);
        self.rows += 1;
        self.pairs += row.neighbors;
        self.extremes([row.h_over_epsilon, row.moment_defect, row.lower_moment, row.sum_abs, row.spectral_bound]);
        self.negative_weights += row.negative_weights;
        self.allowed += usize::from(row.allowed);
        self.condition = larger(self.condition, row.condition);
        self.residual = larger(self.residual, row.residual);
        if let Some(rung) = row.rung {
            self.rungs[rung as usize] += 1;
            self.conditions.add(row.condition);
            self.residuals.add(row.residual);
            self.sums.add(row.sum_abs);
        }
        self.order = lower(self.order, row.order);
        self.grown += usize::from(row.grown > 0);
        self.lowered += usize::from(row.lowered > 0);
        self.empty += usize::from(row.empty);
        self.contrast = self.contrast.max(row.contrast);
        self.growing += usize::from(row.growing);
        self.rank(row);
    }

    /// Takes in the rows that follow.
    pub(super) fn merge(&mut self, next: &Self) {
        if next.rows == 0 {
            return;
        }
        self.fewest = if self.rows == 0 { next.fewest } else { self.fewest.min(next.fewest) };
        self.most = self.most.max(next.most);
        self.rows += next.rows;
        self.pairs += next.pairs;
        self.extremes([next.h_over_epsilon, next.moment_defect, next.lower_moment, next.sum_abs, next.spectral_bound]);
        self.negative_weights += next.negative_weights;
        self.allowed += next.allowed;
        self.condition = larger(self.condition, next.condition);
        self.residual = larger(self.residual, next.residual);
        for (rows, next) in self.rungs.iter_mut().zip(next.rungs) {
            *rows += next;
        }
        self.conditions.merge(&next.conditions);
        self.residuals.merge(&next.residuals);
        self.sums.merge(&next.sums);
        self.order = lower(self.order, next.order);
        self.grown += next.grown;
        self.lowered += next.lowered;
        self.empty += next.empty;
        self.contrast = self.contrast.max(next.contrast);
        self.growing += next.growing;
        next.worst_rows().for_each(|row| self.rank(row));
    }

    fn extremes(&mut self, others: [f64; 5]) {
        let own = [
            &mut self.h_over_epsilon,
            &mut self.moment_defect,
            &mut self.lower_moment,
            &mut self.sum_abs,
            &mut self.spectral_bound,
        ];
        own.into_iter().zip(others).for_each(|(own, other)| *own = larger(*own, other));
    }

    /// A breach without leave outranks one with leave, which outranks none; of equals the first row stays ahead.
    fn rank(&mut self, row: &RowReport) {
        let key = |row: &RowReport| {
            let refused = row.breach.is_some() && !row.allowed;
            let known = |figure: f64| if figure.is_nan() { f64::INFINITY } else { figure };
            (refused, row.empty, row.lowered, row.severity(), known(row.moment_defect), known(row.condition))
        };
        let ahead = |known: &Option<RowReport>| {
            known.is_none_or(|known| key(row).partial_cmp(&key(&known)) == Some(std::cmp::Ordering::Greater))
        };
        // Almost every row ends here.
        if !self.worst.last().is_some_and(ahead) {
            return;
        }
        if let Some(at) = self.worst.iter().position(ahead) {
            self.worst[at..].rotate_right(1);
            self.worst[at] = Some(*row);
        }
    }

    /// Refuses the build where a row breaks a limit without leave.
    pub(super) fn accept(&self) -> Result<()> {
        match self.worst() {
            Some(RowReport { breach: Some(breach), allowed: false, target, .. }) => Err(breach.refuse(*target)),
            _ => Ok(()),
        }
    }
}

/// The larger of two figures, NaN being the largest of all: a method that knows nothing must not look perfect.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The lower of two orders, where one is stated.
fn lower(a: Option<u32>, b: Option<u32>) -> Option<u32> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
