//! Derivatives on scattered particles by DC-PSE: gradient, Laplacian and a mixed third derivative (D^(2,1) in 2D,
//! D^(1,1,1) in 3D) of order 2, 4 and 6 in 2D and 3D, on a jittered and a clustered set, refined four times; and a few
//! degenerate sets, whose rows are refused. Prints a table, writes `scattered_derivatives.csv` and figures (error
//! against h, error against run time, solvers per row, certificates per decade), and exits with 1 when a claim does not hold.
//!
//! Every particle uses its 2 l nearest neighbors. Errors are relative; those of the CSV and of the observed order are
//! over interior particles, whose cutoff touches no face of the box; the others have a column of the printed table.
//! On the clustered set spacings are largest at the faces, and the interior grows towards them with refinement, so that
//! the order there is fitted over the middle of the box, the same for all refinements.
//! In the CSV `n` is the number of particles, `l` that of moment conditions, `neighbors` the mean per row, and `rungs`
//! the rows per solver. Build time is `assemble` on a ready provider over all particles, certificate included, on one
//! thread. The mixed third derivative of order 4 in 3D (84 conditions, 168 neighbors) stops at 32 768 particles and order
//! 6 in 3D at 10 648, so that the study takes minutes.
//!
//! `cargo run --release --example scattered_derivatives [-- --quick] [-- --out DIR]`

mod claims;
mod degenerate;
mod field;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../options/mod.rs"]
mod options;
mod sets;
mod study;

use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

use options::Options;
use parops::{D2, D3, Gradient, Laplacian, Operator};
use sets::Set;
use study::Record;

fn main() -> ExitCode {
    options::run("scattered_derivatives", study)
}

/// Particles along an axis, refinement after refinement, for a dimension, an order and a degree.
fn sides(quick: bool, dim: usize, order: u32, degree: u32) -> &'static [usize] {
    match (quick, dim, order, degree) {
        (true, 2, ..) => &[28, 40],
        (true, _, 2, _) => &[11, 14],
        (true, _, 4, 1 | 2) => &[10, 12],
        // Two sets fine enough for its order would take longer than everything else.
        (true, _, 4, _) => &[10],
        (true, ..) => &[],
        // 1 600 to 99 856 particles.
        (false, 2, ..) => &[40, 80, 160, 316],
        // 4 096 to 32 768 particles: at 10^5 this alone takes as long as all the others of order 4.
        (false, _, 4, 3) => &[16, 20, 25, 32],
        // 8 000 to 97 336 particles.
        (false, _, 2 | 4, _) => &[20, 27, 35, 46],
        // 10 648 particles.
        (false, ..) => &[22],
    }
}

/// Runs the study; whether every claim holds.
fn study(options: &Options) -> Result<bool, Box<dyn Error>> {
    #[cfg(feature = "rayon")]
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let start = Instant::now();
    let mut records = Vec::new();
    println!("{}", Record::TITLE);
    for set in [Set::Jittered, Set::Clustered] {
        for order in [2, 4, 6] {
            let mut plane = Study { set, order, quick: options.quick, records: &mut records };
            plane.refine::<_, 2, 2>(Gradient::<2>, "gradient")?;
            plane.refine::<_, 2, 1>(Laplacian::<2>, "laplacian")?;
            plane.refine::<_, 2, 1>(D2::<2, 1>::default(), "third_mixed")?;
        }
        for order in [2, 4, 6] {
            let mut space = Study { set, order, quick: options.quick, records: &mut records };
            space.refine::<_, 3, 3>(Gradient::<3>, "gradient")?;
            space.refine::<_, 3, 1>(Laplacian::<3>, "laplacian")?;
            space.refine::<_, 3, 1>(D3::<1, 1, 1>::default(), "third_mixed")?;
        }
    }
    let degenerate = degenerate::run()?;
    for line in &degenerate {
        println!("{}", line.row());
    }

    let lines: Vec<String> = records.iter().map(Record::csv).chain(degenerate.iter().map(|line| line.csv())).collect();
    let csv = format!("{}\n{}\n", Record::HEADER, lines.join("\n"));
    std::fs::write(options.out.join("scattered_derivatives.csv"), csv)?;
    figures::errors(&options.out.join("scattered_derivatives_error.svg"), &records)?;
    figures::cost(&options.out.join("scattered_derivatives_cost.svg"), &records)?;
    figures::rungs(&options.out.join("scattered_derivatives_rungs.svg"), &records)?;
    figures::certificates(&options.out.join("scattered_derivatives_certificates.svg"), &records)?;
    println!("written to {} after {:.1} s\n", options.out.display(), start.elapsed().as_secs_f64());

    let claims = claims::check(&records, &degenerate);
    for claim in &claims {
        let mark = match claim.holds {
            Some(true) => "holds ",
            Some(false) => "FAILS ",
            None => "note: ",
        };
        println!("{mark} {}", claim.text);
    }
    Ok(claims.iter().all(|claim| claim.holds != Some(false)))
}

/// One set and order, refined.
struct Study<'a> {
    set: Set,
    order: u32,
    quick: bool,
    records: &'a mut Vec<Record>,
}

impl Study<'_> {
    fn refine<Op, const D: usize, const K: usize>(&mut self, operator: Op, name: &'static str) -> parops::Result<()>
    where
        Op: Operator<D, Out = [f64; K]> + Clone,
    {
        let degree = match name {
            "gradient" => 1,
            "laplacian" => 2,
            _ => 3,
        };
        for &side in sides(self.quick, D, self.order, degree) {
            let particles = self.set.particles::<D>(side)?;
            let mut record = study::run(operator.clone(), name, self.order, self.set, &particles)?;
            if let Some(last) = self.records.last().filter(|last| last.key() == record.key()) {
                let refined = (last.h() / record.h()).ln();
                record.observed_order = Some((last.l2 / record.l2).ln() / refined);
                record.middle_order = Some((last.l2_middle / record.l2_middle).ln() / refined);
            }
            println!("{}", record.row());
            self.records.push(record);
        }
        Ok(())
    }
}
