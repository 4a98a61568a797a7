//! Central DC-PSE advection with hyperviscosity, for scattered particles.

use super::central::CentralRows;
use super::damping::Damping;
use super::fields::Fields;
use super::limits::Rate;
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::{Hyperviscosity, Report, Rows};
use crate::error::{Error, LinearError, ParticleError, Result};
use crate::neighbors::Neighbors;
use crate::operator::{DcPse, Gradient, Laplacian};
use crate::scalar::{Scalar, length};
use crate::scale::Spacing;

/// DC-PSE advection of order R with hyperviscosity,
/// v . grad u - (-1)^(k+1) gamma |v| h^(2k-1) Lap^k u, k the least with 2 k - 1 >= R.
///
/// Lap^k is a Laplacian of order R applied k times. gamma is found when the rows are made, unless
/// [`gamma`](Self::gamma) gives it. Up to 640 particles: from all eigenvalues, as the least with which no mode grows
/// (1e-9 |v|_max / h), or 1e-3 |v|_max / h where no gamma up to 1 does that, plus a quarter ([`Hyperviscosity::tune`]). On
/// larger sets: 2.5 times what the 400 particles around the fastest one need alone for 1e-3 |v|_max / h, twice that and
/// so on where 1000 products with all rows find more growth, which is no proof. Where the flow is at rest then, it is the
/// largest gamma that flows along the axes need. Beside a term u div v growth below max div v/20 is left, since there truncation
/// moves eigenvalues from zero. Implicit schemes and steady problems take the k-th power of the
/// Laplacian as a matrix.
#[derive(Clone, Debug)]
pub struct Stabilized<const D: usize, const R: u32> {
    gradient: DcPse<Gradient<D>, R>,
    laplacian: DcPse<Laplacian<D>, R>,
    h: Spacing,
    gamma: Option<f64>,
}

impl<const D: usize, const R: u32> Stabilized<D, R> {
    /// The scheme for a set of spacing h.
    pub fn new(h: Spacing) -> Self {
        Self { gradient: DcPse::new(), laplacian: DcPse::new(), h, gamma: None }
    }

    /// With a gradient and a Laplacian of your own settings.
    #[must_use]
    pub fn rows(self, gradient: DcPse<Gradient<D>, R>, laplacian: DcPse<Laplacian<D>, R>) -> Self {
        Self { gradient, laplacian, ..self }
    }

    /// With this gamma, which is not looked for then.
    #[must_use]
    pub fn gamma(self, gamma: f64) -> Self {
        Self { gamma: Some(gamma), ..self }
    }
}

/// The rows of a stabilized scheme, and the powers of the Laplacian of the field at hand.
#[derive(Clone, Debug)]
pub struct StabilizedRows<const D: usize, E: Fields> {
    central: CentralRows<D, E>,
    laplacian: Rows<[f64; 1], E::Scalar>,
    h: f64,
    power: usize,
    gamma: f64,
    /// (h^2 Lap)^k u, and room for the power before.
    powers: [Vec<E>; 2],
}

impl<const D: usize, E: Fields> StabilizedRows<D, E> {
    /// gamma.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// (-1)^k gamma |v| / h, what (h^2 Lap)^k u adds to v . grad u by.
    fn factor(&self, v: &[f64; D]) -> f64 {
        let sign = if self.power.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * self.gamma * length(v) / self.h
    }
}

impl<const D: usize, const R: u32> Transport<D> for Stabilized<D, R> {
    type Rows<E: Fields> = StabilizedRows<D, E>;
    const APPLIES: usize = 1 + (R + 1).div_ceil(2) as usize;

    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        flow: impl Fn(usize) -> [f64; D] + Sync,
        steady: bool,
        solenoidal: bool,
        neighbors: &P,
    ) -> Result<StabilizedRows<D, E>> {
        let Spacing(h) = self.h;
        if !(h > 0.0 && h.is_finite()) {
            return Err(ParticleError::Spacing { spacing: h }.into());
        }
        let gamma = match self.gamma {
            Some(value) if !(value >= 0.0 && value.is_finite()) => {
                return Err(LinearError::Setting { value, low: 0.0, high: f64::MAX }.into());
            }
            Some(gamma) => gamma,
            None => {
                // Found in `f64`, whatever the fields.
                let rows: Rows<[f64; D]> = Rows::assemble(&site.screened(&self.gradient), neighbors)?;
                let laplacian: Rows = Rows::assemble(&site.screened(&self.laplacian), neighbors)?;
                let count = site.points().len();
                let mut flows = vec![(0..count).map(&flow).collect::<Vec<_>>()];
                if !steady && flows[0].iter().all(|v| *v == [0.0; D]) {
                    let along = |axis| vec![std::array::from_fn(|i| f64::from(u8::from(i == axis))); count];
                    flows = (0..D).map(along).collect();
                }
                let mut damping = Damping { rows, term: Hyperviscosity::new(laplacian, R, self.h, 0.0)? };
                let larger = |most: f64, flow: &Vec<_>| Ok::<_, Error>(most.max(damping.gamma(flow, solenoidal)?));
                flows.iter().try_fold(0.0, larger)?
            }
        };
        Ok(StabilizedRows {
            central: CentralRows::build(&self.gradient, site, neighbors)?,
            laplacian: Rows::assemble(&site.screened(&self.laplacian), neighbors)?,
            h,
            power: (R + 1).div_ceil(2) as usize,
            gamma,
            powers: [Vec::new(), Vec::new()],
        })
    }

    fn gradient<P: Neighbors<D>>(&self, site: &Site<D>, neighbors: &P) -> Result<Option<Rows<[f64; D]>>> {
        Rows::assemble(&site.screened(&self.gradient), neighbors).map(Some)
    }
}

impl<const D: usize, E: Fields> TransportRows<D, E> for StabilizedRows<D, E> {
    fn refresh(&mut self, u: &[E]) {
        let Self { laplacian, h, power, powers: [last, next], .. } = self;
        let square = E::Scalar::lift(*h * *h);
        last.clear();
        last.extend_from_slice(u);
        next.resize(u.len(), E::ZERO);
        for _ in 0..*power {
            let before = &*last;
            crate::apply::blocks::each_row(next, |p| {
                let own = before[p];
                let (diagonal, pairs) = laplacian.pairs(p);
                let mut sum = diagonal.map_or(E::ZERO, |[d]| E::ZERO.plus_product(d, own));
                for (q, [w]) in pairs {
                    sum = sum.plus_difference(w, before[q], own);
                }
                E::ZERO.plus_product(square, sum)
            });
            std::mem::swap(last, next);
        }
    }

    #[inline(always)]
    fn along(&self, p: usize, v: &[f64; D], u: &[E]) -> E {
        self.central.along(p, v, u).plus_product(E::Scalar::lift(self.factor(v)), self.powers[0][p])
    }

    fn entries(&self, p: usize, v: &[f64; D], entry: &mut dyn FnMut(usize, f64)) {
        self.central.entries(p, v, entry);
        let row = self.laplacian.power_of(p, self.factor(v), self.h * self.h, self.power);
        row.into_iter().for_each(|(q, w)| entry(q, w));
    }

    fn rate(&self, p: usize, v: &[f64; D]) -> Result<Rate> {
        self.central.rate(p, v)
    }

    fn hyperviscosity(&self, _: usize, v: &[f64; D]) -> Rate {
        let radius = self.h * self.h * self.laplacian.report().spectral_bound;
        Rate::decay(self.gamma * length(v) / self.h * radius.powi(self.power as i32))
    }

    fn divergence(&self, p: usize, v: &[[f64; D]]) -> Option<f64> {
        self.central.divergence(p, v)
    }

    fn report(&self) -> &Report {
        self.central.report()
    }
}
