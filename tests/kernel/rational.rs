//! Exact rational numbers: arithmetic, order, rounding to doubles.

use crate::cases::cases;
use crate::properties::properties;
use parops::Rational;
use proptest::prelude::*;

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn rational_arithmetic_agrees_with_integers(a in -1000_i128..1000, b in 1_i128..1000, c in -1000_i128..1000, d in 1_i128..1000) {
        let (x, y) = (Rational::new(a, b).expect("b > 0"), Rational::new(c, d).expect("d > 0"));
        prop_assert_eq!(x.checked_add(y), Rational::new(a * d + c * b, b * d));
        prop_assert_eq!(x.checked_mul(y), Rational::new(a * c, b * d));
        prop_assert_eq!(x.checked_div(y), if c == 0 { None } else { Rational::new(a * d, b * c) });
        prop_assert_eq!(x.cmp(&y), (a * d).cmp(&(c * b)));
        // Both operands are exact, so that the quotient of two doubles is the nearest double.
        prop_assert_eq!(x.to_f64(), a as f64 / b as f64);
    }

    #[test]
    fn rational_of_a_double_is_that_double(x in -1e9..1e9_f64, shift in -60_i32..30) {
        let x = x * 2.0_f64.powi(shift);
        if let Some(exact) = Rational::from_f64(x) {
            prop_assert_eq!(exact.to_f64(), x);
        }
    }

    #[test]
    fn rational_rounds_to_the_nearest_double(n in any::<i128>(), d in 1..i128::MAX) {
        let exact = Rational::new(n, d).unwrap_or(Rational::ZERO);
        let x = exact.to_f64();
        // Where the double and its neighbors are fractions in range, none of them is nearer.
        if let Some(error) = distance(exact, x) {
            for other in [x.next_up(), x.next_down()] {
                if let Some(other) = distance(exact, other) {
                    prop_assert!(error <= other);
                }
            }
        }
    }
}

fn distance(exact: Rational, x: f64) -> Option<Rational> {
    let difference = exact.checked_add(Rational::from_f64(-x)?)?;
    Rational::new(difference.numerator().checked_abs()?, difference.denominator())
}

#[test]
fn rational_overflow_and_division_by_zero_give_none() {
    let (huge, tiny) = (Rational::integer(i128::MAX), Rational::new(1, i128::MAX).expect("in range"));
    assert_eq!(huge.checked_add(Rational::ONE), None);
    assert_eq!(huge.checked_mul(huge), None);
    assert_eq!(tiny.checked_mul(tiny), None);
    assert_eq!(huge.checked_mul(tiny), Some(Rational::ONE));
    assert_eq!(Rational::ONE.checked_div(Rational::ZERO), None);
    assert_eq!(Rational::new(1, 0), None);
    assert_eq!(Rational::new(i128::MIN, -1), None);
    assert_eq!(Rational::new(i128::MIN, 1), None);
    assert_eq!(Rational::new(i128::MIN, 2), Some(Rational::integer(i128::MIN / 2)));
    for x in [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE] {
        assert_eq!(Rational::from_f64(x), None);
    }
    let power = |e: i32| Rational::from_f64(2.0_f64.powi(e));
    assert_eq!([power(126), power(-126)], [Some(Rational::integer(1 << 126)), Rational::new(1, 1 << 126)]);
    assert_eq!([power(127), power(-127)], [None; 2]);
    assert!(tiny < Rational::ONE && Rational::integer(-1) < tiny && tiny < huge);
    assert_eq!(Rational::new(-6, 4).map(|x| x.to_string()), Some("-3/2".into()));
    // A zero has no sign.
    assert_eq!([Rational::new(0, -5), Rational::from_f64(-0.0)], [Some(Rational::ZERO); 2]);
    assert_eq!(Rational::ZERO.to_f64().to_bits(), 0.0_f64.to_bits());
}

#[test]
fn rational_beside_a_tie_of_doubles_rounds_away_from_it() {
    // 53 bits, a half in the next, and what lies 11 bits lower or behind a third.
    for (even, up) in [(1_i128 << 52, false), ((1 << 52) + 1, true)] {
        let tie = 3 * ((even << 12) + (1 << 11));
        let found = |n: i128| Rational::new(n, 3).expect("in range").to_f64();
        let nearest = |up: bool| ((even + i128::from(up)) << 12) as f64;
        assert_eq!([found(tie), found(-tie)], [nearest(up), -nearest(up)]);
        for above in [1, 3, 4] {
            assert_eq!([found(tie + above), found(tie - above)], [nearest(true), nearest(false)], "{above}");
        }
    }
}

#[test]
fn integers_are_rationals_without_a_denominator_to_see() {
    let parts = |x: Rational| (x.numerator(), x.denominator(), x.to_string());
    assert_eq!(parts(Rational::from(-7)), (-7, 1, String::from("-7")));
    assert_eq!(parts(Rational::new(6, -4).expect("no zero")), (-3, 2, String::from("-3/2")));
}
