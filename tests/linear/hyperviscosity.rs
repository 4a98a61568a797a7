//! Advection by DC-PSE: the growth of the bare operator, and what hyperviscosity makes of it.

use crate::dense;
use parops::{
    Along, Apply, DcPse, Domain, ErrorKind, Hyperviscosity, Laplacian, LinearError, Nearest, OperatorError, Particles,
    Plan, Random, Rk4, Rows, Sign, Spacing, SpectrumEstimator, Tuning, integrate, testing::Promise,
};

const VELOCITY: [f64; 2] = [0.8, -0.6];

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn jittered(side: usize, seed: u64) -> Particles<2> {
    Particles::jittered([0.0; 2], [1.0; 2], [side; 2], 0.3, seed).unwrap()
}

/// -v . grad with k neighbors.
fn advection(set: &Particles<2>, order: u32, sign: Sign, k: usize) -> Rows {
    let dcpse = DcPse::at_order(Along(VELOCITY.map(|v| -v)), order).unwrap().sign(sign);
    dcpse.neighbors_per_condition(1.5).unwrap().assemble(&Nearest::build(set, &torus(), k).unwrap()).unwrap()
}

fn laplacian(set: &Particles<2>, order: u32) -> Rows {
    let dcpse = DcPse::at_order(Laplacian::<2>, order).unwrap();
    dcpse.assemble(&Nearest::build(set, &torus(), dcpse.fewest_neighbors::<2>().unwrap()).unwrap()).unwrap()
}

/// Neighbors of the '-' form, 2 l and more.
fn neighbors(order: u32) -> usize {
    [14, 28, 54][order as usize / 2 - 1]
}

#[test]
fn bare_advection_grows_as_measured_for_both_forms() {
    let side = 20;
    let h = 1.0 / side as f64;
    for seed in 1..=2 {
        let set = jittered(side, seed);
        for (sign, k, low, high) in
            [(Sign::Minus, 14, 0.14, 0.22), (Sign::Plus, 14, 0.02, 0.05), (Sign::Plus, 26, 0.002, 0.05)]
        {
            let rows = advection(&set, 2, sign, k);
            let (right, _) = dense::extremes(&dense::matrix(set.len(), |u, du| rows.apply(u, du)));
            assert!((low..=high).contains(&(right * h)), "{seed} {sign:?} {k}: {}", right * h);
        }
    }
}

/// A wave and noise, advanced by RK4 to t = 2; the largest modulus at the end, or infinity.
fn largest_after_two(
    set: &Particles<2>,
    dt: f64,
    rhs: impl FnMut(f64, &Vec<f64>, &mut Vec<f64>) -> parops::Result<()>,
) -> f64 {
    let mut random = Random::new(3);
    let wave = |x: &[f64; 2]| (std::f64::consts::TAU * (x[0] + x[1])).sin() + 0.1 * (2.0 * random.uniform() - 1.0);
    let mut u: Vec<f64> = set.points().iter().map(wave).collect();
    match integrate(&mut Rk4::new(), &mut u, &Plan::new(0.0, 2.0, dt).unwrap(), rhs, |_, _, _| {}) {
        Ok(_) => u.iter().fold(0.0, |largest, u| u.abs().max(largest)),
        Err(_) => f64::INFINITY,
    }
}

#[test]
fn tuned_hyperviscosity_bounds_what_grows_without_it() {
    for (order, side) in [(2, 20), (4, 20), (6, 20)] {
        let set = jittered(side, 2);
        let h = set.spacing().unwrap();
        let rows = advection(&set, order, Sign::Minus, neighbors(order));
        let lap = laplacian(&set, order);
        let mut damping = Hyperviscosity::new(&lap, order, h, 0.0).unwrap();
        assert_eq!(damping.applies(), order / 2 + 1);
        let velocities = vec![VELOCITY; set.len()];
        let estimator = SpectrumEstimator::new();
        let bare = |u: &[f64], du: &mut [f64]| rows.apply(u, du);
        let Tuning { gamma, bare: grown, stabilized, trials, .. } =
            damping.tune(&estimator, &velocities, bare, 1e-3).unwrap();
        assert_eq!(damping.gamma(), gamma);
        assert!((1e-3..=0.2).contains(&gamma) && trials <= 11, "{order} {gamma} {trials}");
        assert!(grown.abscissa * h.0 > 0.1 && stabilized.abscissa * h.0 <= 1e-3, "{order} {grown:?} {stabilized:?}");

        // The whole spectrum, not its estimate.
        let (right, _) = dense::extremes(&dense::matrix(set.len(), |u, du| {
            rows.apply(u, du)?;
            damping.add(&velocities, u, du)
        }));
        let growth =
            Promise::new("Limits of steps", "growth left by hyperviscosity tuned to 1e-3 v/h, of the whole spectrum");
        growth.in_units("v/h", 1.0 / h.0).at_most(1e-3, right);

        // Its share of the step limit.
        let radius = estimator.of(&lap).unwrap().radius;
        let outer = estimator.estimate(set.len(), |u, du| damping.add(&velocities, u, du)).unwrap().radius;
        assert!(
            (damping.rate(1.0, radius) / outer - 1.0).abs() < 0.01,
            "{order} {} {outer}",
            damping.rate(1.0, radius)
        );
        assert!(
            (damping.rate(1.0, radius) - gamma / h.0 * (h.0 * h.0 * radius).powi(order as i32 / 2 + 1)).abs()
                < 1e-9 * outer
        );

        let dt = 1.0 / (grown.radius + damping.rate(1.0, radius));
        let without = largest_after_two(&set, dt, |_, u, du| rows.apply(u, du));
        let with = largest_after_two(&set, dt, |_, u, du| {
            rows.apply(u, du)?;
            damping.add(&velocities, u, du)
        });
        // A wave of 1 and noise of 0.1, each mode of which may grow by exp(1e-3 t/h).
        let most = 1.1 * (1e-3 * 2.0 / h.0).exp();
        assert!(without > 5.0 && with <= most, "{order} {without} {with} {most}");
    }
}

#[test]
fn nothing_is_added_where_nothing_grows_and_too_little_is_refused() {
    let set = jittered(12, 1);
    let h = set.spacing().unwrap();
    let lap = laplacian(&set, 2);
    let mut damping = Hyperviscosity::new(&lap, 2, h, 0.5).unwrap();
    let velocities = vec![VELOCITY; set.len()];
    let decay = |u: &[f64], du: &mut [f64]| {
        du.iter_mut().zip(u).for_each(|(du, u)| *du = -u);
        Ok(())
    };
    let found = damping.tune(&SpectrumEstimator::new(), &velocities, decay, 1e-3).unwrap();
    assert_eq!((found.gamma, found.trials, damping.gamma()), (0.0, 1, 0.0));

    // Growth of the mean is none that a Laplacian could damp.
    damping.set_gamma(0.5).unwrap();
    let growth = |u: &[f64], du: &mut [f64]| {
        du.copy_from_slice(u);
        Ok(())
    };
    let refused = damping.tune(&SpectrumEstimator::new(), &velocities, growth, 1e-3).unwrap_err();
    assert!(matches!(*refused.kind(), ErrorKind::Linear(LinearError::Growing { gamma: 1.0, .. })), "{refused}");
    assert_eq!(damping.gamma(), 0.5);
}

/// L2 error of the stabilized operator on a wave.
fn error(side: usize, order: u32, gamma: f64) -> f64 {
    let set = jittered(side, 4);
    let rows = advection(&set, order, Sign::Minus, neighbors(order));
    let mut damping = Hyperviscosity::new(laplacian(&set, order), order, set.spacing().unwrap(), gamma).unwrap();
    let turn = std::f64::consts::TAU;
    let wave: Vec<f64> = set.points().iter().map(|x| (turn * (x[0] + x[1])).sin()).collect();
    let mut out = vec![0.0; wave.len()];
    rows.apply(&wave, &mut out).unwrap();
    damping.add(&vec![VELOCITY; wave.len()], &wave, &mut out).unwrap();
    let exact = |x: &[f64; 2]| -turn * (VELOCITY[0] + VELOCITY[1]) * (turn * (x[0] + x[1])).cos();
    let sum: f64 = set.points().iter().zip(&out).map(|(x, out)| (out - exact(x)).powi(2)).sum();
    (sum / wave.len() as f64).sqrt()
}

#[test]
fn orders_of_advection_are_kept() {
    for (order, gamma) in [(2, 0.1), (4, 0.03), (6, 0.02)] {
        let (coarse, fine) = (40, 80);
        let observed = (error(coarse, order, gamma) / error(fine, order, gamma)).log2();
        // The added error is of the next odd order, 2 k - 1 = r + 1, so that it may be seen on the way to r.
        let r = f64::from(order);
        let promise = Promise::new("Orders", format!("hyperviscosity keeps the order, r = {r}"));
        promise.within(r - 0.1, r + 1.1, observed);
    }
}

#[test]
fn term_on_a_lattice_wave_is_the_formula() {
    // On a lattice a wave is an eigenvector of Lap, so Lap^k u = lambda^k u to rounding.
    let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2]).unwrap();
    let h = 1.0 / 16.0;
    let wave: Vec<f64> = set.points().iter().map(|x| (std::f64::consts::TAU * x[0]).cos()).collect();
    for order in [2, 4, 6] {
        let lap = laplacian(&set, order);
        let mut image = vec![0.0; wave.len()];
        lap.apply(&wave, &mut image).unwrap();
        let lambda = image[5] / wave[5];
        let k = order as i32 / 2 + 1;
        let mut damping = Hyperviscosity::new(&lap, order, Spacing(h), 0.1).unwrap();
        let mut du = vec![1.0; wave.len()];
        let velocities: Vec<[f64; 2]> = set.points().iter().map(|x| [3.0 * x[1], -4.0 * x[1]]).collect();
        damping.add(&velocities, &wave, &mut du).unwrap();
        for p in 0..wave.len() {
            let speed = 5.0 * set.points()[p][1];
            let term = (-1.0_f64).powi(k + 1) * 0.1 * speed * h.powi(2 * k - 1) * lambda.powi(k) * wave[p];
            // k sweeps round by some eps sum |w| h^2 < 64 eps each, divided by h.
            assert!((du[p] - 1.0 - term).abs() <= 1e-12, "{order} {p} {} {term}", du[p] - 1.0);
            assert!((du[p] - 1.0) * wave[p] <= 1e-12, "it must damp");
        }
    }
}

#[test]
fn rows_of_too_low_an_order_and_illegal_settings_are_refused() {
    let set = jittered(12, 1);
    let h = set.spacing().unwrap();
    let lap = laplacian(&set, 2);
    let refused = |order: u32, h: f64, gamma: f64| Hyperviscosity::new(&lap, order, Spacing(h), gamma).err();
    let low = refused(4, h.0, 0.1).unwrap();
    assert_eq!(*low.kind(), ErrorKind::Operator(OperatorError::LowOrder { found: 2, needed: 4 }));
    for (order, h, gamma) in
        [(0, h.0, 0.1), (9, h.0, 0.1), (2, 0.0, 0.1), (2, f64::NAN, 0.1), (2, h.0, -0.1), (2, h.0, f64::NAN)]
    {
        assert!(refused(order, h, gamma).is_some(), "{order} {h} {gamma}");
    }
    assert!(refused(2, h.0, 0.1).is_none());
    let mut damping = Hyperviscosity::new(&lap, 2, h, 0.1).unwrap();
    let (u, mut du) = (vec![1.0; set.len()], vec![2.0; set.len()]);
    assert!(damping.add(&[VELOCITY; 3], &u, &mut du).is_err());
    assert!(damping.add(&vec![VELOCITY; set.len()], &u[1..], &mut du).is_err());
    assert!(du.iter().all(|&du| du == 2.0));
    assert!(damping.tune(&SpectrumEstimator::new(), &vec![VELOCITY; set.len()], |_, _| Ok(()), 0.0).is_err());
}
