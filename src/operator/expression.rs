//! What is asked for: an operator is a list of terms, and the run-time expression holds such a list.

use std::fmt;

use crate::error::{MultiIndexError, Result};
use crate::multi_index::{MultiIndex, Term, common_degree};

/// What a weight can be: a plain value, such as `f32`, `f64` or an integer. Every such type is one.
pub trait Value: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static {}

impl<T: Copy + Send + Sync + fmt::Debug + PartialEq + Default + 'static> Value for T {}

/// The K values an operator has at one target: `[f64; K]`.
pub trait Outputs: Copy + Send + Sync + fmt::Debug + PartialEq + 'static {
    /// Number of outputs.
    const K: usize;
    /// All outputs zero.
    const ZERO: Self;
    /// The same number of values of another scalar, as stored weights.
    type Of<T: Value>: Copy + Send + Sync + fmt::Debug + PartialEq + AsRef<[T]> + 'static;
    /// The values as a slice.
    fn as_slice(&self) -> &[f64];
    /// The values as a mutable slice.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// Converts value by value.
    fn map<T: Value>(&self, convert: impl Fn(f64) -> T) -> Self::Of<T>;
}

impl<const K: usize> Outputs for [f64; K] {
    const K: usize = K;
    const ZERO: Self = [0.0; K];
    type Of<T: Value> = [T; K];

    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        self
    }

    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        self
    }

    #[inline(always)]
    fn map<T: Value>(&self, convert: impl Fn(f64) -> T) -> [T; K] {
        std::array::from_fn(|k| convert(self[k]))
    }
}

/// A linear differential operator in D dimensions, as terms: what a method discretizes.
///
/// Typed expressions ([`Beta`](crate::Beta), [`Plus`](crate::Plus), [`Times`](crate::Times),
/// [`Laplacian`](crate::Laplacian), [`Gradient`](crate::Gradient), [`Along`](crate::Along)) and the run-time
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

/// The terms of each output, of one degree each.
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
    for (output, terms) in outputs.iter().enumerate() {
        if terms.is_empty() {
            return Err(MultiIndexError::Empty { output }.into());
        }
        common_degree(terms)?;
    }
    Ok(outputs)
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

    /// A typed expression, or any other scalar operator, as run-time data.
    ///
    /// ```
    /// use parops::{Expression, Laplacian};
    /// let laplacian = Expression::of(&(2.0 * Laplacian::<2>))?;
    /// assert_eq!(laplacian.to_string(), "2 D^(2,0) + 2 D^(0,2)");
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`MultiIndexError::Output`] where the operator names an output other than 0.
    pub fn of(operator: &impl Operator<D, Out = [f64; 1]>) -> Result<Self> {
        let terms = collect(operator)?.swap_remove(0);
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
        let mut sum = ShowSum::new(f);
        self.terms.iter().try_for_each(|term| sum.term(term.factor, term.index))
    }
}

/// Writes the terms of a sum with the signs between them; see [`Homogeneous::show`](crate::Homogeneous::show).
pub struct ShowSum<'a, 'f> {
    f: &'a mut fmt::Formatter<'f>,
    empty: bool,
}

impl<'a, 'f> ShowSum<'a, 'f> {
    pub(super) fn new(f: &'a mut fmt::Formatter<'f>) -> Self {
        Self { f, empty: true }
    }

    /// Writes one term: its sign, its factor unless that is 1, and what it is a factor of.
    ///
    /// # Errors
    /// Where the formatter fails.
    pub fn term(&mut self, factor: f64, derivative: impl fmt::Display) -> fmt::Result {
        let negative = factor < 0.0;
        self.f.write_str(match (self.empty, negative) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        })?;
        self.empty = false;
        let size = if negative { -factor } else { factor };
        if size != 1.0 {
            write!(self.f, "{size} ")?;
        }
        write!(self.f, "{derivative}")
    }
}
