//! The observed order of DC-PSE for every multi-index of degree at most 3, r = 1, 2, 3, 4 and 6, in 1D, 2D and 3D, on
//! lattices, jittered, quasi-random and boundary sets, at default settings with the 2 l nearest neighbors. Writes
//! docs/orders.md and exits with 1 where an order leaves its band.
//!
//! Interior particles are those whose stencil touches no face; the others have a norm of their own. Norms of the larger
//! sets are over a random sample of their particles, all multi-indices of one degree from one factorization.
//!
//! `cargo run --release --example orders [-- --quick] [-- --out DIR]`; `--quick` observes one operator per dimension and
//! writes orders.md to the folder given.

mod bands;
mod measure;
#[path = "../options/mod.rs"]
mod options;
mod plan;
mod sets;
mod table;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use options::Options;
use sets::Set;
use table::Table;

fn main() -> ExitCode {
    options::run("orders", matrix)
}

/// Orders r of the full matrix.
const ORDERS: [u32; 5] = [1, 2, 3, 4, 6];

/// Observes every order; whether all are within their bands.
fn matrix(options: &Options) -> Result<bool, Box<dyn Error>> {
    let start = Instant::now();
    let mut table = Table::default();
    if options.quick {
        table.observe::<1, 1>(Set::Boundary, 2, 4)?;
        table.observe::<2, 3>(Set::Jittered, 2, 2)?;
        table.observe::<3, 3>(Set::Jittered, 1, 2)?;
    } else {
        for order in ORDERS {
            for set in [Set::Lattice, Set::Jittered, Set::QuasiRandom, Set::Boundary] {
                table.observe::<1, 1>(set, 0, order)?;
                table.observe::<1, 1>(set, 1, order)?;
                table.observe::<1, 1>(set, 2, order)?;
                table.observe::<1, 1>(set, 3, order)?;
                table.observe::<2, 1>(set, 0, order)?;
                table.observe::<2, 2>(set, 1, order)?;
                table.observe::<2, 3>(set, 2, order)?;
                table.observe::<2, 4>(set, 3, order)?;
                table.observe::<3, 1>(set, 0, order)?;
                table.observe::<3, 3>(set, 1, order)?;
                table.observe::<3, 6>(set, 2, order)?;
                table.observe::<3, 10>(set, 3, order)?;
            }
        }
    }
    let path = if options.quick {
        options.out.join("orders.md")
    } else {
        PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("docs/orders.md")
    };
    std::fs::write(&path, table.markdown())?;
    println!("{} orders after {:.0} s, written to {}", table.len(), start.elapsed().as_secs_f64(), path.display());
    for line in table.violations() {
        println!("FAILS  {line}");
    }
    Ok(table.violations().is_empty())
}
