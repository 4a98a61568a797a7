//! One setting on one set: rows built, applied and compared with the exact Laplacian.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use parops::{
    Allowance, CellList, DcPse, Domain, Epsilon, Laplacian, Method, Nearest, Neighbors, Particles, Pse, Rows,
};

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Varied {
    /// epsilon/h, the cutoff in proportion (PSE), or the number of neighbors (DC-PSE).
    Overlap,
    /// cutoff/epsilon, at a constant epsilon (PSE), or at constant neighbors (DC-PSE).
    Cutoff,
}

/// One line of the table.
#[derive(Clone)]
pub struct Record {
    pub varied: Varied,
    pub method: &'static str,
    pub dim: usize,
    pub side: usize,
    pub jitter: f64,
    pub order: u32,
    pub epsilon_over_h: f64,
    pub cutoff_over_epsilon: f64,
    /// Mean number of neighbors.
    pub neighbors: f64,
    /// Moment conditions solved for; 0 with PSE.
    pub conditions: usize,
    /// The worst condition number of a row; 0 with PSE.
    pub condition: f64,
    /// The largest h^2 sum |w|.
    pub sum_abs: f64,
    /// Largest relative defect of the moments of degree 2 and more, and rows refused by default.
    pub defect: f64,
    pub refused: usize,
    /// Nanoseconds per particle.
    pub build: f64,
    pub apply: f64,
    /// Relative error.
    pub l2: f64,
}

/// A set on the torus of edge 1 and what is known about it.
pub struct Scene<const D: usize> {
    pub side: usize,
    pub jitter: f64,
    pub particles: Particles<D>,
    pub f: Vec<f64>,
    torus: Domain<D>,
}

/// What a method built: its rows, with the cutoff and epsilon of the mean particle and the seconds it took.
struct Built {
    rows: Rows,
    epsilon: f64,
    cutoff: f64,
    seconds: f64,
}

/// Builds that take less are repeated for this long together.
const BUILD_SECONDS: f64 = 0.005;
/// Applications are repeated for this long, the fastest counts.
const APPLY_SECONDS: f64 = 0.003;

impl<const D: usize> Scene<D> {
    pub fn new(side: usize, jitter: f64) -> parops::Result<Self> {
        let particles = Particles::jittered([0.0; D], [1.0; D], [side; D], jitter, 1)?;
        let wave = |x: &[f64; D]| x.iter().enumerate().map(|(i, x)| (TAU * x + 0.3 + i as f64).sin()).product();
        let f = particles.points().iter().map(wave).collect();
        Ok(Self { side, jitter, torus: Domain::periodic([0.0; D], [1.0; D])?, particles, f })
    }

    fn h(&self) -> f64 {
        1.0 / self.side as f64
    }

    /// PSE with epsilon in units of h and the cutoff in units of epsilon; rows beyond the limits are let through.
    pub fn pse(&self, varied: Varied, order: u32, epsilon: f64, cutoff: Option<f64>) -> parops::Result<Record> {
        let global = self.particles.spacing()?.epsilon(epsilon)?;
        let mut pse = Pse::new(Laplacian::<D>, order, global, self.particles.volumes()?)?;
        if let Some(cutoff) = cutoff {
            pse = pse.support(cutoff)?;
        }
        let pse = pse.allow(Allowance::Everywhere);
        let cells = CellList::build(&self.particles, &self.torus, pse.cutoff())?;
        let (rows, seconds) = assemble(&pse, &cells)?;
        let built = Built { rows, epsilon: epsilon * self.h(), cutoff: pse.cutoff().0, seconds };
        Ok(self.record(varied, "PSE", order, built)?.0)
    }

    /// DC-PSE with so many neighbors in units of l and the cutoff of every row in units of its epsilon; and the error at
    /// every particle.
    pub fn dcpse(&self, varied: Varied, order: u32, ratio: f64, cutoff: f64) -> parops::Result<(Record, Vec<f64>)> {
        let dcpse = DcPse::at_order(Laplacian::<D>, order)?.neighbors_per_condition(ratio)?;
        let nearest = Nearest::build(&self.particles, &self.torus, dcpse.fewest_neighbors::<D>()?)?;
        let cutoffs = (0..self.particles.len()).map(|p| nearest.cutoff(p));
        let mean = cutoffs.clone().sum::<f64>() / self.particles.len() as f64;
        let dcpse = dcpse.epsilon(Epsilon::each(cutoffs.map(|rc| rc / cutoff).collect())?);
        let (rows, seconds) = assemble(&dcpse, &nearest)?;
        self.record(varied, "DC-PSE", order, Built { rows, epsilon: mean / cutoff, cutoff: mean, seconds })
    }

    fn record(
        &self,
        varied: Varied,
        method: &'static str,
        order: u32,
        built: Built,
    ) -> parops::Result<(Record, Vec<f64>)> {
        let Built { rows, epsilon, cutoff, seconds } = built;
        let mut out = vec![[0.0]; self.f.len()];
        let (mut apply, start) = (f64::INFINITY, Instant::now());
        while apply.is_infinite() || start.elapsed().as_secs_f64() < APPLY_SECONDS {
            let once = Instant::now();
            rows.apply_all(black_box(&self.f), &mut out)?;
            apply = apply.min(once.elapsed().as_secs_f64());
        }
        // Lap f = -D tau^2 f.
        let factor = -(D as f64) * TAU * TAU;
        let error: Vec<f64> = out.iter().zip(&self.f).map(|([lap], f)| lap / factor - f).collect();
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let report = rows.report();
        let count = self.f.len() as f64;
        let record = Record {
            varied,
            method,
            dim: D,
            side: self.side,
            jitter: self.jitter,
            order,
            epsilon_over_h: epsilon / self.h(),
            cutoff_over_epsilon: cutoff / epsilon,
            neighbors: report.pairs as f64 / count,
            conditions: report.worst().map_or(0, |row| row.conditions),
            condition: report.condition,
            sum_abs: report.sum_abs * self.h() * self.h(),
            defect: report.moment_defect,
            refused: report.allowed,
            build: 1e9 * seconds / count,
            apply: 1e9 * apply / count,
            l2: (square(&error) / square(&self.f)).sqrt(),
        };
        Ok((record, error))
    }
}

fn assemble<const D: usize>(
    method: &impl Method<D, Out = [f64; 1]>,
    neighbors: &impl Neighbors<D>,
) -> parops::Result<(Rows, f64)> {
    let start = Instant::now();
    let mut rows = Rows::assemble(method, neighbors)?;
    let mut seconds = start.elapsed().as_secs_f64();
    // Short builds are repeated, the fastest counts.
    while start.elapsed().as_secs_f64() < BUILD_SECONDS {
        let again = Instant::now();
        rows = Rows::assemble(method, neighbors)?;
        seconds = seconds.min(again.elapsed().as_secs_f64());
    }
    Ok((rows, seconds))
}

impl Record {
    pub const HEADER: &str = "varied,method,dim,n,jitter,order,h_over_epsilon,cutoff_over_epsilon,neighbors,\
        conditions,worst_condition,sum_abs_h2,moment_defect,rows_refused,build_ns_per_particle,apply_ns_per_particle,\
        error_l2";
    pub const TITLE: &str = "varied   method dim     N jitter r  h/eps  rc/eps  neighb.   l     cond  h^2 sum|w|  \
        defect refused  build ns  apply ns   L2 error";

    fn count(&self) -> usize {
        self.side.pow(self.dim as u32)
    }

    pub fn csv(&self) -> String {
        format!(
            "{:?},{},{},{},{},{},{:.4},{:.4},{:.2},{},{:e},{:e},{:e},{},{:.1},{:.1},{:e}",
            self.varied,
            self.method,
            self.dim,
            self.count(),
            self.jitter,
            self.order,
            1.0 / self.epsilon_over_h,
            self.cutoff_over_epsilon,
            self.neighbors,
            self.conditions,
            self.condition,
            self.sum_abs,
            self.defect,
            self.refused,
            self.build,
            self.apply,
            self.l2
        )
    }

    pub fn row(&self) -> String {
        format!(
            "{:<8} {:<6} {:>3} {:>5} {:>6} {} {:>6.3} {:>7.2} {:>8.1} {:>3} {:>8.1e} {:>11.3e} {:>7.0e} {:>7} {:>9.0} {:>9.0} {:>10.2e}",
            format!("{:?}", self.varied),
            self.method,
            self.dim,
            self.count(),
            self.jitter,
            self.order,
            1.0 / self.epsilon_over_h,
            self.cutoff_over_epsilon,
            self.neighbors,
            self.conditions,
            self.condition,
            self.sum_abs,
            self.defect,
            self.refused,
            self.build,
            self.apply,
            self.l2
        )
    }
}
