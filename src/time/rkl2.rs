//! Super time stepping: many cheap stages for one long step of diffusion.

use std::f64::consts::PI;

use nalgebra::Complex;

use super::limit::StepLimit;
use super::state::State;
use super::stepper::{Rhs, Stepper, check_finite, check_step, evaluate, scratch};
use crate::error::{Result, TimeError};

/// The fewest stages; with one there is no second order.
const FEWEST: u32 = 2;

/// The most stages of one substep: a step of 2 10^9 / lambda_max.
const MOST: u32 = 65_536;

/// The slopes |Im lambda| / |Re lambda| that can be counted on; below, finding the interval takes long, and above,
/// explicit Euler takes fewer stages.
const SLOPES: [f64; 2] = [0.02, 0.5];

/// The slope counted on where rows are not symmetric and nothing else is known of them.
const GENERAL: f64 = 0.2;

/// What is known of the rows of an operator, and with it of how far its eigenvalues lie from the real axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowSymmetry {
    /// Symmetric, or similar to symmetric: V_p w_pq = V_q w_qp, as in [`Pse`](crate::Pse) with one epsilon. All
    /// eigenvalues are real.
    Symmetric,
    /// Neither, as in [`DcPse`](crate::DcPse): |Im lambda| <= 0.2 |Re lambda| is counted on.
    General,
}

impl RowSymmetry {
    /// The slope |Im lambda| / |Re lambda| counted on: 0 or 0.2.
    pub fn slope(self) -> f64 {
        match self {
            Self::Symmetric => 0.0,
            Self::General => GENERAL,
        }
    }
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
/// **For eigenvalues near the negative real axis only**, and nowhere on the imaginary axis. Real ones stay bounded for
/// lambda h in [-(s^2 + s - 2)/2, 0], a little farther for odd s (16 % for 3, 0.5 % for 15). Beside the axis the region of
/// stability is waisted wherever P_s has a maximum, and narrows to a point at the far end where s is even. For eigenvalues
/// in the wedge |Im lambda| <= kappa |Re lambda| ([`with_slope`](Self::with_slope)) the interval therefore ends earlier,
/// and beyond some 3.2/kappa stages the waists leave hardly more:
///
/// | slope kappa | most stages | interval | a stage |
/// |---|---|---|---|
/// | 0 | any | (s^2 + s - 2)/2 | s/2 |
/// | 0.05 | 64 | 1023 | 16 |
/// | 0.1 | 32 | 209 | 6.6 |
/// | 0.2 | 16 | 60 | 3.8 |
/// | 0.4 | 8 | 13.4 | 1.7 |
///
/// A stage of explicit Euler reaches 2. Where rows are not symmetric 0.2 is counted on unless a slope is given. Laplacians of
/// [`DcPse`](crate::DcPse) with 2 l neighbors have slopes up to 0.026, 0.030, 0.07 and 0.15 on sets jittered by 0.1, 0.2,
/// 0.3 and 0.45 h (order 2, all eigenvalues of 100 to 1000 sets of up to 196 particles each), 0.043, 0.044, 0.07 and 0.18
/// beside walls, 0.05 at order 4. Modes of worse rows grow: give their slope.
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
/// at which Y_1 is accurate; substeps and slopes are ours.
/// See also: [`Implicit`](crate::Implicit), where the number of stages would exceed the iterations of a solve.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Rkl2<S> {
    stages: u32,
    substeps: u32,
    slope: f64,
    /// The negative real interval of a substep, for this slope.
    interval: f64,
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
    /// The scheme with this number of stages s and one substep, for real eigenvalues.
    ///
    /// # Errors
    /// [`TimeError::Stages`] where s is not in 2 to 65536.
    pub fn new(stages: u32) -> Result<Self> {
        if !(FEWEST..=MOST).contains(&stages) {
            return Err(TimeError::Stages { stages, low: FEWEST, high: MOST }.into());
        }
        let interval = sharp_interval(stages);
        Ok(Self { stages, substeps: 1, slope: 0.0, interval, start: None, work: Work::default() })
    }

    /// The fewest substeps, and then the fewest stages, with which a step of `dt` keeps `limit`: stages of any number for
    /// symmetric rows, at most 16 for others, as [`for_slope`](Self::for_slope) of 0.2 has them.
    ///
    /// The decay rate of `limit` must be a bound on |lambda|. The interval counted on is (s^2 + s - 2)/2 for odd s too.
    ///
    /// # Errors
    /// [`TimeError::Step`] where dt is not positive and finite; [`TimeError::Limit`] where it is above a largest step that
    /// `limit` sets to every stepper, or above what 2^32 - 1 substeps reach.
    pub fn for_decay(limit: &StepLimit, dt: f64, symmetry: RowSymmetry) -> Result<Self> {
        match symmetry {
            RowSymmetry::Symmetric => Self::fewest(limit, dt, 0.0, MOST),
            RowSymmetry::General => Self::for_slope(limit, dt, GENERAL),
        }
    }

    /// The same for eigenvalues with |Im lambda| <= `slope` |Re lambda|, and at most 3.2/slope stages.
    ///
    /// # Errors
    /// Those of [`for_decay`](Self::for_decay) and of [`with_slope`](Self::with_slope).
    pub fn for_slope(limit: &StepLimit, dt: f64, slope: f64) -> Result<Self> {
        check_slope(slope)?;
        Self::fewest(limit, dt, slope, (3.2 / slope) as u32)?.with_slope(slope)
    }

    /// With at most `most` stages.
    fn fewest(limit: &StepLimit, dt: f64, slope: f64, most: u32) -> Result<Self> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        let reaches = |interval: f64, substeps: u32| dt <= limit.step_of_interval(f64::from(substeps) * interval);
        let longest = wedge_interval(most, slope);
        if !reaches(longest, u32::MAX) {
            let limit = limit.step_of_interval(f64::from(u32::MAX) * longest);
            return Err(TimeError::Limit { dt, limit }.into());
        }
        let substeps = least(1, u32::MAX, |substeps| reaches(longest, substeps));
        let stages = least(FEWEST, most, |stages| reaches(wedge_interval(stages, slope), substeps));
        Ok(Self::new(stages)?.with_substeps(substeps))
    }

    /// The same stages for eigenvalues with |Im lambda| <= `slope` |Re lambda|: the interval ends where the wedge leaves
    /// the region of stability.
    ///
    /// # Errors
    /// [`TimeError::Slope`] where it is not in 0.02 to 0.5.
    pub fn with_slope(self, slope: f64) -> Result<Self> {
        check_slope(slope)?;
        Ok(Self { slope, interval: wedge_interval(self.stages, slope), ..self })
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

    /// The slope |Im lambda| / |Re lambda| counted on; 0 for real eigenvalues.
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// Refuses rows that are not symmetric where no slope is counted on. One that was given is taken for known.
    ///
    /// # Errors
    /// [`TimeError::Slope`].
    pub fn check_rows(&self, symmetry: RowSymmetry) -> Result<()> {
        if symmetry == RowSymmetry::General { check_slope(self.slope) } else { Ok(()) }
    }
}

fn check_slope(slope: f64) -> Result<()> {
    let [low, high] = SLOPES;
    if (low..=high).contains(&slope) { Ok(()) } else { Err(TimeError::Slope { slope, low, high }.into()) }
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
fn amplification(s: u32, x: Complex<f64>) -> Complex<f64> {
    let (mut before, mut last) = (Complex::new(1.0, 0.0), x);
    for j in 2..=s {
        let j = f64::from(j);
        (before, last) = (last, (x * last * (2.0 * j - 1.0) - before * (j - 1.0)) / j);
    }
    last * b(s) + (1.0 - b(s))
}

/// The negative real interval, to its last bit.
fn sharp_interval(s: u32) -> f64 {
    // P_s(-1) is 1 for even s; for odd s it is -1, and the factor reaches -1 a little beyond.
    let (mut inside, mut outside) = (-1.0, if s.is_multiple_of(2) { -1.0 } else { -2.0 });
    loop {
        let middle = (inside + outside) / 2.0;
        if middle == inside || middle == outside {
            break;
        }
        if amplification(s, Complex::new(middle, 0.0)).re >= -1.0 { inside = middle } else { outside = middle }
    }
    interval(s) * (1.0 - inside) / 2.0
}

/// Points between two neighboring extrema of P_s.
const FINENESS: u32 = 32;

/// Between the points a maximum of the factor exceeds theirs by less than (pi/64)^2/4; a hundredth more of slope raises
/// what grows there by some 0.01.
const WIDER: f64 = 1.01;

/// What is left of [`interval`] where eigenvalues may lie beside the axis by this slope: the part of the ray
/// (-1 + i slope) x from 0 with factors of at most 1. What the ray and the end of the wedge enclose is then stable by the
/// maximum principle.
fn wedge_interval(s: u32, slope: f64) -> f64 {
    let whole = interval(s);
    if slope == 0.0 {
        return whole;
    }
    let points = FINENESS * s;
    let at = |i: u32| (1.0 - (PI * f64::from(i) / f64::from(points)).cos()) / 2.0;
    let is_stable =
        |part: f64| amplification(s, Complex::new(1.0 - 2.0 * part, 2.0 * WIDER * slope * part)).norm() <= 1.0;
    let inside = (1..=points).take_while(|&i| is_stable(at(i))).last().unwrap_or(0);
    whole * at(inside)
}

impl<S: State> Stepper<S> for Rkl2<S> {
    fn order(&self) -> u32 {
        2
    }

    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        self.check_rows(symmetry)
    }

    fn negative_real_interval(&self) -> f64 {
        f64::from(self.substeps) * self.interval
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
