//! What an implicit Euler step of diffusion costs: the first, which prepares the system, and one after it.
//!
//! Laplacian of DC-PSE, r = 2, on jittered sets (0.2 h) of a torus; dt in units of 1/(row sum). Sparse LU needs the
//! feature `faer`.

use std::time::Instant;

use parops::{
    BiCgStab, CellList, CsrMatrix, Cutoff, DcPse, Domain, Gmres, Implicit, Laplacian, Particles, Result, SolveReport,
    SparseSolver,
};

type Solver = (&'static str, fn(CsrMatrix) -> Result<SparseSolver>);

const SOLVERS: &[Solver] = &[
    #[cfg(feature = "faer")]
    ("lu", SparseSolver::lu),
    ("bicgstab", |matrix| SparseSolver::bicgstab(matrix, BiCgStab::new())),
    ("gmres", |matrix| SparseSolver::gmres(matrix, Gmres::new())),
];

/// The matrix and its largest row sum.
fn laplacian<const D: usize>(m: usize, reach: f64) -> Result<(CsrMatrix, f64)> {
    let particles = Particles::jittered([0.0; D], [1.0; D], [m; D], 0.2, 1)?;
    let torus = Domain::periodic([0.0; D], [1.0; D])?;
    let neighbors = CellList::build(&particles, &torus, Cutoff(reach / m as f64))?;
    let rows = DcPse::<Laplacian<D>, 2>::new().assemble(&neighbors)?;
    Ok((rows.to_csr(0)?, rows.report().spectral_bound))
}

fn measure<const D: usize>(m: usize, reach: f64) -> Result<()> {
    let (a, bound) = laplacian::<D>(m, reach)?;
    let n = a.rows();
    for number in [10.0, 1e3, 1e6] {
        for &(name, solver) in SOLVERS {
            let (mut u, dt): (Vec<f64>, _) = ((0..n).map(|p| (p as f64).sin()).collect(), number / bound);
            let mut euler = Implicit::euler(a.clone())?.solver(solver);
            let mut step = |i: u32| -> Result<(f64, SolveReport)> {
                let start = Instant::now();
                let report = euler.step(f64::from(i) * dt, dt, &mut u, &mut |t, g: &mut [f64]| {
                    g.iter_mut().enumerate().for_each(|(p, g)| *g = (p as f64 + t).cos());
                    Ok(())
                })?;
                Ok((start.elapsed().as_secs_f64() * 1e3, report))
            };
            let outcome = step(0).and_then(|(first, _)| {
                let (second, third) = (step(1)?, step(2)?);
                Ok((first, second.0.min(third.0), third.1))
            });
            match outcome {
                Ok((first, later, report)) => println!(
                    "{D}D N = {n:6}, {:4.1} a row, dt {number:7.0e}, {name:8}: first {first:8.1} ms, later {later:7.2} ms, \
                     {} iterations, residual {:.0e}",
                    a.entries() as f64 / n as f64,
                    report.iterations,
                    report.residual
                ),
                Err(error) => println!("{D}D N = {n:6}, dt {number:7.0e}, {name:8}: {error}"),
            }
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    // Under `cargo test` benches run unoptimized; small sets are enough to see them work.
    let whole = std::env::args().any(|argument| argument == "--bench");
    let (squares, cubes): (&[usize], &[usize]) = if whole { (&[32, 64, 128], &[10, 16]) } else { (&[16], &[8]) };
    for &m in squares {
        measure::<2>(m, 2.9)?;
    }
    for &m in cubes {
        measure::<3>(m, 2.9)?;
    }
    Ok(())
}
