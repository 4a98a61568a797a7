//! Remeshing: weights of both signs, steps that distort too much, and steps that are not refined with the mesh.

use std::error::Error;
use std::f64::consts::TAU;

use parops::{Cic, ErrorKind, Limit, Remeshing, SolverError, StepPolicy, Trigger};

use super::ring;
use super::sets::{listed, order, relative_error};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// The relative error at t of values on the nodes of a ring.
fn error(u: &[f64], t: f64) -> f64 {
    let exact: Vec<f64> = (0..u.len()).map(|i| ring::exact(i as f64 * TAU / u.len() as f64, t)).collect();
    relative_error(u, &exact)
}

/// 14. A top hat remeshed by a kernel with negative weights.
pub fn negative_weights(case: &mut Case, _: bool) -> Done {
    const N: usize = 128;
    const STEPS: usize = 400;
    let h = TAU / N as f64;
    case.setup(format!("a top hat on a ring of {N} nodes, Lambda_4,2, shifted by 0.37 h and remeshed {STEPS} times"));
    let hat = |x: f64| if (1.5..4.5).contains(&x) { 1.0 } else { 0.0 };
    let naive = ring::naive(N, 0.37, 0.0, h, STEPS, hat)?;
    let extrema = |u: &[f64]| u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &u| (a.min(u), b.max(u)));
    let (low, high) = extrema(&naive.u);
    case.naive(
        low < -0.05 && high > 1.05 && naive.drift.abs() < 1e-12,
        format!("values from {low:.3} to {high:.3}, while the mass, exact to {:.0e}, says nothing", naive.drift.abs()),
    );
    let mut run = ring::run_from(N, 0.37, 0.0, hat)?.remeshing(ring::each_step(N)?)?;
    let (mut below, mut above) = (0.0_f64, 0.0_f64);
    run.advance_with(STEPS as f64 * h, h, |row, _| {
        (below, above) = (below.min(row.fields[0].min), above.max(row.fields[0].max));
    })?;
    let totals = &run.ledger().fields[0];
    let negative: f64 = naive.u.iter().map(|u| u.min(0.0) * h).sum();
    case.reports(
        (totals.min - low).abs() < 1e-9
            && (totals.max - high).abs() < 1e-9
            && (totals.negative_mass - negative).abs() < 1e-9,
        format!(
            "the ledger has min {:.3}, max {:.3} and negative mass {:.3} ({:.3} to {:.3} on the way), drift {:.0e}",
            totals.min,
            totals.max,
            totals.negative_mass,
            below,
            above,
            totals.drift.abs() / totals.size
        ),
    );
    let positive = Remeshing { kernel: Cic, mesh: ring::mesh(N)?, trigger: Trigger::Steps(1), threshold: 0.0 };
    let mut run = ring::run_from(N, 0.37, 0.0, hat)?.remeshing(positive)?;
    run.advance(STEPS as f64 * h, h)?;
    let totals = &run.ledger().fields[0];
    case.adapts(
        totals.min >= 0.0 && totals.max <= 1.0 + 1e-12 && totals.negative_mass == 0.0 && totals.drift.abs() < 1e-12 * totals.size,
        format!("a kernel without negative weights is the caller's choice: with CIC {:.3} to {:.3}, of the same mass and order 1", totals.min, totals.max),
    );
    Ok(())
}

/// 15. Steps with dt |dv/dx| above 1.
pub fn lcfl(case: &mut Case, _: bool) -> Done {
    const N: usize = 256;
    const STEPS: [f64; 2] = [2.4, 3.0];
    case.setup(format!(
        "v = 1 + 0.5 sin x on a ring of {N} nodes, Lambda_4,2 each step, two steps of dt max|v'| = 1.2 and of 1.5"
    ));
    let [first, second] = STEPS.map(|dt| ring::naive(N, 1.0, 0.5, dt, 2, ring::start));
    let runs = [first?, second?];
    let errors = [error(&runs[0].u, 2.0 * STEPS[0]), error(&runs[1].u, 2.0 * STEPS[1])];
    let drift = runs.iter().map(|run| run.drift.abs()).fold(0.0, f64::max);
    case.naive(
        errors.iter().all(|error| *error > 0.1) && drift < 1e-13,
        format!("errors {} with a mass drift of {drift:.0e}", listed(errors)),
    );
    let start = || ring::run(N, 1.0, 0.5)?.remeshing(ring::each_step(N)?);
    let mut run = start()?;
    let refusal = run.step(STEPS[0]).err();
    let limit = match refusal.as_ref().map(parops::Error::kind) {
        Some(ErrorKind::Solver(SolverError::Limit { limit, binding: Limit::Distortion, .. })) => *limit,
        _ => f64::NAN,
    };
    let at = refusal.as_ref().and_then(parops::Error::particle);
    let steepest = at.is_some_and(|p| (0.5 * run.points()[p][0].cos()).abs() > 0.499);
    case.detects(
        (limit - 1.0).abs() < 1e-6 && run.time() == 0.0,
        format!("from grad v before the step: the longest legal step is {limit:.3}, that is dt max|v'| = 0.5"),
    );
    case.reports(
        steepest && (STEPS[0] / limit * 0.5 - 1.2).abs() < 1e-6,
        refusal.map_or(String::from("accepted"), |error| error.to_string()),
    );
    // The error at the end, and how often a step was cut.
    let finished = |remeshed: bool, end: f64, dt: f64, policy: StepPolicy| -> parops::Result<(f64, u64)> {
        let mut run = if remeshed { start()? } else { ring::run(N, 1.0, 0.5)? }.step_policy(policy);
        run.advance(end, dt)?;
        let exact: Vec<f64> = run.points().iter().map(|x| ring::exact(x[0], end)).collect();
        Ok((relative_error(&run.values().collect::<Vec<_>>(), &exact), run.ledger().retries))
    };
    let of_both = |step: &dyn Fn(f64) -> f64, policy: StepPolicy| -> parops::Result<([f64; 2], u64)> {
        let [first, second] = STEPS.map(|dt| finished(true, 2.0 * dt, step(dt), policy));
        let (first, second) = (first?, second?);
        Ok(([first.0, second.0], first.1.min(second.1)))
    };
    let below = |errors: &[f64; 2], factor: f64, others: &[f64; 2]| {
        errors.iter().zip(others).all(|(error, other)| *error < factor * other)
    };
    let (legal, _) = of_both(&|_| limit, StepPolicy::Refuse)?;
    let (fine, _) = of_both(&|_| limit / 16.0, StepPolicy::Refuse)?;
    let cut = StepPolicy::Adapt { most: 8 };
    let (whole, parts) = of_both(&|dt| dt, cut)?;
    case.adapts(
        below(&whole, 0.4, &errors) && below(&whole, 1.01, &legal) && fine.iter().all(|error| *error < 1e-3) && parts > 0,
        format!(
            "policy adapt cuts the steps and remeshes after each part: errors {}; {} with the longest legal steps, {} with a sixteenth of them",
            listed(whole),
            listed(legal),
            listed(fine)
        ),
    );
    // Without it steps of 3 would leave a volume below zero.
    let (long, _) = finished(false, 2.0 * STEPS[0], STEPS[0], StepPolicy::Allow)?;
    let (short, parts) = finished(false, 2.0 * STEPS[0], STEPS[0], cut)?;
    case.adapts(
        short < 0.1 * long && parts > 0,
        format!("it cuts the paths too: without remeshing the error is {short:.1e} in place of {long:.1e}"),
    );
    case.documents(
        include_str!("../../../src/solver/policy.rs"),
        "a step cut for distortion gives what the shorter steps give",
    );
    Ok(())
}

/// 16. A fixed dt |dv/dx| under refinement.
pub fn fixed_lcfl(case: &mut Case, quick: bool) -> Done {
    const END: f64 = 6.0;
    let grids: &[usize] = if quick { &[64, 128, 256] } else { &[64, 128, 256, 512] };
    case.setup(format!("the same flow with dt max|v'| = 0.5 on n = {grids:?} nodes, then with dt/h fixed (CFL 3)"));
    let fixed: Vec<f64> = grids
        .iter()
        .map(|&n| ring::naive(n, 1.0, 0.5, 1.0, END as usize, ring::start).map(|run| error(&run.u, END)))
        .collect::<Result<_, _>>()?;
    case.naive(
        fixed[fixed.len() - 1] > 0.5 * fixed[0],
        format!("errors {}: stable, and no convergence", listed(fixed)),
    );
    let refined = |&n: &usize| -> parops::Result<f64> {
        let mut run = ring::run(n, 1.0, 0.5)?.courant(0.99)?.remeshing(ring::each_step(n)?)?;
        run.advance(END, 3.0 / 1.5 * TAU / n as f64)?;
        let exact: Vec<f64> = run.points().iter().map(|x| ring::exact(x[0], END)).collect();
        Ok(relative_error(&run.values().collect::<Vec<_>>(), &exact))
    };
    let errors: Vec<f64> = grids.iter().map(refined).collect::<Result<_, _>>()?;
    let orders: Vec<f64> = errors.windows(2).map(|e| order(e[0], e[1], 2.0)).collect();
    let overall = order(errors[0], errors[errors.len() - 1], 2.0_f64.powi(errors.len() as i32 - 1));
    case.prevents(
        overall > 3.0 && orders.iter().all(|order| *order > 2.5),
        format!(
            "dt refined with h: errors {}, orders {}, {overall:.2} over all",
            listed(errors.iter().copied()),
            listed(orders)
        ),
    );
    case.documents(
        include_str!("../../../src/solver/lagrangian.rs"),
        "Order tests refine dt with h: a bounded dt |grad v| is stability, not convergence.",
    );
    Ok(())
}
