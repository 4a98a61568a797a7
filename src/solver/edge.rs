//! Boundary conditions of a scene: rows at boundary particles, and inflow.

use num_traits::AsPrimitive;

use super::fields::Fields;
use super::term::Site;
use crate::boundary::{BoundaryCondition, BoundaryRows};
use crate::error::{BoundaryError, Error, Result};
use crate::neighbors::Neighbors;

/// The boundary of a scene: conditions a u + b du/dn = g, and places where the flow may come in.
///
/// At an inflow particle with outward unit normal n the value is g wherever v . n < 0 at the moment, and nothing is
/// imposed where v . n >= 0: there the flow leaves and the terms of the scene act as inside.
///
/// ```
/// use parops::{Boundary, BoundaryCondition};
/// let pipe = Boundary::<1>::new(2).inflow([(0, [-1.0])]).conditions([BoundaryCondition::neumann(20, [1.0])]);
/// assert_eq!((pipe.order(), pipe.particles().count()), (2, 2));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Boundary<const D: usize> {
    order: u32,
    conditions: Vec<BoundaryCondition<D>>,
    inflow: Vec<(usize, [f64; D])>,
}

impl<const D: usize> Boundary<D> {
    /// A boundary without conditions, whose normal derivatives are to be of this order, 1 to 8.
    pub fn new(order: u32) -> Self {
        Self { order, conditions: Vec::new(), inflow: Vec::new() }
    }

    /// Adds conditions.
    #[must_use]
    pub fn conditions(mut self, conditions: impl IntoIterator<Item = BoundaryCondition<D>>) -> Self {
        self.conditions.extend(conditions);
        self
    }

    /// Adds particles, with their outward normals, where the flow may come in.
    #[must_use]
    pub fn inflow(mut self, places: impl IntoIterator<Item = (usize, [f64; D])>) -> Self {
        self.inflow.extend(places);
        self
    }

    /// The order of the normal derivatives.
    pub fn order(&self) -> u32 {
        self.order
    }

    /// All particles named, those of conditions first.
    pub fn particles(&self) -> impl Iterator<Item = usize> + '_ {
        self.conditions.iter().map(|condition| condition.particle()).chain(self.inflow.iter().map(|&(p, _)| p))
    }
}

/// A boundary and the values g(p, x, t) of its conditions.
#[derive(Clone, Debug)]
pub struct Bounded<const D: usize, G> {
    pub(super) boundary: Boundary<D>,
    pub(super) values: G,
}

/// The velocity at a particle and a time, where the scene has one.
pub(super) type Flow<'a, const D: usize> = &'a dyn Fn(usize, f64) -> Option<[f64; D]>;

/// The boundary of a scene, or its absence.
pub trait Edge<const D: usize, E: Fields>: Sync {
    /// What is made once for a particle set.
    type State: Send;

    /// Whether there is a boundary.
    const PRESENT: bool;

    /// Makes the rows of the conditions and says which values are prescribed whatever the time.
    ///
    /// # Errors
    /// As [`BoundaryRows::build`], and [`BoundaryError::Particle`] or [`BoundaryError::Repeated`] for inflow particles.
    fn build<P: Neighbors<D>>(
        &self,
        site: &mut Site<D>,
        flow: &dyn Fn(usize, f64) -> Option<[f64; D]>,
        steady: bool,
        neighbors: &P,
    ) -> Result<Self::State>;

    /// Writes the boundary values of time t into u; with `zero` those of the same conditions with g = 0.
    ///
    /// # Errors
    /// As [`BoundaryRows::impose`].
    fn impose(
        &self,
        state: &mut Self::State,
        site: &Site<D>,
        flow: &dyn Fn(usize, f64) -> Option<[f64; D]>,
        t: f64,
        zero: bool,
        u: &mut [E],
    ) -> Result<()>;

    /// Takes the room a copy of the field with boundary values is made in, so that it can be given back.
    fn room(state: &mut Self::State) -> Vec<E>;

    /// Gives the room back.
    fn give_back(state: &mut Self::State, room: Vec<E>);

    /// Calls `particle` for every particle whose value is prescribed at time t.
    fn each_prescribed(&self, flow: &dyn Fn(usize, f64) -> Option<[f64; D]>, t: f64, particle: &mut dyn FnMut(usize));

    /// Whether no condition is about a flux: prescribed values let no mode grow that would not without them.
    fn values_only(&self) -> bool;

    /// The rows of the conditions and the value of each, for steady problems.
    fn rows<'a>(&self, state: &'a Self::State) -> Option<&'a BoundaryRows>;

    /// g at particle p, which is at x.
    fn value(&self, p: usize, x: &[f64; D], t: f64) -> E;
}

impl<const D: usize, E: Fields> Edge<D, E> for () {
    type State = ();
    const PRESENT: bool = false;

    fn build<P: Neighbors<D>>(
        &self,
        _: &mut Site<D>,
        _: &dyn Fn(usize, f64) -> Option<[f64; D]>,
        _: bool,
        _: &P,
    ) -> Result<()> {
        Ok(())
    }

    fn impose(
        &self,
        (): &mut (),
        _: &Site<D>,
        _: &dyn Fn(usize, f64) -> Option<[f64; D]>,
        _: f64,
        _: bool,
        _: &mut [E],
    ) -> Result<()> {
        Ok(())
    }

    fn room((): &mut ()) -> Vec<E> {
        Vec::new()
    }

    fn give_back((): &mut (), _: Vec<E>) {}

    fn each_prescribed(&self, _: &dyn Fn(usize, f64) -> Option<[f64; D]>, _: f64, _: &mut dyn FnMut(usize)) {}

    fn values_only(&self) -> bool {
        true
    }

    fn rows<'a>(&self, (): &'a ()) -> Option<&'a BoundaryRows> {
        None
    }

    fn value(&self, _: usize, _: &[f64; D], _: f64) -> E {
        E::ZERO
    }
}

/// The rows of a boundary, and the room its values are found in.
#[derive(Debug)]
pub struct BoundedState<E: Fields> {
    rows: BoundaryRows,
    room: Vec<E>,
    field: Vec<E::Scalar>,
}

impl<const D: usize, G> Bounded<D, G> {
    /// The boundary.
    pub fn boundary(&self) -> &Boundary<D> {
        &self.boundary
    }

    fn comes_in(&self, i: usize, flow: Flow<'_, D>, t: f64) -> bool {
        self.boundary.inflow.get(i).is_some_and(|&(p, normal)| {
            flow(p, t).is_some_and(|v| v.iter().zip(&normal).fold(0.0, |sum, (v, n)| sum + v * n) < 0.0)
        })
    }
}

impl<G: Fn(usize, &[f64; D], f64) -> E + Sync, const D: usize, E: Fields> Edge<D, E> for Bounded<D, G> {
    type State = BoundedState<E>;
    const PRESENT: bool = true;

    fn build<P: Neighbors<D>>(
        &self,
        site: &mut Site<D>,
        flow: Flow<'_, D>,
        steady: bool,
        neighbors: &P,
    ) -> Result<BoundedState<E>> {
        let Boundary { order, conditions, inflow } = &self.boundary;
        let particles = site.points().len();
        let mut first = vec![None; particles];
        for (i, p) in self.boundary.particles().enumerate() {
            let kind = match first.get_mut(p) {
                Some(place @ None) => {
                    *place = Some(i);
                    continue;
                }
                Some(Some(first)) => BoundaryError::Repeated { first: *first, second: i },
                None => BoundaryError::Particle { particle: p, particles },
            };
            return Err(Error::from(kind).at(p));
        }
        site.open(inflow);
        let rows = BoundaryRows::build(conditions, *order, neighbors)?;
        site.prescribe(conditions.iter().map(BoundaryCondition::particle));
        if steady {
            site.prescribe((0..inflow.len()).filter(|&i| self.comes_in(i, flow, 0.0)).map(|i| inflow[i].0));
        }
        Ok(BoundedState { rows, room: Vec::new(), field: Vec::new() })
    }

    fn impose(
        &self,
        state: &mut BoundedState<E>,
        site: &Site<D>,
        flow: Flow<'_, D>,
        t: f64,
        zero: bool,
        u: &mut [E],
    ) -> Result<()> {
        let points = site.points();
        let given = |p: usize| points.get(p).map_or(E::ZERO, |x| (self.values)(p, x, t));
        let g = |p: usize| if zero { E::ZERO } else { given(p) };
        for (i, &(p, _)) in self.boundary.inflow.iter().enumerate() {
            if self.comes_in(i, flow, t) {
                let value = g(p);
                if let Some(i) = (0..E::FIELDS).find(|&i| !value.get(i).is_finite()) {
                    return Err(Error::from(BoundaryError::Value { value: value.get(i) }).at(p));
                }
                if let Some(own) = u.get_mut(p) {
                    *own = value;
                }
            }
        }
        if state.rows.particles().is_empty() {
            return Ok(());
        }
        for i in 0..E::FIELDS {
            state.field.clear();
            state.field.extend(u.iter().map(|u| <E::Scalar as crate::scalar::Scalar>::lift(u.get(i))));
            state.rows.impose(|p| g(p).get(i), &mut state.field)?;
            for &p in state.rows.particles() {
                if let (Some(own), Some(value)) = (u.get_mut(p), state.field.get(p)) {
                    own.set(i, value.as_());
                }
            }
        }
        Ok(())
    }

    fn room(state: &mut BoundedState<E>) -> Vec<E> {
        std::mem::take(&mut state.room)
    }

    fn give_back(state: &mut BoundedState<E>, room: Vec<E>) {
        state.room = room;
    }

    fn each_prescribed(&self, flow: Flow<'_, D>, t: f64, particle: &mut dyn FnMut(usize)) {
        self.boundary.conditions.iter().for_each(|condition| particle(condition.particle()));
        for (i, &(p, _)) in self.boundary.inflow.iter().enumerate() {
            if self.comes_in(i, flow, t) {
                particle(p);
            }
        }
    }

    fn values_only(&self) -> bool {
        self.boundary.conditions.iter().all(|condition| condition.factors().1 == 0.0)
    }

    fn rows<'a>(&self, state: &'a BoundedState<E>) -> Option<&'a BoundaryRows> {
        Some(&state.rows)
    }

    fn value(&self, p: usize, x: &[f64; D], t: f64) -> E {
        (self.values)(p, x, t)
    }
}
