//! DC-PSE in all its forms keeps the promises of a method, and is exact to the degree it names, by the checkers.

use parops::testing::{MethodFault, Promise, check_method, check_method_moments};
use parops::{
    CellList, Cutoff, D2, D3, DcPse, Domain, Epsilon, Face, Gradient, Laplacian, Nearest, Neighbors, Operator,
    Particles, Qr, Sign, Window,
};

/// What moments of rows may miss in units of their absolute terms: 16 l eps cond with l to 55 and cond to 1e5 would be
/// 2e-8; the certificate holds every row to 30 l eps.
const MOMENTS: f64 = 30.0 * 56.0 * f64::EPSILON;

fn keeps<const D: usize, const K: usize, Op: Operator<D, Out = [f64; K]> + Clone>(
    operator: Op,
    degree: u32,
    order: u32,
    neighbors: &impl Neighbors<D>,
) {
    let dcpse = DcPse::at_order(operator.clone(), order).unwrap();
    let passes = |dcpse: &DcPse<Op>| {
        Promise::new("Conformance", "DC-PSE of either sign, with either window, passes the checker of methods")
            .equal(&check_method(dcpse, neighbors), &Ok(()));
    };
    for sign in [Sign::Plus, Sign::Minus] {
        let dcpse = dcpse.clone().sign(sign);
        passes(&dcpse);
        let exact_to = degree + order - 1;
        Promise::new(
            "Conformance",
            "DC-PSE has the moments of its operator to r - 1 above its degree, and not the next",
        )
        .equal(&check_method_moments(&dcpse, neighbors, &operator, exact_to, MOMENTS), &Ok(()));
        let beyond = check_method_moments(&dcpse, neighbors, &operator, exact_to + 1, MOMENTS);
        assert!(matches!(beyond, Err(MethodFault::Moment { alpha, .. }) if alpha.degree() == exact_to + 1));
    }
    passes(&dcpse.clone().window(Window::Wendland));
    passes(&dcpse.clone().impose_zeroth());
    // A solver is a type of its own.
    assert_eq!(check_method(&dcpse.solver(Qr), neighbors), Ok(()));
}

#[test]
fn promises_hold_on_scattered_sets_in_the_plane() {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 2).unwrap();
    let nearest = |k: usize| Nearest::build(&particles, &Domain::open(), k).unwrap();
    keeps(Laplacian::<2>, 2, 2, &nearest(24));
    keeps(Laplacian::<2>, 2, 4, &nearest(48));
    keeps(Gradient::<2>, 1, 3, &nearest(26));
    keeps(D2::<1, 1>::default(), 2, 3, &nearest(36));
    keeps(D2::<2, 1>::default(), 3, 1, &nearest(26));
    keeps(D2::<2, 2>::default(), 4, 2, &nearest(48));
    keeps(D2::<0, 0>::default(), 0, 2, &nearest(12));
}

#[test]
fn promises_hold_in_space_and_with_one_cutoff_for_all() {
    let particles = Particles::jittered([0.0; 3], [1.0; 3], [6; 3], 0.3, 2).unwrap();
    let nearest = |k: usize| Nearest::build(&particles, &Domain::open(), k).unwrap();
    keeps(Laplacian::<3>, 2, 2, &nearest(45));
    keeps(Gradient::<3>, 1, 2, &nearest(24));
    let one = DcPse::<Laplacian<3>, 2>::new().impose_zeroth().cutoff(&particles).unwrap();
    keeps(Laplacian::<3>, 2, 2, &CellList::build(&particles, &Domain::open(), one).unwrap());
    keeps(D3::<1, 1, 1>::default(), 3, 1, &nearest(60));
}

#[test]
fn promises_hold_behind_mirrors_and_across_periodic_faces() {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 4).unwrap();
    let faces = [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]];
    let domain = Domain::new([0.0; 2], [1.0; 2], faces).unwrap();
    let neighbors = Nearest::build(&particles, &domain, 24).unwrap();
    for sign in [Sign::Plus, Sign::Minus] {
        assert_eq!(check_method(&DcPse::<Gradient<2>, 2>::new().sign(sign), &neighbors), Ok(()));
    }
    assert_eq!(check_method(&DcPse::<Laplacian<2>, 2>::new(), &neighbors), Ok(()));
    let each = Epsilon::each((0..144).map(|p| neighbors.cutoff(p) / (2.0 + 1e-3 * p as f64)).collect()).unwrap();
    assert_eq!(check_method(&DcPse::<Laplacian<2>, 2>::new().epsilon(each), &neighbors), Ok(()));
}

#[test]
fn promises_hold_at_points_that_are_no_particles() {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [10; 2], 0.3, 6).unwrap();
    let points = [[0.21, 0.33], [0.5, 0.5], [0.0, 1.0], [0.93, 0.04]];
    let nearest = Nearest::build_at(&points, &particles, &Domain::open(), 44).unwrap();
    let cells = CellList::build_at(&points, &particles, &Domain::open(), Cutoff(0.75)).unwrap();
    keeps_off_particles(Laplacian::<2>, 2, 4, &nearest);
    keeps_off_particles(Gradient::<2>, 1, 2, &nearest);
    keeps_off_particles(D2::<0, 0>::default(), 0, 4, &cells);
}

fn keeps_off_particles<const K: usize, Op: Operator<2, Out = [f64; K]> + Clone>(
    operator: Op,
    degree: u32,
    order: u32,
    neighbors: &impl Neighbors<2>,
) {
    let dcpse = DcPse::at_order(operator.clone(), order).unwrap();
    assert_eq!(check_method(&dcpse, neighbors), Ok(()));
    let exact_to = degree + order - 1;
    assert_eq!(check_method_moments(&dcpse, neighbors, &operator, exact_to, MOMENTS), Ok(()));
    assert!(check_method_moments(&dcpse, neighbors, &operator, exact_to + 1, MOMENTS).is_err());
}
