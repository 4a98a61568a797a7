//! Diffusivities that jump by a million, and Peclet numbers of a million, in runs against exact solutions.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, DcPse, Domain, ErrorKind, Euler, Eulerian, Gradient, GrowthPolicy, ImplicitScheme, Laplacian,
    Limit, Mean, Nearest, Particles, Result, Rk4, Rkl2, Scene, Sign, SolverError, SspRk3, StepPolicy, UpwindDcPse,
    testing::Promise,
};

type Field = Vec<f64>;

const JUMP: f64 = 1e6;

/// The layer |y| < 1/4 of the torus, y = x_0 - 1/2, conducts a million times better.
fn layers(x: &[f64; 2]) -> f64 {
    if (x[0] - 0.5).abs() < 0.25 { JUMP } else { 1.0 }
}

/// The slowest even mode: cos(k_1 y) inside, b cos(k_2 (1/2 - |y|)) outside, D_1 k_1^2 = k_2^2 = its rate, u and D du/dy
/// continuous at |y| = 1/4.
struct Mode {
    rate: f64,
    b: f64,
}

impl Mode {
    fn new() -> Self {
        // D_1 k_1 sin(k_1/4) cos(k_2/4) + k_2 sin(k_2/4) cos(k_1/4) = 0 between k_2/4 = pi/2 and pi.
        let flux = |k: f64| {
            let inner = k / JUMP.sqrt();
            JUMP * inner * (inner / 4.0).sin() * (k / 4.0).cos() + k * (k / 4.0).sin() * (inner / 4.0).cos()
        };
        let (mut low, mut high) = (TAU, 2.0 * TAU);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if flux(middle) > 0.0 { low = middle } else { high = middle }
        }
        let k = 0.5 * (low + high);
        Self { rate: k * k, b: (k / JUMP.sqrt() / 4.0).cos() / (k / 4.0).cos() }
    }

    fn at(&self, x: &[f64; 2]) -> f64 {
        let (y, k) = ((x[0] - 0.5).abs(), self.rate.sqrt());
        if y < 0.25 { (k / JUMP.sqrt() * y).cos() } else { self.b * (k * (0.5 - y)).cos() }
    }
}

fn jittered(n: usize, jitter: f64, seed: u64) -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [n; 2], jitter, seed)
}

fn nearest(particles: &Particles<2>, k: usize) -> Result<Nearest<2>> {
    Nearest::build(particles, &Domain::periodic([0.0; 2], [1.0; 2])?, k)
}

fn jumping<const R: u32>(mean: Mean) -> impl Scene<2, Value = f64> {
    AdvectionDiffusion::<2>::new().diffusion(layers, DcPse::<Laplacian<2>, R>::new()).mean(mean)
}

/// Root mean square error over some sets when the mode has decayed to 1/e, in 32 steps of Crank-Nicolson, and how many
/// steps of explicit Euler that would have taken.
fn decayed(mean: Mean, n: usize, jitter: f64) -> Result<(f64, f64)> {
    let (mode, seeds) = (Mode::new(), if jitter > 0.0 { 4 } else { 1 });
    let (end, decay) = (1.0 / mode.rate, (-1.0_f64).exp());
    let (mut sum, mut explicit) = (0.0, 0.0);
    for seed in 0..seeds {
        let particles = jittered(n, jitter, seed)?;
        let neighbors = nearest(&particles, 20)?;
        let mut u: Field = particles.points().iter().map(|x| mode.at(x)).collect();
        let mut run = Eulerian::new(jumping::<2>(mean), &particles, &neighbors, ImplicitScheme::crank_nicolson())?;
        explicit = run.limits(&u)?.steps(end, &Euler::<Field>::new());
        run.advance(&mut u, end, end / 32.0)?;
        let miss = particles.points().iter().zip(&u).map(|(x, u)| (u - decay * mode.at(x)).powi(2));
        sum += miss.sum::<f64>() / u.len() as f64;
    }
    Ok(((sum / seeds as f64).sqrt(), explicit))
}

#[test]
fn harmonic_mean_converges_at_order_one_across_a_jump_of_a_million() -> Result<()> {
    for jitter in [0.0, 0.2] {
        let (coarse, _) = decayed(Mean::Harmonic, 24, jitter)?;
        let (fine, explicit) = decayed(Mean::Harmonic, 44, jitter)?;
        let order = (coarse / fine).ln() / (44.0_f64 / 24.0).ln();
        // 32 steps do the work of more than ten million.
        assert!(fine < 0.01 && explicit > 1e7, "{jitter}: {coarse} {fine} {explicit}");
        Promise::new("Orders", "diffusion across a jump of 10^6, harmonic mean").within(0.85, 1.15, order);
    }
    // The arithmetic mean is legal at order 2, and ten times less accurate.
    let [harmonic, arithmetic] = [Mean::Harmonic, Mean::Arithmetic].map(|mean| decayed(mean, 24, 0.2));
    Promise::new("Accuracy", "error across a jump of 10^6, arithmetic over harmonic mean")
        .at_least(10.0, arithmetic?.0 / harmonic?.0);
    Ok(())
}

#[test]
fn arithmetic_mean_of_order_4_grows_with_every_stepper_where_the_harmonic_one_does_not() -> Result<()> {
    let particles = jittered(14, 0.2, 2)?;
    let neighbors = nearest(&particles, 44)?;
    let mode = Mode::new();
    let start: Field = particles.points().iter().map(|x| mode.at(x)).collect();
    let size = |u: &[f64]| u.iter().fold(0.0_f64, |size, u| size.max(u.abs()));
    let refused = Eulerian::new(jumping::<4>(Mean::Arithmetic), &particles, &neighbors, ImplicitScheme::euler()).err();
    Promise::new("Input", "the arithmetic mean of order 4 across a jump of 10^6 is refused with its contrast")
        .equal(refused.unwrap().kind(), &ErrorKind::Solver(SolverError::Contrast { contrast: JUMP }));
    let (refuse, allow) = (StepPolicy::Refuse, GrowthPolicy::Allow);
    for (mean, grows) in [(Mean::Arithmetic, true), (Mean::Harmonic, false)] {
        let mut run = Eulerian::with_policy(jumping::<4>(mean), &particles, &neighbors, Rk4::new(), refuse, allow)?;
        let dt = run.limits(&start)?.step(&Rk4::<Field>::new());
        assert_eq!(run.ledger().growth * dt > 1e-3, grows, "{}", run.ledger().growth * dt);
        let mut explicit = start.clone();
        run.advance(&mut explicit, 1000.0 * dt, dt)?;
        let mut sizes = vec![size(&explicit)];
        for scheme in [ImplicitScheme::euler, ImplicitScheme::crank_nicolson] {
            let mut run = Eulerian::with_policy(jumping::<4>(mean), &particles, &neighbors, scheme(), refuse, allow)?;
            let mut u = start.clone();
            run.advance(&mut u, 1000.0 * dt, dt)?;
            sizes.push(size(&u));
        }
        let after = |text| Promise::new("Limits of steps", text);
        for grown in sizes.iter().map(|found| found / size(&start)) {
            if grows {
                after("size after 1000 steps, r = 4 across a jump of 10^6, arithmetic mean").at_least(1e6, grown);
            } else {
                after("size after 1000 steps, r = 4 across a jump of 10^6, harmonic mean").at_most(1.01, grown);
            }
        }
    }
    Ok(())
}

fn spots(x: &[f64; 2], t: f64) -> f64 {
    (TAU * (x[0] - t)).cos() * (TAU * (x[1] - 0.5 * t)).cos()
}

#[test]
fn peclet_numbers_of_a_million_run_on_scattered_particles_or_are_refused_by_name() -> Result<()> {
    const END: f64 = 0.5;
    let half = UpwindDcPse::half_stencils();
    let particles = jittered(32, 0.2, 2)?;
    let neighbors = nearest(&particles, half.neighbors::<2>()?)?;
    let diffusing = || AdvectionDiffusion::<2>::new().diffusion(1e-6, DcPse::<Laplacian<2>, 2>::new());
    let scene = || diffusing().advection([1.0, 0.5], half);
    let start: Field = particles.points().iter().map(|x| spots(x, 0.0)).collect();
    let worst = |u: &[f64]| {
        let errors = particles.points().iter().zip(u).map(|(x, u)| (u - spots(x, END)).abs());
        errors.fold(0.0, f64::max)
    };
    let mut run = Eulerian::new(scene(), &particles, &neighbors, SspRk3::new())?;
    let mut u = start.clone();
    let limits = run.limits(&u)?;
    let (runge_kutta, steps) = (SspRk3::<Field>::new(), limits.steps(END, &SspRk3::<Field>::new()));
    assert_eq!(limits.binding(&runge_kutta), Some(Limit::Advection));
    // Upwind of order 2 has no step of explicit Euler, however many.
    assert_eq!(limits.steps(END, &Euler::<Field>::new()), f64::INFINITY);
    run.advance(&mut u, END, limits.step(&runge_kutta))?;
    assert_eq!(run.ledger().step as f64, steps);
    let error = Promise::new("Accuracy", "waves at a Peclet number of 10^6, 32^2 particles, upwind DC-PSE");
    error.at_most(0.06, worst(&u));
    let mut run = Eulerian::new(scene(), &particles, &neighbors, ImplicitScheme::crank_nicolson())?;
    let mut u = start.clone();
    run.advance(&mut u, END, 0.025)?;
    error.at_most(0.06, worst(&u));

    let is_unstable = |error: &parops::Error| {
        matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term: Limit::Advection, .. }))
    };
    let error = Eulerian::new(scene(), &particles, &neighbors, Euler::new()).err().unwrap();
    assert!(is_unstable(&error), "{error}");
    let error = Eulerian::new(scene(), &particles, &neighbors, Rkl2::new(10)?).err().unwrap();
    assert!(is_unstable(&error), "{error}");
    let central = diffusing().advection([1.0, 0.5], DcPse::<Gradient<2>, 2>::new().sign(Sign::Minus));
    let error = Eulerian::new(central, &particles, &nearest(&particles, 14)?, Rk4::new()).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. })), "{error}");
    Ok(())
}
