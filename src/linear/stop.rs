//! What iterations have in common: the systems they take, when they end, and what they report.

use super::ilu::{Ilu0, check_length};
use crate::apply::Apply;
use crate::error::{ApplyError, Error, LinearError, Result};

/// What a solve of A x = b did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SolveReport {
    /// Products with A, those for the final residual not counted; steps of refinement where A was factored.
    pub iterations: usize,
    /// The relative residual |b - A x|_2 / |b|_2, computed from x itself; 0 for b = 0.
    pub residual: f64,
}

/// When an iteration ends: at a residual, or after so many products.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub most: usize,
    pub tolerance: f64,
}

impl Stop {
    /// At most 3000 products, relative residual 1e-13.
    pub const DEFAULT: Self = Self { most: 3000, tolerance: 1e-13 };

    /// With this relative residual to be reached.
    pub fn at(self, tolerance: f64) -> Result<Self> {
        if tolerance > 0.0 && tolerance < 1.0 {
            Ok(Self { tolerance, ..self })
        } else {
            Err(LinearError::Setting { value: tolerance, low: 0.0, high: 1.0 }.into())
        }
    }

    /// Refuses a report above the tolerance.
    pub fn accept(self, report: SolveReport) -> Result<SolveReport> {
        let (SolveReport { iterations, residual }, tolerance) = (report, self.tolerance);
        if residual <= tolerance {
            Ok(report)
        } else {
            Err(LinearError::NotConverged { iterations, residual, tolerance }.into())
        }
    }
}

/// Refuses a system whose shapes do not fit, or whose right-hand side is not finite.
pub(super) fn check_system(
    a: &(impl Apply<f64> + ?Sized),
    preconditioner: Option<&Ilu0>,
    b: &[f64],
    x: &[f64],
) -> Result<()> {
    let (rows, columns) = (a.targets(), a.sources());
    if rows != columns {
        return Err(LinearError::NotSquare { rows, columns }.into());
    }
    check_length(preconditioner.map_or(rows, Ilu0::rows), rows)?;
    check_length(b.len(), rows)?;
    check_length(x.len(), rows)?;
    check_right(b)
}

/// Refuses a right-hand side that is not finite.
pub(super) fn check_right(b: &[f64]) -> Result<()> {
    match b.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((p, &value)) => Err(Error::from(LinearError::Value { value }).at(p)),
        None => Ok(()),
    }
}

/// Refuses a solution that is not finite.
pub(super) fn check_solution(x: &[f64]) -> Result<()> {
    match x.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((p, &value)) => Err(Error::from(ApplyError::Overflow { value }).at(p)),
        None => Ok(()),
    }
}
