//! The seam of every term of a scene: rows made once, a share of du/dt at every particle.

use super::fields::Fields;
use super::limits::Limits;
use crate::apply::Report;
use crate::error::{Result, SolverError};
use crate::neighbors::Neighbors;
use crate::operator::{Screen, Screened};
use crate::particles::Particles;

/// Where the terms of a scene act: the particles, and which of them have a prescribed value.
#[derive(Clone, Debug)]
pub struct Site<const D: usize> {
    particles: Particles<D>,
    /// Empty where no value is prescribed.
    prescribed: Vec<bool>,
    /// Particles with outward normals where the flow may come in, in ascending order.
    inflow: Vec<(usize, [f64; D])>,
}

impl<const D: usize> Site<D> {
    /// These particles, none of which has a prescribed value.
    ///
    /// # Errors
    /// [`SolverError::Targets`] where the targets of the provider are not the particles, each in its place;
    /// [`ApplyError::Stale`](crate::ApplyError::Stale) where they are those of another generation.
    pub fn new<P: Neighbors<D>>(particles: &Particles<D>, neighbors: &P) -> Result<Self> {
        let (targets, count) = (neighbors.targets(), particles.len());
        let same = targets == count && neighbors.sources() == count;
        if !(same && (0..count).all(|p| neighbors.center(p) == Some(p))) {
            return Err(SolverError::Targets { targets, particles: count }.into());
        }
        let (rows, set) = (neighbors.generation(), particles.generation());
        if rows != set {
            return Err(crate::error::ApplyError::Stale { rows, set }.into());
        }
        Ok(Self { particles: particles.clone(), prescribed: Vec::new(), inflow: Vec::new() })
    }

    /// These particles, which will move.
    pub(super) fn moving(particles: Particles<D>) -> Self {
        Self { particles, prescribed: Vec::new(), inflow: Vec::new() }
    }

    /// The particles, to be moved.
    pub(super) fn particles_mut(&mut self) -> &mut Particles<D> {
        &mut self.particles
    }

    /// The particles.
    pub fn particles(&self) -> &Particles<D> {
        &self.particles
    }

    /// The points x_p.
    pub fn points(&self) -> &[[f64; D]] {
        self.particles.points()
    }

    /// Whether the value of particle p is prescribed, so that no term needs a row there.
    pub fn prescribed(&self, p: usize) -> bool {
        self.prescribed.get(p).copied().unwrap_or(false)
    }

    /// The rows of a method where no value is prescribed, zeros elsewhere: there a row may not even exist, as at a corner or
    /// where the flow comes in.
    pub(super) fn screened<'a, M>(&'a self, method: &'a M) -> Screened<'a, M, &'a Self> {
        Screened { method, screen: self }
    }

    /// Prescribes the values of these particles.
    pub(super) fn prescribe(&mut self, particles: impl IntoIterator<Item = usize>) {
        for p in particles {
            if self.prescribed.is_empty() {
                self.prescribed = vec![false; self.particles.len()];
            }
            if let Some(prescribed) = self.prescribed.get_mut(p) {
                *prescribed = true;
            }
        }
    }

    /// Says where the flow may come in.
    pub(super) fn open(&mut self, inflow: &[(usize, [f64; D])]) {
        self.inflow.extend_from_slice(inflow);
        self.inflow.sort_by_key(|&(p, _)| p);
    }

    /// Whether a velocity v comes in at particle p, where an inflow condition stands.
    pub(super) fn comes_in(&self, p: usize, v: &[f64; D]) -> bool {
        let inward = |normal: &[f64; D]| v.iter().zip(normal).fold(0.0, |sum, (v, n)| sum + v * n) < 0.0;
        self.inflow.binary_search_by_key(&p, |&(q, _)| q).is_ok_and(|i| inward(&self.inflow[i].1))
    }

    /// Every particle with its point, the prescribed ones left out.
    pub(super) fn free(&self) -> impl Iterator<Item = (usize, &[f64; D])> {
        self.points().iter().enumerate().filter(|&(p, _)| !self.prescribed(p))
    }
}

impl<const D: usize> Screen<D> for &Site<D> {
    fn leaves_out(&self, p: usize) -> bool {
        self.prescribed(p)
    }
}

/// One term of a scene: its coefficient and its method. The unit type is the absent term, of no size and no effect.
///
/// Implemented by [`Diffusion`](crate::Diffusion), [`Advection`](crate::Advection) and [`Source`](crate::Source); a
/// solver calls `build` once a particle set, `refresh` once a stage, `rate` once a particle and stage.
pub trait SceneTerm<const D: usize, E: Fields>: Sync {
    /// What is made once for a particle set; of no size where the term is absent.
    type Rows: Sync;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize;

    /// Whether there is such a term.
    const PRESENT: bool = true;

    /// Makes the rows.
    ///
    /// # Errors
    /// As [`Rows::assemble`](crate::Rows::assemble), and where a coefficient is illegal.
    fn build<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<Self::Rows>;

    /// Computes what depends on the whole field, or on time, before the particles are gone through.
    ///
    /// # Errors
    /// Where a coefficient is illegal at this time.
    fn refresh(&self, rows: &mut Self::Rows, site: &Site<D>, t: f64, u: &[E]) -> Result<()> {
        let _ = (rows, site, t, u);
        Ok(())
    }

    /// Adds the share of this term in du_p/dt to `rate`, for particle p at x; p and u are of the set the rows were made for,
    /// which [`SemiDiscrete`](crate::SemiDiscrete) checks once for all particles.
    fn rate(&self, rows: &Self::Rows, p: usize, x: &[f64; D], t: f64, u: &[E], rate: E) -> E;

    /// Adds what bounds the step at this time.
    ///
    /// # Errors
    /// Naming the particle, where a coefficient is not finite at this time.
    fn limit(&self, rows: &mut Self::Rows, site: &Site<D>, t: f64, u: &[E], limits: &mut Limits) -> Result<()>;

    /// Hands out the entries (q, A_pq) of the linear part of this term for particle p at x, for implicit steps and steady
    /// problems; entries of one q add up.
    fn entries(&self, rows: &Self::Rows, p: usize, x: &[f64; D], t: f64, entry: &mut dyn FnMut(usize, f64));

    /// What the build of the rows found.
    fn report<'a>(&self, rows: &'a Self::Rows) -> Option<&'a Report>;

    /// Whether the row sums of the matrix of this term leave none of its modes growing, as where no weight is negative.
    fn monotone(&self, rows: &Self::Rows) -> bool {
        let _ = rows;
        true
    }

    /// The velocity at particle p, which is at x; `None` for a term that has none.
    fn velocity(&self, p: usize, x: &[f64; D], t: f64) -> Option<[f64; D]> {
        let _ = (p, x, t);
        None
    }

    /// The numerical viscosity of order 1 at particle p, which is at x.
    fn viscosity(&self, p: usize, x: &[f64; D], t: f64) -> f64 {
        let _ = (p, x, t);
        0.0
    }

    /// Whether the velocity is the same at all times.
    fn steady(&self) -> bool {
        true
    }
}

impl<const D: usize, E: Fields> SceneTerm<D, E> for () {
    type Rows = ();
    const APPLIES: usize = 0;
    const PRESENT: bool = false;

    fn build<P: Neighbors<D>>(&self, _: &Site<D>, _: &P) -> Result<()> {
        Ok(())
    }

    #[inline(always)]
    fn rate(&self, (): &(), _: usize, _: &[f64; D], _: f64, _: &[E], rate: E) -> E {
        rate
    }

    fn limit(&self, (): &mut (), _: &Site<D>, _: f64, _: &[E], _: &mut Limits) -> Result<()> {
        Ok(())
    }

    fn entries(&self, (): &(), _: usize, _: &[f64; D], _: f64, _: &mut dyn FnMut(usize, f64)) {}

    fn report<'a>(&self, (): &'a ()) -> Option<&'a Report> {
        None
    }
}
