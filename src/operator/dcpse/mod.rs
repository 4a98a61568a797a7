//! Discretization-corrected PSE: kernels that satisfy the moment conditions on the particles themselves.

mod certify;
mod group;
mod weights;

pub use weights::DcPseScratch;

use super::expression::Operator;
use super::pse::Sign;
use crate::error::{MultiIndexError, OperatorError, Result};
use crate::moment::{Ladder, Window};
use crate::scale::Epsilon;
use group::grouped;

/// cutoff / epsilon where no epsilon is given: the window has fallen to exp(-4.84) there.
pub const CUTOFF_OVER_EPSILON: f64 = 2.2;

/// Discretization-corrected PSE of order R, (Q f)_p = epsilon_p^-m sum_q w_pq (f_q -/+ f_p), w = p(z) phi(|z|) with
/// a polynomial p found for every particle from the discrete moment conditions
/// sum_q w_pq z_q^alpha = (-1)^m c_i beta_i! [alpha = beta_i], |alpha| <= m + R - 1.
///
/// Exact for polynomials of degree below m + R on **any** particle set: a row whose measured residual is more than
/// rounding is refused, with its particle, rank and condition, or answered as [`Fallback`] says, after its
/// support was widened as far as the provider reaches. Needs no volumes and no overlap, but at least 2 l
/// neighbors for l conditions. Does not conserve. Signs as in the notes: '-' for even degrees, with the zeroth moment
/// free; '+' for odd degrees, with the particle itself in the conditions and in the sum; '-' on request. Degree 0, and
/// targets that are no particles, take the plain sum with the zeroth moment imposed.
///
/// Outputs of several degrees ([`Several`](super::Several)) come over one list in one sweep; those whose m + R and sign
/// agree share one factorization.
///
/// R = 0 stands for an order known at run time, see [`at_order`](Self::at_order).
///
/// ```
/// use parops::{Apply, CellList, DcPse, Domain, Laplacian, Particles};
/// let scattered = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
/// let dcpse = DcPse::<Laplacian<2>, 2>::new();
/// let neighbors = CellList::build(&scattered, &Domain::open(), dcpse.cutoff(&scattered)?)?;
/// let rows = dcpse.assemble(&neighbors)?;
/// let f: Vec<f64> = scattered.points().iter().map(|x| x[0].powi(3) - 2.0 * x[0] * x[1] + 5.0).collect();
/// let mut lap = vec![0.0; f.len()];
/// rows.apply(&f, &mut lap)?;
/// assert!(scattered.points().iter().zip(&lap).all(|(x, lap)| (lap - 6.0 * x[0]).abs() < 1e-9));
/// # parops::Result::Ok(())
/// ```
///
/// Source: B. Schrader, S. Reboux, I. F. Sbalzarini (2010); notes 001, eq. 5.33 to 5.47, with errata 19 to 24.
/// See also: [`Pse`](super::Pse), which conserves and is cheaper on lattices.
#[derive(Clone, Debug)]
pub struct DcPse<Op, const R: u32 = 0, S = Ladder> {
    operator: Op,
    solver: S,
    settings: Settings,
}

/// What is done about a row that its widest support does not certify.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fallback {
    /// The build fails, naming particle, neighbors, rank and condition.
    #[default]
    Refuse,
    /// The highest lower order that can be certified; the report says which rows and by how much.
    LowerOrder,
    /// A row without weights, flagged in the report: the operator is zero there.
    Empty,
}

#[derive(Clone, Debug)]
struct Settings {
    order: u32,
    window: Window,
    sign: Sign,
    impose_zeroth: bool,
    share: bool,
    epsilon: Option<Epsilon>,
    neighbors_per_condition: f64,
    fallback: Fallback,
}

impl<Op, const R: u32> DcPse<Op, R> {
    const ORDER_LEGAL: () = assert!(1 <= R && R <= 8, "the order of DC-PSE is 1 to 8");

    /// The operator type's own value, such as `Laplacian` or `D2<1, 1>`, to order R.
    pub fn new() -> Self
    where
        Op: Default,
    {
        Self::of(Op::default())
    }

    /// This operator to order R.
    pub fn of(operator: Op) -> Self {
        let () = Self::ORDER_LEGAL;
        Self::with_order(operator, R)
    }

    fn with_order(operator: Op, order: u32) -> Self {
        let settings = Settings {
            order,
            window: Window::Exponential,
            sign: Sign::Plus,
            impose_zeroth: false,
            share: false,
            epsilon: None,
            neighbors_per_condition: 2.0,
            fallback: Fallback::Refuse,
        };
        Self { operator, solver: Ladder, settings }
    }
}

impl<Op: Default, const R: u32> Default for DcPse<Op, R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<Op> DcPse<Op> {
    /// This operator to an order known at run time; the same code and the same bits as the typed one.
    ///
    /// # Errors
    /// [`MultiIndexError::Order`] where the order is not 1 to 8.
    pub fn at_order(operator: Op, order: u32) -> Result<Self> {
        if !(1..=8).contains(&order) {
            return Err(MultiIndexError::Order { order, low: 1, high: 8 }.into());
        }
        Ok(Self::with_order(operator, order))
    }
}

impl<Op, const R: u32, S> DcPse<Op, R, S> {
    /// Sets the smoothing length; by default the cutoff of each target over [`CUTOFF_OVER_EPSILON`].
    #[must_use]
    pub fn epsilon(mut self, epsilon: Epsilon) -> Self {
        self.settings.epsilon = Some(epsilon);
        self
    }

    /// Sets the window inside the kernel.
    #[must_use]
    pub fn window(mut self, window: Window) -> Self {
        self.settings.window = window;
        self
    }

    /// Sets the sign for odd degrees, '+' by default. Even degrees always take '-'.
    #[must_use]
    pub fn sign(mut self, sign: Sign) -> Self {
        self.settings.sign = sign;
        self
    }

    /// Imposes the zeroth moment where '-' leaves it free: one condition more, and a worse condition number (errata 20).
    #[must_use]
    pub fn impose_zeroth(mut self) -> Self {
        self.settings.impose_zeroth = true;
        self
    }

    /// Sets the fewest neighbors of a row in units of l, 2 by default; 1 is the least that can work, with condition
    /// numbers of 10^7 and more.
    ///
    /// The error at a particle goes up and down with n, and what is best on one set is not on the next: do not tune the
    /// ratio on one scene. Over all particles it is least from about n = 1.3 l on, and grows slowly from there.
    ///
    /// # Errors
    /// [`OperatorError::Setting`] below 1.
    pub fn neighbors_per_condition(mut self, ratio: f64) -> Result<Self> {
        if !(ratio >= 1.0 && ratio.is_finite()) {
            return Err(OperatorError::Setting { value: ratio }.into());
        }
        self.settings.neighbors_per_condition = ratio;
        Ok(self)
    }

    /// Sets what is done about a row that cannot be certified.
    #[must_use]
    pub fn fallback(mut self, fallback: Fallback) -> Self {
        self.settings.fallback = fallback;
        self
    }

    /// Raises outputs of lower degree to the conditions of the highest degree of their sign, so that all share one
    /// factorization and the lower degrees come to a higher order than R.
    #[must_use]
    pub fn share(mut self) -> Self {
        self.settings.share = true;
        self
    }

    /// Solves the moment systems by another method.
    pub fn solver<Other>(self, solver: Other) -> DcPse<Op, R, Other> {
        let Self { operator, settings, .. } = self;
        DcPse { operator, solver, settings }
    }

    /// The fewest nodes a row of this operator must have at a particle.
    ///
    /// # Errors
    /// As [`Method::scratch`](super::Method::scratch).
    pub fn fewest_neighbors<const D: usize>(&self) -> Result<usize>
    where
        Op: Operator<D>,
    {
        Ok(self.settings.fewest(self.most_conditions()?))
    }

    /// The convergence order asked for.
    pub(crate) fn own_order(&self) -> u32 {
        self.settings.order
    }

    /// l of the largest system at a particle.
    pub(crate) fn most_conditions<const D: usize>(&self) -> Result<usize>
    where
        Op: Operator<D>,
    {
        let groups = grouped::<D, Op>(&self.operator, &self.settings, self.settings.order)?;
        Ok(groups.iter().map(|group| group.at_particle().conditions()).max().unwrap_or(0))
    }
}

impl Settings {
    fn fewest(&self, conditions: usize) -> usize {
        (self.neighbors_per_condition * conditions as f64).ceil() as usize
    }
}
