//! What a list of the user's own must obey.

use super::placed::{distance_squared, within};
use crate::error::{Error, NeighborError, ParticleError, Result};
use crate::stencil::Neighbor;

/// Refuses offsets that do not start at 0, decrease, or miss the number of neighbors.
pub(super) fn check_offsets(offsets: &[usize], targets: usize, neighbors: usize) -> Result<()> {
    if Some(offsets.len()) != targets.checked_add(1) {
        return Err(ParticleError::Length { found: offsets.len(), needed: targets.saturating_add(1) }.into());
    }
    let mut least = 0;
    for (row, &found) in offsets.iter().enumerate() {
        if found < least || (row == 0 && found != 0) {
            return Err(Error::from(NeighborError::Offsets { row, found, needed: least }).at(row));
        }
        if row == targets && found != neighbors {
            return Err(NeighborError::Offsets { row, found, needed: neighbors }.into());
        }
        least = found;
    }
    Ok(())
}

/// Refuses the first neighbor of a row that breaks a rule, then repeated ones.
pub(super) fn check_row<const D: usize>(
    sources: usize,
    center: Option<usize>,
    row: &[Neighbor<D>],
    cutoff: f64,
) -> Result<()> {
    for &Neighbor { q, separation, sign } in row {
        if q >= sources {
            return Err(NeighborError::Source { q, sources }.into());
        }
        if let Some(axis) = (0..D).find(|&axis| !separation[axis].is_finite()) {
            return Err(NeighborError::Separation { q, axis, separation: separation[axis] }.into());
        }
        if sign != 1 && sign != -1 {
            return Err(NeighborError::Sign { q, sign }.into());
        }
        let squared = distance_squared(&separation);
        if !(squared <= within(cutoff)) {
            return Err(NeighborError::Distance { q, distance: squared.sqrt(), cutoff }.into());
        }
        if center == Some(q) && sign == 1 && separation == [0.0; D] {
            return Err(NeighborError::OwnCenter { q }.into());
        }
    }
    // Adding zero makes -0 and +0 one place.
    let mut images: Vec<_> = row.iter().map(|n| (n.q, n.separation.map(|s| (s + 0.0).to_bits()), n.sign)).collect();
    images.sort_unstable();
    match images.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(NeighborError::Repeated { q: pair[0].0 }.into()),
        None => Ok(()),
    }
}
