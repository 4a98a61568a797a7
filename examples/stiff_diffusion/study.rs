//! The runs, their tables and files.

use std::error::Error;
use std::time::Instant;

use parops::Method;

use crate::options::Options;
use crate::scheme::{EXPLICIT, Record, STIFF, Scheme, measure};
use crate::setting::{END, Setting, lattice, scattered};
use crate::{claims, figures};

/// The diffusion numbers of the single steps.
const NUMBERS: [f64; 7] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];

const TITLE: &str = "set       scheme                       number explicit   steps  applies    seconds      error";

/// Runs the study; whether every claim holds.
pub fn run(options: &Options) -> Result<bool, Box<dyn Error>> {
    let start = Instant::now();
    let side = if options.quick { 16 } else { 26 };
    let (mut costs, mut numbers) = (Vec::new(), Vec::new());
    println!("{TITLE}");
    study(&lattice(side)?, options.quick, &mut costs, &mut numbers)?;
    study(&scattered(side)?, options.quick, &mut costs, &mut numbers)?;
    for (name, records) in [("stiff_diffusion.csv", &costs), ("stiff_diffusion_numbers.csv", &numbers)] {
        let lines: Vec<String> = records.iter().map(Record::csv).collect();
        std::fs::write(options.out.join(name), format!("{}\n{}\n", Record::HEADER, lines.join("\n")))?;
    }
    figures::draw_all(&options.out, &costs, &numbers)?;
    println!("written to {} after {:.1} s\n", options.out.display(), start.elapsed().as_secs_f64());
    equal_error(&costs);

    let claims = claims::check(&costs, &numbers);
    for (text, holds) in &claims {
        println!("{} {text}", if *holds { "holds " } else { "FAILS " });
    }
    Ok(claims.iter().all(|(_, holds)| *holds))
}

fn study<M: Method<2, Out = [f64; 1]> + Clone>(
    setting: &Setting<M>,
    quick: bool,
    costs: &mut Vec<Record>,
    numbers: &mut Vec<Record>,
) -> parops::Result<()> {
    let repeats = if quick { 1 } else { 3 };
    let keep = |record: Record, records: &mut Vec<Record>| {
        println!("{}", record.row());
        records.push(record);
    };
    for scheme in EXPLICIT {
        // At the limit and below, and once above.
        let fewest = (END / setting.limit(scheme)).ceil() as u64;
        for steps in [fewest / 2, fewest, 2 * fewest, 4 * fewest].into_iter().take(if quick { 3 } else { 4 }) {
            keep(measure(setting, scheme, END, steps, repeats)?, costs);
        }
    }
    for scheme in STIFF {
        let most = if quick { 9 } else { 11 };
        for doublings in 2..most {
            keep(measure(setting, scheme, END, 1 << doublings, repeats)?, costs);
        }
    }
    println!("single steps");
    for number in NUMBERS {
        for scheme in EXPLICIT.into_iter().chain(STIFF) {
            // A hair below, so that number 1 is legal.
            let dt = number * setting.explicit_step() * (1.0 - 1e-9);
            keep(measure(setting, scheme, dt, 1, 1)?, numbers);
        }
    }
    Ok(())
}

/// The cheapest run of a scheme with at most this error, by applies.
pub fn cheapest<'a>(records: &'a [Record], set: &str, scheme: Scheme, error: f64) -> Option<&'a Record> {
    let good = records.iter().filter(|r| r.set == set && r.scheme == scheme && r.error <= error);
    good.min_by_key(|r| r.applies)
}

/// What each scheme costs at the same error.
fn equal_error(records: &[Record]) {
    for set in ["lattice", "scattered"] {
        for error in [1e-2, 1e-3, 1e-4, 1e-5] {
            println!("{set}, error at most {error:.0e}:");
            for scheme in EXPLICIT.into_iter().chain(STIFF) {
                match cheapest(records, set, scheme, error) {
                    Some(r) => println!("  {:<25}{:>8} applies {:>10.2e} s", scheme.name(), r.applies, r.seconds),
                    None => println!("  {:<25} not among these runs", scheme.name()),
                }
            }
        }
    }
    println!();
}
