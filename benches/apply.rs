//! Time per particle of operators: PSE Laplacian of order 2 in 3D over about 30 neighbors, with its accuracy beside it.
//!
//! The narrow Gaussian is cut off at 1.94 spacings, a ball of 30 particles, which costs a fifth of its second moment: the
//! accuracy shown is that of this cheap operator, equal in all columns but for the rounding of f32.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use parops::{
    Allowance, Apply, CellList, Cutoff, Domain, Epsilon, Exchange, Laplacian, NeighborList, Particles, Pse, Random,
    Rows, Strided,
};

/// In spacings: a ball of this radius holds 4/3 pi 1.94^3 = 30.6 particles.
const CUTOFF: f64 = 1.94;

/// epsilon/h; below the limit 1.5 of the kernel, because a wider one would lose most of its moments at this cutoff.
const OVERLAP: f64 = 1.0;

fn sizes() -> &'static [usize] {
    // Under `cargo test` benches run once each and unoptimized; a small set is enough to see them work.
    if std::env::args().any(|argument| argument == "--bench") { &[46, 100] } else { &[10] }
}

fn wave(x: &[f64; 3]) -> f64 {
    x.iter().map(|x| (TAU * x).sin()).product()
}

/// The largest error over the largest exact value, and the largest moment defect.
fn accuracy(name: &str, particles: &Particles<3>, out: impl Iterator<Item = f64>, defect: f64) {
    let scale = 3.0 * TAU * TAU;
    let errors = particles.points().iter().zip(out).map(|(x, out)| (out / scale + wave(x)).abs());
    println!("{name}: largest error {:.3}, moment defect {defect:.3}", errors.fold(0.0, f64::max));
}

fn laplacian(particles: &Particles<3>, m: usize) -> Pse<Exchange<3>> {
    let epsilon = Epsilon::global(OVERLAP / m as f64).expect("positive");
    let pse = Pse::new(Laplacian::<3>, 2, epsilon, particles.volumes().expect("made with volumes")).expect("order 2");
    pse.support(CUTOFF / OVERLAP).expect("positive").allow(Allowance::Everywhere)
}

fn shuffled(particles: &Particles<3>) -> Particles<3> {
    let mut points = particles.points().to_vec();
    let mut random = Random::new(1);
    for i in (1..points.len()).rev() {
        points.swap(i, (random.uniform() * (i + 1) as f64) as usize);
    }
    Particles::new(points).and_then(|moved| moved.with_volumes(particles.volumes()?.clone())).expect("the same points")
}

fn apply(c: &mut Criterion) {
    let mut group = c.benchmark_group("PSE Laplacian 3D");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4));
    for &m in sizes() {
        let lattice = Particles::jittered([0.0; 3], [1.0; 3], [m; 3], 0.3, 1).expect("a legal lattice");
        let domain = Domain::periodic([0.0; 3], [1.0; 3]).expect("a legal box");
        let (sorted, _) = lattice.sorted_by_cell(&domain, Cutoff(CUTOFF / m as f64)).expect("a legal cutoff");
        for (order, particles) in [("cell order", sorted), ("random order", shuffled(&lattice))] {
            let n = particles.len();
            group.throughput(Throughput::Elements(n as u64));
            let pse = laplacian(&particles, m);
            let cells = CellList::build(&particles, &domain, pse.cutoff()).expect("a legal set");
            let f: Vec<f64> = particles.points().iter().map(wave).collect();
            let f32s: Vec<f32> = f.iter().map(|&f| f as f32).collect();
            let (mut out, mut short) = (vec![0.0; n], vec![0.0_f32; n]);
            let id = |name: &str| BenchmarkId::new(format!("{name}, {order}"), n);

            group.bench_function(id("assemble"), |b| b.iter(|| pse.assemble(&cells).expect("allowed")));
            let rows = pse.assemble(&cells).expect("allowed");
            let defect = rows.report().moment_defect;
            println!("{:.1} neighbors a particle", rows.report().pairs as f64 / n as f64);
            group.bench_function(id("stored f64"), |b| b.iter(|| rows.apply(black_box(&f), &mut out)));
            accuracy("stored f64", &particles, out.iter().copied(), defect);
            several_fields(&mut group, &rows, order);
            drop(rows);
            let rows = Rows::<_, f32>::assemble(&pse, &cells).expect("allowed");
            group.bench_function(id("stored f32"), |b| b.iter(|| rows.apply(black_box(&f32s), &mut short)));
            accuracy("stored f32", &particles, short.iter().map(|&x| f64::from(x)), defect);
            drop(rows);
            let free = pse.matrix_free(&cells).expect("allowed");
            group.bench_function(id("matrix-free, cell list"), |b| b.iter(|| free.apply(black_box(&f), &mut out)));
            accuracy("matrix-free, cell list", &particles, out.iter().copied(), free.report().moment_defect);
            let list = NeighborList::from_provider(&cells).expect("a legal list");
            let free = pse.matrix_free(&list).expect("allowed");
            group.bench_function(id("matrix-free, list"), |b| b.iter(|| free.apply(black_box(&f), &mut out)));
            accuracy("matrix-free, list", &particles, out.iter().copied(), free.report().moment_defect);
        }
    }
    group.finish();
}

/// Time for F fields at once; over F it is the time per particle and field.
fn several_fields(group: &mut BenchmarkGroup<'_, WallTime>, rows: &Rows, order: &str) {
    const F: usize = 16;
    let n = rows.targets();
    let id = |name: &str| BenchmarkId::new(format!("{name}, {order}"), n);
    let value = |i: usize| (i as f64 * 0.37).sin();
    let fields: Vec<[f64; F]> = (0..n).map(|p| std::array::from_fn(|i| value(p * F + i))).collect();
    let mut out = vec![[0.0; F]; n];
    group.bench_function(id("16 fields, interleaved"), |b| b.iter(|| rows.apply_fields(black_box(&fields), &mut out)));
    let stacked = fields.as_flattened();
    group.bench_function(id("16 fields, stacked"), |b| {
        b.iter(|| {
            let f = Strided::stacked(black_box(stacked), F).expect("16 fields");
            rows.apply_strided(f, Strided::stacked(out.as_flattened_mut(), F).expect("16 fields"))
        })
    });
}

criterion_group!(benches, apply);
criterion_main!(benches);
