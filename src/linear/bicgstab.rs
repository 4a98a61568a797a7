//! BiCGSTAB with an incomplete factor on the right.

use super::ilu::Ilu0;
use super::norm::{dot, inverse_power, norm};
use super::stop::{SolveReport, Stop, check_solution, check_system};
use crate::apply::Apply;
use crate::error::Result;

/// How often a cycle that broke down and gained nothing is tried again with another shadow.
const RETRIES: u32 = 3;

/// BiCGSTAB: two products an iteration and eight vectors, however many iterations it takes.
///
/// The preconditioner stands on the right, so that the residual is the true one. The recurrence only proposes: where it
/// says that the tolerance is reached, or breaks down, the residual is computed anew from x and decides; a cycle that
/// raised it is taken back, and tried again with another shadow vector up to three times. The start is x = 0, and b is
/// scaled by a power of two, so that equal input gives equal bits and 2^k b gives 2^k x. It allocates in the first solve of a
/// size only.
///
/// Defaults: at most 3000 products, relative residual 1e-13.
///
/// ```
/// use parops::{BiCgStab, CsrMatrix, Ilu0};
/// let chain = (0..50).flat_map(|i: usize| [(i, i, 2.0), (i, (i + 1) % 50, -1.0), (i, (i + 49) % 50, -0.5)]);
/// let a = CsrMatrix::from_triplets(50, 50, chain)?;
/// let mut x = [0.0; 50];
/// let report = BiCgStab::new().solve(&a, Some(&Ilu0::new(&a)?), &[1.0; 50], &mut x)?;
/// assert!(report.residual <= 1e-13 && (x[7] - 2.0).abs() < 1e-12);
/// # parops::Result::Ok(())
/// ```
///
/// Source: H. A. van der Vorst, 1992; preconditioned from the right as in Saad, Iterative Methods, 2003, sec. 9.3.
/// See also: [`Gmres`](crate::Gmres), which needs fewer products and more vectors, and cannot break down.
#[derive(Clone, Debug)]
pub struct BiCgStab {
    stop: Stop,
    residual: Vec<f64>,
    shadow: Vec<f64>,
    direction: Vec<f64>,
    /// A M^-1 times the direction, and times the intermediate residual.
    images: [Vec<f64>; 2],
    work: Vec<f64>,
    scaled: Vec<f64>,
    /// The best x so far.
    kept: Vec<f64>,
}

impl Default for BiCgStab {
    fn default() -> Self {
        Self::new()
    }
}

impl BiCgStab {
    /// The solver at its defaults.
    pub fn new() -> Self {
        let empty = Vec::new;
        Self {
            stop: Stop::DEFAULT,
            residual: empty(),
            shadow: empty(),
            direction: empty(),
            images: [empty(), empty()],
            work: empty(),
            scaled: empty(),
            kept: empty(),
        }
    }

    /// With at most so many products with A.
    #[must_use]
    pub fn most(self, products: usize) -> Self {
        Self { stop: Stop { most: products, ..self.stop }, ..self }
    }

    /// With this relative residual to be reached.
    ///
    /// # Errors
    /// [`LinearError::Setting`](crate::LinearError::Setting) where it is not in (0, 1).
    pub fn tolerance(self, residual: f64) -> Result<Self> {
        Ok(Self { stop: self.stop.at(residual)?, ..self })
    }

    /// Solves A x = b from x = 0, for a matrix or any other operator with as many targets as sources.
    ///
    /// # Errors
    /// As [`Gmres::solve`](crate::Gmres::solve).
    pub fn solve(
        &mut self,
        a: &(impl Apply<f64> + ?Sized),
        preconditioner: Option<&Ilu0>,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport> {
        check_system(a, preconditioner, b, x)?;
        x.fill(0.0);
        let precondition = |x: &mut [f64]| preconditioner.map_or(Ok(()), |factors| factors.solve(x));
        let report = self.run(|x, y| a.apply(x, y), precondition, b, x)?;
        self.stop.accept(report)
    }

    /// Which residual is asked for.
    pub(super) fn stop(&self) -> Stop {
        self.stop
    }

    /// Iterates from x until the tolerance, the last product, or until nothing is gained; the report says how far it came.
    /// Where the start is within the tolerance but not exact, it is still corrected once.
    pub(super) fn run(
        &mut self,
        product: impl Fn(&[f64], &mut [f64]) -> Result<()>,
        precondition: impl Fn(&mut [f64]) -> Result<()>,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport> {
        let largest = b.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        if largest == 0.0 {
            x.fill(0.0);
            return Ok(SolveReport::default());
        }
        self.resize(b.len());
        let scale = inverse_power(largest);
        self.scaled.iter_mut().zip(b).for_each(|(scaled, value)| *scaled = value * scale);
        let full = norm(&self.scaled);
        let goal = self.stop.tolerance * full;
        let mut left = full;
        self.residual.copy_from_slice(&self.scaled);
        if x.iter().any(|&x| x != 0.0) {
            product(x, &mut self.work)?;
            if self.work == b {
                return Ok(SolveReport::default());
            }
            self.residual.iter_mut().zip(&self.work).for_each(|(r, ax)| *r -= scale * ax);
            left = norm(&self.residual);
            x.iter_mut().for_each(|x| *x *= scale);
        }
        let (mut products, mut retries) = (0, 0);
        while left > 0.0 && (left > goal || products == 0) && products < self.stop.most {
            self.kept.copy_from_slice(x);
            self.choose_shadow(left, retries);
            let reached = self.cycle(goal, &mut products, &product, &precondition, x)?;
            let before = left;
            left = self.true_residual(&product, x)?;
            // Where the recurrence arrived and the residual stays, what is left is rounding.
            let gained = left < if reached { 0.5 * before } else { before };
            if !(left <= before) {
                x.copy_from_slice(&self.kept);
                left = self.true_residual(&product, x)?;
            }
            if gained {
                retries = 0;
            } else if reached || retries == RETRIES {
                break;
            } else {
                retries += 1;
            }
        }
        x.iter_mut().for_each(|x| *x /= scale);
        check_solution(x)?;
        Ok(SolveReport { iterations: products, residual: left / full })
    }

    fn resize(&mut self, n: usize) {
        let Self { residual, shadow, direction, images: [first, second], work, scaled, kept, .. } = self;
        for vector in [residual, shadow, direction, first, second, work, scaled, kept] {
            vector.resize(n, 0.0);
        }
    }

    /// The residual itself, of norm `length`, or, where it broke down, itself and a dense vector of about that length.
    fn choose_shadow(&mut self, length: f64, retries: u32) {
        let Self { shadow, residual, .. } = self;
        let spread = if retries == 0 { 0.0 } else { length * (12.0 / residual.len() as f64).sqrt() };
        for (i, (shadow, r)) in shadow.iter_mut().zip(residual).enumerate() {
            // A sequence of low discrepancy in place of random numbers.
            let uniform = ((i + 1) as f64 * f64::from(retries) * 0.618_033_988_749_895).fract() - 0.5;
            *shadow = *r + spread * uniform;
        }
    }

    /// The residual of x and its norm.
    fn true_residual(&mut self, product: &impl Fn(&[f64], &mut [f64]) -> Result<()>, x: &[f64]) -> Result<f64> {
        product(x, &mut self.work)?;
        for ((r, b), ax) in self.residual.iter_mut().zip(&self.scaled).zip(&self.work) {
            *r = b - ax;
        }
        Ok(norm(&self.residual))
    }

    /// Iterations from the residual of x; whether the recurrence reached the goal. Ends where it breaks down, too.
    fn cycle(
        &mut self,
        goal: f64,
        products: &mut usize,
        product: &impl Fn(&[f64], &mut [f64]) -> Result<()>,
        precondition: &impl Fn(&mut [f64]) -> Result<()>,
        x: &mut [f64],
    ) -> Result<bool> {
        let Self { stop, residual: r, shadow, direction, images: [image, second], work, .. } = self;
        direction.copy_from_slice(r);
        let start = norm(shadow);
        let mut along = dot(shadow, r);
        while *products < stop.most {
            work.copy_from_slice(direction);
            precondition(work)?;
            product(work, image)?;
            *products += 1;
            let alpha = along / dot(shadow, image);
            if !alpha.is_finite() {
                return Ok(false);
            }
            add(x, alpha, work);
            add(r, -alpha, image);
            let reached = norm(r) <= goal;
            if reached || *products == stop.most {
                return Ok(reached);
            }

            work.copy_from_slice(r);
            precondition(work)?;
            product(work, second)?;
            *products += 1;
            // Divided twice, so that no square leaves the range of numbers.
            let length = norm(second);
            let omega = dot(second, r) / length / length;
            if !(omega.is_finite() && omega != 0.0) {
                return Ok(false);
            }
            add(x, omega, work);
            add(r, -omega, second);
            let left = norm(r);
            if left <= goal {
                return Ok(true);
            }

            let next = dot(shadow, r);
            // The shadow is orthogonal to the residual but for rounding: a new one is needed.
            if !(next.abs() > f64::EPSILON * start * left) {
                return Ok(false);
            }
            let beta = next / along * (alpha / omega);
            along = next;
            for ((p, r), image) in direction.iter_mut().zip(&*r).zip(&*image) {
                *p = r + beta * (*p - omega * image);
            }
        }
        Ok(false)
    }
}

/// x += a y.
fn add(x: &mut [f64], a: f64, y: &[f64]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += a * y);
}
