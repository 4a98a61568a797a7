//! Multi-indices in graded order, and how many of them a set of moment conditions has.

use super::MultiIndex;
use crate::error::{MultiIndexError, Result};

/// All multi-indices with `low` <= |alpha| <= `high`, degree by degree, within a degree with the larger first
/// exponents first: (0,0), (1,0), (0,1), (2,0), (1,1), (0,2), ...
///
/// Exponents are held in eight bits: degrees above 255 end the enumeration.
///
/// ```
/// use parops::{MultiIndex, graded};
/// let second: Vec<_> = graded::<2>(2, 2).map(|alpha| alpha.exponents()).collect();
/// assert_eq!(second, [[2, 0], [1, 1], [0, 2]]);
/// ```
pub fn graded<const D: usize>(low: u32, high: u32) -> impl Iterator<Item = MultiIndex<D>> {
    let mut next = if D == 0 || low > high { None } else { first_of_degree::<D>(low) };
    std::iter::from_fn(move || {
        let current = next?;
        next = successor(current).or_else(|| {
            let degree = current.degree() + 1;
            if degree > high { None } else { first_of_degree(degree) }
        });
        Some(current)
    })
}

fn first_of_degree<const D: usize>(degree: u32) -> Option<MultiIndex<D>> {
    let mut exponents = [0; D];
    exponents[0] = u8::try_from(degree).ok()?;
    Some(MultiIndex::new(exponents))
}

/// The next multi-index of the same degree: the last exponent but one that can give gives one to its right
/// neighbor, which also takes all that stands at the end.
fn successor<const D: usize>(alpha: MultiIndex<D>) -> Option<MultiIndex<D>> {
    let mut exponents = alpha.exponents();
    let giver = (0..D - 1).rev().find(|&i| exponents[i] > 0)?;
    let tail = exponents[D - 1];
    exponents[D - 1] = 0;
    exponents[giver] -= 1;
    exponents[giver + 1] = tail + 1;
    Some(MultiIndex::new(exponents))
}

/// The number l of moment conditions of an operator of degree |beta| and order r in `dim` dimensions,
/// l = C(dim + |beta| + r - 1, dim) - alpha_min, where alpha_min = 1 for even |beta| (the zeroth moment is free)
/// and 0 for odd |beta|.
///
/// ```
/// assert_eq!(parops::condition_count(2, 2, 2)?, 9);
/// assert_eq!(parops::condition_count(2, 1, 2)?, 6);
/// # parops::Result::Ok(())
/// ```
///
/// # Errors
/// [`MultiIndexError::Order`] for r = 0; [`MultiIndexError::Count`] where l n, n = dim + |beta| + r - 1, does not fit
/// 128 bits.
///
/// Source: notes 001, eq. 5.39, with errata 20 and 21.
pub fn condition_count(dim: u32, degree: u32, order: u32) -> Result<u128> {
    if order == 0 {
        return Err(MultiIndexError::Order { order, low: 1, high: u32::MAX }.into());
    }
    let too_many = || MultiIndexError::Count { dim, degree, order };
    // C(n, k) = C(n, n - k) stays an integer at each step: C(n, i) = C(n, i - 1) (n - i + 1) / i.
    let k = u128::from(dim);
    let n = k + u128::from(degree) + u128::from(order) - 1;
    let mut count = 1_u128;
    for i in 1..=k.min(n - k) {
        count = count.checked_mul(n - i + 1).ok_or_else(too_many)? / i;
    }
    Ok(count - u128::from(degree.is_multiple_of(2)))
}
