//! What a run refuses to go on with: overlap that is lost, and mass that drifts.

use super::fields::Fields;
use super::lagrangian::Lagrangian;
use super::ledger::Totals;
use super::moving::{MovingScene, MovingState};
use super::remeshing::{hole_of, spacings};
use crate::domain::Domain;
use crate::error::{Result, SolverError};
use crate::mesh::Mesh;
use crate::neighbors::{CellList, least_gap};
use crate::particles::Particles;
use crate::scale::Cutoff;
use crate::time::Stepper;

/// Overlap of moving particles, measured from time to time and refused where it is lost.
///
/// The number of neighbors does not show it. Holes and gaps are in spacings of the mesh, as for
/// [`Trigger::Overlap`](super::Trigger::Overlap): a fresh mesh has a hole of sqrt(D)/2 and a gap of 1. The ledger records
/// both after every measurement.
#[derive(Clone, Copy, Debug)]
pub struct OverlapWatch<const D: usize> {
    /// Whose spacing counts, and from whose nodes and middles of cells holes are looked for.
    pub mesh: Mesh<D>,
    /// After how many steps they are measured.
    pub every: u64,
    /// The largest legal hole, above sqrt(D)/2. Holes three times as wide that open between two measurements may be missed.
    pub hole: f64,
    /// The least legal gap, from 0 to below 1.
    pub gap: f64,
}

impl<const D: usize> OverlapWatch<D> {
    pub(super) fn check(&self) -> Result<()> {
        let illegal = [
            (self.every == 0).then_some(0.0),
            (!(self.hole > (D as f64).sqrt() / 2.0 && self.hole.is_finite())).then_some(self.hole),
            (!(self.gap >= 0.0 && self.gap < 1.0)).then_some(self.gap),
        ];
        match illegal.into_iter().flatten().next() {
            Some(value) => Err(SolverError::Trigger { value }.into()),
            None => Ok(()),
        }
    }

    /// The largest hole and the least gap of a set, in spacings.
    ///
    /// # Errors
    /// [`SolverError::OverlapLost`] where they are not legal.
    pub(super) fn measure(&self, particles: &Particles<D>, domain: &Domain<D>) -> Result<(f64, f64)> {
        let (narrow, wide) = spacings(&self.mesh);
        let gap = least_gap(&CellList::build(particles, domain, Cutoff(narrow))?) / narrow;
        let hole = hole_of(&self.mesh, particles, domain, self.hole)? / wide;
        if hole > self.hole || gap < self.gap {
            return Err(SolverError::OverlapLost { hole, most: self.hole, gap, least: self.gap }.into());
        }
        Ok((hole, gap))
    }
}

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    /// Measures overlap after every so many steps, and refuses a step that loses it.
    ///
    /// # Errors
    /// [`SolverError::Trigger`] for illegal numbers.
    pub fn watching(mut self, watch: OverlapWatch<D>) -> Result<Self> {
        watch.check()?;
        self.watch = Some(watch);
        Ok(self)
    }

    /// Refuses steps after which the mass of a field has drifted by more than this share of sum_p |omega_p|; what sources
    /// add, and what remeshing drops, counts as drift.
    ///
    /// # Errors
    /// [`SolverError::Budget`] where it is not positive.
    pub fn drift_budget(mut self, budget: f64) -> Result<Self> {
        self.ledger.budget = check_budget(budget)?;
        Ok(self)
    }

    /// The largest hole and the least gap after a step, where they are due; refuses what is lost, and a mass that has
    /// drifted.
    pub(super) fn watched(&mut self, work: &MovingState<D, S::Value>, t: f64) -> Result<Option<(f64, f64)>> {
        let (points, strengths) = (self.moving.points(work), self.moving.omega(work));
        let strength = |p: usize, i: usize| strengths.get(p).map_or(0.0, |omega| omega.get(i));
        check_drift::<D, S::Value>(points, strength, &self.start, self.ledger.budget)?;
        let Some(watch) = self.watch.filter(|watch| (self.ledger.step + 1).is_multiple_of(watch.every)) else {
            return Ok(None);
        };
        self.moving.place(t, work)?;
        watch.measure(self.moving.held.site.particles(), &self.moving.domain).map(Some)
    }
}

/// Refuses a budget that is not positive; infinite is none.
pub(super) fn check_budget(value: f64) -> Result<f64> {
    if value > 0.0 { Ok(value) } else { Err(SolverError::Budget { value }.into()) }
}

/// Refuses strengths whose sums have drifted from those at the start by more than the budget times their size.
pub(super) fn check_drift<const D: usize, E: Fields>(
    points: &[[f64; D]],
    strength: impl Fn(usize, usize) -> f64,
    start: &[f64],
    budget: f64,
) -> Result<()> {
    if budget == f64::INFINITY {
        return Ok(());
    }
    for (field, start) in start.iter().enumerate().take(E::FIELDS) {
        let Totals { mass, size, .. } = Totals::measure(points, |p| (strength(p, field), 0.0));
        let drift = mass - start;
        if !(drift.abs() <= budget * size) {
            return Err(SolverError::Drift { field, drift, size, budget }.into());
        }
    }
    Ok(())
}
