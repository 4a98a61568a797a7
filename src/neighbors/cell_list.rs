//! The cell list: sources and the images they cast near the faces, sorted by cell.

use super::Neighbors;
use super::grid::Grid;
use super::placed::{Placed, distance_squared, within};
use super::table::{Table, is_dense};
use crate::domain::{Domain, Image};
use crate::error::Result;
use crate::particles::{PARTICLES_HIGH, Particles, check_count, reserved};
use crate::scale::Cutoff;
use crate::stencil::{Neighbor, Stencil};

/// The provider for sets of any size: O(1) a row where particles are spread evenly.
///
/// Images within the reach of a face are stored beside the sources, so that a query knows no boundaries. Their
/// separations are evaluated from the sources by the same expressions as everywhere ([`Domain`]), so that rows are
/// those of [`BruteForce`](crate::BruteForce) bit for bit, in another order. Cells are a cutoff wide, a quarter of it
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
    placed: Placed<D>,
    grid: Grid<D>,
    table: Table<D>,
    positions: Vec<[f64; D]>,
    /// Source and image of every slot.
    origins: Vec<Origin>,
    /// The slot of every center; empty where targets are no particles.
    centers: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Origin {
    source: u32,
    image: Image,
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

        let own = (0..sources.len() as u32).map(|source| Origin { source, image: Image::OWN });
        let mut positions: Vec<[f64; D]> = reserved(count)?;
        let mut origins: Vec<Origin> = reserved(count)?;
        positions.resize(count, [0.0; D]);
        origins.resize(count, Origin { source: 0, image: Image::OWN });
        for ((&slot, point), origin) in slots.iter().zip(entries).zip(own.chain(ghost_origins)) {
            positions[slot as usize] = *point;
            origins[slot as usize] = origin;
        }
        let mut centers = slots;
        centers.truncate(if placed.center(0).is_some() { sources.len() } else { 0 });
        Ok(Self { placed, grid, table, positions, origins, centers })
    }

    /// The sources in the order of the cells.
    pub(super) fn order(&self) -> impl Iterator<Item = usize> + '_ {
        self.origins.iter().filter(|origin| origin.image == Image::OWN).map(|origin| origin.source as usize)
    }

    /// Calls `found` for every neighbor of p.
    ///
    /// Candidates are first filtered without a branch into a small buffer, because whether a candidate is within the
    /// cutoff cannot be predicted; what remains is measured exactly.
    #[inline(always)]
    fn scan(&self, p: usize, cutoff: f64, mut found: impl FnMut(Neighbor<D>)) {
        let (Some(target), Some(limit)) = (self.placed.targets().get(p), self.placed.limit(cutoff)) else {
            return;
        };
        let center = self.centers.get(p).copied().unwrap_or(u32::MAX);
        let radius = cutoff.min(self.placed.cutoff);
        let rough = within(radius + self.grid.slack);
        let mut filter = Filter { list: self, target, rough, held: 0, buffer: [0; BUFFER] };
        let mut measure = |slots: &[u32]| {
            for &slot in slots {
                let Origin { source, image } = self.origins[slot as usize];
                let (separation, sign) = if image == Image::OWN {
                    (difference(target, &self.positions[slot as usize]), 1)
                } else {
                    let separation = self.placed.separation(image, target, source as usize);
                    (separation, self.placed.domain.sign(image))
                };
                if slot != center && distance_squared(&separation) <= limit {
                    found(Neighbor { q: source as usize, separation, sign });
                }
            }
        };
        self.table.runs(&self.grid, target, radius, |run| {
            for first in run.clone().step_by(BUFFER / 2) {
                if filter.held > BUFFER / 2 {
                    measure(&filter.buffer[..filter.held]);
                    filter.held = 0;
                }
                filter.take(first, run.end.min(first + BUFFER / 2));
            }
        });
        measure(&filter.buffer[..filter.held]);
    }
}

/// Candidates held before they are measured; a power of two, so that an index is masked, not checked.
const BUFFER: usize = 128;

/// Slots near enough to be measured.
struct Filter<'a, const D: usize> {
    list: &'a CellList<D>,
    target: &'a [f64; D],
    rough: f64,
    held: usize,
    buffer: [u32; BUFFER],
}

impl<const D: usize> Filter<'_, D> {
    /// Keeps the slots from `first` to before `past`, at most half a buffer, that are near enough.
    #[inline(always)]
    fn take(&mut self, first: usize, past: usize) {
        let mut held = self.held;
        for (slot, position) in (first as u32..).zip(&self.list.positions[first..past]) {
            self.buffer[held % BUFFER] = slot;
            held += usize::from(distance_squared(&difference(self.target, position)) <= self.rough);
        }
        self.held = held;
    }
}

#[inline(always)]
fn difference<const D: usize>(target: &[f64; D], source: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| target[axis] - source[axis])
}

/// A bound on every coordinate that enters: targets, sources, faces.
fn magnitude<const D: usize>(placed: &Placed<D>) -> f64 {
    let points = placed.sources.iter().chain(placed.targets());
    points.flatten().fold(placed.domain.magnitude(), |high, x| x.abs().max(high))
}

/// The images of all sources within `reach` of the box, where they lie and whose they are.
fn ghosts<const D: usize>(placed: &Placed<D>, reach: f64) -> Result<(Vec<[f64; D]>, Vec<Origin>)> {
    let (mut positions, mut origins) = (Vec::new(), Vec::new());
    for (source, point) in (0..).zip(&placed.sources) {
        placed.domain.for_images(point, reach, |image| {
            if image != Image::OWN {
                positions.push(placed.domain.position(image, point));
                origins.push(Origin { source, image });
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
    const LAST: f64 = 0.25;
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

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        self.scan(p, cutoff, visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        row.reset(p, self.center(p), cutoff);
        self.scan(p, cutoff, |neighbor| row.push(neighbor));
    }

    fn count(&self, p: usize, cutoff: f64) -> usize {
        let mut count = 0;
        self.scan(p, cutoff, |_| count += 1);
        count
    }
}
