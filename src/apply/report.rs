//! What is known about all rows of an operator together.

use crate::error::Result;
use crate::operator::RowReport;

/// What a build found: the extremes over all rows and the worst row.
///
/// Being in the rows themselves, it costs nothing to ask again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    pub h_over_epsilon: f64,
    /// Largest relative defect of the discrete moments.
    pub moment_defect: f64,
    /// Largest moment below the degree of the operator, see [`RowReport::lower_moment`]: where it is not zero, the
    /// error of PSE and SPH grows under refinement.
    pub lower_moment: f64,
    /// Largest sum of absolute weights.
    pub sum_abs: f64,
    /// Negative pair weights, summed over all rows.
    pub negative_weights: usize,
    /// Bound on the modulus of the eigenvalues of the operator: the largest over the rows.
    pub spectral_bound: f64,
    /// Rows that break a limit with the caller's leave.
    pub allowed: usize,
    /// Largest estimated condition number of a moment system; 0 where none was solved.
    pub condition: f64,
    /// Largest miss of a moment condition, in scaled units.
    pub residual: f64,
    /// Rows per solver, in the order of [`Rung`](crate::Rung).
    pub rungs: [usize; 5],
    /// The row that breaks its limits worst, or, where none does, the row with the largest moment defect, then condition.
    pub worst: Option<RowReport>,
}

impl Report {
    pub(super) fn add(&mut self, row: &RowReport) {
        self.fewest = if self.rows == 0 { row.neighbors } else { self.fewest.min(row.neighbors) };
        self.most = self.most.max(row.neighbors);
        self.rows += 1;
        self.pairs += row.neighbors;
        self.extremes(row.h_over_epsilon, row.moment_defect, row.sum_abs, row.spectral_bound);
        self.lower_moment = worse(self.lower_moment, row.lower_moment);
        self.negative_weights += row.negative_weights;
        self.allowed += usize::from(row.allowed);
        self.condition = self.condition.max(row.condition);
        self.residual = self.residual.max(row.residual);
        if let Some(rung) = row.rung {
            self.rungs[rung as usize] += 1;
        }
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
        self.extremes(next.h_over_epsilon, next.moment_defect, next.sum_abs, next.spectral_bound);
        self.lower_moment = worse(self.lower_moment, next.lower_moment);
        self.negative_weights += next.negative_weights;
        self.allowed += next.allowed;
        self.condition = self.condition.max(next.condition);
        self.residual = self.residual.max(next.residual);
        for (rows, next) in self.rungs.iter_mut().zip(next.rungs) {
            *rows += next;
        }
        if let Some(worst) = &next.worst {
            self.rank(worst);
        }
    }

    fn extremes(&mut self, h_over_epsilon: f64, moment_defect: f64, sum_abs: f64, spectral_bound: f64) {
        self.h_over_epsilon = worse(self.h_over_epsilon, h_over_epsilon);
        self.moment_defect = worse(self.moment_defect, moment_defect);
        self.sum_abs = worse(self.sum_abs, sum_abs);
        self.spectral_bound = worse(self.spectral_bound, spectral_bound);
    }

    /// A breach without leave outranks one with leave, which outranks none; of equals the first row stays.
    fn rank(&mut self, row: &RowReport) {
        let key = |row: &RowReport| {
            let refused = row.breach.is_some() && !row.allowed;
            let defect = if row.moment_defect.is_nan() { f64::INFINITY } else { row.moment_defect };
            (refused, row.severity(), defect, row.condition)
        };
        let worse = match &self.worst {
            None => true,
            Some(worst) => key(row).partial_cmp(&key(worst)) == Some(std::cmp::Ordering::Greater),
        };
        if worse {
            self.worst = Some(*row);
        }
    }

    /// Refuses the build where a row breaks a limit without leave.
    pub(super) fn accept(&self) -> Result<()> {
        match &self.worst {
            Some(RowReport { breach: Some(breach), allowed: false, target, .. }) => Err(breach.refuse(*target)),
            _ => Ok(()),
        }
    }
}

/// The larger of two figures, NaN being the largest of all: a method that knows nothing must not look perfect.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}
