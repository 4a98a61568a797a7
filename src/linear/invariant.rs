//! The invariant subspace of a small real matrix that belongs to its foremost eigenvalues.

use nalgebra::{Complex, DMatrix, DVector, Schur, SymmetricEigen};

use super::norm::norm;
use super::pseudospectrum::reach;
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
    /// The norm of H.
    scale: f64,
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
            return (scale == 0.0).then_some(Self { values, vectors, triangle, scale });
        }
        let (u, t) = form(h, scale)?;
        let (mut u, mut t) = (u.map(|x| C::new(x, 0.0)), t.map(|x| C::new(x, 0.0)));
        // How many eigenvalues belong together at each place: 1, or 2 for conjugates.
        let blocks = triangulate(&mut t, &mut u);
        let mut units: Vec<_> = blocks.into_iter().map(|(i, length)| (key(t[(i, i)] * scale), length)).collect();
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
        Some(Self { values: (0..size).map(|i| t[(i, i)] * scale).collect(), vectors: u, triangle: t, scale })
    }

    /// How far left a change of H that large may move the foremost eigenvalue, where `beta` is what follows the last vector.
    pub(super) fn reach_of_first(&self, beta: f64, change: f64) -> f64 {
        if self.scale == 0.0 {
            return change;
        }
        let below: Vec<C> = self.vectors.row(self.values.len() - 1).iter().map(|z| z * (beta / self.scale)).collect();
        // A change of the smallest maps may round to 0.
        self.scale * reach(&self.triangle, &below, 0, (change / self.scale).max(f64::EPSILON))
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

/// All eigenvalues of a real matrix in units of its norm, on the diagonal of the triangle of its Schur form. `None` where they
/// are not found.
pub(super) fn eigenvalues(a: &DMatrix<f64>) -> Option<DMatrix<C>> {
    let (size, scale) = (a.nrows(), norm(a.as_slice()));
    if !(scale > 0.0 && scale.is_finite()) {
        return (scale == 0.0).then(|| DMatrix::zeros(size, size));
    }
    let mut t = form(a, scale)?.1.map(|x| C::new(x, 0.0));
    triangulate(&mut t, &mut DMatrix::zeros(0, size));
    Some(t)
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

/// Turns the blocks of conjugates of a real Schur form into triangles; where blocks begin, and how long they are.
fn triangulate(t: &mut DMatrix<C>, u: &mut DMatrix<C>) -> Vec<(usize, usize)> {
    let (mut blocks, mut i) = (Vec::new(), 0);
    while i < t.nrows() {
        let pair = i + 1 < t.nrows() && t[(i + 1, i)].re != 0.0;
        if pair {
            split(t, u, i);
        }
        let length = 1 + usize::from(pair);
        blocks.push((i, length));
        i += length;
    }
    blocks
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
