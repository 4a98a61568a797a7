//! What is known about one row, and the limits it may break.

use super::expression::Outputs;
use crate::error::{Error, OperatorError};
use crate::moment::Rung;
use crate::stencil::Stencil;

/// What is known about one row.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RowReport {
    /// The target.
    pub target: usize,
    /// Number of neighbors n.
    pub neighbors: usize,
    /// h/epsilon, with h = V^(1/D).
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub h_over_epsilon: f64,
    /// Relative defect of the discrete moments that are checked.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub moment_defect: f64,
    /// The largest moment M_alpha with 0 < |alpha| < m, relative to the required ones: zero on lattices, and not
    /// checked. It adds M_alpha D^alpha f / epsilon^(m - |alpha|) to the result, which grows under refinement.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub lower_moment: f64,
    /// Number of moment conditions l that were solved for; 0 where none were.
    pub conditions: usize,
    /// Their rank on this stencil.
    pub rank: usize,
    /// Estimated condition number of the windowed, scaled monomials; 0 where no system was solved.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub condition: f64,
    /// The largest miss of a moment condition, in scaled units.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub residual: f64,
    /// Which solver found the weights.
    pub rung: Option<Rung>,
    /// The convergence order delivered; `None` where the method proves none.
    pub order: Option<u32>,
    /// By how much that is below the order asked for.
    pub lowered: u32,
    /// How many times the support was widened by [`GROWTH`](crate::GROWTH).
    pub grown: u32,
    /// Whether the row was left without weights because none could be certified.
    pub empty: bool,
    /// |d_p| + sum_q |w_pq|, the largest over the outputs: the gain of noise, in units of the operator.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub sum_abs: f64,
    /// Pairs whose weight is negative before the sign of an image, counted for every output; for a Laplacian each costs the
    /// maximum principle.
    pub negative_weights: usize,
    /// The bound this row sets on the modulus of the eigenvalues of the operator, in units of the operator.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub spectral_bound: f64,
    /// Largest over smallest diffusivity of the stencil, see [`DivGrad`](crate::DivGrad), or trace of the diffusion tensor,
    /// see [`DivTensorGrad`](crate::DivTensorGrad); 1 where there is none, infinite beside an insulator.
    #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
    pub contrast: f64,
    /// Whether modes may grow: [`Mean::Arithmetic`](crate::Mean) across a contrast above 10, at an order above 2 and with
    /// weights of both signs.
    pub growing: bool,
    /// The limit this row breaks, if any.
    pub breach: Option<Breach>,
    /// Whether the caller allowed this row to break it.
    pub allowed: bool,
}

impl RowReport {
    /// A report of a row without defects; a method fills in what it knows.
    ///
    /// `sum_abs` and the general bound 2 `sum_abs` on the eigenvalues (Gershgorin) are taken from the weights.
    pub fn of<const D: usize, S: Outputs>(row: &Stencil<D>, w: &[S], diagonal: &S) -> Self {
        let gain =
            |k: usize| w.iter().fold(diagonal.as_slice()[k].abs(), |sum, weight| sum + weight.as_slice()[k].abs());
        let sum_abs = (0..S::K).map(gain).fold(0.0, f64::max);
        Self {
            target: row.target(),
            neighbors: row.len(),
            h_over_epsilon: 0.0,
            moment_defect: 0.0,
            lower_moment: 0.0,
            conditions: 0,
            rank: 0,
            condition: 0.0,
            residual: 0.0,
            rung: None,
            order: None,
            lowered: 0,
            grown: 0,
            empty: false,
            sum_abs,
            negative_weights: 0,
            spectral_bound: 2.0 * sum_abs,
            contrast: 1.0,
            growing: false,
            breach: None,
            allowed: false,
        }
    }

    /// How badly the row breaks its limits: above 1 where it does, otherwise 0.
    pub fn severity(&self) -> f64 {
        self.breach.map_or(0.0, |breach| breach.severity())
    }
}

/// A limit that a row breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Breach {
    /// h/epsilon is above what the kernel bears.
    Overlap {
        /// h/epsilon.
        #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
        h_over_epsilon: f64,
        /// The largest legal value.
        #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
        limit: f64,
    },
    /// The discrete moments miss their conditions.
    Moment {
        /// The relative defect.
        #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
        defect: f64,
        /// The largest legal value.
        #[cfg_attr(feature = "serde", serde(with = "crate::scalar::figure"))]
        limit: f64,
    },
}

impl Breach {
    /// How many times the limit was reached; infinite for NaN.
    pub fn severity(&self) -> f64 {
        let ratio = match *self {
            Self::Overlap { h_over_epsilon, limit } => h_over_epsilon / limit,
            Self::Moment { defect, limit } => defect / limit,
        };
        if ratio.is_nan() { f64::INFINITY } else { ratio }
    }

    /// The error a build fails with when this breach is not allowed.
    pub fn refuse(&self, target: usize) -> Error {
        let kind = match *self {
            Self::Overlap { h_over_epsilon, limit } => OperatorError::Overlap { h_over_epsilon, limit },
            Self::Moment { defect, limit } => OperatorError::Moment { defect, limit },
        };
        Error::from(kind).at(target)
    }
}
