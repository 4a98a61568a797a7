//! The Krylov-Schur method: the foremost eigenvalue of a linear map, from products alone.

use nalgebra::{Complex, DMatrix};

use super::invariant::Ordered;
use super::norm::norm;
use crate::error::{Error, LinearError, Result};
use crate::particles::{Random, reserved};

/// Restarts over which a foremost eigenvalue must not be overtaken.
const STEADY: usize = 4;

/// Times the residual, since a subspace holds little of what makes an eigenvalue move.
const MARGIN: f64 = 8.0;

/// What a search found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foremost {
    pub(super) value: Complex<f64>,
    /// |A x - lambda x| of the unit vector x that belongs to it.
    pub(super) residual: f64,
    /// How far that lets the value be off.
    pub(super) error: f64,
    pub(super) applies: usize,
    pub(super) converged: bool,
}

/// How a search is run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    pub(super) subspace: usize,
    pub(super) tolerance: f64,
    /// What entries of the map are rounded by, in units of the radius.
    pub(super) rounding: f64,
    pub(super) most: usize,
}

impl Search {
    /// The eigenvalue with the largest `key` of the map `apply` on vectors of length n >= 1; `radius` is what is known of
    /// max |lambda|, the unit of the tolerance.
    ///
    /// Thick restarts: the subspace is cut back to the Schur vectors of its foremost eigenvalues and grown again.
    pub(super) fn run(
        &self,
        n: usize,
        apply: &mut impl FnMut(&[f64], &mut [f64]) -> Result<()>,
        key: impl Fn(Complex<f64>) -> f64,
        radius: f64,
    ) -> Result<Foremost> {
        let size = self.subspace.min(n);
        let mut basis = Basis::start(n, size)?;
        let mut h = DMatrix::<f64>::zeros(size, size);
        let (mut kept, mut applies, mut steady) = (0, 0, 0);
        let (mut radius, mut before) = (radius, f64::NEG_INFINITY);
        loop {
            // Grow to the full size, or to an invariant subspace.
            let (mut full, mut beta) = (size, 0.0);
            for j in kept..size {
                let column = basis.grow(j, apply)?;
                applies += 1;
                column.iter().take(j + 1).enumerate().for_each(|(i, &x)| h[(i, j)] = x);
                beta = column[j + 1];
                if beta == 0.0 {
                    full = j + 1;
                    break;
                }
                if j + 1 < size {
                    h[(j + 1, j)] = beta;
                }
            }
            let part = h.view((0, 0), (full, full)).into_owned();
            let Some(ordered) = Ordered::new(&part, &key) else {
                return Err(LinearError::NotConverged {
                    iterations: applies,
                    residual: f64::INFINITY,
                    tolerance: self.tolerance,
                }
                .into());
            };
            let value = ordered.values[0];
            radius = ordered.values.iter().fold(radius, |radius, value| radius.max(value.norm()));
            let residual = beta * ordered.last_of_first();
            let unit = self.tolerance * radius;
            steady = if key(value) - before <= unit { steady + 1 } else { 0 };
            before = key(value);
            let converged = beta == 0.0 || (residual <= unit && steady >= STEADY);
            let found = || {
                // Products round, too.
                let error = ordered.reach_of_first(beta, MARGIN * residual.max(self.rounding * radius));
                Ok(Foremost { value, residual, error, applies, converged })
            };
            if converged || applies >= self.most || full < size || size < 4 {
                return found();
            }
            let Some(turn) = ordered.basis((size / 3).max(2)).filter(|turn| turn.ncols() < size) else {
                return found();
            };
            kept = turn.ncols();
            let small = turn.transpose() * &part * &turn;
            h.fill(0.0);
            h.view_mut((0, 0), (kept, kept)).copy_from(&small);
            (0..kept).for_each(|i| h[(kept, i)] = beta * turn[(size - 1, i)]);
            basis.turn(&turn);
        }
    }
}

/// Orthonormal vectors, one after the other, and the next one.
struct Basis {
    n: usize,
    vectors: Vec<f64>,
    column: Vec<f64>,
    spare: Vec<f64>,
}

impl Basis {
    /// Room for `size` + 1 vectors, the first of which is pseudo-random.
    fn start(n: usize, size: usize) -> Result<Self> {
        let count = n.saturating_mul(size + 1);
        let mut vectors = reserved(count)?;
        vectors.resize(count, 0.0);
        let mut random = Random::new(0x5eed);
        vectors[..n].iter_mut().for_each(|x| *x = 2.0 * random.uniform() - 1.0);
        let whole = norm(&vectors[..n]);
        vectors[..n].iter_mut().for_each(|x| *x /= whole);
        Ok(Self { n, vectors, column: vec![0.0; size + 1], spare: vec![0.0; size + 1] })
    }

    /// Makes vector j + 1 from A times vector j; returns what of it lies along vectors 0 to j, and then the length of
    /// the rest, 0 where that is rounding.
    fn grow(&mut self, j: usize, apply: &mut impl FnMut(&[f64], &mut [f64]) -> Result<()>) -> Result<&[f64]> {
        let n = self.n;
        let (known, rest) = self.vectors.split_at_mut((j + 1) * n);
        let next = &mut rest[..n];
        next.fill(0.0);
        apply(&known[j * n..], next)?;
        if let Some(p) = next.iter().position(|x| !x.is_finite()) {
            return Err(Error::from(LinearError::Value { value: next[p] }).at(p));
        }
        let whole = norm(next);
        self.column.fill(0.0);
        // Twice is enough.
        for _ in 0..2 {
            for (column, v) in self.column.iter_mut().zip(known.chunks_exact(n)) {
                let along: f64 = v.iter().zip(next.iter()).map(|(v, x)| v * x).sum();
                next.iter_mut().zip(v).for_each(|(x, v)| *x -= along * v);
                *column += along;
            }
        }
        let left = norm(next);
        if left > 16.0 * f64::EPSILON * whole * (n as f64).sqrt() {
            next.iter_mut().for_each(|x| *x /= left);
            self.column[j + 1] = left;
        }
        Ok(&self.column)
    }

    /// Replaces the first vectors by the combinations that `turn` names, and lets the last one follow them.
    fn turn(&mut self, turn: &DMatrix<f64>) {
        let (n, size, kept) = (self.n, turn.nrows(), turn.ncols());
        for p in 0..n {
            for (column, out) in self.spare.iter_mut().take(kept).enumerate() {
                *out = (0..size).map(|i| self.vectors[i * n + p] * turn[(i, column)]).sum();
            }
            for (column, &x) in self.spare.iter().take(kept).enumerate() {
                self.vectors[column * n + p] = x;
            }
        }
        self.vectors.copy_within(size * n..(size + 1) * n, kept * n);
    }
}
