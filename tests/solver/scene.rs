//! Scenes: what is named is there, what is not named costs nothing.

use parops::{
    AdvectionDiffusion, CellList, CentralRows, DcPse, DiffusionRows, Domain, Euler, Eulerian, Gradient, GrowthPolicy,
    Laplacian, Leapfrog, Limit, Limits, NoTerms, Particles, Rate, Result, Rk4, Scene, SceneTerm, SemiDiscrete, Site,
    Stages, Steady,
};

type Dc<const R: u32> = DcPse<Laplacian<2>, R>;
type DcGrad<const R: u32> = DcPse<Gradient<2>, R>;

fn applies<S: Scene<2>>(_: &S) -> usize {
    S::APPLIES
}

fn per_step<S: Scene<2>, St: Stages>(_: &S, _: &St) -> usize {
    S::APPLIES * St::STAGES
}

fn set() -> Result<(Particles<2>, CellList<2>)> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.2, 1)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let neighbors = CellList::build(&particles, &torus, Dc::<2>::new().cutoff(&particles)?)?;
    Ok((particles, neighbors))
}

#[test]
fn absent_terms_have_no_size() {
    assert_eq!(size_of::<NoTerms>(), 0);
    assert_eq!(size_of::<AdvectionDiffusion<2>>(), 0);
    assert_eq!(size_of::<AdvectionDiffusion<3, [f32; 4]>>(), 0);
    assert_eq!(size_of::<<() as SceneTerm<2, f64>>::Rows>(), 0);
    // Functions that capture nothing have no size either, nor does what a source holds a particle.
    let still = AdvectionDiffusion::<2>::new().source(|x, t, u| x[0] * t - u);
    assert_eq!(size_of_val(&still), 0);
    assert_eq!(size_of::<<SourceOf<fn(&[f64; 2], f64, f64) -> f64> as SceneTerm<2, f64>>::Rows>(), 0);
}

type SourceOf<F> = parops::Source<F>;

#[test]
fn pure_diffusion_holds_no_velocity() -> Result<()> {
    let (particles, neighbors) = set()?;
    let diffusion = AdvectionDiffusion::<2>::new().diffusion(1e-3, Dc::<2>::new());
    let both = diffusion.clone().advection([1.0, 0.0], DcGrad::<2>::new());
    let (scene, scene_of_both) = (size_of_val(&diffusion), size_of_val(&both));
    let diffusion = SemiDiscrete::new(diffusion, &particles, &neighbors, GrowthPolicy::Refuse)?;
    // The scene, the set and the rows of the Laplacian: to the byte nothing else.
    assert_eq!(size_of_val(&diffusion), scene + size_of::<Site<2>>() + size_of::<DiffusionRows<f64>>());
    assert_eq!(diffusion.reports().count(), 1);
    assert_eq!(diffusion.velocity(3, 0.0), None);

    let both = SemiDiscrete::new(both, &particles, &neighbors, GrowthPolicy::Refuse)?;
    assert_eq!((both.reports().count(), both.velocity(3, 0.0)), (2, Some([1.0, 0.0])));
    let gradient = size_of_val(&both) - size_of_val(&diffusion) - (scene_of_both - scene);
    assert!(gradient >= size_of::<CentralRows<2, f64>>(), "{gradient}");
    Ok(())
}

#[test]
fn applies_per_step_are_those_of_the_terms_named() {
    let scene = AdvectionDiffusion::<2>::new();
    assert_eq!(applies(&scene), 0);
    let diffusion = scene.clone().diffusion(1.0, Dc::<2>::new());
    let both = diffusion.clone().advection([1.0, 0.0], DcGrad::<4>::new());
    let sourced = both.clone().source(|_, _, u: f64| -u);
    let compressed = both.clone().computed_divergence();
    let given = both.clone().divergence(|x, _| x[0]);
    assert_eq!([applies(&diffusion), applies(&both), applies(&sourced)], [1, 2, 2]);
    assert_eq!([applies(&compressed), applies(&given)], [3, 2]);
    assert_eq!(per_step(&both, &Rk4::<Vec<f64>>::new()), 8);
    assert_eq!(per_step(&both, &Euler::<Vec<f64>>::new()), 2);
    assert_eq!(per_step(&diffusion, &Leapfrog::<Vec<f64>>::new()), 1);
}

#[test]
fn a_term_is_computed_as_often_as_the_const_says() -> Result<()> {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let (particles, neighbors) = set()?;
    let calls = AtomicUsize::new(0);
    let source = |_: &[f64; 2], _: f64, _: f64| {
        calls.fetch_add(1, Ordering::Relaxed);
        0.0
    };
    let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3, Dc::<2>::new()).source(source);
    let mut run = Eulerian::new(scene, &particles, &neighbors, Rk4::new())?;
    let mut u = vec![1.0; particles.len()];
    run.step(&mut u, 1e-3)?;
    // Four stages, and two values of the difference quotient that gives its rate at either end of the step.
    assert_eq!(calls.load(Ordering::Relaxed), 8 * particles.len());
    Ok(())
}

#[test]
fn the_limits_of_terms_add_up_to_that_of_a_scene() {
    let mut limits = Limits::default();
    let (rk4, euler, leapfrog) = (Rk4::<f64>::new(), Euler::<f64>::new(), Leapfrog::<f64>::new());
    assert_eq!((limits.step(&rk4), limits.binding(&rk4)), (f64::INFINITY, None));
    limits.add(Limit::Diffusion, Rate::decay(4.0));
    limits.add(Limit::Source, Rate::decay(1.0));
    assert_eq!((limits.step(&euler), limits.binding(&euler)), (0.4, Some(Limit::Diffusion)));
    // Leapfrog bears nothing that decays (errata 53).
    assert_eq!(limits.step(&leapfrog), 0.0);
    assert!(limits.possible(&leapfrog).is_err() && limits.possible(&euler).is_ok());
    limits.add(Limit::Advection, Rate::oscillation(30.0));
    assert_eq!(limits.binding(&rk4), Some(Limit::Advection));
    let expected = 1.0 / (5.0 / 2.785293563405282 + 30.0 / 8.0_f64.sqrt());
    assert!((limits.step(&rk4) / expected - 1.0).abs() < 4.0 * f64::EPSILON);
    // A longest step binds on its own.
    limits.add(Limit::Distortion, Rate::frequency(100.0));
    assert_eq!((limits.step(&rk4), limits.binding(&rk4)), (0.01, Some(Limit::Distortion)));
    assert!(limits.check(0.01, &rk4).is_ok() && limits.check(0.0100001, &rk4).is_err());
}

#[test]
fn scenes_are_made_of_any_coefficients() -> Result<()> {
    let (particles, neighbors) = set()?;
    let count = particles.len();
    let (u, mut du) = (vec![1.0; count], vec![f64::NAN; count]);
    let mut rates = |made: Result<SemiRates>| -> Result<()> {
        made?(&u, &mut du)?;
        // A constant field is at rest in every solenoidal scene.
        assert!(du.iter().all(|du| du.abs() < 1e-11));
        Ok(())
    };
    let lap = Dc::<2>::new;
    let grad = DcGrad::<2>::new;
    let scene = AdvectionDiffusion::<2>::new;
    rates(prepared(scene().diffusion(0.1, lap()).advection([1.0, -1.0], grad()), &particles, &neighbors))?;
    rates(prepared(scene().diffusion(vec![0.1; count], lap()), &particles, &neighbors))?;
    rates(prepared(scene().diffusion(|x: &[f64; 2]| 1.0 + x[0], lap()), &particles, &neighbors))?;
    rates(prepared(scene().advection(vec![[1.0, 2.0]; count], grad()), &particles, &neighbors))?;
    rates(prepared(scene().advection(|x: &[f64; 2], t: f64| [x[1] + t, 0.0], grad()), &particles, &neighbors))?;
    rates(prepared(scene().advection(Steady(|x: &[f64; 2]| [x[1], 0.0]), grad()), &particles, &neighbors))?;
    assert!(prepared(scene().diffusion(vec![0.1; 5], lap()), &particles, &neighbors).is_err());
    assert!(prepared(scene().diffusion(-0.1, lap()), &particles, &neighbors).is_err());
    let negative = |x: &[f64; 2]| 0.5 - x[0];
    let error = prepared(scene().diffusion(negative, lap()), &particles, &neighbors).err();
    let first = particles.points().iter().position(|x| x[0] > 0.5);
    assert!(first.is_some() && error.and_then(|error| error.particle()) == first);
    Ok(())
}

type SemiRates = Box<dyn FnMut(&[f64], &mut [f64]) -> Result<()>>;

fn prepared<S: Scene<2, Value = f64> + 'static>(
    scene: S,
    particles: &Particles<2>,
    neighbors: &CellList<2>,
) -> Result<SemiRates> {
    let mut discrete = SemiDiscrete::new(scene, particles, neighbors, GrowthPolicy::Refuse)?;
    Ok(Box::new(move |u, du| discrete.rate(0.25, u, du)))
}
