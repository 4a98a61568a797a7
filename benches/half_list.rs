//! Time per particle of a matrix-free Gaussian PSE Laplacian in 3D over about 30 neighbors: every pair once, beside the
//! full gather over a stored list. Particles in the order of the cells.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{
    Allowance, Apply, CellList, Cutoff, Domain, Epsilon, HalfList, Laplacian, NeighborList, Particles, Pse, Symmetry,
};

/// In spacings: a ball of this radius holds 4/3 pi 1.94^3 = 30.6 particles.
const CUTOFF: f64 = 1.94;

fn sizes() -> &'static [usize] {
    // Under `cargo test` benches run once each and unoptimized; a small set is enough to see them work.
    if std::env::args().any(|argument| argument == "--bench") { &[100] } else { &[10] }
}

fn half_list(c: &mut Criterion) {
    let mut group = c.benchmark_group("Gaussian PSE 3D");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    for &m in sizes() {
        let lattice = Particles::jittered([0.0; 3], [1.0; 3], [m; 3], 0.3, 1).expect("a legal lattice");
        let domain = Domain::periodic([0.0; 3], [1.0; 3]).expect("a legal box");
        let cutoff = Cutoff(CUTOFF / m as f64);
        let (particles, _) = lattice.sorted_by_cell(&domain, cutoff).expect("a legal cutoff");
        let n = particles.len();
        group.throughput(Throughput::Elements(n as u64));
        let epsilon = Epsilon::global(1.0 / m as f64).expect("positive");
        let volumes = particles.volumes().expect("made with volumes");
        let pse = Pse::new(Laplacian::<3>, 2, epsilon, volumes).expect("order 2");
        let pse = pse.support(CUTOFF).expect("positive").allow(Allowance::Everywhere);
        let cells = CellList::build(&particles, &domain, pse.cutoff()).expect("a legal set");
        let list = NeighborList::from_provider(&cells).expect("a list that fits");
        let f: Vec<f64> = particles.points().iter().map(|x| x.iter().map(|x| (9.0 * x).sin()).product()).collect();
        let (mut full, mut half) = (vec![0.0; n], vec![0.0; n]);
        let id = |name: &str| BenchmarkId::new(name, n);

        let free = pse.matrix_free(&list).expect("allowed");
        group.bench_function(id("full gather"), |b| b.iter(|| free.apply(black_box(&f), &mut full)));
        let pairs = pse.symmetric(&list).expect("allowed");
        group.bench_function(id("half list"), |b| b.iter(|| pairs.apply(black_box(&f), &mut half)));
        let size: f64 = half.iter().map(|x| x.abs()).sum();
        let drift = half.iter().sum::<f64>().abs() / (f64::EPSILON * size);
        let apart = full.iter().zip(&half).fold(0.0_f64, |apart, (a, b)| apart.max((a - b).abs()));
        println!("{:.1} neighbors a particle", 2.0 * pairs.pairs().mutual() as f64 / n as f64);
        println!("sum {drift:.2} eps sum|.|, farthest from the full gather {apart:.1e}");

        group.bench_function(id("half list, build"), |b| b.iter(|| HalfList::from_provider(&list, cutoff)));
        let mut sums = vec![[0.0; 3]; n];
        group.bench_function(id("half list, a closure of three components"), |b| {
            b.iter(|| {
                pairs.pairs().accumulate([Symmetry::Conserved; 3], &mut sums, |pair| {
                    let squared: f64 = pair.separation.iter().map(|x| x * x).sum();
                    pair.separation.map(|x| x / squared)
                })
            });
        });
    }
    group.finish();
}

criterion_group!(benches, half_list);
criterion_main!(benches);
