//! Derivatives along one axis from the sources on one side: boundary closures, and the one that is stable upwind.

use super::allowance::Allowance;
use super::draft::finite;
use super::expression::{Operator, collect};
use super::half_space::{HalfScratch, HalfSpace, half_space_settings, on_side};
use super::method::{Method, spread};
use super::pairwise::times;
use super::row_report::RowReport;
use crate::error::{ErrorKind, KernelError, OperatorError, Result};
use crate::kernel::along_axis;
use crate::moment::{Ladder, MomentScratch, MomentSolver, MomentSystem, Solution};
use crate::multi_index::Term;
use crate::scale::{Cutoff, Epsilon, Volumes};
use crate::stencil::{Side, Stencil};

/// c d^beta/dx_i^beta from the sources on one side of the axis i alone,
/// (Q f)_p = epsilon^-beta sum_q V_q epsilon^-D P(z_q) exp(-|z_q|^2) (f_q - f_p) over z_i > 0 on the left (x_q < x_p),
/// z_i < 0 on the right, z_q = (x_p - x_q)/epsilon.
///
/// Order 1 of beta = 1: P = a z_i, with a from the discrete first moment. In more dimensions the Gaussian is centered at
/// the c across the axis, exp(-|z - c|^2), that makes the first moments across vanish: linear functions are exact on any
/// set, and yet all weights have one sign; c = 0 on lattices. Where no |c| <= 3 does (at a wall along the axis) c = 0, and
/// the moment across is held against [`moment_tolerance`](Self::moment_tolerance).
///
/// All others: P = sum_alpha a_alpha z^alpha over 1 <= |alpha| <= beta + r - 1, with the a_alpha solved from the discrete
/// moments of the half-stencil, so that polynomials of that degree are exact on any set.
///
/// **Only order 1 of beta = 1 is for upwind time stepping** ([`is_upwind`](Self::is_upwind)): with it Euler's step keeps
/// the maximum principle up to dt = 1/sum |w|. With the others order 2 of beta = 1 grows under Euler at every step, orders
/// 3 and 4 have growing modes under any explicit method, and second derivatives grow at short waves: they are boundary
/// closures. Advection takes [`Upwind`](super::Upwind) or [`UpwindGradient`](super::UpwindGradient), which offer nothing
/// else.
///
/// The form f_q - f_p annihilates constants exactly. Needs volumes; costs one exponential a neighbor, and but for order 1
/// of beta = 1 a dense solve of as many conditions as a_alpha.
///
/// ```
/// use parops::{Apply, CellList, D1, Domain, OneSided, Particles, Selected, Side, Spacing};
/// let set = Particles::lattice([0.0], [1.0], [20])?;
/// let slope = D1::<1>::default();
/// let left = OneSided::new(slope, Side::Left, 2, Spacing(0.05).epsilon(1.0)?, set.volumes()?)?;
/// // At the last particle, which has no neighbor on the right.
/// let end = Selected::new(CellList::build(&set, &Domain::open(), left.cutoff())?, &[19])?;
/// let f: Vec<f64> = set.points().iter().map(|x| x[0] * x[0]).collect();
/// let mut out = [0.0];
/// left.assemble(&end)?.apply(&f, &mut out)?;
/// assert!((out[0] - 2.0 * 0.975).abs() < 1e-12);
/// assert!(!left.is_upwind());
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, eq. 6.27 to 6.30, with errata 28 (the form), 31 (discrete moments) and 32 (closures).
#[derive(Clone, Debug)]
pub struct OneSided<const D: usize> {
    pub(super) half: HalfSpace,
    term: Term<D>,
    axis: usize,
    side: Side,
    order: u32,
}

impl<const D: usize> OneSided<D> {
    /// The largest degree plus order.
    const HIGHEST: u32 = 8;

    /// The derivative `operator`, of one term along one axis, from the sources on `side`, to order r = `order`.
    ///
    /// # Errors
    /// [`KernelError::NotAlongAxis`] for another operator; [`KernelError::OneSided`] for order 0 and for degree + order
    /// above 8; and the refusals of [`common_degree`](crate::common_degree).
    pub fn new<Op: Operator<D, Out = [f64; 1]>>(
        operator: Op,
        side: Side,
        order: u32,
        epsilon: Epsilon,
        volumes: &Volumes,
    ) -> Result<Self> {
        let terms = collect(&operator)?.swap_remove(0);
        let [term] = terms.as_slice() else {
            let degree = terms.first().map_or(0, |term| term.index.degree());
            let axes = (0..D).filter(|&axis| terms.iter().any(|term| term.index.exponents()[axis] > 0)).count();
            return Err(KernelError::NotAlongAxis { degree, axes }.into());
        };
        let (axis, degree) = (along_axis(term.index)?, term.index.degree());
        if order == 0 || degree.saturating_add(order) > Self::HIGHEST {
            return Err(KernelError::OneSided { degree, order, limit: Self::HIGHEST }.into());
        }
        Ok(Self { half: HalfSpace::new(epsilon, volumes), term: *term, axis, side, order })
    }

    /// Whether explicit time stepping with it upwind is stable: for order 1 of the first derivative alone.
    pub fn is_upwind(&self) -> bool {
        (self.term.index.degree(), self.order) == (1, 1)
    }

    /// The axis of the derivative.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The side of the sources.
    pub fn side(&self) -> Side {
        self.side
    }
}

half_space_settings!(OneSided);

/// Working memory of [`OneSided`].
#[derive(Clone, Debug)]
pub struct OneSidedScratch<const D: usize> {
    half: HalfScratch<D>,
    /// `None` for order 1 of the first derivative.
    closure: Option<Closure<D>>,
}

/// The conditions of a closure, and the half-stencil they were solved on.
#[derive(Clone, Debug)]
struct Closure<const D: usize> {
    system: MomentSystem<f64, D>,
    moments: MomentScratch<f64>,
    /// The neighbors on the side, the nearest first.
    nodes: Vec<usize>,
    z: Vec<[f64; D]>,
    w: Vec<f64>,
    solution: Option<Solution<f64>>,
}

impl<const D: usize> Closure<D> {
    /// Writes the weights of the side, in units of epsilon^-beta, into the half-stencil.
    fn solve(&mut self, half: &mut HalfScratch<D>, axis: usize, side: Side, ratio: f64) -> Result<()> {
        let Self { system, moments, nodes, z, w, solution } = self;
        let conditions = system.conditions();
        nodes.clear();
        nodes.extend((0..half.z.len()).filter(|&q| on_side(&half.z[q], axis, side)));
        if nodes.is_empty() {
            return Err(OperatorError::EmptySide { axis, side, neighbors: half.z.len() }.into());
        }
        let neighbors = nodes.len();
        if neighbors < conditions {
            return Err(OperatorError::TooFew { neighbors, conditions, needed: conditions }.into());
        }
        z.clear();
        z.extend(nodes.iter().map(|&q| half.z[q]));
        w.clear();
        w.resize(neighbors, 0.0);
        system.fill_windowed(z, |i, squared| half.volume[nodes[i]].sqrt() * (-0.5 * squared).exp());
        let refuse = |rank, condition, residual| OperatorError::Uncertified {
            neighbors,
            conditions,
            rank,
            condition,
            residual,
            ratio,
        };
        let solved = Ladder.solve(system, moments, w).map_err(|error| match *error.kind() {
            ErrorKind::Operator(OperatorError::Singular { rank, .. }) => {
                refuse(rank, f64::INFINITY, system.largest_required()).into()
            }
            _ => error,
        })?;
        if !solved.holds(system) {
            return Err(refuse(solved.rank, solved.condition, solved.residual.absolute).into());
        }
        *solution = Some(solved);
        nodes.iter().zip(w.iter()).for_each(|(&q, &w)| half.w[q] = w);
        Ok(())
    }
}

impl<const D: usize> Method<D> for OneSided<D> {
    type Out = [f64; 1];
    type Scratch = OneSidedScratch<D>;

    fn scratch(&self) -> Result<OneSidedScratch<D>> {
        let half = HalfScratch::default();
        if self.is_upwind() {
            return Ok(OneSidedScratch { half, closure: None });
        }
        let unit = Term { factor: 1.0, ..self.term };
        let system = MomentSystem::new(&[vec![unit]], self.term.index.degree(), self.order, 1)?;
        let (moments, nodes, z, w) = (MomentScratch::default(), Vec::new(), Vec::new(), Vec::new());
        Ok(OneSidedScratch { half, closure: Some(Closure { system, moments, nodes, z, w, solution: None }) })
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        self.half.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        Ok(Some(self.half.epsilon.get(p)? * self.half.support))
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut OneSidedScratch<D>,
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        let OneSidedScratch { half, closure } = scratch;
        let inverse = self.half.prepare(row, half)?;
        match closure {
            Some(closure) => closure.solve(half, self.axis, self.side, row.cutoff() * inverse)?,
            None => half.slope(self.axis, self.side)?,
        }
        // epsilon^-beta comes last: it alone can overflow.
        let scale = times(self.term.factor, inverse, self.term.index.degree() as usize);
        diagonal[0] = 0.0;
        for ((w, &sign), &solved) in w.iter_mut().zip(row.signs()).zip(&half.w) {
            let weight = solved * scale;
            let (weight, share) = spread(weight, -weight, sign);
            w[0] = weight;
            diagonal[0] += share;
        }
        finite(row, w.iter().map(<[f64; 1]>::as_slice), diagonal)
    }

    fn report(
        &self,
        row: &Stencil<D>,
        scratch: &OneSidedScratch<D>,
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
    ) -> Result<RowReport> {
        let mut report = self.half.report(row, &scratch.half, w, diagonal)?;
        report.order = Some(self.order);
        if let Some(closure) = &scratch.closure
            && let Some(Solution { rung, rank, condition, residual }) = closure.solution
        {
            (report.conditions, report.rank) = (closure.system.conditions(), rank);
            (report.condition, report.residual) = (condition, residual.absolute);
            report.rung = Some(rung);
        }
        Ok(report)
    }
}
