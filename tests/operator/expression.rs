//! Typed operator expressions and the run-time expression are the same terms, bit for bit.

use std::fmt::{Debug, Display};

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Along, AlongTwice, Beta, BiLaplacian, D1, D2, D3, Divergence, ErrorKind, Expression, Gradient, Hessian,
    Homogeneous, Laplacian, MultiIndex, MultiIndexError, Operator, Outputs, Plus, Times,
};
use proptest::prelude::*;
use typenum::{U0, U1, U2, Unsigned, tarr};

/// Output, exponents, bits of the factor.
type Bits<const D: usize> = (usize, [u8; D], u64);

fn bits<const D: usize>(operator: &impl Operator<D>) -> Vec<Bits<D>> {
    let mut found = Vec::new();
    operator.terms(&mut |output, index, factor| found.push((output, index.exponents(), factor.to_bits())));
    found
}

fn expression<const D: usize>(terms: &[([u8; D], f64)]) -> Expression<D> {
    Expression::new(terms.iter().map(|&(exponents, factor)| (MultiIndex::new(exponents), factor))).unwrap()
}

/// A typed scalar expression against the terms it should have: values, degree, and what is shown.
fn same<Op, const D: usize>(typed: Op, terms: &[([u8; D], f64)])
where
    Op: Operator<D, Out = [f64; 1]> + Homogeneous + Display + Debug + Copy,
{
    let at_run_time = expression(terms);
    assert_eq!(bits(&typed), bits(&at_run_time), "{typed}");
    assert_eq!(<Op::Degree as Unsigned>::U32, at_run_time.degree(), "{typed}");
    assert_eq!(Expression::of(&typed).unwrap(), at_run_time);
    assert_eq!(typed.to_string(), at_run_time.to_string());
    assert_eq!(format!("{typed:?}"), at_run_time.to_string());
}

#[test]
fn single_derivatives_have_one_term_in_one_to_six_dimensions() {
    same(D1::<3>::default(), &[([3], 1.0)]);
    same(D2::<2, 1>::default(), &[([2, 1], 1.0)]);
    same(D3::<1, 0, 2>::default(), &[([1, 0, 2], 1.0)]);
    same(Beta::<tarr![U1, U0, U2, U0]>::default(), &[([1, 0, 2, 0], 1.0)]);
    same(Beta::<tarr![U0, U0, U2, U0, U1]>::default(), &[([0, 0, 2, 0, 1], 1.0)]);
    same(Beta::<tarr![U2, U0, U0, U0, U0, U2]>::default(), &[([2, 0, 0, 0, 0, 2], 1.0)]);
    same(D2::<0, 0>::default(), &[([0, 0], 1.0)]);
}

#[test]
fn named_operators_have_the_terms_of_their_formula() {
    same(Laplacian::<1>, &[([2], 1.0)]);
    same(Laplacian::<3>, &[([2, 0, 0], 1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0)]);
    same(Along([0.5, -2.0]), &[([1, 0], 0.5), ([0, 1], -2.0)]);
    same(AlongTwice([0.5, -2.0]), &[([2, 0], 0.25), ([1, 1], -2.0), ([0, 2], 4.0)]);
    same(BiLaplacian::<1>, &[([4], 1.0)]);
    let pairs = [([2, 2, 0], 2.0), ([2, 0, 2], 2.0), ([0, 4, 0], 1.0), ([0, 2, 2], 2.0), ([0, 0, 4], 1.0)];
    same(BiLaplacian::<3>, &[&[([4, 0, 0], 1.0)], &pairs[..]].concat());
    same(
        Laplacian::<2> + AlongTwice([1.0, 2.0]),
        &[([2, 0], 1.0), ([0, 2], 1.0), ([2, 0], 1.0), ([1, 1], 4.0), ([0, 2], 4.0)],
    );
    let hessian = [(0, [2, 0], 1.0_f64), (1, [1, 1], 1.0), (2, [0, 2], 1.0)];
    assert_eq!(bits(&Hessian::<2>), hessian.map(|(output, index, factor)| (output, index, factor.to_bits())));
    assert_eq!(
        (2.0 * Hessian::<3>).to_string(),
        "2 (D^(2,0,0), D^(1,1,0), D^(1,0,1), D^(0,2,0), D^(0,1,1), D^(0,0,2))"
    );
    let gradient = [(0, [1, 0, 0], 1.0_f64), (1, [0, 1, 0], 1.0), (2, [0, 0, 1], 1.0)];
    assert_eq!(bits(&Gradient::<3>), gradient.map(|(output, index, factor)| (output, index, factor.to_bits())));
    assert_eq!(bits(&Divergence::<3>::default()), bits(&Gradient::<3>));
}

#[test]
fn sums_differences_and_multiples_have_the_terms_of_both_sides() {
    let (xx, xy, yy) = (D2::<2, 0>::default(), D2::<1, 1>::default(), D2::<0, 2>::default());
    same(xx + yy, &[([2, 0], 1.0), ([0, 2], 1.0)]);
    same(xx + 3.0 * yy, &[([2, 0], 1.0), ([0, 2], 3.0)]);
    same(xx * 3.0 + yy, &[([2, 0], 3.0), ([0, 2], 1.0)]);
    same(xx - yy, &[([2, 0], 1.0), ([0, 2], -1.0)]);
    same(-xx - 2.0 * yy, &[([2, 0], -1.0), ([0, 2], -2.0)]);
    same(-(xx + yy) * 0.1, &[([2, 0], -0.1), ([0, 2], -0.1)]);
    same((xx + yy) + (xy + xy), &[([2, 0], 1.0), ([0, 2], 1.0), ([1, 1], 1.0), ([1, 1], 1.0)]);
    same((xx + yy) - (xy - yy), &[([2, 0], 1.0), ([0, 2], 1.0), ([1, 1], -1.0), ([0, 2], 1.0)]);
    same(xx + (yy + xy), &[([2, 0], 1.0), ([0, 2], 1.0), ([1, 1], 1.0)]);
    same(0.5 * (xx + 3.0 * yy), &[([2, 0], 0.5), ([0, 2], 1.5)]);
    same(Laplacian::<2> + 0.25 * xy, &[([2, 0], 1.0), ([0, 2], 1.0), ([1, 1], 0.25)]);
    same(0.25 * xy + Laplacian::<2>, &[([1, 1], 0.25), ([2, 0], 1.0), ([0, 2], 1.0)]);
    same(2.0 * Laplacian::<2> - Laplacian::<2> * 3.0, &[([2, 0], 2.0), ([0, 2], 2.0), ([2, 0], -3.0), ([0, 2], -3.0)]);
    same(D2::<1, 0>::default() + Along([0.0, 2.0]), &[([1, 0], 1.0), ([1, 0], 0.0), ([0, 1], 2.0)]);
    same(-Along([1.0, 2.0]) + 4.0 * Along([0.5, 0.5]), &[([1, 0], -1.0), ([0, 1], -2.0), ([1, 0], 2.0), ([0, 1], 2.0)]);
    same(0.0 * xx, &[([2, 0], 0.0)]);
}

#[test]
fn deep_nesting_in_three_and_four_dimensions_keeps_every_term() {
    let (xxy, zzz, xyz) = (D3::<2, 1, 0>::default(), D3::<0, 0, 3>::default(), D3::<1, 1, 1>::default());
    same(
        2.0 * (xxy - 3.0 * (zzz + (xyz - 0.5 * (xxy + zzz)))) + xyz,
        &[([2, 1, 0], 2.0), ([0, 0, 3], -6.0), ([1, 1, 1], -6.0), ([2, 1, 0], 3.0), ([0, 0, 3], 3.0), ([1, 1, 1], 1.0)],
    );
    let (first, last) = (Beta::<tarr![U2, U0, U0, U0]>::default(), Beta::<tarr![U0, U0, U1, U1]>::default());
    same(first + last * 7.0, &[([2, 0, 0, 0], 1.0), ([0, 0, 1, 1], 7.0)]);
}

#[test]
fn vector_operators_add_output_by_output() {
    let sum = Gradient::<2> + 2.0 * Gradient::<2> - Gradient::<2>;
    let expected = [
        (0, [1, 0], 1.0_f64),
        (1, [0, 1], 1.0),
        (0, [1, 0], 2.0),
        (1, [0, 1], 2.0),
        (0, [1, 0], -1.0),
        (1, [0, 1], -1.0),
    ];
    assert_eq!(bits(&sum), expected.map(|(output, index, factor)| (output, index, factor.to_bits())));
    fn outputs<Op: Operator<2>>(_: &Op) -> usize {
        Op::Out::K
    }
    assert_eq!((outputs(&sum), outputs(&Laplacian::<2>)), (2, 1));
    assert_eq!(sum.to_string(), "(D^(1,0), D^(0,1)) + 2 (D^(1,0), D^(0,1)) - (D^(1,0), D^(0,1))");
}

#[test]
fn named_sum_is_made_without_a_value() {
    type Mixed = Plus<Laplacian<2>, Plus<D2<1, 1>, D2<2, 0>>>;
    same(Mixed::default(), &[([2, 0], 1.0), ([0, 2], 1.0), ([1, 1], 1.0), ([2, 0], 1.0)]);
    assert_eq!(std::mem::size_of::<Mixed>(), 0);
    assert_eq!(std::mem::size_of::<Times<Mixed>>(), std::mem::size_of::<f64>());
}

#[test]
fn display_reads_as_a_formula() {
    let (xx, yy) = (D2::<2, 0>::default(), D2::<0, 2>::default());
    assert_eq!((xx + 3.0 * yy).to_string(), "D^(2,0) + 3 D^(0,2)");
    assert_eq!((-xx - 0.5 * yy).to_string(), "-D^(2,0) - 0.5 D^(0,2)");
    assert_eq!((2.0 * (xx + yy)).to_string(), "2 D^(2,0) + 2 D^(0,2)");
    assert_eq!((xx - (yy - xx)).to_string(), "D^(2,0) - D^(0,2) + D^(2,0)");
    assert_eq!(format!("{:?}", Laplacian::<2>), "D^(2,0) + D^(0,2)");
    assert_eq!(Gradient::<1>.to_string(), "(D^(1))");
    assert_eq!((0.0 * xx).to_string(), "0 D^(2,0)");
    assert_eq!(expression(&[([2, 0], -1.0), ([1, 1], -2.5)]).to_string(), "-D^(2,0) - 2.5 D^(1,1)");
}

fn refused<const D: usize>(terms: &[([u8; D], f64)]) -> ErrorKind {
    let terms = terms.iter().map(|&(exponents, factor)| (MultiIndex::new(exponents), factor));
    Expression::new(terms).unwrap_err().kind().clone()
}

#[test]
fn run_time_sum_of_unequal_degree_or_no_terms_is_refused() {
    let unequal = MultiIndexError::UnequalDegree { first: 2, other: 1 };
    assert_eq!(refused(&[([2, 0], 1.0), ([0, 1], 1.0)]), ErrorKind::MultiIndex(unequal));
    assert_eq!(refused::<2>(&[]), ErrorKind::MultiIndex(MultiIndexError::Empty { output: 0 }));
}

#[test]
fn factors_that_are_not_finite_are_refused_at_run_time() {
    for factor in [f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(
            refused(&[([1, 0], 1.0), ([0, 1], factor)]),
            ErrorKind::MultiIndex(MultiIndexError::Factor { factor })
        );
    }
    let of_nan =
        |kind: &ErrorKind| matches!(kind, ErrorKind::MultiIndex(MultiIndexError::Factor { factor }) if factor.is_nan());
    assert!(of_nan(&refused(&[([1, 0], f64::NAN)])));
    // Also where the factor arises from typed ones: 0 times infinity, and an overflow.
    let indefinite = Expression::of(&(0.0 * (f64::INFINITY * Laplacian::<2>))).unwrap_err();
    assert!(of_nan(indefinite.kind()));
    let overflow = Expression::of(&(f64::MAX * (2.0 * Laplacian::<2>))).unwrap_err();
    assert_eq!(*overflow.kind(), ErrorKind::MultiIndex(MultiIndexError::Factor { factor: f64::INFINITY }));
}

/// An operator of a user's own.
struct Own(&'static [(usize, [u8; 2], f64)]);

impl Operator<2> for Own {
    type Out = [f64; 1];

    fn terms(&self, term: &mut dyn FnMut(usize, MultiIndex<2>, f64)) {
        self.0.iter().for_each(|&(output, exponents, factor)| term(output, MultiIndex::new(exponents), factor));
    }
}

#[test]
fn foreign_operator_is_lowered_or_refused_with_its_numbers() {
    let own = Own(&[(0, [2, 0], 1.0), (0, [1, 1], -4.0)]);
    assert_eq!(Expression::of(&own).unwrap(), expression(&[([2, 0], 1.0), ([1, 1], -4.0)]));
    let kind = |own: Own| Expression::of(&own).unwrap_err().kind().clone();
    let no_such_output = MultiIndexError::Output { output: 3, outputs: 1 };
    assert_eq!(kind(Own(&[(0, [2, 0], 1.0), (3, [2, 0], 1.0)])), ErrorKind::MultiIndex(no_such_output));
    assert_eq!(kind(Own(&[])), ErrorKind::MultiIndex(MultiIndexError::Empty { output: 0 }));
    let unequal = MultiIndexError::UnequalDegree { first: 2, other: 0 };
    assert_eq!(kind(Own(&[(0, [2, 0], 1.0), (0, [0, 0], 1.0)])), ErrorKind::MultiIndex(unequal));
}

#[test]
fn outputs_are_converted_value_by_value() {
    let values = [1.5, -0.1, 1e300];
    assert_eq!(values.map(|x| x as f32), Outputs::map(&values, |x| x as f32));
    let mut zero = <[f64; 3]>::ZERO;
    zero.as_mut_slice()[1] = 2.0;
    assert_eq!((zero.as_slice(), <[f64; 3]>::K), ([0.0, 2.0, 0.0].as_slice(), 3));
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn factors_reach_the_terms_with_the_bits_of_their_product(a in any::<f64>(), b in any::<f64>(), c in any::<f64>()) {
        prop_assume!((b * c).is_finite() && (b * (a * c)).is_finite());
        let typed = b * (a * (c * D2::<2, 0>::default()) + c * D2::<1, 1>::default());
        // Multiplied from the derivative outward.
        let at_run_time = Expression::new([
            (MultiIndex::new([2, 0]), b * (a * c)),
            (MultiIndex::new([1, 1]), b * c),
        ]).unwrap();
        prop_assert_eq!(bits(&typed), bits(&at_run_time));
        prop_assert_eq!(bits(&Expression::of(&typed).unwrap()), bits(&at_run_time));
    }

    #[test]
    fn run_time_expression_keeps_its_terms_or_names_the_first_that_differs(
        terms in prop::collection::vec((prop::array::uniform3(0_u8..3), -1e3..1e3_f64), 1..8),
    ) {
        let degree = |exponents: &[u8; 3]| exponents.iter().map(|&e| u32::from(e)).sum::<u32>();
        let first = degree(&terms[0].0);
        match terms.iter().map(|(exponents, _)| degree(exponents)).find(|&other| other != first) {
            Some(other) => prop_assert_eq!(
                refused(&terms),
                ErrorKind::MultiIndex(MultiIndexError::UnequalDegree { first, other })
            ),
            None => {
                let kept = expression(&terms);
                let expected: Vec<_> = terms.iter().map(|&(exponents, factor)| (0, exponents, factor.to_bits())).collect();
                prop_assert_eq!((kept.degree(), bits(&kept)), (first, expected));
            }
        }
    }
}
