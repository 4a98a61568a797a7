//! Heat on a lattice by particle strength exchange: one operator, one stepper, no solver.

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use parops::{Apply, CellList, Domain, Laplacian, Particles, Plan, Pse, Rk4, StepLimit, integrate};

mod options;

const END: f64 = 0.01;

fn main() -> ExitCode {
    options::run("lean_diffusion", |options| diffuse(if options.quick { 48 } else { 96 }))
}

fn diffuse(n: usize) -> Result<bool, Box<dyn Error>> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let pse = Pse::new(Laplacian::<2>, 4, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let laplacian = pse.assemble(&CellList::build(&particles, &torus, pse.cutoff())?)?;

    let wave = |x: &[f64; 2]| (TAU * x[0]).sin() * (TAU * x[1]).cos();
    let mut u: Vec<f64> = particles.points().iter().map(wave).collect();
    let mut stepper = Rk4::<Vec<f64>>::new();
    let limit = StepLimit::from_spectral_bound(laplacian.report().spectral_bound, 1.0)?;
    let plan = Plan::new(0.0, END, limit.step(&stepper))?.limit(limit);
    integrate(&mut stepper, &mut u, &plan, |_, u, du| laplacian.apply(u, du), |_, _, _| {})?;

    // PSE of order 4 damps this wave at the rate k^2 (1 - s^2/6), s = (k epsilon)^2/4.
    let rate = 2.0 * TAU * TAU;
    let decay = (-rate * END).exp();
    let s = rate * (2.0 / n as f64).powi(2) / 4.0;
    let bound = 2.0 * decay * rate * END * s * s / 6.0;
    let error = |(x, u): (&[f64; 2], &f64)| (u - decay * wave(x)).abs();
    let worst = particles.points().iter().zip(&u).map(error).fold(0.0, f64::max);
    println!("heat on {n} x {n} particles, {} steps: error {worst:.1e}, at most {bound:.1e}", plan.steps());
    Ok(worst < bound)
}
