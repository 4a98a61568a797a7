//! Runs put aside and taken up again go on with the same bits.

use parops::{
    AdvectionDiffusion, DcPse, Domain, Eulerian, Gradient, GrowthPolicy, ImplicitScheme, Laplacian, Leapfrog, Nearest,
    Particles, Result, Rk4, SavedRun, Scene, SspRk3, StepPolicy, TimeScheme, testing::Promise,
};

const STEPS: usize = 100;
const HALF: usize = 50;
const DT: f64 = 1.0 / 1024.0;

/// What comes back of what was put aside: through a file where there are files, otherwise as it was.
trait Stored: Sized {
    fn stored(self) -> Self;
}

#[cfg(feature = "serde")]
impl<T: serde::Serialize + serde::de::DeserializeOwned> Stored for T {
    fn stored(self) -> Self {
        serde_json::from_str(&serde_json::to_string(&self).unwrap()).unwrap()
    }
}

#[cfg(not(feature = "serde"))]
impl<T> Stored for T {
    fn stored(self) -> Self {
        self
    }
}

fn set() -> Result<(Particles<2>, Nearest<2>)> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.2, 5)?;
    let neighbors = Nearest::build(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, 20)?;
    Ok((particles, neighbors))
}

fn wave(particles: &Particles<2>) -> Vec<f64> {
    particles.points().iter().map(|x| (6.3 * x[0]).sin() + x[1]).collect()
}

/// 100 steps at once, and 50 and 50 with a file between them.
fn both_ways<S: Scene<2, Value = f64>, St>(scene: impl Fn() -> S, stepper: impl Fn() -> St) -> Result<()>
where
    St: TimeScheme<2, S> + Clone,
    SavedRun<f64, St>: Stored,
{
    let (particles, neighbors) = set()?;
    let start = || -> Result<Eulerian<2, S, St>> {
        let (steps, growth) = (StepPolicy::Allow, GrowthPolicy::Allow);
        Eulerian::with_policy(scene(), &particles, &neighbors, stepper(), steps, growth)
    };
    let mut whole = wave(&particles);
    let mut run = start()?;
    for _ in 0..STEPS {
        run.step(&mut whole, DT)?;
    }

    let (mut first, mut u) = (start()?, wave(&particles));
    for _ in 0..HALF {
        first.step(&mut u, DT)?;
    }
    let saved = first.save(&u).stored();
    drop((first, u));
    let mut second = start()?;
    let mut u = second.resume(saved)?;
    for _ in HALF..STEPS {
        second.step(&mut u, DT)?;
    }

    let same = Promise::new("Reproducibility", "100 steps, and 50 and 50 with a file between them, bits");
    same.holds(whole.iter().zip(&u).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert_eq!(run.time().to_bits(), second.time().to_bits());
    assert_eq!(run.ledger(), second.ledger());
    assert_eq!(run.ledger().step, STEPS as u64);
    Ok(())
}

fn moving() -> impl Scene<2, Value = f64> {
    AdvectionDiffusion::<2>::new()
        .diffusion(0.01, DcPse::<Laplacian<2>, 2>::new())
        .advection(|x: &[f64; 2], t: f64| [x[1] - t, 0.5], DcPse::<Gradient<2>, 2>::new())
        .source(|x, t, u| x[0] * t - u)
}

fn flowing() -> impl Scene<2, Value = f64> {
    AdvectionDiffusion::<2>::new().advection([0.3, 0.2], DcPse::<Gradient<2>, 2>::new())
}

#[test]
fn runge_kutta_runs_resume_with_equal_bits() -> Result<()> {
    both_ways(moving, Rk4::new)?;
    both_ways(moving, SspRk3::new)
}

#[test]
fn leapfrog_resumes_with_the_state_before_the_last() -> Result<()> {
    both_ways(flowing, Leapfrog::new)
}

#[test]
fn implicit_runs_resume_with_equal_bits() -> Result<()> {
    let scene = || AdvectionDiffusion::<2>::new().diffusion(5.0, DcPse::<Laplacian<2>, 2>::new());
    both_ways(scene, ImplicitScheme::euler)?;
    both_ways(scene, ImplicitScheme::crank_nicolson)
}

#[test]
fn a_run_of_another_size_is_refused() -> Result<()> {
    let (particles, neighbors) = set()?;
    let (steps, growth) = (StepPolicy::Allow, GrowthPolicy::Unknown);
    let mut run = Eulerian::with_policy(flowing(), &particles, &neighbors, Rk4::new(), steps, growth)?;
    let mut u = wave(&particles);
    run.step(&mut u, DT)?;
    let mut saved = run.save(&u);
    saved.u.pop();
    assert!(run.resume(saved).is_err());
    assert_eq!(run.time(), DT);
    Ok(())
}
