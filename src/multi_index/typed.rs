//! Multi-indices as types: a type-level list inside, const-generic aliases outside.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Add;

use typenum::{ATerm, Sum, TArr, U, U0, Unsigned};

use super::MultiIndex;

/// A multi-index known at compile time, held as a type-level list of unsigned integers.
///
/// `Beta<tarr![U2, U0]>` is the same type as [`D2<2, 0>`](D2). It is a zero-sized value.
///
/// ```
/// use parops::{Beta, D2, MultiIndex};
/// use typenum::{U0, U2, tarr};
/// let typed: Beta<tarr![U2, U0]> = D2::<2, 0>::default();
/// assert_eq!(MultiIndex::from(typed), MultiIndex::new([2, 0]));
/// assert_eq!(format!("{typed} {typed:?}"), "D^(2,0) D^(2,0)");
/// ```
pub struct Beta<L>(PhantomData<fn() -> L>);

/// A derivative in one dimension, [`Beta`] of one exponent.
pub type D1<const A: usize> = Beta<TArr<U<A>, ATerm>>;
/// A derivative in two dimensions, [`Beta`] of two exponents.
pub type D2<const A: usize, const B: usize> = Beta<TArr<U<A>, TArr<U<B>, ATerm>>>;
/// A derivative in three dimensions, [`Beta`] of three exponents.
pub type D3<const A: usize, const B: usize, const C: usize> = Beta<TArr<U<A>, TArr<U<B>, TArr<U<C>, ATerm>>>>;

/// A type-level list of exponents, with their sum.
pub trait Exponents {
    /// |beta| as a type, so that a sum of unequal degree does not compile.
    type Degree: Unsigned;

    /// Writes the exponents, separated by commas; `first` is false behind a comma.
    ///
    /// # Errors
    /// Where the formatter fails.
    fn show(f: &mut fmt::Formatter<'_>, first: bool) -> fmt::Result;
}

impl Exponents for ATerm {
    type Degree = U0;

    fn show(_: &mut fmt::Formatter<'_>, _: bool) -> fmt::Result {
        Ok(())
    }
}

impl<A, Rest> Exponents for TArr<A, Rest>
where
    A: Unsigned + Add<Rest::Degree>,
    Rest: Exponents,
    Sum<A, Rest::Degree>: Unsigned,
{
    type Degree = Sum<A, Rest::Degree>;

    fn show(f: &mut fmt::Formatter<'_>, first: bool) -> fmt::Result {
        write!(f, "{}{}", if first { "" } else { "," }, A::U64)?;
        Rest::show(f, false)
    }
}

/// A list of exactly D exponents.
#[diagnostic::on_unimplemented(
    message = "this multi-index does not have {D} exponents, so it is no derivative in {D} dimensions",
    label = "a derivative in another number of dimensions",
    note = "use D1, D2 or D3 for one, two or three dimensions, or Beta<tarr![..]> with as many exponents as the particles have coordinates"
)]
pub trait HasLen<const D: usize>: Exponents {
    /// The exponents as values; each must fit eight bits, which is checked at compile time.
    const EXPONENTS: [u8; D];
}

const fn exponent<N: Unsigned>() -> u8 {
    assert!(N::USIZE <= u8::MAX as usize, "an exponent of a multi-index must not exceed 255");
    N::U8
}

macro_rules! list {
    () => { ATerm };
    ($head:ident $($tail:ident)*) => { TArr<$head, list!($($tail)*)> };
}

macro_rules! has_len {
    ($($d:literal: $($name:ident)+;)*) => { $(
        impl<$($name: Unsigned),+> HasLen<$d> for list!($($name)+)
        where
            list!($($name)+): Exponents,
        {
            const EXPONENTS: [u8; $d] = [$(exponent::<$name>()),+];
        }
    )* };
}

has_len! {
    1: A;
    2: A B;
    3: A B C;
    4: A B C E;
    5: A B C E F;
    6: A B C E F G;
}

/// Holds for equal degrees only; it stands where a sum is named, so that the compiler can say what is wrong.
#[diagnostic::on_unimplemented(
    message = "a sum of differential operators must have one degree: its terms have unequal degree",
    label = "these terms differ in degree",
    note = "operators of different degree have different powers of epsilon; build them side by side and add their results"
)]
pub trait SameDegree<Other> {}

impl<N> SameDegree<N> for N {}

/// No degree at all. Were equality the only implementation, the compiler would infer the second degree from the
/// first and answer a wrong sum with a type mismatch instead of the sentence above.
#[derive(Clone, Copy, Debug)]
pub enum NoDegree {}

impl<N: Unsigned> SameDegree<NoDegree> for N {}

impl<L> Beta<L> {
    /// The multi-index as a value.
    pub const fn index<const D: usize>() -> MultiIndex<D>
    where
        L: HasLen<D>,
    {
        MultiIndex::new(L::EXPONENTS)
    }
}

impl<L: HasLen<D>, const D: usize> From<Beta<L>> for MultiIndex<D> {
    fn from(_: Beta<L>) -> Self {
        Beta::<L>::index()
    }
}

impl<L> Clone for Beta<L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for Beta<L> {}

impl<L> Default for Beta<L> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<L: Exponents> fmt::Display for Beta<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("D^(")?;
        L::show(f, true)?;
        f.write_str(")")
    }
}

impl<L: Exponents> fmt::Debug for Beta<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
