//! What a run that nothing was allowed may meet: limits and growth of the whole step, and of what comes later.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Apply, Boundary, CellList, CsrMatrix, Cutoff, DcPse, Domain, ErrorKind, Euler, Eulerian,
    Gradient, GrowthPolicy, ImplicitScheme, Laplacian, Limit, Limits, Method, Nearest, Neighbors, Particles, Pse, Rate,
    Result, Rk4, Rkl2, RowReport, Scene, SemiDiscrete, Sign, SolverError, SspRk3, Stabilized, Steady, Stencil,
    TimeError, Transport, UpwindDcPse, UpwindGradient, testing::Promise,
};

fn torus() -> Result<Domain<2>> {
    Domain::periodic([0.0; 2], [1.0; 2])
}

/// Scattered particles, h = 1/n, and k neighbors of each.
fn scattered(n: usize, jitter: f64, k: usize) -> Result<(Particles<2>, Nearest<2>)> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], jitter, 2)?;
    let neighbors = Nearest::build(&set, &torus()?, k)?;
    Ok((set, neighbors))
}

/// A ring of n particles on a lattice.
fn ring(n: usize) -> Result<(Particles<1>, CellList<1>)> {
    let ring = Particles::lattice([0.0], [1.0], [n])?;
    let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(16.0 / n as f64))?;
    Ok((ring, neighbors))
}

/// Rows that grow on scattered particles.
fn growing() -> DcPse<Gradient<2>, 2> {
    DcPse::new().sign(Sign::Minus)
}

fn refused_for_growth(error: &parops::Error) {
    let growing = matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. }));
    Promise::new("Limits of steps", "scenes with modes that grow are refused by default").case(error).holds(growing);
}

#[test]
fn flow_that_rises_within_a_step_binds_it() -> Result<()> {
    let (set, neighbors) = ring(64)?;
    let gradient = Pse::new(Gradient::<1>, 2, set.spacing()?.epsilon(2.0)?, set.volumes()?)?;
    let scene = AdvectionDiffusion::<1>::new().advection(|_: &[f64; 1], t: f64| [100.0 * t], gradient);
    let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
    let mut u: Vec<f64> = (0..64).map(|p| f64::from(u8::from(p == 9))).collect();
    let before = u.clone();
    let error = run.step(&mut u, 1.0).err().unwrap();
    let bound = matches!(error.kind(), ErrorKind::Solver(SolverError::Limit { binding: Limit::Advection, .. }));
    assert!(bound && u == before, "{error}");
    // Cut by the policy, every part is within the limit of its own span, and nothing grows.
    let mut run = run.step_policy(parops::StepPolicy::Adapt { most: 10_000 });
    let row = run.step(&mut u, 1.0)?;
    assert!(row.substeps > 100 && u.iter().all(|u| u.abs() < 2.0), "{}", row.substeps);
    Ok(())
}

#[test]
fn flow_at_rest_when_rows_are_made_is_estimated_once_it_moves() -> Result<()> {
    let (set, neighbors) = scattered(14, 0.3, 14)?;
    let rising = |_: &[f64; 2], t: f64| [t, 0.0];
    let scene = || AdvectionDiffusion::<2>::new().advection(rising, growing());
    let mut u = vec![1.0; set.len()];
    let mut run = Eulerian::new(scene(), &set, &neighbors, Rk4::new())?;
    let error = run.step(&mut u, 1e-3).err().unwrap();
    refused_for_growth(&error);
    assert!(run.time() == 0.0 && run.ledger().step == 0, "{error}");
    let mut later = Eulerian::new(scene(), &set, &neighbors, Rk4::new())?.at(1.0);
    refused_for_growth(&later.step(&mut u, 1e-3).err().unwrap());
    // Allowed, it is recorded, and again as the flow gets faster.
    let (steps, growth) = (parops::StepPolicy::Refuse, GrowthPolicy::Allow);
    let mut run = Eulerian::with_policy(scene(), &set, &neighbors, Rk4::new(), steps, growth)?;
    assert_eq!(run.ledger().growth, 0.0);
    let early = run.step(&mut u, 1e-3)?.growth;
    let late = run.advance(&mut u, 0.1, 1e-3)?.growth;
    assert!(early > 0.0 && late > 32.0 * early, "{early} {late}");
    Ok(())
}

#[test]
fn hyperviscosity_of_a_flow_at_rest_is_found_for_what_it_becomes() -> Result<()> {
    let (set, neighbors) = scattered(14, 0.3, 20)?;
    let gust = |_: &[f64; 2], t: f64| [(3.0 * t).sin(), 0.4 * (3.0 * t).sin()];
    let scheme = Stabilized::<2, 2>::new(set.spacing()?).rows(growing(), DcPse::new());
    let scene = AdvectionDiffusion::<2>::new().advection(gust, scheme);
    let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
    let mut u: Vec<f64> = (0..set.len()).map(|p| f64::from(u8::from(p == 60))).collect();
    run.advance(&mut u, 4.0, 0.01)?;
    // A spike of 1 spreads.
    assert!(u.iter().all(|u| u.abs() < 1.0));
    assert!(run.limits(&u)?.rate(Limit::Hyperviscosity).decay > 0.0);
    Ok(())
}

#[test]
fn stabilized_scene_is_accepted_by_default() -> Result<()> {
    for seed in 1..=3 {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.3, seed)?;
        let neighbors = Nearest::build(&set, &torus()?, 20)?;
        let scheme = || Stabilized::<2, 2>::new(set.spacing().unwrap()).rows(growing(), DcPse::new());
        let turning = Steady(|x: &[f64; 2]| [(TAU * x[1]).sin(), (TAU * x[0]).cos()]);
        Eulerian::new(AdvectionDiffusion::<2>::new().advection([1.0, 0.4], scheme()), &set, &neighbors, Rk4::new())?;
        Eulerian::new(AdvectionDiffusion::<2>::new().advection(turning, scheme()), &set, &neighbors, Rk4::new())?;
    }
    Ok(())
}

#[test]
fn source_that_turns_fields_into_each_other_binds_by_the_imaginary_interval() -> Result<()> {
    const OMEGA: f64 = 50.0;
    let (set, neighbors) = ring(64)?;
    let turn = |_: &[f64; 1], _: f64, u: [f64; 2]| [OMEGA * u[1], -OMEGA * u[0]];
    let scene = || AdvectionDiffusion::<1>::new().fields::<[f64; 2]>().source(turn);
    let mut run = Eulerian::new(scene(), &set, &neighbors, SspRk3::new())?;
    let mut u = vec![[1.0, 0.0]; 64];
    // sqrt 3 on the imaginary axis; 2.51 on the real one would let it grow by 1.9 a step.
    assert!(run.step(&mut u, 2.4 / OMEGA).is_err());
    // The difference quotients of later steps round otherwise.
    let dt = 0.999 * run.limits(&u)?.step(&SspRk3::<Vec<[f64; 2]>>::new());
    for _ in 0..500 {
        run.step(&mut u, dt)?;
    }
    let size = u.iter().map(|u| u[0].hypot(u[1])).fold(0.0, f64::max);
    Promise::new("Limits of steps", "size after 500 steps at the limit of a source that turns fields, less 1")
        .at_most(1e-12, size - 1.0);
    // Euler has no such interval: there a source that only decays binds as on the real axis.
    let fall = |_: &[f64; 1], _: f64, u: [f64; 2]| [-OMEGA * u[0], OMEGA * u[0]];
    let scene = AdvectionDiffusion::<1>::new().fields::<[f64; 2]>().source(fall);
    let mut run = Eulerian::new(scene, &set, &neighbors, Euler::new())?;
    let limit = run.limits(&u)?.step(&Euler::<Vec<[f64; 2]>>::new());
    assert!((limit * OMEGA / 2.0 - 1.0).abs() < 1e-6, "{limit}");
    Ok(())
}

#[test]
fn fields_of_unlike_size_have_difference_quotients_of_their_own() -> Result<()> {
    // A temperature and a concentration c, dc/dt = -k c^2: dS/dc = -2 k c.
    let (k, c) = (1e9, 1e-6);
    let (set, neighbors) = ring(64)?;
    let react = move |_: &[f64; 1], _: f64, u: [f64; 2]| [0.0, -k * u[1] * u[1]];
    let scene = AdvectionDiffusion::<1>::new().fields::<[f64; 2]>().source(react);
    let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
    let rate = run.limits(&vec![[300.0, c]; 64])?.rate(Limit::Source).modulus;
    assert!((rate / (2.0 * k * c) - 1.0).abs() < 1e-6, "{rate}");
    Ok(())
}

#[test]
fn rows_of_dcpse_in_single_precision_are_not_taken_for_symmetric() -> Result<()> {
    let (set, neighbors) = scattered(100, 0.1, 20)?;
    let scene = || AdvectionDiffusion::<2>::new().fields::<f32>().diffusion(0.1, DcPse::<Laplacian<2>, 2>::new());
    let growth = GrowthPolicy::Unknown;
    let steps = parops::StepPolicy::Refuse;
    let error = Eulerian::with_policy(scene(), &set, &neighbors, Rkl2::new(2)?, steps, growth).err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Time(TimeError::Slope { slope: 0.0, .. })), "{error}");
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [100; 2])?;
    let pse = Pse::new(Laplacian::<2>, 2, lattice.spacing()?.epsilon(1.5)?, lattice.volumes()?)?;
    let near = CellList::build(&lattice, &torus()?, pse.cutoff())?;
    let scene = AdvectionDiffusion::<2>::new().fields::<f32>().diffusion(0.1, pse);
    assert!(Eulerian::with_policy(scene, &lattice, &near, Rkl2::new(200)?, steps, growth).is_ok());
    Ok(())
}

#[test]
fn first_step_that_fails_leaves_ledger_and_starting_mass() -> Result<()> {
    let (set, neighbors) = ring(64)?;
    let late = |_: &[f64; 1], t: f64, u: f64| if t > 0.0 { f64::NAN } else { -u };
    let mut run = Eulerian::new(AdvectionDiffusion::<1>::new().source(late), &set, &neighbors, Rk4::new())?;
    let (before, mut u) = (format!("{:?}", run.ledger()), vec![1.0; 64]);
    assert!(run.step(&mut u, 0.1).is_err());
    assert_eq!(format!("{:?}", run.ledger()), before);
    assert!(run.save(&u).start.is_empty());
    Ok(())
}

/// What a user may write: anti-diffusion on a ring, of which the report knows nothing.
#[derive(Clone)]
struct Backward;

impl Method<1> for Backward {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }

    fn weights(&self, row: &Stencil<1>, _: &mut (), w: &mut [[f64; 1]], _: &mut [f64; 1]) -> Result<()> {
        w.iter_mut().zip(row.separations()).for_each(|(w, s)| w[0] = -1.0 / (s[0] * s[0]));
        Ok(())
    }

    fn report(&self, row: &Stencil<1>, _: &(), w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        Ok(RowReport::of(row, w, diagonal))
    }
}

#[test]
fn slow_growth_amid_the_imaginary_axis_is_refused() -> Result<()> {
    // The '+' form with 26 neighbors grows by 0.002 to 0.003 |v|/h, and no estimate of that converges.
    for n in [16, 24] {
        let (set, neighbors) = scattered(n, 0.3, 26)?;
        let rows = DcPse::<Gradient<2>, 2>::new().sign(Sign::Plus);
        let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.0], rows);
        refused_for_growth(&Eulerian::new(scene, &set, &neighbors, Rk4::new()).err().unwrap());
    }
    // On a lattice the same rows turn waves and nothing else.
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let near = CellList::build(&lattice, &torus()?, Cutoff(2.9 / 16.0))?;
    let rows = DcPse::<Gradient<2>, 2>::new().sign(Sign::Plus);
    let scene = AdvectionDiffusion::<2>::new().advection([1.0, 0.4], rows);
    assert!(Eulerian::new(scene, &lattice, &near, Rk4::new()).is_ok());
    Ok(())
}

#[test]
fn foreign_rows_that_grow_are_found_whatever_their_report_says() -> Result<()> {
    let (set, neighbors) = ring(64)?;
    let scene = AdvectionDiffusion::<1>::new().diffusion(1.0, Backward);
    refused_for_growth(&Eulerian::new(scene, &set, &neighbors, Rk4::new()).err().unwrap());
    Ok(())
}

#[test]
fn crank_nicolson_takes_inflow_where_the_step_ends() -> Result<()> {
    // The flow turns at pi/2: in the first half of a step, in its second half, and between steps.
    let line = Particles::lattice([0.0], [1.0], [40])?;
    let gradient = UpwindGradient::new(line.spacing()?.epsilon(1.0)?, line.volumes()?);
    let neighbors = CellList::build(&line, &Domain::open(), gradient.cutoff())?;
    for start in [1.5, 1.45, 1.52] {
        let scene = AdvectionDiffusion::<1>::new()
            .advection(|_: &[f64; 1], t: f64| [t.cos()], gradient.clone())
            .boundary(Boundary::new(1).inflow([(0, [-1.0]), (39, [1.0])]), |_, _, _| 1.0);
        let scheme = ImplicitScheme::crank_nicolson();
        let mut run = Eulerian::new(scene, &line, &neighbors, scheme)?.at(start);
        let mut u = vec![1.0; 40];
        for _ in 0..4 {
            run.step(&mut u, 0.1)?;
        }
        // One is a solution; each solve is good to 1e-13 of a condition below 100.
        let worst = u.iter().map(|u| (u - 1.0).abs()).fold(0.0, f64::max);
        Promise::new("Accuracy", "a constant fed by inflow from either end of a flow that turns, Crank-Nicolson")
            .case(start)
            .at_most(1e-11, worst);
    }
    Ok(())
}

/// The largest difference of A u and du/dt, in units of the largest entry.
fn apart<S: Scene<2, Value = f64>>(scene: S, set: &Particles<2>, neighbors: &impl Neighbors<2>) -> Result<f64> {
    let mut discrete = SemiDiscrete::new(scene, set, neighbors, GrowthPolicy::Allow)?;
    let matrix: CsrMatrix = discrete.matrix(0.3)?;
    let u: Vec<f64> = set.points().iter().map(|x| (TAU * x[0]).sin() + x[1]).collect();
    let (mut du, mut image) = (vec![0.0; u.len()], vec![0.0; u.len()]);
    discrete.rate(0.3, &u, &mut du)?;
    matrix.apply(&u, &mut image)?;
    let size = du.iter().fold(0.0_f64, |most, du| most.max(du.abs()));
    Ok(du.iter().zip(&image).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size)
}

#[test]
fn matrix_of_a_scene_is_its_rate() -> Result<()> {
    /// Cancellation of weights of 1/h^2, squared by hyperviscosity.
    const ROUNDING: f64 = 1e-10;
    let (set, neighbors) = scattered(12, 0.2, 30)?;
    fn scene<X: Transport<2>>(scheme: X) -> impl Scene<2, Value = f64> {
        AdvectionDiffusion::<2>::new()
            .diffusion(|x: &[f64; 2]| 0.1 + x[0], DcPse::<Laplacian<2>, 2>::new())
            .advection(|x: &[f64; 2], t: f64| [x[1] - t, 0.5], scheme)
            .divergence(|x: &[f64; 2], t: f64| x[0] * t)
    }
    let h = set.spacing()?;
    let agrees = Promise::new("Residuals", "the matrix of a scene against its rate, relative");
    agrees.at_most(ROUNDING, apart(scene(DcPse::<Gradient<2>, 2>::new()), &set, &neighbors)?);
    agrees.at_most(ROUNDING, apart(scene(UpwindDcPse::half_stencils()), &set, &neighbors)?);
    agrees.at_most(ROUNDING, apart(scene(Stabilized::<2, 2>::new(h).gamma(0.2)), &set, &neighbors)?);
    let upwind = UpwindGradient::new(h.epsilon(1.0)?, set.volumes()?).support(3.0)?;
    let near = CellList::build(&set, &torus()?, upwind.cutoff())?;
    agrees.at_most(ROUNDING, apart(scene(upwind), &set, &near)?);
    Ok(())
}

#[test]
fn rate_that_is_no_number_allows_no_step() {
    for rate in [Rate::decay(f64::NAN), Rate::modulus(f64::NAN), Rate::frequency(f64::NAN)] {
        let mut limits = Limits::default();
        limits.add(Limit::Diffusion, Rate::decay(1.0));
        limits.add(Limit::Advection, rate);
        let rk4 = Rk4::<f64>::new();
        let none = !(limits.step(&rk4) > 0.0) && limits.check(1e-3, &rk4).is_err();
        Promise::new("Limits of steps", "rates that are no numbers allow no step").holds(none);
        assert_eq!(limits.binding(&rk4), Some(Limit::Advection));
    }
}

#[test]
fn sets_of_no_particle_and_of_one_run() -> Result<()> {
    for points in [vec![], vec![[0.5, 0.5]]] {
        let set = Particles::new(points)?.with_equal_volumes(1.0)?;
        let neighbors = Nearest::build(&set, &Domain::open(), 1)?;
        let scene = AdvectionDiffusion::<2>::new().source(|_, _, u| -u);
        let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
        let mut u = vec![1.0; set.len()];
        run.advance(&mut u, 1.0, 0.125)?;
        assert!(u.iter().all(|u| (u - (-1.0_f64).exp()).abs() < 1e-5));
    }
    Ok(())
}
