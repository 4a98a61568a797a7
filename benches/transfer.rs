//! Time per particle of transfers between particles and mesh: N = 10^6 on a jittered lattice, one particle a cell.
//!
//! Sorted means in the order of their cells; shuffled is what unsorted particles cost.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{Cic, Cutoff, Domain, Lambda, Mesh, MeshKernel, Particles, Random, Tsc};

/// Particles along an axis.
fn side(dim: usize) -> usize {
    // Under `cargo test` benches run once each and unoptimized; a small set is enough to see them work.
    let large = std::env::args().any(|argument| argument == "--bench");
    match (large, dim) {
        (true, 2) => 1000,
        (true, _) => 100,
        (false, _) => 12,
    }
}

fn shuffled<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    let (mut points, mut random) = (points.to_vec(), Random::new(1));
    for i in (1..points.len()).rev() {
        points.swap(i, (random.uniform() * (i + 1) as f64) as usize);
    }
    points
}

/// Every transfer of one kernel between a set of points and the mesh.
struct Study<'a, const D: usize> {
    name: &'a str,
    mesh: &'a Mesh<D>,
    points: &'a [[f64; D]],
}

impl<const D: usize> Study<'_, D> {
    fn kernel<const S: usize>(&self, c: &mut Criterion, kernel_name: &str, kernel: &impl MeshKernel<f64, S>) {
        let mut group = c.benchmark_group(format!("{kernel_name} {D}D"));
        group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
        let Self { mesh, points, .. } = *self;
        let n = points.len();
        group.throughput(Throughput::Elements(n as u64));
        let id = |name: &str| BenchmarkId::new(format!("{name}, {}", self.name), n);

        let (strengths, mut values) = (vec![1.0; n], vec![0.0; mesh.len()]);
        group.bench_function(id("deposit"), |b| {
            b.iter(|| mesh.deposit(kernel, points, &strengths, &mut values).expect("finite strengths"));
        });
        let (shorts, mut short_values) = (vec![1.0_f32; n], vec![0.0_f32; mesh.len()]);
        group.bench_function(id("deposit f32"), |b| {
            b.iter(|| mesh.deposit(kernel, points, &shorts, &mut short_values).expect("finite strengths"));
        });
        let (triples, mut three) = (vec![[1.0; 3]; n], vec![[0.0; 3]; mesh.len()]);
        group.bench_function(id("deposit 3 fields"), |b| {
            b.iter(|| mesh.deposit_fields(kernel, points, &triples, &mut three).expect("finite strengths"));
        });
        let mut out = vec![0.0; n];
        group.bench_function(id("gather"), |b| {
            b.iter(|| mesh.gather(kernel, points, &values, &mut out).expect("finite values"));
        });
        group.finish();
    }
}

fn transfer<const D: usize>(c: &mut Criterion) {
    let side = side(D);
    let domain = Domain::periodic([0.0; D], [1.0; D]).expect("a legal box");
    let lattice = Particles::jittered([0.0; D], [1.0; D], [side; D], 0.3, 1).expect("a legal lattice");
    let (sorted, _) = lattice.sorted_by_cell(&domain, Cutoff(1.0 / side as f64)).expect("a legal cutoff");
    let mesh = Mesh::nodes(&domain, [side; D]).expect("a legal mesh");
    let lambda = Lambda::<4, 2>::new().expect("4 <= 2 * 2 + 1");
    let study = Study { name: "sorted", mesh: &mesh, points: sorted.points() };
    study.kernel(c, "Lambda_4,2", &lambda);
    study.kernel(c, "Lambda_8,4", &Lambda::<8, 4>::new().expect("8 <= 2 * 4 + 1"));
    study.kernel(c, "TSC", &Tsc);
    study.kernel(c, "CIC", &Cic);
    let points = shuffled(sorted.points());
    Study { name: "shuffled", mesh: &mesh, points: &points }.kernel(c, "Lambda_4,2", &lambda);
}

criterion_group!(benches, transfer::<2>, transfer::<3>);
criterion_main!(benches);
