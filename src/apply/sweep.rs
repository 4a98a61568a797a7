//! The arithmetic of one row, the same for stored weights and for weights made on the spot.

use std::borrow::Borrow;

use super::Field;

/// A row of K outputs: out_k = d_k f_p + sum_q w_qk (f_q - f_p), or sum_q w_qk f_q off the particles.
pub(super) trait Sweep<T: Field, const K: usize> {
    /// The source that is the target.
    fn center(&self) -> Option<usize>;

    /// d_k; `None` where all are zero.
    fn diagonal(&self) -> Option<[T; K]>;

    /// Sources and their weights in the order of summation.
    fn pairs(&self) -> impl Iterator<Item = (usize, [T; K])>;

    /// The sum over the row of what `add` makes of the weights and of a field of C components: d and f_p first, then
    /// w_q and f_q - f_p, pair by pair.
    #[inline(always)]
    fn sum<const C: usize, S>(
        &self,
        zero: S,
        value: impl Fn(usize) -> [T; C],
        add: impl Fn(&mut S, &[T; K], &[T; C]),
    ) -> S {
        let mut sum = zero;
        let Some(own) = self.center().map(&value) else {
            self.pairs().for_each(|(q, w)| add(&mut sum, &w, &value(q)));
            return sum;
        };
        if let Some(d) = self.diagonal() {
            add(&mut sum, &d, &own);
        }
        for (q, w) in self.pairs() {
            let mut difference = value(q);
            difference.iter_mut().zip(&own).for_each(|(f, own)| *f -= *own);
            add(&mut sum, &w, &difference);
        }
        sum
    }

    /// All outputs of a scalar field.
    #[inline(always)]
    fn all(&self, f: &[T]) -> [T; K] {
        self.sum([T::zero(); K], |q| [f[q]], |sum, w, f| sum.iter_mut().zip(w).for_each(|(sum, w)| *sum += *w * f[0]))
    }

    /// The contraction with a vector field.
    #[inline(always)]
    fn dot(&self, f: &[[T; K]]) -> T {
        self.sum(T::zero(), |q| f[q], |sum, w, f| w.iter().zip(f).for_each(|(w, f)| *sum += *w * *f))
    }

    /// The derivative of a scalar field along v.
    #[inline(always)]
    fn along(&self, v: &[T; K], f: &[T]) -> T {
        let along = |w: &[T; K]| w.iter().zip(v).fold(T::zero(), |sum, (&w, &v)| sum + v * w);
        self.sum(T::zero(), |q| [f[q]], |sum, w, f| *sum += along(w) * f[0])
    }

    /// All outputs of F fields, each as it would be alone.
    #[inline(always)]
    fn jacobian<const F: usize>(&self, f: &[[T; F]]) -> [[T; K]; F] {
        self.sum(
            [[T::zero(); K]; F],
            |q| f[q],
            |sum, w, f| {
                for (sum, f) in sum.iter_mut().zip(f) {
                    sum.iter_mut().zip(w).for_each(|(sum, w)| *sum += *w * *f);
                }
            },
        )
    }

    /// Output 0 of C fields, each as it would be alone; C sums and C values f_p should fit the registers.
    #[inline(always)]
    fn lanes<const C: usize, V: Borrow<[T; C]>>(&self, value: impl Fn(usize) -> V) -> [T; C] {
        let mut sum = [T::zero(); C];
        let Some(center) = self.center() else {
            for (q, w) in self.pairs() {
                let f = value(q);
                let f = f.borrow();
                for i in 0..C {
                    sum[i] += w[0] * f[i];
                }
            }
            return sum;
        };
        let own = *value(center).borrow();
        if let Some(d) = self.diagonal() {
            for i in 0..C {
                sum[i] += d[0] * own[i];
            }
        }
        for (q, w) in self.pairs() {
            let f = value(q);
            let f = f.borrow();
            for i in 0..C {
                sum[i] += w[0] * (f[i] - own[i]);
            }
        }
        sum
    }
}
