//! Scenes at rest: one sparse solve.

use super::fields::Fields;
use super::policy::GrowthPolicy;
use super::scene::Scene;
use super::semi_discrete::SemiDiscrete;
use crate::error::{Error, LinearError, Result, SolverError};
use crate::linear::{CsrMatrix, SolveReport, SparseSolver};
use crate::neighbors::Neighbors;
use crate::particles::Particles;

/// The field at which a scene is at rest.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SteadyState<E> {
    /// Its values, one a particle.
    pub u: Vec<E>,
    /// What the solver did: iterations of all fields, the largest relative residual.
    pub report: SolveReport,
    /// Estimated condition number of the matrix, rows scaled to a largest entry in [1, 2).
    pub condition: f64,
}

/// Solves div(D grad u) - div(v u) + S = 0 with the boundary conditions of the scene, as one sparse system; a velocity
/// without a named divergence is solenoidal, so that this is div(D grad u) - v . grad u + S = 0.
///
/// By [`SparseSolver`]: sparse LU with the feature `faer`, otherwise GMRES. S and the boundary values are those of t = 0. A
/// source of one field may be affine in u, S = a + b u, and b goes into the matrix; one of several fields may not depend
/// on u. That S is so is checked where it is probed, and again at the field found, to 64 eps of |S(0)| + |b u|: one that is a
/// small difference of large terms, c - (c + u), may be refused. Without a boundary, or with
/// fluxes alone, nothing fixes the level of u unless the source decays.
///
/// ```
/// use parops::{AdvectionDiffusion, Boundary, BoundaryCondition, DcPse, Domain, Gradient, Laplacian, Nearest, Particles};
/// use parops::steady;
/// // u' = 0.1 u'' with u(0) = 0, u(1) = 1: u = (exp(10 x) - 1) / (exp(10) - 1).
/// let rod = Particles::new((0..=80).map(|i| [f64::from(i) / 80.0]).collect())?;
/// let ends = [0, 80].map(BoundaryCondition::dirichlet);
/// let scene = AdvectionDiffusion::<1>::new()
///     .diffusion(0.1, DcPse::<Laplacian<1>, 4>::new())
///     .advection([1.0], DcPse::<Gradient<1>, 4>::new())
///     .boundary(Boundary::new(4).conditions(ends), |_, x, _| x[0].round());
/// let state = steady(scene, &rod, &Nearest::build(&rod, &Domain::open(), 12)?)?;
/// let exact = |x: f64| (10.0 * x).exp_m1() / 10.0_f64.exp_m1();
/// assert!(rod.points().iter().zip(&state.u).all(|(x, u)| (u - exact(x[0])).abs() < 1e-4));
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// As [`SemiDiscrete::new`]; [`SolverError::Unsteady`] for a velocity that depends on time; [`SolverError::NotAffine`] and
/// [`SolverError::Source`] naming the particle; [`SolverError::OpenLevel`] where any constant may be added to u; what
/// [`SparseSolver::new`] and [`SparseSolver::solve`] refuse, naming particles as rows.
pub fn steady<const D: usize, S: Scene<D>, P: Neighbors<D>>(
    scene: S,
    particles: &Particles<D>,
    neighbors: &P,
) -> Result<SteadyState<S::Value>> {
    let mut discrete = SemiDiscrete::new(scene, particles, neighbors, GrowthPolicy::Allow)?;
    if !discrete.steady() {
        return Err(SolverError::Unsteady { t: 0.0 }.into());
    }
    let count = particles.len();
    let zero = vec![S::Value::ZERO; count];
    let source = Affine::probe(&discrete, count)?;
    let matrix = discrete.matrix_with(0.0, 0.0, |p| source.slopes.get(p).copied().unwrap_or(0.0))?;
    if count > 0 && annihilates_constants(&matrix) {
        return Err(SolverError::OpenLevel { particles: count }.into());
    }
    let mut load = zero.clone();
    discrete.load(0.0, &zero, &mut load)?;
    let mut given = vec![false; count];
    discrete.prescribed(0.0).into_iter().for_each(|p| given[p] = true);

    let mut solver = SparseSolver::new(matrix)?;
    let (mut b, mut x, mut u) = (vec![0.0; count], vec![0.0; count], zero);
    let mut report = SolveReport::default();
    for i in 0..S::Value::FIELDS {
        for ((b, load), given) in b.iter_mut().zip(&load).zip(&given) {
            *b = if *given { load.get(i) } else { -load.get(i) };
        }
        let solved = solver.solve(&b, &mut x)?;
        report.iterations += solved.iterations;
        report.residual = report.residual.max(solved.residual);
        u.iter_mut().zip(&x).for_each(|(u, x)| u.set(i, *x));
    }
    for (p, u) in u.iter().enumerate() {
        // Beyond the range of f32, it may be.
        if let Some(value) = (0..S::Value::FIELDS).map(|i| u.get(i)).find(|value| !value.is_finite()) {
            return Err(Error::from(LinearError::Value { value }).at(p));
        }
    }
    source.confirm(&discrete, &u)?;
    Ok(SteadyState { u, report, condition: solver.condition()? })
}

/// Whether every row sums to zero, but for the rounding of its entries and of the diagonal, itself a sum of them.
fn annihilates_constants(matrix: &CsrMatrix) -> bool {
    (0..matrix.rows()).filter_map(|p| matrix.row(p)).all(|(_, row)| {
        let (sum, size) = row.iter().fold((0.0, 0.0), |(sum, size), a| (sum + a, size + f64::abs(*a)));
        f64::abs(sum) <= 2.0 * row.len() as f64 * f64::EPSILON * size
    })
}

/// A source that is affine in u, S = S(0) + dS/du u, particle by particle.
struct Affine<E> {
    /// S(0), of every particle.
    offsets: Vec<E>,
    /// dS/du; zero where no source acts, and of several fields.
    slopes: Vec<f64>,
}

/// Powers of two between the fields a source is probed with.
const STRIDE: usize = 60;

impl<E: Fields> Affine<E> {
    /// Probes the source with u = 0, 1 and 2, and with as much larger fields as it takes for S to change by half of itself: a
    /// slope is known to rounding then, whatever the units of u. Of several fields none may depend on any, at any scale: one
    /// matrix serves them all.
    fn probe<const D: usize, S: Scene<D, Value = E>>(discrete: &SemiDiscrete<D, S>, count: usize) -> Result<Self> {
        let (mut offsets, mut slopes) = (vec![E::ZERO; count], vec![0.0; count]);
        let mut u = vec![E::ZERO; count];
        for (p, _) in discrete.site().free() {
            let mut at = |value: f64| {
                (0..E::FIELDS).for_each(|i| u[p].set(i, value));
                let (filled, source) = (u[p], discrete.source(p, 0.0, &u));
                u[p] = E::ZERO;
                (filled, source)
            };
            let offset = at(0.0).1;
            if let Some(field) = (0..E::FIELDS).find(|&field| !offset.get(field).is_finite()) {
                return Err(Error::from(SolverError::Source { field, t: 0.0 }).at(p));
            }
            for power in (0..f64::MAX_EXP).step_by(STRIDE) {
                let unit = 2.0_f64.powi(power);
                let ((_, once), (filled, twice)) = (at(unit), at(2.0 * unit));
                // Beyond the range of the source what is known by then must do: it is held to the field found.
                if !filled.finite() || power > 0 && !(once.finite() && twice.finite()) {
                    break;
                }
                let change = once.get(0) - offset.get(0);
                slopes[p] = if E::FIELDS == 1 { change / unit } else { 0.0 };
                check(offset, slopes[p], unit, once).map_err(|error| error.at(p))?;
                check(offset, slopes[p], 2.0 * unit, twice).map_err(|error| error.at(p))?;
                if E::FIELDS == 1 && change.abs() >= 0.5 * offset.get(0).abs() {
                    break;
                }
            }
            offsets[p] = offset;
        }
        Ok(Self { offsets, slopes })
    }

    /// Whether the source is what was taken for it at the field found: it may be affine where it was probed and not here.
    fn confirm<const D: usize, S: Scene<D, Value = E>>(&self, discrete: &SemiDiscrete<D, S>, u: &[E]) -> Result<()> {
        discrete.site().free().try_for_each(|(p, _)| {
            let found = discrete.source(p, 0.0, u);
            check(self.offsets[p], self.slopes[p], u[p].get(0), found).map_err(|error| error.at(p))
        })
    }
}

/// Refuses a source that is not offset + slope u, but for rounding.
fn check<E: Fields>(offset: E, slope: f64, u: f64, found: E) -> Result<()> {
    let more = slope * u;
    for field in 0..E::FIELDS {
        let (offset, found) = (offset.get(field), found.get(field));
        let (expected, size) = (offset + more, offset.abs() + more.abs() + found.abs());
        if !(found.is_finite() && (found - expected).abs() <= ROUNDING * E::EPSILON * size) {
            return Err(SolverError::NotAffine { u, found, expected }.into());
        }
    }
    Ok(())
}

/// Roundings of a source and of the comparison, in eps of its values.
const ROUNDING: f64 = 64.0;
