//! Sources of steady scenes: affine ones at any level of the field, others refused wherever they are not affine.

use parops::{
    AdvectionDiffusion, Boundary, BoundaryCondition, DcPse, Domain, ErrorKind, Laplacian, LinearError, Nearest,
    Particles, Result, SolverError, steady,
};

const CELLS: usize = 100;

/// u'' + S(u) = 0 with both ends at `end`.
fn rod(source: impl Fn(f64) -> f64 + Sync, end: f64) -> Result<Vec<f64>> {
    let rod = Particles::new((0..=CELLS).map(|i| [i as f64 / CELLS as f64]).collect())?;
    let ends = Boundary::new(4).conditions([0, CELLS].map(BoundaryCondition::dirichlet));
    let scene = AdvectionDiffusion::<1>::new()
        .diffusion(1.0, DcPse::<Laplacian<1>, 4>::new())
        .source(move |_, _, u| source(u))
        .boundary(ends, move |_, _, _| end);
    Ok(steady(scene, &rod, &Nearest::build(&rod, &Domain::open(), 12)?)?.u)
}

#[test]
fn decay_towards_any_level_is_seen() -> Result<()> {
    // S = k^2 (A - u) between ends at 0: u / A = 1 - cosh(k (x - 1/2)) / cosh(k/2).
    let k = 10.0_f64.sqrt();
    let exact = |i: usize| 1.0 - (k * (i as f64 / CELLS as f64 - 0.5)).cosh() / (0.5 * k).cosh();
    for level in [1e-200, 1e-9, 1.0, 1e10, 1e15, 1e17, 1e150] {
        let u = rod(|u| 10.0 * (level - u), 0.0)?;
        let worst = u.iter().enumerate().fold(0.0_f64, |worst, (i, u)| worst.max((u / level - exact(i)).abs()));
        assert!(worst < 1e-6, "{worst} at {level}");
    }
    // Slopes far below the source: S = A (1 - s u).
    for slope in [1e-3, 1e-12, 1e-60] {
        let u = rod(|u| 1e12 * (1.0 - slope * u), 0.0)?;
        // Where decay is slow, u = A x (1 - x) / 2.
        let k = (1e12 * slope).sqrt();
        let middle = if k < 1e-3 { 0.125e12 } else { (1.0 - 1.0 / (0.5 * k).cosh()) / slope };
        assert!((u[CELLS / 2] / middle - 1.0).abs() < 1e-5, "{} for {middle}", u[CELLS / 2]);
    }
    Ok(())
}

#[test]
fn sources_that_are_not_affine_are_refused_at_any_level() {
    let refused = |source: &(dyn Fn(f64) -> f64 + Sync), end: f64| {
        let error = rod(source, end).unwrap_err();
        let ErrorKind::Solver(SolverError::NotAffine { u, found, expected }) = *error.kind() else { panic!("{error}") };
        assert!(error.particle().is_some() && found == source(u) && found != expected, "{error}");
        u
    };
    for c in [1.0, 1e-8, 1e-18] {
        refused(&|u| 10.0 * (1.0 / c - c * u * u), 1.0 / c);
    }
    // Affine where it is probed, and not where the field comes to lie.
    let u = refused(&|u: f64| 1.0 - u.min(4.0), 10.0);
    assert!(u > 4.0 && u <= 10.0, "{u}");
}

#[test]
fn affine_sources_are_solved_though_they_overflow_far_from_the_field() -> Result<()> {
    // Heat everywhere and a loss whose factors are taken one after the other: u -> inf * 0 beyond the range.
    for (loss, factor) in [(1e-6, 4.2e6), (1e-3, 1e3), (0.0, 1e6)] {
        let u = rod(|u| 1.0 - loss * (factor * u), 0.0)?;
        let k = f64::sqrt(loss * factor);
        let middle = if k == 0.0 { 0.125 } else { (1.0 - 1.0 / (0.5 * k).cosh()) / (k * k) };
        assert!((u[CELLS / 2] / middle - 1.0).abs() < 1e-5, "{} for {middle}", u[CELLS / 2]);
    }
    Ok(())
}

#[test]
fn field_beyond_the_range_of_its_numbers_is_said_to_be() -> Result<()> {
    let rod = Particles::new((0..=10_u8).map(|i| [f64::from(i) / 10.0]).collect())?;
    let ends = Boundary::new(2).conditions([0, 10].map(BoundaryCondition::dirichlet));
    let scene = AdvectionDiffusion::<1>::new()
        .fields::<f32>()
        .diffusion(1e-15, DcPse::<Laplacian<1>, 2>::new())
        .source(|_, _, _: f32| 1e30)
        .boundary(ends, |_, _, _| 0.0);
    let error = steady(scene, &rod, &Nearest::build(&rod, &Domain::open(), 5)?).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Linear(LinearError::Value { value }) if value.is_infinite()), "{error}");
    assert_eq!(error.particle(), Some(1), "{error}");
    Ok(())
}

#[test]
fn source_that_is_infinite_at_the_field_found_is_refused() {
    let sources: [fn(f64) -> f64; 3] = [|_| f64::INFINITY, |_| f64::NEG_INFINITY, |u| 1.0 + (1000.0 * u).exp()];
    for beyond in sources {
        let error = rod(|u| if u <= 3.0 { 1.0 } else { beyond(u) }, 10.0).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::NotAffine { .. })), "{error}");
    }
}
