//! Time per particle to build a cell list and to list all neighbors: 3D, about 30 neighbors, jittered lattice.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{CellList, Cutoff, Domain, NeighborList, Neighbors, Particles, Stencil};

/// In spacings: a ball of this radius holds 4/3 pi 1.94^3 = 30.6 particles.
const CUTOFF: f64 = 1.94;

fn sizes() -> &'static [usize] {
    // Under `cargo test` benches run once each and unoptimized; a small set is enough to see them work.
    if std::env::args().any(|argument| argument == "--bench") { &[46, 100] } else { &[10] }
}

fn cell_list(c: &mut Criterion) {
    let mut group = c.benchmark_group("cell list 3D");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    for &m in sizes() {
        let n = m * m * m;
        let cutoff = Cutoff(CUTOFF / m as f64);
        let particles = Particles::jittered([0.0; 3], [1.0; 3], [m; 3], 0.3, 1).expect("a legal lattice");
        let domains =
            [("open", Domain::open()), ("periodic", Domain::periodic([0.0; 3], [1.0; 3]).expect("a legal box"))];
        group.throughput(Throughput::Elements(n as u64));
        for (name, domain) in &domains {
            let build = || CellList::build(&particles, domain, cutoff).expect("a legal set");
            let neighbors = build();
            group.bench_function(BenchmarkId::new(format!("build {name}"), n), |b| b.iter(build));
            group.bench_function(BenchmarkId::new(format!("count {name}"), n), |b| {
                b.iter(|| (0..n).map(|p| neighbors.count(p, cutoff.0)).sum::<usize>());
            });
            group.bench_function(BenchmarkId::new(format!("gather {name}"), n), |b| {
                let mut row = Stencil::default();
                b.iter(|| {
                    for p in 0..n {
                        neighbors.gather(p, cutoff.0, &mut row);
                        black_box(&row);
                    }
                });
            });
            group.bench_function(BenchmarkId::new(format!("stored list {name}"), n), |b| {
                b.iter(|| NeighborList::from_provider(&neighbors).expect("a list that fits"));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, cell_list);
criterion_main!(benches);
