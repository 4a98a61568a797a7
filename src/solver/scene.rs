//! The physics of a run, term by term.

use std::marker::PhantomData;

use super::advection::Advection;
use super::coefficient::{Diffusivity, Velocity};
use super::diffusion::Diffusion;
use super::divergence::{ComputedDivergence, FlowDivergence, GivenDivergence};
use super::edge::{Boundary, Bounded, Edge};
use super::fields::Fields;
use super::source::Source;
use super::term::SceneTerm;
use super::transport::Transport;
use crate::operator::{Mean, Method};

/// No diffusion, no advection, no source, no boundary.
pub type NoTerms = ((), (), (), ());

/// du/dt + div(v u) = div(D grad u) + S, with the terms that are named and no others.
///
/// `E` is the value of a particle, one field or several; `T` the terms (diffusion, advection, source, boundary), each the
/// unit type where it is absent: then it has no size, makes no rows and compiles to nothing. A term names its coefficient
/// *and* its method. Functions given as coefficients have their arguments written out.
///
/// Periodic and mirror boundaries are those of the domain of the neighbor provider. Behind an odd mirror u changes its
/// sign; a velocity is only ever taken at particles, so v . grad u is right beside a mirror for any v. Fields of both
/// parities in one scene are not: all fields of a run share the rows.
///
/// ```
/// use parops::{AdvectionDiffusion, DcPse, Gradient, Laplacian, Scene};
/// let scene = AdvectionDiffusion::<2>::new()
///     .diffusion(1e-3, DcPse::<Laplacian<2>, 4>::new())
///     .advection(|x: &[f64; 2], _: f64| [-x[1], x[0]], DcPse::<Gradient<2>, 4>::new())
///     .source(|x, t, u| x[0] * t - u);
/// fn applies<S: Scene<2>>(_: &S) -> usize {
///     S::APPLIES
/// }
/// assert_eq!(applies(&scene), 2);
/// assert_eq!(size_of::<AdvectionDiffusion<2>>(), 0);
/// ```
#[derive(Clone, Debug, Default)]
pub struct AdvectionDiffusion<const D: usize, E = f64, T = NoTerms> {
    terms: T,
    value: PhantomData<fn() -> E>,
}

impl<const D: usize> AdvectionDiffusion<D> {
    /// The scene du/dt = 0 of one field in `f64`.
    pub const fn new() -> Self {
        Self { terms: ((), (), (), ()), value: PhantomData }
    }

    /// The scene du/dt = 0 of other fields: `f32`, `[f64; F]` or `[f32; F]`.
    #[must_use]
    pub fn fields<E: Fields>(self) -> AdvectionDiffusion<D, E> {
        made(self.terms)
    }
}

/// A scene whose advection knows its divergence.
type Compressible<const D: usize, E, K, V, X, W, S, B> = AdvectionDiffusion<D, E, (K, Advection<V, X, W>, S, B)>;

fn made<const D: usize, E, T>(terms: T) -> AdvectionDiffusion<D, E, T> {
    AdvectionDiffusion { terms, value: PhantomData }
}

impl<const D: usize, E: Fields, A, S, B> AdvectionDiffusion<D, E, ((), A, S, B)> {
    /// Adds div(D grad u): a [`Diffusivity`] and any method for the Laplacian.
    #[must_use]
    pub fn diffusion<C: Diffusivity<D>, M: Method<D, Out = [f64; 1]>>(
        self,
        diffusivity: C,
        method: M,
    ) -> AdvectionDiffusion<D, E, (Diffusion<C, M>, A, S, B)> {
        let ((), a, s, b) = self.terms;
        made((Diffusion { diffusivity, method, mean: Mean::default() }, a, s, b))
    }
}

impl<const D: usize, E: Fields, C, M, A, S, B> AdvectionDiffusion<D, E, (Diffusion<C, M>, A, S, B)> {
    /// Sets the mean of the two diffusivities of a pair, arithmetic by default.
    #[must_use]
    pub fn mean(mut self, mean: Mean) -> Self {
        self.terms.0.mean = mean;
        self
    }
}

impl<const D: usize, E: Fields, K, S, B> AdvectionDiffusion<D, E, (K, (), S, B)> {
    /// Adds -v . grad u: a [`Velocity`] and a scheme, a method for the gradient or an upwind one. The velocity is
    /// taken to be solenoidal until its divergence is named.
    #[must_use]
    pub fn advection<V: Velocity<D>, X: Transport<D>>(
        self,
        velocity: V,
        scheme: X,
    ) -> AdvectionDiffusion<D, E, (K, Advection<V, X>, S, B)> {
        let (k, (), s, b) = self.terms;
        made((k, Advection { velocity, scheme, divergence: () }, s, b))
    }
}

impl<const D: usize, E: Fields, K, V, X, S, B> AdvectionDiffusion<D, E, (K, Advection<V, X>, S, B)> {
    /// Adds -u div v, with div v a function of x and t.
    #[must_use]
    pub fn divergence<F: Fn(&[f64; D], f64) -> f64 + Sync>(
        self,
        divergence: F,
    ) -> Compressible<D, E, K, V, X, GivenDivergence<F>, S, B> {
        self.with_divergence(GivenDivergence(divergence))
    }

    /// Adds -u div v, with div v by the rows of the scheme, which must be central ones; mirrors turn the normal component
    /// of v, see [`ComputedDivergence`].
    #[must_use]
    pub fn computed_divergence(self) -> Compressible<D, E, K, V, X, ComputedDivergence, S, B> {
        self.with_divergence(ComputedDivergence)
    }

    fn with_divergence<W: FlowDivergence<D>>(self, divergence: W) -> Compressible<D, E, K, V, X, W, S, B> {
        let (k, Advection { velocity, scheme, .. }, s, b) = self.terms;
        made((k, Advection { velocity, scheme, divergence }, s, b))
    }
}

impl<const D: usize, E: Fields, K, A, B> AdvectionDiffusion<D, E, (K, A, (), B)> {
    /// Adds S(x, t, u), with u and S all fields of a particle.
    #[must_use]
    pub fn source<F: Fn(&[f64; D], f64, E) -> E + Sync>(
        self,
        source: F,
    ) -> AdvectionDiffusion<D, E, (K, A, Source<F>, B)> {
        let (k, a, (), b) = self.terms;
        made((k, a, Source(source), b))
    }
}

impl<const D: usize, E: Fields, K, A, S> AdvectionDiffusion<D, E, (K, A, S, ())> {
    /// Adds boundary conditions with the values g(p, x, t) at particle p, which is at x.
    #[must_use]
    pub fn boundary<G: Fn(usize, &[f64; D], f64) -> E + Sync>(
        self,
        boundary: Boundary<D>,
        values: G,
    ) -> AdvectionDiffusion<D, E, (K, A, S, Bounded<D, G>)> {
        let (k, a, s, ()) = self.terms;
        made((k, a, s, Bounded { boundary, values }))
    }
}

/// What a solver sees of a scene: its terms, present or absent.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no scene in {D} dimensions",
    label = "a term of it does not fit its coefficient, its method or the fields"
)]
pub trait Scene<const D: usize> {
    /// The value of a particle.
    type Value: Fields;
    /// The diffusion term.
    type Diffusion: SceneTerm<D, Self::Value>;
    /// The advection term.
    type Advection: SceneTerm<D, Self::Value>;
    /// The source term.
    type Source: SceneTerm<D, Self::Value>;
    /// The boundary.
    type Edge: Edge<D, Self::Value>;

    /// Sweeps over stored rows a stage.
    const APPLIES: usize = <Self::Diffusion as SceneTerm<D, Self::Value>>::APPLIES
        + <Self::Advection as SceneTerm<D, Self::Value>>::APPLIES
        + <Self::Source as SceneTerm<D, Self::Value>>::APPLIES;

    /// The diffusion term.
    fn diffusion_term(&self) -> &Self::Diffusion;

    /// The advection term.
    fn advection_term(&self) -> &Self::Advection;

    /// The source term.
    fn source_term(&self) -> &Self::Source;

    /// The boundary.
    fn edge(&self) -> &Self::Edge;
}

impl<K, A, S, B, const D: usize, E: Fields> Scene<D> for AdvectionDiffusion<D, E, (K, A, S, B)>
where
    K: SceneTerm<D, E>,
    A: SceneTerm<D, E>,
    S: SceneTerm<D, E>,
    B: Edge<D, E>,
{
    type Value = E;
    type Diffusion = K;
    type Advection = A;
    type Source = S;
    type Edge = B;

    fn diffusion_term(&self) -> &K {
        &self.terms.0
    }

    fn advection_term(&self) -> &A {
        &self.terms.1
    }

    fn source_term(&self) -> &S {
        &self.terms.2
    }

    fn edge(&self) -> &B {
        &self.terms.3
    }
}
