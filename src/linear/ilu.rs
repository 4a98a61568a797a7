//! Incomplete factors without fill-in.

use super::csr::CsrMatrix;
use crate::error::{Error, LinearError, Result};
use crate::particles::reserved;

/// The incomplete factors L U ~ A that are zero wherever A is: ILU(0), the preconditioner of [`Gmres`](crate::Gmres).
///
/// L has a unit diagonal; (L U)_pq = A_pq on the pattern of A, to which a diagonal place is added where it lacks one. Rows are
/// eliminated in their order, but those whose diagonal entry is not the largest of the row after all others: rows of
/// normal derivatives, which would spoil what is eliminated after them. On a tridiagonal matrix without such rows the factors
/// are complete. Cost: for every entry before the diagonal one sweep over two rows; memory as the matrix.
///
/// ```
/// use parops::{CsrMatrix, Ilu0};
/// let a = CsrMatrix::from_triplets(2, 2, [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 4.0), (1, 1, 3.0)])?;
/// let mut x = [3.0, 7.0];
/// Ilu0::new(&a)?.solve(&mut x)?;
/// assert_eq!(x, [1.0, 1.0]);
/// # parops::Result::Ok(())
/// ```
///
/// Source: J. A. Meijerink and H. A. van der Vorst, 1977.
#[derive(Clone, Debug, PartialEq)]
pub struct Ilu0 {
    /// L before the diagonal, U from it on, columns in the order of elimination.
    factors: CsrMatrix<f64>,
    /// The place of the diagonal entry of each row.
    diagonal: Vec<usize>,
    /// The rows in the order of their elimination; empty where that is their own.
    order: Vec<u32>,
}

impl Ilu0 {
    /// Factors a square matrix.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`]; [`LinearError::ZeroPivot`] naming the row whose pivot is not above n eps max_q |A_pq|
    /// for its n entries, which is what rounding leaves of zero, or not finite.
    pub fn new(matrix: &CsrMatrix<f64>) -> Result<Self> {
        let n = square(matrix)?;
        let (mut factors, order) = in_order(with_diagonal(matrix)?)?;
        let mut diagonal: Vec<usize> = reserved(n)?;
        diagonal.resize(n, 0);
        // place[q] is where column q stands in the row at work.
        let mut place = vec![usize::MAX; n];
        for row in (0..n).map(|i| eliminated(&order, i)) {
            let range = factors.offsets[row]..factors.offsets[row + 1];
            let mut largest = 0.0_f64;
            for at in range.clone() {
                place[factors.columns[at] as usize] = at;
                largest = largest.max(factors.values[at].abs());
            }
            let mut own = range.start;
            while factors.columns[own] as usize != row {
                let upper = factors.columns[own] as usize;
                let pivot = diagonal[upper];
                let factor = factors.values[own] / factors.values[pivot];
                factors.values[own] = factor;
                for at in pivot + 1..factors.offsets[upper + 1] {
                    let target = place[factors.columns[at] as usize];
                    if target != usize::MAX {
                        factors.values[target] -= factor * factors.values[at];
                    }
                }
                own += 1;
            }
            let pivot = factors.values[own];
            if !(pivot.is_finite() && pivot.abs() > range.len() as f64 * f64::EPSILON * largest) {
                return Err(Error::from(LinearError::ZeroPivot { pivot, largest }).at(row));
            }
            diagonal[row] = own;
            factors.columns[range].iter().for_each(|&q| place[q as usize] = usize::MAX);
        }
        Ok(Self { factors, diagonal, order })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// Overwrites x with the solution of L U y = x. Allocates nothing.
    ///
    /// # Errors
    /// [`LinearError::Length`] for a vector of another length.
    pub fn solve(&self, x: &mut [f64]) -> Result<()> {
        check_length(x.len(), self.rows())?;
        let Self { factors, diagonal, order } = self;
        let sum = |from: usize, to: usize, x: &[f64]| -> f64 {
            let entries = factors.columns[from..to].iter().zip(&factors.values[from..to]);
            entries.fold(0.0, |sum, (&q, value)| sum + value * x[q as usize])
        };
        let rows = (0..diagonal.len()).map(|i| eliminated(order, i)).map(|row| (row, diagonal[row]));
        for (row, own) in rows.clone() {
            x[row] -= sum(factors.offsets[row], own, x);
        }
        for (row, own) in rows.rev() {
            x[row] = (x[row] - sum(own + 1, factors.offsets[row + 1], x)) / factors.values[own];
        }
        Ok(())
    }

    /// Overwrites x with the solution of (L U)^T y = x. Allocates nothing.
    ///
    /// # Errors
    /// [`LinearError::Length`] for a vector of another length.
    pub fn solve_transposed(&self, x: &mut [f64]) -> Result<()> {
        check_length(x.len(), self.rows())?;
        let Self { factors, diagonal, order } = self;
        let spread = |from: usize, to: usize, y: f64, x: &mut [f64]| {
            for (&q, value) in factors.columns[from..to].iter().zip(&factors.values[from..to]) {
                x[q as usize] -= value * y;
            }
        };
        let rows = (0..diagonal.len()).map(|i| eliminated(order, i)).map(|row| (row, diagonal[row]));
        for (row, own) in rows.clone() {
            x[row] /= factors.values[own];
            spread(own + 1, factors.offsets[row + 1], x[row], x);
        }
        for (row, own) in rows.rev() {
            spread(factors.offsets[row], own, x[row], x);
        }
        Ok(())
    }
}

/// The number of rows of a square matrix.
pub(super) fn square(matrix: &CsrMatrix<f64>) -> Result<usize> {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    if rows == columns { Ok(rows) } else { Err(LinearError::NotSquare { rows, columns }.into()) }
}

/// Refuses a vector of another length than the matrix has rows.
pub(super) fn check_length(found: usize, needed: usize) -> Result<()> {
    if found == needed { Ok(()) } else { Err(LinearError::Length { found, needed }.into()) }
}

/// The matrix with a zero on the diagonal of every row that has no entry there.
fn with_diagonal(matrix: &CsrMatrix<f64>) -> Result<CsrMatrix<f64>> {
    let n = matrix.rows();
    let lacks = |row: usize| matrix.range(row).0.binary_search(&(row as u32)).is_err();
    let lacking = (0..n).filter(|&row| lacks(row)).count();
    let mut full = CsrMatrix::empty(n, n, matrix.entries() + lacking)?;
    for row in 0..n {
        let (columns, values) = matrix.range(row);
        let before = columns.partition_point(|&q| (q as usize) < row);
        let entry = |(&q, &value)| (q, value);
        let own = lacks(row).then_some((row as u32, 0.0));
        let left = columns[..before].iter().zip(&values[..before]).map(entry);
        full.push_row(left.chain(own).chain(columns[before..].iter().zip(&values[before..]).map(entry)))?;
    }
    Ok(full)
}

/// The row that is eliminated as number i.
#[inline(always)]
fn eliminated(order: &[u32], i: usize) -> usize {
    order.get(i).map_or(i, |&row| row as usize)
}

/// The order of elimination, weak rows last, and the matrix with the columns of every row in that order.
fn in_order(mut matrix: CsrMatrix<f64>) -> Result<(CsrMatrix<f64>, Vec<u32>)> {
    let n = matrix.rows();
    let weak: Vec<bool> = (0..n)
        .map(|row| {
            let (columns, values) = matrix.range(row);
            let own = columns.binary_search(&(row as u32)).map_or(0.0, |at| values[at].abs());
            values.iter().any(|value| value.abs() > own)
        })
        .collect();
    if !weak.contains(&true) {
        return Ok((matrix, Vec::new()));
    }
    let mut order: Vec<u32> = reserved(n)?;
    order.extend((0..n as u32).filter(|&row| !weak[row as usize]));
    order.extend((0..n as u32).filter(|&row| weak[row as usize]));
    let mut last = Vec::new();
    for row in 0..n {
        let range = matrix.offsets[row]..matrix.offsets[row + 1];
        let mut to = range.start;
        for at in range.clone() {
            let entry = (matrix.columns[at], matrix.values[at]);
            if weak[entry.0 as usize] {
                last.push(entry);
            } else {
                (matrix.columns[to], matrix.values[to]) = entry;
                to += 1;
            }
        }
        for (at, entry) in (to..range.end).zip(last.drain(..)) {
            (matrix.columns[at], matrix.values[at]) = entry;
        }
    }
    Ok((matrix, order))
}
