//! Domains: legal boxes, wrapping by the last bit, what is refused.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    BruteForce, CellList, Cutoff, Domain, DomainError, Error, Face, LENGTH_HIGH, LENGTH_LOW, Neighbors, Particles,
    testing::Promise,
};
use proptest::prelude::*;

fn interval(lower: f64, upper: f64, faces: [Face; 2]) -> parops::Result<Domain<1>> {
    Domain::new([lower], [upper], [faces])
}

#[test]
fn faces_out_of_order_or_not_numbers_are_refused() {
    for (lower, upper) in [(1.0, 1.0), (2.0, 1.0), (f64::INFINITY, f64::INFINITY)] {
        let error = interval(lower, upper, [Face::Open; 2]).unwrap_err();
        assert_eq!(error, Error::from(DomainError::Faces { axis: 0, lower, upper }));
    }
    for (lower, upper) in [(f64::NAN, 1.0), (0.0, f64::NAN)] {
        let error = interval(lower, upper, [Face::Periodic; 2]).unwrap_err();
        assert!(format!("{error}").contains("NaN"), "{error}");
    }
}

#[test]
fn only_open_faces_lie_at_infinity() {
    let inf = f64::INFINITY;
    assert!(interval(0.0, inf, [Face::MirrorEven, Face::Open]).is_ok());
    assert!(interval(-inf, inf, [Face::Open, Face::Open]).is_ok());
    for (lower, upper, faces) in [
        (0.0, inf, [Face::Open, Face::MirrorOdd]),
        (-inf, 0.0, [Face::MirrorEven, Face::Open]),
        (0.0, inf, [Face::Periodic, Face::Periodic]),
    ] {
        let error = interval(lower, upper, faces).unwrap_err();
        assert_eq!(error, Error::from(DomainError::Unbounded { axis: 0, lower, upper }));
    }
}

#[test]
fn half_periodic_axes_are_refused() {
    for faces in [[Face::Periodic, Face::Open], [Face::MirrorEven, Face::Periodic]] {
        let error = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2], faces]).unwrap_err();
        assert_eq!(error, Error::from(DomainError::HalfPeriodic { axis: 1 }));
    }
}

#[test]
fn widths_beyond_the_arithmetic_are_refused() {
    for width in [1e-300, 1e300] {
        let error = interval(0.0, width, [Face::Open; 2]).unwrap_err();
        assert_eq!(error, Error::from(DomainError::Width { axis: 0, width, low: LENGTH_LOW, high: LENGTH_HIGH }));
    }
    assert!(interval(0.0, LENGTH_LOW, [Face::Periodic; 2]).is_ok());
    assert!(interval(0.0, LENGTH_HIGH, [Face::Periodic; 2]).is_ok());
}

#[test]
fn closed_axes_below_two_cutoffs_are_refused() {
    use Face::{MirrorEven, MirrorOdd, Open, Periodic};
    let particles = Particles::new(vec![[0.5]]).unwrap();
    // Beyond the 4 eps that are taken for round-off.
    let cutoff = 0.5 * (1.0 + 6.0 * f64::EPSILON);
    for faces in [[Periodic, Periodic], [MirrorEven, MirrorOdd], [MirrorOdd, MirrorOdd]] {
        let domain = interval(0.0, 1.0, faces).unwrap();
        let expected = Error::from(DomainError::Narrow { axis: 0, width: 1.0, cutoff });
        assert_eq!(CellList::build(&particles, &domain, Cutoff(cutoff)).unwrap_err(), expected);
        assert_eq!(BruteForce::build(&particles, &domain, Cutoff(cutoff)).unwrap_err(), expected);
        for cutoff in [0.5, 0.5 * (1.0 + 4.0 * f64::EPSILON)] {
            assert!(CellList::build(&particles, &domain, Cutoff(cutoff)).is_ok());
        }
    }
    for faces in [[MirrorEven, Open], [Open, MirrorOdd], [Open, Open]] {
        let domain = interval(0.0, 1.0, faces).unwrap();
        assert!(CellList::build(&particles, &domain, Cutoff(7.0)).is_ok());
    }
}

#[test]
fn particles_outside_closed_or_open_faces_are_named() {
    let domain = Domain::new([0.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorEven, Face::Open]]).unwrap();
    for coordinate in [1.0_f64.next_up(), -5e-324, 2.0] {
        let points = vec![[7.0, 0.5], [-3.0, coordinate]];
        let particles = Particles::new(points.clone()).unwrap();
        let kind = DomainError::Outside { axis: 1, coordinate, lower: 0.0, upper: 1.0 };
        let error = CellList::build(&particles, &domain, Cutoff(0.1)).unwrap_err();
        assert_eq!((error, particles.points()), (Error::from(kind).at(1), &points[..]));
    }
    assert_eq!(domain.wrap(&[7.5, 1.0]), Ok([0.5, 1.0]));
    assert!(domain.wrap(&[f64::INFINITY, 0.5]).is_err());
    assert!(domain.wrap(&[0.5, f64::NAN]).is_err());
}

#[test]
fn wrapping_never_reaches_the_upper_face() {
    let unit = interval(0.0, 1.0, [Face::Periodic; 2]).unwrap();
    for (x, wrapped) in [(-1e-17, 0.0), (1.0, 0.0), (-5e-324, 0.0), (-0.25, 0.75), (3.25, 0.25), (-1.0, 0.0)] {
        assert_eq!(unit.wrap(&[x]), Ok([wrapped]), "{x:e}");
    }
    let below_one = 1.0_f64.next_down();
    assert_eq!(unit.wrap(&[below_one]), Ok([below_one]));
    let shifted = interval(1.0, 2.0, [Face::Periodic; 2]).unwrap();
    let wrapped = shifted.wrap(&[below_one]).unwrap()[0];
    assert!((1.0..2.0).contains(&wrapped), "{wrapped:e}");
}

#[test]
fn particles_one_ulp_around_a_periodic_face_meet_across_it() {
    // Both sides of the face, all within a few ulp of one point of the ring: each sees all the others.
    let points: Vec<[f64; 1]> =
        [0.0, 5e-324, -5e-324, 1.0, 1.0_f64.next_down(), 1.0_f64.next_up(), -1e-17].map(|x| [x]).to_vec();
    let particles = Particles::new(points.clone()).unwrap();
    let ring = Domain::periodic([0.0], [1.0]).unwrap();
    let cells = CellList::build(&particles, &ring, Cutoff(0.25)).unwrap();
    for p in 0..points.len() {
        let meet = Promise::new("Neighbor lists", "particles one ulp around a periodic face meet across it");
        meet.equal(&cells.count(p, 4.0 * f64::EPSILON), &(points.len() - 1));
    }
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn wrapped_coordinates_lie_in_the_box_and_stay_there(
        lower in -1e3_f64..1e3,
        width in 1e-3_f64..1e3,
        periods in -3_i32..4,
        ulps in -2_i64..3,
        inside in 0.0_f64..1.0,
        at_face: bool,
    ) {
        let upper = lower + width;
        let domain = interval(lower, upper, [Face::Periodic; 2]).unwrap();
        let place = if at_face { 0.0 } else { inside };
        let mut x = lower + (place + f64::from(periods)) * width;
        for _ in 0..ulps.abs() {
            x = if ulps > 0 { x.next_up() } else { x.next_down() };
        }
        let [wrapped] = domain.wrap(&[x]).unwrap();
        Promise::new("Neighbor lists", "wrapped coordinates lie in the half-open box").holds(lower <= wrapped && wrapped < upper);
        prop_assert_eq!(domain.wrap(&[wrapped]), Ok([wrapped]));
        // Up to rounding of the sums above and in the wrap, each of at most 4 times the largest number.
        let tolerance = 16.0 * f64::EPSILON * (lower.abs() + 4.0 * width);
        let shift = (x - wrapped) / width;
        prop_assert!((shift - shift.round()).abs() * width <= tolerance, "{x:e} to {wrapped:e}");
    }
}
