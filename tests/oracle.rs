//! Kernels and moments against tables derived elsewhere.

use parops::{Exchange, MultiIndex, Rational, Term, graded};
use serde_json::Value;

fn table(text: &str) -> Value {
    serde_json::from_str(text).expect("the table is JSON")
}

fn rational(text: &Value) -> Rational {
    let text = text.as_str().expect("rationals are strings");
    let (n, d) = text.split_once('/').unwrap_or((text, "1"));
    Rational::new(n.parse().expect("numerator"), d.parse().expect("denominator")).expect("in range")
}

fn index<const D: usize>(key: &str) -> MultiIndex<D> {
    let exponents: Vec<u8> = key.split(',').map(|n| n.parse().expect("exponent")).collect();
    MultiIndex::new(exponents.try_into().expect("as many exponents as dimensions"))
}

fn terms<const D: usize>(operator: &str) -> Vec<Term<D>> {
    let one = |degrees: &[(usize, u8)]| {
        let mut exponents = [0; D];
        for &(axis, degree) in degrees {
            exponents[axis] = degree;
        }
        Term { index: MultiIndex::new(exponents), factor: 1.0 }
    };
    match operator {
        "identity" => vec![one(&[])],
        "d_dz1" => vec![one(&[(0, 1)])],
        "laplacian" => (0..D).map(|axis| one(&[(axis, 2)])).collect(),
        "d2_dz1dz1" => vec![one(&[(0, 2)])],
        "d2_dz1dz2" => vec![one(&[(0, 1), (1, 1)])],
        other => panic!("unknown operator {other}"),
    }
}

/// Compares one entry of the table and returns how many rationals were compared.
fn compare<const D: usize>(operator: &str, order: u32, entry: &Value) -> usize {
    let kernel = Exchange::<D>::new(&terms(operator), order).expect("kernel");
    let polynomial = kernel.exact().expect("exact");
    let monomials = entry["monomials"].as_object().expect("monomials");
    assert_eq!(polynomial.iter().count(), monomials.len(), "{operator} d{D} r{order}");
    for (key, value) in monomials {
        assert_eq!(polynomial.coefficient(index(key)), rational(value), "{operator} d{D} r{order} z^({key})");
    }
    assert_eq!(kernel.moment(MultiIndex::ZERO).expect("M_0"), rational(&entry["M_0"]), "{operator} d{D} r{order}");
    let leading = entry["leading_error_moments"].as_object().expect("leading_error_moments");
    let degree = terms::<D>(operator)[0].index.degree() + order;
    for alpha in graded::<D>(degree, degree) {
        let key = alpha.exponents().map(|n| n.to_string()).join(",");
        let expected = leading.get(&key).map_or(Rational::ZERO, rational);
        assert_eq!(kernel.moment(alpha).expect("moment"), expected, "{operator} d{D} r{order} M_({key})");
    }
    monomials.len() + 1 + leading.len()
}

#[test]
fn exchange_kernels_equal_every_full_space_entry_exactly() {
    let table = table(include_str!("data/pse_kernels.json"));
    let mut entries = 0;
    for (operator, kernels) in table["full_space"].as_object().expect("full_space") {
        for (key, entry) in kernels.as_object().expect("kernels") {
            let (dim, order) = key.split_once("_r").expect("d?_r?");
            let order = order.parse().expect("order");
            let compared = match dim {
                "d1" => compare::<1>(operator, order, entry),
                "d2" => compare::<2>(operator, order, entry),
                "d3" => compare::<3>(operator, order, entry),
                other => panic!("unknown dimension {other}"),
            };
            assert!(compared >= 3);
            entries += 1;
        }
    }
    // Four operators in three dimensions and the mixed derivative in two, four orders each.
    assert_eq!(entries, (4 * 3 + 2) * 4);
}
