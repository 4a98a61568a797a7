//! A blob in a vortex that turns back, on particles that the flow carries and a mesh replaces.

use std::error::Error;
use std::f64::consts::PI;
use std::process::ExitCode;

use parops::{AdvectionDiffusion, Carried, Domain, Lagrangian, Lambda, Mesh, Particles, Remeshing, Rk4, Trigger};

mod options;

fn main() -> ExitCode {
    options::run("lean_remeshed", |options| turn(if options.quick { 48 } else { 128 }))
}

fn turn(n: usize) -> Result<bool, Box<dyn Error>> {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let mesh = Mesh::nodes(&torus, [n; 2])?;
    let particles = Particles::new(mesh.points().collect())?.with_equal_volumes(1.0)?;
    // At t = 1 every particle is back at its place.
    let vortex = |x: &[f64; 2], t: f64| {
        let [(sx, cx), (sy, cy)] = x.map(|x| (PI * x).sin_cos());
        let speed = 2.0 * sx * sy * (PI * t).cos();
        [speed * sx * cy, -speed * cx * sy]
    };
    let blob = |x: &[f64; 2]| (-((x[0] - 0.5).powi(2) + (x[1] - 0.7).powi(2)) / 0.02).exp();
    let u: Vec<f64> = particles.points().iter().map(blob).collect();

    let scene = AdvectionDiffusion::<2>::new().advection(vortex, Carried);
    let remeshing = Remeshing { kernel: Lambda::<4, 2>::new()?, mesh, trigger: Trigger::Steps(2), threshold: 0.0 };
    let mut run = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?.remeshing(remeshing)?;
    run.advance(1.0, 1.0 / n as f64)?;

    let error = |(x, u): (&[f64; 2], f64)| (u - blob(x)).abs();
    let worst = run.points().iter().zip(run.values()).map(error).fold(0.0, f64::max);
    let ledger = run.ledger();
    println!("vortex on {n} x {n} particles, {} remeshings: error {worst:.1e}", ledger.remeshings);
    println!("mass has drifted by {:.1e}", ledger.fields[0].drift);
    Ok(worst < 0.01 && ledger.fields[0].drift.abs() < 1e-12)
}
