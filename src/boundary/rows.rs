//! Conditions as equations: one row per boundary particle.

use super::chosen::Chosen;
use super::condition::BoundaryCondition;
use super::coupled::{BoundaryReport, Coupled};
use super::outward::Outward;
use crate::apply::{Field, Report, Rows};
use crate::error::{ApplyError, BoundaryError, Error, LinearError, Result};
use crate::linear::CsrMatrix;
use crate::moment::MomentSolver;
use crate::neighbors::Neighbors;
use crate::operator::{Contraction, DcPse, Gradient, Sign};

/// Neighbors of a condition row in units of l. With 2 l that are not widened the heat equation of order 4 between Neumann
/// walls has growing modes on 2 of 60 jittered sets, with 3 l on none.
const NEIGHBORS_PER_CONDITION: f64 = 3.0;

/// Boundary conditions as rows: condition i is the equation a u_p + b sum_q w_pq (u_q - u_p) = g_i, with the weights of
/// DC-PSE for the derivative along the normal of p.
///
/// [`impose`](Self::impose) finds the boundary values that follow from the others, as an evolution needs them;
/// [`matrix`](Self::matrix) and [`replace_in`](Self::replace_in) give the equations to a steady problem.
///
/// A row takes the 3 l nearest particles, ties included, boundary ones among them: l = C(D + r, D) - 1 for order r. Where
/// u_p has too small a weight in du/dn the support is widened by 1.15 up to three times, as far as the provider reaches;
/// the report says how often. A row is exact for polynomials u of degree r, so that boundary values are as accurate as an
/// operator of order r. One solve and one weight per pair a row; made once per particle set.
///
/// With u_B at the boundary and u_I elsewhere the conditions are A_BB u_B + A_BI u_I = g. What makes A_BB regular is the
/// weight of u_p in its own row, positive and not small beside the others: condition numbers are then 5 to 13 in 2D and
/// 70 to 280 in 3D (r = 2 and 4), whatever the number of particles, and a Robin term with a b >= 0 only helps. A_BB can be
/// singular for a b < 0, where a u_p cancels what du/dn takes of u_p (a ~ -b/h): that is refused, and so is a normal that
/// points inwards, where u_p has the wrong sign. A steady problem with Neumann conditions only is singular whatever its
/// rows, for a constant can be added to u: the sparse LU refuses it, GMRES a right side without a solution. Give one value,
/// or a Robin condition.
///
/// ```
/// use parops::{BoundaryCondition, BoundaryRows, CellList, Cutoff, Domain, Particles};
/// let rod = Particles::new((0..=20).map(|i| [0.05 * f64::from(i)]).collect())?;
/// let neighbors = CellList::build(&rod, &Domain::open(), Cutoff(0.4))?;
/// let ends = [BoundaryCondition::dirichlet(0), BoundaryCondition::neumann(20, [1.0])];
/// let mut boundary = BoundaryRows::build(&ends, 2, &neighbors)?;
/// // u = x^2 inside; u(0) = 0 and du/dx(1) = 2 give the ends.
/// let mut u: Vec<f64> = rod.points().iter().map(|x| x[0] * x[0]).collect();
/// (u[0], u[20]) = (-7.0, 7.0);
/// let report = boundary.impose(|p| if p == 0 { 0.0 } else { 2.0 }, &mut u)?;
/// assert!(u[0] == 0.0 && (u[20] - 1.0).abs() < 1e-12 && report.residual < 1e-13);
/// # parops::Result::Ok(())
/// ```
#[derive(Debug)]
pub struct BoundaryRows {
    particles: Vec<usize>,
    matrix: CsrMatrix,
    generation: u64,
    report: Report,
    coupled: Coupled,
}

impl BoundaryRows {
    /// The rows of these conditions, with normal derivatives of order r = `order`, 1 to 8.
    ///
    /// The targets of `neighbors` must be its particles; its reach must hold 3 l neighbors of every Neumann and Robin
    /// particle.
    ///
    /// # Errors
    /// Naming the particle: [`BoundaryError::Particle`] for one that is no target, [`BoundaryError::Repeated`] for two
    /// conditions at one particle, [`BoundaryError::Factors`] where a and b are both zero or not finite,
    /// [`BoundaryError::Normal`] for a normal that is no unit vector,
    /// [`OperatorError::TooFew`](crate::OperatorError::TooFew) where the reach holds fewer than 3 l neighbors,
    /// [`BoundaryError::OwnWeight`] where u_p has no or a negative weight within the reach, and what
    /// else [`Rows::assemble`] refuses. [`MultiIndexError::Order`](crate::MultiIndexError::Order) for an illegal order.
    /// [`LinearError::Singular`] where the conditions do not determine the boundary values,
    /// and what else [`SparseSolver::new`](crate::SparseSolver::new) refuses.
    pub fn build<const D: usize, P: Neighbors<D>>(
        conditions: &[BoundaryCondition<D>],
        order: u32,
        neighbors: &P,
    ) -> Result<Self> {
        let gradient = DcPse::at_order(Gradient::<D>, order)?.sign(Sign::Minus);
        Self::build_with(conditions, &gradient.neighbors_per_condition(NEIGHBORS_PER_CONDITION)?, neighbors)
    }

    /// The rows of these conditions with a gradient of your own settings.
    ///
    /// Take at least 3 neighbors per condition, and the sign '-'. A smoothing length per particle counts the conditions
    /// with b != 0, in the order of `conditions`. A row of lower order, where the gradient may fall back to one, is taken
    /// where u_p has a positive weight in it; an empty row is refused like the row it stands for.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_with<const D: usize, const R: u32, S: MomentSolver, P: Neighbors<D>>(
        conditions: &[BoundaryCondition<D>],
        gradient: &DcPse<Gradient<D>, R, S>,
        neighbors: &P,
    ) -> Result<Self> {
        check(conditions, neighbors)?;
        let flux: Vec<_> = conditions.iter().filter(|condition| condition.has_flux()).collect();
        let at: Vec<usize> = flux.iter().map(|condition| condition.particle()).collect();
        let normals: Vec<[f64; D]> = flux.iter().map(|condition| condition.unit_normal()).collect();
        let chosen = Chosen::new(neighbors, &at, gradient.fewest_neighbors::<D>()?)?;
        let normal = Outward::new(Contraction::new(gradient.clone(), normals)?);
        let name = |error: Error| match error.particle().and_then(|i| at.get(i)) {
            Some(&p) => error.at(p),
            None => error,
        };
        let rows: Rows = Rows::assemble(&normal, &chosen).map_err(name)?;

        let sources = neighbors.sources();
        let matrix = equations(conditions, &rows, sources)?;
        let mut report = *rows.report();
        report.rename(|i| at.get(i).copied().unwrap_or(i));
        let particles = conditions.iter().map(BoundaryCondition::particle).collect();
        let coupled = Coupled::new(conditions, &matrix)?;
        Ok(Self { particles, matrix, generation: neighbors.generation(), report, coupled })
    }

    /// The particle of each condition, in the order given.
    pub fn particles(&self) -> &[usize] {
        &self.particles
    }

    /// The equations: row i is condition i, over all particles; its right side is g_i.
    pub fn matrix(&self) -> &CsrMatrix {
        &self.matrix
    }

    /// What the build of the rows of normal derivatives found.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Writes the boundary values that follow from the conditions and from the values of u at all other particles;
    /// g(p) is the right side at particle p, a value of the moment where it depends on time.
    ///
    /// Values of Neumann and Robin particles stand in each other's rows: they are found together from one sparse system,
    /// to a relative residual of 1e-13, or what rounding leaves of it, see [`SparseSolver`](crate::SparseSolver). What
    /// stands in u at boundary particles is not read. Where g is given for u alone, u = g/a to the bit. Nothing is
    /// allocated after the first call.
    ///
    /// # Errors
    /// [`ApplyError::Input`] for a field of another length; [`BoundaryError::Value`] naming the particle where g is not
    /// finite, [`ApplyError::Field`] one whose value is needed and is not finite, [`ApplyError::Overflow`] one whose
    /// boundary value is not; [`LinearError::NotConverged`] where the residual is not
    /// reached. `u` is then as it was.
    pub fn impose<T: Field>(&mut self, g: impl FnMut(usize) -> f64, u: &mut [T]) -> Result<BoundaryReport> {
        self.coupled.impose(g, u)
    }

    /// Checks that the rows were made for this generation of a particle set.
    ///
    /// # Errors
    /// [`ApplyError::Stale`] where they were not.
    pub fn validate(&self, generation: u64) -> Result<()> {
        if self.generation == generation {
            Ok(())
        } else {
            Err(ApplyError::Stale { rows: self.generation, set: generation }.into())
        }
    }

    /// Puts the conditions in place of the rows of their particles: the matrix of the steady problem A u = s inside,
    /// conditions at the boundary.
    ///
    /// # Errors
    /// [`LinearError::Length`] for a matrix that is not square with a row per particle; it is then as it was.
    pub fn replace_in(&self, matrix: &mut CsrMatrix) -> Result<()> {
        let (found, needed) = (matrix.rows(), self.matrix.columns());
        if found != needed {
            return Err(LinearError::Length { found, needed }.into());
        }
        matrix.replace_rows(&self.matrix, self.particles.iter().copied().zip(0..))
    }

    /// Writes g(p) at every boundary particle: the right side of the steady problem, or, with g = 0, a rate of change
    /// that leaves boundary values alone. Calls g twice for each.
    ///
    /// # Errors
    /// [`ApplyError::Input`] for a field of another length; [`BoundaryError::Value`] naming the particle where g is not
    /// finite; `field` is then as it was.
    pub fn replace_values(&self, g: impl Fn(usize) -> f64, field: &mut [f64]) -> Result<()> {
        let needed = self.matrix.columns();
        if field.len() != needed {
            return Err(ApplyError::Input { found: field.len(), needed }.into());
        }
        if let Some((p, value)) = self.particles.iter().map(|&p| (p, g(p))).find(|(_, value)| !value.is_finite()) {
            return Err(Error::from(BoundaryError::Value { value }).at(p));
        }
        self.particles.iter().for_each(|&p| field[p] = g(p));
        Ok(())
    }
}

/// Refuses conditions that are none, stand at no particle of the provider, or twice at one.
fn check<const D: usize, P: Neighbors<D>>(conditions: &[BoundaryCondition<D>], neighbors: &P) -> Result<()> {
    let particles = neighbors.sources();
    let mut first = vec![None; particles];
    for (i, condition) in conditions.iter().enumerate() {
        let particle = condition.particle();
        let kind = match first.get_mut(particle) {
            Some(Some(first)) => BoundaryError::Repeated { first: *first, second: i },
            Some(place) if neighbors.center(particle) == Some(particle) => {
                *place = Some(i);
                condition.validate()?;
                continue;
            }
            _ => BoundaryError::Particle { particle, particles },
        };
        return Err(Error::from(kind).at(particle));
    }
    Ok(())
}

/// Row i: a u_p + b (d_p u_p + sum_q w_pq (u_q - u_p)), the normal derivatives in the order of their conditions.
fn equations<const D: usize>(
    conditions: &[BoundaryCondition<D>],
    derivatives: &Rows,
    particles: usize,
) -> Result<CsrMatrix> {
    let mut triplets = Vec::new();
    let mut next = 0;
    for (i, condition) in conditions.iter().enumerate() {
        let (p, (a, b)) = (condition.particle(), condition.factors());
        let mut own = a;
        if condition.has_flux() {
            if let Some(row) = derivatives.row(next) {
                own += b * row.diagonal[0];
                for (&q, [w]) in row.sources.iter().zip(row.weights) {
                    own -= b * w;
                    triplets.push((i, q as usize, b * w));
                }
            }
            next += 1;
        }
        triplets.push((i, p, own));
    }
    CsrMatrix::from_triplets(conditions.len(), particles, triplets)
}
