//! Every family of kernels with its derivatives: smoothing kernels W, exchange kernels eta, one-sided and remeshing
//! kernels, all in one dimension; and Figures 1 and 2 of notes 000, point and smooth particles and the lattice hat.
//!
//! Normalization, moments and interpolation are summed from the same curves. Writes SVG files and exits with 1 when a
//! claim does not hold.
//!
//! `cargo run --release --example kernels [-- --quick] [-- --out DIR]`

mod claim;
mod exchange;
#[allow(dead_code, reason = "curves here have no markers but lone circles")]
#[path = "../figure/mod.rs"]
mod figure;
mod lambda;
mod notes;
mod one_sided;
#[path = "../options/mod.rs"]
mod options;
mod smoothing;

use std::error::Error;
use std::process::ExitCode;

use claim::Claims;
use figure::draw;
use options::Options;

fn main() -> ExitCode {
    options::run("kernels", gallery)
}

/// Draws all figures; whether every claim holds.
fn gallery(options: &Options) -> Result<bool, Box<dyn Error>> {
    let points = if options.quick { 200 } else { 800 };
    let mut claims = Claims::default();
    let figures = [
        ("kernels_smoothing.svg", smoothing::panels(points, &mut claims)?),
        ("kernels_exchange_first.svg", exchange::panels(1, points, &mut claims)?),
        ("kernels_exchange_second.svg", exchange::panels(2, points, &mut claims)?),
        ("kernels_exchange_third.svg", exchange::panels(3, points, &mut claims)?),
        ("kernels_one_sided_first.svg", one_sided::panels(1, points, &mut claims)?),
        ("kernels_one_sided_second.svg", one_sided::panels(2, points, &mut claims)?),
        ("kernels_lambda.svg", lambda::panels(points, &mut claims)?),
        ("kernels_particles.svg", notes::particles(points, &mut claims)),
        ("kernels_hat.svg", notes::hat(&mut claims)),
    ];
    for (name, panels) in &figures {
        draw(&options.out.join(name), panels)?;
    }
    println!("{} figures written to {}", figures.len(), options.out.display());
    Ok(claims.hold())
}
