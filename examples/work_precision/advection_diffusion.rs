//! Advection and diffusion in 2D and 3D: particles that stay, by upwind and by DC-PSE, and particles that move, by PSE and
//! each Lambda.
//!
//! Particles that stay are scattered, those that move start on a lattice and are remeshed after every step; all are
//! stepped by RK4, where they stay at nine tenths of the longest legal step, where they move at 0.625 h, cut to what is
//! stable. Errors are relative to the fluctuation u - 1, over all particles at the end. The gamma of the hyperviscosity, a
//! constant of the flow, is found before, and growth is not looked for: neither is among the times. The searches of particles
//! that move are part of their steps.

use std::error::Error;

use parops::report::{Phase, Sample, Stopwatch, observed_order};
use parops::{
    AdvectionDiffusion, Carried, CellList, DcPse, Domain, Eulerian, GrowthPolicy, Lagrangian, Lambda, Laplacian, Mesh,
    MeshKernel, Method, MovingSettings, Nearest, Neighbors, Particles, Pse, Remeshing, Rk4, Site, Spacing, Stabilized,
    StepPolicy, Transport, Trigger, UpwindGradient,
};

use crate::bench::Bench;
use crate::cells::{DIFFUSIVITY, exact, velocity};
use crate::timed::Timed;

const SCENE: &str = "advection_diffusion";
/// When runs end, in one to three dimensions: before the viscosity of upwind has saturated its error, a rate that grows
/// with the dimension and falls with the spacing.
const END: [f64; 3] = [0.25, 0.25, 0.125];
/// Largest displacement of particles that stay from a lattice, in units of its spacing.
const JITTER: f64 = 0.2;
/// The step of a run over the longest that is legal at its start: the velocity changes.
const SAFETY: f64 = 0.9;
/// Steps of particles that move, in h.
const STEP: f64 = 0.625;
/// epsilon/h of PSE.
const OVERLAP: f64 = 1.5;
/// Where the kernels of upwind are cut, in units of epsilon = h.
const UPWIND_SUPPORT: f64 = 4.0;
/// Particles along an axis of the sets that tell gamma.
const COARSE: [usize; 3] = [16, 16, 7];

/// How far an order may be from where it must be.
const BAND: f64 = 0.3;
const PHASES: &str = "Particles that stay: build makes the rows, apply is the right-hand sides, step the rest of the steps. \
    Particles that move: build is the start of the run; step is all that steps do, search, rows and products included, and \
    remeshing.";
const SETS: &str = "Particles that stay are scattered (jitter 0.2 h), those that move start on a lattice of as many and are \
    remeshed onto it after every step: methods are compared on one problem, each on the set that it is used with. The gamma of \
    the hyperviscosity is searched for on a small set before; the search is in none of the times.";

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    bench.note(SCENE, PHASES);
    bench.note(SCENE, SETS);
    let [plane, space, carried]: [&[usize]; 3] =
        if bench.quick { [&[24, 36], &[16, 24], &[14]] } else { [&[24, 36, 54, 81], &[16, 24, 32], &[14, 18, 22]] };
    each::<2>(bench, plane, plane)?;
    each::<3>(bench, space, carried)?;
    claims(bench);
    Ok(())
}

/// All methods on sets of these particles along an axis, those that move on others.
fn each<const D: usize>(bench: &mut Bench, sides: &[usize], carried: &[usize]) -> parops::Result<()> {
    upwind::<D>(bench, sides)?;
    central::<D, 2>(bench, sides)?;
    central::<D, 4>(bench, sides)?;
    moving::<D, _, 4>(bench, carried, 2, "2 1", Lambda::<2, 1>::new)?;
    moving::<D, _, 4>(bench, carried, 2, "2 2", Lambda::<2, 2>::new)?;
    moving::<D, _, 6>(bench, carried, 4, "4 2", Lambda::<4, 2>::new)?;
    moving::<D, _, 6>(bench, carried, 4, "4 4", Lambda::<4, 4>::new)?;
    // In 3D a run takes seconds.
    if D < 3 || !bench.quick {
        moving::<D, _, 8>(bench, carried, 4, "6 4", Lambda::<6, 4>::new)?;
        moving::<D, _, 8>(bench, carried, 4, "6 6", Lambda::<6, 6>::new)?;
        moving::<D, _, 10>(bench, carried, 4, "8 4", Lambda::<8, 4>::new)?;
    }
    Ok(())
}

/// Where PSE of an order is cut, in units of epsilon: at no shell of the lattice, and where the kernel is as small as the
/// errors that the finest sets leave. Cut at a shell, at 4 epsilon = 6 h, rounding tells which of a pair of opposite
/// neighbors is in, and errors of 5e-6 stay.
fn support(order: u32) -> f64 {
    if order == 2 { 3.5 } else { 4.5 }
}

fn torus<const D: usize>() -> parops::Result<Domain<D>> {
    Domain::periodic([0.0; D], [1.0; D])
}

fn scattered<const D: usize>(side: usize) -> parops::Result<Particles<D>> {
    Particles::jittered([0.0; D], [1.0; D], [side; D], JITTER, 1)
}

fn sample<const D: usize>(side: usize, method: &str, order: u32, stepper: &str) -> Sample {
    Sample {
        stepper: stepper.to_string(),
        n: side.pow(D as u32),
        h: 1.0 / side as f64,
        ..Sample::new(SCENE, D, "torus", method, order)
    }
}

/// Advection from upwind to order 1, diffusion by DC-PSE of order 2.
fn upwind<const D: usize>(bench: &mut Bench, sides: &[usize]) -> parops::Result<()> {
    for &side in sides {
        let set = scattered::<D>(side)?;
        let (h, what) = (set.spacing()?, sample::<D>(side, "upwind", 1, "RK4"));
        bench.sample(what, |watch, sample| {
            let scheme = UpwindGradient::new(h.epsilon(1.0)?, set.volumes()?).support(UPWIND_SUPPORT)?;
            let cells = watch.time(Phase::Neighbors, || CellList::build(&set, &torus()?, scheme.cutoff()))?;
            // Of the many neighbors of the upwind rows the window takes the nearest.
            let laplacian = DcPse::<Laplacian<D>, 2>::new().epsilon(h.epsilon(1.4)?);
            fixed(watch, sample, &set, &cells, laplacian, scheme)
        })?;
    }
    Ok(())
}

/// DC-PSE of order R for both terms, with hyperviscosity.
fn central<const D: usize, const R: u32>(bench: &mut Bench, sides: &[usize]) -> parops::Result<()> {
    let laplacian = DcPse::<Laplacian<D>, R>::new();
    let near = |set: &Particles<D>| Nearest::build(set, &torus()?, laplacian.fewest_neighbors::<D>()?);
    let stabilized = |side: usize| Stabilized::<D, R>::new(Spacing(1.0 / side as f64));
    // gamma has no unit: a small set tells it for all.
    let coarse = scattered::<D>(COARSE[D - 1])?;
    let neighbors = near(&coarse)?;
    let (site, flow) = (Site::new(&coarse, &neighbors)?, |p: usize| velocity(&coarse.points()[p], 0.0));
    let gamma = stabilized(COARSE[D - 1]).build::<f64, _>(&site, flow, true, true, &neighbors)?.gamma();
    for &side in sides {
        let set = scattered::<D>(side)?;
        bench.sample(sample::<D>(side, "DC-PSE", R, "RK4"), |watch, sample| {
            let nearest = watch.time(Phase::Neighbors, || near(&set))?;
            fixed(watch, sample, &set, &nearest, laplacian.clone(), stabilized(side).gamma(gamma))
        })?;
    }
    Ok(())
}

/// A run of particles that stay.
fn fixed<const D: usize, N: Neighbors<D>, L: Method<D, Out = [f64; 1]> + Clone, X: Transport<D>>(
    watch: &Stopwatch,
    sample: &mut Sample,
    set: &Particles<D>,
    neighbors: &N,
    laplacian: L,
    scheme: X,
) -> parops::Result<()> {
    let mut u: Vec<f64> = set.points().iter().map(|x| exact(x, 0.0)).collect();
    let mut run = watch.time(Phase::Build, || {
        let scene = AdvectionDiffusion::<D>::new()
            .diffusion(DIFFUSIVITY, laplacian)
            .advection(velocity::<D> as fn(&[f64; D], f64) -> [f64; D], scheme);
        let stepper = Timed { stepper: Rk4::<Vec<f64>>::new(), watch };
        Eulerian::with_policy(scene, set, neighbors, stepper, StepPolicy::Refuse, GrowthPolicy::Unknown)
    })?;
    let ledger = watch.time(Phase::Step, || {
        let dt = SAFETY * run.longest_step(&u)?;
        run.advance(&mut u, END[D - 1], dt).cloned()
    })?;
    let pairs = run.discrete().reports().map(|report| report.pairs).max().unwrap_or(0);
    sample.neighbors = pairs as f64 / u.len() as f64;
    (sample.dt, sample.steps) = (Some(ledger.dt), ledger.step);
    sample.errors(u.iter().map(|u| u - 1.0), set.points().iter().map(|x| exact(x, END[D - 1]) - 1.0));
    Ok(())
}

/// Particles that move, by PSE and one Lambda.
fn moving<const D: usize, K: MeshKernel<f64, S> + 'static, const S: usize>(
    bench: &mut Bench,
    sides: &[usize],
    order: u32,
    name: &str,
    make: fn() -> parops::Result<K>,
) -> parops::Result<()> {
    for &side in sides {
        let set = Particles::lattice([0.0; D], [1.0; D], [side; D])?;
        let (h, u) = (set.spacing()?, set.points().iter().map(|x| exact(x, 0.0)).collect::<Vec<f64>>());
        let epsilon = h.epsilon(OVERLAP)?;
        let pse = || Pse::new(Laplacian::<D>, order, epsilon.clone(), set.volumes()?)?.support(support(order));
        let cutoff = pse()?.cutoff();
        // Of every particle of a lattice.
        let neighbors = CellList::build(&set, &torus()?, cutoff)?.count(0, cutoff.0) as f64;
        let what = Sample {
            epsilon: Some(OVERLAP * h.0),
            ..sample::<D>(side, "Lagrangian", order, &format!("RK4 Lambda {name}"))
        };
        bench.sample(what, |watch, sample| {
            let mut run = watch.time(Phase::Build, || {
                let scene = AdvectionDiffusion::<D>::new()
                    .diffusion(DIFFUSIVITY, pse()?)
                    .advection(velocity::<D> as fn(&[f64; D], f64) -> [f64; D], Carried);
                let mut settings = MovingSettings::default();
                settings.growth = GrowthPolicy::Unknown;
                let mesh = Mesh::cells(&torus()?, [side; D])?;
                let remeshing = Remeshing { kernel: make()?, mesh, trigger: Trigger::Steps(1), threshold: 0.0 };
                Lagrangian::with_settings(scene, &set, &u, &torus()?, Rk4::new(), settings)?
                    .step_policy(StepPolicy::Adapt { most: 20 })
                    .remeshing(remeshing)
            })?;
            let ledger = watch.time(Phase::Step, || run.advance(END[D - 1], STEP * h.0).cloned())?;
            sample.neighbors = neighbors;
            (sample.dt, sample.steps) = (Some(ledger.dt), ledger.step);
            let ends = run.points().iter().map(|x| exact(x, END[D - 1]) - 1.0);
            sample.errors(run.values().map(|u| u - 1.0), ends);
            Ok(())
        })?;
    }
    Ok(())
}

/// Every order shows. Remeshed after every step of a length in proportion to h, a kernel of exactness P adds an error of
/// order P. Where that is above the order r of PSE, coarse sets show it and fine ones r: the order is between both.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks().iter().filter(|task| task.samples()[0].scene == SCENE) {
        for series in task.series().into_iter().filter(|series| series.len() > 1) {
            let (first, last) = (series[0], series[series.len() - 1]);
            let observed = observed_order([first.h, last.h], [first.error_l2, last.error_l2]).unwrap_or(0.0);
            let (order, exactness) = (f64::from(last.order), exactness(last).unwrap_or(0.0));
            let (least, most) = (order - BAND, order.max(exactness) + BAND);
            let text = format!("{}D, {}: observed order {observed:.2}, {least} to {most}", last.dim, last.label());
            found.push(((least..=most).contains(&observed), text));
        }
    }
    found.into_iter().for_each(|(holds, text)| bench.claim(SCENE, holds, text));
}

/// P of the kernel that a sample is remeshed by.
fn exactness(sample: &Sample) -> Option<f64> {
    sample.stepper.split_once("Lambda ")?.1.split(' ').next()?.parse().ok()
}
