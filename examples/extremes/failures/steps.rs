//! Steps that are too long for a term, fields that overshoot, and values that are no numbers.

use std::error::Error;

use parops::{
    AdvectionDiffusion, Apply, ApplyError, Central, DcPse, Diffusion, ErrorKind, Euler, Eulerian, Exchange, Gradient,
    GrowthPolicy, ImplicitScheme, Laplacian, Limit, Nearest, Neighbors, Particles, Pse, Rk4, SolverError, Source,
    SpectrumEstimator, StepPolicy, TimeError, TimeScheme, UpwindGradient, Volumes,
};

use super::sets::{cells, square, torus, values, wave};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// S(x, t, u), of one type for all scenes.
type Rate = fn(&[f64; 2], f64, f64) -> f64;

/// Diffusion by PSE with a source.
type Heat = AdvectionDiffusion<2, f64, (Diffusion<f64, Pse<Exchange<2>>>, (), Source<Rate>, ())>;

const OVERLAP: f64 = 1.5;

fn pse(particles: &Particles<2>) -> parops::Result<Pse<Exchange<2>>> {
    Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(OVERLAP)?, particles.volumes()?)
}

/// A run of that scene on the unit torus.
fn heated<St: TimeScheme<2, Heat>>(
    particles: &Particles<2>,
    nu: f64,
    source: Rate,
    stepper: St,
) -> parops::Result<Eulerian<2, Heat, St>> {
    let method = pse(particles)?;
    let around = cells(particles, &torus()?, method.cutoff().0)?;
    Eulerian::new(AdvectionDiffusion::<2>::new().diffusion(nu, method).source(source), particles, &around, stepper)
}

fn largest(u: &[f64]) -> f64 {
    u.iter().fold(0.0, |most, u| u.abs().max(most))
}

fn none(_: &[f64; 2], _: f64, _: f64) -> f64 {
    0.0
}

/// 17. A step above the diffusion limit.
pub fn diffusion_limit(case: &mut Case, _: bool) -> Done {
    const M: usize = 24;
    case.setup(format!(
        "diffusion with nu = 1 by PSE on a {M}x{M} lattice, Euler, dt = 1.1 x 2/|lambda_min|, 15 steps, noise 1e-3"
    ));
    let particles = square(M, 0.0, 1)?;
    let method = pse(&particles)?;
    let rows = method.assemble(&cells(&particles, &torus()?, method.cutoff().0)?)?;
    let radius = SpectrumEstimator::new().of(&rows)?.radius;
    let dt = 1.1 * 2.0 / radius;
    let mut random = parops::Random::new(3);
    let start: Vec<f64> = values(&particles, |x| wave(x) + 1e-3 * random.uniform());
    let (mut u, mut lap) = (start.clone(), vec![0.0; start.len()]);
    let mut sawtooth = [0.0; 2];
    for step in 0..60 {
        rows.apply(&u, &mut lap)?;
        u.iter_mut().zip(&lap).for_each(|(u, lap)| *u += dt * lap);
        match step {
            44 => sawtooth[0] = largest(&u),
            59 => sawtooth[1] = largest(&u),
            _ => {}
        }
    }
    let factor = sawtooth[1] / sawtooth[0];
    case.naive(
        factor > 2.0 && largest(&u) > 10.0,
        format!("a sawtooth grows by {factor:.1} in 15 steps, to {:.0e} after 60", largest(&u)),
    );

    let bound = rows.report().spectral_bound;
    let mut run = heated(&particles, 1.0, none, Euler::new())?;
    let mut kept = start.clone();
    let refusal = run.step(&mut kept, dt).err();
    let found = match refusal.as_ref().map(parops::Error::kind) {
        Some(ErrorKind::Solver(SolverError::Limit { limit, binding: Limit::Diffusion, .. })) => *limit,
        _ => f64::NAN,
    };
    case.detects(
        (found - 2.0 / bound).abs() < 1e-9 * found && (1.0..1.25).contains(&(bound / radius)) && kept == start,
        format!(
            "the bound from the rows is {:.3} times |lambda_min|: {}",
            bound / radius,
            refusal.map_or(String::from("accepted"), |error| error.to_string())
        ),
    );
    let mut cut = heated(&particles, 1.0, none, Euler::new())?.step_policy(StepPolicy::Adapt { most: 4 });
    let mut u = start.clone();
    cut.advance(&mut u, 60.0 * dt, dt)?;
    let mut implicit = heated(&particles, 1.0, none, ImplicitScheme::euler())?;
    let mut v = start.clone();
    implicit.advance(&mut v, 60.0 * dt, 4.0 * dt)?;
    case.adapts(
        cut.ledger().substeps == 2 && largest(&u) < largest(&start) && largest(&v) < largest(&start),
        format!(
            "{} substeps a step: largest value {:.3}; implicit Euler with four times the step {:.3}",
            cut.ledger().substeps,
            largest(&u),
            largest(&v)
        ),
    );
    Ok(())
}

/// 18. A stiff source.
pub fn stiff_source(case: &mut Case, _: bool) -> Done {
    const RATE: f64 = 1e4;
    const DT: f64 = 1e-3;
    fn pull(_: &[f64; 2], t: f64, u: f64) -> f64 {
        -RATE * (u - t.cos())
    }
    case.setup("u' = nu Lap u - 1e4 (u - cos t) on a 24x24 lattice, Euler, dt = 1e-3");
    let particles = square(24, 0.0, 1)?;
    let mut u = 1.1_f64;
    let mut factors = Vec::new();
    for step in 0..5 {
        let t = DT * f64::from(step);
        let before = u - t.cos();
        u += DT * pull(&[0.0; 2], t, u);
        factors.push((u - (t + DT).cos()) / before);
    }
    case.naive(
        factors.iter().all(|factor| (factor + 9.0).abs() < 0.1),
        format!("the distance to cos t is multiplied by {:.2} a step", factors[0]),
    );

    let mut run = heated(&particles, 1e-4, pull, Euler::new())?;
    let start = vec![1.1; particles.len()];
    let mut u = start.clone();
    let rate = run.limits(&u)?.rate(Limit::Source).decay;
    case.detects((rate / RATE - 1.0).abs() < 1e-3, format!("a difference quotient finds the rate {rate:.1}"));
    let refusal = run.step(&mut u, DT).err();
    let typed = matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Solver(SolverError::Limit { binding: Limit::Source, limit, .. })) if (limit * RATE / 2.0 - 1.0).abs() < 1e-2);
    case.reports(typed && u == start, refusal.map_or(String::from("accepted"), |error| error.to_string()));
    let mut cut = heated(&particles, 1e-4, pull, Euler::new())?.step_policy(StepPolicy::Adapt { most: 10 });
    cut.advance(&mut u, 0.05, DT)?;
    let miss = u.iter().map(|u| (u - 0.05_f64.cos()).abs()).fold(0.0, f64::max);
    case.adapts(
        (5..=7).contains(&cut.ledger().substeps) && miss < 1e-3,
        format!("{} substeps a step: {miss:.0e} from cos t at t = 0.05", cut.ledger().substeps),
    );
    Ok(())
}

/// 19. A square wave.
pub fn discontinuity(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 24 } else { 32 };
    let h = 1.0 / m as f64;
    case.setup(format!("a square wave carried once around a {m}x{m} torus, DC-PSE of order 4 on the lattice, RK4"));
    let particles = square(m, 0.0, 1)?;
    let hat = |x: &[f64; 2]| if (0.25..0.75).contains(&x[0]) { 1.0 } else { 0.0 };
    let method = DcPse::at_order(Gradient::<2>, 4)?;
    let around = Nearest::build(&particles, &torus()?, method.fewest_neighbors::<2>()?)?;
    let rows = method.assemble(&around)?;
    let (v, dt, steps) = (vec![[-1.0, 0.0]; m * m], 0.25 * h, 4 * m);
    let mut u = values(&particles, hat);
    let (mut k, mut stage, mut sum) = (u.clone(), u.clone(), u.clone());
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for _ in 0..steps {
        stage.clone_from(&u);
        sum.fill(0.0);
        for (weight, next) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)] {
            rows.apply_along(&v, &stage, &mut k)?;
            for p in 0..u.len() {
                sum[p] += weight * k[p];
                stage[p] = u[p] + next * dt * k[p];
            }
        }
        u.iter_mut().zip(&sum).for_each(|(u, sum)| *u += dt / 6.0 * sum);
        (low, high) = u.iter().fold((low, high), |(low, high), u| (low.min(*u), high.max(*u)));
    }
    let start = values(&particles, hat);
    let l1 = |u: &[f64]| u.iter().zip(&start).map(|(u, start)| (u - start).abs()).sum::<f64>() / u.len() as f64;
    case.naive(
        high > 1.05 && low < -0.05,
        format!("values from {low:.3} to {high:.3}, an L1 error of {:.3} after one turn", l1(&u)),
    );

    let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.0], Central(DcPse::at_order(Gradient::<2>, 4)?));
    let mut run =
        Eulerian::with_policy(scene, &particles, &around, Rk4::new(), StepPolicy::Allow, GrowthPolicy::Unknown)?;
    let mut own = start.clone();
    let (mut least, mut most) = (0.0_f64, 1.0_f64);
    run.advance_with(&mut own, 1.0, dt, |row, _| {
        (least, most) = (least.min(row.fields[0].min), most.max(row.fields[0].max));
    })?;
    let negative = run.ledger().fields[0].negative_mass;
    case.reports(
        (least - low).abs() < 1e-6 && (most - high).abs() < 1e-6 && negative < 0.0,
        format!("the extrema are in the ledger: {least:.3} to {most:.3}, negative mass {negative:.1e}"),
    );
    let upwind = UpwindGradient::new(particles.spacing()?.epsilon(1.0)?, particles.volumes()?);
    let sided = cells(&particles, &torus()?, upwind.cutoff().0)?;
    let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.0], upwind);
    let mut run = Eulerian::new(scene, &particles, &sided, Euler::new())?;
    let mut smooth = start.clone();
    let (mut least, mut most) = (0.0_f64, 1.0_f64);
    run.advance_with(&mut smooth, 1.0, dt, |row, _| {
        (least, most) = (least.min(row.fields[0].min), most.max(row.fields[0].max));
    })?;
    case.adapts(
        least >= 0.0 && most <= 1.0,
        format!(
            "upwind of order 1 keeps {least:.3} to {most:.3}, at an L1 error of {:.3}; no order is claimed there",
            l1(&smooth)
        ),
    );
    Ok(())
}

/// 26. A value that is no number.
pub fn silent_nan(case: &mut Case, _: bool) -> Done {
    const M: usize = 24;
    const BAD: usize = 300;
    const STEPS: usize = 4;
    // The grain stands where its particle does.
    fn grain(x: &[f64; 2], t: f64, _: f64) -> f64 {
        let bad = (x[0] - 12.5 / 24.0).abs() < 1e-9 && (x[1] - 12.5 / 24.0).abs() < 1e-9;
        let mass: f64 = if bad && t > 2.0e-4 { -1.0 } else { 1.0 };
        1e-3 * mass.sqrt()
    }
    case.setup(format!(
        "diffusion by PSE on a {M}x{M} lattice; the source takes the root of a mass that is negative at one grain"
    ));
    let particles = square(M, 0.0, 1)?;
    let method = pse(&particles)?;
    let around = cells(&particles, &torus()?, method.cutoff().0)?;
    let dt = 1e-4;
    let mut u = values(&particles, wave);
    let mut spread = Vec::new();
    let epsilon = OVERLAP / M as f64;
    for step in 0..STEPS + 2 {
        let old = u.clone();
        for (p, x) in particles.points().iter().enumerate() {
            let mut sum = 0.0;
            around.for_each(p, 3.0 * epsilon, |q| {
                let r2 = q.separation.iter().map(|s| s * s).sum::<f64>() / (epsilon * epsilon);
                sum += (old[q.q] - old[p]) * (-r2).exp();
            });
            u[p] += dt * (0.01 * sum / (epsilon * epsilon) + grain(x, dt * (step + 1) as f64, old[p]));
        }
        spread.push(u.iter().filter(|u| u.is_nan()).count());
    }
    case.naive(
        spread.contains(&1) && spread[STEPS + 1] > 100,
        format!("the run goes on; values that are no numbers: {spread:?}, one cutoff farther each step"),
    );
    let at = (0..M * M).find(|&p| grain(&particles.points()[p], 1.0, 0.0).is_nan()).unwrap_or(BAD);
    let mut run = heated(&particles, 0.01, grain, Rk4::new())?;
    let mut field = values(&particles, wave);
    let refusal = run.advance(&mut field, 1.0, dt).err();
    let found = match refusal.as_ref().map(parops::Error::kind) {
        Some(ErrorKind::Time(TimeError::NotFinite { stage, t })) => Some((*stage, *t)),
        _ => None,
    };
    case.detects(
        found.is_some() && field.iter().all(|u| u.is_finite()) && (run.time() - 2.0 * dt).abs() < 1e-9,
        format!("the step that would let it in is refused; the field is that of t = {:.0e}", run.time()),
    );
    case.reports(
        refusal.as_ref().and_then(parops::Error::particle) == Some(at)
            && found.is_some_and(|(stage, t)| stage == 2 && t > 2.0 * dt),
        refusal.map_or(String::from("accepted"), |error| error.to_string()),
    );
    let mut poisoned = values(&particles, wave);
    poisoned[at] = (-1.0_f64).sqrt();
    let mut out = vec![0.0; poisoned.len()];
    let refusal = method.assemble(&around)?.apply(&poisoned, &mut out).err();
    let named = matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Apply(ApplyError::Field { value })) if value.is_nan());
    let volume = Volumes::each(vec![1.0, -1.0]).err();
    case.reports(
        named
            && refusal.as_ref().and_then(parops::Error::particle) == Some(at)
            && volume.as_ref().and_then(parops::Error::particle) == Some(1),
        format!(
            "at the door: {}; a negative mass as a volume: {}",
            refusal.map_or(String::from("accepted"), |error| error.to_string()),
            volume.map_or(String::from("accepted"), |error| error.to_string())
        ),
    );
    Ok(())
}

/// 21. Mass of an operator that is exact instead of conservative.
pub fn mass_drift(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 24 } else { 32 };
    case.setup(format!("heat with nu = 1 by DC-PSE of order 2 on {m}x{m} particles, jitter 0.3 h, a wave of unit amplitude, to t = 0.02"));
    let particles = square(m, 0.3, 3)?;
    let method = DcPse::at_order(Laplacian::<2>, 2)?;
    let around = Nearest::build(&particles, &torus()?, method.fewest_neighbors::<2>()?)?;
    let rows = method.assemble(&around)?;
    let (dt, end, volume) = (0.2 / (m * m) as f64, 0.02, 1.0 / (m * m) as f64);
    let steps = (end / dt).ceil() as usize;
    let start = values(&particles, |x| 1.0 + wave(x));
    let (mut u, mut lap) = (start.clone(), start.clone());
    for _ in 0..steps {
        rows.apply(&u, &mut lap)?;
        u.iter_mut().zip(&lap).for_each(|(u, lap)| *u += end / steps as f64 * lap);
    }
    let mass = |u: &[f64]| u.iter().sum::<f64>() * volume;
    let drift = mass(&u) - mass(&start);
    let relative = drift / (mass(&start) * end);
    case.naive(
        relative.abs() > 5e-3,
        format!(
            "the mass has changed by {drift:.1e} at t = {end}, {:.1} % per unit time, and nobody knows",
            100.0 * relative
        ),
    );
    let scene =
        || Ok::<_, parops::Error>(AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::at_order(Laplacian::<2>, 2)?));
    let mut run = Eulerian::new(scene()?, &particles, &around, Rk4::new())?;
    let mut field = start.clone();
    let (mut recorded, mut largest_drift) = (0_u64, 0.0_f64);
    run.advance_with(&mut field, end, dt, |row, _| {
        recorded += 1;
        largest_drift = largest_drift.max(row.fields[0].drift.abs());
    })?;
    let own = run.ledger().fields[0].drift;
    case.reports(
        recorded == run.ledger().step
            && (own / drift - 1.0).abs() < 0.05
            && ((mass(&field) - mass(&start)) - own).abs() < 1e-12,
        format!("the ledger has {own:.1e} after the last of {recorded} steps, {largest_drift:.1e} at most"),
    );
    let budget = 0.5 * largest_drift;
    let mut bounded = Eulerian::new(scene()?, &particles, &around, Rk4::new())?.drift_budget(budget)?;
    let mut field = start.clone();
    let refusal = bounded.advance(&mut field, end, dt).err();
    let typed = matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Solver(SolverError::Drift { drift, size, budget, .. })) if drift.abs() > budget * size);
    case.reports(
        typed && bounded.time() < end && (mass(&field) - mass(&start)).abs() <= budget * 1.01,
        format!("a budget: {}", refusal.map_or(String::from("accepted"), |error| error.to_string())),
    );
    let symmetric = pse(&particles)?.allow(parops::Allowance::Everywhere);
    let rows = symmetric.assemble(&cells(&particles, &torus()?, symmetric.cutoff().0)?)?;
    rows.apply(&start, &mut lap)?;
    let (net, size) = (lap.iter().sum::<f64>(), lap.iter().map(|x| x.abs()).sum::<f64>());
    case.adapts(
        net.abs() < 1e-12 * size,
        format!(
            "the symmetric operator, PSE, conserves to {:.0e} on the same set, and is not exact there",
            net.abs() / size
        ),
    );
    Ok(())
}
