//! The arithmetic of one row, the same for stored weights and for weights made on the spot.

use super::Field;

/// A row of K outputs: out_k = d_k f_p + sum_q w_qk (f_q - f_p), or sum_q w_qk f_q off the particles.
pub(super) trait Sweep<T: Field, const K: usize> {
    /// The source that is the target.
    fn center(&self) -> Option<usize>;

    /// d_k; `None` where all are zero.
    fn diagonal(&self) -> Option<[T; K]>;

    /// Sources and their weights in the order of summation.
    fn pairs(&self) -> impl Iterator<Item = (usize, [T; K])>;

    /// All outputs of a scalar field.
    #[inline(always)]
    fn all(&self, f: &[T]) -> [T; K] {
        let own = self.center().map(|center| f[center]);
        let mut sum = [T::zero(); K];
        if let (Some(d), Some(fp)) = (self.diagonal(), own) {
            for (sum, d) in sum.iter_mut().zip(d) {
                *sum += d * fp;
            }
        }
        for (q, w) in self.pairs() {
            let value = own.map_or(f[q], |fp| f[q] - fp);
            for (sum, w) in sum.iter_mut().zip(w) {
                *sum += w * value;
            }
        }
        sum
    }

    /// The contraction with a vector field.
    #[inline(always)]
    fn dot(&self, f: &[[T; K]]) -> T {
        let own = self.center().map(|center| f[center]);
        let mut sum = T::zero();
        if let (Some(d), Some(fp)) = (self.diagonal(), own) {
            for k in 0..K {
                sum += d[k] * fp[k];
            }
        }
        for (q, w) in self.pairs() {
            for k in 0..K {
                sum += w[k] * own.map_or(f[q][k], |fp| f[q][k] - fp[k]);
            }
        }
        sum
    }

    /// The derivative of a scalar field along v.
    #[inline(always)]
    fn along(&self, v: &[T; K], f: &[T]) -> T {
        let along = |w: [T; K]| w.iter().zip(v).fold(T::zero(), |sum, (&w, &v)| sum + v * w);
        let own = self.center().map(|center| f[center]);
        let mut sum = T::zero();
        if let (Some(d), Some(fp)) = (self.diagonal(), own) {
            sum += along(d) * fp;
        }
        for (q, w) in self.pairs() {
            sum += along(w) * own.map_or(f[q], |fp| f[q] - fp);
        }
        sum
    }
}
