//! What a stepper moves.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OVector};

use super::entry::{self, Entry};
use crate::error::{Result, TimeError};

/// What a stepper moves: the values of all particles, seen as one vector.
///
/// Implemented for `Vec<E>` and `[E; N]` with any [`Entry`] E (one entry a particle), for `f64` and `f32`, for nalgebra's
/// `DVector` and `SVector`, and for pairs (A, B) of states, such as positions and strengths.
/// All operations keep the allocation of `self`. Two states that meet in one have the same shape; the steppers check
/// it with [`same_shape`](Self::same_shape) wherever the caller's code could have changed it.
///
/// ```
/// use parops::State;
/// let mut u = vec![[0.0_f32; 2]; 3];
/// u.set_sum(&vec![[1.0, 2.0]; 3], 0.5, &vec![[2.0, f32::NAN]; 3]);
/// assert_eq!((u[2][0], u.first_non_finite()), (2.0, Some(0)));
/// ```
pub trait State: Clone {
    /// Number of entries.
    fn len(&self) -> usize;

    /// Whether there is no entry.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// self = other, whatever the shape of `self` was; allocates only to grow.
    fn assign(&mut self, other: &Self) {
        self.clone_from(other);
    }

    /// self = base + a y.
    fn set_sum(&mut self, base: &Self, a: f64, y: &Self);

    /// self = self + a y.
    fn add_scaled(&mut self, a: f64, y: &Self);

    /// self = base + a y and sum = sum + b y in one pass over y, unless y is not finite: then its first particle with a
    /// number which is not, and what self and sum hold is unspecified.
    fn set_sum_and_add(&mut self, base: &Self, a: f64, y: &Self, sum: &mut Self, b: f64) -> Option<usize> {
        let found = y.first_non_finite();
        if found.is_none() {
            self.set_sum(base, a, y);
            sum.add_scaled(b, y);
        }
        found
    }

    /// The first particle that has a number which is not finite.
    fn first_non_finite(&self) -> Option<usize>;

    /// Checks that self has the shape of `needed`.
    ///
    /// # Errors
    /// [`TimeError::Shape`] where the numbers of entries differ.
    fn same_shape(&self, needed: &Self) -> Result<()> {
        let (found, needed) = (self.len(), needed.len());
        if found == needed { Ok(()) } else { Err(TimeError::Shape { found, needed }.into()) }
    }
}

/// Implements [`State`] for a type that shows its entries as a slice.
macro_rules! state_by_slice {
    ($slice:expr, $mut_slice:expr, [$($bounds:tt)*], $state:ty $(, $($where:tt)*)?) => {
        impl<$($bounds)*> State for $state $(where $($where)*)? {
            fn len(&self) -> usize {
                $slice(self).len()
            }

            #[inline]
            fn set_sum(&mut self, base: &Self, a: f64, y: &Self) {
                entry::set_sum($mut_slice(self), $slice(base), a, $slice(y));
            }

            #[inline]
            fn add_scaled(&mut self, a: f64, y: &Self) {
                entry::add($mut_slice(self), a, $slice(y));
            }

            fn set_sum_and_add(&mut self, base: &Self, a: f64, y: &Self, sum: &mut Self, b: f64) -> Option<usize> {
                entry::set_sum_and_add($mut_slice(self), $slice(base), a, $slice(y), $mut_slice(sum), b)
            }

            fn first_non_finite(&self) -> Option<usize> {
                entry::first_non_finite($slice(self))
            }
        }
    };
}

state_by_slice!(Vec::as_slice, Vec::as_mut_slice, [E: Entry], Vec<E>);
state_by_slice!(<[E; N]>::as_slice, <[E; N]>::as_mut_slice, [E: Entry, const N: usize], [E; N]);
state_by_slice!(std::slice::from_ref, std::slice::from_mut, [], f64);
state_by_slice!(std::slice::from_ref, std::slice::from_mut, [], f32);
state_by_slice!(
    OVector::<E, D>::as_slice,
    OVector::<E, D>::as_mut_slice,
    [E: Entry + nalgebra::Scalar, D: Dim],
    OVector<E, D>,
    DefaultAllocator: Allocator<D>
);

impl<A: State, B: State> State for (A, B) {
    fn len(&self) -> usize {
        self.0.len().max(self.1.len())
    }

    fn assign(&mut self, other: &Self) {
        self.0.assign(&other.0);
        self.1.assign(&other.1);
    }

    fn set_sum(&mut self, base: &Self, a: f64, y: &Self) {
        self.0.set_sum(&base.0, a, &y.0);
        self.1.set_sum(&base.1, a, &y.1);
    }

    fn add_scaled(&mut self, a: f64, y: &Self) {
        self.0.add_scaled(a, &y.0);
        self.1.add_scaled(a, &y.1);
    }

    fn set_sum_and_add(&mut self, base: &Self, a: f64, y: &Self, sum: &mut Self, b: f64) -> Option<usize> {
        let first = self.0.set_sum_and_add(&base.0, a, &y.0, &mut sum.0, b);
        let second = self.1.set_sum_and_add(&base.1, a, &y.1, &mut sum.1, b);
        first.into_iter().chain(second).min()
    }

    fn first_non_finite(&self) -> Option<usize> {
        let (first, second) = (self.0.first_non_finite(), self.1.first_non_finite());
        first.into_iter().chain(second).min()
    }

    fn same_shape(&self, needed: &Self) -> Result<()> {
        self.0.same_shape(&needed.0)?;
        self.1.same_shape(&needed.1)
    }
}
