//! The benchmark of the notes: diffusion on a ray, with its exact solution.

/// Diffusion coefficient D.
pub const D: f64 = 1e-4;
/// End time T.
pub const T: f64 = 10.0;
/// The step asked for; it is cut where it is above the stability limit.
pub const DT: f64 = 0.1;
/// Where the solution falls below round-off: the end of the particles of PSE.
pub const X_PSE: f64 = 6.2;
/// The end of the particles and bins of the random walk.
pub const X_RW: f64 = 4.0;

/// u(x, t) = x (1 + 4 D t)^(-3/2) exp(-x^2 / (1 + 4 D t)), odd in x. Source: notes 001, eq. 5.25 and 5.26.
pub fn exact(x: f64, t: f64) -> f64 {
    let s = 1.0 + 4.0 * D * t;
    x * (-x * x / s).exp() / (s * s.sqrt())
}

/// Root mean square and largest modulus of the differences (eq. 5.28).
pub fn norms(differences: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut squares, mut largest, mut count) = (0.0_f64, 0.0_f64, 0.0);
    for difference in differences {
        squares += difference * difference;
        largest = largest.max(difference.abs());
        count += 1.0;
    }
    ((squares / count).sqrt(), largest)
}

/// One run: a row of the table.
#[derive(Clone, Debug)]
pub struct Record {
    pub method: &'static str,
    pub scalar: &'static str,
    pub order: u32,
    pub stepper: &'static str,
    pub n: usize,
    pub h: f64,
    pub epsilon: f64,
    pub cutoff: f64,
    pub dt: f64,
    pub steps: u64,
    pub l2: f64,
    pub linf: f64,
    /// log2 of the ratio to the error at half as many particles.
    pub observed_order: Option<f64>,
    pub seconds: f64,
}

impl Record {
    pub const HEADER: &'static str =
        "method,scalar,order,stepper,n,h,epsilon,cutoff,dt,steps,l2,linf,observed_order,seconds";

    pub fn csv(&self) -> String {
        let observed = self.observed_order.map_or(String::new(), |order| format!("{order:.4}"));
        format!(
            "{},{},{},{},{},{},{},{},{},{},{:e},{:e},{observed},{:.6}",
            self.method,
            self.scalar,
            self.order,
            self.stepper,
            self.n,
            self.h,
            self.epsilon,
            self.cutoff,
            self.dt,
            self.steps,
            self.l2,
            self.linf,
            self.seconds
        )
    }

    pub fn row(&self) -> String {
        let observed = self.observed_order.map_or("-".to_string(), |order| format!("{order:.2}"));
        format!(
            "{:<4}{:<4}{:>3} {:<6}{:>6}{:>10.3e}{:>9.4}{:>6}{:>12.3e}{:>12.3e}{observed:>8}{:>11.6}",
            self.method,
            self.scalar,
            self.order,
            self.stepper,
            self.n,
            self.h,
            self.dt,
            self.steps,
            self.l2,
            self.linf,
            self.seconds
        )
    }

    pub const TITLE: &'static str =
        "meth scal r stepper    n         h       dt steps          l2        linf   order    seconds";

    /// Whether this run differs from another in the number of particles only.
    pub fn same_series(&self, other: &Self) -> bool {
        (self.method, self.scalar, self.order, self.stepper) == (other.method, other.scalar, other.order, other.stepper)
    }
}
