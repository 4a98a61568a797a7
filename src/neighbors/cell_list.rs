//! The cell list: sources and the images they cast near the faces, sorted by cell.

use std::sync::Arc;

use super::grid::Grid;
use super::links::Links;
use super::placed::{Placed, distance_squared, within};
use super::table::{Table, is_dense};
use super::{NeighborList, Neighbors};
use crate::domain::{Domain, Image};
use crate::error::Result;
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// The provider for sets of any size: O(1) a row where particles are spread evenly.
///
/// Images within the reach of a face are stored beside the sources, so that a query knows no boundaries. Their
/// separations are evaluated from the sources by the same expressions as everywhere ([`Domain`]), so that rows are
/// those of [`BruteForce`](crate::BruteForce) bit for bit, in another order. Cells are a cutoff wide, an eighth of it
/// along the last axis, and twice that where the set is too thin. Where even those would be too many, as with an
/// outlier at 10^12 spacings, only occupied cells are stored. Rows come in the order of the cells.
///
/// ```
/// use parops::{CellList, Cutoff, Domain, Neighbors, Particles};
/// let square = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
/// let neighbors = CellList::build(&square, &Domain::periodic([0.0; 2], [1.0; 2])?, Cutoff(0.0625))?;
/// assert_eq!(neighbors.count(0, 0.0625), 4);
/// # parops::Result::Ok(())
/// ```
///
/// Source: cell lists, notes 001, sec. 2.1 with errata 47 (no seams here: images are ordinary entries).
#[derive(Clone, Debug)]
pub struct CellList<const D: usize> {
    placed: Arc<Placed<D>>,
    grid: Grid<D>,
    table: Table<D>,
    /// Coordinates of every slot, axis by axis, and `LANES` more so that a load never ends early.
    positions: [Vec<f64>; D],
    sources: Vec<u32>,
    images: Vec<Image>,
    /// The slot of every center; empty where targets are no particles.
    centers: Vec<u32>,
    /// Between these corners no image is within the reach.
    inner: [[f64; 2]; D],
}

impl<const D: usize> CellList<D> {
    /// The particles are targets and sources.
    ///
    /// # Errors
    /// As [`BruteForce::build`](crate::BruteForce::build), and
    /// [`NeighborError::Cells`](crate::NeighborError::Cells) for more than 2^53 cells along an axis,
    /// [`ParticleError::TooMany`](crate::ParticleError::TooMany) where particles and images together are more than
    /// [`PARTICLES_HIGH`](crate::PARTICLES_HIGH).
    pub fn build(particles: &Particles<D>, domain: &Domain<D>, cutoff: Cutoff) -> Result<Self> {
        Self::new(Placed::new(None, particles, domain, cutoff)?)
    }

    /// The targets are points of their own, none of them a particle even where one lies at the same place.
    ///
    /// # Errors
    /// As [`build`](Self::build), and as [`Particles::new`] for the targets; the index an error names is then that of
    /// a target.
    pub fn build_at(
        targets: &[[f64; D]],
        particles: &Particles<D>,
        domain: &Domain<D>,
        cutoff: Cutoff,
    ) -> Result<Self> {
        Self::new(Placed::new(Some(targets), particles, domain, cutoff)?)
    }

    fn new(placed: Placed<D>) -> Result<Self> {
        let sources = &placed.sources;
        let magnitude = magnitude(&placed);
        let reach = placed.cutoff + Grid::<D>::slack(magnitude, placed.cutoff);
        let (ghosts, ghost_origins) = ghosts(&placed, reach)?;
        let count = sources.len() + ghosts.len();
        check_count(count, PARTICLES_HIGH)?;

        let entries = sources.iter().chain(&ghosts);
        let grid = fitting_grid(entries.clone(), count, placed.cutoff, magnitude)?;
        let (table, slots) = Table::build(&grid, entries.clone(), count)?;

        let mut positions: [Vec<f64>; D] = std::array::from_fn(|_| Vec::new());
        for axis in &mut positions {
            *axis = reserved(count + LANES)?;
            axis.resize(count + LANES, 0.0);
        }
        let (mut own, mut images) = (reserved(count)?, reserved(count)?);
        own.resize(count, 0);
        images.resize(count, Image::OWN);
        let origins = (0..sources.len() as u32).map(|source| (source, Image::OWN)).chain(ghost_origins);
        for ((&slot, point), (source, image)) in slots.iter().zip(entries).zip(origins) {
            let slot = slot as usize;
            (own[slot], images[slot]) = (source, image);
            for (axis, &x) in positions.iter_mut().zip(point) {
                axis[slot] = x;
            }
        }
        let mut centers = slots;
        centers.truncate(if placed.center(0).is_some() { sources.len() } else { 0 });
        let inner = placed.domain.inner(reach + grid.slack);
        Ok(Self { placed: Arc::new(placed), grid, table, positions, sources: own, images, centers, inner })
    }

    /// The sources in the order of the cells.
    pub(super) fn order(&self) -> impl Iterator<Item = usize> + '_ {
        let own = self.sources.iter().zip(&self.images).filter(|&(_, &image)| image == Image::OWN);
        own.map(|(&source, _)| source as usize)
    }

    /// All rows up to the reach as indices.
    pub(super) fn links(&self) -> Result<Vec<Links>> {
        Links::rows(self.targets(), |p, links| {
            self.scan(p, self.placed.cutoff, |_, slots, images| {
                if images {
                    slots.iter().for_each(|&slot| links.push(self.sources[slot as usize], self.images[slot as usize]));
                } else {
                    links.extend(slots.iter().map(|&slot| self.sources[slot as usize]));
                }
            });
        })
    }

    /// Calls `found` with the slots of all neighbors of p, some at a time; tells it whether images may be among them.
    ///
    /// Candidates are kept without a branch, because whether one is within the cutoff cannot be predicted.
    #[inline(always)]
    fn scan(&self, p: usize, cutoff: f64, mut found: impl FnMut(&[f64; D], &[u32], bool)) {
        let (Some(target), Some(limit)) = (self.placed.targets().get(p), self.placed.limit(cutoff)) else {
            return;
        };
        let center = self.centers.get(p).copied().unwrap_or(u32::MAX);
        let radius = cutoff.min(self.placed.cutoff);
        let inside = (0..D).all(|axis| self.inner[axis][0] < target[axis] && target[axis] < self.inner[axis][1]);
        // Where an image is stored is rounded: it is found in a wider ball, then measured from its source.
        let rough = if inside { limit } else { within(radius + self.grid.slack) };
        let mut flush = |slots: &mut [u32]| {
            let slots = without(slots, center);
            if inside {
                found(target, slots, false);
            } else {
                let exact = |&slot: &u32| distance_squared(&self.separation(target, slot as usize)) <= limit;
                found(target, keep(slots, exact), true);
            }
        };
        let mut candidates = Candidates { held: 0, slots: [0; ROOM + LANES], squares: [0.0; ROOM + LANES] };
        // All runs are known before the first is looked at: their numbers do not wait for a run that ends unforeseen.
        let mut look = |runs: &[[u32; 2]]| {
            for &[first, past] in runs {
                let (mut first, past) = (first as usize, past as usize);
                while first < past {
                    if candidates.held > ROOM - LANES {
                        flush(candidates.near(rough));
                        candidates.held = 0;
                    }
                    candidates.take(&self.positions, target, first, past);
                    first += LANES;
                }
            }
        };
        let (mut known, mut runs) = (0, [[0; 2]; 16]);
        self.table.runs(&self.grid, target, radius, |run| {
            runs[known % 16] = [run.start as u32, run.end as u32];
            known += 1;
            if known == 16 {
                look(&runs);
                known = 0;
            }
        });
        look(&runs[..known % 16]);
        flush(candidates.near(rough));
    }

    #[inline(always)]
    fn separation(&self, target: &[f64; D], slot: usize) -> [f64; D] {
        match self.images[slot] {
            Image::OWN => std::array::from_fn(|axis| target[axis] - self.positions[axis][slot]),
            image => self.placed.separation(image, target, self.sources[slot] as usize),
        }
    }

    #[inline(always)]
    fn neighbor(&self, target: &[f64; D], slot: u32) -> Neighbor<D> {
        let slot = slot as usize;
        let (separation, image) = (self.separation(target, slot), self.images[slot]);
        let sign = if image == Image::OWN { 1 } else { self.placed.domain.sign(image) };
        Neighbor { q: self.sources[slot] as usize, separation, sign }
    }
}

/// Slots held before they are handed on; a power of two, so that an index is masked, not checked.
const ROOM: usize = 128;

/// Candidates measured side by side.
const LANES: usize = 16;

/// Slots and their squared distances.
struct Candidates {
    held: usize,
    slots: [u32; ROOM + LANES],
    squares: [f64; ROOM + LANES],
}

impl Candidates {
    /// Adds the slots from `first` to before `past`, at most `LANES`.
    #[inline(always)]
    fn take<const D: usize>(&mut self, positions: &[Vec<f64>; D], target: &[f64; D], first: usize, past: usize) {
        // What is written beyond `past` is overwritten by the next, or not held.
        let held = self.held % ROOM;
        let Some(squares) = self.squares[held..].first_chunk_mut::<LANES>() else { return };
        let Some(slots) = self.slots[held..].first_chunk_mut::<LANES>() else { return };
        let mut sums = [0.0; LANES];
        for axis in 0..D {
            let Some(lanes) = positions[axis].get(first..).and_then(|rest| rest.first_chunk::<LANES>()) else { return };
            for lane in 0..LANES {
                let along = target[axis] - lanes[lane];
                sums[lane] += along * along;
            }
        }
        *squares = sums;
        for (lane, slot) in (0..).zip(slots) {
            *slot = (first as u32).wrapping_add(lane);
        }
        self.held = held + LANES.min(past - first);
    }

    /// The slots within `limit`.
    #[inline(always)]
    fn near(&mut self, limit: f64) -> &mut [u32] {
        let mut kept = 0;
        for i in 0..self.held.min(ROOM) {
            self.slots[kept % ROOM] = self.slots[i];
            kept += usize::from(self.squares[i] <= limit);
        }
        &mut self.slots[..kept.min(ROOM)]
    }
}

/// The slots but this one.
#[inline(always)]
fn without(slots: &mut [u32], center: u32) -> &mut [u32] {
    match slots.iter().position(|&slot| slot == center) {
        Some(at) => {
            slots.copy_within(at + 1.., at);
            let past = slots.len() - 1;
            &mut slots[..past]
        }
        None => slots,
    }
}

/// The slots that pass, in their order.
#[inline(always)]
fn keep(slots: &mut [u32], pass: impl Fn(&u32) -> bool) -> &[u32] {
    let mut kept = 0;
    for i in 0..slots.len() {
        slots[kept] = slots[i];
        kept += usize::from(pass(&slots[i]));
    }
    &slots[..kept]
}

/// A bound on every coordinate that enters: targets, sources, faces.
pub(super) fn magnitude<const D: usize>(placed: &Placed<D>) -> f64 {
    let points = placed.sources.iter().chain(placed.targets());
    points.flatten().fold(placed.domain.magnitude(), |high, x| x.abs().max(high))
}

pub(super) type Ghosts<const D: usize> = (Vec<[f64; D]>, Vec<(u32, Image)>);

/// The images of all sources within `reach` of the box, where they lie and whose they are.
pub(super) fn ghosts<const D: usize>(placed: &Placed<D>, reach: f64) -> Result<Ghosts<D>> {
    let (mut positions, mut origins) = (Vec::new(), Vec::new());
    for (source, point) in (0..).zip(&placed.sources) {
        placed.domain.for_images(point, reach, |image| {
            if image != Image::OWN {
                positions.push(placed.domain.position(image, point));
                origins.push((source, image));
            }
        });
        check_count(placed.sources.len() + positions.len(), PARTICLES_HIGH)?;
    }
    Ok((positions, origins))
}

/// The finest of a few grids that a dense table holds, or the finest of all for a sparse one.
fn fitting_grid<'a, const D: usize>(
    entries: impl Iterator<Item = &'a [f64; D]>,
    count: usize,
    cutoff: f64,
    magnitude: f64,
) -> Result<Grid<D>> {
    let (mut lower, mut upper) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for point in entries {
        for axis in 0..D {
            lower[axis] = point[axis].min(lower[axis]);
            upper[axis] = point[axis].max(upper[axis]);
        }
    }
    // Long runs of cells cost less than small ones waste, and along the last axis cells are cheap; coarser ones where
    // particles are thin.
    const LAST: f64 = 0.125;
    let mut sparse = None;
    for width in [1.0, 2.0] {
        let mut widths = [width * cutoff; D];
        widths[D - 1] = LAST * width * cutoff;
        match Grid::new(lower, upper, widths, cutoff, magnitude) {
            Ok(grid) if is_dense(grid.total(), count) => return Ok(grid),
            grid => sparse = sparse.or(Some(grid)),
        }
    }
    sparse.unwrap_or_else(|| Grid::new(lower, upper, [cutoff; D], cutoff, magnitude))
}

impl<const D: usize> Neighbors<D> for CellList<D> {
    fn targets(&self) -> usize {
        self.placed.targets().len()
    }

    fn sources(&self) -> usize {
        self.placed.sources.len()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.placed.center(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.placed.cutoff
    }

    fn reach(&self) -> f64 {
        self.placed.cutoff
    }

    fn generation(&self) -> u64 {
        self.placed.generation
    }

    fn domain(&self) -> Option<&Domain<D>> {
        Some(&self.placed.domain)
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<D>)) {
        self.scan(p, cutoff, |target, slots, _| slots.iter().for_each(|&slot| visit(self.neighbor(target, slot))));
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        self.scan(p, cutoff, |target, slots, images| {
            if images {
                slots.iter().for_each(|&slot| row.push(self.neighbor(target, slot)));
            } else {
                let separation =
                    |&slot: &u32| std::array::from_fn(|axis| target[axis] - self.positions[axis][slot as usize]);
                row.extend(slots.iter().map(|&slot| self.sources[slot as usize]), slots.iter().map(separation));
            }
        });
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        let mut count = 0;
        self.scan(p, cutoff, |_, slots, _| count += slots.len());
        count
    }

    fn stored(&self) -> Result<NeighborList<D>> {
        NeighborList::linked(&self.placed, self.links()?)
    }
}
