//! The promises of a method, broken.

use std::fmt;

use crate::error::Error;
use crate::multi_index::MultiIndex;

/// The promise a method breaks, with the numbers; `p` is the target, `q` the neighbor, or none for the diagonal.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MethodFault<const D: usize> {
    /// The method has no weights for a row, no report, no cutoff, or no scratch.
    Refused {
        /// Why, and for which target.
        error: Error,
    },
    /// A cutoff that is negative, NaN, or beyond the reach of the provider.
    Cutoff {
        /// Target.
        p: usize,
        /// The cutoff.
        cutoff: f64,
        /// The reach.
        reach: f64,
    },
    /// A weight, or the diagonal, was not written.
    Unwritten {
        /// Target.
        p: usize,
        /// Neighbor.
        q: Option<usize>,
    },
    /// A weight, or the diagonal, is not finite.
    NotFinite {
        /// Target.
        p: usize,
        /// Neighbor.
        q: Option<usize>,
        /// The value.
        value: f64,
    },
    /// The row differs when it is asked for again with scratch of its own.
    Unsteady {
        /// Target.
        p: usize,
    },
    /// The row, or its report, depends on the rows made before with the same scratch.
    Scratch {
        /// Target.
        p: usize,
    },
    /// The report is that of another row.
    Named {
        /// Target.
        p: usize,
        /// The target reported.
        target: usize,
        /// The number of neighbors reported.
        neighbors: usize,
        /// The number of neighbors there are.
        expected: usize,
    },
    /// The sum of absolute weights reported is not theirs.
    SumAbs {
        /// Target.
        p: usize,
        /// The sum reported.
        found: f64,
        /// The sum.
        expected: f64,
    },
    /// h/epsilon, the moment defect or the spectral bound is negative or NaN.
    Figure {
        /// Target.
        p: usize,
        /// The figure.
        figure: f64,
    },
    /// A breach that exceeds no limit, or leave for none.
    Breach {
        /// Target.
        p: usize,
        /// How many times the limit was reached; 0 without a breach.
        severity: f64,
    },
    /// With the signs of all images turned, the weight is not turned, or the diagonal does not take up the difference.
    Sign {
        /// Target.
        p: usize,
        /// Neighbor.
        q: Option<usize>,
        /// The value with the signs as they are.
        weight: f64,
        /// The value with all of them turned.
        turned: f64,
    },
    /// No spectral bound of any row reaches the mean of the eigenvalues.
    SpectralBound {
        /// The largest bound.
        bound: f64,
        /// |tr A| / N.
        mean: f64,
    },
    /// The row is not exact for a monomial.
    Moment {
        /// Target.
        p: usize,
        /// Output.
        output: usize,
        /// The exponents of the monomial.
        alpha: MultiIndex<D>,
        /// What the row gives.
        found: f64,
        /// What the operator gives.
        required: f64,
        /// How far they may differ.
        tolerance: f64,
    },
}

impl<const D: usize> From<Error> for MethodFault<D> {
    fn from(error: Error) -> Self {
        Self::Refused { error }
    }
}

impl<const D: usize> fmt::Display for MethodFault<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entry = |q: &Option<usize>| q.map_or("the diagonal".to_string(), |q| format!("the weight of neighbor {q}"));
        match self {
            Self::Refused { error } => write!(f, "a row was refused: {error}"),
            Self::Cutoff { p, cutoff, reach } => {
                write!(f, "target {p}: cutoff {cutoff} is outside 0 to the reach {reach}")
            }
            Self::Unwritten { p, q } => write!(f, "target {p}: {} is not written", entry(q)),
            Self::NotFinite { p, q, value } => write!(f, "target {p}: {} is {value}", entry(q)),
            Self::Unsteady { p } => write!(f, "target {p}: the row differs when asked for again"),
            Self::Scratch { p } => write!(f, "target {p}: the row depends on the rows before it"),
            Self::Named { p, target, neighbors, expected } => {
                write!(f, "target {p} with {expected} neighbors is reported as {target} with {neighbors}")
            }
            Self::SumAbs { p, found, expected } => {
                write!(f, "target {p}: the sum of absolute weights is {expected}, reported {found}")
            }
            Self::Figure { p, figure } => write!(f, "target {p}: a figure of the report is {figure}"),
            Self::Breach { p, severity } => write!(f, "target {p}: breach and leave do not fit severity {severity}"),
            Self::Sign { p, q, weight, turned } => {
                write!(f, "target {p}: {} is {weight}, and {turned} with the signs of all images turned", entry(q))
            }
            Self::SpectralBound { bound, mean } => {
                write!(f, "the spectral bound {bound} is below the mean {mean} of the eigenvalues")
            }
            Self::Moment { p, output, alpha, found, required, tolerance } => write!(
                f,
                "target {p}, output {output}: (x - x_p)^{alpha} gives {found}, not {required} to {tolerance:e}"
            ),
        }
    }
}

impl<const D: usize> std::error::Error for MethodFault<D> {}
