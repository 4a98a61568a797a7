//! The sparse matrix: rows sorted by column, one entry a place.

use crate::apply::blocks::each_row;
use crate::apply::{Apply, Field, check, check_results, scalars};
use crate::error::{Error, LinearError, Result};
use crate::particles::{PARTICLES_HIGH, reserved};

/// A sparse matrix in compressed rows: y_p = sum_q A_pq x_q.
///
/// Row p holds the entries `offsets[p]..offsets[p + 1]` of `columns` and `values`. Columns ascend within a row, no place
/// stands twice, every value is finite; entries that are zero are kept. Memory: 4 bytes and a value per entry, 8 bytes
/// per row. It is an operator like any other: [`Apply`] is implemented for it.
///
/// ```
/// use parops::CsrMatrix;
/// let a = CsrMatrix::from_triplets(2, 3, [(0, 2, 5.0), (1, 0, 1.0), (0, 2, -2.0)])?;
/// assert!(a.triplets().eq([(0, 2, 3.0), (1, 0, 1.0)]));
/// let mut y = [0.0; 2];
/// a.multiply(&[1.0, 1.0, 2.0], &mut y)?;
/// assert_eq!(y, [6.0, 1.0]);
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CsrMatrix<T: Field = f64> {
    pub(super) width: usize,
    pub(super) offsets: Vec<usize>,
    pub(super) columns: Vec<u32>,
    pub(super) values: Vec<T>,
}

impl<T: Field> CsrMatrix<T> {
    /// The matrix of these entries (row, column, value), in any order; entries at one place are summed in the order given.
    ///
    /// # Errors
    /// [`LinearError::Columns`] for more columns than [`PARTICLES_HIGH`]; [`LinearError::Index`] for an entry outside;
    /// [`LinearError::Entry`] naming the row where a value or a sum is not finite;
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where there is no room.
    pub fn from_triplets(
        rows: usize,
        columns: usize,
        triplets: impl IntoIterator<Item = (usize, usize, T)>,
    ) -> Result<Self> {
        check_width(columns)?;
        let mut entries = Vec::new();
        for (row, column, value) in triplets {
            if row >= rows || column >= columns {
                return Err(LinearError::Index { row, column, rows, columns }.into());
            }
            entries.push((row, column as u32, value));
        }
        // The sort is stable, so entries at one place keep their order.
        entries.sort_by_key(|&(row, column, _)| (row, column));
        let mut matrix = Self::empty(columns, rows, entries.len())?;
        let mut rest = entries.as_slice();
        for row in 0..rows {
            let own = rest.partition_point(|entry| entry.0 == row);
            let (own, after) = rest.split_at(own);
            matrix.push_row(own.iter().map(|&(_, column, value)| (column, value)))?;
            rest = after;
        }
        Ok(matrix)
    }

    /// The matrix whose row p has the entries (column, value) that `row` pushes, in any order; entries of one column are
    /// summed in the order pushed. Every row is asked for twice, to be counted and to be stored.
    ///
    /// # Errors
    /// As [`from_triplets`](Self::from_triplets).
    pub(crate) fn from_rows(
        rows: usize,
        columns: usize,
        mut row: impl FnMut(usize, &mut Vec<(usize, T)>),
    ) -> Result<Self> {
        check_width(columns)?;
        let mut own = Vec::new();
        let mut sorted = |p: usize, own: &mut Vec<(usize, T)>| {
            own.clear();
            row(p, own);
            own.sort_by_key(|entry| entry.0);
            match own.last() {
                Some(&(column, _)) if column >= columns => {
                    Err(Error::from(LinearError::Index { row: p, column, rows, columns }))
                }
                _ => Ok(()),
            }
        };
        let mut entries = 0;
        for p in 0..rows {
            sorted(p, &mut own)?;
            entries += own.chunk_by(|a, b| a.0 == b.0).count();
        }
        let mut matrix = Self::empty(columns, rows, entries)?;
        for p in 0..rows {
            sorted(p, &mut own)?;
            matrix.push_row(own.iter().map(|&(column, value)| (column as u32, value)))?;
        }
        Ok(matrix)
    }

    /// The identity of n rows.
    ///
    /// # Errors
    /// As [`from_triplets`](Self::from_triplets).
    pub fn identity(n: usize) -> Result<Self> {
        check_width(n)?;
        let mut matrix = Self::empty(n, n, n)?;
        for row in 0..n {
            matrix.push_row([(row as u32, T::one())])?;
        }
        Ok(matrix)
    }

    /// A matrix without rows and with room for some.
    pub(super) fn empty(width: usize, rows: usize, entries: usize) -> Result<Self> {
        let mut offsets = reserved(rows.saturating_add(1))?;
        offsets.push(0);
        Ok(Self { width, offsets, columns: reserved(entries)?, values: reserved(entries)? })
    }

    /// Appends a row whose columns ascend; neighboring entries of one column are summed.
    pub(super) fn push_row(&mut self, entries: impl IntoIterator<Item = (u32, T)>) -> Result<()> {
        let row = self.rows();
        let first = self.columns.len();
        for (column, value) in entries {
            match (self.columns.last(), self.values.last_mut()) {
                (Some(&last), Some(sum)) if last == column && self.columns.len() > first => *sum += value,
                _ => {
                    self.columns.push(column);
                    self.values.push(value);
                }
            }
        }
        check_entries(row, &self.columns[first..], &self.values[first..])?;
        self.offsets.push(self.columns.len());
        Ok(())
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.width
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Where each row begins in [`column_indices`](Self::column_indices) and [`values`](Self::values), and where the
    /// last one ends.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// The columns of all entries, row by row.
    pub fn column_indices(&self) -> &[u32] {
        &self.columns
    }

    /// The values of all entries, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Columns and values of one row; `None` beyond the rows.
    pub fn row(&self, row: usize) -> Option<(&[u32], &[T])> {
        let range = *self.offsets.get(row)?..*self.offsets.get(row + 1)?;
        Some((&self.columns[range.clone()], &self.values[range]))
    }

    /// All entries (row, column, value), row by row, columns ascending.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, T)> + '_ {
        (0..self.rows()).flat_map(move |row| {
            let (columns, values) = self.range(row);
            columns.iter().zip(values).map(move |(&column, &value)| (row, column as usize, value))
        })
    }

    /// Columns and values of a row that exists.
    #[inline(always)]
    pub(super) fn range(&self, row: usize) -> (&[u32], &[T]) {
        let range = self.offsets[row]..self.offsets[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// y = A x. The order of summation is that of the columns, for any number of threads.
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn multiply(&self, x: &[T], y: &mut [T]) -> Result<()> {
        self.apply(x, y)
    }

    /// y = A x for vectors known to fit.
    pub(super) fn product(&self, x: &[T], y: &mut [T]) {
        each_row(y, |row| {
            let (columns, values) = self.range(row);
            columns.iter().zip(values).fold(T::zero(), |sum, (&q, &value)| sum + value * x[q as usize])
        });
    }

    /// The transposed matrix.
    ///
    /// # Errors
    /// [`LinearError::Columns`] where there are more rows than a column index can name.
    pub fn transposed(&self) -> Result<Self> {
        check_width(self.rows())?;
        let mut counts = vec![0_usize; self.width + 1];
        self.columns.iter().for_each(|&q| counts[q as usize + 1] += 1);
        for q in 0..self.width {
            counts[q + 1] += counts[q];
        }
        let offsets = counts.clone();
        let (mut columns, mut values) = (vec![0; self.entries()], vec![T::zero(); self.entries()]);
        for (row, column, value) in self.triplets() {
            let place = counts[column];
            (columns[place], values[place]) = (row as u32, value);
            counts[column] += 1;
        }
        Ok(Self { width: self.rows(), offsets, columns, values })
    }

    /// The same matrix in `f64`, as the solvers take it.
    pub fn to_f64(&self) -> CsrMatrix<f64> {
        CsrMatrix {
            width: self.width,
            offsets: self.offsets.clone(),
            columns: self.columns.clone(),
            values: self.values.iter().map(|value| value.as_()).collect(),
        }
    }
}

impl<T: Field> Apply<T> for CsrMatrix<T> {
    fn targets(&self) -> usize {
        self.rows()
    }

    fn sources(&self) -> usize {
        self.width
    }

    fn apply(&self, f: &[T], out: &mut [T]) -> Result<()> {
        check(scalars(f), self.width, out, self.rows())?;
        self.product(f, out);
        check_results(scalars(out))
    }
}

fn check_width(columns: usize) -> Result<()> {
    let limit = PARTICLES_HIGH;
    if columns > limit { Err(LinearError::Columns { columns, limit }.into()) } else { Ok(()) }
}

fn check_entries<T: Field>(row: usize, columns: &[u32], values: &[T]) -> Result<()> {
    match columns.iter().zip(values).find(|(_, value)| !value.is_finite()) {
        Some((&column, value)) => {
            Err(Error::from(LinearError::Entry { column: column as usize, value: value.as_() }).at(row))
        }
        None => Ok(()),
    }
}
