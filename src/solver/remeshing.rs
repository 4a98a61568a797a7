//! When moving particles are replaced by those of a mesh, and by which kernel.

use super::fields::Fields;
use crate::domain::{Domain, Face};
use crate::error::{Result, SolverError};
use crate::kernel::MeshKernel;
use crate::mesh::{Mesh, Remeshed};
use crate::neighbors::{CellList, fill_distance, least_gap};
use crate::particles::Particles;
use crate::scale::{Cutoff, Spacing};

/// When particles are replaced.
///
/// They have a turn after every step, and within a step that is cut ([`StepPolicy::Adapt`](super::StepPolicy::Adapt)) before
/// each substep that would take the sum of dt |grad v|_2 since the last turn above its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Trigger {
    /// At one of so many turns: after every so many steps, where distortion cuts none.
    Steps(u64),
    /// When overlap is lost: as soon as the largest hole ([`fill_distance`]) is wider than `hole` or the least gap
    /// ([`least_gap`]) narrower than `gap`, both in spacings of the mesh. A fresh mesh has a hole of sqrt(D)/2 and a gap of
    /// 1; the number of neighbors shows neither.
    ///
    /// It keeps a set fit for its operators. It does not converge: between two remeshings particles are distorted by as
    /// much whatever h, and the field they deposit misses by as much. Orders need remeshing after a fixed number of steps.
    Overlap {
        /// The largest legal hole, above sqrt(D)/2.
        hole: f64,
        /// The least legal gap, below 1.
        gap: f64,
    },
    /// When a row of the diffusion term has a condition number above this.
    Condition(f64),
}

/// Remeshing of moving particles.
///
/// Strengths are deposited on the mesh and every node whose strength exceeds `threshold` becomes a particle; what does not
/// is dropped, and counted in the ledger. Mass and the moments up to the exactness of the kernel stay but for rounding and
/// what is dropped.
///
/// Source: notes 001, sec. 7.4.
#[derive(Clone, Copy, Debug)]
pub struct Remeshing<const D: usize, K> {
    /// The kernel, such as [`Lambda`](crate::Lambda).
    pub kernel: K,
    /// The mesh. It is periodic where the domain is, with the same faces; elsewhere it may be smaller, and particles whose
    /// support leaves it are refused.
    pub mesh: Mesh<D>,
    /// When.
    pub trigger: Trigger,
    /// Strengths up to this magnitude are dropped; 0 drops what is exactly 0.
    pub threshold: f64,
}

/// Remeshing with the kernel behind a pointer: a run is the same for all of them.
pub(super) trait Remesher<const D: usize, E: Fields>: Send + Sync {
    fn exactness(&self) -> u32;
    fn mesh(&self) -> &Mesh<D>;
    fn trigger(&self) -> Trigger;
    fn threshold(&self) -> f64;
    fn remesh(&self, points: &[[f64; D]], strengths: &[E], values: &mut Vec<E>) -> Result<Remeshed<E, D>>;
}

/// The number of nodes of the kernel, S, is part of the type so that it can be forgotten.
pub(super) struct Nodes<const D: usize, K, const S: usize>(pub(super) Remeshing<D, K>);

impl<const D: usize, E: Fields, K: MeshKernel<f64, S>, const S: usize> Remesher<D, E> for Nodes<D, K, S> {
    fn exactness(&self) -> u32 {
        self.0.kernel.exactness()
    }

    fn mesh(&self) -> &Mesh<D> {
        &self.0.mesh
    }

    fn trigger(&self) -> Trigger {
        self.0.trigger
    }

    fn threshold(&self) -> f64 {
        self.0.threshold
    }

    fn remesh(&self, points: &[[f64; D]], strengths: &[E], values: &mut Vec<E>) -> Result<Remeshed<E, D>> {
        let Remeshing { kernel, mesh, threshold, .. } = &self.0;
        values.clear();
        values.resize(mesh.len(), E::ZERO);
        E::deposit(mesh, kernel, points, strengths, values)?;
        E::remesh(mesh, values, *threshold)
    }
}

/// Refuses a remeshing that does not fit the domain, the operator (its order, and whether its rows have conditions), or
/// itself.
pub(super) fn check<const D: usize, E: Fields>(
    remesher: &impl Remesher<D, E>,
    domain: &Domain<D>,
    order: Option<u32>,
    conditioned: bool,
) -> Result<Spacing> {
    let (exactness, mesh) = (remesher.exactness(), remesher.mesh());
    if let Some(order) = order.filter(|&order| order > exactness) {
        return Err(SolverError::Exactness { exactness, order }.into());
    }
    for axis in 0..D {
        let faces = |domain: &Domain<D>| [domain.lower()[axis], domain.upper()[axis]];
        let periodic = |domain: &Domain<D>| domain.faces()[axis][0] == Face::Periodic;
        let (own, box_of) = (mesh.domain(), domain);
        if periodic(own) != periodic(box_of) || (periodic(own) && faces(own) != faces(box_of)) {
            return Err(SolverError::MeshAxis { axis, mesh: faces(own), domain: faces(box_of) }.into());
        }
    }
    let threshold = remesher.threshold();
    if !(threshold >= 0.0 && threshold.is_finite()) {
        return Err(crate::error::MeshError::Threshold { field: 0, threshold }.into());
    }
    let illegal = match remesher.trigger() {
        Trigger::Steps(steps) => (steps == 0).then_some(0.0),
        Trigger::Overlap { hole, .. } if !(hole > (D as f64).sqrt() / 2.0 && hole.is_finite()) => Some(hole),
        Trigger::Overlap { gap, .. } => (!(gap > 0.0 && gap < 1.0)).then_some(gap),
        Trigger::Condition(condition) => (!(condition > 1.0 && conditioned)).then_some(condition),
    };
    if let Some(value) = illegal {
        return Err(SolverError::Trigger { value }.into());
    }
    Ok(Spacing(mesh.spacings().iter().fold(0.0, |widest: f64, &h| widest.max(h))))
}

/// How far around a probe sources are looked for, in units of the largest legal hole: a wider hole that opens within one
/// step would be missed.
const SIGHT: f64 = 3.0;

/// Whether a set has lost its overlap, in spacings h of the mesh.
pub(super) fn overlap_is_lost<const D: usize>(
    mesh: &Mesh<D>,
    particles: &Particles<D>,
    domain: &Domain<D>,
    hole: f64,
    gap: f64,
) -> Result<bool> {
    let (least, widest) = spacings(mesh);
    if least_gap(&CellList::build(particles, domain, Cutoff(gap * least))?) < gap * least {
        return Ok(true);
    }
    Ok(hole_of(mesh, particles, domain, hole)? > hole * widest)
}

/// The smallest and the largest spacing of a mesh.
pub(super) fn spacings<const D: usize>(mesh: &Mesh<D>) -> (f64, f64) {
    mesh.spacings().iter().fold((f64::INFINITY, 0.0_f64), |(l, w), &h| (l.min(h), w.max(h)))
}

/// The largest hole, seen from the nodes of a mesh and the middles of its cells, as long as it is not above three times
/// `hole` spacings.
pub(super) fn hole_of<const D: usize>(
    mesh: &Mesh<D>,
    particles: &Particles<D>,
    domain: &Domain<D>,
    hole: f64,
) -> Result<f64> {
    let half = mesh.spacings().map(|h| 0.5 * h);
    let middle = |x: [f64; D]| std::array::from_fn(|axis| x[axis] + half[axis]);
    let inside = |x: [f64; D]| domain.wrap(&x).ok();
    let probes: Vec<[f64; D]> = mesh.points().flat_map(|x| [x, middle(x)]).filter_map(inside).collect();
    let sight = Cutoff(SIGHT * hole * spacings(mesh).1);
    Ok(fill_distance(&CellList::build_at(&probes, particles, domain, sight)?))
}
