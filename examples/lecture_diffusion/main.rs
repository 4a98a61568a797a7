//! The diffusion benchmark of the lecture notes (001, eq. 5.25 to 5.28): random walk against PSE, order 2 to 8,
//! in `f64` and `f32`, with three propagators. Prints a table, writes `lecture_diffusion.csv` and the figures 5.1, 5.2
//! and error against run time, and exits with 1 when a result is not what theory says.
//!
//! `cargo run --release --example lecture_diffusion [-- --quick] [-- --out DIR]`

mod benchmark;
mod claims;
mod exchange;
#[path = "../figure/mod.rs"]
mod figure;
mod figures;
#[path = "../options/mod.rs"]
mod options;
mod random_walk;

use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

use benchmark::{D, DT, Record, T, X_RW, exact, norms};
use exchange::{Outcome, Propagator, run};
use options::Options;
use random_walk::{centers, walk};

/// Largest N for which the semi-discrete system is also propagated exactly.
const EXACT_LIMIT: usize = 400;
/// Independent random walks per N.
const SEEDS: u64 = 10;
/// The N of figure 5.1.
const SHOWN: usize = 50;

fn main() -> ExitCode {
    options::run("lecture_diffusion", lecture)
}

/// Runs the benchmark; whether every claim holds.
fn lecture(options: &Options) -> Result<bool, Box<dyn Error>> {
    let start = Instant::now();
    let finest = if options.quick { 400 } else { 1600 };
    let sizes: Vec<usize> = [25, 50, 100, 200, 400, 800, 1600].into_iter().filter(|&n| n <= finest).collect();
    let mut records: Vec<Record> = Vec::new();
    let mut shown = Vec::new();

    println!("u_t = D u_xx, D = {D}, T = {T}, dt = {DT} or the largest stable divisor of T below it");
    println!("{}", Record::TITLE);
    for order in [2, 4, 6, 8] {
        for propagator in [Propagator::Euler, Propagator::Rk4, Propagator::Exact] {
            for &n in sizes.iter().filter(|&&n| propagator != Propagator::Exact || n <= EXACT_LIMIT) {
                let outcome = median(|| run::<f64>("f64", order, propagator, n))?;
                keep(&mut records, outcome.record);
                if (n, order) == (SHOWN, 2) && propagator == Propagator::Rk4 {
                    shown = outcome.solution;
                }
            }
        }
        for propagator in [Propagator::Euler, Propagator::Rk4] {
            for &n in &sizes {
                keep(&mut records, median(|| run::<f32>("f32", order, propagator, n))?.record);
            }
        }
    }
    let mut walked = Vec::new();
    for &n in &sizes {
        let (record, bins) = random_walks(n);
        keep(&mut records, record);
        if n == SHOWN {
            walked = bins;
        }
    }

    let csv = options.out.join("lecture_diffusion.csv");
    let lines: Vec<String> = records.iter().map(Record::csv).collect();
    std::fs::write(&csv, format!("{}\n{}\n", Record::HEADER, lines.join("\n")))?;
    figures::solutions(&options.out.join("lecture_diffusion_5_1.svg"), &walked, &shown)?;
    figures::convergence(&options.out.join("lecture_diffusion_5_2.svg"), &records)?;
    figures::cost(&options.out.join("lecture_diffusion_cost.svg"), &records)?;
    println!("written to {} after {:.1} s\n", options.out.display(), start.elapsed().as_secs_f64());

    println!("{}", claims::euler_against_rk4(&records));
    let claims = claims::check(&records);
    for claim in &claims {
        println!("{} {}", if claim.holds { "holds " } else { "FAILS " }, claim.text);
    }
    Ok(claims.iter().all(|claim| claim.holds))
}

/// The same run three times, with the median of the run times.
fn median(run: impl Fn() -> parops::Result<Outcome>) -> parops::Result<Outcome> {
    let mut outcomes = [run()?, run()?, run()?];
    outcomes.sort_by(|a, b| a.record.seconds.total_cmp(&b.record.seconds));
    let [_, outcome, _] = outcomes;
    Ok(outcome)
}

/// Adds a run to the table with the order observed against the run before it, and prints it.
fn keep(records: &mut Vec<Record>, mut record: Record) {
    record.observed_order = records
        .last()
        .filter(|last| last.same_series(&record))
        .map(|last| (last.l2 / record.l2).ln() / (record.n as f64 / last.n as f64).ln());
    println!("{}", record.row());
    records.push(record);
}

/// The random walk with n particles: root mean square over the seeds of the error at the bin centers, and the field of
/// the first seed.
fn random_walks(n: usize) -> (Record, Vec<(f64, f64)>) {
    let start = Instant::now();
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    let mut first = Vec::new();
    for seed in 0..SEEDS {
        let bins: Vec<(f64, f64)> = centers().zip(walk(n, seed)).collect();
        let (l2, linf) = norms(bins.iter().map(|&(x, u)| exact(x, T) - u));
        squares += l2 * l2;
        largest = largest.max(linf);
        if seed == 0 {
            first = bins;
        }
    }
    let record = Record {
        method: "rw",
        scalar: "f64",
        order: 0,
        stepper: "euler",
        n,
        h: X_RW / n as f64,
        epsilon: random_walk::WIDTH,
        cutoff: random_walk::WIDTH,
        dt: DT,
        steps: (T / DT).round() as u64,
        l2: (squares / SEEDS as f64).sqrt(),
        linf: largest,
        observed_order: None,
        seconds: start.elapsed().as_secs_f64() / SEEDS as f64,
    };
    (record, first)
}
