//! Sets on which moment conditions lose their rank: what the library refuses, and that what it accepts holds.

use parops::{
    DcPse, Domain, ErrorKind, Gradient, Laplacian, Method, Nearest, Neighbors, Operator, OperatorError, Particles,
    Random, RowReport, Stencil,
};

/// What became of the rows of one set.
pub struct Line {
    pub dim: usize,
    pub operator: &'static str,
    pub name: &'static str,
    /// Rows accepted, and refused by rank, by too few neighbors, and otherwise.
    pub accepted: usize,
    pub singular: usize,
    pub too_few: usize,
    pub other: usize,
    pub conditions: usize,
    pub neighbors: f64,
    /// The largest relative error of a quadratic polynomial's derivative over the accepted rows.
    pub miss: f64,
    pub condition: f64,
    pub residual: f64,
    pub rungs: [usize; 5],
    /// The first refusal.
    pub refusal: Option<parops::Error>,
}

pub fn run() -> parops::Result<Vec<Line>> {
    let mut random = Random::new(3);
    let mut line = |i: usize| 0.1 * (i as f64 + 0.3 * random.uniform());
    let on_a_line: Vec<[f64; 2]> = (0..60).map(&mut line).map(|t| [t, 0.5 * t]).collect();
    let in_a_plane: Vec<[f64; 3]> = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 5)?
        .points()
        .iter()
        .map(|x| [x[0], x[1], 0.25 * x[0] - 0.5 * x[1]])
        .collect();
    let along_an_axis: Vec<[f64; 2]> = (0..60).map(|i| [line(i), 0.0]).collect();
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [12; 2])?.points().to_vec();
    let space = Particles::lattice([0.0; 3], [1.0; 3], [8; 3])?.points().to_vec();
    // Half of it a line, half a jittered block: some rows have rank, others do not.
    let mut mixed = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 6)?.points().to_vec();
    mixed.extend((0..60).map(|i| [2.0 + line(i), 0.0]));
    Ok(vec![
        rows("line", "laplacian", Laplacian::<2>, on_a_line, 2.0)?,
        rows("axis", "laplacian", Laplacian::<2>, along_an_axis, 2.0)?,
        rows("plane", "laplacian", Laplacian::<3>, in_a_plane, 2.0)?,
        rows("lattice n=l", "laplacian", Laplacian::<2>, lattice.clone(), 1.0)?,
        rows("lattice n=2l", "laplacian", Laplacian::<2>, lattice.clone(), 2.0)?,
        rows("lattice n=l", "gradient", Gradient::<2>, lattice, 1.0)?,
        rows("lattice n=l", "laplacian", Laplacian::<3>, space, 1.0)?,
        rows("block and line", "laplacian", Laplacian::<2>, mixed, 2.0)?,
    ])
}

/// Every row of order 2 by itself, so that one refusal does not hide the others.
fn rows<Op, const D: usize, const K: usize>(
    name: &'static str,
    operator_name: &'static str,
    operator: Op,
    points: Vec<[f64; D]>,
    neighbors_per_condition: f64,
) -> parops::Result<Line>
where
    Op: Operator<D, Out = [f64; K]>,
{
    let particles = Particles::new(points)?;
    let dcpse = DcPse::<Op, 2>::of(operator).neighbors_per_condition(neighbors_per_condition)?;
    let neighbors = Nearest::build(&particles, &Domain::open(), dcpse.fewest_neighbors()?)?;
    let mut line = Line {
        dim: D,
        operator: operator_name,
        name,
        accepted: 0,
        singular: 0,
        too_few: 0,
        other: 0,
        conditions: 0,
        neighbors: 0.0,
        miss: 0.0,
        condition: 0.0,
        residual: 0.0,
        rungs: [0; 5],
        refusal: None,
    };
    let mut scratch = dcpse.scratch()?;
    let mut row = Stencil::default();
    for p in 0..particles.len() {
        neighbors.gather(p, neighbors.cutoff(p), &mut row);
        line.neighbors += row.len() as f64 / particles.len() as f64;
        let (mut w, mut diagonal) = (vec![[0.0; K]; row.len()], [0.0; K]);
        match dcpse.weights(&row, &mut scratch, &mut w, &mut diagonal) {
            Ok(()) => {
                let report = dcpse.report(&row, &scratch, &w, &diagonal)?;
                line.accept(&report);
                line.miss = line.miss.max(miss(operator_name, &row, &w));
            }
            Err(error) => line.refuse(error.at(p)),
        }
    }
    Ok(line)
}

/// The row applied to |x - x_p|^2 + r_c sum_i (x - x_p)_i, of which the Laplacian is 2 D and the gradient
/// (r_c, .., r_c), against that.
fn miss<const D: usize, const K: usize>(operator: &str, row: &Stencil<D>, w: &[[f64; K]]) -> f64 {
    let rc = row.cutoff();
    // f_p = 0, so that only the neighbors enter.
    let f = |z: &[f64; D]| z.iter().map(|z| z * z - rc * z).sum::<f64>();
    let exact = if operator == "laplacian" { 2.0 * D as f64 } else { rc };
    let value = |k: usize| row.separations().iter().zip(w).map(|(z, w)| w[k] * f(z)).sum::<f64>();
    (0..K).map(|k| (value(k) - exact).abs() / exact).fold(0.0, f64::max)
}

impl Line {
    fn accept(&mut self, report: &RowReport) {
        self.accepted += 1;
        self.conditions = report.conditions;
        self.condition = self.condition.max(report.condition);
        self.residual = self.residual.max(report.residual);
        if let Some(rung) = report.rung {
            self.rungs[rung as usize] += 1;
        }
    }

    fn refuse(&mut self, error: parops::Error) {
        match *error.kind() {
            ErrorKind::Operator(
                OperatorError::Uncertified { rank, conditions, .. } | OperatorError::Singular { rank, conditions, .. },
            ) => {
                self.conditions = conditions;
                if rank < conditions { self.singular += 1 } else { self.other += 1 }
            }
            ErrorKind::Operator(OperatorError::TooFew { conditions, .. }) => {
                self.conditions = conditions;
                self.too_few += 1;
            }
            _ => self.other += 1,
        }
        self.refusal.get_or_insert(error);
    }

    pub fn rows(&self) -> usize {
        self.accepted + self.refused()
    }

    pub fn refused(&self) -> usize {
        self.singular + self.too_few + self.other
    }

    pub fn row(&self) -> String {
        let Self { dim, operator, name, accepted, singular, too_few, other, miss, .. } = self;
        let first = self.refusal.as_ref().map_or(String::new(), |error| format!("; first: {error}"));
        format!(
            "{dim:>3} degenerate {operator:>11}  2 {name}: {accepted} rows accepted (error {miss:.0e}), refused {singular} \
             for rank, {too_few} for neighbors, {other} for residual{first}"
        )
    }

    /// Errors and times have no meaning here; the last field tells rows accepted and refused.
    pub fn csv(&self) -> String {
        let Self { dim, operator, conditions, neighbors, condition, residual, .. } = self;
        let certificate = if self.accepted > 0 { format!("{condition:e},{residual:e}") } else { String::from(",") };
        format!(
            "{dim},degenerate,{operator},2,{},{conditions},{neighbors:.2},,,,,,{certificate},{} accepted:{} refused:{}",
            self.rows(),
            self.name,
            self.accepted,
            self.refused()
        )
    }
}
