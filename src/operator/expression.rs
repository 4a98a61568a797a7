//! What is asked for: typed and run-time expressions, which all lower to terms.

use std::fmt;
use std::ops::{Add, Mul};

use typenum::{U1, U2, Unsigned};

use crate::error::{MultiIndexError, Result};
use crate::multi_index::{Beta, Exponents, HasLen, MultiIndex, SameDegree, Term, common_degree};

/// The K values an operator has at one target: `[f64; K]`.
pub trait Outputs: Copy + Send + Sync + fmt::Debug + PartialEq + 'static {
    /// Number of outputs.
    const K: usize;
    /// All outputs zero.
    const ZERO: Self;
    /// The same number of values of another scalar, as stored weights.
    type Of<T: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static>: Copy
        + Send
        + Sync
        + fmt::Debug
        + PartialEq
        + AsRef<[T]>
        + 'static;
    /// The values as a slice.
    fn as_slice(&self) -> &[f64];
    /// The values as a mutable slice.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// Converts value by value.
    fn map<T: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static>(
        &self,
        convert: impl Fn(f64) -> T,
    ) -> Self::Of<T>;
}

impl<const K: usize> Outputs for [f64; K] {
    const K: usize = K;
    const ZERO: Self = [0.0; K];
    type Of<T: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static> = [T; K];

    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        self
    }

    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        self
    }

    #[inline(always)]
    fn map<T: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static>(
        &self,
        convert: impl Fn(f64) -> T,
    ) -> [T; K] {
        std::array::from_fn(|k| convert(self[k]))
    }
}

/// A linear differential operator in D dimensions, as terms: what a method discretizes.
///
/// Typed expressions ([`Beta`], [`Plus`], [`Times`], [`Laplacian`], [`Gradient`], [`Divergence`]) and the run-time
/// [`Expression`] implement it; below this line only terms exist, so both give identical bits.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no differential operator in {D} dimensions",
    label = "expected an operator in {D} dimensions",
    note = "a multi-index must have {D} exponents, and every term of a sum the same number of them"
)]
pub trait Operator<const D: usize>: Sync {
    /// `[f64; K]`, the values at one target.
    type Out: Outputs;

    /// Hands out every term: output k, multi-index, factor.
    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64));
}

/// The terms of each output, checked.
///
/// # Errors
/// [`MultiIndexError::Output`] for an output that does not exist, [`MultiIndexError::Empty`] for one without terms,
/// and as [`common_degree`].
pub(super) fn collect<const D: usize, Op: Operator<D>>(operator: &Op) -> Result<Vec<Vec<Term<D>>>> {
    let mut outputs = vec![Vec::new(); Op::Out::K];
    let mut beyond = None;
    operator.terms(&mut |output, index, factor| match outputs.get_mut(output) {
        Some(terms) => terms.push(Term { index, factor }),
        None => beyond = Some(output),
    });
    if let Some(output) = beyond {
        return Err(MultiIndexError::Output { output, outputs: Op::Out::K }.into());
    }
    let mut first = None;
    for (output, terms) in outputs.iter().enumerate() {
        if terms.is_empty() {
            return Err(MultiIndexError::Empty { output }.into());
        }
        let other = common_degree(terms)?;
        let first = *first.get_or_insert(other);
        if other != first {
            return Err(MultiIndexError::UnequalDegree { first, other }.into());
        }
    }
    Ok(outputs)
}

/// A typed expression whose terms all have one degree, known to the compiler.
pub trait Homogeneous {
    /// |beta| of every term.
    type Degree: Unsigned;
}

impl<L: Exponents> Homogeneous for Beta<L> {
    type Degree = L::Degree;
}

impl<L: HasLen<D>, const D: usize> Operator<D> for Beta<L> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        term(0, Beta::<L>::index(), 1.0);
    }
}

/// The sum of two operators of equal degree: one solve, one weight per pair.
///
/// ```
/// use parops::{D2, Operator};
/// let sum = D2::<2, 0>::default() + 3.0 * D2::<0, 2>::default();
/// assert_eq!(sum.to_string(), "D^(2,0) + 3 D^(0,2)");
/// ```
#[derive(Clone, Copy, Default)]
pub struct Plus<A: Homogeneous, B: Homogeneous>(A, B)
where
    A::Degree: SameDegree<B::Degree>;

impl<A: Homogeneous, B: Homogeneous> Homogeneous for Plus<A, B>
where
    A::Degree: SameDegree<B::Degree>,
{
    type Degree = A::Degree;
}

impl<A, B, const D: usize> Operator<D> for Plus<A, B>
where
    A: Homogeneous + Operator<D>,
    B: Homogeneous + Operator<D, Out = A::Out>,
    A::Degree: SameDegree<B::Degree>,
{
    type Out = A::Out;

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        self.0.terms(term);
        self.1.terms(term);
    }
}

impl<A: Homogeneous + fmt::Display, B: Homogeneous + fmt::Display> fmt::Display for Plus<A, B>
where
    A::Degree: SameDegree<B::Degree>,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} + {}", self.0, self.1)
    }
}

/// An operator times a constant factor.
#[derive(Clone, Copy, Debug)]
pub struct Times<A>(f64, A);

impl<A: Homogeneous> Homogeneous for Times<A> {
    type Degree = A::Degree;
}

impl<A: Operator<D>, const D: usize> Operator<D> for Times<A> {
    type Out = A::Out;

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        self.1.terms(&mut |output, index, factor| term(output, index, self.0 * factor));
    }
}

impl<A: fmt::Display> fmt::Display for Times<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.0, self.1)
    }
}

/// The Laplacian sum_i d^2/dx_i^2, one weight per pair.
#[derive(Clone, Copy, Debug, Default)]
pub struct Laplacian<const D: usize>;

impl<const D: usize> Homogeneous for Laplacian<D> {
    type Degree = U2;
}

impl<const D: usize> Operator<D> for Laplacian<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        for axis in 0..D {
            let mut exponents = [0; D];
            exponents[axis] = 2;
            term(0, MultiIndex::new(exponents), 1.0);
        }
    }
}

/// The gradient, output k being d/dx_k: D weights per pair.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gradient<const D: usize>;

impl<const D: usize> Homogeneous for Gradient<D> {
    type Degree = U1;
}

impl<const D: usize> Operator<D> for Gradient<D> {
    type Out = [f64; D];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        for axis in 0..D {
            let mut exponents = [0; D];
            exponents[axis] = 1;
            term(axis, MultiIndex::new(exponents), 1.0);
        }
    }
}

/// The divergence of a vector field. Its rows are those of the [`Gradient`]; `apply_dot` contracts them with the field.
pub type Divergence<const D: usize> = Gradient<D>;

/// v . grad for one constant velocity. Where the velocity varies, contract [`Gradient`] rows by `apply_along`.
#[derive(Clone, Copy, Debug)]
pub struct Along<const D: usize>(
    /// The velocity v.
    pub [f64; D],
);

impl<const D: usize> Homogeneous for Along<D> {
    type Degree = U1;
}

impl<const D: usize> Operator<D> for Along<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        Gradient::<D>.terms(&mut |axis, index, factor| term(0, index, factor * self.0[axis]));
    }
}

macro_rules! arithmetic {
    ($([$($generics:tt)*] $ty:ty;)*) => { $(
        impl<$($generics)*, Other: Homogeneous> Add<Other> for $ty
        where
            $ty: Homogeneous,
            <$ty as Homogeneous>::Degree: SameDegree<Other::Degree>,
        {
            type Output = Plus<$ty, Other>;
            fn add(self, other: Other) -> Self::Output {
                Plus(self, other)
            }
        }

        impl<$($generics)*> Mul<$ty> for f64
        where
            $ty: Homogeneous,
        {
            type Output = Times<$ty>;
            fn mul(self, operator: $ty) -> Self::Output {
                Times(self, operator)
            }
        }
    )* };
}

arithmetic! {
    [L: Exponents] Beta<L>;
    [A: Homogeneous] Times<A>;
    [const D: usize] Laplacian<D>;
    [const D: usize] Along<D>;
    [const D: usize] Gradient<D>;
}

impl<A: Homogeneous, B: Homogeneous, Other: Homogeneous> Add<Other> for Plus<A, B>
where
    A::Degree: SameDegree<B::Degree> + SameDegree<Other::Degree>,
{
    type Output = Plus<Self, Other>;

    fn add(self, other: Other) -> Self::Output {
        Plus(self, other)
    }
}

impl<A: Homogeneous, B: Homogeneous> Mul<Plus<A, B>> for f64
where
    A::Degree: SameDegree<B::Degree>,
{
    type Output = Times<Plus<A, B>>;

    fn mul(self, operator: Plus<A, B>) -> Self::Output {
        Times(self, operator)
    }
}

/// A scalar operator known at run time only: from a configuration file, from another language.
///
/// ```
/// use parops::{Expression, MultiIndex};
/// let laplacian = Expression::new([(MultiIndex::new([2, 0]), 1.0), (MultiIndex::new([0, 2]), 1.0)])?;
/// assert_eq!((laplacian.degree(), laplacian.to_string().as_str()), (2, "D^(2,0) + D^(0,2)"));
/// # parops::Result::Ok(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Expression<const D: usize> {
    terms: Vec<Term<D>>,
    degree: u32,
}

impl<const D: usize> Expression<D> {
    /// The sum of these terms.
    ///
    /// # Errors
    /// [`MultiIndexError::Empty`] without terms, [`MultiIndexError::UnequalDegree`] where two degrees differ,
    /// [`MultiIndexError::Factor`] where a factor is not finite.
    pub fn new(terms: impl IntoIterator<Item = (MultiIndex<D>, f64)>) -> Result<Self> {
        let terms: Vec<_> = terms.into_iter().map(|(index, factor)| Term { index, factor }).collect();
        let degree = common_degree(&terms)?;
        Ok(Self { terms, degree })
    }

    /// |beta| of every term.
    pub fn degree(&self) -> u32 {
        self.degree
    }
}

impl<const D: usize> Operator<D> for Expression<D> {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        for t in &self.terms {
            term(0, t.index, t.factor);
        }
    }
}

impl<const D: usize> fmt::Display for Expression<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, term) in self.terms.iter().enumerate() {
            f.write_str(if i == 0 { "" } else { " + " })?;
            if term.factor != 1.0 {
                write!(f, "{} ", term.factor)?;
            }
            write!(f, "{}", term.index)?;
        }
        Ok(())
    }
}

impl<A: Homogeneous, B: Homogeneous> fmt::Debug for Plus<A, B>
where
    A: fmt::Debug,
    B: fmt::Debug,
    A::Degree: SameDegree<B::Degree>,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} + {:?}", self.0, self.1)
    }
}
