//! The advection scheme of particles that move: none.

use super::fields::Fields;
use super::limits::Rate;
use super::term::Site;
use super::transport::{Transport, TransportRows};
use crate::apply::Report;
use crate::error::{Result, SolverError};
use crate::neighbors::Neighbors;

/// No scheme for v . grad u: the particles are carried by the flow, so that there is nothing to discretize.
///
/// For [`Lagrangian`](crate::Lagrangian) runs, which leave any other scheme of a scene unused too; particles that stay
/// refuse it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Carried;

/// The rows of [`Carried`], of which there are none.
#[derive(Clone, Copy, Debug)]
pub enum CarriedRows {}

impl<const D: usize> Transport<D> for Carried {
    type Rows<E: Fields> = CarriedRows;
    const APPLIES: usize = 0;

    fn build<E: Fields, P: Neighbors<D>>(
        &self,
        site: &Site<D>,
        _: impl Fn(usize) -> [f64; D] + Sync,
        _: bool,
        _: bool,
        _: &P,
    ) -> Result<CarriedRows> {
        Err(SolverError::Stays { particles: site.points().len() }.into())
    }
}

impl<const D: usize, E: Fields> TransportRows<D, E> for CarriedRows {
    fn along(&self, _: usize, _: &[f64; D], _: &[E]) -> E {
        match *self {}
    }

    fn entries(&self, _: usize, _: &[f64; D], _: &mut dyn FnMut(usize, f64)) {
        match *self {}
    }

    fn rate(&self, _: usize, _: &[f64; D]) -> Result<Rate> {
        match *self {}
    }

    fn report(&self) -> &Report {
        match *self {}
    }
}
