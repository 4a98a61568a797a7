//! How a scene on its particles is moved in time: by any stepper, or implicitly.

use super::fields::Fields;
use super::scene::Scene;
use super::semi_discrete::SemiDiscrete;
use crate::error::{Limit, Result};
use crate::linear::{BiCgStab, CsrMatrix, SolveReport, SparseSolver};
use crate::time::{Euler, Implicit, Leapfrog, Rk4, RowSymmetry, SspRk3, Stepper};

/// What moves a scene in time. Every [`Stepper`] does, and [`ImplicitScheme`].
pub trait TimeScheme<const D: usize, S: Scene<D>> {
    /// The intervals (x, y) of the negative real and of the imaginary axis on which modes of this kind are stable.
    fn intervals(&self, limit: Limit) -> (f64, f64);

    /// Refuses rows that the scheme does not suit.
    ///
    /// # Errors
    /// As [`Stepper::check_symmetry`].
    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        let _ = symmetry;
        Ok(())
    }

    /// Advances u from t to t + dt; `u` changes only where that succeeds.
    ///
    /// # Errors
    /// As [`Stepper::step`], [`Implicit::step`] and [`SemiDiscrete::rate`].
    fn step(&mut self, t: f64, dt: f64, u: &mut Vec<S::Value>, discrete: &mut SemiDiscrete<D, S>) -> Result<()>;

    /// Forgets all earlier steps.
    fn reset(&mut self);
}

impl<St: Stepper<Vec<S::Value>>, S: Scene<D>, const D: usize> TimeScheme<D, S> for St {
    fn intervals(&self, _: Limit) -> (f64, f64) {
        (self.negative_real_interval(), self.imaginary_interval())
    }

    fn check_symmetry(&self, symmetry: RowSymmetry) -> Result<()> {
        Stepper::check_symmetry(self, symmetry)
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut Vec<S::Value>, discrete: &mut SemiDiscrete<D, S>) -> Result<()> {
        Stepper::step(self, t, dt, u, &mut |t, u, du| discrete.rate(t, u, du))
    }

    fn reset(&mut self) {
        Stepper::reset(self);
    }
}

/// How many right-hand sides a scheme evaluates a step, where its type says so.
pub trait Stages {
    /// That number.
    const STAGES: usize;
}

macro_rules! stages {
    ($($scheme:ident $stages:literal)*) => { $(
        impl<S> Stages for $scheme<S> {
            const STAGES: usize = $stages;
        }
    )* };
}

stages!(Euler 1 Leapfrog 1 SspRk3 3 Rk4 4);

/// Implicit Euler or Crank-Nicolson for a scene, see [`Implicit`]: no diffusion or advection limit binds.
///
/// The matrix is that of the diffusion and advection terms with the conditions of the boundary as algebraic rows; it is
/// made in the first step, and anew in every step where the velocity is not steady, then at the end of the step for
/// implicit Euler and in the middle for Crank-Nicolson. Matrix and factors are kept while dt stays. The source is taken
/// explicitly, S(x, t, u^n) at the times of the scheme: one that depends on u costs the second order and is stable while its
/// rate keeps to 2/dt.
#[derive(Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct ImplicitScheme<E: Fields = f64> {
    theta: f64,
    lu_rows: usize,
    /// Matrix and factors, made anew after saving or cloning.
    #[cfg_attr(feature = "serde", serde(skip))]
    held: Option<Implicit<E>>,
    #[cfg_attr(feature = "serde", serde(skip))]
    before: Vec<E>,
    #[cfg_attr(feature = "serde", serde(skip))]
    solved: SolveReport,
}

impl<E: Fields> Clone for ImplicitScheme<E> {
    fn clone(&self) -> Self {
        Self { lu_rows: self.lu_rows, ..Self::new(self.theta) }
    }
}

impl<E: Fields> ImplicitScheme<E> {
    /// Implicit Euler.
    pub fn euler() -> Self {
        Self::new(1.0)
    }

    /// Crank-Nicolson.
    pub fn crank_nicolson() -> Self {
        Self::new(0.5)
    }

    fn new(theta: f64) -> Self {
        let (lu_rows, solved) = (Implicit::<E>::LU_ROWS, SolveReport::default());
        Self { theta, lu_rows, held: None, before: Vec::new(), solved }
    }

    /// With sparse LU up to so many particles, [`Implicit::LU_ROWS`] by default, and BiCGSTAB beyond. Without the feature
    /// `faer` there is no LU, and this has no effect.
    #[must_use]
    pub fn lu_up_to(self, rows: usize) -> Self {
        Self { lu_rows: rows, held: None, ..self }
    }

    /// What the solve of the last step did, summed over the fields; nothing before the first.
    pub fn last_solve(&self) -> SolveReport {
        self.solved
    }

    /// The scheme with this matrix.
    fn implicit(&self, matrix: CsrMatrix) -> Result<Implicit<E>> {
        let rows = matrix.rows();
        let scheme = if self.theta == 1.0 { Implicit::euler(matrix)? } else { Implicit::crank_nicolson(matrix)? };
        #[cfg(feature = "faer")]
        if rows <= self.lu_rows {
            return Ok(scheme.solver(SparseSolver::lu));
        }
        let _ = rows;
        Ok(scheme.solver(|matrix| SparseSolver::bicgstab(matrix, BiCgStab::new())))
    }
}

/// The negative real interval of explicit Euler, with which the source is taken.
const EXPLICIT: f64 = 2.0;

impl<S: Scene<D, Value = E>, E: Fields, const D: usize> TimeScheme<D, S> for ImplicitScheme<E> {
    fn intervals(&self, limit: Limit) -> (f64, f64) {
        match limit {
            Limit::Source => (EXPLICIT, 0.0),
            _ => (f64::INFINITY, f64::INFINITY),
        }
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut Vec<E>, discrete: &mut SemiDiscrete<D, S>) -> Result<()> {
        // Inflow may begin or end within a step: it is taken where the step ends.
        let (at, end) = (t + self.theta * dt, t + dt);
        let mut implicit = match self.held.take() {
            Some(implicit) if discrete.steady() => implicit,
            Some(mut implicit) => {
                implicit.set_matrix(discrete.matrix_with(at, end, |_| 0.0)?)?;
                implicit.algebraic(discrete.prescribed(end))?
            }
            None => {
                let scheme = self.implicit(discrete.matrix_with(at, end, |_| 0.0)?)?;
                scheme.algebraic(discrete.prescribed(end))?
            }
        };
        self.before.clone_from(u);
        let before = &self.before;
        let done = implicit.step(t, dt, u, &mut |t, g| discrete.load_with(t, end, before, g));
        self.held = Some(implicit);
        self.solved = done?;
        Ok(())
    }

    fn reset(&mut self) {
        self.held = None;
    }
}
