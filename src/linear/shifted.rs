//! The matrix of an implicit step.

use super::csr::CsrMatrix;
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
}
