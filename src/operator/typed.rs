//! Operators as types: derivatives, their sums and multiples, of one degree that the compiler knows.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

use typenum::Unsigned;

use super::expression::{Operator, ShowSum};
use crate::multi_index::{Beta, Exponents, HasLen, MultiIndex, SameDegree};

/// A typed expression whose terms all have one degree, known to the compiler.
///
/// The arithmetic is `a + b`, `a - b`, `-a`, `2.0 * a` and `a * 2.0`, in any nesting.
///
/// ```
/// use parops::{D2, Laplacian};
/// let mixed = Laplacian::<2> - 3.0 * (D2::<1, 1>::default() + 0.5 * D2::<0, 2>::default());
/// assert_eq!(mixed.to_string(), "D^(2,0) + D^(0,2) - 3 D^(1,1) - 1.5 D^(0,2)");
/// ```
pub trait Homogeneous {
    /// |beta| of every term.
    type Degree: Unsigned;

    /// Writes `factor` times this expression; `Display` and `Debug` both show it with factor 1.
    ///
    /// # Errors
    /// Where the formatter fails.
    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result;
}

impl<L: Exponents> Homogeneous for Beta<L> {
    type Degree = L::Degree;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        sum.term(factor, self)
    }
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
/// use parops::{D2, Plus};
/// let sum: Plus<_, _> = D2::<2, 0>::default() + D2::<0, 2>::default();
/// assert_eq!(sum.to_string(), "D^(2,0) + D^(0,2)");
/// ```
#[derive(Clone, Copy, Default)]
pub struct Plus<A: Homogeneous, B: Homogeneous>(pub(super) A, pub(super) B)
where
    A::Degree: SameDegree<B::Degree>;

impl<A: Homogeneous, B: Homogeneous> Homogeneous for Plus<A, B>
where
    A::Degree: SameDegree<B::Degree>,
{
    type Degree = A::Degree;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        self.0.show(factor, sum)?;
        self.1.show(factor, sum)
    }
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

/// An operator times a constant factor.
#[derive(Clone, Copy)]
pub struct Times<A>(pub(super) f64, pub(super) A);

impl<A: Homogeneous> Homogeneous for Times<A> {
    type Degree = A::Degree;

    fn show(&self, factor: f64, sum: &mut ShowSum<'_, '_>) -> fmt::Result {
        self.1.show(factor * self.0, sum)
    }
}

impl<A: Operator<D>, const D: usize> Operator<D> for Times<A> {
    type Out = A::Out;

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<D>, f64)) {
        self.1.terms(&mut |output, index, factor| term(output, index, self.0 * factor));
    }
}

macro_rules! arithmetic {
    ($([$($generics:tt)*] $ty:ty [$($bound:tt)*];)*) => { $(
        impl<$($generics)*, Other: Homogeneous> Add<Other> for $ty
        where
            <$ty as Homogeneous>::Degree: SameDegree<Other::Degree>,
            $($bound)*
        {
            type Output = Plus<$ty, Other>;
            fn add(self, other: Other) -> Self::Output {
                Plus(self, other)
            }
        }

        impl<$($generics)*, Other: Homogeneous> Sub<Other> for $ty
        where
            <$ty as Homogeneous>::Degree: SameDegree<Other::Degree>,
            $($bound)*
        {
            type Output = Plus<$ty, Times<Other>>;
            fn sub(self, other: Other) -> Self::Output {
                Plus(self, Times(-1.0, other))
            }
        }

        impl<$($generics)*> Neg for $ty where $($bound)* {
            type Output = Times<$ty>;
            fn neg(self) -> Self::Output {
                Times(-1.0, self)
            }
        }

        impl<$($generics)*> Mul<$ty> for f64 where $($bound)* {
            type Output = Times<$ty>;
            fn mul(self, operator: $ty) -> Self::Output {
                Times(self, operator)
            }
        }

        impl<$($generics)*> Mul<f64> for $ty where $($bound)* {
            type Output = Times<$ty>;
            fn mul(self, factor: f64) -> Self::Output {
                Times(factor, self)
            }
        }
    )* };
}

arithmetic! {
    [L: Exponents] Beta<L> [];
    [A: Homogeneous, B: Homogeneous] Plus<A, B> [A::Degree: SameDegree<B::Degree>];
    [A: Homogeneous] Times<A> [];
}

// `Beta` writes itself: it stands in the layer above.
macro_rules! shown {
    ($([$($generics:tt)*] $ty:ty [$($bound:tt)*];)*) => { $(
        impl<$($generics)*> fmt::Display for $ty where $($bound)* {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.show(1.0, &mut ShowSum::new(f))
            }
        }

        impl<$($generics)*> fmt::Debug for $ty where $($bound)* {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
    )* };
}

shown! {
    [A: Homogeneous, B: Homogeneous] Plus<A, B> [A::Degree: SameDegree<B::Degree>];
    [A: Homogeneous] Times<A> [];
}

pub(super) use {arithmetic, shown};
