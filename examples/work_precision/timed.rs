//! Applications told from steps.

use parops::report::{Phase, Stopwatch};
use parops::{Rhs, RowSymmetry, State, Stepper};

/// A stepper whose right-hand sides are timed as applications; what is left are its own sums.
pub struct Timed<'a, St> {
    pub stepper: St,
    pub watch: &'a Stopwatch,
}

impl<S: State, St: Stepper<S>> Stepper<S> for Timed<'_, St> {
    fn order(&self) -> u32 {
        self.stepper.order()
    }

    fn negative_real_interval(&self) -> f64 {
        self.stepper.negative_real_interval()
    }

    fn imaginary_interval(&self) -> f64 {
        self.stepper.imaginary_interval()
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> parops::Result<()> {
        self.stepper.step(t, dt, u, &mut |t, u, du| self.watch.time(Phase::Apply, || rhs(t, u, du)))
    }

    fn check_symmetry(&self, symmetry: RowSymmetry) -> parops::Result<()> {
        self.stepper.check_symmetry(symmetry)
    }

    fn reset(&mut self) {
        self.stepper.reset();
    }
}
