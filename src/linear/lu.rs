//! Sparse LU with partial pivoting, by the package `faer`.

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::{Conj, MatMut, Par};

use super::csr::CsrMatrix;
use super::norm::ratio;
use super::stop::{SolveReport, check_solution};
use crate::error::{Error, LinearError, ParticleError, Result};

/// Most steps of refinement in one solve.
const REFINEMENTS: usize = 3;

/// The relative residual that is always good enough.
const TOLERANCE: f64 = 1e-13;

/// The factors of P A Q, and room for a solve. One thread, so that bits do not depend on how many there are.
pub(super) struct SparseLu {
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    room: MemBuffer,
}

impl fmt::Debug for SparseLu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SparseLu").field("symbolic", &self.symbolic).finish_non_exhaustive()
    }
}

impl SparseLu {
    /// Factors a square matrix.
    pub(super) fn new(matrix: &CsrMatrix) -> Result<Self> {
        let memory = || Error::from(ParticleError::Memory { count: matrix.entries() });
        let refused = |error| match error {
            LuError::SymbolicSingular { .. } => LinearError::Singular { condition: f64::INFINITY }.into(),
            LuError::Generic(_) => memory(),
        };
        let columns = matrix.to_faer_columns()?;
        let symbolic = factorize_symbolic_lu(columns.symbolic(), Default::default()).map_err(|_| memory())?;
        let mut numeric = NumericLu::new();
        let need = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut room = MemBuffer::try_new(need).map_err(|_| memory())?;
        let stack = MemStack::new(&mut room);
        let done = symbolic.factorize_numeric_lu(&mut numeric, columns.as_ref(), Par::Seq, stack, Default::default());
        done.map_err(refused)?;
        let need = StackReq::any_of(&[
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
            symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        let room = MemBuffer::try_new(need).map_err(|_| memory())?;
        Ok(Self { symbolic, numeric, room })
    }

    /// Overwrites x, one entry a row, with A^-1 x or A^-T x.
    pub(super) fn solve(&mut self, x: &mut [f64], transposed: bool) {
        let rows = x.len();
        let right = MatMut::from_column_major_slice_mut(x, rows, 1);
        let factors = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let stack = MemStack::new(&mut self.room);
        if transposed {
            factors.solve_transpose_in_place_with_conj(Conj::No, right, Par::Seq, stack);
        } else {
            factors.solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
        }
    }

    /// Solves A x = b from x with at least one step of refinement, until the residual is below its bound.
    pub(super) fn refined(
        &mut self,
        matrix: &CsrMatrix,
        b: &[f64],
        x: &mut [f64],
        [residual, work]: &mut [Vec<f64>; 2],
        floor: impl Fn(&CsrMatrix, &[f64], &[f64], &mut [f64]) -> f64,
    ) -> Result<SolveReport> {
        if b.iter().all(|&b| b == 0.0) {
            x.fill(0.0);
            return Ok(SolveReport::default());
        }
        residual.copy_from_slice(b);
        if x.iter().any(|&x| x != 0.0) {
            matrix.product(x, work);
            residual.iter_mut().zip(&*work).for_each(|(r, ax)| *r -= ax);
        }
        let mut iterations = 0;
        loop {
            // The first pass solves, those after it refine.
            self.solve(residual, false);
            x.iter_mut().zip(&*residual).for_each(|(x, step)| *x += step);
            check_solution(x)?;
            matrix.product(x, work);
            residual.iter_mut().zip(b.iter().zip(&*work)).for_each(|(r, (b, ax))| *r = b - ax);
            let left = ratio(residual, b);
            let tolerance = TOLERANCE.max(floor(matrix, b, x, work));
            if iterations > 0 && left <= tolerance {
                return Ok(SolveReport { iterations, residual: left });
            }
            if iterations == REFINEMENTS {
                return Err(LinearError::NotConverged { iterations, residual: left, tolerance }.into());
            }
            iterations += 1;
        }
    }
}
