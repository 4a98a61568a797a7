//! The moment system of one stencil: the windowed, scaled monomials of its neighbors, and what they must sum to.

use super::integral::required_moment;
use super::window::Window;
use crate::error::{MultiIndexError, Result};
use crate::multi_index::{MultiIndex, Term, graded};
use crate::scalar::{Scalar, square};

/// Find w with sum_q w_q z_q^alpha = b_alpha for all `low` <= |alpha| <= m + r - 1.
///
/// With B = E V, V_qj = z_q^alpha_j (n x l) and E = diag(sqrt(window)), the weights are w = E^2 V a, that is the
/// least-norm solution in the measure of the window. The columns of B are scaled by powers of two to norms between
/// 1/2 and 1, which is exact. Made once for an operator, filled for one stencil after another without allocation.
///
/// Source: notes 001, eq. 5.39 to 5.45, with errata 20 to 24.
#[derive(Clone, Debug)]
pub struct MomentSystem<T, const D: usize> {
    basis: Vec<MultiIndex<D>>,
    /// z^alpha_j = z_axis z^alpha_parent; no parent means the constant.
    parents: Vec<(Option<usize>, Option<usize>)>,
    /// K right-hand sides of l conditions.
    required: Vec<T>,
    /// The largest |b_alpha|: the unit of the residual.
    largest: T,
    outputs: usize,
    n: usize,
    roots: Vec<T>,
    /// B, column after column.
    columns: Vec<T>,
    scales: Vec<T>,
}

/// By how much weights miss their conditions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual<T> {
    /// max_alpha |sum_q w_q z_q^alpha - b_alpha|.
    pub absolute: T,
    /// max_alpha sum_q |w_q z_q^alpha|, the unit of its rounding.
    pub terms: T,
}

impl<T: Scalar, const D: usize> MomentSystem<T, D> {
    /// The conditions `low` <= |alpha| <= m + r - 1 for one or several operators of one degree m.
    ///
    /// # Errors
    /// [`MultiIndexError::Order`] for r = 0 or above 8; [`MultiIndexError::Degree`] where beta! does not fit.
    pub fn new(outputs: &[Vec<Term<D>>], degree: u32, order: u32, low: u32) -> Result<Self> {
        if !(1..=8).contains(&order) {
            return Err(MultiIndexError::Order { order, low: 1, high: 8 }.into());
        }
        let basis: Vec<MultiIndex<D>> = graded(low, degree + order - 1).collect();
        let mut required = Vec::with_capacity(outputs.len() * basis.len());
        for terms in outputs {
            for &alpha in &basis {
                required.push(T::lift(required_moment(terms, alpha)?));
            }
        }
        let parent = |alpha: &MultiIndex<D>| {
            let mut exponents = alpha.exponents();
            let axis = exponents.iter().position(|&e| e > 0);
            if let Some(axis) = axis {
                exponents[axis] -= 1;
            }
            (axis, basis.iter().position(|other| other.exponents() == exponents && axis.is_some()))
        };
        let parents = basis.iter().map(parent).collect();
        let largest = required.iter().fold(T::zero(), |largest, b| largest.max(b.abs()));
        let scales = vec![T::one(); basis.len()];
        let (outputs, columns, roots) = (outputs.len(), Vec::new(), Vec::new());
        Ok(Self { basis, parents, required, largest, outputs, n: 0, roots, columns, scales })
    }

    /// Number of conditions l.
    pub fn conditions(&self) -> usize {
        self.basis.len()
    }

    /// The multi-indices of the conditions, in graded order.
    pub(super) fn basis(&self) -> &[MultiIndex<D>] {
        &self.basis
    }

    /// Number of neighbors n of the stencil it was filled with.
    pub fn neighbors(&self) -> usize {
        self.n
    }

    /// Number of right-hand sides K.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// max |b_alpha|, at most beta! for one derivative.
    pub fn largest_required(&self) -> T {
        self.largest
    }

    /// The l conditions b_alpha of output k, in graded order.
    pub fn required(&self, k: usize) -> &[T] {
        &self.required[k * self.conditions()..][..self.conditions()]
    }

    /// Fills B for the scaled separations z = (x_p - x_q)/epsilon; `radius` is the cutoff in units of epsilon.
    pub fn fill(&mut self, z: &[[T; D]], window: Window, radius: T) {
        self.fill_windowed(z, |_, squared| window.root(squared, radius));
    }

    /// Fills B for the scaled separations z and a window whose square root is `root(q, |z_q|^2)`.
    pub(crate) fn fill_windowed(&mut self, z: &[[T; D]], root: impl Fn(usize, T) -> T) {
        self.n = z.len();
        let n = self.n;
        self.roots.clear();
        self.roots.extend(z.iter().enumerate().map(|(q, z)| root(q, square(z))));
        self.columns.clear();
        self.columns.resize(n * self.conditions(), T::zero());
        for j in 0..self.conditions() {
            let (known, rest) = self.columns.split_at_mut(j * n);
            let column = &mut rest[..n];
            let (axis, parent) = self.parents[j];
            let parent = parent.map_or(self.roots.as_slice(), |parent| &known[parent * n..][..n]);
            for ((entry, &parent), z) in column.iter_mut().zip(parent).zip(z) {
                *entry = axis.map_or(parent, |axis| parent * z[axis]);
            }
        }
        for (column, scale) in self.columns.chunks_exact_mut(n.max(1)).zip(&mut self.scales) {
            let norm = column.iter().fold(T::zero(), |sum, &x| sum + x * x).sqrt();
            *scale = power_of_two_below_inverse(norm);
            column.iter_mut().for_each(|x| *x *= *scale);
        }
    }

    /// The diagonal of E: the square root of the window at each neighbor.
    pub(super) fn roots(&self) -> &[T] {
        &self.roots
    }

    /// Column j of the scaled B.
    pub(super) fn column(&self, j: usize) -> &[T] {
        &self.columns[j * self.n..][..self.n]
    }

    /// All columns of the scaled B, one after the other.
    pub(super) fn columns(&self) -> &[T] {
        &self.columns
    }

    /// b of output k in the scaling of B.
    pub(super) fn scaled_required(&self, k: usize) -> impl Iterator<Item = T> + '_ {
        self.required(k).iter().zip(&self.scales).map(|(&b, &scale)| b * scale)
    }

    /// w = E y: from the least-norm solution y to weights.
    pub(super) fn window_into(&self, y: &[T], w: &mut [T]) {
        for ((w, &y), &root) in w.iter_mut().zip(y).zip(&self.roots) {
            *w = y * root;
        }
    }

    /// V^T w of condition j and the sum of absolute terms, for y = E^-1 w.
    ///
    /// What an addition loses is carried along: the bounds on a residual know l and not n, and the rounding of a plain
    /// sum of a thousand terms alone would break them.
    fn moment(&self, j: usize, y: &[T]) -> (T, T) {
        let (mut sum, mut lost, mut terms) = (T::zero(), T::zero(), T::zero());
        for (&b, &y) in self.column(j).iter().zip(y) {
            let product = b * y;
            let next = sum + product;
            let added = next - sum;
            lost += (sum - (next - added)) + (product - added);
            sum = next;
            terms += product.abs();
        }
        ((sum + lost) / self.scales[j], terms / self.scales[j])
    }

    /// b - V^T w in the scaling of B, for y = E^-1 w: what a corrected step starts from.
    pub(super) fn defect(&self, k: usize, y: &[T], out: &mut [T]) {
        for (j, (out, &b)) in out.iter_mut().zip(self.required(k)).enumerate() {
            *out = (b - self.moment(j, y).0) * self.scales[j];
        }
    }

    /// By how much y = E^-1 w misses the conditions of output k.
    pub(super) fn residual(&self, k: usize, y: &[T]) -> Residual<T> {
        let mut residual = Residual { absolute: T::zero(), terms: T::zero() };
        for (j, &b) in self.required(k).iter().enumerate() {
            let (moment, terms) = self.moment(j, y);
            residual.absolute = larger(residual.absolute, (moment - b).abs());
            residual.terms = residual.terms.max(terms);
        }
        residual
    }
}

/// The larger of two misses; one that is no number is larger than all, and stays.
#[inline(always)]
pub(super) fn larger<T: Scalar>(a: T, b: T) -> T {
    if a >= b || !a.is_finite() { a } else { b }
}

/// The power of two in (1/(2 x), 1/x], 1 for 0: scaling by it is exact.
fn power_of_two_below_inverse<T: Scalar>(x: T) -> T {
    if !(x > T::zero()) {
        return T::one();
    }
    let two = T::lift(2.0);
    let mut scale = T::one();
    while x * scale > T::one() {
        scale /= two;
    }
    while x * scale * two <= T::one() {
        scale *= two;
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::{larger, power_of_two_below_inverse};

    #[test]
    fn scales_are_powers_of_two_that_bring_norms_between_one_half_and_one() {
        let mantissas = [1.0, 1.0_f64.next_up(), 1.3, 1.5, 2.0_f64.next_down()];
        for x in (-300..300).flat_map(|exponent| mantissas.map(|x| x * 2.0_f64.powi(exponent))) {
            let scale = power_of_two_below_inverse(x);
            assert!(0.5 < scale * x && scale * x <= 1.0, "{x:e}");
            assert_eq!(scale.to_bits() << 12, 0, "{x:e}");
        }
        assert_eq!([0.0, f64::NAN].map(power_of_two_below_inverse), [1.0; 2]);
    }

    #[test]
    fn misses_that_are_no_numbers_do_not_hide_behind_later_ones() {
        let largest = |misses: [f64; 3]| misses.into_iter().fold(0.0, larger);
        assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
        for bad in [f64::NAN, f64::INFINITY] {
            let all = [[bad, 1.0, 2.0], [1.0, bad, 2.0], [1.0, 2.0, bad]];
            assert!(all.into_iter().all(|misses| !largest(misses).is_finite()));
        }
    }
}
