//! A method of your own on the same curves, of error, time and memory: a Laplacian of first differences along each pair,
//! after Brookshaw, beside PSE and DC-PSE on jittered sets. Writes `own_method.csv`, `own_method.svg` and
//! `own_method.html`, and exits with 1 when the method breaks a promise of the trait, beside mirror walls too, or the three
//! do not come out as theory says.
//!
//! `cargo run --release --features testing --example own_method [-- --quick] [-- --out DIR]`

#[path = "../work_precision/counting.rs"]
mod counting;
#[path = "../work_precision/curves.rs"]
mod curves;
#[allow(dead_code, reason = "panels are drawn by the grid")]
#[path = "../figure/mod.rs"]
mod figure;
#[path = "../figure/grid.rs"]
mod grid;
#[path = "../options/mod.rs"]
mod options;
#[path = "../work_precision/tags.rs"]
mod tags;

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::fs::{File, read_to_string};
use std::process::ExitCode;

use options::Options;
use parops::report::{Page, Phase, Repeats, Sample, Stopwatch, Table, machine, measure};
use parops::testing::check_method;
use parops::{
    Allowance, Apply, CellList, Cutoff, DcPse, Domain, Face, Laplacian, Method, Nearest, Neighbors, Particles, Pse,
    Result, RowReport, Rows, Stencil, spread,
};

/// lap f(x_p) ~ 2 sum_q V (s f_q - f_p) F(|x_pq|), V = (R/4)^2, F = -W'(r)/r, with the Wendland kernel
/// W = 7/(pi R^2) (1 - r/R)^4 (1 + 4 r/R); s is the sign of the image.
///
/// Source: L. Brookshaw, Proc. Astron. Soc. Australia 6 (1985).
struct Brookshaw {
    radius: f64,
}

impl Method<2> for Brookshaw {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }

    fn weights(&self, row: &Stencil<2>, _: &mut (), w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        *diagonal = [0.0];
        for (w, q) in w.iter_mut().zip(row.iter()) {
            let r = q.separation[0].hypot(q.separation[1]) / self.radius;
            let weight = 280.0 / PI * (0.25 * self.radius).powi(2) / self.radius.powi(4) * (1.0 - r).max(0.0).powi(3);
            let (pair, own) = spread(weight, -weight, q.sign);
            w[0] = pair;
            diagonal[0] += own;
        }
        Ok(())
    }

    fn report(&self, row: &Stencil<2>, _: &(), w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        Ok(RowReport::of(row, w, diagonal))
    }
}

/// What the method promises by its trait, on a torus and beside walls behind which the field changes its sign, or not.
fn checked() -> std::result::Result<(), Box<dyn Error>> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    let brookshaw = Brookshaw { radius: 4.0 / 12.0 };
    for faces in [Face::Periodic, Face::MirrorEven, Face::MirrorOdd] {
        let domain = Domain::new([0.0; 2], [1.0; 2], [[faces; 2]; 2])?;
        check_method(&brookshaw, &CellList::build(&particles, &domain, Cutoff(brookshaw.radius))?)?;
    }
    Ok(())
}

/// Any method over any provider, timed; the mean number of neighbors is kept.
fn work<M: Method<2, Out = [f64; 1]>, P: Neighbors<2>>(
    watch: &Stopwatch,
    sample: &mut Sample,
    f: &[f64],
    method: &M,
    neighbors: impl FnOnce() -> Result<P>,
) -> Result<()> {
    let neighbors = watch.time(Phase::Neighbors, neighbors)?;
    let rows: Rows = watch.time(Phase::Build, || Rows::assemble(method, &neighbors))?;
    let mut out = vec![0.0; f.len()];
    watch.time(Phase::Apply, || rows.apply(f, &mut out))?;
    sample.neighbors = rows.report().pairs as f64 / f.len() as f64;
    sample.errors(out, f.iter().map(|f| -5.0 * TAU * TAU * f));
    Ok(())
}

fn main() -> ExitCode {
    options::run("own_method", own_method)
}

fn own_method(options: &Options) -> std::result::Result<bool, Box<dyn Error>> {
    checked()?;
    let mut table = Table::default();
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    for side in if options.quick { vec![24, 48] } else { vec![24, 48, 96, 192] } {
        let h = 1.0 / side as f64;
        let particles = Particles::jittered([0.0; 2], [1.0; 2], [side; 2], 0.3, 1)?;
        let f: Vec<f64> = particles.points().iter().map(|x| (TAU * (x[0] - 2.0 * x[1])).sin()).collect();
        for (name, order) in [("Brookshaw", 2), ("PSE", 2), ("DC-PSE", 2), ("DC-PSE", 4)] {
            let what = Sample { n: f.len(), h, ..Sample::new("own_method", 2, "jittered", name, order) };
            let cells = |cutoff: Cutoff| CellList::build(&particles, &torus, cutoff);
            table.push(measure(what, Repeats::default(), Some(counting::peak), |watch, sample| match name {
                "Brookshaw" => work(watch, sample, &f, &Brookshaw { radius: 4.0 * h }, || cells(Cutoff(4.0 * h))),
                "PSE" => {
                    let pse = Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
                    work(watch, sample, &f, &pse.clone().allow(Allowance::Everywhere), || cells(pse.cutoff()))
                }
                _ => {
                    let dcpse = DcPse::at_order(Laplacian::<2>, order)?;
                    let needed = dcpse.fewest_neighbors::<2>()?;
                    work(watch, sample, &f, &dcpse, || Nearest::build(&particles, &torus, needed))
                }
            })?)?;
        }
    }
    table.write_csv(&mut File::create(options.out.join("own_method.csv"))?)?;
    let figure = options.out.join("own_method.svg");
    curves::draw(&figure, &table, "own_method")?;
    let mut page = Page::new("A method of your own", &table);
    for (name, value) in machine() {
        page.fact(name, &value);
    }
    page.figure("own_method", &read_to_string(figure)?)?
        .write(&mut File::create(options.out.join("own_method.html"))?)?;

    let tasks = table.tasks();
    // Pair sums of fixed overlap stand still on scattered sets; DC-PSE converges.
    let orders: Vec<f64> = tasks[0].series().iter().filter_map(|series| series.last()?.observed_order).collect();
    println!("cheapest for 1e-2: {}", tasks[0].cheapest(1e-2).map_or("nothing".to_string(), Sample::label));
    println!("observed orders of Brookshaw, PSE, DC-PSE 2 and 4: {orders:.2?}");
    Ok(matches!(orders[..], [a, b, c, d] if a < 1.0 && b < 1.0 && (c - 2.0).abs() < 0.3 && (d - 4.0).abs() < 0.5))
}
