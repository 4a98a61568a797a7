//! Relations of whole runs: scaled strengths and times, and the number of threads.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Allowance, Carried, Domain, Lagrangian, Lambda, Laplacian, Mesh, Particles, Pse, Remeshing,
    Result, Rk4, Steady, Trigger, testing::Promise,
};

/// Bits of places, strengths and volumes.
type Bits = [Vec<u64>; 3];

/// `steps` steps of dt of stirred, diffusing particles on a torus, replaced by those of a mesh every ten steps: what they
/// are, and the ledger, whose numbers scale with what they count.
fn stirred(side: usize, strength: f64, speed: f64, steps: u32) -> Result<(Bits, String)> {
    const DT: f64 = 0.0078125;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [side; 2], 0.2, 3)?;
    let u: Vec<f64> = particles.points().iter().map(|x| strength * ((TAU * x[0]).sin() + x[1])).collect();
    let swirl = Steady(move |x: &[f64; 2]| {
        let [a, b] = x.map(|x| TAU * x);
        [0.3 * a.sin() * b.cos(), -0.3 * a.cos() * b.sin()].map(|v| speed * v)
    });
    let pse = Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(1.6)?, particles.volumes()?)?;
    let pse = pse.support(2.5)?.allow(Allowance::Everywhere);
    let scene = AdvectionDiffusion::<2>::new().diffusion(1e-3 * speed, pse).advection(swirl, Carried);
    let mesh = Mesh::cells(&torus, [side; 2])?;
    let remeshing = Remeshing { kernel: Lambda::<4, 2>::new()?, mesh, trigger: Trigger::Steps(10), threshold: 0.0 };
    let mut run = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?.remeshing(remeshing)?;
    for _ in 0..steps {
        run.step(DT / speed)?;
    }
    let bits = |u: &[f64]| u.iter().map(|u| u.to_bits()).collect();
    let found = [bits(run.points().as_flattened()), bits(run.strengths()), bits(run.volumes())];
    Ok((found, format!("{:?}", run.ledger())))
}

#[test]
fn scaling_strengths_or_time_against_speed_by_powers_of_two_keeps_the_bits() -> Result<()> {
    let (reference, _) = stirred(12, 1.0, 1.0, 25)?;
    for k in [-60, 17] {
        let factor = f64::exp2(f64::from(k));
        let scaled = reference[1].iter().map(|bits| (f64::from_bits(*bits) * factor).to_bits()).collect();
        let expected = [reference[0].clone(), scaled, reference[2].clone()];
        let same = |text| Promise::new("Metamorphic relations", text);
        same("M14 remeshed particles with strengths scaled by 2^k").equal(&stirred(12, factor, 1.0, 25)?.0, &expected);
        same("M14 remeshed particles with time scaled against speed")
            .equal(&stirred(12, 1.0, factor, 25)?.0, &reference);
    }
    Ok(())
}

#[cfg(feature = "rayon")]
#[test]
fn hundred_steps_have_the_same_bits_on_any_number_of_threads() -> Result<()> {
    use parops::{DcPse, Eulerian, Gradient, Nearest};
    /// A hundred steps on rows, and the ledger.
    fn on_rows() -> Result<(Vec<u64>, String)> {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [40; 2], 0.2, 5)?.with_equal_volumes(1.0)?;
        let neighbors = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 20)?;
        let scene = AdvectionDiffusion::<2>::new()
            .diffusion(0.01, DcPse::<Laplacian<2>, 2>::new())
            .advection(|x: &[f64; 2], t: f64| [(TAU * x[1]).sin(), t], DcPse::<Gradient<2>, 2>::new())
            .source(|x, t, u: f64| x[0] * t - u);
        let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
        let mut u: Vec<f64> = set.points().iter().map(|x| (TAU * x[0]).sin()).collect();
        for _ in 0..100 {
            run.step(&mut u, 1e-3)?;
        }
        Ok((u.iter().map(|u| u.to_bits()).collect(), format!("{:?}", run.ledger())))
    }
    let with = |threads: usize| -> Result<_> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Ok((stirred(40, 1.0, 1.0, 100)?, on_rows()?)))
    };
    let (moving, fixed) = with(1)?;
    let same = |text| Promise::new("Reproducibility", text);
    for threads in [2, 3, 8] {
        let (again, once_more) = with(threads)?;
        same("100 remeshed Lagrangian steps and their ledger, bits on 1, 2, 3, 8 threads").holds(again == moving);
        same("100 Eulerian steps and their ledger, bits on 1, 2, 3, 8 threads").holds(once_more == fixed);
    }
    Ok(())
}
