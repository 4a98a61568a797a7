//! Targets and sources in their box, checked once: what every provider starts from.

use crate::domain::{Domain, Image, LENGTH_HIGH, LENGTH_LOW};
use crate::error::{NeighborError, Result};
use crate::particles::{PARTICLES_HIGH, Particles, check_count, check_points, reserved};
use crate::scalar::square;
use crate::scale::Cutoff;
use crate::stencil::Neighbor;

/// Sources and targets wrapped into the box, and the cutoff r_c that provider and domain agree on.
#[derive(Clone, Debug)]
pub(super) struct Placed<const D: usize> {
    pub(super) domain: Domain<D>,
    pub(super) sources: Vec<[f64; D]>,
    /// `None` where the sources are the targets.
    targets: Option<Vec<[f64; D]>>,
    pub(super) cutoff: f64,
    pub(super) generation: u64,
}

impl<const D: usize> Placed<D> {
    pub(super) fn new(
        targets: Option<&[[f64; D]]>,
        particles: &Particles<D>,
        domain: &Domain<D>,
        cutoff: Cutoff,
    ) -> Result<Self> {
        check_cutoff(cutoff)?;
        domain.admits(cutoff)?;
        let targets = match targets {
            None => None,
            Some(points) => {
                check_count(points.len(), PARTICLES_HIGH)?;
                check_points(points)?;
                Some(wrapped(points, domain)?)
            }
        };
        let sources = wrapped(particles.points(), domain)?;
        Ok(Self { domain: *domain, sources, targets, cutoff: cutoff.0, generation: particles.generation() })
    }

    pub(super) fn targets(&self) -> &[[f64; D]] {
        self.targets.as_deref().unwrap_or(&self.sources)
    }

    pub(super) fn center(&self, p: usize) -> Option<usize> {
        (self.targets.is_none() && p < self.sources.len()).then_some(p)
    }

    /// The square a query compares with: up to the reach, and `None` where nothing can be within.
    #[inline]
    pub(super) fn limit(&self, cutoff: f64) -> Option<f64> {
        (cutoff >= 0.0).then(|| within(cutoff.min(self.cutoff)))
    }

    /// The separation to an image of source q.
    #[inline]
    pub(super) fn separation(&self, image: Image, target: &[f64; D], q: usize) -> [f64; D] {
        self.domain.separation(image, target, &self.sources[q])
    }

    /// An image of source q as a neighbor.
    #[inline(always)]
    pub(super) fn neighbor(&self, image: Image, target: &[f64; D], q: u32) -> Neighbor<D> {
        let (q, own) = (q as usize, image == Image::OWN);
        let separation = if own { difference(target, &self.sources[q]) } else { self.separation(image, target, q) };
        Neighbor { q, separation, sign: if own { 1 } else { self.domain.sign(image) } }
    }
}

/// x_p - x_q, the separation to a source that is no image.
#[inline(always)]
pub(super) fn difference<const D: usize>(target: &[f64; D], source: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| target[axis] - source[axis])
}

/// cutoff^2, the right-hand side of |separation|^2 <= cutoff^2: one expression for all providers, so that ties at
/// the cutoff are decided alike.
#[inline(always)]
pub(super) fn within(cutoff: f64) -> f64 {
    cutoff * cutoff
}

/// |separation|^2, the left-hand side.
#[inline(always)]
pub(super) fn distance_squared<const D: usize>(separation: &[f64; D]) -> f64 {
    square(separation)
}

/// Refuses a cutoff that is not positive and finite, or whose square is not safe.
pub(super) fn check_cutoff(cutoff: Cutoff) -> Result<()> {
    let cutoff = cutoff.0;
    if !(cutoff > 0.0 && cutoff.is_finite()) {
        return Err(NeighborError::Cutoff { cutoff }.into());
    }
    if !(LENGTH_LOW..=LENGTH_HIGH).contains(&cutoff) {
        return Err(NeighborError::CutoffRange { cutoff, low: LENGTH_LOW, high: LENGTH_HIGH }.into());
    }
    Ok(())
}

fn wrapped<const D: usize>(points: &[[f64; D]], domain: &Domain<D>) -> Result<Vec<[f64; D]>> {
    let mut wrapped = reserved(points.len())?;
    for (p, point) in points.iter().enumerate() {
        wrapped.push(domain.wrap(point).map_err(|error| error.at(p))?);
    }
    Ok(wrapped)
}
