//! How overlap, cutoff and order trade: the Laplacian of a wave on a lattice and on jittered particles, 2D and 3D, by PSE of
//! order 2 to 8 and DC-PSE of order 2 to 6. Varied are epsilon/h (PSE) or the number of neighbors (DC-PSE), and
//! cutoff/epsilon. Prints a table, writes `choose_epsilon.csv`, figures, and the error of DC-PSE as VTU files with a
//! PVD series over the neighbors per condition, and exits with 1 when a claim does not hold.
//!
//! Errors are relative root mean squares. Rows of PSE beyond its limits are let through and counted as refused. In the
//! CSV `n` is the number of particles, `sum_abs_h2` the largest h^2 sum |w| of a row.
//!
//! `cargo run --release --example choose_epsilon [-- --quick] [-- --out DIR]`

mod claims;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../options/mod.rs"]
mod options;
mod study;
#[path = "../vtk/mod.rs"]
mod vtk;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use options::Options;
use study::{Record, Scene, Varied};

fn main() -> ExitCode {
    options::run("choose_epsilon", choose)
}

/// Jitter of the scattered sets, in units of h.
pub const JITTER: f64 = 0.2;
/// cutoff/epsilon of DC-PSE where it is not varied, and neighbors per condition.
const CUTOFF: f64 = 2.2;
const NEIGHBORS: f64 = 2.0;

/// What is tried in one dimension.
struct Plan {
    /// Particles along an axis: of PSE at least twelve times the largest overlap, because the torus must be two cutoffs
    /// wide.
    pse_side: usize,
    dcpse_side: usize,
    pse_orders: &'static [u32],
    dcpse_orders: &'static [u32],
    overlaps: &'static [f64],
    /// epsilon/h where the cutoff of PSE is varied, and cutoff/epsilon tried.
    overlap: f64,
    cutoffs: &'static [f64],
}

const OVERLAPS: &[f64] = &[1.0, 1.15, 1.3, 1.5, 1.75, 2.0, 2.5, 3.0, 3.6, 4.3];
const CUTOFFS: &[f64] = &[2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0];
const RATIOS: &[f64] = &[1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0];

impl Plan {
    fn plane(quick: bool) -> Self {
        let (side, last) = if quick { (36, 8) } else { (64, 10) };
        Self {
            pse_side: side,
            dcpse_side: side,
            pse_orders: &[2, 4, 6, 8],
            dcpse_orders: &[2, 3, 4, 5, 6],
            overlaps: &OVERLAPS[..last],
            overlap: 2.0,
            cutoffs: CUTOFFS,
        }
    }

    fn space(quick: bool) -> Self {
        let (pse_side, dcpse_side, overlap) = if quick { (16, 10, 1.3) } else { (18, 14, 1.5) };
        Self {
            pse_side,
            dcpse_side,
            pse_orders: if quick { &[4, 8] } else { &[2, 4, 6, 8] },
            dcpse_orders: if quick { &[2, 4] } else { &[2, 3, 4, 5, 6] },
            overlaps: if quick { &[1.0, 1.3] } else { &OVERLAPS[..4] },
            overlap,
            cutoffs: if quick { &CUTOFFS[..4] } else { CUTOFFS },
        }
    }

    fn run<const D: usize>(&self, records: &mut Vec<Record>) -> parops::Result<()> {
        let mut add = |record: Record| {
            println!("{}", record.row());
            records.push(record);
        };
        for jitter in [0.0, JITTER] {
            let scene = Scene::<D>::new(self.pse_side, jitter)?;
            for &order in self.pse_orders {
                for &overlap in self.overlaps {
                    add(scene.pse(Varied::Overlap, order, overlap, None)?);
                }
                for &cutoff in self.cutoffs {
                    add(scene.pse(Varied::Cutoff, order, self.overlap, Some(cutoff))?);
                }
            }
        }
        let scene = Scene::<D>::new(self.dcpse_side, JITTER)?;
        for &order in self.dcpse_orders {
            for &ratio in RATIOS {
                add(scene.dcpse(Varied::Overlap, order, ratio, CUTOFF)?.0);
            }
            for cutoff in [1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6, 4.0, 4.6] {
                add(scene.dcpse(Varied::Cutoff, order, NEIGHBORS, cutoff)?.0);
            }
        }
        Ok(())
    }
}

/// Runs the study; whether every claim holds.
fn choose(options: &Options) -> Result<bool, Box<dyn Error>> {
    let start = Instant::now();
    let mut records = Vec::new();
    println!("{}", Record::TITLE);
    Plan::plane(options.quick).run::<2>(&mut records)?;
    Plan::space(options.quick).run::<3>(&mut records)?;

    let lines: Vec<String> = records.iter().map(Record::csv).collect();
    std::fs::write(options.out.join("choose_epsilon.csv"), format!("{}\n{}\n", Record::HEADER, lines.join("\n")))?;
    figures::draw_all(&options.out, &records)?;
    errors(&options.out)?;
    println!("written to {} after {:.1} s\n", options.out.display(), start.elapsed().as_secs_f64());

    let claims = claims::check(&records);
    for (text, holds) in &claims {
        println!("{} {text}", if *holds { "holds " } else { "FAILS " });
    }
    Ok(claims.iter().all(|(_, holds)| *holds))
}

/// The errors of order 2 and 4 over the plane, a file for each number of neighbors per condition.
fn errors(folder: &Path) -> Result<(), Box<dyn Error>> {
    let scene = Scene::<2>::new(40, JITTER)?;
    let mut files = Vec::new();
    for &ratio in RATIOS {
        let (_, second) = scene.dcpse(Varied::Overlap, 2, ratio, CUTOFF)?;
        let (_, fourth) = scene.dcpse(Varied::Overlap, 4, ratio, CUTOFF)?;
        let name = format!("choose_epsilon_{}.vtu", files.len());
        vtk::save(folder, &name, &scene.particles, &[("wave", &scene.f), ("error_2", &second), ("error_4", &fourth)])?;
        files.push((ratio, name));
    }
    vtk::save_series(folder, "choose_epsilon.pvd", &files)
}
