//! All monomials of a point by one multiplication each, in runs that lie one after another in memory.

use std::cmp::Reverse;

use super::nodes::{GROUP, Group};
use crate::lanes::{Lanes, Vectors, Work};
use crate::multi_index::{MultiIndex, graded};

/// The monomials z^alpha with |alpha| <= a degree, in graded order.
///
/// Those of degree d that contain the first axis are that axis times all of degree d - 1, in the same order; those that
/// do not, but contain the second, are that axis times the end of degree d - 1; and so on. So D runs make a degree.
#[derive(Clone, Debug)]
pub(super) struct Monomials<const D: usize> {
    indices: Vec<MultiIndex<D>>,
    runs: Vec<Run>,
}

/// `len` monomials from `child` on are z_axis times those from `parent` on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    axis: usize,
    parent: usize,
    child: usize,
    len: usize,
}

impl<const D: usize> Monomials<D> {
    pub(super) fn up_to(degree: u32) -> Self {
        let indices: Vec<MultiIndex<D>> = graded(0, degree).collect();
        let (mut runs, mut child) = (Vec::new(), 1);
        let mut previous = 0..1;
        for _ in 0..degree {
            let first = child;
            for axis in 0..D {
                let free = |&i: &usize| indices[i].exponents()[..axis].iter().all(|&exponent| exponent == 0);
                let parent = previous.clone().find(free).unwrap_or(previous.end);
                let len = previous.end - parent;
                runs.push(Run { axis, parent, child, len });
                child += len;
            }
            previous = first..child;
        }
        Self { indices, runs }
    }

    /// Their number.
    pub(super) fn len(&self) -> usize {
        self.indices.len()
    }

    /// The runs that make those up to a degree from the constant.
    #[inline(always)]
    pub(super) fn runs(&self, degree: usize) -> &[Run] {
        &self.runs[..degree * D]
    }

    /// Where z^alpha stands, 0 if it does not.
    pub(super) fn position(&self, alpha: &MultiIndex<D>) -> usize {
        let key = |alpha: &MultiIndex<D>| (alpha.degree(), Reverse(alpha.exponents()));
        self.indices.binary_search_by_key(&key(alpha), key).unwrap_or(0)
    }
}

/// Multiplies powers[0] = c out to c z^alpha, and adds these to the sums over the neighbors.
///
/// Called out of line: among the variables of its callers the places would not stay in registers, at a cost of 10 %.
pub(super) struct AddPowers<'a, const L: usize> {
    pub(super) runs: &'a [Run],
    pub(super) places: &'a [Group<L>],
    pub(super) powers: &'a mut [Group<L>],
    pub(super) sums: &'a mut [Lanes<L>],
}

impl<const L: usize> Work for AddPowers<'_, L> {
    type Out = ();

    #[inline(always)]
    fn run<V: Vectors>(self, _: V) {
        let Self { runs, places, powers, sums } = self;
        sums[0] = powers[0].iter().fold(sums[0], |sum, &power| sum + power);
        for run in runs {
            let z = places[run.axis];
            let (parents, children) = powers.split_at_mut(run.child);
            let parents = &parents[run.parent..][..run.len];
            let (children, sums) = (&mut children[..run.len], &mut sums[run.child..][..run.len]);
            for ((parent, child), sum) in parents.iter().zip(children).zip(sums) {
                let mut total = *sum;
                for q in 0..GROUP {
                    child[q] = parent[q] * z[q];
                    total += child[q];
                }
                *sum = total;
            }
        }
    }
}

/// sum_alpha a_alpha z^alpha.
#[inline(always)]
pub(super) fn polynomial<const L: usize>(
    runs: &[Run],
    places: &[Group<L>],
    a: &[Lanes<L>],
    powers: &mut [Group<L>],
) -> Group<L> {
    powers[0] = [Lanes::ONE; GROUP];
    let mut values = [a[0]; GROUP];
    for run in runs {
        let z = places[run.axis];
        let (parents, children) = powers.split_at_mut(run.child);
        let parents = &parents[run.parent..][..run.len];
        let (children, a) = (&mut children[..run.len], &a[run.child..][..run.len]);
        for ((parent, child), &a) in parents.iter().zip(children).zip(a) {
            for q in 0..GROUP {
                child[q] = parent[q] * z[q];
                values[q] += child[q] * a;
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::widest;

    #[test]
    fn runs_make_every_monomial_in_graded_order() {
        fn check<const D: usize>(degree: u32) {
            let monomials = Monomials::<D>::up_to(degree);
            let z: [f64; D] = std::array::from_fn(|axis| [2.0, 3.0, 5.0, 7.0][axis]);
            let places = z.map(|z| [Lanes([z]); GROUP]);
            let mut powers = vec![[Lanes::ONE; GROUP]; monomials.len()];
            let mut sums = vec![Lanes::ZERO; monomials.len()];
            let runs = monomials.runs(degree as usize);
            widest(AddPowers { runs, places: &places, powers: &mut powers, sums: &mut sums });
            // Different primes: every value belongs to one multi-index.
            for (i, alpha) in graded::<D>(0, degree).enumerate() {
                assert_eq!(powers[i], [Lanes([alpha.power(&z)]); GROUP], "{alpha}");
                assert_eq!(sums[i], Lanes([GROUP as f64 * alpha.power(&z)]), "{alpha}");
                assert_eq!(monomials.position(&alpha), i);
            }
            let a: Vec<_> = (0..monomials.len()).map(|i| Lanes([i as f64])).collect();
            let expected: f64 = graded::<D>(0, degree).enumerate().map(|(i, alpha)| i as f64 * alpha.power(&z)).sum();
            let found = polynomial(monomials.runs(degree as usize), &places, &a, &mut powers);
            assert_eq!(found, [Lanes([expected]); GROUP]);
        }
        check::<1>(9);
        check::<2>(7);
        check::<3>(6);
        check::<4>(3);
    }
}
