//! One line of the table: errors, cost, conservation and overlap of a run.

use parops::{CellList, Cutoff, Lambda, LedgerRow, Mesh, Particles, Result, fill_distance, least_gap};

use crate::flow::{exact, start};
use crate::runs::Method;
use crate::scattered::torus;

/// The particles and their values at a time.
pub struct Moment {
    pub t: f64,
    pub particles: Particles<2>,
    pub u: Vec<f64>,
}

impl Moment {
    pub fn errors(&self) -> Vec<f64> {
        self.particles.points().iter().zip(&self.u).map(|(x, u)| u - exact(x, self.t)).collect()
    }
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Record {
    pub method: Method,
    /// Particles along an axis.
    pub n: usize,
    pub dt: f64,
    pub steps: u64,
    /// Relative errors back at the start, root mean square and largest.
    pub l2: f64,
    pub linf: f64,
    /// Relative error of the wound-up blob at T/2. Particles that were not remeshed then are deposited on the mesh.
    pub half: f64,
    /// Seconds to make the rows, and to take the steps.
    pub build: f64,
    pub run: f64,
    /// Mass at the end less mass at the start, over that mass.
    pub drift: f64,
    /// Extrema of the values at the end; 0 and 1 but for 1e-5 are exact.
    pub min: f64,
    pub max: f64,
    pub remeshings: u64,
    /// The widest hole and the least gap at T/2, in h.
    pub hole: f64,
    pub gap: f64,
}

impl Record {
    pub const HEADER: &str = "method,n,dt,steps,error_l2,error_linf,error_half,seconds_build,seconds_run,mass_drift,\
        min,max,remeshings,hole_over_h,gap_over_h";
    pub const TITLE: &str = "method                   n      dt steps  L2 error Linf err.  at T/2   build s   run s  \
        mass drift     min    max remesh. hole/h gap/h";

    pub fn new(method: Method, n: usize, build: f64) -> Self {
        let none = f64::NAN;
        Self {
            method,
            n,
            dt: none,
            steps: 0,
            l2: none,
            linf: none,
            half: none,
            build,
            run: 0.0,
            drift: none,
            min: none,
            max: none,
            remeshings: 0,
            hole: none,
            gap: none,
        }
    }

    pub fn seconds(&self) -> f64 {
        self.build + self.run
    }

    /// Notes error and overlap at T/2.
    pub fn half(&mut self, moment: &Moment) -> Result<()> {
        let h = 1.0 / self.n as f64;
        let Moment { t, particles, u } = moment;
        let mesh = Mesh::cells(&torus()?, [self.n; 2])?;
        let nodes: Vec<[f64; 2]> = mesh.points().collect();
        self.half = if matches!(self.method, Method::Late | Method::Free) {
            let volumes = particles.volumes()?;
            let strength = |(p, u): (usize, &f64)| Ok(u * volumes.get(p)?);
            let strengths = u.iter().enumerate().map(strength).collect::<Result<Vec<f64>>>()?;
            let mut field = vec![0.0; mesh.len()];
            mesh.deposit(&Lambda::<4, 2>::new()?, particles.points(), &strengths, &mut field)?;
            field.iter_mut().for_each(|omega| *omega /= mesh.cell_volume());
            relative(&nodes, &field, |x| exact(x, *t)).0
        } else {
            relative(particles.points(), u, |x| exact(x, *t)).0
        };
        let probes: Vec<[f64; 2]> = Mesh::nodes(&torus()?, [2 * self.n; 2])?.points().collect();
        self.hole = fill_distance(&CellList::build_at(&probes, particles, &torus()?, Cutoff(4.0 * h))?) / h;
        self.gap = least_gap(&CellList::build(particles, &torus()?, Cutoff(1.5 * h))?) / h;
        Ok(())
    }

    /// Notes what the run came to.
    pub fn end(&mut self, moment: &Moment, ledger: &LedgerRow<2>) {
        (self.l2, self.linf) = relative(moment.particles.points(), &moment.u, start);
        (self.dt, self.steps, self.remeshings) = (ledger.dt, ledger.step, ledger.remeshings);
        let field = &ledger.fields[0];
        (self.drift, self.min, self.max) = (field.drift / (field.mass - field.drift), field.min, field.max);
    }

    pub fn csv(&self) -> String {
        format!(
            "{},{},{:e},{},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{:.4},{:.4}",
            self.method.name(),
            self.n,
            self.dt,
            self.steps,
            self.l2,
            self.linf,
            self.half,
            self.build,
            self.run,
            self.drift,
            self.min,
            self.max,
            self.remeshings,
            self.hole,
            self.gap
        )
    }

    pub fn row(&self) -> String {
        format!(
            "{:<22} {:>3} {:>7.4} {:>5} {:>9.2e} {:>9.2e} {:>9.2e} {:>7.3} {:>7.3} {:>11.1e} {:>7.3} {:>6.3} {:>7} {:>6.2} {:>5.2}",
            self.method.name(),
            self.n,
            self.dt,
            self.steps,
            self.l2,
            self.linf,
            self.half,
            self.build,
            self.run,
            self.drift,
            self.min,
            self.max,
            self.remeshings,
            self.hole,
            self.gap
        )
    }
}

/// Root mean square and largest error over those of the exact values.
fn relative(points: &[[f64; 2]], u: &[f64], exact: impl Fn(&[f64; 2]) -> f64) -> (f64, f64) {
    let (mut sums, mut largest) = ([0.0; 2], [0.0_f64; 2]);
    for (x, u) in points.iter().zip(u) {
        let exact = exact(x);
        for (i, value) in [u - exact, exact].into_iter().enumerate() {
            sums[i] += value * value;
            largest[i] = largest[i].max(value.abs());
        }
    }
    ((sums[0] / sums[1]).sqrt(), largest[0] / largest[1])
}
