//! The one seam every discretization method implements: a stencil goes in, weights come out.

use super::expression::Outputs;
use crate::error::{Error, OperatorError, Result};
use crate::moment::Rung;
use crate::stencil::Stencil;

/// How a stencil becomes weights: the only trait a new method implements.
///
/// Weights w_pq and diagonal d_p mean
/// out_p = d_p f_p + sum_q w_pq (f_q - f_p) where the target is a particle, and
/// out_p = sum_q w_pq f_q where it is not. Here f_q is the value of the source itself: the sign of a mirror image is
/// already in w_pq and d_p, and [`spread`] puts it there.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no discretization method in {D} dimensions",
    label = "expected a method in {D} dimensions",
    note = "the method and the neighbor provider must agree on the number of dimensions"
)]
pub trait Method<const D: usize>: Sync {
    /// `[f64; K]`: K weights per pair.
    type Out: Outputs;
    /// Working memory for one row, made once and reused.
    type Scratch: Send;

    /// Makes working memory; the only allocation.
    ///
    /// # Errors
    /// Where a parameter of the method is illegal.
    fn scratch(&self) -> Result<Self::Scratch>;

    /// Checks that what the method holds per particle is there for so many targets and sources. Called once a build.
    ///
    /// # Errors
    /// [`ParticleError::Length`](crate::ParticleError::Length) where it is not.
    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        let _ = (targets, sources);
        Ok(())
    }

    /// The cutoff this method wants for target p; `None` takes the provider's.
    ///
    /// # Errors
    /// Where the method holds no data for p.
    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        let _ = p;
        Ok(None)
    }

    /// The weights of one target. `w` is as long as the stencil; `w` and `diagonal` are written whole.
    ///
    /// # Errors
    /// Where no weights exist for this stencil. A row that exists but is poor is no error here: [`report`](Self::report)
    /// says so, and the build decides.
    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut Self::Scratch,
        w: &mut [Self::Out],
        diagonal: &mut Self::Out,
    ) -> Result<()>;

    /// What is known about the row that [`weights`](Self::weights) has just written with the same scratch.
    ///
    /// # Errors
    /// Where the method holds no data for the row.
    fn report(
        &self,
        row: &Stencil<D>,
        scratch: &Self::Scratch,
        w: &[Self::Out],
        diagonal: &Self::Out,
    ) -> Result<RowReport>;
}

/// What is known about one row.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RowReport {
    /// The target.
    pub target: usize,
    /// Number of neighbors n.
    pub neighbors: usize,
    /// h/epsilon, with h = V^(1/D).
    pub h_over_epsilon: f64,
    /// Relative defect of the discrete moments that are checked.
    pub moment_defect: f64,
    /// The largest moment M_alpha with 0 < |alpha| < m, relative to the required ones: zero on lattices, and not
    /// checked. It adds M_alpha D^alpha f / epsilon^(m - |alpha|) to the result, which grows under refinement.
    pub lower_moment: f64,
    /// Number of moment conditions l that were solved for; 0 where none were.
    pub conditions: usize,
    /// Their rank on this stencil.
    pub rank: usize,
    /// Estimated condition number of the windowed, scaled monomials; 0 where no system was solved.
    pub condition: f64,
    /// The largest miss of a moment condition, in scaled units.
    pub residual: f64,
    /// Which solver found the weights.
    pub rung: Option<Rung>,
    /// |d_p| + sum_q |w_pq|, the largest over the outputs: the gain of noise, in units of the operator.
    pub sum_abs: f64,
    /// Pairs whose weight is negative before the sign of an image; for a Laplacian each costs the maximum principle.
    pub negative_weights: usize,
    /// The bound this row sets on the modulus of the eigenvalues of the operator, in units of the operator.
    pub spectral_bound: f64,
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
            sum_abs,
            negative_weights: 0,
            spectral_bound: 2.0 * sum_abs,
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
#[non_exhaustive]
pub enum Breach {
    /// h/epsilon is above what the kernel bears.
    Overlap {
        /// h/epsilon.
        h_over_epsilon: f64,
        /// The largest legal value.
        limit: f64,
    },
    /// The discrete moments miss their conditions.
    Moment {
        /// The relative defect.
        defect: f64,
        /// The largest legal value.
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

/// A set of targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Targets {
    sorted: Vec<usize>,
}

/// Where a caller allows rows to break their limits.
///
/// ```
/// use parops::Allowance;
/// let some = Allowance::at([9, 5, 1]);
/// assert!(some.covers(1) && some.covers(9) && !some.covers(2));
/// assert!(Allowance::Everywhere.covers(2) && !Allowance::default().covers(1));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Allowance {
    /// Nowhere: a breach fails the build.
    #[default]
    Nowhere,
    /// At these targets; made by [`Allowance::at`].
    At(Targets),
    /// Everywhere; the report still says where.
    Everywhere,
}

impl Allowance {
    /// At these targets, in any order.
    pub fn at(targets: impl IntoIterator<Item = usize>) -> Self {
        let mut sorted: Vec<_> = targets.into_iter().collect();
        sorted.sort_unstable();
        sorted.dedup();
        Self::At(Targets { sorted })
    }

    /// Whether it covers target p.
    pub fn covers(&self, p: usize) -> bool {
        match self {
            Self::Nowhere => false,
            Self::At(targets) => targets.sorted.binary_search(&p).is_ok(),
            Self::Everywhere => true,
        }
    }
}

/// Splits the pair term a s f_q + b f_p into its weight on (f_q - f_p) and its share of the diagonal,
/// (a s) (f_q - f_p) + (a s + b) f_p, where s is the sign of the image.
///
/// ```
/// assert_eq!(parops::spread(2.0, -2.0, 1), (2.0, 0.0));
/// assert_eq!(parops::spread(2.0, -2.0, -1), (-2.0, -4.0));
/// ```
#[inline(always)]
pub fn spread(a: f64, b: f64, sign: i8) -> (f64, f64) {
    let w = a * f64::from(sign);
    (w, w + b)
}
