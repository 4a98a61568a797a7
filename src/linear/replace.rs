//! Rows of a matrix exchanged for others: boundary rows among those of an operator.

use super::csr::CsrMatrix;
use crate::apply::Field;
use crate::error::{ErrorKind, LinearError, Result};

impl<T: Field> CsrMatrix<T> {
    /// Gives `row` these entries (column, value) instead of its own; entries of one column are summed.
    ///
    /// Costs a shift of all entries behind it; for many rows see [`replace_rows`](Self::replace_rows).
    ///
    /// # Errors
    /// [`LinearError::Index`] for a row or column outside, [`LinearError::Entry`] for a value that is not finite; the
    /// matrix is then as it was.
    pub fn replace_row(&mut self, row: usize, entries: &[(usize, T)]) -> Result<()> {
        let (rows, columns) = (self.rows(), self.width);
        let outside = |column| LinearError::Index { row, column, rows, columns };
        if row >= rows {
            return Err(outside(entries.first().map_or(0, |entry| entry.0)).into());
        }
        let one = entries.iter().map(|&(column, value)| (0, column, value));
        let new = Self::from_triplets(1, columns, one).map_err(|error| match error.kind() {
            ErrorKind::Linear(LinearError::Index { column, .. }) => outside(*column).into(),
            _ => error.at(row),
        })?;
        let range = self.offsets[row]..self.offsets[row + 1];
        let (old, now) = (range.len(), new.entries());
        self.columns.splice(range.clone(), new.columns);
        self.values.splice(range, new.values);
        self.offsets[row + 1..].iter_mut().for_each(|offset| *offset = *offset - old + now);
        Ok(())
    }

    /// Takes rows from another matrix: for every pair (p, i) row p becomes row i of `other`.
    ///
    /// So a steady problem gets its boundary rows: interior rows from an operator, the others from boundary conditions,
    /// whether those number all particles or only the boundary ones. The last pair of a row counts.
    ///
    /// # Errors
    /// [`LinearError::Length`] where `other` has another number of columns; [`LinearError::Index`] for a row outside
    /// either matrix; the matrix is then as it was.
    ///
    /// ```
    /// use parops::CsrMatrix;
    /// let mut a = CsrMatrix::from_triplets(3, 3, [(0, 0, 2.0), (1, 1, 2.0), (2, 2, 2.0)])?;
    /// let boundary = CsrMatrix::from_triplets(2, 3, [(0, 0, 1.0), (1, 2, 1.0), (1, 1, -1.0)])?;
    /// a.replace_rows(&boundary, [0, 2].into_iter().zip(0..))?;
    /// assert!(a.triplets().eq([(0, 0, 1.0), (1, 1, 2.0), (2, 1, -1.0), (2, 2, 1.0)]));
    /// # parops::Result::Ok(())
    /// ```
    pub fn replace_rows(&mut self, other: &Self, pairs: impl IntoIterator<Item = (usize, usize)>) -> Result<()> {
        if other.width != self.width {
            return Err(LinearError::Length { found: other.width, needed: self.width }.into());
        }
        let mut taken = vec![None; self.rows()];
        for (row, from) in pairs {
            for (row, rows) in [(row, self.rows()), (from, other.rows())] {
                if row >= rows {
                    return Err(LinearError::Index { row, column: 0, rows, columns: self.width }.into());
                }
            }
            taken[row] = Some(from);
        }
        let from = |row: usize| taken[row].map_or_else(|| self.range(row), |i| other.range(i));
        let entries = (0..self.rows()).map(|row| from(row).0.len()).sum();
        let mut merged = Self::empty(self.width, self.rows(), entries)?;
        for row in 0..self.rows() {
            let (columns, values) = from(row);
            merged.columns.extend_from_slice(columns);
            merged.values.extend_from_slice(values);
            merged.offsets.push(merged.columns.len());
        }
        *self = merged;
        Ok(())
    }
}
