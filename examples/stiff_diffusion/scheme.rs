//! The schemes, and a run of one of them.

use std::time::Instant;

use parops::{
    ErrorKind, Euler, ImplicitScheme, Limit, Method, Result, Rk4, Rkl2, RowSymmetry, SolverError, SspRk3, StepLimit,
    Stepper, TimeScheme,
};

use crate::setting::{Physics, Setting};

type Field = Vec<f64>;

/// How far eigenvalues lie beside the real axis at most, |Im| over |Re|, counted on for RKL2 where rows are not symmetric.
/// The scattered sets here have 0.0008 to 0.0015 (all eigenvalues, sides 12 to 26), 50 others of side 12 at most 0.003.
const SLOPE: f64 = 0.05;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    Euler,
    SspRk3,
    Rk4,
    Rkl2,
    ImplicitEulerLu,
    ImplicitEulerBiCgStab,
    CrankNicolsonLu,
    CrankNicolsonBiCgStab,
}

pub const EXPLICIT: [Scheme; 3] = [Scheme::Euler, Scheme::SspRk3, Scheme::Rk4];
pub const STIFF: [Scheme; 5] = [
    Scheme::Rkl2,
    Scheme::ImplicitEulerLu,
    Scheme::ImplicitEulerBiCgStab,
    Scheme::CrankNicolsonLu,
    Scheme::CrankNicolsonBiCgStab,
];

impl Scheme {
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::SspRk3 => "SSP-RK3",
            Self::Rk4 => "RK4",
            Self::Rkl2 => "RKL2",
            Self::ImplicitEulerLu => "implicit Euler, LU",
            Self::ImplicitEulerBiCgStab => "implicit Euler, BiCGSTAB",
            Self::CrankNicolsonLu => "Crank-Nicolson, LU",
            Self::CrankNicolsonBiCgStab => "Crank-Nicolson, BiCGSTAB",
        }
    }

    /// Its order in time.
    pub fn order(self) -> f64 {
        match self {
            Self::Euler | Self::ImplicitEulerLu | Self::ImplicitEulerBiCgStab => 1.0,
            Self::Rkl2 | Self::CrankNicolsonLu | Self::CrankNicolsonBiCgStab => 2.0,
            Self::SspRk3 => 3.0,
            Self::Rk4 => 4.0,
        }
    }

    /// The scheme, where it is implicit.
    pub fn implicit(self) -> Option<ImplicitScheme> {
        match self {
            Self::ImplicitEulerLu => Some(ImplicitScheme::euler().lu_up_to(usize::MAX)),
            Self::ImplicitEulerBiCgStab => Some(ImplicitScheme::euler().lu_up_to(0)),
            Self::CrankNicolsonLu => Some(ImplicitScheme::crank_nicolson().lu_up_to(usize::MAX)),
            Self::CrankNicolsonBiCgStab => Some(ImplicitScheme::crank_nicolson().lu_up_to(0)),
            _ => None,
        }
    }

    /// The stepper for steps of dt, and the right-hand sides it evaluates a step.
    pub fn explicit<M: Method<2, Out = [f64; 1]> + Clone>(
        self,
        setting: &Setting<M>,
        dt: f64,
    ) -> Result<(Box<dyn Stepper<Field>>, u64)> {
        Ok(match self {
            Self::SspRk3 => (Box::new(SspRk3::new()), 3),
            Self::Rk4 => (Box::new(Rk4::new()), 4),
            Self::Rkl2 => {
                let limit = StepLimit::from_spectral_bound(setting.rate, 1.0)?;
                let rkl2 = match setting.symmetry {
                    RowSymmetry::Symmetric => Rkl2::for_decay(&limit, dt, setting.symmetry)?,
                    RowSymmetry::General => Rkl2::for_slope(&limit, dt, SLOPE)?,
                };
                let evaluations = rkl2.evaluations();
                (Box::new(rkl2), evaluations)
            }
            _ => (Box::new(Euler::new()), 1),
        })
    }
}

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Record {
    pub set: &'static str,
    pub scheme: Scheme,
    pub dt: f64,
    /// dt in steps of explicit Euler.
    pub number: f64,
    pub steps: u64,
    pub applies: u64,
    pub seconds: f64,
    /// Against the exact field at the end; NaN for a run to another time.
    pub error: f64,
    /// (max - min) at the end over that at the start.
    pub left: f64,
    /// The limit of the refusal, and what set it.
    pub refused: Option<(f64, Limit)>,
    /// Steps the run would have taken with explicit Euler.
    pub explicit: f64,
}

impl Record {
    pub const HEADER: &'static str =
        "set,scheme,dt,diffusion_number,steps,applies,seconds,error,spread_left,refused_above,binding,explicit_steps";

    pub fn csv(&self) -> String {
        let Self { set, scheme, dt, number, steps, applies, seconds, error, left, refused, explicit } = self;
        let (limit, binding) =
            refused.map_or((String::new(), ""), |(limit, binding)| (format!("{limit:e}"), binding.name()));
        let name = scheme.name().replace(", ", " by ");
        format!(
            "{set},{name},{dt:e},{number:e},{steps},{applies},{seconds:e},{error:e},{left:e},{limit},{binding},{explicit}"
        )
    }

    pub fn row(&self) -> String {
        let Self { set, number, steps, applies, seconds, error, left, explicit, .. } = self;
        let head = format!("{set:<10}{:<25}{number:>10.3e}{explicit:>9.0}", self.scheme.name());
        match self.refused {
            Some((limit, binding)) => format!("{head}   refused above {limit:.2e} by {binding}"),
            None if error.is_nan() => format!("{head}{steps:>8}{applies:>9}{seconds:>11.2e}   left {left:.1e}"),
            None => format!("{head}{steps:>8}{applies:>9}{seconds:>11.2e}{error:>11.2e}"),
        }
    }
}

/// So many equal steps to t = `end`, the fastest of `repeats` runs.
pub fn measure<M: Method<2, Out = [f64; 1]> + Clone>(
    setting: &Setting<M>,
    scheme: Scheme,
    end: f64,
    steps: u64,
    repeats: usize,
) -> Result<Record> {
    let dt = end / steps as f64;
    let run = || match scheme.implicit() {
        // One product for A u, and those of the solve.
        Some(implicit) => timed(setting, implicit, dt, steps, |implicit| implicit.last_solve().iterations as u64 + 1),
        None => {
            let (stepper, evaluations) = scheme.explicit(setting, dt)?;
            timed(setting, stepper, dt, steps, |_| evaluations)
        }
    };
    let mut record = Record {
        set: setting.name,
        scheme,
        dt,
        number: dt / setting.explicit_step(),
        steps,
        applies: 0,
        seconds: f64::INFINITY,
        error: f64::NAN,
        left: f64::NAN,
        refused: None,
        explicit: (end / setting.explicit_step()).ceil(),
    };
    for _ in 0..repeats {
        match run() {
            Ok((u, applies, seconds)) => {
                record.left = spread(&u) / spread(&setting.start);
                record.error = if end == crate::setting::END { setting.error(&u) } else { f64::NAN };
                (record.applies, record.seconds) = (applies, seconds.min(record.seconds));
            }
            Err(error) => match *error.kind() {
                ErrorKind::Solver(SolverError::Limit { limit, binding, .. }) => {
                    (record.refused, record.seconds) = (Some((limit, binding)), f64::NAN);
                    return Ok(record);
                }
                _ => return Err(error),
            },
        }
    }
    Ok(record)
}

fn spread(u: &[f64]) -> f64 {
    let (low, high) = u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(*u), high.max(*u)));
    high - low
}

/// The field, the applies and the seconds of a run; its rows are not among them.
fn timed<M: Method<2, Out = [f64; 1]> + Clone, St: TimeScheme<2, Physics<M>>>(
    setting: &Setting<M>,
    stepper: St,
    dt: f64,
    steps: u64,
    applies: impl Fn(&St) -> u64,
) -> Result<(Field, u64, f64)> {
    let mut run = setting.run(&setting.search()?, stepper)?;
    let (mut u, mut sum) = (setting.start.clone(), 0);
    let clock = Instant::now();
    for _ in 0..steps {
        run.step(&mut u, dt)?;
        sum += applies(run.stepper());
    }
    Ok((u, sum, clock.elapsed().as_secs_f64()))
}
