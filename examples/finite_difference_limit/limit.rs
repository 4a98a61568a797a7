//! The rows on a lattice of spacing 1, and the finite differences they tend to.

use parops::{
    BruteForce, Cutoff, D1, D2, DcPse, Domain, Epsilon, ErrorKind, Laplacian, LatticeHat, Method, Neighbors, Operator,
    OperatorError, Particles, Pse, RowReport, Stencil, Volumes,
};

/// One stencil and operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Case {
    /// d/dx of order 2 with cutoff h.
    FirstSecond,
    /// d/dx of order 4 with cutoff 2 h: the fewest nodes that can work (errata 25).
    FirstFourth,
    /// d/dx of order 4 with cutoff h, where 5.54 has no solution.
    FirstFourthNear,
    /// d/dx of order 2 on the block of 3 x 3.
    PlaneFirst,
    /// The Laplacian of order 2 on the block of 3 x 3: rank 7 of 9 (errata 21).
    LaplacianBlock,
    /// The Laplacian of order 2 on the shells |k|^2 <= 4: rank 9.
    LaplacianShells,
    /// PSE with the lattice hat kernel, which takes c = 1 only (000, eq. 27 to 31).
    HatLine,
    /// The same in two dimensions.
    HatPlane,
    /// The same in three dimensions.
    HatSpace,
}

/// What became of the row.
pub enum Outcome {
    /// Weights, and what the certificate says.
    Accepted {
        /// The largest distance of a weight from the finite difference.
        miss: f64,
        /// The largest distance of a weight from the closed form of eq. 5.51 at this c, where it applies.
        from_closed_form: Option<f64>,
        report: RowReport,
    },
    /// The error in place of weights.
    Refused(parops::Error),
}

impl Outcome {
    pub fn miss(&self) -> Option<f64> {
        if let Self::Accepted { miss, .. } = self { Some(*miss) } else { None }
    }

    pub fn condition(&self) -> Option<f64> {
        if let Self::Accepted { report, .. } = self { Some(report.condition) } else { None }
    }
}

pub struct Record {
    pub case: Case,
    pub c: f64,
    /// Number of neighbors and cutoff/epsilon.
    pub neighbors: usize,
    pub cutoff_over_epsilon: f64,
    pub outcome: Outcome,
}

impl Case {
    pub const ALL: [Self; 9] = [
        Self::FirstSecond,
        Self::FirstFourth,
        Self::FirstFourthNear,
        Self::PlaneFirst,
        Self::LaplacianBlock,
        Self::LaplacianShells,
        Self::HatLine,
        Self::HatPlane,
        Self::HatSpace,
    ];
    pub const HATS: [Self; 3] = [Self::HatLine, Self::HatPlane, Self::HatSpace];

    pub fn name(self) -> &'static str {
        match self {
            Self::FirstSecond => "d/dx r=2 rc=h",
            Self::FirstFourth => "d/dx r=4 rc=2h",
            Self::FirstFourthNear => "d/dx r=4 rc=h",
            Self::PlaneFirst => "2D d/dx r=2 3x3",
            Self::LaplacianBlock => "2D lap r=2 3x3",
            Self::LaplacianShells => "2D lap r=2 13 points",
            Self::HatLine => "PSE hat 1D lap",
            Self::HatPlane => "PSE hat 2D lap",
            Self::HatSpace => "PSE hat 3D lap",
        }
    }

    /// Cutoff in units of h.
    fn cutoff(self) -> f64 {
        match self {
            Self::FirstSecond | Self::FirstFourthNear => 1.0,
            Self::HatLine | Self::HatPlane | Self::HatSpace => 1.25,
            Self::FirstFourth | Self::LaplacianShells => 2.0,
            Self::PlaneFirst | Self::LaplacianBlock => 1.5,
        }
    }

    /// The finite difference, eq. 5.52 to 5.54: the weight of the node k from the target, in units of h^-m.
    fn difference(self, k: &[f64]) -> f64 {
        let off_axis = k.iter().skip(1).any(|&k| k != 0.0);
        match (self, k[0] as i32) {
            (Self::LaplacianBlock | Self::LaplacianShells | Self::HatLine | Self::HatPlane | Self::HatSpace, _) => {
                if k.iter().map(|k| k * k).sum::<f64>() == 1.0 { 1.0 } else { 0.0 }
            }
            (_, _) if off_axis => 0.0,
            (Self::FirstFourth | Self::FirstFourthNear, 2) => -1.0 / 12.0,
            (Self::FirstFourth | Self::FirstFourthNear, 1) => 2.0 / 3.0,
            (Self::FirstFourth | Self::FirstFourthNear, -1) => -2.0 / 3.0,
            (Self::FirstFourth | Self::FirstFourthNear, -2) => 1.0 / 12.0,
            (_, k) => 0.5 * f64::from(k),
        }
    }

    /// Eq. 5.51 before the limit, k_1 exp(-c^2 |k|^2) / sum_l l_1^2 exp(-c^2 |l|^2), for first derivatives of order 2.
    fn closed_form<const D: usize>(self, c: f64, nodes: &[[f64; D]]) -> Option<Vec<f64>> {
        if !matches!(self, Self::FirstSecond | Self::PlaneFirst) {
            return None;
        }
        let window = |k: &[f64; D]| (-c * c * k.iter().map(|k| k * k).sum::<f64>()).exp();
        let sum: f64 = nodes.iter().map(|k| k[0] * k[0] * window(k)).sum();
        Some(nodes.iter().map(|k| k[0] * window(k) / sum).collect())
    }

    /// Whether the case is defined at this c.
    pub fn takes(self, c: f64) -> bool {
        !Self::HATS.contains(&self) || c == 1.0
    }

    pub fn run(self, c: f64) -> parops::Result<Record> {
        match self {
            Self::FirstSecond => self.corrected(DcPse::<D1<1>, 2>::new(), c),
            Self::FirstFourth | Self::FirstFourthNear => self.corrected(DcPse::<D1<1>, 4>::new(), c),
            Self::PlaneFirst => self.corrected(DcPse::<D2<1, 0>, 2>::new(), c),
            Self::LaplacianBlock | Self::LaplacianShells => self.corrected(DcPse::<Laplacian<2>, 2>::new(), c),
            Self::HatLine => self.hat::<1>(c),
            Self::HatPlane => self.hat::<2>(c),
            Self::HatSpace => self.hat::<3>(c),
        }
    }

    fn corrected<Op, const R: u32, const D: usize>(self, dcpse: DcPse<Op, R>, c: f64) -> parops::Result<Record>
    where
        Op: Operator<D, Out = [f64; 1]>,
    {
        self.row(&dcpse.epsilon(Epsilon::global(1.0 / c)?).neighbors_per_condition(1.0)?, c)
    }

    fn hat<const D: usize>(self, c: f64) -> parops::Result<Record> {
        let volumes = Volumes::equal(1.0)?;
        self.row(&Pse::<_, 1>::with_kernels([LatticeHat::<D>::new()], Epsilon::global(1.0 / c)?, &volumes)?, c)
    }

    /// The row of the middle particle of a lattice.
    fn row<M: Method<D, Out = [f64; 1]>, const D: usize>(self, method: &M, c: f64) -> parops::Result<Record> {
        let lattice = Particles::lattice([-3.5; D], [3.5; D], [7; D])?;
        let neighbors = BruteForce::build(&lattice, &Domain::open(), Cutoff(self.cutoff()))?;
        let mut row = Stencil::default();
        neighbors.gather(lattice.len() / 2, self.cutoff(), &mut row);
        // x_p - x_q points from the neighbor to the target.
        let nodes: Vec<[f64; D]> = row.separations().iter().map(|z| z.map(|z| -z)).collect();

        let mut scratch = method.scratch()?;
        let (mut w, mut diagonal) = (vec![[0.0]; row.len()], [0.0]);
        let outcome = match method.weights(&row, &mut scratch, &mut w, &mut diagonal) {
            Ok(()) => {
                let largest = |miss: &mut dyn Iterator<Item = f64>| miss.fold(0.0, f64::max);
                let miss = largest(&mut nodes.iter().zip(&w).map(|(k, w)| (w[0] - self.difference(k)).abs()));
                let closed = self.closed_form(c, &nodes);
                let from_closed_form =
                    closed.map(|closed| largest(&mut closed.iter().zip(&w).map(|(exact, w)| (w[0] - exact).abs())));
                let report = method.report(&row, &scratch, &w, &diagonal)?;
                Outcome::Accepted { miss, from_closed_form, report }
            }
            Err(error) => Outcome::Refused(error),
        };
        Ok(Record { case: self, c, neighbors: row.len(), cutoff_over_epsilon: self.cutoff() * c, outcome })
    }
}

impl Record {
    pub const HEADER: &str = "case,c,cutoff_over_epsilon,neighbors,outcome,condition,residual,miss";
    pub const TITLE: &str =
        "                case      c  rc/eps   n      outcome       cond   residual       miss  what the library says";

    fn outcome(&self) -> String {
        match &self.outcome {
            Outcome::Accepted { report, .. } => report.rung.map_or("accepted".into(), |rung| format!("{rung:?}")),
            Outcome::Refused(error) => match error.kind() {
                ErrorKind::Operator(OperatorError::Window { .. }) => "Window".into(),
                ErrorKind::Operator(OperatorError::TooFew { .. }) => "TooFew".into(),
                ErrorKind::Operator(OperatorError::Singular { .. }) => "Singular".into(),
                ErrorKind::Operator(OperatorError::Uncertified { .. }) => "Uncertified".into(),
                _ => "refused".into(),
            },
        }
    }

    pub fn row(&self) -> String {
        let Self { case, c, neighbors, cutoff_over_epsilon, .. } = self;
        let head =
            format!("{:>20} {c:>6.3} {cutoff_over_epsilon:>7.3} {neighbors:>3} {:>12}", case.name(), self.outcome());
        match &self.outcome {
            Outcome::Accepted { miss, report, .. } => {
                let (condition, residual) = (report.condition, report.residual);
                let said = match report.conditions {
                    0 => format!("moments miss by {:.0e}", report.moment_defect),
                    conditions => format!("rank {} of {conditions}", report.rank),
                };
                format!("{head} {condition:>10.2e} {residual:>10.2e} {miss:>10.2e}  {said}")
            }
            Outcome::Refused(error) => format!("{head} {:>10} {:>10} {:>10}  {error}", "-", "-", "-"),
        }
    }

    pub fn csv(&self) -> String {
        let Self { case, c, neighbors, cutoff_over_epsilon, .. } = self;
        let head = format!("{},{c},{cutoff_over_epsilon},{neighbors},{}", case.name(), self.outcome());
        match &self.outcome {
            Outcome::Accepted { miss, report, .. } => {
                format!("{head},{:e},{:e},{miss:e}", report.condition, report.residual)
            }
            Outcome::Refused(_) => format!("{head},,,"),
        }
    }
}
