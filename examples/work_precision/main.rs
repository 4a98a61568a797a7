//! Error against run time and memory of every method on the same work, scene by scene. Prints each sample, writes
//! `work_precision.csv`, a figure a scene and `report.html`, which holds it all and needs nothing else; exits with 1 when
//! an error is not the stored one (`bounds.csv`, within a factor) or a claim does not hold. Times are never asserted.
//!
//! A scene is a file with a function that hands samples to a [`Bench`], and a line in [`SCENES`]. All work is done on one
//! thread.
//!
//! `cargo run --release --features faer --example work_precision [-- --quick] [-- --scene NAME] [-- --out DIR]`

mod advection_diffusion;
mod bench;
#[allow(dead_code, reason = "the record is that of the example lecture_diffusion")]
#[path = "../lecture_diffusion/benchmark.rs"]
mod benchmark;
mod bounds;
mod cells;
mod choice;
mod counting;
mod curves;
mod derivatives;
#[allow(dead_code, reason = "panels are drawn by the grid")]
#[path = "../figure/mod.rs"]
mod figure;
mod finite_difference;
#[path = "../figure/grid.rs"]
mod grid;
mod lecture;
#[path = "../poisson/field.rs"]
mod manufactured;
mod operators;
mod overlap;
mod poisson;
#[path = "../lecture_diffusion/random_walk.rs"]
mod random_walk;
mod remeshing;
mod round;
#[allow(dead_code, reason = "records are those of the example stiff_diffusion")]
#[path = "../stiff_diffusion/scheme.rs"]
mod scheme;
mod sets;
#[allow(dead_code, reason = "errors are those of the samples")]
#[path = "../stiff_diffusion/setting.rs"]
mod setting;
mod stiff;
mod tags;
mod timed;

use std::error::Error;
use std::fs::{self, File};
use std::io::BufWriter;
use std::process::{Command, ExitCode};
use std::time::Instant;

use bench::Bench;
use choice::Choice;
use parops::report::{Page, machine};

type Scene = fn(&mut Bench) -> Result<(), Box<dyn Error>>;

const SCENES: &[(&str, Scene)] = &[
    ("derivatives", derivatives::run),
    ("lecture", lecture::run),
    ("overlap", overlap::run),
    ("poisson", poisson::run),
    ("advection_diffusion", advection_diffusion::run),
    ("stiff", stiff::run),
    ("remeshing", remeshing::run),
];

fn main() -> ExitCode {
    match work_precision() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("work_precision: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the scenes asked for; whether all errors and claims are as they must be.
fn work_precision() -> Result<bool, Box<dyn Error>> {
    let names: Vec<&str> = SCENES.iter().map(|(name, _)| *name).collect();
    let choice = Choice::read(&names)?;
    #[cfg(feature = "rayon")]
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    fs::create_dir_all(&choice.out)?;
    let mut bench = Bench::new(choice.quick, choice.record, choice.out.clone());
    for (name, scene) in SCENES {
        if choice.scene.as_ref().is_none_or(|only| only == name) {
            let start = Instant::now();
            println!("-- {name}");
            scene(&mut bench)?;
            println!("-- {name}: {:.1} s", start.elapsed().as_secs_f64());
        }
    }
    write(&choice, &bench)?;
    if choice.record {
        bounds::record(&bench.table, choice.quick)?;
    }
    let faults = if choice.record { Vec::new() } else { bounds::faults(&bench.table, choice.quick) };
    faults.iter().for_each(|fault| println!("FAILS  {fault}"));
    let failed = bench.claims.iter().filter(|(_, holds, _)| !holds).count();
    println!("{} samples, {} errors not as stored, {failed} claims fail", bench.table.samples().len(), faults.len());
    Ok(faults.is_empty() && failed == 0)
}

fn write(choice: &Choice, bench: &Bench) -> Result<(), Box<dyn Error>> {
    let file = |name: &str| File::create(choice.out.join(name)).map(BufWriter::new);
    bench.table.write_csv(&mut file("work_precision.csv")?)?;
    let mut page = Page::new("Error against run time", &bench.table);
    for (name, value) in machine() {
        page.fact(name, &value);
    }
    page.fact("compiler", &compiler());
    page.fact("threads used", "1");
    page.fact("times", &bench.timing());
    page.fact("run", if choice.quick { "quick: fewer particles, fewer repeats" } else { "full" });
    for scene in bench.table.scenes() {
        let path = choice.out.join(format!("work_precision_{scene}.svg"));
        curves::draw(&path, &bench.table, scene)?;
        page.figure(scene, &fs::read_to_string(path)?)?;
    }
    for (scene, path) in &bench.figures {
        page.figure(scene, &fs::read_to_string(path)?)?;
    }
    for (scene, text) in &bench.notes {
        page.note(scene, text)?;
    }
    for (scene, holds, text) in &bench.claims {
        page.note(scene, &format!("{}: {text}", if *holds { "holds" } else { "FAILS" }))?;
    }
    page.write(&mut file("report.html")?)?;
    println!("written to {}", choice.out.display());
    Ok(())
}

/// What the compiler at hand calls itself.
fn compiler() -> String {
    let output = Command::new("rustc").arg("--version").output();
    let text = output.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    text.map_or("unknown".to_string(), |text| text.trim().to_string())
}
