//! The invariant subspace of a small real matrix that belongs to its foremost eigenvalues.

use nalgebra::{Complex, DMatrix, DVector, Schur, SymmetricEigen};

use super::norm::norm;
use crate::particles::Random;

type C = Complex<f64>;

/// The eigenvalues of a small matrix in an order of the caller's, with Schur vectors in that order.
pub(super) struct Ordered {
    /// The eigenvalues, foremost first; of a pair of conjugates both, one after the other.
    pub(super) values: Vec<C>,
    /// U with H U = U T.
    vectors: DMatrix<C>,
    /// T, upper triangular with the eigenvalues on its diagonal, in units of `scale`.
    triangle: DMatrix<C>,
}

impl Ordered {
    /// Orders the eigenvalues of H by `key`, the largest first; conjugates must have equal keys. `None` where the
    /// eigenvalues are not found.
    pub(super) fn new(h: &DMatrix<f64>, key: impl Fn(C) -> f64) -> Option<Self> {
        let size = h.nrows();
        let scale = norm(h.as_slice());
        if !(scale > 0.0 && scale.is_finite()) {
            let values = vec![C::new(0.0, 0.0); size];
            let (vectors, triangle) = (DMatrix::identity(size, size), DMatrix::zeros(size, size));
            return (scale == 0.0).then_some(Self { values, vectors, triangle });
        }
        let (u, t) = form(h, scale)?;
        let (mut u, mut t) = (u.map(|x| C::new(x, 0.0)), t.map(|x| C::new(x, 0.0)));
        // How many eigenvalues belong together at each place: 1, or 2 for conjugates.
        let mut units = Vec::new();
        let mut i = 0;
        while i < size {
            let pair = i + 1 < size && t[(i + 1, i)].re != 0.0;
            if pair {
                split(&mut t, &mut u, i);
            }
            let length = 1 + usize::from(pair);
            units.push((key(t[(i, i)] * scale), length));
            i += length;
        }
        // Insertion, since only neighbors can be exchanged.
        for at in 1..units.len() {
            let mut unit = at;
            while unit > 0 && units[unit].0 > units[unit - 1].0 {
                let first: usize = units[..unit - 1].iter().map(|unit| unit.1).sum();
                let (left, right) = (units[unit - 1].1, units[unit].1);
                for moved in 0..right {
                    (first + moved..first + moved + left).rev().for_each(|i| exchange(&mut t, &mut u, i));
                }
                units.swap(unit - 1, unit);
                unit -= 1;
            }
        }
        Some(Self { values: (0..size).map(|i| t[(i, i)] * scale).collect(), vectors: u, triangle: t })
    }

    /// The condition of the foremost eigenvalue.
    pub(super) fn condition_of_first(&self) -> f64 {
        in_triangle(&self.triangle, 0)
    }

    /// The last entry of the eigenvector of the foremost eigenvalue: by how much it fails to be one of the whole.
    pub(super) fn last_of_first(&self) -> f64 {
        self.vectors.row(self.values.len() - 1)[0].norm()
    }

    /// An orthonormal basis of the invariant subspace of the first `count` eigenvalues, or one more where that would
    /// tear conjugates apart.
    pub(super) fn basis(&self, count: usize) -> Option<DMatrix<f64>> {
        let size = self.values.len();
        let mut k = 0;
        while k < count.min(size) {
            // Eigenvalues of a real matrix come in pairs: the partner stands behind.
            k += if self.values[k].im == 0.0 { 1 } else { 2 };
        }
        let k = k.min(size);
        let wanted = self.vectors.columns(0, k);
        // The projector on a subspace closed under conjugation is real.
        let projector = (wanted * wanted.adjoint()).map(|z| z.re);
        let eigen = SymmetricEigen::try_new(projector, f64::EPSILON, 100 * size.max(10))?;
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        Some(DMatrix::from_fn(size, k, |row, column| eigen.eigenvectors[(row, order[column])]))
    }
}

/// All eigenvalues of a real matrix, and its Schur form in units of its norm. `None` where they are not found.
pub(super) fn eigenvalues(a: &DMatrix<f64>) -> Option<(Vec<C>, DMatrix<f64>)> {
    let (size, scale) = (a.nrows(), norm(a.as_slice()));
    if !(scale > 0.0 && scale.is_finite()) {
        return (scale == 0.0).then(|| (vec![C::new(0.0, 0.0); size], DMatrix::zeros(size, size)));
    }
    let t = form(a, scale)?.1;
    let mut values = Vec::with_capacity(size);
    while values.len() < size {
        let i = values.len();
        if i + 1 < size && t[(i + 1, i)] != 0.0 {
            let half = (t[(i, i)] - t[(i + 1, i + 1)]) / 2.0;
            let root = C::new(half * half + t[(i, i + 1)] * t[(i + 1, i)], 0.0).sqrt();
            let middle = t[(i + 1, i + 1)] + half;
            values.extend([(root + middle) * scale, (-root + middle) * scale]);
        } else {
            values.push(C::new(t[(i, i)] * scale, 0.0));
        }
    }
    Some((values, t))
}

/// The condition |x| |y| / |y* x| of eigenvalue number i of [`eigenvalues`], x and y its right and left eigenvectors: by how
/// much more than the matrix it may change.
pub(super) fn condition(t: &DMatrix<f64>, i: usize) -> f64 {
    let size = t.nrows();
    let (mut t, mut none) = (t.map(|x| C::new(x, 0.0)), DMatrix::zeros(0, size));
    (1..size).for_each(|i| {
        if t[(i, i - 1)].re != 0.0 {
            split(&mut t, &mut none, i - 1)
        }
    });
    in_triangle(&t, i)
}

/// The condition of entry i of the diagonal of a triangle.
fn in_triangle(t: &DMatrix<C>, i: usize) -> f64 {
    let (one, zero) = (C::new(1.0, 0.0), C::new(0.0, 0.0));
    let entry = |sum: C, j: usize| {
        let apart = t[(i, i)] - t[(j, j)];
        if sum == zero { zero } else { sum * apart.conj() / apart.norm_sqr() }
    };
    // T x = lambda x ends at i, y* T = lambda y* begins there; both are 1 there, and their product is.
    let (mut x, mut y) = (vec![zero; i + 1], vec![one; t.ncols() - i]);
    x[i] = one;
    for j in (0..i).rev() {
        x[j] = entry((j + 1..=i).fold(zero, |sum, k| sum + t[(j, k)] * x[k]), j);
    }
    for j in i + 1..t.ncols() {
        y[j - i] = entry((i..j).fold(zero, |sum, k| sum + y[k - i] * t[(k, j)]), j);
    }
    let size = |z: &[C]| z.iter().map(|z| z.norm_sqr()).sum::<f64>().sqrt();
    let condition = size(&x) * size(&y);
    if condition.is_finite() { condition } else { f64::INFINITY }
}

/// U and T with A U = scale U T.
fn form(a: &DMatrix<f64>, scale: f64) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    // The package takes an entry for zero beside its diagonal entries, which never happens where these are zero
    // themselves: the shift puts them between 1 and 3.
    let mut shifted = a / scale;
    (0..a.nrows()).for_each(|i| shifted[(i, i)] += 2.0);
    let (u, mut t) = (0..TURNS).find_map(|turn| schur(&shifted, turn))?;
    (0..a.nrows()).for_each(|i| t[(i, i)] -= 2.0);
    Some((u, t))
}

/// How often a Schur form is looked for.
const TURNS: u64 = 4;

/// U and T with A U = U T. The iteration may go in circles: then A is first reflected, P A P with P = 1 - 2 v v^T for a
/// pseudo-random unit vector v, another one each `turn`, and P U taken for U.
fn schur(a: &DMatrix<f64>, turn: u64) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let size = a.nrows();
    let form = |a: &DMatrix<f64>| {
        let to = |eps: f64| Schur::try_new(a.clone(), eps * f64::EPSILON, 100 * size.max(10));
        Some([1.0, 32.0, 1024.0].into_iter().find_map(to)?.unpack())
    };
    if turn == 0 {
        return form(a);
    }
    let mut random = Random::new(turn);
    let v = DVector::from_fn(size, |_, _| random.uniform() - 0.5).normalize();
    let reflection = DMatrix::identity(size, size) - &v * v.transpose() * 2.0;
    let (u, t) = form(&(&reflection * a * &reflection))?;
    Some((reflection * u, t))
}

/// Multiplies rows i and i + 1 of T by the unitary [[a, b], [-b*, a*]], and columns of T and U by its adjoint.
fn rotate(t: &mut DMatrix<C>, u: &mut DMatrix<C>, i: usize, a: C, b: C) {
    for column in i.saturating_sub(1)..t.ncols() {
        let (x, y) = (t[(i, column)], t[(i + 1, column)]);
        t[(i, column)] = a * x + b * y;
        t[(i + 1, column)] = a.conj() * y - b.conj() * x;
    }
    for (matrix, rows) in [(t, i + 2), (u, usize::MAX)] {
        for row in 0..rows.min(matrix.nrows()) {
            let (x, y) = (matrix[(row, i)], matrix[(row, i + 1)]);
            matrix[(row, i)] = a.conj() * x + b.conj() * y;
            matrix[(row, i + 1)] = a * y - b * x;
        }
    }
}

/// Turns the block of two conjugates at i into a triangle.
fn split(t: &mut DMatrix<C>, u: &mut DMatrix<C>, i: usize) {
    let (p, q, r, s) = (t[(i, i)], t[(i, i + 1)], t[(i + 1, i)], t[(i + 1, i + 1)]);
    let half = (p - s) * 0.5;
    let value = s + half + (half * half + q * r).sqrt();
    // (value - s, r) is its eigenvector.
    let (x, y) = (value - s, r);
    let norm = (x.norm_sqr() + y.norm_sqr()).sqrt();
    rotate(t, u, i, x.conj() / norm, y.conj() / norm);
    t[(i + 1, i)] = C::new(0.0, 0.0);
}

/// Exchanges the eigenvalues at i and i + 1.
fn exchange(t: &mut DMatrix<C>, u: &mut DMatrix<C>, i: usize) {
    let (first, second) = (t[(i, i)], t[(i + 1, i + 1)]);
    let (x, y) = (t[(i, i + 1)], second - first);
    let norm = (x.norm_sqr() + y.norm_sqr()).sqrt();
    if norm == 0.0 {
        return;
    }
    rotate(t, u, i, x.conj() / norm, y.conj() / norm);
    t[(i + 1, i)] = C::new(0.0, 0.0);
    // What was exchanged keeps its bits, so that conjugates stay conjugates.
    (t[(i, i)], t[(i + 1, i + 1)]) = (second, first);
}
