//! What a time scheme costs at equal error where diffusion is stiff: div(D grad u) on a torus, where D jumps by 300, by PSE
//! on a lattice and by DC-PSE on scattered particles.
//!
//! Explicit Euler, SSP-RK3 and RK4 at their limits and below, RKL2, implicit Euler and Crank-Nicolson (each by sparse LU
//! and by BiCGSTAB) at steps of any length. Errors are root mean squares over what is left of the field, against the
//! exact propagator of the same rows, so they are those of time alone. Then single steps of 1 to 10^6 explicit ones. Prints
//! tables, writes `stiff_diffusion.csv`, `stiff_diffusion_numbers.csv` and three figures, and exits with 1 when a claim does
//! not hold.
//!
//! An apply is one sweep over the rows, or one product with the matrix of an implicit step; what a sparse LU costs shows in
//! the seconds only, its factors among them.
//!
//! `cargo run --release --features faer --example stiff_diffusion [-- --quick] [-- --out DIR]`

mod claims;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../options/mod.rs"]
mod options;
mod scheme;
mod setting;
mod study;

use std::process::ExitCode;

fn main() -> ExitCode {
    options::run("stiff_diffusion", study::run)
}
