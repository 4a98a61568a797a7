//! Restarted GMRES with an incomplete factor on the right.

use super::ilu::Ilu0;
use super::norm::{dot, inverse_power, norm};
use super::stop::{SolveReport, Stop, check_solution, check_system};
use crate::apply::Apply;
use crate::error::Result;
use crate::particles::reserved;

/// GMRES(m): the x of least residual |b - A x|_2 in a growing Krylov space, restarted every m iterations.
///
/// The preconditioner stands on the right, A M^-1 (M x) = b, so that the residual minimized is the true one. It is
/// computed anew from x at every restart, and that decides. Vectors are made orthogonal twice (modified Gram-Schmidt), so
/// residuals near rounding can be reached. The start is x = 0, and b is scaled by a power of two, so that equal input
/// gives equal bits and 2^k b gives 2^k x. Memory for m + 1 vectors is reserved in the first solve of a size, filled as
/// far as iterations need it, and reused.
///
/// Defaults: m = 60, at most 3000 iterations, relative residual 1e-13. A system whose |A| |x| is far above |b| cannot get
/// there in `f64`; [`SparseSolver`](crate::SparseSolver) knows where rounding ends.
///
/// ```
/// use parops::{CsrMatrix, Gmres, Ilu0};
/// let chain = (0..50).flat_map(|i: usize| [(i, i, 2.0), (i, (i + 1) % 50, -1.0), (i, (i + 49) % 50, -0.5)]);
/// let a = CsrMatrix::from_triplets(50, 50, chain)?;
/// let mut x = [0.0; 50];
/// let report = Gmres::new().solve(&a, Some(&Ilu0::new(&a)?), &[1.0; 50], &mut x)?;
/// assert!(report.residual <= 1e-13 && (x[7] - 2.0).abs() < 1e-12);
/// # parops::Result::Ok(())
/// ```
///
/// Source: Y. Saad and M. H. Schultz, 1986; right preconditioning as in Saad, Iterative Methods, 2003, algorithm 9.5.
#[derive(Clone, Debug)]
pub struct Gmres {
    restart: usize,
    stop: Stop,
    /// The orthonormal vectors, one after the other.
    basis: Vec<f64>,
    /// The triangular factor of the projected matrix, column by column, m + 1 places each.
    triangle: Vec<f64>,
    rotations: Vec<[f64; 2]>,
    /// The right-hand side of the projected problem, then its solution.
    small: Vec<f64>,
    work: Vec<f64>,
    scaled: Vec<f64>,
}

impl Default for Gmres {
    fn default() -> Self {
        Self::new()
    }
}

impl Gmres {
    /// The solver at its defaults.
    pub fn new() -> Self {
        Self {
            restart: 60,
            stop: Stop::DEFAULT,
            basis: Vec::new(),
            triangle: Vec::new(),
            rotations: Vec::new(),
            small: Vec::new(),
            work: Vec::new(),
            scaled: Vec::new(),
        }
    }

    /// With a restart after so many iterations, at least 1.
    #[must_use]
    pub fn restart(self, iterations: usize) -> Self {
        Self { restart: iterations.max(1), ..self }
    }

    /// With at most so many iterations.
    #[must_use]
    pub fn most(self, iterations: usize) -> Self {
        Self { stop: Stop { most: iterations, ..self.stop }, ..self }
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
    /// [`LinearError::NotSquare`](crate::LinearError::NotSquare) and [`LinearError::Length`](crate::LinearError::Length)
    /// where shapes do not fit; [`LinearError::Value`](crate::LinearError::Value) naming the first entry of `b` that is not
    /// finite; [`LinearError::NotConverged`](crate::LinearError::NotConverged) where the residual is above the tolerance
    /// after the last iteration, or when a restart no longer lowers it (`x` then holds what was reached);
    /// [`ApplyError::Overflow`](crate::ApplyError::Overflow) where the solution is not finite; and the errors of the operator.
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

    /// Iterates from x until the tolerance, the last iteration, or until nothing is gained; the report says how far it
    /// came. Where the start is within the tolerance but not exact, it is still corrected once.
    pub(super) fn run(
        &mut self,
        product: impl Fn(&[f64], &mut [f64]) -> Result<()>,
        precondition: impl Fn(&mut [f64]) -> Result<()>,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport> {
        let n = b.len();
        let largest = b.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        if largest == 0.0 {
            x.fill(0.0);
            return Ok(SolveReport::default());
        }
        self.reserve(n)?;
        let scale = inverse_power(largest);
        self.scaled.iter_mut().zip(b).for_each(|(scaled, value)| *scaled = value * scale);
        let full = norm(&self.scaled);
        let goal = self.stop.tolerance * full;
        self.basis.clear();
        self.basis.extend_from_slice(&self.scaled);
        if x.iter().any(|&x| x != 0.0) {
            product(x, &mut self.work)?;
            if self.work == b {
                return Ok(SolveReport::default());
            }
            self.basis.iter_mut().zip(&self.work).for_each(|(b, ax)| *b -= scale * ax);
            x.iter_mut().for_each(|x| *x *= scale);
        }
        let (mut left, mut iterations) = (norm(&self.basis), 0);
        while left > 0.0 && (left > goal || iterations == 0) && iterations < self.stop.most {
            let steps = self.cycle(left, goal, self.stop.most - iterations, &product, &precondition)?;
            iterations += steps.done;
            self.combine(n, steps.kept);
            precondition(&mut self.work)?;
            x.iter_mut().zip(&self.work).for_each(|(x, step)| *x += step);
            product(x, &mut self.work)?;
            self.basis.clear();
            self.basis.extend(self.scaled.iter().zip(&self.work).map(|(b, ax)| b - ax));
            let before = left;
            left = norm(&self.basis);
            // Where the small problem was solved and the residual stays, what is left is rounding.
            let gained = left < if steps.solved { 0.5 * before } else { before };
            if !gained {
                break;
            }
        }
        x.iter_mut().for_each(|x| *x /= scale);
        check_solution(x)?;
        Ok(SolveReport { iterations, residual: left / full })
    }

    /// The most vectors of one cycle that take part in a solution.
    fn width(&self, n: usize) -> usize {
        self.restart.min(self.stop.most).min(n)
    }

    /// Room for all that a solve of n unknowns can need.
    fn reserve(&mut self, n: usize) -> Result<()> {
        let m = self.width(n);
        let wanted = n.saturating_mul(m + 1);
        if self.basis.capacity() < wanted {
            self.basis = reserved(wanted)?;
        }
        if self.triangle.len() < m * (m + 1) {
            self.triangle.resize(m * (m + 1), 0.0);
            self.rotations.resize(m, [0.0; 2]);
            self.small.resize(m + 1, 0.0);
        }
        self.work.resize(n, 0.0);
        self.scaled.resize(n, 0.0);
        Ok(())
    }

    /// One cycle from the residual that is the first vector of the basis.
    fn cycle(
        &mut self,
        residual: f64,
        goal: f64,
        most: usize,
        product: &impl Fn(&[f64], &mut [f64]) -> Result<()>,
        precondition: &impl Fn(&mut [f64]) -> Result<()>,
    ) -> Result<Steps> {
        let n = self.work.len();
        let m = self.width(n);
        self.basis.iter_mut().for_each(|value| *value /= residual);
        self.small.fill(0.0);
        self.small[0] = residual;
        let mut j = 0;
        while j < m.min(most) {
            self.work.copy_from_slice(&self.basis[j * n..]);
            precondition(&mut self.work)?;
            self.basis.resize((j + 2) * n, 0.0);
            let (known, next) = self.basis.split_at_mut((j + 1) * n);
            product(&self.work, next)?;
            let column = &mut self.triangle[j * (m + 1)..][..j + 2];
            let before = norm(next);
            orthogonalize(known, next, &mut column[..=j]);
            let length = norm(next);
            // What is left of a vector inside the space is rounding: the space holds the solution, or A is singular.
            let closed = !(length > 4.0 * f64::EPSILON * before);
            column[j + 1] = if closed { 0.0 } else { length };
            next.iter_mut().for_each(|value| *value /= length);
            for (i, &[c, s]) in self.rotations[..j].iter().enumerate() {
                (column[i], column[i + 1]) = (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
            }
            let pivot = column[j].hypot(column[j + 1]);
            if !(pivot > f64::EPSILON * before) {
                // The last direction is mapped to nothing that is new: it cannot help.
                return Ok(Steps { done: j + 1, kept: j, solved: false });
            }
            let [c, s] = [column[j] / pivot, column[j + 1] / pivot];
            (column[j], self.rotations[j]) = (pivot, [c, s]);
            (self.small[j], self.small[j + 1]) = (c * self.small[j], -s * self.small[j]);
            j += 1;
            if closed || self.small[j].abs() <= goal {
                return Ok(Steps { done: j, kept: j, solved: true });
            }
        }
        Ok(Steps { done: j, kept: j, solved: false })
    }

    /// The combination of the first `kept` basis vectors that solves the projected problem, into `work`.
    fn combine(&mut self, n: usize, kept: usize) {
        let stride = self.width(n) + 1;
        for j in (0..kept).rev() {
            let column = &self.triangle[j * stride..][..=j];
            let y = self.small[j] / column[j];
            self.small[j] = y;
            self.small[..j].iter_mut().zip(column).for_each(|(small, entry)| *small -= entry * y);
        }
        self.work.fill(0.0);
        for (vector, &y) in self.basis.chunks_exact(n).zip(&self.small[..kept]) {
            self.work.iter_mut().zip(vector).for_each(|(sum, value)| *sum += y * value);
        }
    }
}

/// What one cycle did.
struct Steps {
    done: usize,
    /// Vectors that take part in the solution.
    kept: usize,
    /// Whether the projected residual reached the goal.
    solved: bool,
}

/// Takes from `next` its parts along the known vectors, twice, and sums them in `parts`.
fn orthogonalize(known: &[f64], next: &mut [f64], parts: &mut [f64]) {
    parts.fill(0.0);
    for _ in 0..2 {
        for (vector, part) in known.chunks_exact(next.len()).zip(&mut *parts) {
            let along = dot(vector, next);
            *part += along;
            next.iter_mut().zip(vector).for_each(|(value, v)| *value -= along * v);
        }
    }
}
