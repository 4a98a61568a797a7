//! The pairs of one row, for sums that live outside this layer.

use std::collections::BTreeMap;

use super::Field;
use super::rows::Rows;

impl<const K: usize, T: Field> Rows<[f64; K], T> {
    /// The diagonal of row p, where it is not zero throughout, and its pairs (q, w_pq) in the order of summation.
    #[inline(always)]
    pub(crate) fn pairs(&self, p: usize) -> (Option<[T; K]>, impl Iterator<Item = (usize, [T; K])>) {
        let range = self.offsets[p]..self.offsets[p + 1];
        let pairs = self.columns[range.clone()].iter().zip(&self.weights[range]);
        (self.diagonal.get(p).copied(), pairs.map(|(&q, &w)| (q as usize, w)))
    }

    /// Whether Gershgorin's discs, the row sums around the diagonal, leave no eigenvalue a real part above `tolerance` times
    /// their modulus: A_pp + sum_q |A_pq| = d_p + 2 sum_q max(-w_pq, 0) is that small in every row and output.
    pub(crate) fn cannot_grow(&self, tolerance: f64) -> bool {
        (0..self.targets()).all(|p| {
            let (diagonal, pairs) = self.pairs(p);
            let mut right = diagonal.map_or([0.0; K], |d| d.map(|d| d.as_()));
            let mut size = right.map(f64::abs);
            for (_, w) in pairs {
                for ((right, size), w) in right.iter_mut().zip(&mut size).zip(w) {
                    let w: f64 = w.as_();
                    *right += 2.0 * (-w).max(0.0);
                    *size += w.abs();
                }
            }
            right.iter().zip(size).all(|(right, size)| *right <= tolerance * size)
        })
    }

    /// The matrix entries (q, A_pq) of row p, where target p is source p, each the contraction of its K weights.
    pub(crate) fn entries_of(&self, p: usize, contract: impl Fn([f64; K]) -> f64, entry: &mut dyn FnMut(usize, f64)) {
        let (diagonal, pairs) = self.pairs(p);
        let mut own = diagonal.map_or(0.0, |d| contract(d.map(|d| d.as_())));
        for (q, w) in pairs {
            let w = contract(w.map(|w| w.as_()));
            own -= w;
            entry(q, w);
        }
        entry(p, own);
    }
}

impl<T: Field> Rows<[f64; 1], T> {
    /// The entries of row p of `weight` times a power of `factor` times these rows.
    pub(crate) fn power_of(&self, p: usize, weight: f64, factor: f64, power: usize) -> BTreeMap<usize, f64> {
        (0..power).fold(BTreeMap::from([(p, weight)]), |row, _| {
            let mut next = BTreeMap::new();
            for (q, weight) in row {
                let weight = factor * weight;
                self.entries_of(q, |[w]| weight * w, &mut |q, w| *next.entry(q).or_insert(0.0) += w);
            }
            next
        })
    }
}
