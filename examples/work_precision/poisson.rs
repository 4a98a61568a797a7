//! div(D grad u) = -S on scattered sets, the disc and the ball, by DC-PSE with GMRES, BiCGSTAB and sparse LU.
//!
//! u is given on the sphere and on half of the circle, du/dn on the other half. Iterations have the incomplete factors
//! ILU(0) of the rows, and end far below the error in space. Errors are relative, over all particles.
//!
//! In the ball order 8 is left out: its rows take 440 of a few thousand particles, and a minute. Order 8 in the disc and 6 in
//! the ball start a set later: on the coarsest, rows take a quarter and an eighth of all particles, and the errors fall from
//! there as h^11.5 and h^11.8, which tells nothing of their orders.

use std::error::Error;

use parops::report::{Phase, Sample, observed_order};
use parops::{
    BiCgStab, BoundaryRows, CsrMatrix, DcPse, DivGrad, Domain, Gmres, Gradient, Laplacian, Nearest, SparseSolver,
};

use crate::bench::Bench;
use crate::manufactured::{diffusivity, gradient, solution, source};
use crate::round::{Round, ball, disc, gives_value};

const SCENE: &str = "poisson";
/// The relative residual at which iterations end.
const TOLERANCE: f64 = 1e-13;
/// Neighbors of the rows of normal derivatives, in units of their conditions.
const NEUMANN_RATIO: f64 = 3.0;
/// How far the order over all refinements may be from r.
const BAND: f64 = 0.3;
/// How far the errors of two solvers may be apart, relative to them, and what the residual leaves of each.
const SAME: f64 = 0.01;
const SOLVED: f64 = 1e-11;

const PHASES: &str = "Build makes the rows and the matrix. Step is the solver: its factors, and its iterations with their products, \
    which are not timed apart.";
const COARSE: &str = "Order 8 in the disc and 6 in the ball start a set later: on the coarsest, a row takes a quarter and an \
    eighth of all particles, and errors fall faster from there than the order says. Order 8 in the ball, of 440 neighbors, is \
    left out.";

type Solver = (&'static str, fn(CsrMatrix) -> parops::Result<SparseSolver>);

const SOLVERS: &[Solver] = &[
    ("GMRES", |matrix| SparseSolver::gmres(matrix, Gmres::new().tolerance(TOLERANCE)?)),
    ("BiCGSTAB", |matrix| SparseSolver::bicgstab(matrix, BiCgStab::new().tolerance(TOLERANCE)?)),
    ("LU", SparseSolver::lu),
];

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    bench.note(SCENE, PHASES);
    bench.note(SCENE, COARSE);
    let across = [24, 36, 54, 81];
    for order in [2, 4, 6] {
        let most = if bench.quick && order < 6 { 3 } else { 4 };
        refine(bench, "disc", order, &across[..most], disc)?;
    }
    if !bench.quick {
        refine(bench, "disc", 8, &across[1..], disc)?;
    }
    let across = [12, 16, 20, 25];
    for order in [2, 4] {
        refine(bench, "ball", order, &across[..if bench.quick { 2 } else { 4 }], ball)?;
    }
    refine(bench, "ball", 6, &across[1..3], ball)?;
    claims(bench);
    Ok(())
}

/// Samples of each set by each solver.
fn refine<const D: usize>(
    bench: &mut Bench,
    name: &str,
    order: u32,
    across: &[usize],
    set: fn(usize) -> parops::Result<Round<D>>,
) -> parops::Result<()> {
    for &n in across {
        let set = set(n)?;
        for solver in SOLVERS {
            solve(bench, name, order, &set, solver)?;
        }
    }
    Ok(())
}

fn solve<const D: usize>(
    bench: &mut Bench,
    name: &str,
    order: u32,
    set: &Round<D>,
    &(solver, make): &Solver,
) -> parops::Result<()> {
    let points = set.particles.points();
    let what = Sample {
        stepper: solver.to_string(),
        n: points.len(),
        h: set.h,
        ..Sample::new(SCENE, D, name, "DC-PSE", order)
    };
    let right = right(set);
    bench.sample(what, |watch, sample| {
        let neighbors = watch.time(Phase::Neighbors, || near(set, order))?;
        let matrix = watch.time(Phase::Build, || matrix(set, order, &neighbors))?;
        sample.neighbors = matrix.entries() as f64 / points.len() as f64;
        let mut u = vec![0.0; points.len()];
        let solved = watch.time(Phase::Step, || make(matrix)?.solve(&right, &mut u))?;
        sample.steps = solved.iterations as u64;
        sample.errors(u, points.iter().map(solution));
        Ok(())
    })?;
    Ok(())
}

/// As many neighbors as the rows of the Laplacian and of normal derivatives need.
fn near<const D: usize>(set: &Round<D>, order: u32) -> parops::Result<Nearest<D>> {
    let laplacian = DcPse::at_order(Laplacian::<D>, order)?.fewest_neighbors::<D>()?;
    let normal = DcPse::at_order(Gradient::<D>, order)?.neighbors_per_condition(NEUMANN_RATIO)?;
    Nearest::build(&set.particles, &Domain::open(), laplacian.max(normal.fewest_neighbors::<D>()?))
}

fn matrix<const D: usize>(set: &Round<D>, order: u32, neighbors: &Nearest<D>) -> parops::Result<CsrMatrix> {
    let coefficient: Vec<f64> = set.particles.points().iter().map(diffusivity).collect();
    let interior = DivGrad::new(DcPse::at_order(Laplacian::<D>, order)?, coefficient)?;
    let mut matrix = interior.assemble(neighbors)?.to_csr(0)?;
    BoundaryRows::build(&set.conditions(), order, neighbors)?.replace_in(&mut matrix)?;
    Ok(matrix)
}

/// -S inside; u or du/dn on the boundary.
fn right<const D: usize>(set: &Round<D>) -> Vec<f64> {
    let points = set.particles.points();
    let mut right: Vec<f64> = points.iter().map(|x| -source(x)).collect();
    for &(p, normal) in &set.boundary {
        let slope = || gradient(&points[p]).iter().zip(&normal).map(|(du, n)| du * n).sum();
        right[p] = if gives_value(&normal) { solution(&points[p]) } else { slope() };
    }
    right
}

/// Every order shows, and no solver changes the error.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks().iter().filter(|task| task.samples()[0].scene == SCENE) {
        let all = task.series();
        for series in &all {
            let (first, last) = (series[0], series[series.len() - 1]);
            let observed = observed_order([first.h, last.h], [first.error_l2, last.error_l2]).unwrap_or(0.0);
            let order = f64::from(last.order);
            let shown =
                format!("{}, {}: observed order {observed:.2}, within {BAND} of {order}", last.set, last.label());
            found.push(((observed - order).abs() <= BAND, shown));
            let finest = all.iter().map(|other| other[other.len() - 1]).filter(|other| other.order == last.order);
            let apart = finest.map(|other| (other.error_l2 - last.error_l2).abs()).fold(0.0, f64::max);
            let allowed = SAME * last.error_l2 + SOLVED;
            let text = format!(
                "{}, {}: an error of {:.2e}, {apart:.0e} from those by other solvers, at most {allowed:.0e}",
                last.set,
                last.label(),
                last.error_l2
            );
            found.push((apart <= allowed, text));
        }
    }
    found.into_iter().for_each(|(holds, text)| bench.claim(SCENE, holds, text));
}
