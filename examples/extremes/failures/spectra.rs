//! Eigenvalues on the wrong side: growing modes of advection, damping of the wrong size, weights of the wrong sign.

use std::error::Error;

use parops::{
    AdvectionDiffusion, Apply, Central, DcPse, ErrorKind, Eulerian, Gradient, GrowthPolicy, Hyperviscosity, Laplacian,
    Limit, Nearest, Particles, Rk4, Rows, Sign, SolverError, Spacing, SpectrumEstimator, Stabilized, StepPolicy,
};

use super::sets::{dcpse, laplacian, listed, square, torus, values, wave};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

pub const VELOCITY: [f64; 2] = [0.8, -0.6];

/// The gradient of order 2 in the '-' form, which grows fastest.
pub fn gradient() -> parops::Result<DcPse<Gradient<2>, 2>> {
    DcPse::<Gradient<2>, 2>::new().sign(Sign::Minus).neighbors_per_condition(1.5)
}

fn largest(u: &[f64]) -> f64 {
    u.iter().fold(0.0, |most, u| if u.is_finite() { u.abs().max(most) } else { f64::INFINITY })
}

/// u' = f(u) by RK4 written out.
fn rk4(
    u: &mut [f64],
    dt: f64,
    steps: usize,
    mut rhs: impl FnMut(&[f64], &mut [f64]) -> parops::Result<()>,
) -> parops::Result<()> {
    let n = u.len();
    let (mut k, mut stage, mut sum) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for _ in 0..steps {
        stage.copy_from_slice(u);
        sum.fill(0.0);
        for (weight, next) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)] {
            rhs(&stage, &mut k)?;
            for p in 0..n {
                sum[p] += weight * k[p];
                stage[p] = u[p] + next * dt * k[p];
            }
        }
        u.iter_mut().zip(&sum).for_each(|(u, sum)| *u += dt / 6.0 * sum);
        if !largest(u).is_finite() || largest(u) > 1e100 {
            break;
        }
    }
    Ok(())
}

/// -v . grad u from the rows of a gradient.
pub fn advect(rows: &Rows<[f64; 2]>, u: &[f64], du: &mut [f64]) -> parops::Result<()> {
    rows.apply_along(&vec![VELOCITY.map(|v| -v); u.len()], u, du)
}

/// 8. Modes of advection that grow whatever the step.
pub fn advection(case: &mut Case, quick: bool) -> Done {
    // On more than 640 particles the ledger does not know that nothing grows.
    let m = if quick { 20 } else { 25 };
    let (h, end) = (1.0 / m as f64, 2.0);
    case.setup(format!(
        "advection with |v| = 1, DC-PSE of order 2 ('-', 14 neighbors), jitter 0.3 h, h = 1/{m}, RK4 to t = 2"
    ));
    let particles = square(m, 0.3, 2)?;
    let around = Nearest::build(&particles, &torus()?, 14)?;
    let rows = gradient()?.assemble(&around)?;
    let (dt, steps) = (0.4 * h, (end / (0.4 * h)).round() as usize);
    let mut random = parops::Random::new(3);
    let mut u = values(&particles, |x| wave(x) + 0.1 * (2.0 * random.uniform() - 1.0));
    let start = u.clone();
    rk4(&mut u, dt, steps / 2, |u, du| advect(&rows, u, du))?;
    let halfway = largest(&u);
    rk4(&mut u, dt, steps / 2, |u, du| advect(&rows, u, du))?;
    let grown = largest(&u);
    let measured = (grown / halfway).ln() / (dt * (steps / 2) as f64);
    case.naive(
        grown > 20.0,
        format!(
            "a wave of amplitude 1 with noise of 0.1 comes to {grown:.1e}, at last as exp({:.2} t/h)",
            measured * h
        ),
    );

    let scene = AdvectionDiffusion::<2>::new().advection(VELOCITY, Central(gradient()?));
    let refusal = Eulerian::new(scene.clone(), &particles, &around, Rk4::new()).err();
    let rate = match refusal.as_ref().map(parops::Error::kind) {
        Some(ErrorKind::Solver(SolverError::Growing { rate, .. })) => Some(*rate),
        _ => None,
    };
    let own = SpectrumEstimator::new().estimate(particles.len(), |u, du| advect(&rows, u, du))?;
    case.detects(
        rate.is_some_and(|rate| (rate / own.abscissa - 1.0).abs() < 0.05 && rate * h > 0.05),
        format!("max Re(lambda) h = {:.3} estimated when the rows are made", rate.unwrap_or(0.0) * h),
    );
    // The fastest mode comes to dominate, from below.
    case.reports(
        rate.is_some_and(|rate| (0.5..1.25).contains(&(measured / rate))),
        format!(
            "{}; {:.2} of that rate was measured",
            refusal.map_or(String::from("accepted"), |error| error.to_string()),
            measured / rate.unwrap_or(f64::NAN)
        ),
    );

    let stable = AdvectionDiffusion::<2>::new()
        .advection(VELOCITY, Stabilized::<2, 2>::new(Spacing(h)).rows(gradient()?, DcPse::new()));
    let wide = Nearest::build(&particles, &torus()?, 18)?;
    let mut run = Eulerian::with_policy(
        stable,
        &particles,
        &wide,
        Rk4::new(),
        StepPolicy::Adapt { most: 64 },
        GrowthPolicy::Allow,
    )?;
    let mut u = start;
    run.advance(&mut u, end, dt)?;
    case.adapts(
        largest(&u) < 1.2 && run.ledger().growth * h <= 1.1e-3,
        format!(
            "hyperviscosity with gamma from the estimate: max Re(lambda) h = {:.0e}, the wave comes to {:.2}",
            run.ledger().growth * h,
            largest(&u)
        ),
    );
    Ok(())
}

/// 9. Too little and too much hyperviscosity.
pub fn hyperviscosity(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 16 } else { 24 };
    let h = 1.0 / m as f64;
    case.setup(format!("the same operator on {m}x{m} particles with -gamma h^3 Lap^2; gamma = 0, 0.03, 0.1 on jitter 0.1 and 0.3, then 3 with dt = 0.4 h"));
    let estimator = SpectrumEstimator::new();
    let velocities = vec![VELOCITY; m * m];
    let rows_of = |amount: f64| -> parops::Result<(Particles<2>, Rows<[f64; 2]>, Rows)> {
        let particles = square(m, amount, 2)?;
        let lap = DcPse::<Laplacian<2>, 2>::new();
        let advection = gradient()?.assemble(&Nearest::build(&particles, &torus()?, 14)?)?;
        let laplacian = lap.assemble(&Nearest::build(&particles, &torus()?, 18)?)?;
        Ok((particles, advection, laplacian))
    };
    let growth = |rows: &Rows<[f64; 2]>, lap: &Rows, gamma: f64| -> parops::Result<f64> {
        let mut damping = Hyperviscosity::new(lap, 2, Spacing(h), gamma)?;
        let found = estimator.estimate(m * m, |u, du| {
            advect(rows, u, du)?;
            if gamma > 0.0 { damping.add(&velocities, u, du) } else { Ok(()) }
        })?;
        Ok(found.abscissa * h)
    };
    let (calm, (particles, rows, lap)) = (rows_of(0.1)?, rows_of(0.3)?);
    let gammas = [0.0, 0.03, 0.1];
    let slow: Vec<f64> = gammas.iter().map(|&gamma| growth(&calm.1, &calm.2, gamma)).collect::<Result<_, _>>()?;
    let fast: Vec<f64> = gammas.iter().map(|&gamma| growth(&rows, &lap, gamma)).collect::<Result<_, _>>()?;
    let mut strong = Hyperviscosity::new(&lap, 2, Spacing(h), 3.0)?;
    let mut u = values(&particles, wave);
    rk4(&mut u, 0.4 * h, 60, |u, du| {
        advect(&rows, u, du)?;
        strong.add(&velocities, u, du)
    })?;
    let blown = largest(&u);
    case.naive(
        slow[0] > 1e-3 && fast[0] > 0.05 && fast[1] > 1e-3 && fast[2] <= 1.1e-3 && blown > 1e6,
        format!("max Re(lambda) h is {} at jitter 0.1 and {} at 0.3: a guess may be too little; gamma = 3 blows up to {blown:.0e}, far over the step limit", listed(slow), listed(fast)),
    );

    let mut damping = Hyperviscosity::new(&lap, 2, Spacing(h), 0.0)?;
    let tuning = damping.tune(&estimator, &velocities, |u, du| advect(&rows, u, du), 1e-3)?;
    case.adapts(
        tuning.stabilized.abscissa * h <= 1.1e-3 && (1e-3..0.2).contains(&tuning.gamma),
        format!(
            "gamma = {:.3} found from {} spectra: max Re(lambda) h {:.3} becomes {:.0e}",
            tuning.gamma,
            tuning.trials,
            tuning.bare.abscissa * h,
            tuning.stabilized.abscissa * h
        ),
    );
    let scene = AdvectionDiffusion::<2>::new()
        .advection(VELOCITY, Stabilized::<2, 2>::new(Spacing(h)).rows(gradient()?, DcPse::new()).gamma(3.0));
    let wide = Nearest::build(&particles, &torus()?, 18)?;
    let mut run =
        Eulerian::with_policy(scene, &particles, &wide, Rk4::new(), StepPolicy::Refuse, GrowthPolicy::Unknown)?;
    let mut u = values(&particles, wave);
    let refusal = run.step(&mut u, 0.4 * h).err();
    let limit = match refusal.as_ref().map(parops::Error::kind) {
        Some(ErrorKind::Solver(SolverError::Limit { limit, binding: Limit::Hyperviscosity, .. })) => *limit,
        _ => f64::NAN,
    };
    let kept = limit > 0.0 && run.advance(&mut u, 60.0 * limit, limit).is_ok() && largest(&u) < 1.1;
    case.adapts(
        kept,
        format!(
            "it is in the step limit: {}; at the limit the wave stays at {:.2}",
            refusal.map_or(String::from("accepted"), |error| error.to_string()),
            largest(&u)
        ),
    );
    Ok(())
}

/// 20. Wrong signs in a diffusion operator.
pub fn positivity(case: &mut Case, quick: bool) -> Done {
    let m = if quick { 24 } else { 48 };
    let h = 1.0 / m as f64;
    case.setup(format!(
        "DC-PSE Laplacian of order 2, 20 nearest, {m}x{m} particles, jitter 0.45 h; heat from one particle"
    ));
    let particles = square(m, 0.45, 5)?;
    let method = dcpse(laplacian()?, 2)?;
    let rows = method.assemble(&Nearest::build(&particles, &torus()?, 20)?)?;
    let (mut negative, mut pairs, mut at) = (0, 0, (0.0, 0));
    for p in 0..particles.len() {
        let Some(row) = rows.row(p) else { continue };
        for (&q, [w]) in row.sources.iter().zip(row.weights) {
            pairs += 1;
            if *w < 0.0 {
                negative += 1;
                at = if *w < at.0 { (*w, q as usize) } else { at };
            }
        }
    }
    // One small step of Euler from the source of the most negative weight.
    let mut u = vec![0.0; particles.len()];
    u[at.1] = 1.0;
    let mut lap = vec![0.0; u.len()];
    rows.apply(&u, &mut lap)?;
    let least = u.iter().zip(&lap).map(|(u, lap)| u + 0.1 * h * h * lap).fold(0.0, f64::min);
    let share = negative as f64 / pairs as f64;
    case.naive(
        least < -1e-6 && (1e-3..0.1).contains(&share),
        format!("{:.1} % of the off-diagonal weights are negative, and a positive field falls to {least:.1e} in a step of 0.1 h^2", 100.0 * share),
    );
    let report = rows.report();
    case.reports(
        report.negative_weights == negative && report.pairs == pairs && report.worst_rows().next().is_some(),
        format!("negative_weights = {} of {} pairs in the report", report.negative_weights, report.pairs),
    );
    Ok(())
}
