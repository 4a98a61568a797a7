//! A method and a provider become rows: counted first, then filled, block by block.

use super::blocks::{BLOCK, each_block};
use super::rows::{Centers, Rows};
use super::splice::Stray;
use super::worker::{BATCH, CROWD, Workers, cutoff};
use super::{Field, MatrixFree, Report};
use crate::domain::Domain;
use crate::error::{Error, NeighborError, OperatorError, ParticleError, Result};
use crate::kernel::{Kernel, SmoothingKernel};
use crate::moment::MomentSolver;
use crate::neighbors::{CellList, Neighbors};
use crate::operator::{DcPse, Draft, Method, Operator, Outputs, Pse, Sph, finite};
use crate::particles::{Particles, reserved};
use crate::scale::Cutoff;

impl<S: Outputs, T: Field> Rows<S, T> {
    /// Builds the rows of `method` over `neighbors`, with weights rounded to `T`.
    ///
    /// Identical bits for any number of threads with one provider; with
    /// [`canonical`](Neighbors::canonical) neighbors also over providers and after renumbering.
    ///
    /// # Errors
    /// [`NeighborError::Reach`] naming the target whose cutoff is beyond the provider; [`NeighborError::Source`] and
    /// [`NeighborError::Offsets`] for a provider that names sources it does not have or counts others than it gathers;
    /// [`NeighborError::Misnamed`] and [`OperatorError::Draft`] for a provider and a method that leave another row than
    /// the one asked for;
    /// [`ParticleError::Memory`](crate::ParticleError::Memory) where the rows do not fit; what the method refuses;
    /// [`OperatorError::Weight`] where a weight is not finite, in `f64` or rounded to `T`; and
    /// [`OperatorError::Overlap`] or [`OperatorError::Moment`] naming the worst row that breaks a limit without leave, or the
    /// first of more than 65,536 neighbors.
    pub fn assemble<const D: usize, M: Method<D, Out = S>, P: Neighbors<D>>(method: &M, neighbors: &P) -> Result<Self> {
        let targets = neighbors.targets();
        method.validate(targets, neighbors.sources())?;
        let workers = Workers::default();
        let offsets = count(method, neighbors, &workers)?;
        let pairs = offsets.last().copied().unwrap_or(0);
        let zero = S::ZERO.map(T::lift);
        let mut columns = filled(pairs, 0_u32)?;
        let mut weights = filled(pairs, zero)?;
        let mut diagonal = filled(targets, zero)?;

        let blocks = Blocks {
            offsets: &offsets,
            first: 0,
            columns: &mut columns,
            weights: &mut weights,
            diagonal: &mut diagonal,
        };
        let made = each_block(blocks, |mut block| {
            workers.with(method, |worker| {
                let (mut report, mut strays) = (Report::default(), Vec::new());
                let past = block.first + block.diagonal.len();
                for first in (block.first..past).step_by(BATCH) {
                    for draft in worker.rows(method, neighbors, first..past.min(first + BATCH))? {
                        strays.extend(block.store(&offsets, draft, &mut report)?);
                    }
                }
                Ok((report, strays))
            })
        })?;
        let (mut report, mut strays) = (Report::default(), Vec::new());
        for (block, found) in made {
            report.merge(&block);
            strays.extend(found);
        }
        report.accept()?;
        if diagonal.iter().all(|d| *d == zero) {
            diagonal = Vec::new();
        }
        let (sources, generation) = (neighbors.sources(), neighbors.generation());
        let centers = centers(neighbors)?;
        let mut rows = Self { offsets, columns, weights, diagonal, centers, sources, generation, report };
        rows.splice(&strays)?;
        Ok(rows)
    }
}

/// `count` copies of a value, or an error where there is no memory for them.
fn filled<V: Copy>(count: usize, value: V) -> Result<Vec<V>> {
    let mut values = reserved(count)?;
    values.resize(count, value);
    Ok(values)
}

/// Where each row begins; a crowded row is made, so that it is refused before the others are counted.
fn count<const D: usize, M: Method<D>, P: Neighbors<D>>(
    method: &M,
    neighbors: &P,
    workers: &Workers<D, M>,
) -> Result<Vec<usize>> {
    let targets = neighbors.targets();
    let mut offsets = filled(targets.saturating_add(1), 0_usize)?;
    each_block(offsets[1..].chunks_mut(BLOCK).enumerate(), |(b, counts)| {
        for (i, count) in counts.iter_mut().enumerate() {
            let p = b * BLOCK + i;
            *count = neighbors.count(p, cutoff(method, neighbors, p)?);
            if *count > CROWD {
                workers.with(method, |worker| worker.rows(method, neighbors, p..p + 1).map(drop))?;
            }
        }
        Ok(())
    })?;
    let mut sum = 0_usize;
    for offset in &mut offsets {
        sum = sum.checked_add(*offset).ok_or(ParticleError::Memory { count: usize::MAX })?;
        *offset = sum;
    }
    Ok(offsets)
}

fn centers<const D: usize, P: Neighbors<D>>(neighbors: &P) -> Result<Centers> {
    let (targets, sources) = (0..neighbors.targets(), neighbors.sources());
    if let Some((p, q)) = targets.clone().find_map(|p| Some((p, neighbors.center(p).filter(|&q| q >= sources)?))) {
        return Err(Error::from(NeighborError::Source { q, sources }).at(p));
    }
    if targets.clone().all(|p| neighbors.center(p) == Some(p)) {
        Ok(Centers::Same)
    } else {
        Ok(Centers::Each(targets.map(|p| neighbors.center(p).map(|q| q as u32)).collect()))
    }
}

/// The arrays of all rows, handed out block after block.
struct Blocks<'a, W> {
    offsets: &'a [usize],
    first: usize,
    columns: &'a mut [u32],
    weights: &'a mut [W],
    diagonal: &'a mut [W],
}

impl<'a, W> Iterator for Blocks<'a, W> {
    type Item = Block<'a, W>;

    fn next(&mut self) -> Option<Block<'a, W>> {
        let first = self.first;
        let rows = self.diagonal.len().min(BLOCK);
        if rows == 0 {
            return None;
        }
        self.first += rows;
        let pairs = self.offsets[self.first] - self.offsets[first];
        Some(Block {
            first,
            columns: self.columns.split_off_mut(..pairs)?,
            weights: self.weights.split_off_mut(..pairs)?,
            diagonal: self.diagonal.split_off_mut(..rows)?,
        })
    }
}

struct Block<'a, W> {
    first: usize,
    columns: &'a mut [u32],
    weights: &'a mut [W],
    diagonal: &'a mut [W],
}

impl<W: Copy> Block<'_, W> {
    /// Stores a row where its room is, or returns it where it was widened or left empty.
    fn store<const D: usize, S: Outputs<Of<T> = W>, T: Field>(
        &mut self,
        offsets: &[usize],
        draft: &Draft<D, S>,
        report: &mut Report,
    ) -> Result<Option<Stray<W>>>
    where
        W: AsRef<[T]>,
    {
        let (row, p) = (&draft.stencil, draft.stencil.target());
        let known = draft.report.clone()?;
        report.add(&known);
        let room = offsets[p] - offsets[self.first]..offsets[p + 1] - offsets[self.first];
        let weights = draft.weights.iter().map(|w| w.map(T::lift));
        let diagonal = draft.diagonal.map(T::lift);
        self.diagonal[p - self.first] = diagonal;
        if row.len() != room.len() && (known.grown > 0 || known.empty) {
            let stray = Stray { p, columns: row.sources().to_vec(), weights: weights.collect() };
            finite(row, stray.weights.iter().map(AsRef::as_ref), diagonal.as_ref()).map_err(|error| error.at(p))?;
            return Ok(Some(stray));
        }
        if row.len() != room.len() {
            let (found, needed) = (offsets[p] + row.len(), offsets[p + 1]);
            return Err(Error::from(NeighborError::Offsets { row: p, found, needed }).at(p));
        }
        self.columns[room.clone()].copy_from_slice(row.sources());
        for (stored, w) in self.weights[room.clone()].iter_mut().zip(weights) {
            *stored = w;
        }
        let stored = self.weights[room].iter().map(AsRef::as_ref);
        finite(row, stored, diagonal.as_ref()).map_err(|error| error.at(p))?;
        Ok(None)
    }
}

impl<K, const N: usize> Pse<K, N> {
    /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn assemble<const D: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows<[f64; N]>>
    where
        K: Kernel<f64, D>,
    {
        Rows::assemble(self, neighbors)
    }

    /// The same operator without stored weights: they are computed anew in every application.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn matrix_free<'a, const D: usize, P: Neighbors<D>>(
        &'a self,
        neighbors: &'a P,
    ) -> Result<MatrixFree<'a, D, Self, P>>
    where
        K: Kernel<f64, D>,
    {
        MatrixFree::new(self, neighbors)
    }
}

impl<W: SmoothingKernel<f64, D>, const D: usize, const N: usize> Sph<W, D, N> {
    /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn assemble<P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows<[f64; N]>> {
        Rows::assemble(self, neighbors)
    }

    /// The same operator without stored weights: they are computed anew in every application.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn matrix_free<'a, P: Neighbors<D>>(&'a self, neighbors: &'a P) -> Result<MatrixFree<'a, D, Self, P>> {
        MatrixFree::new(self, neighbors)
    }
}

impl<Op, const R: u32, S: MomentSolver> DcPse<Op, R, S> {
    /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn assemble<const D: usize, const K: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows<[f64; K]>>
    where
        Op: Operator<D, Out = [f64; K]>,
    {
        Rows::assemble(self, neighbors)
    }

    /// The same operator without stored weights: they are computed anew in every application.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn matrix_free<'a, const D: usize, const K: usize, P: Neighbors<D>>(
        &'a self,
        neighbors: &'a P,
    ) -> Result<MatrixFree<'a, D, Self, P>>
    where
        Op: Operator<D, Out = [f64; K]>,
    {
        MatrixFree::new(self, neighbors)
    }

    /// A cutoff that holds enough neighbors for every particle, those at edges and corners included.
    ///
    /// It starts from the ball that would hold them on a lattice of the same spacing and grows by 1.15 until the
    /// particle with the fewest has enough.
    ///
    /// # Errors
    /// [`OperatorError::TooFew`](crate::OperatorError::TooFew) naming the particle with the fewest neighbors where the
    /// whole set holds too few; and those of [`Particles::spacing`] and [`CellList::build`].
    pub fn cutoff<const D: usize>(&self, particles: &Particles<D>) -> Result<Cutoff>
    where
        Op: Operator<D>,
    {
        self.cutoff_in(particles, &Domain::open())
    }

    /// The same with the images of a domain.
    pub(super) fn cutoff_in<const D: usize>(&self, particles: &Particles<D>, domain: &Domain<D>) -> Result<Cutoff>
    where
        Op: Operator<D>,
    {
        let (conditions, needed) = (self.most_conditions()?, self.fewest_neighbors()?);
        let h = particles.spacing()?.0;
        // A ball of radius r holds about (2 r/h)^D / 2 lattice points, for D = 1 to 3 within a factor of 1.3.
        let mut cutoff = 0.5 * h * (2.0 * needed as f64).powf(1.0 / D as f64);
        loop {
            let cells = CellList::build(particles, domain, Cutoff(cutoff))?;
            let counts = (0..particles.len()).map(|p| (cells.count(p, cutoff), p));
            let Some((fewest, p)) = counts.min() else { return Ok(Cutoff(cutoff)) };
            if fewest >= needed {
                return Ok(Cutoff(cutoff));
            }
            if fewest + 1 >= particles.len() {
                let kind = OperatorError::TooFew { neighbors: fewest, conditions, needed };
                return Err(Error::from(kind).at(p));
            }
            cutoff *= 1.15;
        }
    }
}
