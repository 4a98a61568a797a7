//! What a Lagrangian run records: its ledger after every step, and all it needs to be taken up again.

use super::fields::Fields;
use super::flow::Flow;
use super::lagrangian::Lagrangian;
use super::ledger::Totals;
use super::moving::{Held, MovingScene, MovingState, wrapped};
use super::moving_diffusion::MovingDiffusion;
use super::saved::SavedParticles;
use crate::apply::Report;
use crate::error::{Result, TimeError};
use crate::particles::Particles;
use crate::scale::Volumes;
use crate::time::Stepper;

impl<const D: usize, S: MovingScene<D>, St: Stepper<MovingState<D, S::Value>>> Lagrangian<D, S, St> {
    pub(super) fn certify(&mut self, report: Option<&Report>) {
        if let Some(report) = report {
            (self.ledger.condition, self.ledger.residual) = (report.condition, report.residual);
        }
    }

    pub(super) fn measure(&mut self) {
        let Self { moving, state, ledger, start, .. } = self;
        let (omega, volume) = (moving.omega(state), moving.volume(state));
        for (i, totals) in ledger.fields.iter_mut().enumerate() {
            let of = |p: usize| {
                let strength = omega.get(p).map_or(0.0, |omega| omega.get(i));
                (strength, strength / volume.get(p).copied().unwrap_or(1.0))
            };
            totals.renew(Totals::measure(moving.points(state), of), start.get(i).copied());
        }
        ledger.rebuilds = moving.searches().0;
    }

    /// The run as it stands; the scene is not in it.
    pub fn save(&self) -> SavedParticles<S::Value, St>
    where
        St: Clone,
    {
        let (searches, searched_at) = self.moving.searches();
        let dropped = |of: fn(&Totals<D>) -> f64| self.ledger.fields.iter().map(of).collect();
        SavedParticles {
            t: self.t,
            step: self.ledger.step,
            retries: self.ledger.retries,
            remeshings: self.ledger.remeshings,
            turns: self.turns,
            start: self.start.clone(),
            dropped: dropped(|field| field.dropped),
            dropped_size: dropped(|field| field.dropped_size),
            points: self.points().as_flattened().to_vec(),
            strengths: self.strengths().to_vec(),
            volumes: self.volumes().to_vec(),
            searches,
            searched_at: searched_at.as_flattened().to_vec(),
            surveyed: self.surveyed,
            growth: Some(self.ledger.growth).filter(|growth| !growth.is_nan()),
            stepper: self.stepper.clone(),
        }
    }

    /// Takes up a saved run with the same scene in the same domain: the steps that follow have the bits they would have
    /// had. Policies, limits and remeshing stay those of this run.
    ///
    /// # Errors
    /// [`TimeError::Shape`] where the parts of the saved run do not fit each other or the fields of this one; as
    /// [`Particles::new`], [`Volumes::each`] and [`MovingDiffusion::restart`]. The run is then as it was.
    pub fn resume(&mut self, saved: SavedParticles<S::Value, St>) -> Result<()> {
        let (fields, count) = (<S::Value as Fields>::FIELDS, saved.strengths.len());
        let searched = if <S::Diffusion as MovingDiffusion<D, S::Value>>::SPREADS { D * count } else { 0 };
        let fits = [
            (saved.points.len(), D * count),
            (saved.volumes.len(), count),
            (saved.searched_at.len(), searched),
            (saved.start.len(), fields),
            (saved.dropped.len(), fields),
            (saved.dropped_size.len(), fields),
        ];
        if let Some((found, needed)) = fits.into_iter().find(|(found, needed)| found != needed) {
            return Err(TimeError::Shape { found, needed }.into());
        }
        self.moving.scene.advection_term().validate(count)?;
        self.moving.scene.diffusion_term().validate(count)?;
        let points = wrapped(saved.points.as_chunks().0, &self.moving.domain)?;
        let particles = Particles::new(points)?.with_volumes(Volumes::each(saved.volumes)?)?;
        let kept = self.moving.resumed(&particles, saved.searched_at.as_chunks().0, saved.searches)?;
        (self.moving.held, self.state) = Held::new(particles, saved.strengths, kept)?;
        (self.t, self.start, self.stepper) = (saved.t, saved.start, saved.stepper);
        (self.turns, self.surveyed) = (saved.turns, saved.surveyed);
        let ledger = &mut self.ledger;
        ledger.growth = saved.growth.unwrap_or(f64::NAN);
        (ledger.t, ledger.step, ledger.retries) = (saved.t, saved.step, saved.retries);
        ledger.remeshings = saved.remeshings;
        for (i, totals) in ledger.fields.iter_mut().enumerate() {
            (totals.dropped, totals.dropped_size) = (saved.dropped[i], saved.dropped_size[i]);
        }
        self.measure();
        Ok(())
    }
}
