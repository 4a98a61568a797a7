//! Files for ParaView, announced so that a reader can be checked against what was written.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use parops::{Particles, Vtu};

/// Writes scalar fields to the folder and prints `vtu NAME POINTS FIELD=SUM ..`.
pub fn save<const D: usize>(
    folder: &Path,
    name: &str,
    particles: &Particles<D>,
    fields: &[(&str, &[f64])],
) -> Result<(), Box<dyn Error>> {
    let mut vtu = Vtu::new(particles);
    let mut line = format!("vtu {name} {}", particles.len());
    for &(field, values) in fields {
        vtu.field(field, values)?;
        line += &format!(" {field}={:e}", values.iter().sum::<f64>());
    }
    vtu.write(&mut BufWriter::new(File::create(folder.join(name))?))?;
    println!("{line}");
    Ok(())
}

/// Writes a series to the folder and prints `pvd NAME TIME=FILE ..`.
pub fn save_series(folder: &Path, name: &str, files: &[(f64, String)]) -> Result<(), Box<dyn Error>> {
    let mut series = parops::Pvd::new();
    let mut line = format!("pvd {name}");
    for (time, file) in files {
        series.push(*time, file)?;
        line += &format!(" {time:?}={file}");
    }
    series.write(&mut BufWriter::new(File::create(folder.join(name))?))?;
    println!("{line}");
    Ok(())
}
