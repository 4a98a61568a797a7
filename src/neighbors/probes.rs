//! Places to look for holes from: about two a particle, where the particles are.

use std::collections::BTreeMap;

use crate::domain::{Domain, Face};
use crate::error::{ParticleError, Result};
use crate::scale::Cutoff;

/// Probes of a domain without open faces lie all over it. In any other they lie between particles, images too, of each cell of
/// one cutoff and of the cells around it, as densely as these. Cells are counted from the first particle on: what else is far
/// away changes nothing.
pub(super) fn probes<const D: usize>(points: &[[f64; D]], domain: &Domain<D>, cutoff: Cutoff) -> Result<Vec<[f64; D]>> {
    let mut probes = Vec::new();
    if domain.faces().iter().flatten().all(|face| *face != Face::Open) {
        cover(domain.lower(), domain.upper(), points.len(), &mut probes)?;
        return Ok(probes);
    }
    let Some(origin) = points.first() else { return Ok(probes) };
    let (lower, upper) = (domain.lower(), domain.upper());
    for (cell, block) in blocks(points, domain, origin, cutoff.0) {
        // A place with particles all around it is within the box of those of its block.
        let face = |axis: usize, side: i64| origin[axis] + cell[axis].saturating_add(side) as f64 * cutoff.0;
        let low = std::array::from_fn(|axis| block.low[axis].max(face(axis, 0)).max(lower[axis]));
        let high = std::array::from_fn(|axis| block.high[axis].min(face(axis, 1)).min(upper[axis]));
        if (0..D).all(|axis| low[axis] <= high[axis]) {
            let share = |axis: usize| match block.high[axis] - block.low[axis] {
                0.0 => 1.0,
                width => (high[axis] - low[axis]) / width,
            };
            let held = block.held as f64 * (0..D).map(share).product::<f64>();
            cover(low, high, held.ceil() as usize, &mut probes)?;
        }
    }
    Ok(probes)
}

/// The particles of a cell and of the cells around it: their number, and the box they lie in.
struct Block<const D: usize> {
    held: usize,
    low: [f64; D],
    high: [f64; D],
}

impl<const D: usize> Block<D> {
    fn of(x: &[f64; D]) -> Self {
        Self { held: 1, low: *x, high: *x }
    }

    fn join(&mut self, other: &Self) {
        self.held += other.held;
        for axis in 0..D {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
    }
}

/// The blocks of all cells with a particle or an image in them or beside them, by the numbers of the cells.
fn blocks<const D: usize>(
    points: &[[f64; D]],
    domain: &Domain<D>,
    origin: &[f64; D],
    edge: f64,
) -> BTreeMap<[i64; D], Block<D>> {
    let (mut cells, mut blocks) = (BTreeMap::new(), BTreeMap::new());
    for x in points {
        domain.for_images(x, edge, |image| {
            let x = domain.position(image, x);
            // The cast saturates: farther cells are one.
            let cell = std::array::from_fn(|axis| ((x[axis] - origin[axis]) / edge).floor() as i64);
            join(&mut cells, cell, &Block::of(&x));
        });
    }
    for (cell, own) in &cells {
        for around in 0..3_usize.pow(D as u32) {
            let turn = |axis: usize| (around / 3_usize.pow(axis as u32) % 3) as i64 - 1;
            join(&mut blocks, std::array::from_fn(|axis: usize| cell[axis].saturating_add(turn(axis))), own);
        }
    }
    blocks
}

fn join<const D: usize>(blocks: &mut BTreeMap<[i64; D], Block<D>>, cell: [i64; D], other: &Block<D>) {
    let empty = Block { held: 0, low: other.low, high: other.high };
    blocks.entry(cell).or_insert(empty).join(other);
}

/// The corners and the middles of about `count` cells of a box.
fn cover<const D: usize>(low: [f64; D], high: [f64; D], count: usize, probes: &mut Vec<[f64; D]>) -> Result<()> {
    let widths: [f64; D] = std::array::from_fn(|axis| high[axis] - low[axis]);
    let counts = cells_of(widths, count);
    let total = counts.iter().product::<usize>();
    probes.try_reserve(2 * total).map_err(|_| ParticleError::Memory { count: probes.len() + 2 * total })?;
    for cell in 0..total {
        let mut rest = cell;
        let index = counts.map(|count| {
            let i = rest % count;
            rest /= count;
            i as f64
        });
        for shift in [0.0, 0.5] {
            let at = |axis: usize| low[axis] + widths[axis] * (index[axis] + shift) / counts[axis] as f64;
            probes.push(std::array::from_fn(at));
        }
    }
    Ok(())
}

/// Cells along the axes of a box, about `count` in all and as cubic as can be; one across an axis without extent.
fn cells_of<const D: usize>(widths: [f64; D], count: usize) -> [usize; D] {
    let mut cells = [1; D];
    let mut axes: Vec<usize> = (0..D).filter(|&axis| widths[axis] > 0.0).collect();
    // The narrowest first: what it cannot take is left to the others.
    axes.sort_by(|&a, &b| widths[a].total_cmp(&widths[b]));
    let mut left = count.max(1) as f64;
    for (i, &axis) in axes.iter().enumerate() {
        let rest = (axes.len() - i) as f64;
        let mean = axes[i..].iter().map(|&axis| widths[axis].ln()).sum::<f64>() / rest;
        let share = (widths[axis].ln() - mean).exp() * left.powf(1.0 / rest);
        cells[axis] = (share.round() as usize).clamp(1, count.max(1));
        left = (left / cells[axis] as f64).max(1.0);
    }
    cells
}
