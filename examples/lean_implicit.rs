//! Stiff heat: implicit steps, each as long as thousands of explicit ones.

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

use parops::{AdvectionDiffusion, DcPse, Domain, Euler, Eulerian, Face, ImplicitScheme, Laplacian, Nearest, Particles};

mod options;

const DIFFUSIVITY: f64 = 100.0;
const DT: f64 = 0.1;

fn main() -> ExitCode {
    options::run("lean_implicit", |options| warm(if options.quick { 32 } else { 64 }))
}

fn warm(n: usize) -> Result<bool, Box<dyn Error>> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 1)?;
    // u = 0 at x = 0 and x = 1.
    let channel = Domain::new([0.0; 2], [1.0; 2], [[Face::MirrorOdd; 2], [Face::Periodic; 2]])?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&particles, &channel, laplacian.fewest_neighbors::<2>()?)?;

    // Heat comes and goes slowly, and spreads fast: u = cos(t) sin(2 pi x).
    let wave = |x: &[f64; 2]| (TAU * x[0]).sin();
    let heating = move |x: &[f64; 2], t: f64, _| (DIFFUSIVITY * TAU * TAU * t.cos() - t.sin()) * wave(x);
    let scene = AdvectionDiffusion::<2>::new().diffusion(DIFFUSIVITY, laplacian).source(heating);
    let mut run = Eulerian::new(scene, &particles, &neighbors, ImplicitScheme::euler())?;

    let mut u: Vec<f64> = particles.points().iter().map(wave).collect();
    let explicit = run.limits(&u)?.steps(DT, &Euler::<Vec<f64>>::new());
    run.advance(&mut u, 1.0, DT)?;

    let error = |(x, u): (&[f64; 2], &f64)| (u - 1.0_f64.cos() * wave(x)).abs();
    let worst = particles.points().iter().zip(&u).map(error).fold(0.0, f64::max);
    // Rows of order 2 miss by a quarter of (k h)^2 and less.
    let bound = (TAU / n as f64).powi(2) / 4.0;
    println!("heat at {} particles: error {worst:.1e}, at most {bound:.1e}", particles.len());
    println!("one step of {DT} in the place of {explicit:.0} explicit ones");
    Ok(worst < bound && explicit > 1000.0)
}
