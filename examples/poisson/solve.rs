//! One set solved and compared.

use std::time::Instant;

use parops::{BoundaryCondition, BoundaryRows, DcPse, DivGrad, Domain, Gradient, Laplacian, Nearest, SparseSolver};

use crate::field::{diffusivity, gradient, solution, source};
use crate::sets::Scattered;

/// One line of the table, and the fields for the figures.
pub struct Solved<const D: usize> {
    pub order: u32,
    pub h: f64,
    pub particles: usize,
    pub boundary: usize,
    /// Mean number of entries a row of the matrix.
    pub entries: f64,
    /// Relative errors over all particles.
    pub l2: f64,
    pub linf: f64,
    /// Estimated condition of the matrix with scaled rows, and relative residual of the solve.
    pub condition: f64,
    pub residual: f64,
    /// Seconds for rows and matrix, and for factors and solve.
    pub build: f64,
    pub solve: f64,
    pub points: Vec<[f64; D]>,
    pub u: Vec<f64>,
    pub error: Vec<f64>,
}

/// Neighbors of the rows of normal derivatives, in units of their conditions.
const NEUMANN_RATIO: f64 = 3.0;

pub fn solve<const D: usize>(set: &Scattered<D>, order: u32) -> parops::Result<Solved<D>> {
    let points = set.particles.points();
    let of = |f: fn(&[f64; D]) -> f64| points.iter().map(f).collect::<Vec<f64>>();

    let start = Instant::now();
    let laplacian = DcPse::at_order(Laplacian::<D>, order)?;
    let normal = DcPse::at_order(Gradient::<D>, order)?.neighbors_per_condition(NEUMANN_RATIO)?;
    let needed = laplacian.fewest_neighbors::<D>()?.max(normal.fewest_neighbors::<D>()?);
    let neighbors = Nearest::build(&set.particles, &Domain::open(), needed)?;
    let interior = DivGrad::new(laplacian, of(diffusivity))?.assemble(&neighbors)?;
    let conditions: Vec<BoundaryCondition<D>> = set.conditions.iter().map(|boundary| boundary.condition).collect();
    let boundary = BoundaryRows::build(&conditions, order, &neighbors)?;
    let mut matrix = interior.to_csr(0)?;
    boundary.replace_in(&mut matrix)?;

    // div(D grad u) = -S inside; u or du/dn at the boundary.
    let mut right: Vec<f64> = points.iter().map(|x| -source(x)).collect();
    for at in &set.conditions {
        let p = at.condition.particle();
        let slope = |n: &[f64; D]| gradient(&points[p]).iter().zip(n).map(|(du, n)| du * n).sum();
        right[p] = at.normal.as_ref().map_or_else(|| solution(&points[p]), slope);
    }
    let entries = matrix.entries() as f64 / points.len() as f64;
    let build = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut lu = SparseSolver::lu(matrix)?;
    let mut u = vec![0.0; points.len()];
    let report = lu.solve(&right, &mut u)?;
    let solve = start.elapsed().as_secs_f64();

    let exact = of(solution);
    let error: Vec<f64> = u.iter().zip(&exact).map(|(u, exact)| (u - exact).abs()).collect();
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    Ok(Solved {
        order,
        h: set.h,
        particles: points.len(),
        boundary: conditions.len(),
        entries,
        l2: norm(&error) / norm(&exact),
        linf: largest(&error) / largest(&exact),
        condition: lu.condition()?,
        residual: report.residual,
        build,
        solve,
        points: points.to_vec(),
        u,
        error,
    })
}
