//! The k nearest neighbors of every target, however the spacing varies.

use super::placed::distance_squared;
use super::{CellList, Neighbors};
use crate::domain::{Domain, LENGTH_HIGH, LENGTH_LOW};
use crate::error::{DomainError, ErrorKind, NeighborError, Result};
use crate::particles::{Particles, Random, reserved};
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// The provider whose cutoff at target p is the distance of its neighbor number k, whole shells: neighbors as far away
/// as that one, but for rounding, are in.
///
/// k nearest by growing cells: cell lists of growing reach, of which a query takes the finest that reaches far enough, so
/// that dense regions are not searched in the cells of thin ones. The reach is 1.15^3 times the largest cutoff, so that
/// an operator may widen the support of a poor row. A closed axis admits cutoffs up to half its width: a target with
/// fewer than k neighbors within the widest legal cutoff takes that one, and the operator says that there are too few.
/// Memory: 2 to 4 cell lists where the spacing is even, one more for every factor of 1.3 to which cutoffs vary.
///
/// ```
/// use parops::{DcPse, Domain, Laplacian, Nearest, Neighbors, Particles};
/// let scattered = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
/// let dcpse = DcPse::<Laplacian<2>, 2>::new();
/// let neighbors = Nearest::build(&scattered, &Domain::open(), dcpse.fewest_neighbors::<2>()?)?;
/// assert!((0..144).all(|p| neighbors.count(p, neighbors.cutoff(p)) == 18));
/// assert_eq!(dcpse.assemble(&neighbors)?.report().most, 18);
/// # parops::Result::Ok(())
/// ```
///
/// See also: [`CellList`] with `DcPse::cutoff`, one cutoff for all, for sets of even spacing.
#[derive(Clone, Debug)]
pub struct Nearest<const D: usize> {
    /// In the order of their reach, at least one.
    levels: Vec<CellList<D>>,
    cutoffs: Vec<f64>,
}

/// From one level to the next.
const GROWTH: f64 = 1.3;
/// Across gaps.
const FASTEST: f64 = 16.0;
/// A neighbor as far away as the last one but for rounding is in.
const SHELL: f64 = 1.0 + 1e-9;
/// From the largest cutoff to the reach: three steps of 1.15, and their rounding.
const ROOM: f64 = 1.15 * 1.15 * 1.15 * SHELL;
/// A query looks as much farther as the coordinates may be rounded by, 72 eps of the largest: no farther than the reach of
/// 2^53 cells over this.
const ROUNDINGS: f64 = 128.0;
/// Targets looked at before a level is chosen.
const SAMPLE: usize = 64;

impl<const D: usize> Nearest<D> {
    /// The particles are targets and sources; the cutoff of each holds `k` others, at least one.
    ///
    /// # Errors
    /// As [`CellList::build`], but for the cutoff: [`NeighborError::CutoffRange`](crate::NeighborError::CutoffRange)
    /// where the set or the box is so small that none is legal.
    pub fn build(particles: &Particles<D>, domain: &Domain<D>, k: usize) -> Result<Self> {
        Self::new(particles, domain, k, particles.points(), |reach| CellList::build(particles, domain, reach))
    }

    /// The targets are points of their own, none of them a particle even where one lies at the same place.
    ///
    /// # Errors
    /// As [`build`](Self::build) and [`CellList::build_at`].
    pub fn build_at(targets: &[[f64; D]], particles: &Particles<D>, domain: &Domain<D>, k: usize) -> Result<Self> {
        Self::new(particles, domain, k, targets, |reach| CellList::build_at(targets, particles, domain, reach))
    }

    fn new(
        particles: &Particles<D>,
        domain: &Domain<D>,
        k: usize,
        targets: &[[f64; D]],
        cells: impl Fn(Cutoff) -> Result<CellList<D>>,
    ) -> Result<Self> {
        let k = k.max(1);
        let mut search = Search { k, row: Stencil::default(), distances: Vec::new() };
        let widest = widest(particles, domain, targets);
        // Cells of this reach, or far fewer where an axis would have more of them than there may be: beside an outlier gaps
        // may be finer than that, and than what its roundings leave of a query.
        let cells = |mut reach: f64| loop {
            let error = match cells(Cutoff(reach)) {
                Err(error) if reach < widest => error,
                made => return made,
            };
            let ErrorKind::Neighbor(NeighborError::Cells { cells, limit, .. }) = *error.kind() else {
                return Err(error);
            };
            reach = (ROUNDINGS * cells / limit * reach).min(widest);
        };
        // A ball of k lattice points; a set without a spacing is one place.
        let guess = particles.spacing().map_or(widest, |h| 0.6 * h.0 * (k as f64).powf(1.0 / D as f64));
        let mut reach = guess.min(widest).max(LENGTH_LOW);

        let (mut levels, mut cutoffs) = (Vec::new(), reserved(targets.len())?);
        cutoffs.resize(targets.len(), 0.0);
        let mut open: Vec<usize> = reserved(targets.len())?;
        open.extend(0..targets.len());
        let (mut growth, mut guessed, mut random) = (GROWTH, true, Random::new(0x5eed));
        while !open.is_empty() || levels.is_empty() {
            let mut level = cells(reach)?;
            if guessed {
                // All that is open, searched in cells far too large, would be pairs of everybody.
                let sample = (0..open.len().min(SAMPLE)).map(|i| spread(&mut random, i, &open));
                let nearest = sample.filter_map(|p| search.distance(&level, p)).filter(|&d| d > 0.0);
                let least = (nearest.fold(level.reach(), f64::min) * SHELL).max(LENGTH_LOW);
                // Served is at least the one that is so near.
                if 2.0 * least <= level.reach() {
                    level = cells(least)?;
                }
            }
            reach = level.reach();
            let last = reach >= widest;
            let before = open.len();
            open.retain(|&p| {
                cutoffs[p] = match search.distance(&level, p) {
                    Some(distance) => distance * SHELL,
                    None => f64::INFINITY,
                };
                if last {
                    cutoffs[p] = cutoffs[p].min(reach);
                }
                cutoffs[p] > reach
            });
            // A level that serves nobody is not kept, and the gap after it is crossed faster and faster.
            guessed = open.len() == before && !last && !targets.is_empty();
            growth = if guessed { (growth * growth).min(FASTEST) } else { GROWTH };
            if !guessed {
                levels.push(level);
            }
            reach = (reach * growth).min(widest);
        }
        let largest = cutoffs.iter().fold(0.0_f64, |largest, &cutoff| largest.max(cutoff));
        let room = admitted(domain, largest * ROOM);
        if levels.last().is_none_or(|last| last.reach() < room) {
            levels.push(cells(room)?);
        }
        Ok(Self { levels, cutoffs })
    }

    fn level(&self, cutoff: f64) -> Option<&CellList<D>> {
        let finest = self.levels.partition_point(|level| level.reach() < cutoff);
        self.levels.get(finest).or(self.levels.last())
    }
}

/// Room for the distances of one row.
struct Search<const D: usize> {
    k: usize,
    row: Stencil<D>,
    distances: Vec<f64>,
}

impl<const D: usize> Search<D> {
    /// The distance of neighbor number k, where there are so many within the reach.
    fn distance(&mut self, cells: &CellList<D>, p: usize) -> Option<f64> {
        cells.gather(p, cells.reach(), &mut self.row);
        if self.row.len() < self.k {
            return None;
        }
        self.distances.clear();
        self.distances.extend(self.row.separations().iter().map(distance_squared));
        let (_, last, _) = self.distances.select_nth_unstable_by(self.k - 1, f64::total_cmp);
        Some(last.sqrt())
    }
}

/// Number i of a sample of the targets that are open, all where they are no more: at random, since any stride may be in step
/// with how they are ordered.
fn spread(random: &mut Random, i: usize, open: &[usize]) -> usize {
    let many = open.len() > SAMPLE;
    open[if many { ((u128::from(random.bits()) * open.len() as u128) >> 64) as usize } else { i }]
}

/// The widest legal cutoff that can still find a neighbor.
fn widest<const D: usize>(particles: &Particles<D>, domain: &Domain<D>, targets: &[[f64; D]]) -> f64 {
    let points = particles.points().iter().chain(targets).flatten();
    let faces = domain.lower().into_iter().chain(domain.upper()).filter(|face| face.is_finite());
    // No image is farther away than four times this along any axis.
    let magnitude = points.copied().chain(faces).fold(0.0, |largest: f64, x| largest.max(x.abs()));
    admitted(domain, 4.0 * D as f64 * magnitude).clamp(LENGTH_LOW, LENGTH_HIGH)
}

/// The cutoff, or half the width of the narrowest closed axis where that is less.
fn admitted<const D: usize>(domain: &Domain<D>, mut cutoff: f64) -> f64 {
    while let Err(error) = domain.admits(Cutoff(cutoff)) {
        match error.kind() {
            ErrorKind::Domain(DomainError::Narrow { width, .. }) if 0.5 * width < cutoff => cutoff = 0.5 * width,
            _ => break,
        }
    }
    cutoff
}

impl<const D: usize> Neighbors<D> for Nearest<D> {
    fn targets(&self) -> usize {
        self.cutoffs.len()
    }

    fn sources(&self) -> usize {
        self.level(0.0).map_or(0, CellList::sources)
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.level(0.0).and_then(|level| level.center(p))
    }

    fn cutoff(&self, p: usize) -> f64 {
        self.cutoffs.get(p).copied().unwrap_or(0.0)
    }

    fn reach(&self) -> f64 {
        self.levels.last().map_or(0.0, CellList::reach)
    }

    fn generation(&self) -> u64 {
        self.level(0.0).map_or(0, CellList::generation)
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.level(0.0)?.domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        if let Some(level) = self.level(cutoff) {
            level.for_each(p, cutoff, visit);
        }
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        match self.level(cutoff) {
            Some(level) => level.gather(p, cutoff, row),
            None => row.reset(p, None, cutoff),
        }
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        self.level(cutoff).map_or(0, |level| level.count(p, cutoff))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particles::Random;

    #[test]
    fn samples_see_a_dense_cluster_however_the_particles_are_ordered() {
        // Every second, fifth or fiftieth particle lies in a wide cluster, the others in a narrow one. A sample in step with
        // that would see one of them.
        for every in [2, 5, 50] {
            for count in [4000, 4160, 6400, 6450] {
                let mut random = Random::new(5);
                let mut point = |x: f64, size: f64| [x + size * random.uniform(), size * random.uniform()];
                let wide = |i: usize| i.is_multiple_of(every);
                let points = (0..count).map(|i| if wide(i) { point(0.3, 0.1) } else { point(0.8, 1e-6) }).collect();
                let nearest = Nearest::build(&Particles::new(points).unwrap(), &Domain::open(), 8).unwrap();
                let narrow = (0..count).filter(|&p| !wide(p)).map(|p| nearest.cutoff(p)).fold(0.0, f64::max);
                let reach = nearest.level(narrow).unwrap().reach();
                assert!(reach <= 8.0 * narrow, "cells of {reach} for {narrow}, {count} by {every}");
            }
        }
    }
}
