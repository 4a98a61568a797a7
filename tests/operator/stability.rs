//! Step limits: lambda_max on lattices against reference values, and what is refused.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Allowance, Apply, Binding, Cutoff, Epsilon, Error, ErrorKind, Euler, Exchange, Exponential, Kernel, Laplacian,
    LatticeSpectrum, Leapfrog, MultiIndex, Neighbor, NeighborError, Neighbors, OperatorError, ParticleError, Plan,
    Policy, Pse, Rk4, Rows, StepLimit, Stepper, Term, TimeError, Volumes, WideGaussian, integrate, testing::Promise,
    wide_gaussian_decay,
};
use proptest::prelude::*;
use serde_json::Value;

fn table(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn bounds() -> Value {
    table(include_str!("../data/stability_bounds.json"))
}

/// The relative accuracy the reference promises for lambda_max of Gaussian-polynomial kernels.
const PROMISED: f64 = 1e-9;

/// Both sides sum up to 2.4e4 terms; errors of rounding add up like their root at least, here taken at ten times that.
const ROUNDING: f64 = 1600.0 * f64::EPSILON;

/// eta(z) = pi^(-D/2) a sum_j c_j (b |z|^2)^j exp(-b |z|^2), a kernel as a user would write it.
struct Gaussian<const D: usize> {
    terms: Vec<Term<D>>,
    a: f64,
    b: f64,
    c: Vec<f64>,
}

impl<const D: usize> Gaussian<D> {
    fn new(a: f64, b: f64, c: Vec<f64>) -> Self {
        Self { terms: terms().to_vec(), a, b, c }
    }

    fn wide() -> Self {
        Self::new(0.5_f64.powi(D as i32), 0.25, vec![1.0])
    }

    fn laplacian(order: u32) -> Self {
        let kernels = table(include_str!("../data/pse_kernels.json"));
        let c = kernels["full_space"]["laplacian"][format!("d{D}_r{order}")]["c"].as_array().unwrap();
        let rational = |text: &Value| {
            let mut parts = text.as_str().unwrap().split('/').map(|part| part.parse::<f64>().unwrap());
            parts.next().unwrap() / parts.next().unwrap_or(1.0)
        };
        Self::new(1.0, 1.0, c.iter().map(rational).collect())
    }
}

impl<const D: usize> Kernel<f64, D> for Gaussian<D> {
    fn value(&self, z: &[f64; D]) -> f64 {
        let square = self.b * z.iter().map(|x| x * x).sum::<f64>();
        let polynomial = self.c.iter().rev().fold(0.0, |sum, c| sum * square + c);
        self.a * polynomial * (-square).exp() / std::f64::consts::PI.powf(D as f64 / 2.0)
    }
    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }
    fn order(&self) -> u32 {
        2 * self.c.len() as u32
    }
    fn support(&self) -> f64 {
        7.0
    }
    fn overlap_limit(&self) -> f64 {
        1.0
    }
}

fn relative(a: f64, b: f64) -> f64 {
    (a - b).abs() / b.abs()
}

fn kind(error: Error) -> ErrorKind {
    error.kind().clone()
}

/// Second moments of the sums without cutoff miss their tails by less than this, says the reference.
const TRUNCATION: f64 = 1e-11;

fn wide_gaussian_matches<const D: usize>() {
    let bounds = bounds();
    let entries = bounds["diffusion"]["gaussian_wide_exp(-z^2/4)"]["lattice"].as_array().unwrap();
    let entries: Vec<_> = entries.iter().filter(|entry| entry["d"] == D as u64).collect();
    assert_eq!(entries.len(), 9);
    for entry in entries {
        let number = |key: &str| entry[key].as_f64().unwrap();
        let delta = number("h_over_eps");
        let kernel = Gaussian::<D>::wide();
        // The radius the reference sums to.
        let full = LatticeSpectrum::scan(&kernel, delta, if D == 3 && delta < 1.0 { 11.0 } else { 14.0 }).unwrap();
        let promise = Promise::new("Limits of steps", "lambda_max of the wide Gaussian on lattices against the table");
        promise.at_most(ROUNDING, relative(full.lambda_max, number("lambda_max_no_cutoff")));
        assert!(relative(full.coefficient[0], number("effective_D_over_D_no_cutoff")) < ROUNDING, "{D} {delta}");

        let cut = LatticeSpectrum::scan(&WideGaussian::<D>::new(), delta, 5.0).unwrap();
        assert!(relative(cut.lambda_max, number("lambda_max_cutoff_5eps")) < ROUNDING, "{D} {delta}: {cut:?}");
        assert!(relative(cut.coefficient[D - 1], number("effective_D_over_D_cutoff_5eps")) < ROUNDING, "{D} {delta}");

        let closed = wide_gaussian_decay::<D>(delta).unwrap();
        assert!(relative(closed, number("lambda_max_no_cutoff")) < TRUNCATION, "{D} {delta}: {closed}");
        assert!(relative(2.0 / closed, number("bound_no_cutoff")) < TRUNCATION, "{D} {delta}: {closed}");
    }
}

#[test]
fn wide_gaussian_on_lattices_matches_the_reference() {
    wide_gaussian_matches::<1>();
    wide_gaussian_matches::<2>();
    wide_gaussian_matches::<3>();
}

fn laplacians_match<const D: usize>(exchange: impl Fn(u32) -> Exchange<D>) {
    let bounds = bounds();
    let radius = if D == 3 { 5.5 } else { 7.0 };
    for order in [2, 4, 6, 8] {
        let entry = &bounds["diffusion"][format!("gaussian_polynomial_laplacian_r{order}")][format!("d{D}")];
        let rows = entry["lattice"].as_array().unwrap();
        assert_eq!(rows.len(), 6);
        for row in rows {
            let number = |key: &str| row[key].as_f64().unwrap();
            let delta = number("h_over_eps");
            let foreign = LatticeSpectrum::scan(&Gaussian::<D>::laplacian(order), delta, radius);
            let ours = LatticeSpectrum::scan(&exchange(order), delta, radius);
            for scan in [foreign, ours] {
                if row["bound"].is_null() {
                    let error = kind(scan.unwrap_err());
                    let ErrorKind::Time(TimeError::Growing { rate }) = error else { panic!("{error:?}") };
                    // Ours also refines the minimum, so it is at most the sampled one.
                    assert!(
                        rate <= number("lambda_smallest_nonzero_sampled") * (1.0 - PROMISED),
                        "{D} {order} {delta}"
                    );
                    continue;
                }
                let scan = scan.unwrap();
                let promise = Promise::new("Limits of steps", "lambda_max of Laplacians on lattices against the table");
                promise.at_most(PROMISED, relative(scan.lambda_max, number("lambda_max")));
                // The moment is of the size of the terms it cancels from, not of itself.
                let moment = (scan.coefficient[D - 1] - number("discrete_second_moment_over_2")).abs();
                assert!(moment < f64::from(order) * ROUNDING, "{D} {order} {delta}: {moment:e}");
                let euler = scan.limit(1.0, 1.0).unwrap().step(&Euler::<f64>::new());
                assert!(relative(euler, number("bound")) < PROMISED, "{D} {order} {delta}: {euler}");
            }
        }
    }
}

fn terms<const D: usize>() -> [Term<D>; D] {
    std::array::from_fn(|axis| {
        let mut exponents = [0; D];
        exponents[axis] = 2;
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    })
}

#[test]
fn laplacians_of_every_order_on_lattices_match_the_reference_and_growing_ones_are_refused() {
    laplacians_match::<1>(|order| Exchange::new(&terms(), order).unwrap());
    laplacians_match::<2>(|order| Exchange::new(&terms(), order).unwrap());
    laplacians_match::<3>(|order| Exchange::new(&terms(), order).unwrap());
}

#[test]
fn lambda_max_of_fine_lattices_is_that_of_the_integral() {
    // The integral has 2 r; the lattice sum aliases with exp(-(pi/delta)^2/4) times a polynomial, 1e-17 at 0.25.
    for order in [2, 4, 6, 8] {
        let spectrum = LatticeSpectrum::scan(&Gaussian::<2>::laplacian(order), 0.25, 7.0).unwrap();
        assert!(relative(spectrum.lambda_max, 2.0 * f64::from(order)) < PROMISED, "{order}: {spectrum:?}");
    }
}

#[test]
fn scan_attains_its_maximum_where_it_says() {
    for (delta, radius) in [(1.0, 5.0), (0.5, 3.3), (2.0 / 3.0, 5.0)] {
        let kernel = Gaussian::<2>::wide();
        let spectrum = LatticeSpectrum::scan(&kernel, delta, radius).unwrap();
        let n = (radius / delta) as i32 + 1;
        let mut lambda = 0.0;
        for j in (-n..=n).flat_map(|i| (-n..=n).map(move |j| [i, j])) {
            let z = j.map(|j| f64::from(j) * delta);
            if z[0] * z[0] + z[1] * z[1] <= radius * radius {
                let phase = z[0] * spectrum.fastest[0] + z[1] * spectrum.fastest[1];
                lambda += delta * delta * kernel.value(&z) * (1.0 - phase.cos());
            }
        }
        assert!(relative(lambda, spectrum.lambda_max) < ROUNDING, "{delta} {radius}: {lambda} {spectrum:?}");
    }
}

#[test]
fn explicit_euler_is_bounded_just_below_the_lattice_limit_and_grows_just_above() {
    // 64 points of a periodic line hold the wavenumber pi/delta at which this kernel decays fastest.
    const N: usize = 64;
    let (kernel, delta, radius, epsilon, diffusion) = (Gaussian::<1>::laplacian(4), 0.8, 7.0, 0.05, 0.3);
    let reach = (radius / delta) as usize;
    let weights: Vec<f64> = (1..=reach).map(|j| delta * kernel.value(&[j as f64 * delta])).collect();
    let rhs = |_: f64, u: &Vec<f64>, du: &mut Vec<f64>| {
        for p in 0..N {
            let pair = |(j, w): (usize, &f64)| w * (u[(p + j + 1) % N] + u[(p + N - j - 1) % N] - 2.0 * u[p]);
            du[p] = diffusion / (epsilon * epsilon) * weights.iter().enumerate().map(pair).sum::<f64>();
        }
        Ok(())
    };
    let limit = LatticeSpectrum::scan(&kernel, delta, radius).unwrap().limit(diffusion, epsilon).unwrap();
    let largest = |stepper: &mut dyn Stepper<Vec<f64>>, part: f64| {
        let dt = part * limit.step(stepper);
        let plan = Plan::new(0.0, 2000.0 * dt, dt).unwrap().limit(limit).policy(Policy::Allow);
        let mut u: Vec<f64> = (0..N).map(|p| if p == 0 { 1.0 } else { 0.0 }).collect();
        let run = integrate(stepper, &mut u, &plan, rhs, |_, _, _| {}).unwrap();
        assert_eq!(run.within_limit, part <= 1.0);
        u.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()))
    };
    for stepper in [&mut Euler::new() as &mut dyn Stepper<_>, &mut Rk4::new()] {
        let amplitude = |text| Promise::new("Limits of steps", text);
        amplitude("amplitude after 2000 steps of 0.999 of the limit of a lattice")
            .at_most(1.0, largest(stepper, 0.999));
        amplitude("amplitude after 2000 steps of 1.01 of the limit of a lattice").at_least(1e3, largest(stepper, 1.01));
    }
}

#[test]
fn limits_of_other_steppers_scale_with_their_negative_real_interval() {
    let limit = StepLimit::from_spectral_bound(8.0, 0.5).unwrap();
    let (euler, rk4) = (Euler::<f64>::new(), Rk4::<f64>::new());
    assert_eq!(limit.step(&euler), 0.5);
    assert_eq!(limit.step(&rk4), 2.785293563405282 / 4.0);
    assert_eq!(limit.binding(&rk4), Binding::Decay { rate: 4.0 });
    let integrators = &bounds()["time_integrators"];
    for (name, stepper) in [("explicit_euler", &euler as &dyn Stepper<f64>), ("rk4", &rk4)] {
        assert_eq!(stepper.negative_real_interval(), integrators[name]["negative_real"].as_f64().unwrap());
        // The reference found this root, 2 sqrt 2, numerically.
        let imaginary = integrators[name]["imaginary"].as_f64().unwrap();
        assert!((stepper.imaginary_interval() - imaginary).abs() <= 2.0 * f64::EPSILON * imaginary);
    }
}

#[test]
fn leapfrog_refuses_every_diffusion() {
    let limit = StepLimit::from_spectral_bound(1e-9, 1e-9).unwrap();
    let mut leapfrog = Leapfrog::new();
    assert_eq!(limit.step(&leapfrog), 0.0);
    let plan = Plan::new(0.0, 1.0, 1e-6).unwrap().limit(limit);
    let refusal = ErrorKind::Time(TimeError::Limit { dt: plan.dt(), limit: 0.0 });
    let mut u = vec![1.0];
    let rhs = |_: f64, _: &Vec<f64>, _: &mut Vec<f64>| panic!("refused before the first evaluation");
    assert_eq!(kind(integrate(&mut leapfrog, &mut u, &plan, rhs, |_, _, _| {}).unwrap_err()), refusal);
    assert_eq!(kind(plan.cut_for(&leapfrog).unwrap_err()), refusal);
}

#[test]
fn limits_combine_and_vanish_without_diffusion() {
    let euler = Euler::<f64>::new();
    let none = StepLimit::from_spectral_bound(4.0, 0.0).unwrap();
    assert_eq!((none, none.step(&euler), none.binding(&euler)), (StepLimit::NONE, f64::INFINITY, Binding::Nothing));
    assert_eq!(none.step(&Leapfrog::<f64>::new()), f64::INFINITY);
    let (slow, fast) =
        (StepLimit::from_spectral_bound(1.0, 1.0).unwrap(), StepLimit::from_spectral_bound(3.0, 1.0).unwrap());
    assert_eq!(slow.and(fast).decay(), 3.0);
    assert_eq!(slow.plus(fast).decay(), 4.0);
    let both = slow.plus(fast).and(StepLimit::from_step(0.25).unwrap());
    assert_eq!((both.step(&euler), both.binding(&euler)), (0.25, Binding::Step { dt: 0.25 }));
}

#[test]
fn limits_refuse_illegal_numbers() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        for error in [StepLimit::from_spectral_bound(value, 1.0), StepLimit::from_spectral_bound(1.0, value)] {
            let ErrorKind::Time(TimeError::Coefficient { value: found }) = kind(error.unwrap_err()) else { panic!() };
            assert_eq!(found.to_bits(), value.to_bits());
        }
    }
    assert!(matches!(
        kind(StepLimit::from_spectral_bound(1e200, 1e200).unwrap_err()),
        ErrorKind::Time(TimeError::Coefficient { value: f64::INFINITY })
    ));
    assert_eq!(kind(StepLimit::from_step(0.0).unwrap_err()), ErrorKind::Time(TimeError::Step { dt: 0.0 }));
    assert_eq!(
        kind(wide_gaussian_decay::<2>(-1.0).unwrap_err()),
        ErrorKind::Particle(ParticleError::Spacing { spacing: -1.0 })
    );
    // A lattice so coarse that particles do not see each other decays at no rate.
    assert_eq!(wide_gaussian_decay::<3>(1e300).unwrap(), 0.0);
}

/// exp(-z^2) with an odd part along the last axis, a hole at 2 and terms of choice.
struct Odd<const D: usize> {
    terms: Vec<Term<D>>,
    odd: f64,
    at_two: f64,
}

impl<const D: usize> Kernel<f64, D> for Odd<D> {
    fn value(&self, z: &[f64; D]) -> f64 {
        if z[0].abs() == 2.0 {
            self.at_two
        } else {
            (-z.iter().map(|x| x * x).sum::<f64>()).exp() * (1.0 + self.odd * z[D - 1])
        }
    }
    fn terms(&self) -> &[Term<D>] {
        &self.terms
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        5.0
    }
    fn overlap_limit(&self) -> f64 {
        1.0
    }
}

#[test]
fn scan_refuses_kernels_and_lattices_it_cannot_bound() {
    let laplacian = terms();
    let scan = |terms: &[Term<2>], odd, at_two, delta, radius| {
        kind(LatticeSpectrum::scan(&Odd { terms: terms.to_vec(), odd, at_two }, delta, radius).unwrap_err())
    };
    assert_eq!(
        scan(&laplacian, 0.0, f64::NEG_INFINITY, 1.0, 5.0),
        ErrorKind::Operator(OperatorError::Weight { q: 12, weight: f64::NEG_INFINITY })
    );
    let ErrorKind::Time(TimeError::Uneven { axis: 1, defect }) = scan(&laplacian, 0.1, 0.0, 1.0, 5.0) else { panic!() };
    assert!(defect > 0.01);
    let mixed = [Term { index: MultiIndex::new([1, 1]), factor: 1.0 }];
    assert_eq!(scan(&mixed, 0.0, 0.0, 1.0, 5.0), ErrorKind::Time(TimeError::NotDiffusion { degree: 2 }));
    let fourth = [Term { index: MultiIndex::new([2, 2]), factor: 1.0 }];
    assert_eq!(scan(&fourth, 0.0, 0.0, 1.0, 5.0), ErrorKind::Time(TimeError::NotDiffusion { degree: 4 }));
    assert_eq!(scan(&laplacian, 0.0, 0.0, 0.0, 5.0), ErrorKind::Particle(ParticleError::Spacing { spacing: 0.0 }));
    assert_eq!(scan(&laplacian, 0.0, 0.0, 1.0, -5.0), ErrorKind::Neighbor(NeighborError::Cutoff { cutoff: -5.0 }));
    let ErrorKind::Neighbor(NeighborError::Cells { cells, .. }) = scan(&laplacian, 0.0, 0.0, 1e-9, 5.0) else {
        panic!()
    };
    assert!(cells > 1e9);
    // A cutoff below the spacing leaves no neighbor: nothing decays.
    assert!(matches!(scan(&laplacian, 0.0, 0.0, 1.0, 0.9), ErrorKind::Time(TimeError::Growing { rate: 0.0 })));
    assert_eq!(
        kind(LatticeSpectrum::scan(&Gaussian::<1>::wide(), 1.0, 5.0).unwrap().limit(1.0, 0.0).unwrap_err()),
        ErrorKind::Particle(ParticleError::Epsilon { epsilon: 0.0 })
    );
}

/// Brute force over points in an open plane: a provider as a user would write it.
struct AllPairs {
    points: Vec<[f64; 2]>,
    reach: f64,
}

impl Neighbors<2> for AllPairs {
    fn targets(&self) -> usize {
        self.points.len()
    }
    fn sources(&self) -> usize {
        self.points.len()
    }
    fn center(&self, p: usize) -> Option<usize> {
        Some(p)
    }
    fn cutoff(&self, _: usize) -> f64 {
        self.reach
    }
    fn reach(&self) -> f64 {
        self.reach
    }
    fn generation(&self) -> u64 {
        0
    }
    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<2>)) {
        let center = self.points[p];
        for (q, x) in self.points.iter().enumerate().filter(|&(q, _)| q != p) {
            let separation = [center[0] - x[0], center[1] - x[1]];
            if separation[0].hypot(separation[1]) <= cutoff {
                visit(Neighbor { q, separation, sign: 1 });
            }
        }
    }
}

/// The largest eigenvalue modulus of PSE rows on a set with volumes V: that of the symmetric V^1/2 A V^-1/2.
fn spectral_radius(rows: &Rows<[f64; 1]>, volumes: &[f64]) -> f64 {
    let scaled = |u: &[f64], du: &mut [f64]| {
        let f: Vec<f64> = u.iter().zip(volumes).map(|(u, v)| u / v.sqrt()).collect();
        rows.apply(&f, du)?;
        du.iter_mut().zip(volumes).for_each(|(du, v)| *du *= v.sqrt());
        Ok(())
    };
    Exponential::new(volumes.len(), scaled).unwrap().spectral_radius().unwrap()
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn row_bounds_of_pse_bound_the_spectrum_on_any_particle_set(
        set in prop::collection::vec(([0.0..1.0, 0.0..1.0], 0.5..2.0), 2..24), epsilon in 0.02..0.5, order in 0..3_usize,
    ) {
        let points: Vec<[f64; 2]> = set.iter().map(|particle| particle.0).collect();
        let v: Vec<f64> = set.iter().map(|particle| particle.1 / set.len() as f64).collect();
        let (epsilon, volumes) = (Epsilon::global(epsilon).unwrap(), Volumes::each(v.clone()).unwrap());
        let provider = |cutoff: Cutoff| AllPairs { points: points.clone(), reach: cutoff.0 };
        let rows = if order == 2 {
            let pse = Pse::<WideGaussian<2>>::with_kernels([WideGaussian::new()], epsilon, &volumes).unwrap();
            pse.clone().allow(Allowance::Everywhere).assemble(&provider(pse.cutoff())).unwrap()
        } else {
            let pse = Pse::new(Laplacian::<2>, [2, 4][order], epsilon, &volumes).unwrap();
            pse.clone().allow(Allowance::Everywhere).assemble(&provider(pse.cutoff())).unwrap()
        };
        let (bound, radius) = (rows.report().spectral_bound, spectral_radius(&rows, &v));
        let limit = Promise::new("Limits of steps", "spectral radius of PSE rows over the bound of the rows");
        limit.at_most(1.0 + ROUNDING, radius / bound);
    }
}

#[test]
fn row_bound_of_a_positive_definite_kernel_is_sharp_on_a_dense_set() {
    // Sixty particles within one epsilon: the fastest mode sees hardly any neighbor, and S_p is nearly the same for all.
    let points: Vec<[f64; 2]> = (0..60).map(|p| [0.002 * f64::from(p), 0.0]).collect();
    let v = vec![0.01; 60];
    let pse = Pse::new(Laplacian::<2>, 2, Epsilon::global(1.0).unwrap(), &Volumes::each(v.clone()).unwrap()).unwrap();
    let pse = pse.allow(Allowance::Everywhere);
    let rows = pse.assemble(&AllPairs { points, reach: pse.cutoff().0 }).unwrap();
    let (bound, radius) = (rows.report().spectral_bound, spectral_radius(&rows, &v));
    let dense =
        Promise::new("Limits of steps", "spectral radius of PSE rows on a dense set over the bound of the rows");
    dense.within(0.99, 1.0, radius / bound);
}

#[test]
fn advection_limits_of_central_pse_follow_from_the_imaginary_intervals() {
    let bounds = bounds();
    let (rk4, leapfrog, euler) = (Rk4::<f64>::new(), Leapfrog::<f64>::new(), Euler::<f64>::new());
    let entries = bounds["advection_central"].as_object().unwrap();
    assert_eq!(entries.len(), 12);
    for entry in entries.values() {
        let number = |key: &str| entry[key].as_f64().unwrap();
        for (stepper, key) in [(&rk4 as &dyn Stepper<f64>, "rk4"), (&leapfrog, "leapfrog"), (&euler, "explicit_euler")]
        {
            let limit = stepper.imaginary_interval() / number("max_abs_symbol");
            let promise = Promise::new("Limits of steps", "advection limits of central PSE against the table");
            promise.in_units("eps", f64::EPSILON * limit).at_most(4.0, (limit - number(key)).abs());
        }
    }
}
