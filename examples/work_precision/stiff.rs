//! Stiff diffusion with every stepper: the scene of the example stiff_diffusion, div(D grad u) with a D that jumps by 300.
//!
//! Every run starts and ends at the same times and differs in the number of its steps. The exact field is that of the rows
//! themselves, by their exponential: what is measured is the error in time. Errors are relative to what is left of the field.

use std::error::Error;

use parops::report::{Phase, Sample, Stopwatch};
use parops::{Method, TimeScheme};

use crate::bench::Bench;
use crate::scheme::{EXPLICIT, STIFF, Scheme};
use crate::setting::{END, Physics, Setting, lattice, scattered};
use crate::timed::Timed;

const SCENE: &str = "stiff";
/// Particles along an axis in quick and in full runs: the exponential takes their sixth power.
const SIDES: [usize; 2] = [16, 24];
/// Relative errors below this are rounding.
const ROUNDING: f64 = 1e-10;
/// How far an order in time may be from that of its scheme.
const BAND: f64 = 0.3;
/// The error for which steps are counted.
const GOOD: f64 = 1e-3;
const PHASES: &str = "Build makes the rows. Apply is the right-hand sides of explicit steppers, step the rest of their steps; \
    implicit ones have all of a step in step: factors, solves and products.";

pub fn run(bench: &mut Bench) -> Result<(), Box<dyn Error>> {
    bench.note(SCENE, PHASES);
    let side = SIDES[usize::from(!bench.quick)];
    each(bench, "PSE", side, &lattice(side)?)?;
    each(bench, "DC-PSE", side, &scattered(side)?)?;
    claims(bench);
    Ok(())
}

fn each<M: Method<2, Out = [f64; 1]> + Clone>(
    bench: &mut Bench,
    method: &str,
    side: usize,
    setting: &Setting<M>,
) -> parops::Result<()> {
    for scheme in EXPLICIT.into_iter().chain(STIFF) {
        for steps in steps(setting, scheme, bench.quick) {
            let dt = END / steps as f64;
            let what = Sample {
                stepper: scheme.name().replace(", ", " by "),
                n: setting.particles.len(),
                h: 1.0 / side as f64,
                dt: Some(dt),
                steps,
                ..Sample::new(SCENE, 2, setting.name, method, 2)
            };
            bench.sample(what, |watch, sample| {
                let (u, neighbors) = match scheme.implicit() {
                    Some(implicit) => advance(watch, setting, implicit, dt, steps)?,
                    None => {
                        let stepper = scheme.explicit(setting, dt)?.0;
                        advance(watch, setting, Timed { stepper, watch }, dt, steps)?
                    }
                };
                sample.neighbors = neighbors;
                let mean = setting.end.iter().sum::<f64>() / setting.end.len() as f64;
                sample.errors(u.iter().map(|u| u - mean), setting.end.iter().map(|u| u - mean));
                Ok(())
            })?;
        }
    }
    Ok(())
}

/// Explicit schemes from their limit on, the others from steps that are as long as they like.
fn steps<M: Method<2, Out = [f64; 1]> + Clone>(setting: &Setting<M>, scheme: Scheme, quick: bool) -> Vec<u64> {
    if EXPLICIT.contains(&scheme) {
        let fewest = (END / setting.limit(scheme)).ceil() as u64;
        return (0..if quick { 2 } else { 3 }).map(|doublings| fewest << doublings).collect();
    }
    (2..if quick { 8 } else { 10 }).map(|doublings| 1 << doublings).collect()
}

/// The field at the end, and its neighbors in the mean.
fn advance<M: Method<2, Out = [f64; 1]> + Clone, St: TimeScheme<2, Physics<M>>>(
    watch: &Stopwatch,
    setting: &Setting<M>,
    stepper: St,
    dt: f64,
    steps: u64,
) -> parops::Result<(Vec<f64>, f64)> {
    let neighbors = watch.time(Phase::Neighbors, || setting.search())?;
    let mut run = watch.time(Phase::Build, || setting.run(&neighbors, stepper))?;
    let mut u = setting.start.clone();
    watch.time(Phase::Step, || (0..steps).try_for_each(|_| run.step(&mut u, dt).map(|_| ())))?;
    let pairs = run.discrete().reports().map(|report| report.pairs).max().unwrap_or(0);
    let neighbors = pairs as f64 / u.len() as f64;
    Ok((u, neighbors))
}

/// Orders in time, and steps far above the limit of explicit ones.
fn claims(bench: &mut Bench) {
    let mut found = Vec::new();
    for task in bench.table.tasks().iter().filter(|task| task.samples()[0].scene == SCENE) {
        let (set, all) = (&task.samples()[0].set, task.series());
        for (series, scheme) in all.iter().zip(EXPLICIT.into_iter().chain(STIFF)) {
            let last = series[series.len() - 1];
            let above = series.iter().rev().find(|sample| sample.error_l2 > ROUNDING);
            let order = above.and_then(|sample| sample.observed_order);
            let holds = order.is_some_and(|order| (order - scheme.order()).abs() < BAND) || last.error_l2 <= ROUNDING;
            let shown = match order {
                Some(order) => format!("observed order {order:.2}, within {BAND} of {}", scheme.order()),
                None => "rounding is left".to_string(),
            };
            let down = if last.error_l2 <= ROUNDING { ", which is rounding" } else { "" };
            let text = format!("{set}, {}: {shown}; errors down to {:.1e}{down}", last.label(), last.error_l2);
            found.push((holds, text));
        }
        let fewest = |stiff: bool| {
            let chosen = all.iter().enumerate().filter(|(i, _)| (*i >= EXPLICIT.len()) == stiff);
            let good = chosen.flat_map(|(_, series)| series).filter(|sample| sample.error_l2 <= GOOD);
            good.map(|sample| sample.steps).min().unwrap_or(u64::MAX)
        };
        let [explicit, stiff] = [false, true].map(fewest);
        let text = format!(
            "{set}: an error of {GOOD:.0e} takes {explicit} explicit steps, {stiff} of the others, below a tenth"
        );
        found.push((stiff < explicit / 10, text));
    }
    found.into_iter().for_each(|(holds, text)| bench.claim(SCENE, holds, text));
}
