//! Advection and diffusion in the plane by particles that stay and by particles that move, beside the exact solution.
//!
//! Cells that turn in themselves are carried by a wind and decay; u is known at any time, and nothing moves it but
//! the wind, though any scheme must bear the turning. Scattered particles that stay take the advection from upwind
//! (order 1) or by central DC-PSE with hyperviscosity (order 2 and 4); particles that move exchange strength by PSE
//! (order 2 and 4) and are remeshed after every step.
//!
//! Prints a table, writes `advection_diffusion_2d.csv`, the ledger of a run of each method, figures of the orders, of
//! fields and errors, and of the drift of the mass, and the field of two methods as VTU files with PVD series. Exits
//! with 1 when an observed order, an error or a conservation law does not hold.
//!
//! `cargo run --release --features faer --example advection_diffusion_2d [-- --quick] [-- --out DIR]`

mod claims;
mod exact;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../map/mod.rs"]
mod map;
#[path = "../options/mod.rs"]
mod options;
mod record;
mod runs;
#[path = "../scattered/mod.rs"]
mod scattered;
#[path = "../vtk/mod.rs"]
mod vtk;

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use options::Options;
use record::Record;
use runs::{Method, Solved};
use scattered::Gammas;

fn main() -> ExitCode {
    options::run("advection_diffusion_2d", solve_all)
}

/// Particles along an axis of the figures of fields, the ledgers, and the files for ParaView.
const SHOWN: usize = 40;

/// Runs all methods on all sets; whether every claim holds.
fn solve_all(options: &Options) -> Result<bool, Box<dyn Error>> {
    let sides: &[usize] = if options.quick { &[25, 30, SHOWN] } else { &[25, 30, SHOWN, 50, 60, 80, 100] };
    let gammas = Gammas::find(exact::velocity)?;
    let (mut records, mut shown) = (Vec::new(), Vec::new());
    println!("{}", Record::TITLE);
    for method in Method::ALL {
        for &n in sides {
            let clock = Instant::now();
            let solved = runs::solve(method, n, &gammas)?;
            let record = solved.record(clock.elapsed().as_secs_f64()).ok_or("a run without a step")?;
            println!("{}", record.row());
            records.push(record);
            if n == SHOWN {
                shown.push(solved);
            }
        }
    }
    let out = |name: &str| options.out.join(format!("advection_diffusion_2d{name}"));
    let lines: Vec<String> = records.iter().map(Record::csv).collect();
    std::fs::write(out(".csv"), format!("{}\n{}\n", Record::HEADER, lines.join("\n")))?;
    figures::order(&out("_order.svg"), &records)?;
    figures::fields(&out("_field.svg"), &shown)?;
    figures::drift(&out("_drift.svg"), &shown)?;
    for solved in &shown {
        let (kind, order) = match solved.method {
            Method::Upwind => ("upwind", 1),
            Method::DcPse(order) => ("dcpse", order),
            Method::Moving(order) => ("moving", order),
        };
        let mut file = BufWriter::new(File::create(out(&format!("_ledger_{kind}_{order}.csv")))?);
        solved.ledger.write_csv(&mut file)?;
        if order == 4 {
            series(&options.out, &format!("advection_diffusion_2d_{kind}"), solved)?;
        }
    }
    println!("written to {}\n", options.out.display());

    let claims = claims::check(&records);
    for (text, holds) in &claims {
        println!("{} {text}", if *holds { "holds " } else { "FAILS " });
    }
    Ok(claims.iter().all(|(_, holds)| *holds))
}

/// The moments of a run as files.
fn series(folder: &Path, name: &str, solved: &Solved) -> Result<(), Box<dyn Error>> {
    let mut files = Vec::new();
    for (i, moment) in solved.moments.iter().enumerate() {
        let file = format!("{name}_{i}.vtu");
        vtk::save(folder, &file, &moment.particles, &[("u", &moment.u), ("error", &moment.errors())])?;
        files.push((moment.t, file));
    }
    vtk::save_series(folder, &format!("{name}.pvd"), &files)
}
