//! div(D grad u) on particles that move: weights made anew wherever they are.

use super::coefficient::{Diffusivity, diffusivities, renew_diffusivities};
use super::diffusion::{Diffusion, check_contrast};
use super::fields::Fields;
use super::growth::legal;
use super::policy::GrowthPolicy;
use crate::apply::blocks::each_row;
use crate::apply::worker::Workers;
use crate::apply::{Apply, MatrixFree, MovingMethod, Report, Rows};
use crate::domain::{Domain, Face};
use crate::error::{ParticleError, Result};
use crate::linear::{Spectrum, SpectrumEstimator};
use crate::neighbors::{Neighbors, VerletList};
use crate::operator::{DivGrad, Draft, Method};
use crate::particles::Particles;
use crate::scalar::Scalar;
use crate::scale::{Cutoff, Spacing};
use crate::stencil::{Neighbor, Stencil};

/// The skin of the neighbor list over its reach, where the caller names none.
const SKIN: f64 = 0.15;

/// How the neighbors of moving particles are kept, and what is done about modes that grow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MovingSettings {
    /// The cutoff of the rows; by default that of the method.
    pub cutoff: Option<f64>,
    /// The skin of the list; by default 0.15 of its reach, or less in a narrow domain.
    pub skin: Option<f64>,
    /// What is done about modes of the diffusion term that grow: on the set of the start, and on every set whose neighbors
    /// were searched anew because it has moved (not on a fresh mesh).
    pub growth: GrowthPolicy,
}

/// What the diffusion term of a scene is to particles that move. The unit type is no diffusion, and keeps no list.
pub trait MovingDiffusion<const D: usize, E: Fields>: Sync {
    /// The neighbor list and the method; of no size where there is no diffusion.
    type Kept: Send;

    /// Whether there is such a term.
    const SPREADS: bool;

    /// The order of the method.
    fn order(&self) -> Option<u32>;

    /// Whether rows of the method have condition numbers.
    fn conditioned(&self) -> bool;

    /// Refuses a diffusivity that is not there for so many particles.
    ///
    /// # Errors
    /// As [`Diffusivity::validate`].
    fn validate(&self, particles: usize) -> Result<()>;

    /// Searches the neighbors of these particles.
    ///
    /// # Errors
    /// As [`VerletList::build`] and [`MovingMethod::reach`]; [`ParticleError::Diffusivity`] for an illegal diffusivity.
    fn start(&self, particles: &Particles<D>, domain: &Domain<D>, settings: MovingSettings) -> Result<Self::Kept>;

    /// The same with the cutoffs of what is kept, for other particles, as search number `searches`.
    ///
    /// # Errors
    /// As [`VerletList::build`].
    fn restart(&self, kept: &Self::Kept, particles: &Particles<D>, searches: u64) -> Result<Self::Kept>;

    /// Takes the places and volumes of now.
    ///
    /// # Errors
    /// As [`VerletList::update`].
    fn follow(&self, kept: &mut Self::Kept, particles: &Particles<D>) -> Result<()>;

    /// Makes the search of now the one that [`undo_searches`](Self::undo_searches) goes back to.
    fn keep_searches(&self, kept: &mut Self::Kept);

    /// Goes back to the search that was kept last: it decides the order of every sum.
    fn undo_searches(&self, kept: &mut Self::Kept);

    /// Refuses a lattice on which the rows would be illegal.
    ///
    /// # Errors
    /// As [`MovingMethod::admits`].
    fn admits(&self, kept: &Self::Kept, spacing: Spacing) -> Result<()>;

    /// Checks all rows of now and writes div(D grad u), which costs little once rows are there; `None` where there are
    /// none. The eigenvalues of the term are bounded by the spectral bound of the report times the number beside it.
    ///
    /// # Errors
    /// Naming the particle whose row is illegal.
    fn check(&self, kept: &Self::Kept, u: &[E], out: &mut [E]) -> Result<Option<(Report, f64)>>;

    /// The rightmost eigenvalue and the spectral radius of the rows of now; zero without a product where no weight is
    /// negative.
    ///
    /// # Errors
    /// As [`Rows::assemble`] and [`SpectrumEstimator::estimate`].
    fn spectrum(&self, kept: &Self::Kept, estimator: SpectrumEstimator) -> Result<Spectrum>;

    /// Writes `finish`(p, div(D grad u)_p) for every particle.
    ///
    /// # Errors
    /// Naming the particle whose row is illegal.
    fn rates(
        &self,
        kept: &Self::Kept,
        u: &[E],
        out: &mut [E],
        finish: impl Fn(usize, E) -> E + Sync + Send,
    ) -> Result<()>;

    /// How often the neighbors were searched anew, and where the particles were then.
    fn searches<'a>(&self, kept: &'a Self::Kept) -> (u64, &'a [[f64; D]]);
}

impl<const D: usize, E: Fields> MovingDiffusion<D, E> for () {
    type Kept = ();
    const SPREADS: bool = false;

    fn order(&self) -> Option<u32> {
        None
    }

    fn conditioned(&self) -> bool {
        false
    }

    fn validate(&self, _: usize) -> Result<()> {
        Ok(())
    }

    fn start(&self, _: &Particles<D>, _: &Domain<D>, _: MovingSettings) -> Result<()> {
        Ok(())
    }

    fn restart(&self, (): &(), _: &Particles<D>, _: u64) -> Result<()> {
        Ok(())
    }

    fn follow(&self, (): &mut (), _: &Particles<D>) -> Result<()> {
        Ok(())
    }

    fn keep_searches(&self, (): &mut ()) {}

    fn undo_searches(&self, (): &mut ()) {}

    fn admits(&self, (): &(), _: Spacing) -> Result<()> {
        Ok(())
    }

    fn check(&self, (): &(), _: &[E], _: &mut [E]) -> Result<Option<(Report, f64)>> {
        Ok(None)
    }

    fn spectrum(&self, (): &(), _: SpectrumEstimator) -> Result<Spectrum> {
        Ok(Spectrum::default())
    }

    fn rates(&self, (): &(), _: &[E], out: &mut [E], finish: impl Fn(usize, E) -> E + Sync + Send) -> Result<()> {
        each_row(out, |p| finish(p, E::ZERO));
        Ok(())
    }

    fn searches<'a>(&self, (): &'a ()) -> (u64, &'a [[f64; D]]) {
        (0, &[])
    }
}

/// A method and the neighbors it works on, both where the particles are.
#[derive(Clone, Debug)]
pub struct MovingRows<const D: usize, M: Method<D, Out = [f64; 1]>> {
    term: Term<D, M>,
    list: VerletList<D>,
    /// The list of the search that was kept, where there were others since.
    former: Option<VerletList<D>>,
    domain: Domain<D>,
    cutoff: f64,
    /// Searches of the lists before this one, its own first search among them.
    earlier: u64,
}

/// The method with its diffusivity, and what threads make its rows with from one sweep to the next.
#[derive(Clone, Debug)]
enum Term<const D: usize, M: Method<D, Out = [f64; 1]>> {
    Constant(M, f64, Workers<D, M>),
    Varying(DivGrad<M>, Workers<D, DivGrad<M>>),
}

impl<const D: usize, M: Method<D, Out = [f64; 1]>> MovingRows<D, M> {
    fn within(&self) -> Within<'_, D> {
        Within { list: &self.list, cutoff: self.cutoff }
    }
}

impl<const D: usize, M: MovingMethod<D>> Term<D, M> {
    fn new<C: Diffusivity<D>>(diffusion: &Diffusion<C, M>, particles: &Particles<D>) -> Result<Self> {
        let mut method = diffusion.method.clone();
        method.set_volumes(particles.volumes()?);
        match diffusion.diffusivity.constant() {
            Some(diffusivity) if !(diffusivity >= 0.0 && diffusivity.is_finite()) => {
                Err(ParticleError::Diffusivity { diffusivity }.into())
            }
            Some(diffusivity) => Ok(Self::Constant(method, diffusivity, Workers::default())),
            None => {
                let values = diffusivities(&diffusion.diffusivity, particles.points())?;
                Ok(Self::Varying(DivGrad::new(method, values)?.mean(diffusion.mean), Workers::default()))
            }
        }
    }

    fn follow<C: Diffusivity<D>>(&mut self, diffusion: &Diffusion<C, M>, particles: &Particles<D>) -> Result<()> {
        match self {
            Self::Constant(method, ..) => method.set_volumes(particles.volumes()?),
            Self::Varying(div_grad, _) => {
                let (method, values) = div_grad.parts_mut();
                method.set_volumes(particles.volumes()?);
                renew_diffusivities(&diffusion.diffusivity, particles.points(), values)?;
            }
        }
        Ok(())
    }
}

impl<C: Diffusivity<D>, M: MovingMethod<D>, const D: usize, E: Fields> MovingDiffusion<D, E> for Diffusion<C, M> {
    type Kept = MovingRows<D, M>;
    const SPREADS: bool = true;

    fn order(&self) -> Option<u32> {
        Some(self.method.order())
    }

    fn conditioned(&self) -> bool {
        self.method.conditioned()
    }

    fn validate(&self, particles: usize) -> Result<()> {
        self.diffusivity.validate(particles)
    }

    fn start(
        &self,
        particles: &Particles<D>,
        domain: &Domain<D>,
        settings: MovingSettings,
    ) -> Result<MovingRows<D, M>> {
        let term = Term::new(self, particles)?;
        let [cutoff, reach] = match settings.cutoff {
            Some(cutoff) => [cutoff; 2],
            None => self.method.reach(particles, domain)?.map(|cutoff| cutoff.0),
        };
        // Skin and growth are room to move in, as far as images are counted rightly.
        let widths = domain.widths();
        let closed = domain.faces().map(|faces| faces.iter().all(|&face| face != Face::Open));
        let narrowest = widths.iter().zip(closed).filter(|&(_, closed)| closed);
        let room = narrowest.fold(f64::INFINITY, |room, (width, _)| room.min(0.499 * width));
        let skin = settings.skin.unwrap_or((SKIN * reach).min(0.5 * (room - cutoff)).max(0.0));
        let reach = reach.min(room - skin).max(cutoff);
        let list = VerletList::build(particles, domain, Cutoff(reach), skin)?;
        Ok(MovingRows { term, list, former: None, domain: *domain, cutoff, earlier: 0 })
    }

    fn restart(&self, kept: &MovingRows<D, M>, particles: &Particles<D>, searches: u64) -> Result<MovingRows<D, M>> {
        let list = VerletList::build(particles, &kept.domain, Cutoff(kept.list.reach()), kept.list.skin())?;
        let term = Term::new(self, particles)?;
        Ok(MovingRows { term, list, former: None, domain: kept.domain, cutoff: kept.cutoff, earlier: searches })
    }

    fn follow(&self, kept: &mut MovingRows<D, M>, particles: &Particles<D>) -> Result<()> {
        if let Some(replaced) = kept.list.replaced(particles)? {
            kept.former.get_or_insert(replaced);
        }
        kept.term.follow(self, particles)
    }

    fn keep_searches(&self, kept: &mut MovingRows<D, M>) {
        kept.former = None;
    }

    fn undo_searches(&self, kept: &mut MovingRows<D, M>) {
        if let Some(former) = kept.former.take() {
            kept.list = former;
        }
    }

    fn admits(&self, kept: &MovingRows<D, M>, spacing: Spacing) -> Result<()> {
        self.method.admits(spacing, Cutoff(kept.cutoff))
    }

    fn check(&self, kept: &MovingRows<D, M>, u: &[E], out: &mut [E]) -> Result<Option<(Report, f64)>> {
        let within = kept.within();
        let (report, factor) = match &kept.term {
            Term::Constant(method, factor, workers) => (check(method, &within, workers, *factor, u, out)?, *factor),
            Term::Varying(method, workers) => (check(method, &within, workers, 1.0, u, out)?, 1.0),
        };
        check_contrast(&report)?;
        Ok(Some((report, factor)))
    }

    fn spectrum(&self, kept: &MovingRows<D, M>, estimator: SpectrumEstimator) -> Result<Spectrum> {
        let within = kept.within();
        match &kept.term {
            Term::Constant(method, factor, _) => spectrum(method, &within, *factor, estimator),
            Term::Varying(method, _) => spectrum(method, &within, 1.0, estimator),
        }
    }

    fn rates(
        &self,
        kept: &MovingRows<D, M>,
        u: &[E],
        out: &mut [E],
        finish: impl Fn(usize, E) -> E + Sync + Send,
    ) -> Result<()> {
        let within = kept.within();
        match &kept.term {
            Term::Constant(method, factor, workers) => sweep(method, &within, workers, *factor, u, out, finish),
            Term::Varying(method, workers) => sweep(method, &within, workers, 1.0, u, out, finish),
        }
    }

    fn searches<'a>(&self, kept: &'a MovingRows<D, M>) -> (u64, &'a [[f64; D]]) {
        (kept.earlier + kept.list.rebuilds() as u64, kept.list.searched_at())
    }
}

/// The spectrum of the rows times a factor, from rows that are stored for it.
fn spectrum<const D: usize, M: Method<D, Out = [f64; 1]>>(
    method: &M,
    neighbors: &Within<'_, D>,
    factor: f64,
    estimator: SpectrumEstimator,
) -> Result<Spectrum> {
    let rows = Rows::<[f64; 1]>::assemble(method, neighbors)?;
    if rows.cannot_grow(legal::<f64>()) {
        return Ok(Spectrum::default());
    }
    estimator.settle(neighbors.targets(), |u, du| {
        rows.apply(u, du)?;
        du.iter_mut().for_each(|du| *du *= factor);
        Ok(())
    })
}

/// The report of all rows, and factor sum_q w_pq (u_q - u_p) of each.
fn check<const D: usize, M: Method<D, Out = [f64; 1]>, E: Fields>(
    method: &M,
    neighbors: &Within<'_, D>,
    workers: &Workers<D, M>,
    factor: f64,
    u: &[E],
    out: &mut [E],
) -> Result<Report> {
    let mut rows = MatrixFree::unchecked(method, neighbors, workers.clone());
    rows.check(out, |p, draft| rate(draft, factor, u, p))?;
    Ok(*rows.report())
}

/// `finish`(p, factor sum_q w_pq (u_q - u_p)), row after row, without storing any.
fn sweep<const D: usize, M: Method<D, Out = [f64; 1]>, E: Fields>(
    method: &M,
    neighbors: &Within<'_, D>,
    workers: &Workers<D, M>,
    factor: f64,
    u: &[E],
    out: &mut [E],
    finish: impl Fn(usize, E) -> E + Sync + Send,
) -> Result<()> {
    MatrixFree::unchecked(method, neighbors, workers.clone()).each(out, |p, draft| finish(p, rate(draft, factor, u, p)))
}

/// factor sum_q w_pq (u_q - u_p) of one row.
#[inline]
fn rate<const D: usize, E: Fields>(draft: &Draft<D, [f64; 1]>, factor: f64, u: &[E], p: usize) -> E {
    let (own, [diagonal]) = (u[p], draft.diagonal);
    let mut sum = E::ZERO.plus_product(E::Scalar::lift(diagonal), own);
    for (&q, &[w]) in draft.stencil.sources().iter().zip(&draft.weights) {
        sum = sum.plus_difference(E::Scalar::lift(w), u[q as usize], own);
    }
    E::ZERO.plus_product(E::Scalar::lift(factor), sum)
}

/// A list whose rows stay within a cutoff below its reach, so that rows that are refused can grow.
struct Within<'a, const D: usize> {
    list: &'a VerletList<D>,
    cutoff: f64,
}

impl<const D: usize> Neighbors<D> for Within<'_, D> {
    fn targets(&self) -> usize {
        self.list.targets()
    }

    fn sources(&self) -> usize {
        self.list.sources()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.list.center(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.cutoff
    }

    fn reach(&self) -> f64 {
        self.list.reach()
    }

    fn generation(&self) -> u64 {
        self.list.generation()
    }

    fn domain(&self) -> Option<&Domain<D>> {
        self.list.domain()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<D>)) {
        self.list.for_each(p, cutoff, visit);
    }

    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<D>) {
        self.list.gather(p, cutoff, row);
    }
}
