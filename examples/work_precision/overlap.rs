//! What overlap does to PSE: h/epsilon kept, and the error stands still; h/epsilon falling with h, and it does not.
//!
//! The error of PSE on a wave has two parts. The kernel replaces the derivative by an integral: mollification, O(epsilon^r).
//! The particles replace the integral by a sum: quadrature, which depends on h/epsilon and on the set. On a wave
//! sin(k x) the integral is a factor, the symbol sigma(k epsilon), found here by a lattice so fine that its sum is the
//! integral to rounding; so both parts are measured, not estimated. Besides the samples, `overlap_parts.csv` has them apart.

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write;

use parops::report::{Phase, Sample};
use parops::{
    Allowance, Apply, CellList, Domain, Epsilon, Exchange, Kernel, MatrixFree, MultiIndex, Particles, Pse, Term,
    Volumes,
};

use crate::bench::Bench;
use crate::figure::{Axes, Curve, Mark};
use crate::grid;
use crate::tags::{self, Series};

const SCENE: &str = "overlap";
/// The wave sin(2 pi x + phase).
const PHASE: f64 = 0.4;
/// h/epsilon that is kept: the sums of a lattice miss the integrals by 4 pi^4 exp(-pi^2), 2 %, there.
const KEPT: f64 = 1.0;
/// epsilon as h^POWER where h/epsilon falls, from h/epsilon = 1 on the coarsest set. On jittered sets the sums miss
/// the first moment by (h/epsilon)^(3/2), and the error is that over epsilon: it falls for powers below 3/5.
const POWER: f64 = 0.5;
const COARSEST: f64 = 1.0 / 32.0;
const JITTER: f64 = 0.3;
/// Of the figure of both parts.
const TITLES: [[&str; 2]; 2] = [
    ["lattice, h/epsilon kept", "lattice, h/epsilon falling"],
    ["jittered, h/epsilon kept", "jittered, h/epsilon falling"],
];

const PHASES: &str = "Build makes kernels and checks every row, apply makes the rows again and applies them.";

/// The two parts of a relative error in L2.
struct Parts {
    mollification: f64,
    quadrature: f64,
}

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    let sides: &[usize] =
        if bench.quick { &[32, 128, 512, 2048] } else { &[32, 64, 128, 256, 512, 1024, 2048, 4096, 8192] };
    bench.note(SCENE, PHASES);
    let mut panels: Vec<(Axes, Vec<Curve>)> = Vec::new();
    // The samples of the curves of each panel.
    let mut drawn: Vec<Vec<Series>> = Vec::new();
    let mut samples = 0;
    let mut csv = "set,order,overlap,n,h,epsilon,error_l2,mollification_l2,quadrature_l2\n".to_string();
    for (set, jitter) in [("lattice", 0.0), ("jittered", JITTER)] {
        for order in [2, 4] {
            for (method, falling) in [("PSE h/eps kept", false), ("PSE h/eps falling", true)] {
                let (mut errors, mut parts) = (Vec::new(), Vec::new());
                for &side in sides {
                    let h = 1.0 / side as f64;
                    let epsilon = if falling { COARSEST / KEPT * (h / COARSEST).powf(POWER) } else { h / KEPT };
                    let particles = Particles::jittered([0.0], [1.0], [side], jitter, 7)?;
                    let mut part = Parts { mollification: 0.0, quadrature: 0.0 };
                    let what =
                        Sample { n: side, h, epsilon: Some(epsilon), ..Sample::new(SCENE, 1, set, method, order) };
                    let sample = bench.sample(what, |watch, sample| {
                        let pse = watch.time(Phase::Build, || {
                            let kernel = Exchange::<1>::new(&second(), order)?;
                            let volumes = Volumes::equal(h)?;
                            let pse = Pse::with_kernels([kernel], Epsilon::global(epsilon)?, &volumes)?;
                            parops::Result::Ok(pse.allow(Allowance::Everywhere))
                        })?;
                        let torus = Domain::periodic([0.0], [1.0])?;
                        let cells =
                            watch.time(Phase::Neighbors, || CellList::build(&particles, &torus, pse.cutoff()))?;
                        let operator = watch.time(Phase::Build, || MatrixFree::new(&pse, &cells))?;
                        let f: Vec<f64> = particles.points().iter().map(wave).collect();
                        let mut out = vec![0.0; side];
                        watch.time(Phase::Apply, || operator.apply(&f, &mut out))?;
                        sample.neighbors = operator.report().pairs as f64 / side as f64;
                        let exact = || f.iter().map(|f| -TAU * TAU * f);
                        let symbol = symbol(order, epsilon)?;
                        // One part at a time, by the same norm.
                        sample.errors(f.iter().map(|f| symbol * f), exact());
                        part.mollification = sample.error_l2;
                        let of_sum = out.iter().zip(&f).map(|(out, f)| out - (symbol + TAU * TAU) * f);
                        sample.errors(of_sum, exact());
                        part.quadrature = sample.error_l2;
                        sample.errors(out.iter().copied(), exact());
                        Ok(())
                    })?;
                    let Parts { mollification, quadrature } = part;
                    let kind = if falling { "falling" } else { "kept" };
                    writeln!(
                        csv,
                        "{set},{order},{kind},{side},{h:e},{epsilon:e},{:e},{mollification:e},{quadrature:e}",
                        sample.error_l2
                    )?;
                    errors.push(sample.error_l2);
                    parts.push(part);
                }
                claim(bench, set, order, falling, &errors, &parts);
                let title = TITLES[usize::from(jitter > 0.0)][usize::from(falling)];
                let here = panels.iter().position(|(axes, _)| axes.title == title).unwrap_or(panels.len());
                if here == panels.len() {
                    let axes = Axes { title, x: "spacing h", y: "part of the L2 error", logarithmic: true };
                    panels.push((axes, Vec::new()));
                    drawn.push(Vec::new());
                }
                for curve in curves(order, sides, &parts) {
                    panels[here].1.push(curve);
                    drawn[here].push(Series::Curve((samples..samples + sides.len()).collect()));
                }
                samples += sides.len();
            }
        }
    }
    std::fs::write(bench.out.join("overlap_parts.csv"), csv)?;
    let file = bench.out.join("overlap_parts.svg");
    grid::draw(&file, panels.len(), panels)?;
    let drawn: Vec<Series> = drawn.into_iter().flatten().collect();
    std::fs::write(&file, tags::tag(&std::fs::read_to_string(&file)?, &drawn)?)?;
    bench.figures.push((SCENE.to_string(), file));
    Ok(())
}

/// Both parts against the spacing, a panel a set and choice of overlap.
fn curves(order: u32, sides: &[usize], parts: &[Parts]) -> [Curve; 2] {
    let curve = |name: &str, mark, part: fn(&Parts) -> f64| Curve {
        name: format!("{name}, order {order}"),
        points: sides.iter().zip(parts).map(|(&side, parts)| (1.0 / side as f64, part(parts))).collect(),
        mark,
        color: order as usize / 2 - 1,
    };
    [
        curve("mollification", Mark::Circles, |parts| parts.mollification),
        curve("quadrature", Mark::Squares, |parts| parts.quadrature),
    ]
}

/// What the two parts must do.
fn claim(bench: &mut Bench, set: &str, order: u32, falling: bool, errors: &[f64], parts: &[Parts]) {
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    let (start, end) = (&parts[0], &parts[parts.len() - 1]);
    let [lost, missed] = [[start.mollification, end.mollification], [start.quadrature, end.quadrature]];
    let refined = errors.len() > 1 && lost[1] < 0.1 * lost[0];
    let holds = match (set, falling) {
        // The plateau: mollification falls, and the quadrature error that is left does not.
        ("lattice", false) => refined && missed[1] > 0.5 * missed[0] && last > 0.9 * missed[1],
        // Without order in the particles the first moment is missed, and its error grows as 1/epsilon.
        (_, false) => refined && missed[1] > 4.0 * missed[0] && last > first,
        ("lattice", true) => refined && missed[1] < 1e-9 && last < 0.1 * first,
        (_, true) => refined && missed[1] < missed[0] && last < first,
    };
    let kind = if falling { "falling" } else { "kept" };
    let [lost, missed] = [lost, missed].map(|[a, b]| format!("from {a:.1e} to {b:.1e}"));
    let text = format!(
        "{set}, order {order}, h/epsilon {kind}: mollification {lost}, quadrature {missed}, the error from {first:.1e} to {last:.1e}"
    );
    bench.claim(SCENE, holds, text);
}

fn wave(x: &[f64; 1]) -> f64 {
    (TAU * x[0] + PHASE).sin()
}

fn second() -> Vec<Term<1>> {
    vec![Term { index: MultiIndex::new([2]), factor: 1.0 }]
}

/// epsilon^-2 int eta(z) (cos(2 pi epsilon z) - 1) dz. The trapezoidal rule with 16 nodes a unit errs by exp(-(16 pi)^2).
fn symbol(order: u32, epsilon: f64) -> parops::Result<f64> {
    const NODES: i32 = 16;
    let kernel = Exchange::<1>::new(&second(), order)?;
    let reach = (Kernel::<f64, 1>::support(&kernel) * f64::from(NODES)).ceil() as i32;
    let sum: f64 = (1..=reach)
        .map(|i| f64::from(i) / f64::from(NODES))
        // cos a - 1 without cancellation.
        .map(|z| -4.0 * kernel.value(&[z]) * (0.5 * TAU * epsilon * z).sin().powi(2))
        .sum();
    Ok(sum / f64::from(NODES) / (epsilon * epsilon))
}
