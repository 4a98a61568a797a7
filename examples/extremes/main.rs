//! Stiff and extreme cases: the failure modes that are known of particle methods, each with what a naive method does,
//! measured, and what the library does about it: detects, reports, adapts, prevents or documents. Then the bad inputs, each
//! with the error it is refused by, and the eigenvalues of advection and diffusion over the stability regions.
//!
//! Prints set-up, naive outcome, own outcome and verdict of each case, writes `extremes.csv` and `extremes.html` (one page
//! that needs no network), and exits with 1 where an outcome is not the documented one, or where the naive method does not
//! show the failure.
//!
//! `cargo run --release --features faer --example extremes [-- --quick] [-- --out DIR]`

mod case;
#[path = "../../tests/linear/dense/mod.rs"]
mod dense;
mod failures;
#[allow(dead_code)]
#[path = "../figure/mod.rs"]
mod figure;
#[path = "../figure/grid.rs"]
mod grid;
mod inputs;
#[path = "../options/mod.rs"]
mod options;
mod page;
mod stability;

use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

use case::{Case, Entry};
use options::Options;

fn main() -> ExitCode {
    options::run("extremes", extremes)
}

/// The catalogues, each with its name and the number of its entries.
const CATALOGUES: [(&str, &[Entry], u32); 3] = [
    ("Failure modes", &failures::ENTRIES, 32),
    ("Bad inputs", &inputs::ENTRIES, 66),
    ("Spectra", &stability::ENTRIES, 2),
];

/// Runs all cases; whether every one holds.
fn extremes(options: &Options) -> Result<bool, Box<dyn Error>> {
    let start = Instant::now();
    let mut cases = Vec::new();
    let mut complete = true;
    for (name, entries, count) in CATALOGUES {
        let numbers: Vec<u32> = entries.iter().map(|entry| entry.number).collect();
        if numbers != (1..=count).collect::<Vec<_>>() {
            println!("{name}: the entries are {numbers:?}, not 1 to {count}");
            complete = false;
        }
        for entry in entries {
            let case = Case::run(name, entry, options.quick);
            print(&case, count);
            cases.push(case);
        }
    }
    let lines: Vec<String> = cases.iter().map(Case::csv).collect();
    std::fs::write(options.out.join("extremes.csv"), format!("{}\n{}\n", Case::HEADER, lines.join("\n")))?;
    let figures = stability::figures(&options.out)?;
    std::fs::write(options.out.join("extremes.html"), page::render(&cases, &figures))?;
    let held = cases.iter().filter(|case| case.holds()).count();
    println!("{held} of {} cases end as documented", cases.len());
    println!("written to {} after {:.1} s", options.out.display(), start.elapsed().as_secs_f64());
    Ok(complete && held == cases.len())
}

fn print(case: &Case, count: u32) {
    println!("{}/{count} {} ({:.2} s)", case.number, case.title, case.seconds);
    println!("    set-up:  {}", case.setup);
    println!("    naive:   {}", case.naive);
    for outcome in &case.outcomes {
        let mark = if outcome.met { "" } else { "NOT " };
        println!("    {mark}{}: {}", outcome.duty.name(), outcome.text);
    }
    if let Some(reason) = case.not_offered {
        println!("    not offered: {reason}");
    }
    println!("    verdict: {}", case.verdict());
}
