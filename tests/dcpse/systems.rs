//! What solvers say of single stencils: the same in any unit of length and by any factorization, and the way up the
//! ladder.

use crate::solvers::{solve, stencil};
use crate::stencils::Stencils;
use num_dual::Dual64;
use parops::{
    CUTOFF_OVER_EPSILON, Cholesky, DcPse, Error, ErrorKind, Expression, Ladder, Lu, MomentScratch, MomentSolver,
    MomentSystem, MultiIndex, MultiIndexError, OperatorError, PivotedQr, Qr, Residual, Rung, Scalar, Solution, Term,
    Window, graded,
};

const EPS: f64 = f64::EPSILON;

fn system<const D: usize>(beta: [u8; D], order: u32) -> MomentSystem<f64, D> {
    let beta = MultiIndex::new(beta);
    let terms = vec![vec![Term { index: beta, factor: 1.0 }]];
    MomentSystem::new(&terms, beta.degree(), order, u32::from(beta.is_even())).unwrap()
}

type Found<T> = parops::Result<(Solution<T>, Vec<T>)>;

fn weights<const D: usize>(solver: &impl MomentSolver, system: &MomentSystem<f64, D>) -> Found<f64> {
    let mut w = vec![f64::NAN; system.neighbors()];
    let solution = solver.solve(system, &mut MomentScratch::default(), &mut w)?;
    Ok((solution, w))
}

#[test]
fn windows_have_their_values() {
    let phi = |window: Window, z: f64, radius: f64| window.root(z * z, radius).powi(2);
    for (z, radius) in [(0.0, 2.2), (1e-9, 2.2), (0.7, 2.2), (1.1, 2.2), (2.0, 2.2), (3.0, 4.5)] {
        // A power, a root and a square of a few roundings.
        let near = |found: f64, expected: f64| (found - expected).abs() <= 32.0 * EPS * expected;
        assert!(near(phi(Window::Exponential, z, radius), (-z * z).exp()), "{z}");
        let s = z / radius;
        assert!(near(phi(Window::Wendland, z, radius), (1.0 - s).powi(4) * (4.0 * s + 1.0)), "{z} {radius}");
    }
    assert_eq!([2.2, 2.3, 1e200].map(|z| phi(Window::Wendland, z, 2.2)), [0.0; 3]);
    // The slope at the middle is zero, where that of the distance is not finite.
    let z = Dual64::new(0.0, 1.0);
    for window in [Window::Exponential, Window::Wendland] {
        let root = window.root(z * z, Dual64::new(2.2, 0.0));
        assert_eq!((root.re, root.eps), (1.0, 0.0));
    }
}

#[test]
fn solutions_do_not_depend_on_the_unit_of_length() {
    fn check<const D: usize>(beta: [u8; D], order: u32, cut: usize, seed: u64) {
        let mut system = system(beta, order);
        let z = stencil::<D>(2 * system.conditions(), 0.3, cut, seed);
        let degree: i32 = beta.iter().copied().map(i32::from).sum();
        for exponent in [-60, -1, 7, 40] {
            let scale = 2.0_f64.powi(exponent);
            let mut compare = |solver: &dyn Fn(&MomentSystem<f64, D>) -> Found<f64>| {
                system.fill(&z, Window::Wendland, 2.5);
                let (one, w) = solver(&system).unwrap();
                let scaled: Vec<_> = z.iter().map(|z| z.map(|x| x * scale)).collect();
                system.fill(&scaled, Window::Wendland, 2.5 * scale);
                let (other, v) = solver(&system).unwrap();
                assert_eq!((one.condition, one.rank), (other.condition, other.rank), "{exponent} {:?}", one.rung);
                // What is missed is not the same in another unit, and a correction may be.
                if one.rung == other.rung {
                    assert!(v.iter().zip(&w).all(|(v, w)| v * scale.powi(degree) == *w), "{exponent} {:?}", one.rung);
                }
            };
            compare(&|system| weights(&Qr, system));
            compare(&|system| weights(&PivotedQr, system));
            compare(&|system| weights(&Cholesky, system));
            compare(&|system| weights(&Lu, system));
        }
    }
    for seed in 0..5 {
        check([1], 3, 1, seed);
        check([2, 0], 2, 0, seed);
        check([1, 1], 4, 1, seed);
        check([0, 1, 0], 2, 1, seed);
    }
}

#[test]
fn condition_is_that_of_the_system_whatever_factors_it() {
    for seed in 0..60 {
        let (order, cut) = (1 + (seed % 4) as u32, (seed % 3) as usize);
        let beta = MultiIndex::new([1, 1]);
        let l = graded::<2>(1, 1 + order).count();
        let z = stencil::<2>(2 * l, 0.3, cut, seed);
        let exact = solve(&Lu, beta, order, &z).unwrap().2.condition;
        let qr = solve(&Qr, beta, order, &z).unwrap().2.condition;
        let cholesky = solve(&Cholesky, beta, order, &z).unwrap().2.condition;
        // Both iterate with A, which Cholesky knows to l eps cond^2 relative to its smallest eigenvalue.
        let rounding = l as f64 * EPS * exact * exact;
        assert!((cholesky / qr - 1.0).abs() <= rounding, "{seed}: {cholesky:e} {qr:e} {exact:e}");
        let pivoted = solve(&PivotedQr, beta, order, &z).unwrap().2.condition;
        // Iterations come from below.
        assert!(
            [qr, pivoted].iter().all(|found| (0.3..1.0 + 1e-9).contains(&(found / exact))),
            "{seed}: {qr:e} {pivoted:e} {exact:e}"
        );
    }
}

#[test]
fn corrected_steps_leave_what_rounding_leaves() {
    let mut corrected = 0;
    for seed in 0..60 {
        let order = 3 + (seed % 2) as u32;
        let beta = MultiIndex::new([2, 0]);
        let l = graded::<2>(1, 1 + order).count();
        let z = stencil::<2>(2 * l, 0.3, 1 + (seed % 2) as usize, seed);
        let (_, _, solution) = solve(&Cholesky, beta, order, &z).unwrap();
        if solution.rung == Rung::Corrected && solution.condition < 1e5 {
            corrected += 1;
            let Residual { absolute, terms } = solution.residual;
            assert!(absolute <= 16.0 * EPS * terms, "{seed}: {solution:?}");
        }
    }
    assert!(corrected > 10, "{corrected}");
}

/// Nodes on the first axis: of the nine conditions of a second derivative of order 2, those of x, x^2 and x^3 are
/// independent, and all others are of columns of zeros.
fn line() -> Vec<[f64; 2]> {
    (0..18).map(|i| [0.25 * f64::from(i) - 2.1, 0.0]).collect()
}

fn on_the_line(beta: [u8; 2]) -> MomentSystem<f64, 2> {
    let mut system = system(beta, 2);
    system.fill(&line(), Window::Exponential, 2.2);
    system
}

#[test]
fn systems_without_full_rank_are_refused_by_qr_and_solved_at_their_rank_with_pivots() {
    for (beta, possible) in [([2, 0], true), ([0, 2], false), ([1, 1], false)] {
        let system = on_the_line(beta);
        let singular = |rank| Some(ErrorKind::Operator(OperatorError::Singular { neighbors: 18, conditions: 9, rank }));
        let kind = |solver: &dyn Fn() -> Found<f64>| solver().err().map(|error| error.kind().clone());
        assert_eq!(kind(&|| weights(&Qr, &system)), singular(1));
        assert_eq!(kind(&|| weights(&Cholesky, &system)), singular(1));
        assert_eq!(kind(&|| weights(&Lu, &system)), singular(0));
        let (solution, w) = weights(&PivotedQr, &system).unwrap();
        assert_eq!((solution.rung, solution.rank, solution.holds(&system)), (Rung::PivotedQr, 3, possible));
        let second: f64 = line().iter().zip(&w).map(|(z, w)| w * z[0] * z[0]).sum();
        assert!((second - if possible { 2.0 } else { 0.0 }).abs() < 1e-12, "{second}");
        assert_eq!(weights(&Ladder, &system).unwrap(), (solution, w));
    }
    // Fewer nodes than conditions.
    let mut few = system([2, 0], 2);
    few.fill(&stencil::<2>(5, 0.3, 0, 1), Window::Exponential, 2.2);
    let kind = weights(&Qr, &few).unwrap_err().kind().clone();
    assert_eq!(kind, ErrorKind::Operator(OperatorError::Singular { neighbors: 5, conditions: 9, rank: 5 }));
    // No node at all, and one without a place.
    for z in [vec![], vec![[f64::NAN; 2]; 18]] {
        few.fill(&z, Window::Exponential, 2.2);
        let solvers = [weights(&Qr, &few), weights(&PivotedQr, &few), weights(&Cholesky, &few), weights(&Lu, &few)];
        for solved in solvers {
            let refused = matches!(solved.map_err(|error| error.kind().clone()),
                Err(ErrorKind::Operator(OperatorError::Singular { neighbors, conditions: 9, rank: 0 })) if neighbors == z.len());
            assert!(refused, "{}", z.len());
        }
    }
}

#[test]
fn ladder_keeps_what_is_sharp_and_falls_back_on_what_holds_where_nothing_better_does() {
    let known = |absolute: f64| {
        let residual = Residual { absolute, terms: 100.0 };
        Solution { rung: Rung::Corrected, rank: 9, condition: 1e3, residual }
    };
    // Sharp to 16 eps terms = 3.6e-13, within the gates to 8 l eps cond = 1.6e-11 and 30 l eps terms = 6e-12.
    let (sharp, holds, poor) = (known(3e-13), known(5e-12), known(1e-9));
    let climb = |known, system: &MomentSystem<f64, 2>| {
        let mut w: Vec<f64> = (0..18).map(f64::from).collect();
        let solution = Ladder.climb(known, system, &mut MomentScratch::default(), &mut w).unwrap();
        (solution, w)
    };
    let mark: Vec<f64> = (0..18).map(f64::from).collect();
    let mut sound = system([2, 0], 2);
    sound.fill(&stencil::<2>(18, 0.3, 0, 1), Window::Exponential, 2.2);
    let (possible, impossible) = (on_the_line([2, 0]), on_the_line([0, 2]));
    for system in [&sound, &possible, &impossible] {
        assert_eq!(climb(Some(sharp), system), (sharp, mark.clone()));
    }
    for known in [Some(holds), Some(poor), None] {
        assert_eq!(climb(known, &sound), weights(&Qr, &sound).unwrap());
        assert_eq!(climb(known, &possible), weights(&PivotedQr, &possible).unwrap());
    }
    assert_eq!(climb(Some(holds), &impossible), (holds, mark));
    for known in [Some(poor), None] {
        assert_eq!(climb(known, &impossible), weights(&PivotedQr, &impossible).unwrap());
    }
}

#[test]
fn lu_refuses_systems_of_which_two_conditions_are_the_same() {
    // On the diagonal x^i y^j depends on i + j alone.
    let mut system = system([1, 1], 2);
    system.fill(&line().iter().map(|z| [z[0]; 2]).collect::<Vec<_>>(), Window::Exponential, 3.2);
    let kind = weights(&Lu, &system).unwrap_err().kind().clone();
    assert_eq!(kind, ErrorKind::Operator(OperatorError::Singular { neighbors: 18, conditions: 9, rank: 0 }));
}

#[test]
fn systems_of_illegal_orders_and_of_factorials_that_do_not_fit_are_refused() {
    let refused = |degree: u8, order: u32| {
        let terms = vec![vec![Term { index: MultiIndex::new([degree]), factor: 1.0 }]];
        let error = MomentSystem::<f64, 1>::new(&terms, degree.into(), order, 0).err();
        error.map(|error| error.kind().clone())
    };
    let order = |order| Some(ErrorKind::MultiIndex(MultiIndexError::Order { order, low: 1, high: 8 }));
    assert_eq!([0, 1, 8, 9].map(|order| refused(2, order)), [order(0), None, None, order(9)]);
    assert!(matches!(refused(200, 1), Some(ErrorKind::MultiIndex(MultiIndexError::Degree { degree: 200, .. }))));
}

/// A solver that always says the same.
#[derive(Clone)]
struct Refusing(OperatorError);

impl MomentSolver for Refusing {
    fn solve<T: Scalar, const D: usize>(
        &self,
        _: &MomentSystem<T, D>,
        _: &mut MomentScratch<T>,
        _: &mut [T],
    ) -> parops::Result<Solution<T>> {
        Err(self.0.into())
    }
}

#[test]
fn rows_of_solvers_that_find_no_weights_are_refused_with_all_that_is_known() {
    // The second of two targets has its neighbors on the first axis.
    let second = Expression::new([(MultiIndex::new([2, 0]), 1.0)]).unwrap();
    let sound = stencil::<2>(18, 0.3, 0, 1).iter().map(|z| z.map(|x| 0.99 * x)).collect();
    let stencils = Stencils { offsets: vec![sound, line()], cutoff: CUTOFF_OVER_EPSILON };
    fn refused<S: MomentSolver>(solver: S, second: &Expression<2>, stencils: &Stencils<2>) -> Error {
        DcPse::at_order(second.clone(), 2).unwrap().solver(solver).assemble(stencils).unwrap_err()
    }
    let error = refused(Qr, &second, &stencils);
    let ErrorKind::Operator(OperatorError::Uncertified { neighbors, conditions, rank, condition, residual, ratio }) =
        *error.kind()
    else {
        panic!("{error}")
    };
    assert_eq!((error.particle(), neighbors, conditions, rank), (Some(1), 18, 9, 1));
    // Nothing of the moment 2 is there.
    assert_eq!((condition, residual), (f64::INFINITY, 2.0));
    assert!((ratio / CUTOFF_OVER_EPSILON - 1.0).abs() < 4.0 * EPS, "{ratio}");
    // What is no matter of rank is handed on as it is.
    let own = OperatorError::Setting { value: 7.0 };
    let error = refused(Refusing(own), &second, &stencils);
    assert_eq!((error.kind(), error.particle()), (&ErrorKind::Operator(own), Some(0)));
}
