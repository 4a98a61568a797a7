//! Hyperviscosity: a power of the Laplacian that damps what advection rows let grow.

use std::borrow::Borrow;
use std::collections::BTreeMap;

use super::{Apply, Field, Rows, check, scalars};
use crate::error::{Error, LinearError, OperatorError, ParticleError, Result};
use crate::particles::reserved;
use crate::scalar::length;
use crate::scale::Spacing;

/// The term (-1)^(k+1) gamma |v| h^(2k-1) Lap^k u for advection of order r: k is the least with 2k - 1 >= r, so 2, 3, 4
/// for r = 2, 4, 6, and the error stays O(h^r).
///
/// Lap^k is `laplacian` applied k times, rows of order r at least: with those of order 2 the term would itself be wrong by
/// O(h^2) |v| and order 4 be lost. |v| is that of each target; gamma has no unit. It damps all modes when Lap has
/// eigenvalues on or near the negative axis, as DC-PSE has. Cost: [`applies`](Self::applies) = k sweeps; two fields of
/// memory, made once.
///
/// Of the step limit it takes [`rate`](Self::rate), an eigenvalue on the negative axis.
///
/// ```
/// use parops::{DcPse, Domain, Hyperviscosity, Laplacian, Nearest, Particles};
/// let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 1)?;
/// let dcpse = DcPse::<Laplacian<2>, 2>::new();
/// let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, dcpse.fewest_neighbors::<2>()?)?;
/// let lap = dcpse.assemble(&around)?;
/// let mut damping = Hyperviscosity::new(&lap, 2, set.spacing()?, 0.1)?;
/// let wave: Vec<f64> = set.points().iter().map(|x| (std::f64::consts::TAU * x[0]).sin()).collect();
/// let mut du = vec![0.0; wave.len()];
/// damping.add(&vec![[1.0, 0.0]; wave.len()], &wave, &mut du)?;
/// // -gamma h^3 (2 pi)^4 u
/// assert!((du[3] / wave[3] / -0.0380 - 1.0).abs() < 0.2);
/// assert_eq!(damping.applies(), 2);
/// # parops::Result::Ok(())
/// ```
///
/// Source: V. Shankar, A. Fogelson, 2018, of the idea; exponents as above.
/// See also: [`UpwindDcPse`](super::UpwindDcPse), which needs none.
#[derive(Clone, Debug)]
pub struct Hyperviscosity<L = Rows, T: Field = f64> {
    laplacian: L,
    power: u32,
    h: f64,
    gamma: f64,
    powers: [Vec<T>; 2],
}

impl<L: Borrow<Rows<[f64; 1], T>>, T: Field> Hyperviscosity<L, T> {
    /// The term for advection of order r = `order`, 1 to 8, with the spacing h and gamma >= 0.
    ///
    /// # Errors
    /// [`LinearError::NotSquare`] where targets and sources of the rows differ in number; [`OperatorError::LowOrder`]
    /// where their order is below r, or none is stated; [`LinearError::Setting`] for r outside 1 to 8 and a gamma that is
    /// negative or not finite; [`ParticleError::Spacing`] for an h that is not positive and finite;
    /// [`ParticleError::Memory`] where there is no room for two fields.
    pub fn new(laplacian: L, order: u32, h: Spacing, gamma: f64) -> Result<Self> {
        let rows: &Rows<[f64; 1], T> = laplacian.borrow();
        let (targets, sources) = (rows.targets(), rows.sources());
        if targets != sources {
            return Err(LinearError::NotSquare { rows: targets, columns: sources }.into());
        }
        if !(1..=8).contains(&order) {
            return Err(LinearError::Setting { value: f64::from(order), low: 1.0, high: 8.0 }.into());
        }
        let found = rows.report().order.unwrap_or(0);
        if found < order {
            return Err(OperatorError::LowOrder { found, needed: order }.into());
        }
        if !(h.0 > 0.0 && h.0.is_finite()) {
            return Err(ParticleError::Spacing { spacing: h.0 }.into());
        }
        let mut powers = [reserved(targets)?, reserved(targets)?];
        powers.iter_mut().for_each(|power| power.resize(targets, T::zero()));
        let power = (order + 1).div_ceil(2);
        let mut term = Self { laplacian, power, h: h.0, gamma: 0.0, powers };
        term.set_gamma(gamma)?;
        Ok(term)
    }

    /// gamma.
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// Sets gamma.
    ///
    /// # Errors
    /// [`LinearError::Setting`] where it is negative or not finite.
    pub fn set_gamma(&mut self, gamma: f64) -> Result<()> {
        if !(gamma >= 0.0 && gamma.is_finite()) {
            return Err(LinearError::Setting { value: gamma, low: 0.0, high: f64::MAX }.into());
        }
        self.gamma = gamma;
        Ok(())
    }

    /// The spacing h.
    pub fn spacing(&self) -> Spacing {
        Spacing(self.h)
    }

    /// k, the applications of the Laplacian that one evaluation costs.
    pub fn applies(&self) -> u32 {
        self.power
    }

    /// The Laplacian's rows.
    pub fn laplacian(&self) -> &Rows<[f64; 1], T> {
        self.laplacian.borrow()
    }

    /// gamma |v| h^(2k-1) lambda_max^k: the rate of the fastest damped mode, for the largest speed |v| and the spectral
    /// radius lambda_max of the Laplacian. A stepper bears dt times the rate up to its limit on the negative axis, 2.785
    /// for RK4.
    pub fn rate(&self, speed: f64, laplacian_radius: f64) -> f64 {
        self.gamma * speed / self.h * (self.h * self.h * laplacian_radius).powi(self.power as i32)
    }

    /// Adds the term at u to `du`; `velocities`, `u` and `du` are one per particle. Allocates nothing.
    ///
    /// # Errors
    /// As [`Rows::apply_along`]; [`ApplyError::Overflow`](crate::ApplyError::Overflow) where a power of the Laplacian is
    /// not finite. `du` is then as it was.
    pub fn add<const D: usize>(&mut self, velocities: &[[T; D]], u: &[T], du: &mut [T]) -> Result<()> {
        let Self { laplacian, power, h, gamma, powers: [power_of_u, next] } = self;
        let rows: &Rows<[f64; 1], T> = (*laplacian).borrow();
        check(scalars(u), rows.sources(), du, rows.targets())?;
        check(velocities, rows.targets(), du, rows.targets())?;
        // h^2 Lap at a time: h^-2k alone may overflow.
        let square = T::lift(*h * *h);
        power_of_u.copy_from_slice(u);
        for _ in 0..*power {
            rows.apply(power_of_u, next)?;
            next.iter_mut().for_each(|x| *x *= square);
            std::mem::swap(power_of_u, next);
        }
        let factor = T::lift(sign(*power) * *gamma / *h);
        let sums = du.iter().zip(power_of_u.iter()).zip(velocities).map(|((du, x), v)| *du + factor * length(v) * *x);
        if let Some((p, value)) = sums.enumerate().find(|(_, sum)| !sum.is_finite()) {
            return Err(Error::from(crate::error::ApplyError::Overflow { value: value.as_() }).at(p));
        }
        for ((du, x), v) in du.iter_mut().zip(power_of_u.iter()).zip(velocities) {
            *du += factor * length(v) * *x;
        }
        Ok(())
    }

    /// The entries of row p of the term with gamma = 1, where the particle is that fast.
    pub(crate) fn row(&self, p: usize, speed: f64) -> BTreeMap<usize, f64> {
        let (factor, square) = (sign(self.power) * speed / self.h, self.h * self.h);
        self.laplacian().power_of(p, factor, square, self.power as usize)
    }
}

/// (-1)^(k+1).
fn sign(power: u32) -> f64 {
    if power.is_multiple_of(2) { -1.0 } else { 1.0 }
}
