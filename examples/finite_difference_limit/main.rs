//! Finite differences as the limit of DC-PSE on a lattice (001, eq. 5.51 to 5.54, with errata 21 and 25): weights for
//! c = h/epsilon from 1 to 3.5, by how much they miss the finite differences, and what the library says of the row.
//! Prints a table, writes `finite_difference_limit.csv` and an SVG, and exits with 1 when a claim does not hold.
//!
//! Beside it stands PSE with the lattice hat kernel, which is the difference itself at c = 1 (000, eq. 27 to 31).
//!
//! The limit is approached like exp(-c^2) where the stencil has more nodes than the difference, and the condition
//! number grows like exp(4 c^2) where the conditions need nodes at 2 h (errata 25).
//!
//! `cargo run --release --example finite_difference_limit [-- --quick] [-- --out DIR]`

mod claims;
#[path = "../figure/mod.rs"]
mod figure;
mod limit;
#[path = "../options/mod.rs"]
mod options;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use figure::{Axes, Curve, Mark, draw};
use limit::{Case, Outcome, Record};
use options::Options;

fn main() -> ExitCode {
    options::run("finite_difference_limit", table)
}

/// Runs every case; whether every claim holds.
fn table(options: &Options) -> Result<bool, Box<dyn Error>> {
    let steps = if options.quick { 2 } else { 8 };
    let ratios: Vec<f64> = (0..=5 * steps / 2).map(|i| 1.0 + f64::from(i) / f64::from(steps)).collect();
    let mut records = Vec::new();
    println!("{}", Record::TITLE);
    for case in Case::ALL {
        for &c in ratios.iter().filter(|&&c| case.takes(c)) {
            let record = case.run(c)?;
            println!("{}", record.row());
            records.push(record);
        }
    }
    let lines: Vec<String> = records.iter().map(Record::csv).collect();
    let csv = format!("{}\n{}\n", Record::HEADER, lines.join("\n"));
    std::fs::write(options.out.join("finite_difference_limit.csv"), csv)?;
    figure(&options.out.join("finite_difference_limit.svg"), &records)?;
    println!("written to {}\n", options.out.display());

    let claims = claims::check(&records);
    for claim in &claims {
        println!("{} {}", if claim.holds { "holds " } else { "FAILS " }, claim.text);
    }
    Ok(claims.iter().all(|claim| claim.holds))
}

/// Miss and condition number against c; refused rows have neither.
fn figure(path: &Path, records: &[Record]) -> Result<(), Box<dyn Error>> {
    let curves = |value: fn(&Outcome) -> Option<f64>| {
        let curve = |(color, case): (usize, Case)| Curve {
            name: case.name().into(),
            points: records
                .iter()
                .filter(|record| record.case == case)
                .filter_map(|record| Some((record.c, value(&record.outcome)?)))
                // A logarithmic axis has no place for an exact zero.
                .filter(|point| point.1 > 0.0)
                .collect(),
            mark: [Mark::Circles, Mark::Triangles, Mark::Crosses][color % 3],
            color,
        };
        let all = Case::ALL.into_iter().enumerate().map(curve);
        all.filter(|curve| !curve.points.is_empty()).collect::<Vec<_>>()
    };
    let (mut miss, mut condition) = (curves(Outcome::miss), curves(Outcome::condition));
    // The legend of the first panel serves both.
    condition.iter_mut().for_each(|curve| curve.name.clear());
    let approach = (0..=50).map(|i| 1.0 + 0.05 * f64::from(i)).map(|c| (c, (-c * c).exp())).collect();
    miss.push(Curve { name: "exp(-c^2)".into(), points: approach, mark: Mark::Line, color: 7 });
    let x = "c = h / epsilon";
    draw(
        path,
        &[
            (Axes { title: "Distance from the finite difference", x, y: "largest miss", logarithmic: true }, miss),
            (
                Axes { title: "Condition number in the certificate, same colors", x, y: "cond(B)", logarithmic: true },
                condition,
            ),
        ],
    )
}
