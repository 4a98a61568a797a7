//! Sets that lose their overlap, cluster, pair, clump, or change their volumes.

use std::error::Error;
use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Carried, CubicSpline, Cutoff, Domain, ErrorKind, Kernel, Lagrangian, Lambda, LedgerRow, Mesh,
    MovingScene, Neighbors, OverlapWatch, Particles, Random, Remeshing, Rk4, SetQuality, SmoothingKernel, SolverError,
    Steady, Trigger, WendlandC2, least_gap,
};

use super::ring;
use super::sets::{cells, listed, square, torus};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// The steady cellular flow, whose stagnation points tear holes and whose stretched lines come close.
fn swirls(x: &[f64; 2]) -> [f64; 2] {
    let [a, b] = x.map(|x| TAU * x);
    [a.sin() * b.cos(), -a.cos() * b.sin()]
}

fn scene() -> impl MovingScene<2, Value = f64> {
    AdvectionDiffusion::<2>::new().advection(Steady(swirls as fn(&[f64; 2]) -> [f64; 2]), Carried)
}

/// Steps of RK4, for a time of 1.
const STEPS: f64 = 50.0;

/// Particles carried to t by RK4 written out, on the unit torus.
fn carried(particles: &Particles<2>, t: f64) -> parops::Result<Particles<2>> {
    let (steps, mut points) = ((STEPS * t).round() as usize, particles.points().to_vec());
    let dt = t / steps as f64;
    for _ in 0..steps {
        for x in &mut points {
            let shifted = |v: [f64; 2], dt: f64| [x[0] + dt * v[0], x[1] + dt * v[1]];
            let a = swirls(x);
            let b = swirls(&shifted(a, 0.5 * dt));
            let c = swirls(&shifted(b, 0.5 * dt));
            let d = swirls(&shifted(c, dt));
            *x = std::array::from_fn(|i| (x[i] + dt / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i])).rem_euclid(1.0));
        }
    }
    Particles::new(points)?.with_equal_volumes(1.0)
}

/// 10. Holes and gaps that the number of neighbors does not show.
pub fn overlap_lost(case: &mut Case, quick: bool) -> Done {
    let (m, end) = (if quick { 48 } else { 64 }, 0.4);
    let h = 1.0 / m as f64;
    case.setup(format!("{m}x{m} particles of a lattice in the steady cellular flow to t = {end}, never remeshed"));
    let start = square(m, 0.0, 1)?;
    let moved = carried(&start, end)?;
    let quality = |set: &Particles<2>, cutoff: f64| SetQuality::measure(set, &torus()?, Cutoff(cutoff * h));
    let (before, after) = (quality(&start, 3.0)?, quality(&moved, 3.0)?);
    // Holes wider than the cutoff are infinite to it.
    let hole = quality(&moved, 6.0)?.fill;
    case.naive(
        after.median.abs_diff(before.median) <= 3 && (1.5 * h..6.0 * h).contains(&hole) && after.separation < 0.3 * h,
        format!(
            "within 3 h the median particle has {} neighbors, before {}, but the largest hole is {:.1} h and the least gap {:.2} h",
            after.median,
            before.median,
            hole / h,
            after.separation / h
        ),
    );

    let mesh = Mesh::nodes(&torus()?, [m; 2])?;
    let u: Vec<f64> = start.points().iter().map(|x| 1.0 + (TAU * x[0]).sin()).collect();
    let watch = OverlapWatch { mesh, every: 2, hole: 1.2, gap: 0.4 };
    let run = || Lagrangian::new(scene(), &start, &u, &torus()?, Rk4::new())?.watching(watch);
    let mut alone = run()?;
    let refusal = alone.advance(end, 1.0 / STEPS).err();
    let (t, [hole, gap]) = (alone.time(), overlap(alone.ledger()));
    case.detects(
        t > 0.0 && t < end && hole <= 1.2 && gap >= 0.4 && hole > 0.7,
        format!("hole and gap measured each 2 steps: {hole:.2} and {gap:.2} spacings in the ledger at t = {t:.2}"),
    );
    let lost = matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Solver(SolverError::OverlapLost { hole, gap, .. })) if *hole > 1.2 || *gap < 0.4);
    case.reports(lost, refusal.map_or(String::from("nothing"), |error| error.to_string()));

    let trigger = Trigger::Overlap { hole: 1.0, gap: 0.6 };
    let mut remeshed = run()?.remeshing(Remeshing { kernel: Lambda::<4, 2>::new()?, mesh, trigger, threshold: 0.0 })?;
    let row = remeshed.advance(end, 1.0 / STEPS)?;
    let (drift, [hole, gap]) = (row.fields[0].drift.abs() / row.fields[0].size, overlap(row));
    case.adapts(
        row.remeshings > 0 && hole <= 1.2 && gap >= 0.4 && drift < 1e-13,
        format!(
            "remeshed {} times when overlap is lost: hole {hole:.2} and gap {gap:.2} at t = {end}, mass drift {drift:.0e}",
            row.remeshings
        ),
    );
    Ok(())
}

/// The hole and the gap of the ledger; not numbers where they were not measured.
fn overlap(row: &LedgerRow<2>) -> [f64; 2] {
    [row.hole, row.gap].map(|found| found.unwrap_or(f64::NAN))
}

/// 11. Clustering along stagnation lines.
pub fn clustering(case: &mut Case, quick: bool) -> Done {
    let (m, end) = (if quick { 48 } else { 64 }, 2.0);
    let h = 1.0 / m as f64;
    case.setup(format!("the same flow to t = {end}, {m}x{m} particles"));
    let start = square(m, 0.0, 1)?;
    let naive = carried(&start, end)?;
    let around = cells(&naive, &torus()?, 3.0 * h)?;
    let counts: Vec<usize> = (0..naive.len()).map(|p| around.count(p, 3.0 * h)).collect();
    let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
    let (fewest, most) = (counts.iter().min().copied().unwrap_or(0), counts.iter().max().copied().unwrap_or(0));
    case.naive(
        (20.0..40.0).contains(&mean) && fewest < 18 && most > 45,
        format!("a mean of {mean:.1} neighbors within 3 h looks as at the start (28), but they are {fewest} to {most}"),
    );
    let u = vec![1.0; start.len()];
    let mut run = Lagrangian::new(scene(), &start, &u, &torus()?, Rk4::new())?;
    run.advance(end, 1.0 / STEPS)?;
    let quality = SetQuality::measure(&run.particles()?, &torus()?, Cutoff(3.0 * h))?;
    case.reports(
        quality.fewest.abs_diff(fewest) <= 1 && quality.most.abs_diff(most) <= 2 && quality.loneliest.is_some(),
        format!(
            "{} to {} neighbors, median {}, fewest at particle {}",
            quality.fewest,
            quality.most,
            quality.median,
            quality.loneliest.unwrap_or(0)
        ),
    );
    Ok(())
}

/// Forces -sigma sum_q 2 V grad W on a torus of m x m particles: positions after so many damped steps, or with inertia.
struct Forces<'a> {
    kernel: &'a dyn SmoothingKernel<f64, 2>,
    epsilon: f64,
    /// Twice the pressure; negative for tension.
    pressure: f64,
}

impl Forces<'_> {
    fn at(&self, particles: &Particles<2>, volume: f64, out: &mut [[f64; 2]]) -> parops::Result<()> {
        let cutoff = 2.0 * self.epsilon;
        let around = cells(particles, &torus()?, cutoff)?;
        let mut row = parops::Stencil::default();
        for (p, out) in out.iter_mut().enumerate() {
            around.gather(p, cutoff, &mut row);
            let mut sum = [0.0; 2];
            for s in row.separations() {
                let gradient = self.kernel.gradient(&s.map(|s| s / self.epsilon))?;
                (0..2).for_each(|i| sum[i] -= self.pressure * volume * gradient[i] / self.epsilon.powi(3));
            }
            *out = sum;
        }
        Ok(())
    }
}

/// A lattice with noise of so many spacings.
fn noisy(m: usize, noise: f64) -> parops::Result<Particles<2>> {
    let (h, mut random) = (1.0 / m as f64, Random::new(7));
    let lattice = square(m, 0.0, 1)?;
    let moved = |x: &[f64; 2]| x.map(|x| (x + noise * h * (2.0 * random.uniform() - 1.0)).rem_euclid(1.0));
    Particles::new(lattice.points().iter().map(moved).collect())?.with_equal_volumes(1.0)
}

/// The largest usable h/epsilon of a kernel.
fn limit<const D: usize>(kernel: &impl Kernel<f64, D>) -> f64 {
    kernel.overlap_limit()
}

/// 12. Pairs under pressure.
pub fn pairing(case: &mut Case, quick: bool) -> Done {
    const OVERLAP: f64 = 2.0;
    let (m, steps) = if quick { (12, 1500) } else { (16, 10_000) };
    let h = 1.0 / m as f64;
    case.setup(format!("SPH pair forces under pressure, {m}x{m} particles on a torus, noise 0.01 h, epsilon = {OVERLAP} h, {steps} damped steps"));
    let relaxed = |kernel: &dyn SmoothingKernel<f64, 2>| -> parops::Result<Particles<2>> {
        let forces = Forces { kernel, epsilon: OVERLAP * h, pressure: 2.0 };
        let mut particles = noisy(m, 0.01)?;
        let mut force = vec![[0.0; 2]; particles.len()];
        // The stiffest modes decay at about 2 pressure / epsilon^2 times the sum of V W'' epsilon^2, which is below 5.
        let dt = 0.1 * forces.epsilon * forces.epsilon;
        for _ in 0..steps {
            forces.at(&particles, h * h, &mut force)?;
            let points: Vec<[f64; 2]> = particles
                .points()
                .iter()
                .zip(&force)
                .map(|(x, f)| std::array::from_fn(|i| (x[i] + (dt * f[i]).clamp(-0.05 * h, 0.05 * h)).rem_euclid(1.0)))
                .collect();
            particles.set_points(&points)?;
        }
        Ok(particles)
    };
    let (spline, wendland) = (relaxed(&CubicSpline::<2>::new())?, relaxed(&WendlandC2::<2>::new())?);
    let gap = |set: &Particles<2>| -> parops::Result<f64> { Ok(least_gap(&cells(set, &torus()?, 2.0 * h)?) / h) };
    let (paired, apart) = (gap(&spline)?, gap(&wendland)?);
    case.naive(paired < 0.1, format!("cubic spline: the particles form pairs, least gap {paired:.1e} h"));
    let quality = |set: &Particles<2>| SetQuality::measure(set, &torus()?, Cutoff(2.0 * h));
    let (pairs, none) = (quality(&spline)?, quality(&wendland)?);
    case.reports(
        (pairs.separation / h - paired).abs() < 1e-9 && pairs.closest.is_some() && none.separation > 0.6 * h,
        format!(
            "the least gap, {:.1e} h at particle {}; with Wendland C2 it stays {apart:.2} h",
            pairs.separation / h,
            pairs.closest.unwrap_or(0)
        ),
    );
    case.documents(
        include_str!("../../../src/kernel/spline.rs"),
        "particles that move along -grad sum_q W form pairs where the overlap is large: in two dimensions from epsilon = 1.3 h on",
    );
    case.documents(
        include_str!("../../../src/kernel/wendland.rs"),
        "Positive definite in D dimensions: no pairing for any number of neighbors.",
    );
    // The table of usable overlap, with the limits that the kernels themselves have.
    let table = include_str!("../../../src/kernel/mod.rs");
    let line = |name: &str, limits: [f64; 3], pairs: &str| {
        format!("| [`{name}`](crate::{name}) | {:.2}, {:.2}, {:.2} | {pairs} |", limits[0], limits[1], limits[2])
    };
    let splines = [limit(&CubicSpline::<1>::new()), limit(&CubicSpline::<2>::new()), limit(&CubicSpline::<3>::new())];
    let wendlands = [limit(&WendlandC2::<1>::new()), limit(&WendlandC2::<2>::new()), limit(&WendlandC2::<3>::new())];
    case.documents(table, &line("CubicSpline", splines, "0.77"));
    case.documents(table, &line("WendlandC2", wendlands, "never"));
    Ok(())
}

/// 13. Clumps under tension.
pub fn tensile(case: &mut Case, quick: bool) -> Done {
    const OVERLAP: f64 = 1.3;
    let m = if quick { 16 } else { 24 };
    let h = 1.0 / m as f64;
    case.setup(format!("SPH pair forces with inertia under a background stress of -1, {m}x{m} particles on a torus, cubic spline, epsilon = {OVERLAP} h, noise 1e-3 h"));
    let kernel = CubicSpline::<2>::new();
    let (dt, every) = (0.05 * h, 10);
    let history = |pressure: f64| -> parops::Result<(Vec<f64>, Particles<2>)> {
        let forces = Forces { kernel: &kernel, epsilon: OVERLAP * h, pressure };
        let mut particles = noisy(m, 1e-3)?;
        let (mut v, mut force) = (vec![[0.0; 2]; particles.len()], vec![[0.0; 2]; particles.len()]);
        let mut disorder = Vec::new();
        for step in 0..=200 {
            if step % every == 0 {
                disorder.push(SetQuality::measure(&particles, &torus()?, Cutoff(2.5 * h))?.disorder);
            }
            forces.at(&particles, h * h, &mut force)?;
            let mut points = particles.points().to_vec();
            for ((x, v), f) in points.iter_mut().zip(&mut v).zip(&force) {
                for i in 0..2 {
                    v[i] += dt * f[i];
                    x[i] = (x[i] + dt * v[i]).rem_euclid(1.0);
                }
            }
            particles.set_points(&points)?;
        }
        Ok((disorder, particles))
    };
    let ((tension, clumped), (pressed, _)) = (history(-2.0)?, history(2.0)?);
    let gap = least_gap(&cells(&clumped, &torus()?, 2.0 * h)?) / h;
    case.naive(
        gap < 0.8 && tension[tension.len() - 1] > 20.0 * tension[0],
        format!(
            "the particles clump: least gap {gap:.2} h, noise {:.0} times what it was",
            tension[tension.len() - 1] / tension[0]
        ),
    );
    // While it is small the noise grows by the same factor from measurement to measurement.
    let linear: Vec<f64> = tension.windows(2).skip(3).take_while(|d| d[1] < 0.03).map(|d| d[1] / d[0]).collect();
    let (slow, fast) = linear.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &x| (a.min(x), b.max(x)));
    let calm = pressed.iter().fold(0.0_f64, |most, d| most.max(*d)) / pressed[0];
    case.detects(
        linear.len() >= 3 && slow > 1.05 && fast / slow < 1.6 && calm < 5.0,
        format!("the disorder of the set grows from {:.1e} by {slow:.2} to {fast:.2} each {every} steps; under pressure it stays below {calm:.1} times its start", tension[0]),
    );
    case.documents(
        include_str!("../../../src/kernel/spline.rs"),
        "Under tension particles clump where W'' is positive, from r = 2/3 on; no artificial stress is ever added.",
    );
    Ok(())
}

/// 30. Volumes that stay while the flow compresses.
pub fn frozen_volumes(case: &mut Case, _: bool) -> Done {
    case.setup("u_t + (v u)_x = 0 with v = 1 + 0.5 sin x on a ring, 64 and 128 particles, to t = 1");
    let (mut frozen, mut moved, mut defects) = (Vec::new(), Vec::new(), Vec::new());
    for n in [64, 128] {
        let mut run = ring::run(n, 1.0, 0.5)?;
        let values = run.values().collect::<Vec<f64>>();
        run.advance(1.0, 0.02)?;
        let exact: Vec<f64> = run.points().iter().map(|x| ring::exact(x[0], 1.0)).collect();
        let error = |u: &[f64]| super::sets::relative_error(u, &exact);
        // With V as it was the strength over it is the value at the start, wherever the particle has gone.
        frozen.push(error(&values));
        moved.push(error(&run.values().collect::<Vec<f64>>()));
        let domain: Domain<1> = ring::domain()?;
        let cutoff = Cutoff(4.0 * TAU / n as f64);
        defects.push(SetQuality::measure(&run.particles()?, &domain, cutoff)?.volume_defect.unwrap_or(f64::NAN));
    }
    case.naive(
        frozen.iter().all(|error| *error > 0.1) && frozen[1] > 0.9 * frozen[0],
        format!("V frozen: errors {}, order 0", listed(frozen)),
    );
    case.prevents(
        moved.iter().all(|error| *error < 1e-6),
        format!("V follows div v, omega is the invariant: errors {}", listed(moved)),
    );
    let lattice = Particles::lattice([0.0], [TAU], [64])?.with_equal_volumes(0.9 * TAU)?;
    let wrong = SetQuality::measure(&lattice, &ring::domain()?, Cutoff(0.4))?.volume_defect.unwrap_or(0.0);
    case.reports(
        defects.iter().all(|defect| defect.abs() < 1e-3) && (wrong + 0.1).abs() < 1e-12,
        format!("sum V against the box: {} (and {wrong:.2} for volumes a tenth too small)", listed(defects)),
    );
    case.documents(
        include_str!("../../../src/solver/lagrangian.rs"),
        "The strengths omega_p are what is conserved; the values u_p are never stored.",
    );
    Ok(())
}
