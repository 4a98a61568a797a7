//! The gradient of values at scattered points, and nothing else.

use std::error::Error;
use std::process::ExitCode;

use parops::{DcPse, Domain, Gradient, Nearest, Particles};

mod options;

fn main() -> ExitCode {
    options::run("lean_derivative", |options| differentiate(if options.quick { 40 } else { 160 }))
}

fn differentiate(n: usize) -> Result<bool, Box<dyn Error>> {
    // Yours may come from a file: any points, and one value for each.
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.3, 1)?;
    let values: Vec<f64> = particles.points().iter().map(|x| (3.0 * x[0]).sin() * x[1].exp()).collect();

    let gradient = DcPse::<Gradient<2>, 2>::new();
    let neighbors = Nearest::build(&particles, &Domain::open(), gradient.fewest_neighbors::<2>()?)?;
    let rows = gradient.assemble(&neighbors)?;
    let mut slopes = vec![[0.0; 2]; particles.len()];
    rows.apply_all(&values, &mut slopes)?;

    let (mut worst, mut steepest) = (0.0_f64, 0.0_f64);
    for (x, slope) in particles.points().iter().zip(&slopes) {
        let exact = [3.0 * (3.0 * x[0]).cos() * x[1].exp(), (3.0 * x[0]).sin() * x[1].exp()];
        for (slope, exact) in slope.iter().zip(exact) {
            (worst, steepest) = (worst.max((slope - exact).abs()), steepest.max(exact.abs()));
        }
    }
    // Rows of order 2 miss by (k h)^2 and less, with k = 3 the steepest wave number of the values.
    let (error, bound) = (worst / steepest, (3.0 / n as f64).powi(2));
    println!("gradient at {} points: relative error {error:.1e}, at most {bound:.1e}", particles.len());
    println!("largest residual of a row: {:.1e}", rows.report().residual);
    Ok(error < bound)
}
