//! How much hyperviscosity advection rows need.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVectorView, DVectorViewMut};

use super::growth::COMPRESSED;
use crate::apply::{Hyperviscosity, Rows};
use crate::error::{Error, ErrorKind, LinearError, Result};
use crate::linear::{OPEN, SpectrumEstimator, least};
use crate::scalar::length;
use crate::scale::Spacing;

/// The growth that is left, in |v|_max / h, where eigenvalues are exact: above their rounding, below what runs refuse.
const NONE: f64 = 1e-9;

/// The same elsewhere: finer estimates do not resolve the spectrum of an advection operator.
const GROWTH: f64 = 1e-3;

/// Vectors of the estimates: growth amid the imaginary axis is missed with fewer.
const VECTORS: usize = 64;

/// Products of an estimate: three times as many found no more growth, on 32 sets of 676 and 900 particles.
const PRODUCTS: usize = 1000;

/// Particles of a part of a set.
const PART: usize = 400;

/// Advection rows, and the term that damps what they let grow.
pub(super) struct Damping<const D: usize> {
    pub(super) rows: Rows<[f64; D]>,
    pub(super) term: Hyperviscosity,
}

impl<const D: usize> Damping<D> {
    /// gamma for this flow; beside a term u div v unless it is `solenoidal`.
    ///
    /// # Errors
    /// As [`Hyperviscosity::tune`].
    pub(super) fn gamma(&mut self, flow: &[[f64; D]], solenoidal: bool) -> Result<f64> {
        let divergence = if solenoidal { vec![0.0; flow.len()] } else { self.divergence(flow) };
        let fastest = flow.iter().map(length).fold(0.0, f64::max);
        let left = COMPRESSED / 2.0 * divergence.iter().copied().fold(0.0, f64::max);
        // At rest the quotient is no number, and the other is taken.
        let growth = (left * self.term.spacing().0 / fastest).max(NONE);
        let coarse = growth.max(GROWTH);

        let estimator = SpectrumEstimator::new().subspace(VECTORS).most(PRODUCTS);
        // What the part has to say against the rows, all of them say with their own particles.
        let exact = estimator.is_exact(flow.len());
        let part = if exact { 0.0 } else { self.part(flow, &divergence, coarse).unwrap_or(0.0) };
        let Self { rows, term } = self;
        let bare = |u: &[f64], du: &mut [f64]| {
            rows.apply_along(flow, u, du)?;
            du.iter_mut().zip(u).zip(&divergence).for_each(|((du, u), divergence)| *du = -*du - divergence * u);
            Ok(())
        };
        if exact {
            match term.tune(&estimator, flow, bare, growth) {
                Err(error) if grows(&error) => term.tune(&estimator, flow, bare, coarse)?,
                found => found?,
            };
        } else {
            // Estimates of the whole alone miss growth, the more the larger the set is.
            term.raise(&estimator, flow, bare, coarse, part)?;
        }
        Ok(term.gamma())
    }

    /// div v by the rows, mirrors left aside.
    fn divergence(&self, flow: &[[f64; D]]) -> Vec<f64> {
        let along = |p: usize, (q, w): (usize, [f64; D])| {
            w.iter().zip(&flow[q]).zip(&flow[p]).map(|((w, v), own)| w * (v - own)).sum::<f64>()
        };
        (0..flow.len()).map(|p| self.rows.pairs(p).1.map(|pair| along(p, pair)).sum()).collect()
    }

    /// The gamma that the particles around the fastest one need, with the same margin as an estimate of all.
    fn part(&self, flow: &[[f64; D]], divergence: &[f64], growth: f64) -> Result<f64> {
        let Self { rows, term } = self;
        let speed = |p: usize| length(&flow[p]);
        // Far from the rim where all are as fast.
        let middle = flow.len() / 2;
        let fastest = (0..flow.len()).fold(middle, |most, p| if speed(p) > speed(most) { p } else { most });
        let part = around(term.laplacian(), fastest);
        let places: BTreeMap<usize, usize> = part.iter().enumerate().map(|(i, &p)| (p, i)).collect();

        let (size, Spacing(h)) = (part.len(), term.spacing());
        let (mut advection, mut damping) = (DMatrix::<f64>::zeros(size, size), DMatrix::<f64>::zeros(size, size));
        for (i, &p) in part.iter().enumerate() {
            let along = |w: [f64; D]| -w.iter().zip(&flow[p]).map(|(w, v)| w * v).sum::<f64>();
            let place = |q| places.get(&q).map(|&j| (i, j));
            rows.entries_of(p, along, &mut |q, w| place(q).into_iter().for_each(|at| advection[at] += w));
            advection[(i, i)] -= divergence[p];
            for (q, w) in term.row(p, speed(p)) {
                place(q).into_iter().for_each(|at| damping[at] += w);
            }
        }
        let found = least(speed(fastest) / h, growth, |gamma| {
            SpectrumEstimator::new().estimate(size, |u, du| {
                let u = DVectorView::from_slice(u, size);
                let mut du = DVectorViewMut::from_slice(du, size);
                du.gemv(1.0, &advection, &u, 0.0);
                du.gemv(gamma, &damping, &u, 1.0);
                Ok(())
            })
        })?;
        Ok(OPEN * found.gamma)
    }
}

/// The particles nearest to one, in steps from row to row.
fn around(rows: &Rows, first: usize) -> Vec<usize> {
    let (mut found, mut known, mut at) = (vec![first], BTreeSet::from([first]), 0);
    while at < found.len() && found.len() < PART {
        for (q, _) in rows.pairs(found[at]).1 {
            if found.len() < PART && known.insert(q) {
                found.push(q);
            }
        }
        at += 1;
    }
    found
}

/// Whether no gamma was enough.
fn grows(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Linear(LinearError::Growing { .. }))
}
