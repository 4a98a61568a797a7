//! Super time stepping: many cheap stages for one long step of diffusion.

use super::limit::StepLimit;
use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, scratch};
use crate::error::{Result, TimeError};

/// The fewest stages; with one there is no second order.
const FEWEST: u32 = 2;

/// The most stages of one substep: a step of 2 10^9 / lambda_max.
const MOST: u32 = 65_536;

/// The most stages of one substep for rows that are not symmetric.
const MOST_GENERAL: u32 = 40;

/// What is known of the rows of an operator, and with it of how far its eigenvalues lie from the real axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowSymmetry {
    /// Symmetric, or similar to symmetric: V_p w_pq = V_q w_qp, as in [`Pse`](crate::Pse) with one epsilon. All
    /// eigenvalues are real.
    Symmetric,
    /// Neither, as in [`DcPse`](crate::DcPse): imaginary parts of a few percent of the real ones are expected.
    General,
}

/// Runge-Kutta-Legendre super time stepping of order 2: s stages reach as far as (s^2 + s - 2)/4 steps of explicit Euler.
///
/// With h the length of a substep, Y_0 = u, Y_1 = Y_0 + mu'_1 h f(t, Y_0) and, for j = 2 to s,
/// Y_j = mu_j Y_(j-1) + nu_j Y_(j-2) + (1 - mu_j - nu_j) Y_0 + mu'_j h f(t_(j-1), Y_(j-1)) + gamma'_j h f(t, Y_0), where
/// b_j = (j^2 + j - 2)/(2 j (j + 1)), b_0 = b_1 = 1/3, w = 4/(s^2 + s - 2), mu_j = (2 j - 1)/j b_j/b_(j-1),
/// nu_j = -(j - 1)/j b_j/b_(j-2), mu'_1 = b_1 w, mu'_j = mu_j w, gamma'_j = -(1 - b_(j-1)) mu'_j,
/// t_1 = t + h w/3 and t_j = t + h (j^2 + j - 2)/(s^2 + s - 2). So u' = lambda u is multiplied by
/// 1 - b_s + b_s P_s(1 + w lambda h), P_s the Legendre polynomial. The sums are taken over Y_j - Y_0: a state at rest
/// keeps its bits.
///
/// **For eigenvalues near the negative real axis only.** They stay bounded for lambda h in [-(s^2 + s - 2)/2, 0], a little
/// farther for odd s (16 % for 3, 0.5 % for 15), and nowhere on the imaginary axis. Beside the real axis the region of
/// stability is waisted, wherever |P_s| has an extremum, and narrows to a point at the far end where s is even. For
/// |Re lambda| h up to 2/3 of the interval |Im lambda| <= kappa |Re lambda| is stable, with kappa s between 1.4 and 2.6 for
/// s = 2 and 4 to 60, 1.03 for s = 3 (kappa = 4.9 % at 40 stages); up to 0.9 of the interval kappa s falls to 0.5.
/// Row sums overestimate |lambda| by 1.5 to 2.2, so with them as the bound and at most 40 stages rows of
/// [`DcPse`](crate::DcPse) are inside. Longer steps of such rows take several substeps; no damping is needed.
///
/// `s n` evaluations a step of n substeps, five states of working memory, six with substeps. Rounding grows with s like
/// that of a single step: by less than 100 eps in 1000 stages.
///
/// ```
/// use parops::{Plan, Rkl2, StepLimit, RowSymmetry, integrate};
/// // 1000 explicit Euler steps, in one step of 63 stages.
/// let limit = StepLimit::from_spectral_bound(2000.0, 1.0)?;
/// let mut rkl2 = Rkl2::for_decay(&limit, 1.0, RowSymmetry::Symmetric)?;
/// assert_eq!((rkl2.stages(), rkl2.substeps()), (63, 1));
/// let mut u = [1.0, 1.0];
/// let decay = |_: f64, u: &[f64; 2], du: &mut [f64; 2]| {
///     *du = [-0.1 * u[0], -2000.0 * u[1]];
///     Ok(())
/// };
/// integrate(&mut rkl2, &mut u, &Plan::new(0.0, 1.0, 1.0)?.limit(limit), decay, |_, _, _| {})?;
/// assert!((u[0] - (-0.1_f64).exp()).abs() < 1e-4 && u[1].abs() < 1.0);
/// # parops::Result::Ok(())
/// ```
///
/// Source: C. D. Meyer, D. S. Balsara, T. D. Aslam, J. Comput. Phys. 257 (2014), eq. 16 to 20; the time of stage 1 is that
/// at which Y_1 is accurate; substeps are ours.
/// See also: [`Implicit`](crate::Implicit), where the number of stages would exceed the iterations of a solve.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Rkl2<S> {
    stages: u32,
    substeps: u32,
    /// The state a substep starts from.
    #[cfg_attr(feature = "serde", serde(skip))]
    start: Option<S>,
    #[cfg_attr(feature = "serde", serde(skip))]
    work: Work<S>,
}

#[derive(Clone, Debug)]
struct Work<S> {
    /// f(t, Y_0).
    first: Option<S>,
    rate: Option<S>,
    /// (Y_j - Y_0) / c_j of the last even and the last odd stage.
    moved: [Option<S>; 2],
    stage: Option<S>,
}

impl<S> Default for Work<S> {
    fn default() -> Self {
        Self { first: None, rate: None, moved: [None, None], stage: None }
    }
}

impl<S> Rkl2<S> {
    /// The scheme with this number of stages s and one substep.
    ///
    /// # Errors
    /// [`TimeError::Stages`] where s is not in 2 to 65536.
    pub fn new(stages: u32) -> Result<Self> {
        if !(FEWEST..=MOST).contains(&stages) {
            return Err(TimeError::Stages { stages, low: FEWEST, high: MOST }.into());
        }
        Ok(Self { stages, substeps: 1, start: None, work: Work::default() })
    }

    /// The fewest substeps, and then the fewest stages, with which a step of `dt` keeps `limit`: stages of any number for
    /// symmetric rows, at most 40 for others. The interval counted on is (s^2 + s - 2)/2 for odd s too.
    ///
    /// The decay rate of `limit` must be a bound on |lambda|, that of the row sums where the rows are not symmetric.
    ///
    /// # Errors
    /// [`TimeError::Step`] where dt is not positive and finite; [`TimeError::Limit`] where it is above a largest step that
    /// `limit` sets to every stepper, or above what 2^32 - 1 substeps reach.
    pub fn for_decay(limit: &StepLimit, dt: f64, symmetry: RowSymmetry) -> Result<Self> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let most = most_stages(symmetry);
        let reaches = |stages: u32, substeps: u32| dt <= limit.step_of_interval(f64::from(substeps) * interval(stages));
        if !reaches(most, u32::MAX) {
            let limit = limit.step_of_interval(f64::from(u32::MAX) * interval(most));
            return Err(TimeError::Limit { dt, limit }.into());
        }
        let substeps = least(1, u32::MAX, |substeps| reaches(most, substeps));
        let stages = least(FEWEST, most, |stages| reaches(stages, substeps));
        Ok(Self::new(stages)?.with_substeps(substeps))
    }

    /// The same stages, `substeps` (at least 1) times a step, each over the same part of dt.
    #[must_use]
    pub fn with_substeps(self, substeps: u32) -> Self {
        Self { substeps: substeps.max(1), ..self }
    }

    /// Stages s of a substep.
    pub fn stages(&self) -> u32 {
        self.stages
    }

    /// Substeps of a step.
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// Evaluations of the right-hand side in a step.
    pub fn evaluations(&self) -> u64 {
        u64::from(self.stages) * u64::from(self.substeps)
    }

    /// Refuses more stages than suit the rows: any number for symmetric ones, 40 for others.
    ///
    /// # Errors
    /// [`TimeError::Stages`].
    pub fn check_rows(&self, symmetry: RowSymmetry) -> Result<()> {
        let (stages, low, high) = (self.stages, FEWEST, most_stages(symmetry));
        if stages <= high { Ok(()) } else { Err(TimeError::Stages { stages, low, high }.into()) }
    }
}

fn most_stages(symmetry: RowSymmetry) -> u32 {
    match symmetry {
        RowSymmetry::Symmetric => MOST,
        RowSymmetry::General => MOST_GENERAL,
    }
}

/// The smallest number in low to high for which `holds`, which does for `high` and, once it does, for all above.
fn least(low: u32, high: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (low, high);
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

/// The negative real interval 2/w all stage numbers have: P_s stays within [-1, 1] on it.
fn interval(stages: u32) -> f64 {
    let s = f64::from(stages);
    (s * s + s - 2.0) / 2.0
}

/// b_j.
fn b(j: u32) -> f64 {
    let j = f64::from(j.max(2));
    (j * j + j - 2.0) / (2.0 * j * (j + 1.0))
}

/// 1 - b_s + b_s P_s(x).
fn amplification(s: u32, x: f64) -> f64 {
    let (mut before, mut last) = (1.0, x);
    for j in 2..=s {
        let j = f64::from(j);
        (before, last) = (last, ((2.0 * j - 1.0) * x * last - (j - 1.0) * before) / j);
    }
    1.0 - b(s) + b(s) * last
}

impl<S: State> Stepper<S> for Rkl2<S> {
    fn order(&self) -> u32 {
        2
    }

    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        self.check_rows(symmetry)
    }

    fn negative_real_interval(&self) -> f64 {
        let s = self.stages;
        // P_s(-1) is 1 for even s; for odd s it is -1, and the factor reaches -1 a little beyond.
        let (mut inside, mut outside) = (-1.0, if s.is_multiple_of(2) { -1.0 } else { -2.0 });
        loop {
            let middle = (inside + outside) / 2.0;
            if middle == inside || middle == outside {
                break;
            }
            if amplification(s, middle) >= -1.0 { inside = middle } else { outside = middle }
        }
        f64::from(self.substeps) * interval(s) * (1.0 - inside) / 2.0
    }

    fn imaginary_interval(&self) -> f64 {
        0.0
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        let h = dt / f64::from(self.substeps);
        check_step(t, dt)?;
        check_step(t, h)?;
        check_finite(u, 1, t)?;
        for substep in 0..self.substeps {
            let from = if substep == 0 { &*u } else { scratch(&mut self.start, u) };
            let begin = t + f64::from(substep) * h;
            let before = substep as usize * self.stages as usize;
            let end = self.work.substep(self.stages, before, begin, h, from, rhs)?;
            check_finite(end, before + self.stages as usize + 1, begin + h)?;
            if substep + 1 < self.substeps {
                std::mem::swap(scratch(&mut self.start, u), end);
            } else {
                std::mem::swap(u, end);
            }
        }
        Ok(())
    }
}

impl<S: State> Work<S> {
    /// The state a substep of length h from `u` leads to; its stages are counted on from `before`.
    fn substep(&mut self, s: u32, before: usize, t: f64, h: f64, u: &S, rhs: &mut Rhs<'_, S>) -> Result<&mut S> {
        let (first, rate, stage) =
            (scratch(&mut self.first, u), scratch(&mut self.rate, u), scratch(&mut self.stage, u));
        let [even, odd] = &mut self.moved;
        let (mut older, mut newer) = (scratch(even, u), scratch(odd, u));
        let w = 2.0 / interval(s);

        evaluate(rhs, before + 1, t, u, first)?;
        // Y_j - Y_0 = c_j E_j with c_j = nu_j c_(j-2), so that E_j takes the place of E_(j-2).
        let mut c = [1.0, 1.0];
        for part in [&mut *older, &mut *newer] {
            part.set_sum(u, -1.0, u);
        }
        newer.add_scaled(b(1) * w * h, first);
        stage.set_sum(u, 1.0, newer);
        for j in 2..=s {
            let (x, y) = (f64::from(j), f64::from(j - 1));
            // The time at which Y_(j-1) is accurate.
            let time = t + h * w * if j == 2 { b(1) } else { (y * y + y - 2.0) / 4.0 };
            evaluate(rhs, before + j as usize, time, stage, rate)?;
            let mu = (2.0 * x - 1.0) / x * b(j) / b(j - 1);
            let nu = (1.0 - x) / x * b(j) / b(j - 2);
            let next = nu * c[0];
            older.add_scaled(mu * c[1] / next, newer);
            // Of opposite signs, and the larger one last, so that less overflows on the way.
            older.add_scaled((b(j - 1) - 1.0) * mu * w * h / next, first);
            older.add_scaled(mu * w * h / next, rate);
            stage.set_sum(u, next, older);
            c = [c[1], next];
            std::mem::swap(&mut older, &mut newer);
        }
        Ok(stage)
    }
}
