//! What bounds the next step, term by term.

use crate::error::{Error, Limit, Result, SolverError};
use crate::time::{State, Stepper};

/// How fast the modes of one term decay and oscillate, and the longest step it bears whatever the stepper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rate {
    /// Bound on -Re(lambda), in 1/time.
    pub decay: f64,
    /// Bound on |Im(lambda)|, in 1/time.
    pub oscillation: f64,
    /// Bound on |lambda| of modes left of the imaginary axis, wherever there, in 1/time.
    pub modulus: f64,
    /// One over the longest step that any stepper may take, in 1/time; 0 where there is none.
    pub frequency: f64,
}

/// The half-disc left of the imaginary axis that lies in the stability region, in units of the shorter interval: 0.939 for
/// RK4, 1.001 for SSP-RK3.
const HALF_DISC: f64 = 0.93;

impl Rate {
    const NONE: Self = Self { decay: 0.0, oscillation: 0.0, modulus: 0.0, frequency: 0.0 };

    /// Modes that only decay.
    pub const fn decay(decay: f64) -> Self {
        Self { decay, ..Self::NONE }
    }

    /// Modes that only oscillate.
    pub const fn oscillation(oscillation: f64) -> Self {
        Self { oscillation, ..Self::NONE }
    }

    /// Modes that decay and oscillate in any proportion.
    pub const fn modulus(modulus: f64) -> Self {
        Self { modulus, ..Self::NONE }
    }

    /// A longest step, given as one over it.
    pub const fn frequency(frequency: f64) -> Self {
        Self { frequency, ..Self::NONE }
    }

    /// The largest bound on a modulus.
    pub(super) fn fastest(self) -> f64 {
        self.decay.max(self.oscillation).max(self.modulus)
    }

    /// The largest number in it.
    fn most(self) -> f64 {
        self.fastest().max(self.frequency)
    }

    /// The larger of each.
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        Self {
            decay: larger(self.decay, other.decay),
            oscillation: larger(self.oscillation, other.oscillation),
            modulus: larger(self.modulus, other.modulus),
            frequency: larger(self.frequency, other.frequency),
        }
    }
}

/// The rates of all terms at one moment, from the actual rows.
///
/// With x the negative real and y the imaginary interval of a stepper, modes that decay at up to a = sum_i a_i and
/// oscillate at up to b = sum_i b_i, or lie anywhere to the left within c = sum_i c_i of zero, are stable for
///
/// ```text
/// dt (a/x + b/y + c/(0.93 min(x, y))) <= 1
/// ```
///
/// because the triangle between the ends of both intervals and that half-disc lie in the stability regions of RK4 and
/// SSP-RK3, which are star-shaped.
/// With one term alone that is its own sharp limit; of several, the one with the largest share binds. A term that
/// oscillates has no legal step where y = 0, as for explicit Euler (notes 001, eq. 6.25).
///
/// ```
/// use parops::{Euler, Limit, Limits, Rate, Rk4};
/// let mut limits = Limits::default();
/// limits.add(Limit::Diffusion, Rate::decay(100.0));
/// assert_eq!(limits.step(&Euler::<f64>::new()), 0.02);
/// limits.add(Limit::Advection, Rate::oscillation(400.0));
/// assert_eq!((limits.step(&Euler::<f64>::new()), limits.binding(&Rk4::<f64>::new())), (0.0, Some(Limit::Advection)));
/// ```
///
/// Source: errata 26, 30, 33, 36, 37 and 56.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    rates: [Rate; Limit::ALL.len()],
    /// Who sets them, where that is one particle.
    setters: [Option<usize>; Limit::ALL.len()],
}

impl Limits {
    /// Adds the rate of a term; rates of one kind add up, longest steps do not.
    pub fn add(&mut self, limit: Limit, rate: Rate) {
        let own = &mut self.rates[limit as usize];
        own.decay += rate.decay;
        own.oscillation += rate.oscillation;
        own.modulus += rate.modulus;
        own.frequency = larger(own.frequency, rate.frequency);
    }

    /// The same for a rate that one particle sets; it is named where that rate is the largest of its kind.
    pub fn add_of(&mut self, limit: Limit, rate: Rate, particle: Option<usize>) {
        if rate.most() > self.rate(limit).most() {
            self.setters[limit as usize] = particle;
        }
        self.add(limit, rate);
    }

    /// Puts a rate in the place of what was known, such as a sharp eigenvalue in that of a bound.
    pub fn set(&mut self, limit: Limit, rate: Rate) {
        self.rates[limit as usize] = rate;
        self.setters[limit as usize] = None;
    }

    /// The particle that sets the rate of one kind, where it is known: that of distortion, compression and source.
    pub fn particle(&self, limit: Limit) -> Option<usize> {
        self.setters[limit as usize]
    }

    /// The refusal of a step, naming the particle that sets the limit where it is known.
    pub(super) fn refuse(&self, dt: f64, limit: f64, binding: Option<Limit>) -> Error {
        let binding = binding.unwrap_or(Limit::Diffusion);
        let error = Error::from(SolverError::Limit { dt, limit, binding });
        match self.particle(binding) {
            Some(p) => error.at(p),
            None => error,
        }
    }

    /// The larger rates, kind by kind.
    #[must_use]
    pub fn larger(&self, other: &Self) -> Self {
        let mut all = *self;
        for (i, rate) in other.rates.iter().enumerate() {
            if rate.most() > all.rates[i].most() {
                all.setters[i] = other.setters[i];
            }
            all.rates[i] = all.rates[i].larger(*rate);
        }
        all
    }

    /// The rate of one kind.
    pub fn rate(&self, limit: Limit) -> Rate {
        self.rates[limit as usize]
    }

    /// The longest legal step of a stepper: infinite without a limit, 0 where no step is stable.
    pub fn step<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> f64 {
        self.step_within(of(stepper))
    }

    /// The longest legal step where modes of each kind are stable on these intervals (x, y).
    pub fn step_within(&self, intervals: impl Fn(Limit) -> (f64, f64)) -> f64 {
        let shares = Limit::ALL.iter().fold(0.0, |sum, &limit| sum + share(limit, self.rate(limit), intervals(limit)));
        1.0 / self.rates.iter().fold(shares, |most: f64, rate| most.max(known(rate.frequency)))
    }

    /// The kind with the largest share in the limit; `None` where nothing binds.
    pub fn binding<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> Option<Limit> {
        self.binding_within(of(stepper))
    }

    /// The same where modes of each kind are stable on these intervals (x, y).
    pub fn binding_within(&self, intervals: impl Fn(Limit) -> (f64, f64)) -> Option<Limit> {
        let weigh = |limit: &Limit| {
            let rate = self.rate(*limit);
            share(*limit, rate, intervals(*limit)).max(known(rate.frequency))
        };
        let most = Limit::ALL.into_iter().rev().max_by(|a, b| weigh(a).total_cmp(&weigh(b)))?;
        (weigh(&most) > 0.0).then_some(most)
    }

    /// Refuses a step above the limit.
    ///
    /// # Errors
    /// [`SolverError::Limit`] with the limit and what binds it, naming the particle that sets it where it is known.
    pub fn check<S: State>(&self, dt: f64, stepper: &(impl Stepper<S> + ?Sized)) -> Result<()> {
        let limit = self.step(stepper);
        match self.binding(stepper) {
            Some(binding) if !(dt <= limit) => Err(self.refuse(dt, limit, Some(binding))),
            _ => Ok(()),
        }
    }

    /// How many steps of a stepper a span of time takes at the least; infinite where no step is legal.
    pub fn steps<S: State>(&self, span: f64, stepper: &(impl Stepper<S> + ?Sized)) -> f64 {
        (span / self.step(stepper)).ceil()
    }

    /// Refuses a term that no step of the stepper is stable for.
    ///
    /// # Errors
    /// [`SolverError::Unstable`] naming the term, its rates and the intervals of the stepper.
    pub fn possible<S: State>(&self, stepper: &(impl Stepper<S> + ?Sized)) -> Result<()> {
        self.possible_within(of(stepper))
    }

    /// The same where modes of each kind are stable on these intervals (x, y).
    ///
    /// # Errors
    /// As [`possible`](Self::possible).
    pub fn possible_within(&self, intervals: impl Fn(Limit) -> (f64, f64)) -> Result<()> {
        let impossible = |&limit: &Limit| share(limit, self.rate(limit), intervals(limit)).is_infinite();
        let Some(term) = Limit::ALL.into_iter().find(impossible) else { return Ok(()) };
        let (Rate { decay, oscillation, modulus, .. }, (negative_real, imaginary)) = (self.rate(term), intervals(term));
        let (decay, oscillation) = (decay + modulus, oscillation + modulus);
        Err(SolverError::Unstable { term, decay, oscillation, negative_real, imaginary }.into())
    }
}

/// The intervals of a stepper, the same for all kinds of modes.
fn of<S: State>(stepper: &(impl Stepper<S> + ?Sized)) -> impl Fn(Limit) -> (f64, f64) {
    let intervals = (stepper.negative_real_interval(), stepper.imaginary_interval());
    move |_| intervals
}

/// a/x + b/y + c/(0.93 min(x, y)), in 1/time.
fn share(limit: Limit, rate: Rate, (x, y): (f64, f64)) -> f64 {
    let part = |rate: f64, interval: f64| {
        let binds = known(rate) > 0.0 && interval.is_finite();
        if binds { known(rate) / interval } else { 0.0 }
    };
    // Where nothing that oscillates is stable, that of a source grows by the error of the scheme, (rate dt)^2/2 a step for
    // Euler, and no finer with the particles: what decays is bounded there.
    let reach = if limit == Limit::Source && y == 0.0 { x } else { HALF_DISC * x.min(y) };
    part(rate.decay, x) + part(rate.oscillation, y) + part(rate.modulus, reach)
}

/// The larger of two rates, NaN being the largest of all.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// A rate that is no number allows no step.
fn known(rate: f64) -> f64 {
    if rate.is_nan() { f64::INFINITY } else { rate }
}
