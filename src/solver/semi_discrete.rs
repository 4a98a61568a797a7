//! A scene on a particle set: du/dt of all particles, ready to be stepped.

use super::diffusion::check_contrast;
use super::edge::Edge;
use super::fields::Fields;
use super::limits::Limits;
use super::policy::GrowthPolicy;
use super::scene::Scene;
use super::symmetry::{probes, symmetry};
use super::term::{SceneTerm, Site};
use crate::apply::Report;
use crate::apply::blocks::each_row;
use crate::error::{Result, TimeError};
use crate::linear::CsrMatrix;
use crate::neighbors::Neighbors;
use crate::particles::Particles;
use crate::time::RowSymmetry;

/// A scene on a particle set: its rows, made once, and du/dt at any time. Absent terms take no room in it.
///
/// One loop over the particles sums all terms of a particle; nothing of the size of the set is held beside the rows, but
/// a copy of the field where there is a boundary.
pub struct SemiDiscrete<const D: usize, S: Scene<D>> {
    scene: S,
    site: Site<D>,
    diffusion: DiffusionRowsOf<D, S>,
    advection: AdvectionRowsOf<D, S>,
    source: SourceRowsOf<D, S>,
    edge: <S::Edge as Edge<D, S::Value>>::State,
}

type DiffusionRowsOf<const D: usize, S> = <<S as Scene<D>>::Diffusion as SceneTerm<D, <S as Scene<D>>::Value>>::Rows;
type AdvectionRowsOf<const D: usize, S> = <<S as Scene<D>>::Advection as SceneTerm<D, <S as Scene<D>>::Value>>::Rows;
type SourceRowsOf<const D: usize, S> = <<S as Scene<D>>::Source as SceneTerm<D, <S as Scene<D>>::Value>>::Rows;

impl<const D: usize, S: Scene<D>> SemiDiscrete<D, S> {
    /// Makes the rows of all terms, boundary conditions first: where a value is prescribed no term makes a row.
    ///
    /// # Errors
    /// As [`Site::new`], [`SceneTerm::build`] and [`Edge::build`]; [`SolverError::Contrast`](crate::SolverError::Contrast)
    /// where diffusivities make modes grow with every stepper and `growth` refuses that.
    pub fn new<P: Neighbors<D>>(
        scene: S,
        particles: &Particles<D>,
        neighbors: &P,
        growth: GrowthPolicy,
    ) -> Result<Self> {
        let mut site = Site::new(particles, neighbors)?;
        let points = particles.points();
        let flow = |p: usize, t: f64| points.get(p).and_then(|x| scene.advection_term().velocity(p, x, t));
        let edge = scene.edge().build(&mut site, &flow, scene.advection_term().steady(), neighbors)?;
        let diffusion = scene.diffusion_term().build(&site, neighbors)?;
        if let (Some(report), GrowthPolicy::Refuse) = (scene.diffusion_term().report(&diffusion), growth) {
            check_contrast(report)?;
        }
        let advection = scene.advection_term().build(&site, neighbors)?;
        let source = scene.source_term().build(&site, neighbors)?;
        Ok(Self { scene, site, diffusion, advection, source, edge })
    }

    /// The scene.
    pub fn scene(&self) -> &S {
        &self.scene
    }

    /// The particles, and which have prescribed values.
    pub fn site(&self) -> &Site<D> {
        &self.site
    }

    /// The velocity at particle p at time t; `None` in a scene without advection, and beyond the particles.
    pub fn velocity(&self, p: usize, t: f64) -> Option<[f64; D]> {
        self.scene.advection_term().velocity(p, self.site.points().get(p)?, t)
    }

    /// The reports of the rows that were made.
    pub fn reports(&self) -> impl Iterator<Item = &Report> {
        let diffusion = self.scene.diffusion_term().report(&self.diffusion);
        diffusion.into_iter().chain(self.scene.advection_term().report(&self.advection))
    }

    /// Writes du/dt at time t; boundary values are those of t, whatever stands in u, and their rates zero.
    ///
    /// # Errors
    /// [`TimeError::Shape`] for another number of particles; as [`SceneTerm::refresh`] and [`Edge::impose`].
    pub fn rate(&mut self, t: f64, u: &[S::Value], du: &mut [S::Value]) -> Result<()> {
        let needed = self.site.points().len();
        if let Some(found) = [u.len(), du.len()].into_iter().find(|&found| found != needed) {
            return Err(TimeError::Shape { found, needed }.into());
        }
        if !<S::Edge as Edge<D, S::Value>>::PRESENT {
            return self.inside::<true>(t, u, du);
        }
        let mut room = S::Edge::room(&mut self.edge);
        room.clear();
        room.extend_from_slice(u);
        let done = self.impose(t, &mut room).and_then(|()| self.inside::<true>(t, &room, du));
        S::Edge::give_back(&mut self.edge, room);
        done?;
        self.hold(t, du);
        Ok(())
    }

    /// du/dt of the diffusion and advection terms with boundary conditions whose values are zero, which are written into u.
    pub(super) fn linear(&mut self, t: f64, u: &mut [S::Value], du: &mut [S::Value]) -> Result<()> {
        self.impose_values(t, true, u)?;
        self.inside::<false>(t, u, du)?;
        self.hold(t, du);
        Ok(())
    }

    /// Sets the rates of prescribed values to zero.
    fn hold(&self, t: f64, du: &mut [S::Value]) {
        self.each_prescribed(t, |p| {
            if let Some(du) = du.get_mut(p) {
                *du = S::Value::ZERO;
            }
        });
    }

    /// Whether no term can have a growing mode, by its row sums.
    pub(super) fn cannot_grow(&self) -> bool {
        let terms = self.scene.diffusion_term().monotone(&self.diffusion)
            && self.scene.advection_term().monotone(&self.advection);
        terms && self.scene.edge().values_only()
    }

    /// du/dt of a field that has its boundary values, with or without the source.
    fn inside<const SOURCE: bool>(&mut self, t: f64, u: &[S::Value], du: &mut [S::Value]) -> Result<()> {
        let Self { scene, site, diffusion, advection, source, .. } = self;
        scene.diffusion_term().refresh(diffusion, site, t, u)?;
        scene.advection_term().refresh(advection, site, t, u)?;
        scene.source_term().refresh(source, site, t, u)?;
        let (k, a, s) = (scene.diffusion_term(), scene.advection_term(), scene.source_term());
        let points = site.points();
        let (diffusion, advection, source) = (&*diffusion, &*advection, &*source);
        each_row(du, |p| {
            let x = &points[p];
            let rate = k.rate(diffusion, p, x, t, u, S::Value::ZERO);
            let rate = a.rate(advection, p, x, t, u, rate);
            if SOURCE { s.rate(source, p, x, t, u, rate) } else { rate }
        });
        Ok(())
    }

    /// Writes the boundary values of time t into u.
    ///
    /// # Errors
    /// As [`Edge::impose`].
    pub fn impose(&mut self, t: f64, u: &mut [S::Value]) -> Result<()> {
        self.impose_values(t, false, u)
    }

    fn impose_values(&mut self, t: f64, zero: bool, u: &mut [S::Value]) -> Result<()> {
        let Self { scene, site, edge, .. } = self;
        let points = site.points();
        let flow = |p: usize, t: f64| points.get(p).and_then(|x| scene.advection_term().velocity(p, x, t));
        scene.edge().impose(edge, site, &flow, t, zero, u)
    }

    fn each_prescribed(&self, t: f64, mut particle: impl FnMut(usize)) {
        let points = self.site.points();
        let flow = |p: usize, t: f64| points.get(p).and_then(|x| self.scene.advection_term().velocity(p, x, t));
        self.scene.edge().each_prescribed(&flow, t, &mut particle);
    }

    /// Whether the rows are the same at all times.
    pub fn steady(&self) -> bool {
        self.scene.advection_term().steady()
    }

    /// The particles with prescribed values at time t.
    pub fn prescribed(&self, t: f64) -> Vec<usize> {
        let mut particles = Vec::new();
        self.each_prescribed(t, |p| particles.push(p));
        particles
    }

    /// The matrix A of the diffusion and advection terms, du/dt = A u + S inside; rows of prescribed values are the
    /// conditions themselves, a u + b du/dn.
    ///
    /// # Errors
    /// As [`CsrMatrix::from_triplets`].
    pub fn matrix(&mut self, t: f64) -> Result<CsrMatrix> {
        self.matrix_with(t, t, |_| 0.0)
    }

    /// The same with the values of another time prescribed, and a diagonal of its own added inside.
    pub(super) fn matrix_with(&mut self, t: f64, given: f64, own: impl Fn(usize) -> f64) -> Result<CsrMatrix> {
        self.scene.advection_term().refresh(&mut self.advection, &self.site, t, &[])?;
        let points = self.site.points();
        let mut prescribed = vec![false; points.len()];
        self.each_prescribed(given, |p| {
            if let Some(prescribed) = prescribed.get_mut(p) {
                *prescribed = true;
            }
        });
        let row = |p: usize, entries: &mut Vec<(usize, f64)>| {
            if prescribed[p] {
                entries.push((p, 1.0));
                return;
            }
            let (x, mut entry) = (&points[p], |q: usize, value: f64| entries.push((q, value)));
            self.scene.diffusion_term().entries(&self.diffusion, p, x, t, &mut entry);
            self.scene.advection_term().entries(&self.advection, p, x, t, &mut entry);
            entry(p, own(p));
        };
        let mut matrix = CsrMatrix::from_rows(points.len(), points.len(), row)?;
        if let Some(rows) = self.scene.edge().rows(&self.edge) {
            rows.replace_in(&mut matrix)?;
        }
        Ok(matrix)
    }

    /// S at particle p; zero beyond the particles.
    pub(super) fn source(&self, p: usize, t: f64, u: &[S::Value]) -> S::Value {
        let of = |x| self.scene.source_term().rate(&self.source, p, x, t, u, S::Value::ZERO);
        self.site.points().get(p).map_or(S::Value::ZERO, of)
    }

    /// Writes what stands beside A u: the source S(x, t, u) inside, the values g of the conditions at their particles.
    ///
    /// # Errors
    /// [`TimeError::Shape`] for another number of particles.
    pub fn load(&mut self, t: f64, u: &[S::Value], out: &mut [S::Value]) -> Result<()> {
        self.load_with(t, t, u, out)
    }

    /// The same with the values of another time prescribed.
    pub(super) fn load_with(&mut self, t: f64, given: f64, u: &[S::Value], out: &mut [S::Value]) -> Result<()> {
        let needed = self.site.points().len();
        if let Some(found) = [u.len(), out.len()].into_iter().find(|&found| found != needed) {
            return Err(TimeError::Shape { found, needed }.into());
        }
        let points = self.site.points();
        for ((p, x), out) in points.iter().enumerate().zip(&mut *out) {
            *out = self.scene.source_term().rate(&self.source, p, x, t, u, S::Value::ZERO);
        }
        self.each_prescribed(given, |p| {
            if let (Some(out), Some(x)) = (out.get_mut(p), points.get(p)) {
                *out = self.scene.edge().value(p, x, t);
            }
        });
        Ok(())
    }

    /// Whether V_p w_pq = V_q w_qp in the rows of the diffusion term, found by applying them to two fields; a boundary
    /// breaks it. Without a diffusion term there is nothing to break.
    pub fn symmetry(&self) -> RowSymmetry {
        let (points, k) = (self.site.points(), self.scene.diffusion_term());
        let volumes = self.site.particles().volumes().ok();
        let volume = |p: usize| volumes.and_then(|volumes| volumes.get(p).ok()).unwrap_or(1.0);
        let fields = probes::<S::Value>(points.len());
        let images = fields.each_ref().map(|u| {
            let rate = |(p, x)| k.rate(&self.diffusion, p, x, 0.0, u, S::Value::ZERO);
            points.iter().enumerate().map(rate).collect()
        });
        symmetry(&fields, &images, volume)
    }

    /// The largest numerical viscosity of order 1 at time t, in the units of a diffusivity; 0 for schemes of higher order.
    pub fn numerical_viscosity(&self, t: f64) -> f64 {
        let of = |(p, x): (usize, &[f64; D])| self.scene.advection_term().viscosity(p, x, t);
        self.site.free().map(of).fold(0.0, f64::max)
    }

    /// What bounds the step at time t.
    ///
    /// # Errors
    /// As [`SceneTerm::limit`].
    pub fn limits(&mut self, t: f64, u: &[S::Value]) -> Result<Limits> {
        let Self { scene, site, diffusion, advection, .. } = self;
        let mut limits = Limits::default();
        scene.diffusion_term().limit(diffusion, site, t, u, &mut limits)?;
        scene.advection_term().limit(advection, site, t, u, &mut limits)?;
        Ok(limits.larger(&self.source_limits(t, u)?))
    }

    /// What the source alone bounds.
    pub(super) fn source_limits(&mut self, t: f64, u: &[S::Value]) -> Result<Limits> {
        let mut limits = Limits::default();
        self.scene.source_term().limit(&mut self.source, &self.site, t, u, &mut limits)?;
        Ok(limits)
    }

    /// What bounds the step at time t whatever the field: the limits without the source.
    ///
    /// # Errors
    /// As [`SceneTerm::limit`].
    pub fn linear_limits(&mut self, t: f64) -> Result<Limits> {
        let Self { scene, site, diffusion, advection, .. } = self;
        let mut limits = Limits::default();
        scene.diffusion_term().limit(diffusion, site, t, &[], &mut limits)?;
        scene.advection_term().limit(advection, site, t, &[], &mut limits)?;
        Ok(limits)
    }
}
