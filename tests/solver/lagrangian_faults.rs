//! Steps of moving particles that fail, at any call of a function of the scene, and are then taken after all.

use std::f64::consts::TAU;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::remeshed_substeps::picture;
use parops::{
    AdvectionDiffusion, Allowance, Carried, Domain, Lagrangian, Laplacian, Leapfrog, MovingScene, MovingSettings,
    MovingState, Particles, Pse, Result, Rk4, Stepper, testing::Promise,
};

const DT: f64 = 1.0 / 128.0;

/// Calls of the velocity that are left before one goes wrong, and how.
struct Fault {
    left: AtomicUsize,
    panics: bool,
}

impl Fault {
    fn velocity(&self, x: &[f64; 2], t: f64) -> [f64; 2] {
        let [a, b] = x.map(|x| TAU * x);
        if self.left.fetch_sub(1, Relaxed) != 0 {
            return [0.3 * a.sin() * b.cos() + t, -0.3 * a.cos() * b.sin()];
        }
        if self.panics {
            // Without the message of the default hook.
            resume_unwind(Box::new("told to"));
        }
        [f64::INFINITY; 2]
    }
}

fn set() -> Result<(Particles<2>, Vec<f64>, Domain<2>)> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [8; 2], 0.2, 12)?;
    let u = particles.points().iter().map(|x| (TAU * x[0]).sin() + x[1]).collect();
    Ok((particles, u, Domain::periodic([0.0; 2], [1.0; 2])?))
}

/// Two steps, the second one after it has failed at every 7th call there is in it, against two that nothing befell.
fn failing<S: MovingScene<2, Value = f64>, St: Stepper<MovingState<2, f64>> + Clone>(
    fault: &Fault,
    start: impl Fn() -> Result<Lagrangian<2, S, St>>,
) -> Result<()> {
    let never = || fault.left.store(usize::MAX, Relaxed);
    never();
    let (mut run, mut other) = (start()?, start()?);
    run.step(DT)?;
    other.step(DT)?;
    let ledger = format!("{:?}", run.ledger());
    let calls = (0..).step_by(7).take_while(|&call| {
        fault.left.store(call, Relaxed);
        let failed = catch_unwind(AssertUnwindSafe(|| run.step(DT).map(drop))).map_or(true, |done| done.is_err());
        // Not a number equals itself as text.
        assert!(!failed || (run.time(), format!("{:?}", run.ledger())) == (DT, ledger.clone()), "call {call}");
        failed
    });
    // A search and a check of the flow at either end, and the stages.
    assert!(calls.count() > 2 * 64 / 7);
    never();
    other.step(DT)?;
    let same = Promise::new("Reproducibility", "a step of moving particles after it failed, and without, bits");
    same.holds(picture(&run) == picture(&other));
    Ok(())
}

#[test]
fn steps_that_failed_at_any_call_are_taken_after_all_with_the_same_bits() -> Result<()> {
    let (particles, u, torus) = set()?;
    for panics in [false, true] {
        let fault = Fault { left: AtomicUsize::new(usize::MAX), panics };
        let flow = |x: &[f64; 2], t: f64| fault.velocity(x, t);
        // Neighbors are searched anew in every stage, or whenever somebody has moved by a tenth of the spacing.
        for skin in [0.0, 0.025] {
            failing(&fault, || {
                let pse = Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(1.0)?, particles.volumes()?)?;
                let pse = pse.support(3.0)?.allow(Allowance::Everywhere);
                let mut list = MovingSettings::default();
                list.skin = Some(skin);
                let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3, pse).advection(flow, Carried);
                Lagrangian::with_settings(scene, &particles, &u, &torus, Rk4::new(), list)
            })?;
        }
        // A scheme that remembers the step before.
        failing(&fault, || {
            let scene = AdvectionDiffusion::<2>::new().advection(flow, Carried);
            Lagrangian::new(scene, &particles, &u, &torus, Leapfrog::new())
        })?;
    }
    Ok(())
}
