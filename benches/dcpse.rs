//! Time per row of DC-PSE, certificate included, beside a loop of nalgebra over the same rows.
//!
//! Laplacian on jittered sets (0.3 h), rows in the order of the set with exactly their n = 2 l nearest neighbors, already
//! gathered: interior rows, and rows at a face. The loop solves one particle after another with matrices of fixed size:
//! A = B^T B of the windowed, scaled monomials by symmetric rank-one updates (of the ways nalgebra offers the fastest at
//! three of the four sizes), LU with partial pivoting, weights. Once it stops there; once it goes on to what our rows are
//! certified by, the residual of all conditions and an estimate of the condition number. Then each of our solvers has the
//! rows to itself. The figures at the end of each size are the best of all samples, block of rows by block.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Const, DimMin, SMatrix, SVector, ToTypenum};
use parops::{
    CellList, Cholesky, Cutoff, DcPse, Domain, Draft, Laplacian, Lu, Method, MomentSolver, Neighbors, Operator,
    Particles, PivotedQr, Qr, Rung, Stencil, graded,
};

/// cutoff / epsilon.
const RATIO: f64 = parops::CUTOFF_OVER_EPSILON;

#[derive(Clone, Copy, PartialEq)]
enum Place {
    Interior,
    Face,
}

/// Under `cargo test` benches run once each and unoptimized; few rows are enough to see them work.
fn rows_wanted() -> usize {
    if std::env::args().any(|argument| argument == "--bench") { 512 } else { 16 }
}

/// The first rows of that kind with their n nearest neighbors.
fn rows<const D: usize>(place: Place, n: usize) -> Vec<Draft<D, [f64; 1]>> {
    let (m, reach) = if D == 2 { (64, 7.5) } else { (20, 5.5) };
    let h = 1.0 / m as f64;
    let particles = Particles::jittered([0.0; D], [1.0; D], [m; D], 0.3, 1).expect("a legal lattice");
    let cells = CellList::build(&particles, &Domain::open(), Cutoff(reach * h)).expect("a legal set");
    let inside = |x: f64| (reach * h..1.0 - reach * h).contains(&x);
    let wanted = |x: &[f64; D]| match place {
        Place::Interior => x.iter().all(|&x| inside(x)),
        Place::Face => x[D - 1] < h && x[..D - 1].iter().all(|&x| inside(x)),
    };
    let (mut gathered, mut found) = (Stencil::default(), Vec::new());
    let square = |s: &[f64; D]| s.iter().map(|x| x * x).sum::<f64>();
    for (p, _) in particles.points().iter().enumerate().filter(|(_, x)| wanted(x)).take(rows_wanted()) {
        cells.gather(p, reach * h, &mut gathered);
        let mut squares: Vec<f64> = gathered.separations().iter().map(square).collect();
        squares.sort_by(f64::total_cmp);
        let cutoff = squares[n - 1].sqrt();
        let mut draft = Draft::default();
        draft.stencil.reset(p, Some(p), cutoff);
        for neighbor in gathered.iter().filter(|neighbor| square(&neighbor.separation) <= squares[n - 1]) {
            draft.stencil.push(neighbor);
        }
        draft.clear();
        found.push(draft);
    }
    assert!(found.iter().all(|draft| draft.stencil.len() == n));
    found
}

/// One row after another with matrices of fixed size: l = `C` conditions, n = `N` neighbors.
struct Loop<const D: usize, const C: usize, const N: usize> {
    /// Axis and parent of every monomial; a parent of C is the constant.
    parents: Vec<(usize, usize)>,
    required: SVector<f64, C>,
    /// B^T.
    b: SMatrix<f64, C, N>,
    w: SVector<f64, N>,
}

impl<const D: usize, const C: usize, const N: usize> Loop<D, C, N>
where
    Const<C>: ToTypenum + DimMin<Const<C>, Output = Const<C>>,
{
    fn new(order: u32) -> Self {
        let basis: Vec<_> = graded::<D>(1, order + 1).map(|alpha| alpha.exponents()).collect();
        let parent = |exponents: &[u8; D]| {
            let axis = exponents.iter().position(|&e| e > 0).unwrap_or(0);
            let mut parent = *exponents;
            parent[axis] -= 1;
            (axis, basis.iter().position(|other| *other == parent).unwrap_or(C))
        };
        let pure = |exponents: &[u8; D]| exponents.contains(&2) && exponents.iter().sum::<u8>() == 2;
        let required = SVector::from_iterator(basis.iter().map(|exponents| if pure(exponents) { 2.0 } else { 0.0 }));
        Self { parents: basis.iter().map(parent).collect(), required, b: SMatrix::zeros(), w: SVector::zeros() }
    }

    /// The weights of one row; with `certify`, residual, sum of absolute terms and condition number too.
    fn solve(&mut self, stencil: &Stencil<D>, certify: bool) -> [f64; 3] {
        let Self { parents, required, b, w } = self;
        let inverse = RATIO / stencil.cutoff();
        let mut roots = [0.0; N];
        for ((mut column, s), root) in b.column_iter_mut().zip(stencil.separations()).zip(&mut roots) {
            let z = s.map(|x| x * inverse);
            *root = (-0.5 * z.iter().map(|x| x * x).sum::<f64>()).exp();
            for (j, &(axis, parent)) in parents.iter().enumerate() {
                column[j] = z[axis] * if parent == C { *root } else { column[parent] };
            }
        }
        let mut a = SMatrix::<f64, C, C>::zeros();
        for column in b.column_iter() {
            a.syger(1.0, &column, &column, 1.0);
        }
        a.fill_upper_triangle_with_lower_triangle();
        let lu = a.lu();
        let x = lu.solve(required).unwrap_or(*required);
        let y = b.tr_mul(&x);
        let scale = inverse * inverse;
        for ((w, &y), &root) in w.iter_mut().zip(y.iter()).zip(&roots) {
            *w = y * root * scale;
        }
        if !certify {
            return [0.0; 3];
        }
        let (mut sums, mut terms) = (-*required, SVector::<f64, C>::zeros());
        for (column, &y) in b.column_iter().zip(y.iter()) {
            for ((&b, sum), term) in column.iter().zip(sums.iter_mut()).zip(terms.iter_mut()) {
                *sum += b * y;
                *term += (b * y).abs();
            }
        }
        let start = SVector::<f64, C>::from_element(1.0);
        let up = a * start;
        let largest = (a * up).norm() / up.norm();
        let down = lu.solve(&start).unwrap_or(start);
        let smallest = down.norm() / lu.solve(&down).unwrap_or(down).norm();
        [sums.amax(), terms.amax(), (largest / smallest).sqrt()]
    }
}

/// Rows that are timed together: few enough that a share of the samples is not interrupted by other work.
const BLOCK: usize = 32;

/// Runs `block` over all blocks of the rows, and adds up the best times of each: nanoseconds a row.
fn timed<T>(
    c: &mut BenchmarkGroup<'_, WallTime>,
    id: BenchmarkId,
    rows: &mut [T],
    mut block: impl FnMut(&mut [T]),
) -> f64 {
    let count = rows.len();
    let mut best = vec![f64::INFINITY; count.div_ceil(BLOCK)];
    c.bench_function(id, |b| {
        b.iter_custom(|times| {
            let mut total = Duration::ZERO;
            for _ in 0..times {
                for (rows, best) in rows.chunks_mut(BLOCK).zip(&mut best) {
                    let start = Instant::now();
                    block(black_box(rows));
                    let elapsed = start.elapsed();
                    *best = best.min(elapsed.as_secs_f64());
                    total += elapsed;
                }
            }
            total
        })
    });
    best.iter().sum::<f64>() * 1e9 / count as f64
}

/// The same rows by one solver alone, one stencil after another: what each rung of the ladder costs.
fn alone<const D: usize, const R: u32, S: MomentSolver>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    id: BenchmarkId,
    solver: S,
    drafts: &mut [Draft<D, [f64; 1]>],
) -> f64
where
    Laplacian<D>: Operator<D, Out = [f64; 1]> + Default,
{
    let dcpse = DcPse::<Laplacian<D>, R>::new().solver(solver);
    let mut scratch = dcpse.scratch().expect("a legal operator");
    timed(group, id, drafts, |drafts| dcpse.weights_batch(drafts, &mut scratch))
}

fn case<const D: usize, const R: u32, const C: usize, const N: usize>(c: &mut Criterion)
where
    Laplacian<D>: Operator<D, Out = [f64; 1]> + Default,
    Const<C>: ToTypenum + DimMin<Const<C>, Output = Const<C>>,
{
    let mut group = c.benchmark_group(format!("DC-PSE Laplacian {D}D, order {R}, {C} conditions, {N} neighbors"));
    group.sample_size(20).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    for (place, name) in [(Place::Interior, "interior"), (Place::Face, "face")] {
        let mut drafts = rows::<D>(place, N);
        let count = drafts.len();
        group.throughput(Throughput::Elements(count as u64));
        let id = |what: &str| BenchmarkId::new(what, name);
        let dcpse = DcPse::<Laplacian<D>, R>::new();
        let mut scratch = dcpse.scratch().expect("a legal operator");
        let ours = timed(&mut group, id("rows"), &mut drafts, |drafts| {
            drafts.chunks_mut(8).for_each(|drafts| dcpse.weights_batch(drafts, &mut scratch));
        });
        let mut single = Loop::<D, C, N>::new(R);
        for draft in &drafts {
            single.solve(&draft.stencil, true);
            let largest = single.w.amax();
            let far = draft.weights.iter().zip(single.w.iter()).map(|([w], v)| (w - v).abs()).fold(0.0, f64::max);
            // Normal equations at condition numbers up to some thousands.
            assert!(far <= 1e-8 * largest, "{far} {largest}");
        }
        let [bare, certified] =
            [(false, "LU of nalgebra"), (true, "LU of nalgebra, certified")].map(|(certify, what)| {
                timed(&mut group, id(what), &mut drafts, |drafts| {
                    for draft in drafts {
                        black_box(single.solve(&draft.stencil, certify));
                        black_box(&single.w);
                    }
                })
            });
        let reports = || drafts.iter().filter_map(|draft| draft.report.as_ref().ok());
        let corrected = reports().filter(|report| report.rung == Some(Rung::Corrected)).count();
        let condition = reports().map(|report| report.condition).fold(0.0, f64::max);
        println!(
            "{name}: {ours:.0} ns a row of {count}, {corrected} corrected, condition to {condition:.0}; nalgebra {bare:.0} \
             ns, ratio {:.2}; certified {certified:.0} ns, ratio {:.2}",
            bare / ours,
            certified / ours
        );
        let cholesky = alone::<D, R, _>(&mut group, id("Cholesky alone"), Cholesky, &mut drafts);
        let qr = alone::<D, R, _>(&mut group, id("QR alone"), Qr, &mut drafts);
        let pivoted = alone::<D, R, _>(&mut group, id("pivoted QR alone"), PivotedQr, &mut drafts);
        let lu = alone::<D, R, _>(&mut group, id("LU alone"), Lu, &mut drafts);
        println!("{name}, one at a time: Cholesky {cholesky:.0} ns, QR {qr:.0}, pivoted QR {pivoted:.0}, LU {lu:.0}");
    }
    group.finish();
}

fn dcpse(c: &mut Criterion) {
    case::<2, 2, 9, 20>(c);
    case::<2, 4, 20, 40>(c);
    case::<3, 2, 19, 38>(c);
    case::<3, 4, 55, 110>(c);
}

criterion_group!(benches, dcpse);
criterion_main!(benches);
