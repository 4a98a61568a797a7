//! Time per particle of Eulerian RK4 steps beside four applications of their rows: DC-PSE of order 2 in 3D.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use parops::{
    AdvectionDiffusion, Apply, Cutoff, DcPse, Domain, Eulerian, Gradient, GrowthPolicy, Laplacian, Nearest, Particles,
    Rk4, StepPolicy,
};

/// Neighbors a row: twice its conditions.
const NEIGHBORS: usize = 32;

fn sizes() -> &'static [usize] {
    // Under `cargo test` benches run once each and unoptimized; a small set is enough to see them work.
    if std::env::args().any(|argument| argument == "--bench") { &[46, 100] } else { &[10] }
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("Eulerian RK4 3D");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4));
    for &m in sizes() {
        let jittered = Particles::jittered([0.0; 3], [1.0; 3], [m; 3], 0.2, 1).expect("a legal lattice");
        let domain = Domain::periodic([0.0; 3], [1.0; 3]).expect("a legal box");
        let (set, _) = jittered.sorted_by_cell(&domain, Cutoff(2.0 / m as f64)).expect("a legal cutoff");
        let near = Nearest::build(&set, &domain, NEIGHBORS).expect("enough particles");
        let wave = |x: &[f64; 3]| (TAU * x[0]).sin() * (TAU * x[1]).cos();
        let mut u: Vec<f64> = set.points().iter().map(wave).collect();
        let mut du = vec![0.0; u.len()];
        group.throughput(Throughput::Elements(u.len() as u64));

        let laplacian = DcPse::<Laplacian<3>, 2>::new();
        let rows = laplacian.assemble(&near).expect("certified rows");
        group.bench_function(format!("four applies/{m}"), |b| {
            b.iter(|| (0..4).try_for_each(|_| rows.apply(black_box(&u), &mut du)).expect("a finite field"));
        });
        let scene = AdvectionDiffusion::<3>::new().diffusion(1e-3, laplacian);
        let (policy, growth) = (StepPolicy::Refuse, GrowthPolicy::Unknown);
        let mut run = Eulerian::with_policy(scene, &set, &near, Rk4::new(), policy, growth).expect("a legal scene");
        group.bench_function(format!("diffusion/{m}"), |b| {
            b.iter(|| run.step(&mut u, 1e-6).map(|row| row.step).expect("a legal step"));
        });
        drop(run);

        let gradient = DcPse::<Gradient<3>, 2>::new();
        let rows = gradient.assemble(&near).expect("certified rows");
        let v = vec![[1.0, 0.5, 0.0]; u.len()];
        group.bench_function(format!("four applies along a velocity/{m}"), |b| {
            b.iter(|| (0..4).try_for_each(|_| rows.apply_along(&v, black_box(&u), &mut du)).expect("a finite field"));
        });
        let scene = AdvectionDiffusion::<3>::new().advection([1.0, 0.5, 0.0], gradient);
        let mut run = Eulerian::with_policy(scene, &set, &near, Rk4::new(), policy, growth).expect("a legal scene");
        group.bench_function(format!("advection/{m}"), |b| {
            b.iter(|| run.step(&mut u, 1e-6).map(|row| row.step).expect("a legal step"));
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
