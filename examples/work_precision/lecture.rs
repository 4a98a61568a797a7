//! The lecture benchmark: u_t = D u_xx on a ray, odd at x = 0, with its exact solution at T = 10.
//!
//! The random walk; SPH, PSE and DC-PSE rows with RK4 at the step asked for, cut to what is stable, RKL2 and Crank-Nicolson
//! at steps ten times as long. Errors are relative to the exact solution, over all particles (bins for the walk).

use std::error::Error;

use parops::report::{Phase, Sample, Stopwatch};
use parops::{
    Allowance, Apply, CellList, CsrMatrix, DcPse, Domain, Epsilon, Face, Gaussian, Implicit, Laplacian, Nearest,
    Particles, Plan, Pse, Rk4, Rkl2, RowSymmetry, Rows, Sph, SphForm, StepLimit, integrate,
};

use crate::bench::Bench;
use crate::benchmark::{D, DT, T, X_PSE, X_RW, exact};
use crate::random_walk::{centers, walk};

const SCENE: &str = "lecture";
/// The step of RKL2 and Crank-Nicolson: their time error, D^3 T dt^2 u'''''', is below 1e-9 of u.
const LONG: f64 = 1.0;
const PHASES: &str = "Build makes kernels, rows and matrices. Apply is the products with the rows, step the rest of the steps; \
    Crank-Nicolson has all of a step in step, factors and solves, and the random walk is nothing but steps.";
/// How far an order may be from r, and an error of long steps above that of short ones: a factor, and what is left beside.
const BAND: f64 = 0.3;
const SAME: f64 = 1.1;
const LEFT: f64 = 1e-8;

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    bench.note(SCENE, PHASES);
    let sizes: &[usize] = if bench.quick { &[50, 100, 200] } else { &[25, 50, 100, 200, 400, 800] };
    for &n in sizes {
        random_walk(bench, n)?;
    }
    let methods = [("SPH", 2), ("PSE", 2), ("PSE", 4), ("PSE", 6), ("PSE", 8)];
    let corrected = [2, 4, 6, 8].map(|order| ("DC-PSE", order));
    for (method, order) in methods.into_iter().chain(corrected) {
        for stepper in ["RK4", "RKL2", "Crank-Nicolson"] {
            for &n in sizes {
                diffusion(bench, method, order, stepper, n)?;
            }
        }
    }
    claims(bench);
    Ok(())
}

/// Bins of particles that walk, by one seed.
fn random_walk(bench: &mut Bench, n: usize) -> parops::Result<()> {
    let what = Sample {
        n,
        h: X_RW / n as f64,
        dt: Some(DT),
        steps: (T / DT).round() as u64,
        ..Sample::new(SCENE, 1, "ray", "random walk", 0)
    };
    bench.sample(what, |watch, sample| {
        let bins = watch.time(Phase::Step, || walk(n, 0));
        sample.errors(bins, centers().map(|x| exact(x, T)));
        Ok(())
    })?;
    Ok(())
}

fn diffusion(bench: &mut Bench, method: &str, order: u32, stepper: &str, n: usize) -> parops::Result<()> {
    let h = X_PSE / n as f64;
    let particles = Particles::lattice([0.0], [X_PSE], [n])?;
    let x: Vec<f64> = particles.points().iter().map(|x| x[0]).collect();
    let epsilon = 2.0 * h;
    let what = Sample {
        stepper: stepper.to_string(),
        n,
        h,
        epsilon: (method != "DC-PSE").then_some(epsilon),
        ..Sample::new(SCENE, 1, "ray", method, order)
    };
    bench.sample(what, |watch, sample| {
        let rows = rows(watch, method, order, epsilon, &particles)?;
        sample.neighbors = rows.report().pairs as f64 / n as f64;
        let mut u: Vec<f64> = x.iter().map(|&x| exact(x, 0.0)).collect();
        (sample.dt, sample.steps) = advance(watch, stepper, method != "DC-PSE", &rows, &mut u)?;
        sample.errors(u, x.iter().map(|&x| exact(x, T)));
        Ok(())
    })?;
    Ok(())
}

/// Laplacian rows with the odd image at x = 0; at the open end u is below rounding, and kernels may miss neighbors.
fn rows(
    watch: &Stopwatch,
    method: &str,
    order: u32,
    epsilon: f64,
    particles: &Particles<1>,
) -> parops::Result<Rows<[f64; 1]>> {
    let ray = Domain::new([0.0], [X_PSE], [[Face::MirrorOdd, Face::Open]])?;
    let length = Epsilon::global(epsilon)?;
    let beyond = |cutoff: f64| {
        let near = particles.points().iter().enumerate().filter(move |(_, x)| x[0] > X_PSE - cutoff);
        Allowance::at(near.map(|(p, _)| p))
    };
    match method {
        "SPH" => {
            let sph = watch.time(Phase::Build, || {
                Sph::new(Laplacian::<1>, Gaussian::<1>::new(), length, particles.volumes()?)?.form(SphForm::Difference)
            })?;
            let cutoff = sph.cutoff();
            let sph = sph.allow(beyond(cutoff.0));
            let cells = watch.time(Phase::Neighbors, || CellList::build(particles, &ray, cutoff))?;
            watch.time(Phase::Build, || sph.assemble(&cells))
        }
        "PSE" => {
            let pse = watch.time(Phase::Build, || Pse::new(Laplacian::<1>, order, length, particles.volumes()?))?;
            let cutoff = pse.cutoff();
            let pse = pse.allow(beyond(cutoff.0));
            let cells = watch.time(Phase::Neighbors, || CellList::build(particles, &ray, cutoff))?;
            watch.time(Phase::Build, || pse.assemble(&cells))
        }
        _ => {
            let dcpse = DcPse::at_order(Laplacian::<1>, order)?;
            let needed = dcpse.fewest_neighbors::<1>()?;
            let nearest = watch.time(Phase::Neighbors, || Nearest::build(particles, &ray, needed))?;
            watch.time(Phase::Build, || dcpse.assemble(&nearest))
        }
    }
}

/// Takes u from 0 to T; the step and how many.
fn advance(
    watch: &Stopwatch,
    stepper: &str,
    symmetric: bool,
    rows: &Rows<[f64; 1]>,
    u: &mut Vec<f64>,
) -> parops::Result<(Option<f64>, u64)> {
    let limit = StepLimit::from_spectral_bound(rows.report().spectral_bound, D)?;
    let rate = |_: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
        watch.time(Phase::Apply, || rows.apply(u, du))?;
        du.iter_mut().for_each(|du| *du *= D);
        Ok(())
    };
    if stepper == "Crank-Nicolson" {
        let mut implicit = watch.time(Phase::Build, || {
            let laplacian = rows.to_csr(0)?;
            let scaled = laplacian.triplets().map(|(p, q, w)| (p, q, D * w));
            Implicit::crank_nicolson(CsrMatrix::from_triplets(laplacian.rows(), laplacian.columns(), scaled)?)
        })?;
        let plan = Plan::new(0.0, T, LONG)?;
        watch.time(Phase::Step, || {
            (0..plan.steps()).try_for_each(|n| {
                let none = &mut |_: f64, g: &mut [f64]| {
                    g.fill(0.0);
                    Ok(())
                };
                implicit.step(plan.time(n), plan.dt(), u, none).map(|_| ())
            })
        })?;
        return Ok((Some(plan.dt()), plan.steps()));
    }
    let run = if stepper == "RK4" {
        let plan = Plan::new(0.0, T, DT)?.limit(limit).cut_for(&Rk4::<Vec<f64>>::new())?;
        watch.time(Phase::Step, || integrate(&mut Rk4::new(), u, &plan, rate, |_, _, _| {}))?
    } else {
        let symmetry = if symmetric { RowSymmetry::Symmetric } else { RowSymmetry::General };
        let mut rkl2 = Rkl2::for_decay(&limit, LONG, symmetry)?;
        let plan = Plan::new(0.0, T, LONG)?.limit(limit);
        watch.time(Phase::Step, || integrate(&mut rkl2, u, &plan, rate, |_, _, _| {}))?
    };
    Ok((Some(run.dt), run.steps))
}

/// Spatial orders above rounding, and long steps that cost no accuracy.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks().iter().filter(|task| task.samples()[0].scene == SCENE) {
        let last = |method: &str, order: u32, stepper: &str| {
            let is = |s: &&&Sample| (s.method.as_str(), s.order, s.stepper.as_str()) == (method, order, stepper);
            task.samples().iter().rev().find(is).copied()
        };
        for (method, order) in [("PSE", 2), ("PSE", 4), ("PSE", 6), ("DC-PSE", 2), ("DC-PSE", 4), ("DC-PSE", 6)] {
            let is = |s: &&&Sample| (s.method.as_str(), s.order, s.stepper.as_str()) == (method, order, "RK4");
            let fine = task.samples().iter().rev().find(|s| is(s) && s.error_l2 > 1e-10);
            let observed = fine.and_then(|sample| sample.observed_order).unwrap_or(0.0);
            let holds = (observed - f64::from(order)).abs() < BAND;
            let text =
                format!("{method} {order} with RK4 has the observed order {observed:.2}, within {BAND} of {order}");
            found.push((holds, text));
        }
        for (method, order) in [("PSE", 4), ("DC-PSE", 4)] {
            for stepper in ["RKL2", "Crank-Nicolson"] {
                if let (Some(short), Some(long)) = (last(method, order, "RK4"), last(method, order, stepper)) {
                    let most = SAME * short.error_l2 + LEFT;
                    let holds = long.error_l2 < most && long.steps < short.steps;
                    let (errors, steps) = ([short.error_l2, long.error_l2], [short.steps, long.steps]);
                    let [a, b] = errors.map(|error| format!("{error:.2e}"));
                    let text = format!(
                        "{method} {order}: RK4 errs by {a} in {} steps, {stepper} by {b}, below {most:.2e}, in {}",
                        steps[0], steps[1]
                    );
                    found.push((holds, text));
                }
            }
        }
    }
    found.into_iter().for_each(|(holds, text)| bench.claim(SCENE, holds, text));
}
