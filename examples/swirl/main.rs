//! A swirl that returns to its start: error against run time of particles that stay (upwind of order 1, upwind DC-PSE
//! of order 3, central DC-PSE of order 2 and 4 with hyperviscosity) and of particles that the flow carries, remeshed
//! by several Lambda_{p,r}.
//!
//! A flow that turns back takes back the errors of central schemes and of particles that are not remeshed: they come
//! home better than they were on the way. So errors are taken at the end of the period T *and* at T/2, where the blob
//! is wound up. Remeshing after every step converges; remeshing when overlap is lost does not, because the distortion
//! between two remeshings is then as large whatever h.
//!
//! Prints a table, writes `swirl.csv`, `swirl_cost.svg`, `swirl_order.svg` and `swirl_field.svg`, and the quarters of
//! the period as VTU files with a PVD series, and exits with 1 when a claim does not hold. No claim is about seconds:
//! these are for one run on the machine at hand. The columns `hole_over_h` and `gap_over_h` are the overlap at T/2.
//!
//! `cargo run --release --features faer --example swirl [-- --quick] [-- --out DIR]`

mod claims;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
mod flow;
mod lost;
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
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use options::Options;
use record::{Moment, Record};
use runs::Method;
use scattered::Gammas;

fn main() -> ExitCode {
    options::run("swirl", swirl)
}

/// Particles along an axis of the figures of fields, and of the files for ParaView.
pub const SHOWN: usize = 64;

/// Runs the study; whether every claim holds.
fn swirl(options: &Options) -> Result<bool, Box<dyn Error>> {
    let sides: &[usize] = if options.quick { &[32, 48, SHOWN] } else { &[32, 48, SHOWN, 96, 128, 192] };
    let clock = Instant::now();
    let gammas = Gammas::find(flow::velocity)?;
    let [second, fourth] = [gammas.second, gammas.fourth];
    let seconds = clock.elapsed().as_secs_f64();
    println!("gamma of the hyperviscosity: {second:.2e} (r = 2), {fourth:.2e} (r = 4), found in {seconds:.1} s\n");

    let (mut records, mut shown) = (Vec::new(), Vec::new());
    println!("{}", Record::TITLE);
    for method in Method::ALL {
        for &n in sides {
            let mut moments = Vec::new();
            let record = runs::solve(method, n, &gammas, |moment| moments.push(moment))?;
            println!("{}", record.row());
            records.push(record);
            if n == SHOWN {
                shown.push((method, moments));
            }
        }
    }
    let lines: Vec<String> = records.iter().map(Record::csv).collect();
    std::fs::write(options.out.join("swirl.csv"), format!("{}\n{}\n", Record::HEADER, lines.join("\n")))?;
    figures::cost(&options.out.join("swirl_cost.svg"), &records)?;
    figures::order(&options.out.join("swirl_order.svg"), &records)?;
    figures::fields(&options.out.join("swirl_field.svg"), &shown)?;
    for (method, name) in [(Method::Central(4), "swirl_dcpse"), (Method::Remeshed(4, 2), "swirl_remeshed")] {
        for (_, moments) in shown.iter().filter(|(own, _)| *own == method) {
            series(&options.out, name, moments)?;
        }
    }
    println!("written to {}\n", options.out.display());

    let claims = claims::check(&records, &[lost::wind_up(false)?, lost::wind_up(true)?]);
    for (text, holds) in &claims {
        println!("{} {text}", if *holds { "holds " } else { "FAILS " });
    }
    Ok(claims.iter().all(|(_, holds)| *holds))
}

/// The moments of a run as files.
fn series(folder: &Path, name: &str, moments: &[Moment]) -> Result<(), Box<dyn Error>> {
    let mut files = Vec::new();
    for (i, moment) in moments.iter().enumerate() {
        let file = format!("{name}_{i}.vtu");
        vtk::save(folder, &file, &moment.particles, &[("u", &moment.u), ("error", &moment.errors())])?;
        files.push((moment.t, file));
    }
    vtk::save_series(folder, &format!("{name}.pvd"), &files)
}
