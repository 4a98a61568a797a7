//! Scenes at rest: one sparse solve.

use super::fields::Fields;
use super::policy::GrowthPolicy;
use super::scene::Scene;
use super::semi_discrete::SemiDiscrete;
use crate::error::{Error, Result, SolverError};
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
/// on u. Without a boundary, or with fluxes alone, nothing fixes the level of u unless the source decays.
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
/// [`SolverError::Source`] naming the particle; [`SolverError::OpenLevel`] where any constant may be added to u; what [`SparseSolver::new`] and [`SparseSolver::solve`] refuse, naming
/// particles as rows.
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
    let slopes = slopes(&discrete, &zero)?;
    let matrix = discrete.matrix_with(0.0, 0.0, |p| slopes.get(p).copied().unwrap_or(0.0))?;
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
    Ok(SteadyState { u, report, condition: solver.condition()? })
}

/// Whether every row sums to zero, but for the rounding of its entries and of the diagonal, itself a sum of them.
fn annihilates_constants(matrix: &CsrMatrix) -> bool {
    (0..matrix.rows()).filter_map(|p| matrix.row(p)).all(|(_, row)| {
        let (sum, size) = row.iter().fold((0.0, 0.0), |(sum, size), a| (sum + a, size + f64::abs(*a)));
        f64::abs(sum) <= 2.0 * row.len() as f64 * f64::EPSILON * size
    })
}

/// dS/du of a source that is affine in u, particle by particle.
fn slopes<const D: usize, S: Scene<D>>(discrete: &SemiDiscrete<D, S>, zero: &[S::Value]) -> Result<Vec<f64>> {
    let filled = |value: f64| {
        let mut u = S::Value::ZERO;
        (0..S::Value::FIELDS).for_each(|i| u.set(i, value));
        vec![u; zero.len()]
    };
    let (one, two) = (filled(1.0), filled(2.0));
    let mut slopes = vec![0.0; zero.len()];
    for (p, _) in discrete.site().free() {
        let [a, b, c] = [zero, &one[..], &two[..]].map(|u| discrete.source(p, 0.0, u));
        for field in 0..S::Value::FIELDS {
            let (a, b, found) = (a.get(field), b.get(field), c.get(field));
            if ![a, b, found].iter().all(|s| s.is_finite()) {
                return Err(Error::from(SolverError::Source { field, t: 0.0 }).at(p));
            }
            // Of several fields none may depend on any: one matrix serves them all.
            let slope = if S::Value::FIELDS == 1 { b - a } else { 0.0 };
            let (expected, size) = (a + 2.0 * slope, a.abs() + 2.0 * b.abs() + found.abs());
            let rounding = ROUNDING * S::Value::EPSILON * size;
            if !((found - expected).abs() <= rounding && (b - a - slope).abs() <= rounding) {
                return Err(Error::from(SolverError::NotAffine { found, expected }).at(p));
            }
            slopes[p] = slope;
        }
    }
    Ok(slopes)
}

/// Roundings of a source and of the comparison, in eps of its values.
const ROUNDING: f64 = 64.0;
