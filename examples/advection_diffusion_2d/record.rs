//! One line of the table.

use parops::{Ledger, Limit, Particles};

use crate::exact::exact;
use crate::runs::{END, Method, Moment, Solved};

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Record {
    pub method: Method,
    pub n: usize,
    /// Relative errors of u - 1, root mean square and largest.
    pub l2: f64,
    pub linf: f64,
    pub dt: f64,
    pub steps: u64,
    /// Substeps beyond one a step.
    pub retries: u64,
    pub binding: Option<Limit>,
    /// Mass at the end less mass at the start, over that mass.
    pub drift: f64,
    /// The same of the exact values at the same particles: sums over scattered ones are only quadrature.
    pub drift_of_exact: f64,
    pub min: f64,
    pub max: f64,
    /// The largest numerical viscosity over D, and the largest growth rate of a mode.
    pub viscosity: f64,
    pub growth: f64,
    pub condition: f64,
    pub remeshings: u64,
    pub rebuilds: u64,
    pub seconds: f64,
}

impl Solved {
    pub fn new(method: Method, n: usize, particles: Particles<2>, u: Vec<f64>) -> Self {
        let start = Moment { t: 0.0, particles, u };
        Self { method, n, moments: vec![start], ledger: Ledger::default(), viscosity: 0.0 }
    }

    /// The drift that exact values have at the last particles, over the mass.
    pub fn drift_of_exact(&self, t: f64) -> f64 {
        let Some(moment) = self.moments.last() else { return f64::NAN };
        let mean = |t: f64| {
            let points = moment.particles.points();
            points.iter().map(|x| exact(x, t)).sum::<f64>() / points.len() as f64
        };
        mean(t) / mean(0.0) - 1.0
    }

    /// The line of a run that took so many seconds; `None` for one that took no step.
    pub fn record(&self, seconds: f64) -> Option<Record> {
        let (moment, last) = (self.moments.last()?, self.ledger.rows().last()?);
        let (mut squares, mut largest) = ([0.0; 2], [0.0_f64; 2]);
        for (x, error) in moment.particles.points().iter().zip(moment.errors()) {
            for (i, value) in [error, exact(x, END) - 1.0].into_iter().enumerate() {
                squares[i] += value * value;
                largest[i] = largest[i].max(value.abs());
            }
        }
        let field = last.fields.first()?;
        Some(Record {
            method: self.method,
            n: self.n,
            l2: (squares[0] / squares[1]).sqrt(),
            linf: largest[0] / largest[1],
            dt: last.dt,
            steps: last.step,
            retries: last.retries,
            binding: last.binding,
            drift: field.drift / (field.mass - field.drift),
            drift_of_exact: self.drift_of_exact(END),
            min: field.min,
            max: field.max,
            viscosity: self.viscosity,
            growth: last.growth,
            condition: self.ledger.rows().iter().fold(0.0, |most, row| most.max(row.condition)),
            remeshings: last.remeshings,
            rebuilds: last.rebuilds,
            seconds,
        })
    }
}

impl Record {
    pub const HEADER: &str = "method,order,n,error_l2,error_linf,dt,steps,retries,binding,mass_drift,\
        mass_drift_of_exact,min,max,numerical_viscosity_over_d,growth,condition,remeshings,rebuilds,seconds";
    pub const TITLE: &str = "method               n  L2 error Linf err.      dt steps more bound by      mass drift     \
        min     max  visc./D   growth    cond remesh.   sec.";

    fn bound_by(&self) -> &'static str {
        self.binding.map_or("", Limit::name)
    }

    pub fn csv(&self) -> String {
        format!(
            "{},{},{},{:e},{:e},{:e},{},{},{},{:e},{:e},{:e},{:e},{:e},{:e},{:e},{},{},{:e}",
            self.method.name(),
            self.method.order(),
            self.n,
            self.l2,
            self.linf,
            self.dt,
            self.steps,
            self.retries,
            self.bound_by(),
            self.drift,
            self.drift_of_exact,
            self.min,
            self.max,
            self.viscosity,
            self.growth,
            self.condition,
            self.remeshings,
            self.rebuilds,
            self.seconds
        )
    }

    pub fn row(&self) -> String {
        format!(
            "{:<18} {:>3} {:>9.2e} {:>9.2e} {:>7.4} {:>5} {:>4} {:<12} {:>11.1e} {:>7.4} {:>7.4} {:>8.2} {:>8.1e} {:>7.2} {:>7} {:>6.2}",
            self.method.name(),
            self.n,
            self.l2,
            self.linf,
            self.dt,
            self.steps,
            self.retries,
            self.bound_by(),
            self.drift,
            self.min,
            self.max,
            self.viscosity,
            self.growth,
            self.condition,
            self.remeshings,
            self.seconds
        )
    }
}
