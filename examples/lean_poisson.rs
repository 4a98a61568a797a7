//! Poisson's equation on scattered particles by DC-PSE and one sparse solve.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::process::ExitCode;

use parops::{AdvectionDiffusion, Boundary, BoundaryCondition, DcPse, Domain, Laplacian, Nearest, Particles, steady};

mod options;

fn main() -> ExitCode {
    options::run("lean_poisson", |options| solve(if options.quick { 24 } else { 72 }))
}

fn solve(n: usize) -> Result<bool, Box<dyn Error>> {
    // Scattered inside, in rows along the walls.
    let h = 1.0 / n as f64;
    let mut points = Particles::jittered([0.5 * h; 2], [1.0 - 0.5 * h; 2], [n - 1; 2], 0.3, 1)?.points().to_vec();
    let inside = points.len();
    for i in 0..n {
        let s = i as f64 * h;
        points.extend([[s, 0.0], [1.0, s], [1.0 - s, 1.0], [0.0, 1.0 - s]]);
    }
    let particles = Particles::new(points)?;
    let walls = (inside..particles.len()).map(BoundaryCondition::dirichlet);

    // -(u_xx + u_yy) = 5 pi^2 u for this u, which is also what stands at the walls.
    let exact = |x: &[f64; 2]| (PI * x[0]).sin() * (TAU * x[1]).cos();
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), laplacian.fewest_neighbors::<2>()?)?;
    let scene = AdvectionDiffusion::<2>::new()
        .diffusion(1.0, laplacian)
        .source(|x, _, _| 5.0 * PI * PI * exact(x))
        .boundary(Boundary::new(2).conditions(walls), |_, x, _| exact(x));
    let state = steady(scene, &particles, &neighbors)?;

    let error = |(x, u): (&[f64; 2], &f64)| (u - exact(x)).abs();
    let worst = particles.points().iter().zip(&state.u).map(error).fold(0.0, f64::max);
    // Rows of order 2 miss by (k h)^2 and less.
    let bound = (TAU * h).powi(2);
    println!("Poisson at {} particles: error {worst:.1e}, at most {bound:.1e}", particles.len());
    println!("condition {:.0}, residual of the solve {:.1e}", state.condition, state.report.residual);
    Ok(worst < bound)
}
