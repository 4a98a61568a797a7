//! What every example understands, and how it ends.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

/// `--quick` for fewer particles, `--out DIR` for where to write.
pub struct Options {
    pub quick: bool,
    pub out: PathBuf,
}

/// Reads the options, makes the folder, and runs the example: success where it returns true.
pub fn run(name: &str, example: impl FnOnce(&Options) -> Result<bool, Box<dyn Error>>) -> ExitCode {
    let ready = options().map_err(Into::into).and_then(|options| {
        std::fs::create_dir_all(&options.out)?;
        example(&options)
    });
    match ready {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{name}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn options() -> Result<Options, String> {
    let mut options = Options { quick: false, out: PathBuf::from("target/report") };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => options.quick = true,
            "--out" => options.out = arguments.next().ok_or("--out needs a directory")?.into(),
            other => return Err(format!("unknown argument {other}; known are --quick and --out DIR")),
        }
    }
    Ok(options)
}
