//! How well a set covers its place: the least gap between particles, and the largest hole.

use super::Neighbors;

/// The least distance between a target and a neighbor of it; infinite where nobody has a neighbor within the cutoff.
///
/// ```
/// use parops::{CellList, Cutoff, Domain, Particles, least_gap};
/// let particles = Particles::new(vec![[0.0], [0.5], [0.625]])?;
/// let cells = CellList::build(&particles, &Domain::open(), Cutoff(0.25))?;
/// assert_eq!(least_gap(&cells), 0.125);
/// # parops::Result::Ok(())
/// ```
pub fn least_gap<const D: usize>(provider: &impl Neighbors<D>) -> f64 {
    let mut square = f64::INFINITY;
    for p in 0..provider.targets() {
        provider.for_each(p, provider.cutoff(p), |neighbor| square = square.min(squared(&neighbor.separation)));
    }
    square.sqrt()
}

/// The largest hole: the greatest distance from a target to its nearest source, over all targets that are surrounded.
///
/// Targets are probes, such as the nodes of a mesh and the middles of its cells; the set has holes between them that are
/// larger by up to their own fill distance. A probe is surrounded where every one of the 2^D orthants around it holds a
/// source within the cutoff: those beside the set are not, nor those in a hole wider than the cutoff. 0 where no probe is
/// surrounded. A lattice of spacing h has the fill distance h sqrt(D)/2.
///
/// ```
/// use parops::{CellList, Cutoff, Domain, Particles, fill_distance};
/// let particles = Particles::new(vec![[0.0], [0.25], [1.0], [1.25]])?;
/// let probes = [[-0.5], [0.125], [0.75], [3.0]];
/// let cells = CellList::build_at(&probes, &particles, &Domain::open(), Cutoff(0.75))?;
/// assert_eq!(fill_distance(&cells), 0.25);
/// # parops::Result::Ok(())
/// ```
///
/// Source: Wendland 2004, def. 1.4 (fill distance). Up to 6 dimensions.
pub fn fill_distance<const D: usize>(provider: &impl Neighbors<D>) -> f64 {
    let seen = (0..provider.targets()).map(|p| nearest(provider, p));
    seen.filter(|seen| seen.surrounded).fold(0.0, |hole, seen| seen.distance.max(hole))
}

/// What a probe sees within the cutoff.
pub(super) struct Seen {
    /// To the nearest source; infinite where there is none.
    pub distance: f64,
    /// That source.
    pub q: Option<usize>,
    /// Whether every orthant holds a source.
    pub surrounded: bool,
}

/// The nearest source of target p.
pub(super) fn nearest<const D: usize>(provider: &impl Neighbors<D>, p: usize) -> Seen {
    const { assert!(D <= 6, "holes are measured in at most 6 dimensions") };
    // A bit for every orthant that holds no source; a source between two serves both.
    let (mut square, mut empty) = (f64::INFINITY, if D == 6 { u64::MAX } else { (1 << (1_u64 << D)) - 1 });
    let mut nearest = None;
    provider.for_each(p, provider.cutoff(p), |neighbor| {
        let z = &neighbor.separation;
        if squared(z) < square {
            (square, nearest) = (squared(z), Some(neighbor.q));
        }
        if empty == 0 {
            return;
        }
        for orthant in 0..1_u64 << D {
            let holds = |(axis, &z): (usize, &f64)| if orthant >> axis & 1 == 1 { z >= 0.0 } else { z <= 0.0 };
            if z.iter().enumerate().all(holds) {
                empty &= !(1 << orthant);
            }
        }
    });
    Seen { distance: square.sqrt(), q: nearest, surrounded: empty == 0 }
}

fn squared<const D: usize>(z: &[f64; D]) -> f64 {
    z.iter().map(|z| z * z).sum()
}
