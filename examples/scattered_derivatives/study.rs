//! One operator on one set: rows built, applied and compared with the exact derivative.

use std::hint::black_box;
use std::time::Instant;

use parops::{DcPse, Domain, Histogram, MultiIndex, Nearest, Neighbors, Operator, Particles, Report};

use crate::field::{derivative, exact};
use crate::sets::Set;

/// One line of the table.
#[derive(Clone)]
pub struct Record {
    pub dim: usize,
    pub set: &'static str,
    pub operator: &'static str,
    pub order: u32,
    /// Number of particles, and of them interior ones: their cutoff touches no face of the box.
    pub particles: usize,
    pub interior: usize,
    pub conditions: usize,
    /// Mean number of neighbors.
    pub neighbors: f64,
    /// Relative errors: over interior particles, and the root mean square over the others.
    pub l2: f64,
    pub linf: f64,
    pub l2_faces: f64,
    /// Relative error in the middle, where every |x_i - 1/2| <= 1/4: the same region for all refinements.
    pub l2_middle: f64,
    /// Rounding in units of `l2`: eps sum_q |w_pq| max |f|, root mean square.
    pub floor: f64,
    /// Against the next coarser set, in h = N^(-1/D).
    pub observed_order: Option<f64>,
    pub middle_order: Option<f64>,
    /// Nanoseconds per particle.
    pub build: f64,
    pub apply: f64,
    pub condition: f64,
    pub residual: f64,
    pub rungs: [usize; 5],
    /// Rows per decade.
    pub condition_spread: Histogram,
    pub residual_spread: Histogram,
}

/// Builds are repeated until they have taken this long together, three times at most; the fastest counts.
const BUILD_SECONDS: f64 = 0.05;
/// Applications are repeated for this long.
const APPLY_SECONDS: f64 = 0.01;

pub fn run<Op, const D: usize, const K: usize>(
    operator: Op,
    name: &'static str,
    order: u32,
    set: Set,
    particles: &Particles<D>,
) -> parops::Result<Record>
where
    Op: Operator<D, Out = [f64; K]> + Clone,
{
    let points = particles.points();
    let count = points.len();
    let dcpse = DcPse::at_order(operator.clone(), order)?;
    let needed = dcpse.fewest_neighbors()?;
    let neighbors = Nearest::build(particles, &Domain::open(), needed)?;

    let start = Instant::now();
    let mut rows = dcpse.assemble(&neighbors)?;
    let mut build = start.elapsed().as_secs_f64();
    for _ in 0..2 {
        if start.elapsed().as_secs_f64() < BUILD_SECONDS {
            let again = Instant::now();
            rows = dcpse.assemble(&neighbors)?;
            build = build.min(again.elapsed().as_secs_f64());
        }
    }

    let f: Vec<f64> = points.iter().map(|x| derivative(MultiIndex::ZERO, x)).collect();
    let mut out = vec![[0.0; K]; count];
    let (mut apply, start) = (f64::INFINITY, Instant::now());
    while apply.is_infinite() || start.elapsed().as_secs_f64() < APPLY_SECONDS {
        let once = Instant::now();
        rows.apply_all(black_box(&f), &mut out)?;
        apply = apply.min(once.elapsed().as_secs_f64());
    }

    let mut interior = Norm::default();
    let mut faces = Norm::default();
    let mut middle = Norm::default();
    let mut rounding = 0.0;
    for (p, (x, out)) in points.iter().zip(&out).enumerate() {
        let rc = neighbors.cutoff(p);
        let inside = x.iter().all(|x| x - rc >= 0.0 && x + rc <= 1.0);
        let exact = exact(&operator, x);
        let norm = if inside { &mut interior } else { &mut faces };
        norm.add(out, &exact);
        if x.iter().all(|x| (x - 0.5).abs() <= 0.25) {
            middle.add(out, &exact);
        }
        if let Some(row) = rows.row(p).filter(|_| inside) {
            for k in 0..K {
                let sum = row.weights.iter().fold(row.diagonal[k].abs(), |sum, w| sum + w[k].abs());
                rounding += (f64::EPSILON * sum).powi(2);
            }
        }
    }
    let largest = f.iter().fold(0.0_f64, |largest, f| largest.max(f.abs()));
    let report: &Report = rows.report();
    let nanoseconds = |seconds: f64| 1e9 * seconds / count as f64;
    Ok(Record {
        dim: D,
        set: set.name(),
        operator: name,
        order,
        particles: count,
        interior: interior.count,
        conditions: report.worst().map_or(0, |row| row.conditions),
        neighbors: report.pairs as f64 / count as f64,
        l2: interior.l2(),
        linf: interior.largest / interior.largest_exact,
        l2_faces: faces.l2(),
        l2_middle: middle.l2(),
        floor: largest * (rounding / interior.squares_exact).sqrt(),
        observed_order: None,
        middle_order: None,
        build: nanoseconds(build),
        apply: nanoseconds(apply),
        condition: report.condition,
        residual: report.residual,
        rungs: report.rungs,
        condition_spread: report.conditions,
        residual_spread: report.residuals,
    })
}

/// Errors relative to the exact values of the same particles.
#[derive(Default)]
struct Norm {
    count: usize,
    squares: f64,
    squares_exact: f64,
    largest: f64,
    largest_exact: f64,
}

impl Norm {
    fn add<const K: usize>(&mut self, out: &[f64; K], exact: &[f64; K]) {
        self.count += 1;
        for (out, exact) in out.iter().zip(exact) {
            self.squares += (out - exact).powi(2);
            self.squares_exact += exact * exact;
            self.largest = self.largest.max((out - exact).abs());
            self.largest_exact = self.largest_exact.max(exact.abs());
        }
    }

    fn l2(&self) -> f64 {
        (self.squares / self.squares_exact).sqrt()
    }
}

impl Record {
    pub const HEADER: &str = "dim,set,operator,order,n,l,neighbors,error_l2,error_linf,observed_order,\
        build_ns_per_particle,apply_ns_per_particle,worst_cond,worst_residual,rungs";
    pub const TITLE: &str = "dim       set    operator  r       N interior   l  neighb.   L2 inner  Linf inner  order  \
        L2 middle  order   \
        L2 faces    floor  build ns  apply ns     cond  residual  rows per rung";

    /// N^(-1/D).
    pub fn h(&self) -> f64 {
        (self.particles as f64).powf(-1.0 / self.dim as f64)
    }

    pub fn key(&self) -> (usize, &'static str, &'static str, u32) {
        (self.dim, self.set, self.operator, self.order)
    }

    fn rungs(&self) -> String {
        let names = ["lu", "cholesky", "corrected", "qr", "pivoted"];
        let used = names.iter().zip(self.rungs).filter(|(_, rows)| *rows > 0);
        used.map(|(name, rows)| format!("{name}:{rows}")).collect::<Vec<_>>().join(" ")
    }

    pub fn row(&self) -> String {
        let shown = |order: Option<f64>| order.map_or("-".into(), |order| format!("{order:.2}"));
        let (order, middle_order) = (shown(self.observed_order), shown(self.middle_order));
        format!(
            "{:>3} {:>9} {:>11} {:>2} {:>7} {:>8} {:>3} {:>8.1} {:>10.2e} {:>11.2e} {order:>6} {:>10.2e} {middle_order:>6} {:>10.2e} {:>8.0e} {:>9.0} {:>9.0} {:>8.1e} {:>9.1e}  {}",
            self.dim,
            self.set,
            self.operator,
            self.order,
            self.particles,
            self.interior,
            self.conditions,
            self.neighbors,
            self.l2,
            self.linf,
            self.l2_middle,
            self.l2_faces,
            self.floor,
            self.build,
            self.apply,
            self.condition,
            self.residual,
            self.rungs()
        )
    }

    pub fn csv(&self) -> String {
        format!(
            "{},{},{},{},{},{},{:.2},{:e},{:e},{},{:.1},{:.1},{:e},{:e},{}",
            self.dim,
            self.set,
            self.operator,
            self.order,
            self.particles,
            self.conditions,
            self.neighbors,
            self.l2,
            self.linf,
            self.observed_order.map_or(String::new(), |order| format!("{order:.4}")),
            self.build,
            self.apply,
            self.condition,
            self.residual,
            self.rungs()
        )
    }
}
