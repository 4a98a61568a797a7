//! The same matrix in the types of the package `faer`.

use faer::sparse::{SparseColMat, SparseRowMat, SymbolicSparseColMat, SymbolicSparseRowMat};

use super::csr::CsrMatrix;
use crate::apply::Field;
use crate::error::Result;

impl<T: Field> CsrMatrix<T> {
    /// A copy as a `faer` matrix by rows.
    pub fn to_faer_rows(&self) -> SparseRowMat<usize, T> {
        let columns = self.columns.iter().map(|&q| q as usize).collect();
        let pattern =
            SymbolicSparseRowMat::new_checked(self.rows(), self.columns(), self.offsets.clone(), None, columns);
        SparseRowMat::new(pattern, self.values.clone())
    }

    /// A copy as a `faer` matrix by columns, as its factorizations take it.
    ///
    /// # Errors
    /// As [`transposed`](Self::transposed).
    pub fn to_faer_columns(&self) -> Result<SparseColMat<usize, T>> {
        let Self { offsets, columns, values, .. } = self.transposed()?;
        let rows = columns.into_iter().map(|p| p as usize).collect();
        let pattern = SymbolicSparseColMat::new_checked(self.rows(), self.columns(), offsets, None, rows);
        Ok(SparseColMat::new(pattern, values))
    }
}
