//! Density maps of particles in a plane: one particle, and clouds of 100 and 10 000 drawn from a Gaussian of standard
//! deviation 3, on 20 x 20 cells between -10 and 10, with the kernels of order 0, 1 and 2 and with Lambda_{4,2}.
//!
//! Every particle of a cloud of N carries the mass 1/N. Particles within a cell of the boundary or beyond it are
//! rejected, as the exercise asks; Lambda_{4,2} reaches farther and rejects all that are nearer than two and a half
//! cells. What is rejected is counted and is all the mass that a map lacks. Prints a table, writes
//! `particle_mesh_map.csv` and `particle_mesh_map.svg` (a row per cloud, a column per kernel, the exact density last),
//! and exits with 1 when a claim does not hold. With `--quick` the large cloud has 1000 particles.
//!
//! `cargo run --release --example particle_mesh_map [-- --quick] [-- --out DIR]`

mod claims;
mod figures;
mod map;
#[path = "../options/mod.rs"]
mod options;

use std::error::Error;
use std::process::ExitCode;

use map::{Cloud, Map};
use options::Options;
use parops::{Cic, Domain, Face, Lambda, Mesh, Ngp, Tsc};

/// Half the width of the box.
const HALF: f64 = 10.0;
/// Cells along an axis.
const CELLS: usize = 20;

fn main() -> ExitCode {
    options::run("particle_mesh_map", study)
}

/// Draws all maps; whether every claim holds.
fn study(options: &Options) -> Result<bool, Box<dyn Error>> {
    let square = Domain::new([-HALF; 2], [HALF; 2], [[Face::Open; 2]; 2])?;
    let mesh = Mesh::cells(&square, [CELLS; 2])?;
    let lambda = Lambda::<4, 2>::new()?;
    let large = if options.quick { 1000 } else { 10_000 };
    let clouds = [Cloud::single(&mesh, 1), Cloud::gaussian(100, 2), Cloud::gaussian(large, 3)];
    let mut maps = Vec::new();
    println!("{}", Map::TITLE);
    for cloud in &clouds {
        maps.push(cloud.map("NGP", &mesh, &Ngp)?);
        maps.push(cloud.map("CIC", &mesh, &Cic)?);
        maps.push(cloud.map("TSC", &mesh, &Tsc)?);
        maps.push(cloud.map("Lambda_4,2", &mesh, &lambda)?);
        maps.iter().rev().take(4).rev().for_each(|map| println!("{}", map.row()));
    }
    let lines: Vec<String> = maps.iter().map(Map::csv).collect();
    let csv = format!("{}\n{}\n", Map::HEADER, lines.join("\n"));
    std::fs::write(options.out.join("particle_mesh_map.csv"), csv)?;
    figures::draw(&options.out.join("particle_mesh_map.svg"), &mesh, &clouds, &maps)?;
    println!("written to {}\n", options.out.display());

    let claims = claims::check(&maps);
    for (holds, text) in &claims {
        println!("{} {text}", if *holds { "holds" } else { "FAILS" });
    }
    Ok(claims.iter().all(|claim| claim.0))
}
