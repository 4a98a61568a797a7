//! What the command line asks for.

use std::path::PathBuf;

/// `--quick` for fewer particles and runs, `--out DIR` for where to write, `--scene NAME` for one scene alone, `--record`
/// to store the errors of this run as the bounds of later ones.
pub struct Choice {
    pub quick: bool,
    pub record: bool,
    pub scene: Option<String>,
    pub out: PathBuf,
}

impl Choice {
    /// Reads the arguments; the scene must be one of `scenes`.
    pub fn read(scenes: &[&str]) -> Result<Self, String> {
        let mut choice = Self { quick: false, record: false, scene: None, out: PathBuf::from("target/report") };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--quick" => choice.quick = true,
                "--record" => choice.record = true,
                "--out" => choice.out = arguments.next().ok_or("--out needs a directory")?.into(),
                "--scene" => {
                    let name = arguments.next().filter(|name| scenes.contains(&name.as_str()));
                    choice.scene = Some(name.ok_or(format!("--scene needs one of {}", scenes.join(", ")))?);
                }
                other => {
                    let known = "--quick, --scene NAME, --out DIR and --record";
                    return Err(format!("unknown argument {other}; known are {known}"));
                }
            }
        }
        Ok(choice)
    }
}
