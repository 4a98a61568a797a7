//! How good a particle set is, in a few numbers.

use super::overlap::nearest;
use super::probes::probes;
use super::{CellList, Neighbors};
use crate::domain::{Domain, Face};
use crate::error::Result;
use crate::particles::{Particles, reserved};
use crate::scale::Cutoff;

/// What a set looks like within a cutoff r_c: gaps, holes, numbers of neighbors, disorder, volumes.
///
/// The disorder of a particle is the first moment of its neighbors,
///
/// ```text
/// d_p = |sum_q W(s_pq) s_pq| / sum_q W(s_pq) |s_pq|,   W(s) = (1 - |s|^2/r_c^2)^2,   s_pq = x_p - x_q
/// ```
///
/// 0 on lattices, about 0.027 for a jitter of 0.1 h and 0.08 for 0.3 h where r_c holds 20 neighbors in two dimensions,
/// and towards 1 where all neighbors lie on one side, as at open faces. It is proportional to small displacements, so
/// that its growth is theirs.
///
/// ```
/// use parops::{Cutoff, Domain, Particles, SetQuality};
/// let set = Particles::lattice([0.0; 2], [1.0; 2], [10; 2])?;
/// let quality = SetQuality::measure(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, Cutoff(0.25))?;
/// assert_eq!((quality.fewest, quality.median, quality.most), (20, 20, 20));
/// assert!((quality.separation - 0.1).abs() < 1e-12 && (quality.fill - 0.5_f64.sqrt() / 10.0).abs() < 1e-12);
/// assert!(quality.disorder < 1e-12 && quality.volume_defect.is_some_and(|defect| defect.abs() < 1e-12));
/// # parops::Result::Ok(())
/// ```
///
/// Source: the first moment as a measure of disorder: Antuono, Bouscasse, Colagrossi, Marrone 2014, in another norm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SetQuality {
    /// The least gap between two particles; infinite where none lies within the cutoff of another.
    pub separation: f64,
    /// A particle at that gap.
    pub closest: Option<usize>,
    /// The largest hole, as [`fill_distance`](crate::fill_distance) measures it from about two probes a particle, which lie
    /// where particles or their images are within the cutoff of each other, in cells counted from the first particle on: any
    /// other that is far away changes nothing. Infinite where a probe of a domain
    /// without open faces has nobody within the cutoff, and where no probe has particles all around it.
    pub fill: f64,
    /// The particle nearest to the middle of that hole; `None` where it is infinite.
    pub rim: Option<usize>,
    /// Fewest neighbors.
    pub fewest: usize,
    /// A particle with so few.
    pub loneliest: Option<usize>,
    /// Neighbors of the median particle, the upper one of two.
    pub median: usize,
    /// Most neighbors.
    pub most: usize,
    /// sqrt(mean d_p^2), over the particles that have neighbors.
    pub disorder: f64,
    /// The largest d_p.
    pub largest_disorder: f64,
    /// The particle it belongs to.
    pub most_disordered: Option<usize>,
    /// sum_p V_p over the volume of the domain, less 1; `None` without volumes, or in a domain without end.
    pub volume_defect: Option<f64>,
}

impl SetQuality {
    /// Measures a set; the particles are searched once, the probes once.
    ///
    /// # Errors
    /// As [`CellList::build`]; [`ParticleError::Memory`](crate::ParticleError::Memory) where the probes do not fit.
    pub fn measure<const D: usize>(particles: &Particles<D>, domain: &Domain<D>, cutoff: Cutoff) -> Result<Self> {
        let cells = CellList::build(particles, domain, cutoff)?;
        let (fill, rim) = fill(particles, domain, cutoff)?;
        let mut quality = Self {
            separation: f64::INFINITY,
            closest: None,
            fill,
            rim,
            fewest: usize::MAX,
            loneliest: None,
            median: 0,
            most: 0,
            disorder: 0.0,
            largest_disorder: 0.0,
            most_disordered: None,
            volume_defect: volume_defect(particles, domain),
        };
        let mut counts = reserved(particles.len())?;
        let (mut squares, mut surrounded) = (0.0, 0_usize);
        for p in 0..particles.len() {
            let (mut count, mut square, mut weights, mut moment) = (0, f64::INFINITY, 0.0, [0.0; D]);
            cells.for_each(p, cutoff.0, |neighbor| {
                let r2: f64 = neighbor.separation.iter().map(|s| s * s).sum();
                let w = (1.0 - r2 / (cutoff.0 * cutoff.0)).max(0.0).powi(2);
                count += 1;
                square = square.min(r2);
                weights += w * r2.sqrt();
                moment.iter_mut().zip(&neighbor.separation).for_each(|(moment, s)| *moment += w * s);
            });
            counts.push(count);
            if count < quality.fewest {
                (quality.fewest, quality.loneliest) = (count, Some(p));
            }
            if square.sqrt() < quality.separation {
                (quality.separation, quality.closest) = (square.sqrt(), Some(p));
            }
            if weights > 0.0 {
                let disorder = moment.iter().map(|m| m * m).sum::<f64>().sqrt() / weights;
                squares += disorder * disorder;
                surrounded += 1;
                if disorder >= quality.largest_disorder {
                    (quality.largest_disorder, quality.most_disordered) = (disorder, Some(p));
                }
            }
        }
        counts.sort_unstable();
        quality.median = counts.get(counts.len() / 2).copied().unwrap_or(0);
        quality.most = counts.last().copied().unwrap_or(0);
        quality.fewest = counts.first().copied().unwrap_or(0);
        quality.disorder = (squares / surrounded.max(1) as f64).sqrt();
        Ok(quality)
    }
}

fn volume_defect<const D: usize>(particles: &Particles<D>, domain: &Domain<D>) -> Option<f64> {
    let (volumes, whole) = (particles.volumes().ok()?, domain.volume());
    let sum = match volumes.common() {
        Some(volume) => volume * particles.len() as f64,
        None => (0..particles.len()).filter_map(|p| volumes.get(p).ok()).sum(),
    };
    whole.is_finite().then(|| sum / whole - 1.0)
}

/// The largest hole seen from the probes, and the particle nearest to its middle.
fn fill<const D: usize>(particles: &Particles<D>, domain: &Domain<D>, cutoff: Cutoff) -> Result<(f64, Option<usize>)> {
    let probes = probes(particles.points(), domain, cutoff)?;
    let around = CellList::build_at(&probes, particles, domain, cutoff)?;
    let closed = domain.faces().iter().flatten().all(|face| *face != Face::Open);
    let (mut hole, mut rim) = (0.0_f64, None);
    for p in 0..probes.len() {
        let seen = nearest(&around, p);
        if (closed || seen.surrounded) && seen.distance > hole {
            (hole, rim) = (seen.distance, seen.q);
        }
    }
    // A probe on a particle has seen nothing.
    Ok(if hole > 0.0 { (hole, rim) } else { (f64::INFINITY, None) })
}
