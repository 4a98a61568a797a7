//! Time of a Lagrangian step with its neighbor list kept and searched anew: PSE of order 2 in 2D, explicit Euler.

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{
    AdvectionDiffusion, Allowance, Carried, Domain, Euler, Exchange, Lagrangian, Laplacian, MovingScene,
    MovingSettings, MovingState, Particles, Pse, Result,
};

/// Particles along an axis; the set is the unit square with periodic faces.
const SIDE: usize = 128;

fn scene(particles: &Particles<2>) -> Result<impl MovingScene<2, Value = f64> + use<>> {
    let pse: Pse<Exchange<2>> = Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(1.0)?, particles.volumes()?)?
        .support(3.0)?
        .allow(Allowance::Everywhere);
    // In 100 steps all particles go one spacing; displacements count, not distortion.
    let speed = 1.0 / SIDE as f64;
    Ok(AdvectionDiffusion::<2>::new().diffusion(1e-5, pse).advection([speed, 0.0], Carried))
}

fn run(skin: f64) -> Result<Lagrangian<2, impl MovingScene<2, Value = f64>, Euler<MovingState<2, f64>>>> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.2, 1)?;
    let u: Vec<f64> = particles.points().iter().map(|x| x[0] * (1.0 - x[0])).collect();
    let mut list = MovingSettings::default();
    list.skin = Some(skin / SIDE as f64);
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    Lagrangian::with_settings(scene(&particles)?, &particles, &u, &torus, Euler::new(), list)
}

fn steps(criterion: &mut Criterion) {
    const DT: f64 = 0.01;
    let mut group = criterion.benchmark_group("lagrangian_step");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements((SIDE * SIDE) as u64));
    // A skin of one spacing lasts 50 steps; without one every step searches anew.
    for (name, skin) in [("list_kept", 1.0), ("list_searched", 0.0)] {
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter_custom(|steps| {
                let mut run = run(skin).expect("a legal run");
                let start = Instant::now();
                for _ in 0..steps {
                    run.step(DT).expect("a legal step");
                }
                start.elapsed()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
