//! Discretization-corrected PSE: kernels that satisfy the moment conditions on the particles themselves.

use super::expression::{Operator, collect};
use super::method::{Method, RowReport, spread};
use super::pse::Sign;
use crate::error::{Error, MultiIndexError, OperatorError, ParticleError, Result};
use crate::moment::{Ladder, MomentScratch, MomentSolver, MomentSystem, Window};
use crate::multi_index::common_degree;
use crate::scale::Epsilon;
use crate::stencil::Stencil;

/// cutoff / epsilon where no epsilon is given: the window has fallen to exp(-4.84) there.
pub const CUTOFF_OVER_EPSILON: f64 = 2.2;

/// Discretization-corrected PSE of order R, (Q f)_p = epsilon_p^-m sum_q w_pq (f_q -/+ f_p), w = p(z) phi(|z|) with
/// a polynomial p found for every particle from the discrete moment conditions
/// sum_q w_pq z_q^alpha = (-1)^m c_i beta_i! [alpha = beta_i], |alpha| <= m + R - 1.
///
/// Exact for polynomials of degree below m + R on **any** particle set: a row whose measured residual is more than
/// rounding is refused, with its particle, rank and condition. Needs no volumes and no overlap, but at least 2 l
/// neighbors for l conditions. Does not conserve. Signs as in the notes: '-' for even degrees, with the zeroth moment
/// free; '+' for odd degrees, with the particle itself in the conditions and in the sum; '-' on request. Degree 0, and
/// targets that are no particles, take the plain sum with the zeroth moment imposed.
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
    order: u32,
    solver: S,
    window: Window,
    sign: Sign,
    impose_zeroth: bool,
    epsilon: Option<Epsilon>,
    neighbors_per_condition: f64,
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
        Self {
            operator,
            order,
            solver: Ladder,
            window: Window::Exponential,
            sign: Sign::Plus,
            impose_zeroth: false,
            epsilon: None,
            neighbors_per_condition: 2.0,
        }
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
        self.epsilon = Some(epsilon);
        self
    }

    /// Sets the window inside the kernel.
    #[must_use]
    pub fn window(mut self, window: Window) -> Self {
        self.window = window;
        self
    }

    /// Sets the sign for odd degrees, '+' by default. Even degrees always take '-'.
    #[must_use]
    pub fn sign(mut self, sign: Sign) -> Self {
        self.sign = sign;
        self
    }

    /// Imposes the zeroth moment where '-' leaves it free: one condition more, and a worse condition number (errata 20).
    #[must_use]
    pub fn impose_zeroth(mut self) -> Self {
        self.impose_zeroth = true;
        self
    }

    /// Sets the fewest neighbors of a row in units of l, 2 by default; 1 is the least that can work, with condition
    /// numbers of 10^7 and more.
    ///
    /// # Errors
    /// [`OperatorError::Setting`] below 1.
    pub fn neighbors_per_condition(mut self, ratio: f64) -> Result<Self> {
        if !(ratio >= 1.0 && ratio.is_finite()) {
            return Err(OperatorError::Setting { value: ratio }.into());
        }
        self.neighbors_per_condition = ratio;
        Ok(self)
    }

    /// Solves the moment systems by another method.
    pub fn solver<Other>(self, solver: Other) -> DcPse<Op, R, Other> {
        let Self { operator, order, window, sign, impose_zeroth, epsilon, neighbors_per_condition, .. } = self;
        DcPse { operator, order, solver, window, sign, impose_zeroth, epsilon, neighbors_per_condition }
    }

    /// The fewest nodes a row of this operator must have at a particle.
    ///
    /// # Errors
    /// As [`Method::scratch`].
    pub fn fewest_neighbors<const D: usize>(&self) -> Result<usize>
    where
        Op: Operator<D>,
    {
        let DcPseScratch { own, plain, .. } = self.prepare::<D>()?;
        Ok(self.fewest_for(own.unwrap_or(plain).conditions()))
    }

    fn fewest_for(&self, conditions: usize) -> usize {
        (self.neighbors_per_condition * conditions as f64).ceil() as usize
    }

    fn prepare<const D: usize>(&self) -> Result<DcPseScratch<D>>
    where
        Op: Operator<D>,
    {
        let outputs = collect(&self.operator)?;
        let degree = common_degree(outputs.first().map_or(&[], Vec::as_slice))?;
        let pairing = match (degree, self.sign) {
            (0, _) => Pairing::Plain,
            (m, Sign::Plus) if m % 2 == 1 => Pairing::Sum,
            _ => Pairing::Difference,
        };
        let plain = MomentSystem::new(&outputs, degree, self.order, 0)?;
        let own = match pairing {
            Pairing::Difference if !self.impose_zeroth => Some(MomentSystem::new(&outputs, degree, self.order, 1)?),
            _ => None,
        };
        let report = RowReport::of::<D, [f64; 1]>(&Stencil::default(), &[], &[0.0]);
        let (z, w, moments) = (Vec::new(), Vec::new(), MomentScratch::default());
        Ok(DcPseScratch { degree, pairing, plain, own, z, w, moments, report })
    }
}

/// How f_p enters at a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pairing {
    /// f_q - f_p.
    Difference,
    /// f_q + f_p, the particle itself included.
    Sum,
    /// f_q alone.
    Plain,
}

/// Working memory of [`DcPse`]: the conditions of the operator, and room for one row.
#[derive(Clone, Debug)]
pub struct DcPseScratch<const D: usize> {
    degree: u32,
    pairing: Pairing,
    /// All conditions, the zeroth moment among them.
    plain: MomentSystem<f64, D>,
    /// Those of '-' at a particle, where the zeroth moment is free.
    own: Option<MomentSystem<f64, D>>,
    z: Vec<[f64; D]>,
    w: Vec<f64>,
    moments: MomentScratch<f64>,
    report: RowReport,
}

impl<Op, const R: u32, S, const D: usize, const K: usize> Method<D> for DcPse<Op, R, S>
where
    Op: Operator<D, Out = [f64; K]>,
    S: MomentSolver,
{
    type Out = [f64; K];
    type Scratch = DcPseScratch<D>;

    fn scratch(&self) -> Result<DcPseScratch<D>> {
        self.prepare()
    }

    fn validate(&self, targets: usize, _: usize) -> Result<()> {
        match self.epsilon.as_ref().and_then(Epsilon::len) {
            Some(found) if found != targets => Err(ParticleError::Length { found, needed: targets }.into()),
            _ => Ok(()),
        }
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut DcPseScratch<D>,
        w: &mut [[f64; K]],
        diagonal: &mut [f64; K],
    ) -> Result<()> {
        *diagonal = [0.0; K];
        let p = row.target();
        let epsilon = match &self.epsilon {
            Some(epsilon) => epsilon.get(p)?,
            None => row.cutoff() / CUTOFF_OVER_EPSILON,
        };
        let ratio = row.cutoff() / epsilon;
        if !(1.0..=6.0).contains(&ratio) {
            return Err(OperatorError::Window { ratio, low: 1.0, high: 6.0 }.into());
        }
        let DcPseScratch { degree, pairing, plain, own, z, w: solved, moments, .. } = scratch;
        let pairing = if row.center().is_none() { Pairing::Plain } else { *pairing };
        let system = match own {
            Some(own) if pairing == Pairing::Difference => own,
            _ => plain,
        };
        let conditions = system.conditions();
        // The particle itself is one of the nodes where it stands in the conditions (errata 21).
        let nodes = row.len() + usize::from(pairing == Pairing::Sum);
        let needed = self.fewest_for(conditions);
        if nodes < needed {
            return Err(OperatorError::TooFew { neighbors: nodes, conditions, needed }.into());
        }
        let inverse = 1.0 / epsilon;
        z.clear();
        z.extend(row.separations().iter().map(|s| s.map(|x| x * inverse)));
        if pairing == Pairing::Sum {
            z.push([0.0; D]);
        }
        system.fill(z, self.window, ratio);
        solved.clear();
        solved.resize(z.len() * K, 0.0);
        let solution = self.solver.solve(system, moments, solved)?;
        if !solution.holds(system) {
            let (rank, condition, residual) = (solution.rank, solution.condition, solution.residual.absolute);
            let neighbors = row.len();
            let kind = OperatorError::Uncertified { neighbors, conditions, rank, condition, residual, ratio };
            return Err(Error::from(kind));
        }

        // epsilon^-m comes last: it alone can overflow.
        let scale = (0..*degree).fold(1.0, |product, _| product * inverse);
        let sigma = match pairing {
            Pairing::Difference => -1.0,
            Pairing::Sum => 1.0,
            Pairing::Plain => 0.0,
        };
        for k in 0..K {
            let column = &solved[k * z.len()..][..z.len()];
            for (i, (w, &sign)) in w.iter_mut().zip(row.signs()).enumerate() {
                let weight = column[i] * scale;
                let (on_difference, share) = spread(weight, sigma * weight, sign);
                if !on_difference.is_finite() {
                    return Err(OperatorError::Weight { q: row.sources()[i] as usize, weight }.into());
                }
                w[k] = on_difference;
                diagonal[k] += share;
            }
            if pairing == Pairing::Sum {
                diagonal[k] += 2.0 * column[row.len()] * scale;
            }
        }
        if row.center().is_none() {
            *diagonal = [0.0; K];
        }

        let mut report = RowReport::of(row, w, diagonal);
        (report.conditions, report.rank) = (conditions, solution.rank);
        (report.condition, report.residual) = (solution.condition, solution.residual.absolute);
        report.rung = Some(solution.rung);
        report.negative_weights = solved.iter().filter(|&&w| w < 0.0).count();
        scratch.report = report;
        Ok(())
    }

    fn report(&self, _: &Stencil<D>, scratch: &DcPseScratch<D>, _: &[[f64; K]], _: &[f64; K]) -> Result<RowReport> {
        Ok(scratch.report)
    }
}
