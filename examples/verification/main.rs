//! Compares VERIFICATION.md with the promises that tests have just recorded: exits with 1 where a promise, a bound, a
//! verdict or the name of a test differs, a promise is broken, or the page says anything else; measured values may differ
//! within their bounds, and those that are worse by a factor of two are told. The page as it is now goes to the directory
//! of `--out`, with `--record` to the root as well; `--quick` changes nothing.
//!
//! After `cargo test` and `cargo test --all-features`, both with `PAROPS_PROMISES=$PWD/target/promises`:
//! `cargo run --release --all-features --example verification [-- --record]`

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

use parops::testing::Verification;

const PAGE: &str = "VERIFICATION.md";

const HEAD: &str = "# Verification

What parops promises, the bound, and the test that measures it. Cases of a property are random: a measured value is the
worst of one run with 1000 cases, and moves within its bound. Written by
`cargo run --release --all-features --example verification -- --record` after `cargo test` and
`cargo test --all-features`, both with `PAROPS_PROMISES=$PWD/target/promises`; `.ci/run` compares all else,
and measured values with their bounds.

";

fn main() -> ExitCode {
    match run() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("verification: {error}");
            ExitCode::FAILURE
        }
    }
}

/// How many faults were found.
fn run() -> Result<usize, Box<dyn Error>> {
    let (mut record, mut out) = (false, PathBuf::from("target/report"));
    let mut arguments = env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => {}
            "--out" => out = arguments.next().ok_or("--out needs a directory")?.into(),
            "--record" => record = true,
            other => return Err(format!("unknown argument {other}; known are --quick, --out DIR and --record").into()),
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let recorded = env::var_os("PAROPS_PROMISES").map_or_else(|| root.join("target/promises"), Into::into);
    let shown = Verification::read(&recorded).map_err(|error| format!("{}: {error}", recorded.display()))?;
    let page = format!("{HEAD}{shown}");
    fs::create_dir_all(&out)?;
    fs::write(out.join(PAGE), &page)?;
    let before = fs::read_to_string(root.join(PAGE));
    if let Ok(before) = &before {
        shown.worsened(before).iter().for_each(|change| println!("worse, within its bound: {change}"));
    }
    let stated = if record {
        fs::write(root.join(PAGE), &page)?;
        page
    } else {
        before.map_err(|error| format!("{PAGE}: {error}"))?
    };
    let mut faults: Vec<String> = shown.broken().map(|promise| format!("broken: {promise}")).collect();
    if !stated.starts_with(&format!("{HEAD}## ")) {
        faults.push(format!("{PAGE} does not begin as it is written"));
    }
    faults.extend(shown.differences(&stated));
    faults.iter().for_each(|fault| println!("{fault}"));
    println!("promises: {} faults", faults.len());
    Ok(faults.len())
}
