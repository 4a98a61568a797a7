//! Implicit steps of linear systems: one sparse solve instead of a stability limit.

use super::entry::{self, Entry};
use super::stepper::check_step;
use crate::error::{Error, LinearError, Result, TimeError};
use crate::linear::{BiCgStab, CsrMatrix, SolveReport, SparseSolver};

/// Implicit Euler (theta = 1) and Crank-Nicolson (theta = 1/2) for u' = A u + g(t) with a sparse matrix A:
/// (I - theta dt A) u^(n+1) = (I + (1 - theta) dt A) u^n + dt ((1 - theta) g(t) + theta g(t + dt)).
///
/// Rows may be algebraic: such a row p has no time derivative and demands (A u)_p = g_p at the end of the step. A Dirichlet
/// row is a row of the identity with the value of that time as g_p, a condition a u + b du/dn = g the row that
/// [`BoundaryRows::matrix`](crate::BoundaryRows::matrix) gives it; [`CsrMatrix::replace_rows`] puts them into A.
///
/// Orders 1 and 2. Where no eigenvalue of A has a positive real part every step is stable: no
/// [`StepLimit`](crate::StepLimit) binds. Implicit Euler also damps modes that should grow, once |1 - lambda dt| > 1, and
/// fast modes by 1/|lambda dt|; Crank-Nicolson leaves fast modes their size and flips their sign each step, so start it from
/// smooth states, or by a few steps of implicit Euler.
///
/// What is solved for is the increment, (I - theta dt A) (u^(n+1) - u^n) = dt (A u^n + (1 - theta) g(t) + theta g(t + dt)),
/// with A u^n taken by differences: where a row of A sums to zero but for rounding, n eps sum |A_pq|, constants keep their
/// bits, and no diffusion number brings that rounding back (at 10^6 it would make them grow by 2 10^-9 a step).
///
/// The system is prepared in the first step and kept while dt stays: the same matrix and factors serve all steps and all
/// the fields of an entry, and then nothing is allocated. The solve keeps the promise of
/// [`SparseSolver`]: a relative residual below 1e-13, or below what rounding leaves. It is by BiCGSTAB with ILU(0), or, with
/// the feature `faer`, by sparse LU where [`LU_ROWS`](Self::LU_ROWS) says; [`solver`](Self::solver) takes any other.
/// Everything is computed in `f64` and rounded to the entry once.
///
/// ```
/// use parops::{CsrMatrix, Implicit};
/// // u_1' = -1000 (u_1 - u_0), u_0 = t.
/// let a = CsrMatrix::from_triplets(2, 2, [(0, 0, 1.0), (1, 0, 1000.0), (1, 1, -1000.0)])?;
/// let mut euler = Implicit::euler(a)?.algebraic([0])?;
/// let mut u = [0.0, 0.0];
/// for n in 0..10 {
///     euler.step(0.1 * f64::from(n), 0.1, &mut u, &mut |t, g: &mut [f64]| {
///         g.copy_from_slice(&[t, 0.0]);
///         Ok(())
///     })?;
/// }
/// assert!((u[0] - 1.0).abs() < 1e-14 && (u[1] - 0.999).abs() < 1e-12);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 3.2, for both schemes; J. Crank and P. Nicolson, 1947; errata 56.
/// See also: [`Rkl2`](crate::Rkl2), which needs no matrix, where a diffusion number is not in the thousands.
#[derive(Debug)]
pub struct Implicit<E = f64> {
    a: CsrMatrix,
    /// Sums of its rows.
    sums: Vec<f64>,
    theta: f64,
    /// Which rows have no time derivative.
    algebraic: Vec<bool>,
    solver: fn(CsrMatrix) -> Result<SparseSolver>,
    /// The system of this dt.
    prepared: Option<(f64, SparseSolver)>,
    /// g(t) and g(t + dt).
    sources: [Vec<E>; 2],
    next: Vec<E>,
    right: Vec<f64>,
    x: Vec<f64>,
    rate: Vec<f64>,
}

impl<E: Entry> Implicit<E> {
    /// With the feature `faer`, up to so many rows are solved by sparse LU and more by BiCGSTAB.
    ///
    /// Milliseconds to prepare and per later step, diffusion numbers 10 to 10^6: 1000 particles in 2D (21 entries a row) LU
    /// 200 and 0.4, BiCGSTAB 2 and 0.4 to 1.5; in 3D (98 a row) 290 and 0.7 to 1, 80 and 1.4 to 20; 16,000 in 2D 800 to 4600
    /// and 16 to 31, 12 to 390 and 28 to 150; 4000 in 3D 8000 and 70 to 90, 300 and 75 to 93. LU depends neither on the
    /// diffusion number nor on luck, but in 3D it costs a hundred steps from about 2000 rows on.
    pub const LU_ROWS: usize = 2000;

    /// Implicit Euler for the square matrix A.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`].
    pub fn euler(a: CsrMatrix) -> Result<Self> {
        Self::new(a, 1.0)
    }

    /// Crank-Nicolson for the square matrix A.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`].
    pub fn crank_nicolson(a: CsrMatrix) -> Result<Self> {
        Self::new(a, 0.5)
    }

    fn new(a: CsrMatrix, theta: f64) -> Result<Self> {
        let (rows, columns) = (a.rows(), a.columns());
        if rows != columns {
            return Err(LinearError::NotSquare { rows, columns }.into());
        }
        Ok(Self {
            theta,
            algebraic: vec![false; rows],
            solver: chosen,
            prepared: None,
            sources: [Vec::new(), Vec::new()],
            next: Vec::new(),
            right: vec![0.0; rows],
            x: vec![0.0; rows],
            rate: vec![0.0; rows],
            sums: a.row_sums(),
            a,
        })
    }

    /// With these rows algebraic, and no others.
    ///
    /// # Errors
    /// [`LinearError::Index`] for a row outside.
    pub fn algebraic(mut self, rows: impl IntoIterator<Item = usize>) -> Result<Self> {
        let n = self.a.rows();
        self.algebraic.fill(false);
        for row in rows {
            match self.algebraic.get_mut(row) {
                Some(algebraic) => *algebraic = true,
                None => return Err(LinearError::Index { row, column: row, rows: n, columns: n }.into()),
            }
        }
        self.prepared = None;
        Ok(self)
    }

    /// With this way to prepare the system, such as `SparseSolver::lu`, or
    /// `|matrix| SparseSolver::gmres(matrix, Gmres::new())`.
    #[must_use]
    pub fn solver(self, solver: fn(CsrMatrix) -> Result<SparseSolver>) -> Self {
        Self { solver, prepared: None, ..self }
    }

    /// A.
    pub fn matrix(&self) -> &CsrMatrix {
        &self.a
    }

    /// Takes another matrix of as many rows, as particles that moved have it; algebraic rows stay what they are, and the
    /// system is prepared anew in the next step.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`]; [`LinearError::Length`] for another number of rows.
    pub fn set_matrix(&mut self, a: CsrMatrix) -> Result<()> {
        let (rows, columns, needed) = (a.rows(), a.columns(), self.a.rows());
        if rows != columns {
            return Err(LinearError::NotSquare { rows, columns }.into());
        }
        if rows != needed {
            return Err(LinearError::Length { found: rows, needed }.into());
        }
        (self.sums, self.a, self.prepared) = (a.row_sums(), a, None);
        Ok(())
    }

    /// The order of the error at a fixed end time: 1 for implicit Euler, 2 for Crank-Nicolson.
    pub fn order(&self) -> u32 {
        if self.theta == 1.0 { 1 } else { 2 }
    }

    /// As [`Stepper::negative_real_interval`](crate::Stepper::negative_real_interval): infinite, for
    /// [`StepLimit::step_of_interval`](crate::StepLimit::step_of_interval).
    pub fn negative_real_interval(&self) -> f64 {
        f64::INFINITY
    }

    /// As [`Stepper::imaginary_interval`](crate::Stepper::imaginary_interval): infinite.
    pub fn imaginary_interval(&self) -> f64 {
        f64::INFINITY
    }

    /// Advances u from t to t + dt. `source(t, g)` writes all of g, whose contents before are unspecified; Crank-Nicolson
    /// asks for t and then t + dt, implicit Euler for t + dt.
    ///
    /// The report sums iterations over the fields of an entry and has their largest residual.
    ///
    /// # Errors
    /// [`TimeError::Step`], [`TimeError::Span`], [`TimeError::NoProgress`] as [`Stepper::step`](crate::Stepper::step);
    /// [`TimeError::Shape`] where u has another length than A has rows; [`TimeError::NotFinite`] with the particle, where
    /// `u` or g(t) (stage 1), g(t + dt) (stage 2) or the new state (stage 3) is not finite;
    /// [`LinearError::Entry`] naming the row where I - theta dt A is not finite; what preparing and solving a
    /// [`SparseSolver`] refuses, [`LinearError::ZeroPivot`], `Singular` and `NotConverged` above all;
    /// [`ApplyError::Overflow`](crate::ApplyError::Overflow); and the errors of `source`, unchanged. `u` is then as it was,
    /// and after a panic in `source` too.
    pub fn step(
        &mut self,
        t: f64,
        dt: f64,
        u: &mut [E],
        source: &mut dyn FnMut(f64, &mut [E]) -> Result<()>,
    ) -> Result<SolveReport> {
        check_step(t, dt)?;
        let (found, needed) = (u.len(), self.a.rows());
        if found != needed {
            return Err(TimeError::Shape { found, needed }.into());
        }
        check_finite(u, 1, t)?;
        self.evaluate(t, dt, u, source)?;
        self.prepare(dt)?;
        let mut whole = SolveReport::default();
        for k in 0..E::NUMBERS {
            let report = self.solve(k, dt, u)?;
            whole.iterations += report.iterations;
            whole.residual = whole.residual.max(report.residual);
        }
        check_finite(&self.next, 3, t + dt)?;
        u.copy_from_slice(&self.next);
        Ok(whole)
    }

    /// The source at both ends of the step, as far as the scheme asks for them.
    fn evaluate(
        &mut self,
        t: f64,
        dt: f64,
        u: &[E],
        source: &mut dyn FnMut(f64, &mut [E]) -> Result<()>,
    ) -> Result<()> {
        let [start, end] = &mut self.sources;
        for buffer in [&mut *start, &mut *end, &mut self.next] {
            if buffer.len() != u.len() {
                buffer.clear();
                buffer.extend_from_slice(u);
            }
        }
        if self.theta < 1.0 {
            source(t, start)?;
            check_finite(start, 1, t)?;
        }
        source(t + dt, end)?;
        check_finite(end, 2, t + dt)
    }

    /// Makes the system of this dt, unless it is there.
    fn prepare(&mut self, dt: f64) -> Result<()> {
        if self.prepared.as_ref().is_none_or(|(known, _)| *known != dt) {
            self.prepared = None;
            let matrix = self.a.shifted(-self.theta * dt, &self.algebraic)?;
            self.prepared = Some((dt, (self.solver)(matrix)?));
        }
        Ok(())
    }

    /// Solves for number k of every entry, from the state before.
    fn solve(&mut self, k: usize, dt: f64, u: &[E]) -> Result<SolveReport> {
        let Self { a, sums, theta, algebraic, prepared, sources: [start, end], next, right, x, rate, .. } = self;
        let Some((_, solver)) = prepared else { return Ok(SolveReport::default()) };
        x.iter_mut().zip(u).for_each(|(x, u)| *x = u.number(k));
        a.product_by_differences(sums, x, rate);
        for (p, (right, rate)) in right.iter_mut().zip(&*rate).enumerate() {
            let later = end[p].number(k);
            *right = if algebraic[p] {
                later - rate
            } else if *theta < 1.0 {
                dt * (rate + ((1.0 - *theta) * start[p].number(k) + *theta * later))
            } else {
                dt * (rate + later)
            };
        }
        let mut report = solver.solve(right, x)?;
        // Where the increment is larger than the state, as in the first steps of a rough field, the residual is to be small
        // beside the state: what the first solve left is solved for once more.
        let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0_f64, |most, x| most.max(x.abs()));
        if largest(&mut right.iter().copied()) > largest(&mut u.iter().map(|u| u.number(k))) {
            a.product_by_differences(sums, x, rate);
            for (p, (right, rate)) in right.iter_mut().zip(&*rate).enumerate() {
                *right -= if algebraic[p] { *rate } else { x[p] - *theta * dt * rate };
            }
            report.iterations += solver.solve(right, rate)?.iterations;
            x.iter_mut().zip(&*rate).for_each(|(x, more)| *x += more);
        }
        for ((next, u), x) in next.iter_mut().zip(u).zip(&*x) {
            next.set_number(k, u.number(k) + x);
        }
        Ok(report)
    }
}

/// Sparse LU for small systems where it is there, BiCGSTAB otherwise.
fn chosen(matrix: CsrMatrix) -> Result<SparseSolver> {
    #[cfg(feature = "faer")]
    if matrix.rows() <= Implicit::<f64>::LU_ROWS {
        return SparseSolver::lu(matrix);
    }
    SparseSolver::bicgstab(matrix, BiCgStab::new())
}

fn check_finite<E: Entry>(u: &[E], stage: usize, t: f64) -> Result<()> {
    match entry::first_non_finite(u) {
        None => Ok(()),
        Some(particle) => Err(Error::from(TimeError::NotFinite { stage, t }).at(particle)),
    }
}
