//! The numbers that kernels and single-stencil numerics are generic over.

use nalgebra::RealField;

/// A real scalar: `f32`, `f64`, or a dual number that carries derivatives.
///
/// Everything that evaluates a kernel at one point is generic over it, so that automatic differentiation
/// passes straight through a kernel. It is implemented for every copyable [`nalgebra::RealField`].
///
/// ```
/// use parops::Scalar;
/// assert_eq!(f32::lift(0.5), 0.5_f32);
/// ```
pub trait Scalar: RealField + Copy {
    /// The scalar nearest to the given `f64`.
    #[inline(always)]
    fn lift(x: f64) -> Self {
        nalgebra::convert(x)
    }
}

impl<T: RealField + Copy> Scalar for T {}

/// The squared Euclidean length |z|^2 = sum_i z_i^2, summed from the first axis on.
#[inline(always)]
pub(crate) fn square<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    let mut s = T::zero();
    for &x in z {
        s += x * x;
    }
    s
}

/// The length |z|, of vectors of any scale.
#[inline(always)]
pub(crate) fn length<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    let s = square(z);
    // Squares below the first are short of digits.
    let sound = s > T::lift(LEAST_SQUARE) && s.is_finite();
    if sound { s.sqrt() } else { scaled_length(z) }
}

/// Above the least normal number over epsilon, of `f32` too.
const LEAST_SQUARE: f64 = 1e-30;

/// The same by the largest component.
#[cold]
fn scaled_length<T: Scalar, const D: usize>(z: &[T; D]) -> T {
    let largest = z.iter().fold(T::zero(), |largest, x| largest.max(x.abs()));
    if largest == T::zero() || !largest.is_finite() {
        square(z)
    } else {
        largest * square(&z.map(|x| x / largest)).sqrt()
    }
}

/// Figures of a report in files: a number where it is finite, a word where it is not, for formats such as JSON that have
/// no other way to say so.
#[cfg(feature = "serde")]
pub(crate) mod figure {
    use std::fmt;

    use serde::de::{Deserialize, Deserializer, Error, Visitor};
    use serde::ser::Serializer;

    pub(crate) fn serialize<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if x.is_finite() || !serializer.is_human_readable() {
            serializer.serialize_f64(*x)
        } else {
            serializer.collect_str(x)
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        if deserializer.is_human_readable() {
            deserializer.deserialize_any(Figure)
        } else {
            f64::deserialize(deserializer)
        }
    }

    struct Figure;

    impl Visitor<'_> for Figure {
        type Value = f64;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a number, or NaN, inf or -inf")
        }

        fn visit_f64<E: Error>(self, x: f64) -> Result<f64, E> {
            Ok(x)
        }

        fn visit_u64<E: Error>(self, x: u64) -> Result<f64, E> {
            Ok(x as f64)
        }

        fn visit_i64<E: Error>(self, x: i64) -> Result<f64, E> {
            Ok(x as f64)
        }

        fn visit_str<E: Error>(self, word: &str) -> Result<f64, E> {
            word.parse().map_err(|_| E::invalid_value(serde::de::Unexpected::Str(word), &self))
        }
    }
}
