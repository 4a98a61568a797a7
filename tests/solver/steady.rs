//! Scenes at rest by one sparse solve.

use std::f64::consts::PI;

use parops::{
    AdvectionDiffusion, Boundary, BoundaryCondition, CellList, DcPse, Domain, ErrorKind, Face, Gradient, Laplacian,
    Nearest, Particles, Random, Result, SolverError, Steady, UpwindGradient, steady, testing::Promise,
};

fn rod(n: usize, jitter: f64) -> Result<Particles<1>> {
    let mut random = Random::new(3);
    let mut place = |i: usize| match i {
        i if i == 0 || i == n => i as f64,
        i => i as f64 + jitter * (2.0 * random.uniform() - 1.0),
    };
    Particles::new((0..=n).map(|i| [place(i) / n as f64]).collect())
}

fn worst<const D: usize>(points: &[[f64; D]], u: &[f64], exact: impl Fn(&[f64; D]) -> f64) -> f64 {
    points.iter().zip(u).map(|(x, u)| (u - exact(x)).abs()).fold(0.0, f64::max)
}

/// u' = D u'' + s between two values, r = 2: error of the layer at h.
fn layer(n: usize) -> Result<f64> {
    let rod = rod(n, 0.2)?;
    let scene = AdvectionDiffusion::<1>::new()
        .diffusion(0.1, DcPse::<Laplacian<1>, 2>::new())
        .advection([1.0], DcPse::<Gradient<1>, 2>::new())
        .boundary(Boundary::new(2).conditions([0, n].map(BoundaryCondition::dirichlet)), |_, x, _| x[0].round());
    let state = steady(scene, &rod, &Nearest::build(&rod, &Domain::open(), 8)?)?;
    let exact = |x: &[f64; 1]| (10.0 * x[0]).exp_m1() / 10.0_f64.exp_m1();
    Promise::new("Residuals", "steady solves, relative").at_most(1e-12, state.report.residual);
    assert!(state.condition > 1.0);
    Ok(worst(rod.points(), &state.u, exact))
}

#[test]
fn boundary_layers_converge_at_design_order() -> Result<()> {
    let errors = [layer(60)?, layer(120)?, layer(240)?];
    for order in [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()] {
        println!("order {order:.3}");
        // Of the largest error, which one particle has.
        Promise::new("Orders", "steady boundary layers, r = 2").within(1.7, 2.3, order);
    }
    Ok(())
}

#[test]
fn robin_walls_and_variable_diffusivity_balance_a_source() -> Result<()> {
    // ((1 + x) u')' - v u' - 3 u + s = 0 with u = cos(pi x): the source is affine in u.
    let (n, v) = (160, 0.7);
    let rod = rod(n, 0.2)?;
    let ends = [BoundaryCondition::robin(0, [-1.0], 2.0, 1.0), BoundaryCondition::neumann(n, [1.0])];
    let source = move |x: &[f64; 1], _: f64, u: f64| {
        let (sin, cos) = (PI * x[0]).sin_cos();
        PI * sin + (1.0 + x[0]) * PI * PI * cos - v * PI * sin + 3.0 * cos - 3.0 * u
    };
    let scene = AdvectionDiffusion::<1>::new()
        .diffusion(|x: &[f64; 1]| 1.0 + x[0], DcPse::<Laplacian<1>, 4>::new())
        .advection(Steady(move |_: &[f64; 1]| [v]), DcPse::<Gradient<1>, 4>::new())
        .source(source)
        .boundary(Boundary::new(4).conditions(ends), |p, _, _| if p == 0 { 2.0 } else { 0.0 });
    let state = steady(scene, &rod, &Nearest::build(&rod, &Domain::open(), 14)?)?;
    let error = worst(rod.points(), &state.u, |x| (PI * x[0]).cos());
    // h^4 u^(6) with constants of order one, solved to 1e-10.
    Promise::new("Accuracy", "steady u = cos(pi x) of D = 1 + x between Robin and Neumann ends, r = 4, h = 1/160")
        .at_most(1e-6, error);
    Ok(())
}

#[test]
fn several_fields_share_one_matrix() -> Result<()> {
    let square = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.2, 4)?;
    let near = |x: &[f64; 2]| x.iter().any(|x| *x < 1.0 / 16.0 || *x > 15.0 / 16.0);
    let walls: Vec<_> = (0..square.len()).filter(|&p| near(&square.points()[p])).collect();
    // Quadratics that r = 2 reproduces: u = (x^2, x y + 1), Lap u = (2, 0).
    let exact = |x: &[f64; 2]| [x[0] * x[0], x[0] * x[1] + 1.0];
    let scene = AdvectionDiffusion::<2>::new()
        .fields::<[f64; 2]>()
        .diffusion(0.5, DcPse::<Laplacian<2>, 2>::new())
        .source(|_, _, _| [-1.0, 0.0])
        .boundary(Boundary::new(2).conditions(walls.into_iter().map(BoundaryCondition::dirichlet)), move |_, x, _| {
            exact(x)
        });
    let state = steady(scene, &square, &Nearest::build(&square, &Domain::open(), 20)?)?;
    for (x, u) in square.points().iter().zip(&state.u) {
        // The residual of the solve times the condition of the matrix, below 1e4.
        let off = u.iter().zip(exact(x)).map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max);
        Promise::new("Accuracy", "quadratic steady states of two fields, r = 2").at_most(1e-9, off);
    }
    Ok(())
}

#[test]
fn inflow_feeds_an_upwind_balance() -> Result<()> {
    // -u' - 2 u = 0 from u(0) = 1, order 1.
    let mut errors = Vec::new();
    for n in [100, 200] {
        let line = Particles::lattice([0.0], [1.0], [n])?;
        let upwind = UpwindGradient::new(line.spacing()?.epsilon(1.0)?, line.volumes()?);
        let neighbors = CellList::build(&line, &Domain::open(), upwind.cutoff())?;
        let x0 = line.points()[0][0];
        let scene = AdvectionDiffusion::<1>::new()
            .advection([1.0], upwind)
            .source(|_, _, u| -2.0 * u)
            .boundary(Boundary::new(1).inflow([(0, [-1.0])]), |_, _, _| 1.0);
        let state = steady(scene, &line, &neighbors)?;
        errors.push(worst(line.points(), &state.u, |x| (-2.0 * (x[0] - x0)).exp()));
    }
    assert!(errors[0] < 0.02, "{errors:?}");
    let order = (errors[0] / errors[1]).log2();
    Promise::new("Orders", "a steady upwind balance fed by inflow").within(0.9, 1.1, order);
    Ok(())
}

#[test]
fn what_has_no_steady_state_is_refused() -> Result<()> {
    let rod = rod(40, 0.0)?;
    let neighbors = Nearest::build(&rod, &Domain::open(), 8)?;
    let scene = || AdvectionDiffusion::<1>::new().diffusion(1.0, DcPse::<Laplacian<1>, 2>::new());
    let ends = || Boundary::new(2).conditions([0, 40].map(BoundaryCondition::dirichlet));

    let squared = steady(scene().source(|_, _, u| 1.0 - u * u).boundary(ends(), |_, _, _| 0.0), &rod, &neighbors);
    let refused = Promise::new("Input", "scenes without a steady state are refused by what is wrong");
    let error = squared.unwrap_err();
    let expected = ErrorKind::Solver(SolverError::NotAffine { u: 2.0, found: -3.0, expected: -1.0 });
    refused.clone().case(&error).holds(*error.kind() == expected && error.particle() == Some(1));

    let gust = scene().advection(|_: &[f64; 1], t: f64| [t], DcPse::<Gradient<1>, 2>::new());
    let error = steady(gust.boundary(ends(), |_, _, _| 0.0), &rod, &neighbors).unwrap_err();
    refused.clone().case(&error).holds(matches!(error.kind(), ErrorKind::Solver(SolverError::Unsteady { .. })));

    let broken = scene().source(|x, _, _| if x[0] == 0.5 { f64::NAN } else { 0.0 });
    let error = steady(broken.boundary(ends(), |_, _, _| 0.0), &rod, &neighbors).unwrap_err();
    let source = matches!(error.kind(), ErrorKind::Solver(SolverError::Source { .. }));
    refused.clone().case(&error).holds(source && error.particle() == Some(20));
    Ok(())
}

#[test]
fn level_that_nothing_fixes_is_refused_and_what_fixes_it_is_seen() -> Result<()> {
    let rod = rod(40, 0.0)?;
    let neighbors = Nearest::build(&rod, &Domain::open(), 8)?;
    let scene = || AdvectionDiffusion::<1>::new().diffusion(1.0, DcPse::<Laplacian<1>, 2>::new());
    // Whether or not the source has a balance.
    let open = ErrorKind::Solver(SolverError::OpenLevel { particles: 41 });
    let walls = [BoundaryCondition::neumann(0, [-1.0]), BoundaryCondition::neumann(40, [1.0])];
    let fluxes = || Boundary::new(2).conditions(walls);
    let refused = Promise::new("Input", "steady scenes that fix no level are refused");
    for source in [0.0, 1.0] {
        let fluxes = scene().source(move |_, _, _| source).boundary(fluxes(), |_, _, _| 0.0);
        refused.equal(steady(fluxes, &rod, &neighbors).unwrap_err().kind(), &open);
    }
    refused.equal(steady(scene(), &rod, &neighbors).unwrap_err().kind(), &open);

    let robin = [BoundaryCondition::neumann(0, [-1.0]), BoundaryCondition::robin(40, [1.0], 1.0, 1.0)];
    let held = steady(scene().boundary(Boundary::new(2).conditions(robin), |_, _, _| 0.0), &rod, &neighbors)?;
    assert!(held.u.iter().all(|&u| u == 0.0));
    let decaying = steady(scene().source(|_, _, u| 1.0 - u).boundary(fluxes(), |_, _, _| 0.0), &rod, &neighbors)?;
    // The residual of the solve times the condition of the matrix, below 1e4.
    assert!(decaying.u.iter().all(|u| (u - 1.0).abs() < 1e-9));

    let cells = Particles::lattice([0.0], [1.0], [40])?;
    let mirrors = Domain::new([0.0], [1.0], [[Face::MirrorOdd, Face::MirrorEven]])?;
    let bump = |x: &[f64; 1]| (0.5 * PI * x[0]).sin();
    let source = scene().source(move |x, _, _| 0.25 * PI * PI * bump(x));
    let mirrored = steady(source, &cells, &Nearest::build(&cells, &mirrors, 8)?)?;
    // Neighbors as far as 4 h: 2 (4 h)^2/4! u/u with u/u'' = (pi/2)^2.
    assert!(worst(cells.points(), &mirrored.u, bump) < 3.3 * 40.0_f64.powi(-2));
    Ok(())
}
