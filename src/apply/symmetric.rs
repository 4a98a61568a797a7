//! PSE over a half list: one kernel value serves both particles of a pair.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::{Apply, Field, MatrixFree, Report, check, check_results, scalars};
use crate::error::{Error, OperatorError, Result};
use crate::kernel::Kernel;
use crate::neighbors::{HalfList, Neighbors};
use crate::operator::{Mutual, Pse};
use crate::particles::reserved;
use crate::scale::Cutoff;

/// Pairs whose kernel values are computed together; their arrays stay in the first cache.
const BATCH: usize = 384;

/// How far eta(z) and +/- eta(-z) may differ, relative to the largest value near by: two evaluations of a polynomial
/// of some ten terms.
const PARITY: f64 = 64.0 * f64::EPSILON;

/// A [`Pse`] of one epsilon applied matrix-free over a [`HalfList`]: half the kernel values and separations.
///
/// With t = eps^-m eta_eps(x_p - x_q) (f_q + sigma f_p) a pair adds V_q t to p and -V_p t to q (+V_p t where an odd
/// degree is paired with '-'), so that sum_p V_p out_p of a closed set is zero but for the rounding of the sums,
/// whatever the volumes; in strengths what one loses is to the bit what the other gains. Results are those of
/// [`MatrixFree`] but for the order of summation and the rounding of '+' forms, which are summed as pairs here.
/// Neighbors behind mirrors serve their target alone.
///
/// All rows are checked once when it is made. An application allocates nothing after the first of as many threads, and
/// gives the same bits for any number of them with one provider and numbering.
///
/// ```
/// use parops::{Apply, CellList, Domain, Laplacian, Particles, Pse};
/// let particles = Particles::lattice([0.0], [1.0], [64])?;
/// let pse = Pse::new(Laplacian::<1>, 2, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
/// let neighbors = CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?;
/// let exchange = pse.symmetric(&neighbors)?;
/// let f: Vec<f64> = (0..64).map(|p| f64::from(p % 7)).collect();
/// let mut lap = vec![0.0; 64];
/// exchange.apply(&f, &mut lap)?;
/// let size: f64 = lap.iter().map(|x| x.abs()).sum();
/// assert!(lap.iter().sum::<f64>().abs() <= 4.0 * f64::EPSILON * size);
/// # parops::Result::Ok(())
/// ```
///
/// Source: notes 001, sec. 2.3 and 2.4; notes 000, eq. 26, with errata 13 for unequal volumes.
pub struct SymmetricPse<'a, const D: usize, K, const N: usize = 1> {
    mutual: Mutual<'a, K, N>,
    half: HalfList<D>,
    report: Report,
    /// v = V eps^-D of every particle; empty where all are equal.
    volumes: Vec<f64>,
    /// The common v.
    volume: f64,
    spare: Mutex<Vec<Scratch<D>>>,
}

/// Working memory of one thread.
#[derive(Debug, Default)]
struct Scratch<const D: usize> {
    sources: Vec<u32>,
    ends: Vec<usize>,
    z: Vec<[f64; D]>,
    e: Vec<f64>,
    signs: Vec<i8>,
}

impl<const D: usize> Scratch<D> {
    fn clear(&mut self) {
        self.sources.clear();
        self.ends.clear();
        self.z.clear();
        self.signs.clear();
    }
}

impl<K, const N: usize> Pse<K, N> {
    /// The same operator over every pair once: half the work of [`matrix_free`](Self::matrix_free).
    ///
    /// # Errors
    /// As [`Rows::assemble`](crate::Rows::assemble) and [`HalfList::from_provider`];
    /// [`OperatorError::VariableEpsilon`] for an epsilon that varies, [`OperatorError::Parity`] naming a particle at
    /// which a kernel is neither even nor odd as its degree demands, [`OperatorError::Weight`] where a weight is not
    /// finite.
    pub fn symmetric<const D: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<SymmetricPse<'_, D, K, N>>
    where
        K: Kernel<f64, D>,
    {
        SymmetricPse::new(self, neighbors)
    }
}

impl<'a, const D: usize, K: Kernel<f64, D>, const N: usize> SymmetricPse<'a, D, K, N> {
    fn new<P: Neighbors<D>>(method: &'a Pse<K, N>, neighbors: &P) -> Result<Self> {
        let mutual = method.mutual()?;
        let report = *MatrixFree::new(method, neighbors)?.report();
        let half = HalfList::from_provider(neighbors, Cutoff(mutual.cutoff))?;
        let (mut volumes, mut volume) = (Vec::new(), 0.0);
        match mutual.volumes.common() {
            Some(common) => volume = mutual.scaled::<D>(common),
            None => {
                volumes = reserved(half.particles())?;
                for p in 0..half.particles() {
                    volumes.push(mutual.scaled::<D>(mutual.volumes.get(p)?));
                }
            }
        }
        let operator = Self { mutual, half, report, volumes, volume, spare: Mutex::default() };
        operator.check_pairs()?;
        Ok(operator)
    }

    /// Refuses kernels without the parity of their degree, and weights that are not finite.
    fn check_pairs(&self) -> Result<()> {
        let parity = if self.mutual.is_odd() { -1.0 } else { 1.0 };
        let (mut scratch, mut opposite) = (Scratch::default(), Vec::new());
        let mut first = 0;
        while first < self.half.particles() {
            let past = self.fill(first..self.half.particles(), &mut scratch);
            scratch.z.iter_mut().flatten().for_each(|z| *z = -*z);
            self.mutual.evaluate(&scratch.z, &mut opposite);
            let limit = PARITY * scratch.e.iter().fold(0.0_f64, |largest, e| largest.max(e.abs()));
            let mut i = 0;
            for (p, &end) in (first..past).zip(&scratch.ends) {
                for (i, &q) in (i..end).zip(&scratch.sources[i..]) {
                    for n in 0..N {
                        let at = n * scratch.sources.len() + i;
                        let (value, opposite) = (scratch.e[at], opposite[at]);
                        let weight = value * self.volume_of(p).max(self.volume_of(q as usize));
                        if !weight.is_finite() {
                            return Err(Error::from(OperatorError::Weight { q: q as usize, weight }).at(p));
                        }
                        if !((value - parity * opposite).abs() <= limit) {
                            return Err(Error::from(OperatorError::Parity { value, opposite }).at(p));
                        }
                    }
                }
                i = end;
            }
            first = past;
        }
        Ok(())
    }
}

impl<const D: usize, K: Kernel<f64, D>, const N: usize> SymmetricPse<'_, D, K, N> {
    /// What the check of all rows found.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The pairs.
    pub fn pairs(&self) -> &HalfList<D> {
        &self.half
    }

    /// All N outputs of a scalar field, as [`Rows::apply_all`](crate::Rows::apply_all).
    ///
    /// # Errors
    /// As [`Apply::apply`].
    pub fn apply_all<T: Field>(&self, f: &[T], out: &mut [[T; N]]) -> Result<()> {
        check(scalars(f), self.half.particles(), out, self.half.particles())?;
        out.fill([T::zero(); N]);
        self.half.each_block(out, |rows, out| {
            let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let mut scratch = spare.unwrap_or_default();
            let mut rest = rows.clone();
            while !rest.is_empty() {
                let past = self.fill(rest.clone(), &mut scratch);
                let batch = rest.start..past;
                if self.volumes.is_empty() {
                    self.add_equal(batch, rows.start, &scratch, f, out);
                } else {
                    self.add_varying(batch, rows.start, &scratch, f, out);
                }
                rest.start = past;
            }
            self.add_single(rows, &mut scratch, f, out);
            self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
            Ok(())
        })?;
        check_results(out)
    }

    /// Mutual pairs of as many rows as make a batch, with e at each; returns the row after the last.
    #[inline]
    fn fill(&self, rows: Range<usize>, scratch: &mut Scratch<D>) -> usize {
        scratch.clear();
        let mut p = rows.start;
        while p < rows.end && scratch.sources.len() < BATCH {
            self.half.gather_mutual(p, self.mutual.inverse, &mut scratch.sources, &mut scratch.z);
            scratch.ends.push(scratch.sources.len());
            p += 1;
        }
        self.mutual.evaluate(&scratch.z, &mut scratch.e);
        p
    }

    /// Pairs of equal volumes: one weight for both.
    #[inline]
    fn add_equal<T: Field>(&self, rows: Range<usize>, first: usize, scratch: &Scratch<D>, f: &[T], out: &mut [[T; N]]) {
        let (sigma, partner) = (T::lift(self.mutual.sigma), T::lift(self.mutual.partner));
        let pairs = scratch.sources.len();
        let mut begin = 0;
        for (p, &end) in rows.zip(&scratch.ends) {
            let own = sigma * f[p];
            let mut sum = [T::zero(); N];
            for i in begin..end {
                let q = scratch.sources[i] as usize;
                let both = f[q] + own;
                let given = &mut out[q - first];
                for n in 0..N {
                    let term = T::lift(self.volume * scratch.e[n * pairs + i]) * both;
                    sum[n] += term;
                    given[n] += partner * term;
                }
            }
            add(&mut out[p - first], &sum);
            begin = end;
        }
    }

    /// Pairs of any volumes.
    #[inline]
    fn add_varying<T: Field>(
        &self,
        rows: Range<usize>,
        first: usize,
        scratch: &Scratch<D>,
        f: &[T],
        out: &mut [[T; N]],
    ) {
        let Mutual { sigma, partner, strengths, .. } = self.mutual;
        let (sigma_of, partner_of) = (T::lift(sigma), T::lift(partner));
        let pairs = scratch.sources.len();
        let mut begin = 0;
        for (p, &end) in rows.zip(&scratch.ends) {
            let (own_volume, own) = (self.volumes[p], f[p]);
            let mut sum = [T::zero(); N];
            for i in begin..end {
                let q = scratch.sources[i] as usize;
                let volume = self.volumes[q];
                let given = &mut out[q - first];
                for n in 0..N {
                    let e = scratch.e[n * pairs + i];
                    let (to_p, to_q) = (T::lift(volume * e), T::lift(own_volume * e));
                    if strengths {
                        let term = to_q * f[q] + sigma_of * to_p * own;
                        sum[n] += term;
                        given[n] += partner_of * term;
                    } else {
                        let both = f[q] + sigma_of * own;
                        sum[n] += to_p * both;
                        given[n] += partner_of * to_q * both;
                    }
                }
            }
            add(&mut out[p - first], &sum);
            begin = end;
        }
    }

    /// What serves one target alone.
    fn add_single<T: Field>(&self, rows: Range<usize>, scratch: &mut Scratch<D>, f: &[T], out: &mut [[T; N]]) {
        if self.half.single() == 0 {
            return;
        }
        let sigma = T::lift(self.mutual.sigma);
        for p in rows.clone() {
            scratch.clear();
            let Scratch { sources, z, signs, .. } = scratch;
            self.half.visit_single(p, |neighbor| {
                sources.push(neighbor.q as u32);
                z.push(neighbor.separation.map(|s| s * self.mutual.inverse));
                signs.push(neighbor.sign);
            });
            if scratch.sources.is_empty() {
                continue;
            }
            self.mutual.evaluate(&scratch.z, &mut scratch.e);
            let pairs = scratch.sources.len();
            let own_volume = self.volume_of(p);
            let mut sum = [T::zero(); N];
            for (i, (&q, &sign)) in scratch.sources.iter().zip(&scratch.signs).enumerate() {
                let (volume, seen) = (self.volume_of(q as usize), T::lift(f64::from(sign)) * f[q as usize]);
                for (n, sum) in sum.iter_mut().enumerate() {
                    let e = scratch.e[n * pairs + i];
                    *sum += if self.mutual.strengths {
                        T::lift(own_volume * e) * seen + sigma * T::lift(volume * e) * f[p]
                    } else {
                        T::lift(volume * e) * (seen + sigma * f[p])
                    };
                }
            }
            add(&mut out[p - rows.start], &sum);
        }
    }

    #[inline(always)]
    fn volume_of(&self, p: usize) -> f64 {
        self.volumes.get(p).copied().unwrap_or(self.volume)
    }
}

#[inline(always)]
fn add<T: Field, const N: usize>(out: &mut [T; N], sum: &[T; N]) {
    out.iter_mut().zip(sum).for_each(|(out, sum)| *out += *sum);
}

impl<T: Field, const D: usize, K: Kernel<f64, D>> Apply<T> for SymmetricPse<'_, D, K> {
    fn targets(&self) -> usize {
        self.half.particles()
    }

    fn sources(&self) -> usize {
        self.half.particles()
    }

    fn apply(&self, f: &[T], out: &mut [T]) -> Result<()> {
        self.apply_all(f, out.as_chunks_mut().0)
    }
}
