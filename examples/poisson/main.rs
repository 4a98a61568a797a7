//! div(D grad u) + S = 0 with a diffusivity D that varies, on scattered particles in a square with a hole and in a ball.
//!
//! Interior rows are those of `DivGrad` over the DC-PSE Laplacian of order r = 2 and 4, boundary rows those of
//! `BoundaryRows` of the same order: u given on two sides of the square and on the upper half of the sphere, du/dn on
//! the other sides, around the hole and on the lower half. One sparse LU gives u; D, u and S are manufactured. Prints a
//! table, writes `poisson.csv`, `poisson_order.svg`, `poisson_square.svg` and `poisson_ball.svg`, and exits with 1 where
//! an observed order is below r - 0.3.
//!
//! `cargo run --release --features faer --example poisson [-- --quick] [-- --out DIR]`

mod field;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../map/mod.rs"]
mod map;
#[path = "../options/mod.rs"]
mod options;
mod sets;
mod solve;
mod study;

use std::process::ExitCode;

fn main() -> ExitCode {
    options::run("poisson", study::run)
}
