//! Time per particle to build a cell list and to list all neighbors: 3D, about 30 neighbors, jittered lattice.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{CellList, Cutoff, Domain, NeighborList, Neighbors, Particles, Stencil, VerletList};

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

/// An update that keeps the rows, one that searches them anew, and the query after it. The skin is a tenth of r_c.
fn verlet_list(c: &mut Criterion) {
    let mut group = c.benchmark_group("Verlet list 3D");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    for &m in sizes() {
        let n = m * m * m;
        let (cutoff, skin) = (Cutoff(CUTOFF / m as f64), 0.1 * CUTOFF / m as f64);
        let lattice = Particles::jittered([0.0; 3], [1.0; 3], [m; 3], 0.3, 1).expect("a legal lattice");
        let domain = Domain::periodic([0.0; 3], [1.0; 3]).expect("a legal box");
        let (start, _) = lattice.sorted_by_cell(&domain, cutoff).expect("a legal cutoff");
        // Sets that are all within half the skin of the first, and sets that are not.
        let pushed = |by: f64| {
            let mut moved = start.clone();
            let points: Vec<_> = start.points().iter().map(|x| x.map(|x| x + by * skin)).collect();
            moved.set_points(&points).expect("finite");
            moved
        };
        let (near, far) = ([pushed(0.1), pushed(-0.1)], [pushed(1.0), pushed(-1.0)]);
        let build = || VerletList::build(&start, &domain, cutoff, skin).expect("a legal set");
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("build", n), |b| b.iter(build));
        for (name, sets) in [("update, rows reused", &near), ("update, rows searched anew", &far)] {
            let (mut list, mut turn) = (build(), 0);
            group.bench_function(BenchmarkId::new(name, n), |b| {
                b.iter(|| {
                    turn = 1 - turn;
                    list.update(&sets[turn]).expect("inside")
                });
            });
            println!("{} searches after the first", list.rebuilds());
        }
        let mut list = build();
        list.update(&near[0]).expect("inside");
        let mut row = Stencil::default();
        group.bench_function(BenchmarkId::new("gather", n), |b| {
            b.iter(|| {
                for p in 0..n {
                    list.gather(p, cutoff.0, &mut row);
                    black_box(&row);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, cell_list, verlet_list);
criterion_main!(benches);
