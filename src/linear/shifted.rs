//! The matrix of an implicit step, and its product by differences.

use super::csr::CsrMatrix;
use crate::apply::blocks::each_row;
use crate::error::Result;

impl CsrMatrix {
    /// I + c A, but rows p of `kept` as they are in A; every other row has a diagonal entry.
    pub(crate) fn shifted(&self, c: f64, kept: &[bool]) -> Result<Self> {
        let n = self.rows();
        let mut matrix = Self::empty(self.columns(), n, self.entries() + n)?;
        for (p, kept) in (0..n).zip(kept) {
            let (columns, values) = self.range(p);
            let entries = columns.iter().copied().zip(values.iter().copied());
            if *kept {
                matrix.push_row(entries)?;
                continue;
            }
            let (left, right) = columns.split_at(columns.partition_point(|&q| (q as usize) < p));
            let scaled = |(&q, &value): (&u32, &f64)| (q, c * value);
            let before = left.iter().zip(&values[..left.len()]).map(scaled);
            let after = right.iter().zip(&values[left.len()..]).map(scaled);
            matrix.push_row(before.chain([(p as u32, 1.0)]).chain(after))?;
        }
        Ok(matrix)
    }

    /// The sum of each row; 0 where it is within the rounding of n additions, n eps sum |A_pq|.
    pub(crate) fn row_sums(&self) -> Vec<f64> {
        let sum = |row: usize| {
            let (_, values) = self.range(row);
            let (sum, size) = values.iter().fold((0.0, 0.0), |(sum, size), value| (sum + value, size + value.abs()));
            if f64::abs(sum) <= values.len() as f64 * f64::EPSILON * size { 0.0 } else { sum }
        };
        (0..self.rows()).map(sum).collect()
    }

    /// y = A x as y_p = s_p x_p + sum_q A_pq (x_q - x_p) with the sums s of the rows, for vectors known to fit: where
    /// s_p = 0 constants are annihilated exactly.
    pub(crate) fn product_by_differences(&self, sums: &[f64], x: &[f64], y: &mut [f64]) {
        each_row(y, |row| {
            let (columns, values) = self.range(row);
            let own = x[row];
            columns.iter().zip(values).fold(sums[row] * own, |sum, (&q, &value)| sum + value * (x[q as usize] - own))
        });
    }
}
