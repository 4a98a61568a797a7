//! A cloud in a wind, by the upwind scheme on scattered particles that stay where they are.

use std::error::Error;
use std::process::ExitCode;

use parops::{AdvectionDiffusion, CellList, Domain, Euler, Eulerian, Particles, Spacing, UpwindGradient};

mod options;

const WIND: [f64; 2] = [1.0, 0.5];
const END: f64 = 0.2;

fn main() -> ExitCode {
    options::run("lean_upwind", |options| carry(if options.quick { 40 } else { 120 }))
}

fn carry(n: usize) -> Result<bool, Box<dyn Error>> {
    let h = 1.0 / n as f64;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 1)?.with_equal_volumes(1.0)?;
    let upwind = UpwindGradient::new(Spacing(h).epsilon(1.0)?, particles.volumes()?).support(3.0)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let neighbors = CellList::build(&particles, &torus, upwind.cutoff())?;
    let scene = AdvectionDiffusion::<2>::new().advection(WIND, upwind);
    let mut run = Eulerian::new(scene, &particles, &neighbors, Euler::new())?;

    let cloud = |x: &[f64; 2]| if x.iter().all(|x| (0.2..0.5).contains(x)) { 1.0 } else { 0.0 };
    let mut u: Vec<f64> = particles.points().iter().map(cloud).collect();
    let dt = run.limits(&u)?.step(&Euler::<Vec<f64>>::new());
    let ledger = run.advance(&mut u, END, dt)?;

    // No value leaves the range of the start, and the middle of the cloud goes with the wind.
    let total = &ledger.fields[0];
    let middle = total.first.map(|moment| moment / total.mass);
    let miss = (0..2).map(|i| (middle[i] - 0.35 - END * WIND[i]).abs()).fold(0.0, f64::max);
    println!("wind over {n} x {n} particles, {} steps: middle at {middle:.3?}, {miss:.1e} off", ledger.step);
    println!("values from {:.1e} to {:.3}", total.min, total.max);
    Ok(miss < h && total.min >= 0.0 && total.max <= 1.0)
}
