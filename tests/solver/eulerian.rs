//! Eulerian runs: what is interchangeable, what is refused, what limits are worth, what the ledger says.

use std::f64::consts::{PI, SQRT_2, TAU};

use parops::{
    AdvectionDiffusion, Boundary, CellList, Cutoff, DcPse, Domain, ErrorKind, Euler, Eulerian, Face, Gaussian,
    Gradient, GrowthPolicy, Laplacian, Limit, Nearest, Particles, Pse, Rate, Result, Rk4, Scene, SolverError, Sph,
    SphForm, SspRk3, StepPolicy, TimeScheme, UpwindGradient, testing::Promise,
};

/// A ring of n particles on a lattice, h = 1/n.
fn ring(n: usize) -> Result<(Particles<1>, CellList<1>)> {
    let ring = Particles::lattice([0.0], [1.0], [n])?;
    let neighbors = CellList::build(&ring, &Domain::periodic([0.0], [1.0])?, Cutoff(16.0 / n as f64))?;
    Ok((ring, neighbors))
}

/// PSE of the gradient, epsilon in spacings.
fn pse_gradient(ring: &Particles<1>, overlap: f64) -> Result<Pse<parops::Exchange<1>, 1>> {
    Pse::new(Gradient::<1>, 2, ring.spacing()?.epsilon(overlap)?, ring.volumes()?)
}

fn norm(u: &[f64]) -> f64 {
    u.iter().map(|u| u * u).sum::<f64>().sqrt()
}

/// A field with all modes of a ring.
fn spike(n: usize) -> Vec<f64> {
    (0..n).map(|p| f64::from(u8::from(p == n / 3))).collect()
}

fn refused_as_unstable(error: &parops::Error, of: Limit) {
    let unstable = matches!(error.kind(), ErrorKind::Solver(SolverError::Unstable { term, .. }) if *term == of);
    Promise::new("Limits of steps", "steppers that no step makes stable are refused with the term")
        .case(error)
        .holds(unstable);
}

#[test]
fn explicit_euler_with_central_advection_is_refused_and_grows() -> Result<()> {
    let n = 64;
    let (ring, neighbors) = ring(n)?;
    let scene = || AdvectionDiffusion::<1>::new().advection([1.0], pse_gradient(&ring, 2.0).unwrap());
    let error = Eulerian::new(scene(), &ring, &neighbors, Euler::new()).err().unwrap();
    refused_as_unstable(&error, Limit::Advection);
    // With diffusion beside it too: eq. 6.25 is about the advection.
    let volumes = ring.volumes()?;
    let laplacian = Pse::new(Laplacian::<1>, 2, ring.spacing()?.epsilon(2.0)?, volumes)?;
    let error = Eulerian::new(scene().diffusion(0.1, laplacian), &ring, &neighbors, Euler::new()).err().unwrap();
    refused_as_unstable(&error, Limit::Advection);

    // Eq. 6.25: the mode at kappa = sqrt 2 grows by sqrt(1 + c^2 2/e) a step.
    let (c, epsilon, steps) = (0.5, 2.0 / n as f64, 200);
    let growth = GrowthPolicy::Allow;
    let mut run = Eulerian::with_policy(scene(), &ring, &neighbors, Euler::new(), StepPolicy::Allow, growth)?;
    let mut u = spike(n);
    let start = norm(&u);
    for _ in 0..steps {
        run.step(&mut u, c * epsilon)?;
    }
    let expected = (1.0 + c * c * 2.0 / 1.0_f64.exp()).powf(f64::from(steps) / 2.0);
    // One of 64 modes holds an eighth of the spike or so.
    assert!(norm(&u) > 0.05 * expected * start && norm(&u) < expected * start, "{} {expected}", norm(&u));
    assert!(!run.ledger().within_limit && run.ledger().binding == Some(Limit::Advection));
    Ok(())
}

#[test]
fn rk4_with_central_advection_is_stable_to_3_29_and_not_beyond() -> Result<()> {
    let n = 256;
    let (ring, neighbors) = ring(n)?;
    let epsilon = 2.0 / n as f64;
    // The symbol of eq. 6.24 is at most sqrt(2/e)/epsilon.
    let sharp = Rate::oscillation((2.0 / 1.0_f64.exp()).sqrt() / epsilon);
    let start = |policy: StepPolicy| -> Result<_> {
        let scene = AdvectionDiffusion::<1>::new().advection([1.0], pse_gradient(&ring, 2.0)?);
        let run = Eulerian::new(scene, &ring, &neighbors, Rk4::new())?;
        Ok(run.sharp(Limit::Advection, sharp).step_policy(policy))
    };
    let after = |c: f64, policy: StepPolicy| -> Result<f64> {
        let (mut run, mut u) = (start(policy)?, spike(n));
        for _ in 0..2000 {
            run.step(&mut u, c * epsilon)?;
        }
        Ok(norm(&u))
    };
    let size = |text| Promise::new("Limits of steps", text);
    size("size after 2000 steps of RK4, central PSE advection at c = 3.29")
        .at_most(1.0 + 1e-10, after(3.29, StepPolicy::Refuse)?);
    size("size after 2000 steps of RK4, central PSE advection at c = 3.31")
        .at_least(10.0, after(3.31, StepPolicy::Allow)?);
    let error = start(StepPolicy::Refuse)?.step(&mut spike(n), 3.31 * epsilon).err().unwrap();
    match *error.kind() {
        ErrorKind::Solver(SolverError::Limit { dt, limit, binding: Limit::Advection }) => {
            assert!(
                dt == 3.31 * epsilon && (limit / epsilon - 2.0 * SQRT_2 / (2.0 / 1.0_f64.exp()).sqrt()).abs() < 1e-9
            );
        }
        _ => panic!("{error}"),
    }
    // Without it the row sums bind: sum_j (h/epsilon) |eta(z_j)| with eta = 2 z exp(-z^2)/sqrt(pi) at z_j = j/2, in place of
    // sqrt(2/e): 1.259 times as much.
    let scene = AdvectionDiffusion::<1>::new().advection([1.0], pse_gradient(&ring, 2.0)?);
    let rows = Eulerian::new(scene, &ring, &neighbors, Rk4::new())?.limits(&spike(n))?.rate(Limit::Advection);
    let sum: f64 = (1..=12).map(|j| 0.5 * f64::from(j)).map(|z| 2.0 * z * (-z * z).exp() / PI.sqrt()).sum();
    let safer = rows.oscillation / sharp.oscillation * (2.0 / 1.0_f64.exp()).sqrt();
    assert!((safer / sum - 1.0).abs() < 1e-12, "{safer} {sum}");
    Ok(())
}

/// The largest amplification of a mode of the ring in one step.
fn amplification<S: Scene<1, Value = f64>>(scene: S, n: usize, stepper: impl TimeScheme<1, S>, dt: f64) -> Result<f64> {
    let (ring, neighbors) = ring(n)?;
    let mut run = Eulerian::new(scene, &ring, &neighbors, stepper)?.step_policy(StepPolicy::Allow);
    // The rows are those of a circulant matrix, so one step of a unit vector holds all its eigenvalues.
    let mut u = vec![0.0; n];
    u[0] = 1.0;
    run.step(&mut u, dt)?;
    let mode = |k: usize| {
        u.iter().enumerate().fold((0.0, 0.0), |(re, im), (p, u)| {
            let (sin, cos) = (TAU * (k * p % n) as f64 / n as f64).sin_cos();
            (re + u * cos, im - u * sin)
        })
    };
    Ok((0..n).map(mode).map(|(re, im)| re.hypot(im)).fold(0.0, f64::max))
}

#[test]
fn limits_of_upwind_and_diffusion_are_sharp() -> Result<()> {
    const N: usize = 256;
    let (set, _) = ring(N)?;
    let h = 1.0 / N as f64;
    let upwind = || -> Result<_> {
        let gradient = UpwindGradient::new(set.spacing()?.epsilon(1.0)?, set.volumes()?);
        Ok(AdvectionDiffusion::<1>::new().advection([1.0], gradient))
    };
    // Errata 31: 1.1707 epsilon/v at epsilon = h with the normalized kernel, on 256 modes.
    let sharp = 1.1707 * h;
    assert!(amplification(upwind()?, N, Euler::new(), 0.99 * sharp)? <= 1.0 + 1e-10);
    assert!(amplification(upwind()?, N, Euler::new(), 1.01 * sharp)? > 1.0 + 1e-6);
    // In the limit of small h/epsilon 2/sqrt(pi) epsilon/v, which is reached at h/epsilon = 1/2.
    let limit = 2.0 / std::f64::consts::PI.sqrt() * 2.0 * h;
    let wide = || -> Result<_> {
        let gradient = UpwindGradient::new(set.spacing()?.epsilon(2.0)?, set.volumes()?).support(6.0)?;
        Ok(AdvectionDiffusion::<1>::new().advection([1.0], gradient))
    };
    assert!(amplification(wide()?, N, Euler::new(), 0.99 * limit)? <= 1.0 + 1e-10);
    assert!(amplification(wide()?, N, Euler::new(), 1.01 * limit)? > 1.0 + 1e-6);
    for order in [2, 4, 6, 8] {
        let overlap = if order == 8 { 2.0 } else { 1.5 };
        let laplacian = Pse::new(Laplacian::<1>, order, set.spacing()?.epsilon(overlap)?, set.volumes()?)?;
        let scene = || AdvectionDiffusion::<1>::new().diffusion(1.0, laplacian.clone());
        // Errata 26: lambda_max = 2 r/epsilon^2 in the limit of small h/epsilon; at h/epsilon = 2/3 the sum of the weights
        // less what the shortest wave leaves of it.
        let (ring, neighbors) = ring(N)?;
        let alternating: Vec<f64> = (0..N).map(|p| if p % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let mut du = vec![0.0; N];
        parops::Apply::apply(&laplacian.assemble(&neighbors)?, &alternating, &mut du)?;
        let sharp = 2.0 / du[1].abs();
        assert!(amplification(scene(), N, Euler::new(), 0.99 * sharp)? <= 1.0 + 1e-10, "{order}");
        assert!(amplification(scene(), N, Euler::new(), 1.01 * sharp)? > 1.0 + 1e-3, "{order}");
        // What a run allows by its rows is below, and not by more than the sum of the weights is above its symbol.
        let mut run = Eulerian::new(scene(), &ring, &neighbors, Euler::new())?;
        let allowed = run.limits(&alternating)?.step(&Euler::<Vec<f64>>::new());
        assert!(allowed <= sharp * (1.0 + 1e-12) && allowed > 0.5 * sharp, "{order} {allowed} {sharp}");
    }
    Ok(())
}

#[test]
fn methods_are_interchangeable_on_one_scene() -> Result<()> {
    const END: f64 = 0.1;
    let (d, v) = (0.01, 1.0);
    let set = Particles::lattice([0.0; 2], [1.0; 2], [48; 2])?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let (epsilon, volumes) = (set.spacing()?.epsilon(1.5)?, set.volumes()?);
    let neighbors = CellList::build(&set, &torus, Cutoff(13.0 / 48.0))?;
    let decay = (-d * TAU * TAU * END).exp();
    let exact = |x: &[f64; 2]| 1.0 + decay * (TAU * (x[0] - v * END)).sin();
    fn error<S: Scene<2, Value = f64>>(
        scene: S,
        set: &Particles<2>,
        neighbors: &impl parops::Neighbors<2>,
        exact: impl Fn(&[f64; 2]) -> f64,
    ) -> Result<f64> {
        let (steps, growth) = (StepPolicy::Refuse, GrowthPolicy::Unknown);
        let mut run = Eulerian::with_policy(scene, set, neighbors, SspRk3::new(), steps, growth)?;
        let mut u: Vec<f64> = set.points().iter().map(|x| 1.0 + (TAU * x[0]).sin()).collect();
        run.advance(&mut u, END, 2e-3)?;
        Ok(set.points().iter().zip(&u).map(|(x, u)| (u - exact(x)).abs()).fold(0.0, f64::max))
    }
    let pse = Pse::new(Laplacian::<2>, 2, epsilon.clone(), volumes)?;
    let scene = || AdvectionDiffusion::<2>::new();
    let of_pse =
        scene().diffusion(d, pse.clone()).advection([v, 0.0], Pse::new(Gradient::<2>, 2, epsilon.clone(), volumes)?);
    let window = Gaussian::<2>::new();
    let of_sph = scene()
        .diffusion(d, Sph::new(Laplacian::<2>, window.clone(), epsilon.clone(), volumes)?.form(SphForm::Difference)?)
        .advection([v, 0.0], Sph::new(Gradient::<2>, window, epsilon.clone(), volumes)?.form(SphForm::Difference)?);
    let of_dcpse =
        scene().diffusion(d, DcPse::<Laplacian<2>, 2>::new()).advection([v, 0.0], DcPse::<Gradient<2>, 2>::new());
    let of_upwind = scene().diffusion(d, pse).advection([v, 0.0], UpwindGradient::new(epsilon, volumes));
    let near = Nearest::build(&set, &torus, 20)?;
    let errors = [
        error(of_pse, &set, &neighbors, exact)?,
        error(of_sph, &set, &neighbors, exact)?,
        error(of_dcpse, &set, &near, exact)?,
        error(of_upwind, &set, &neighbors, exact)?,
    ];
    // Truncation of order 2, epsilon^2 k^3 v t / 4 and h^2 k^3 v t / 6; the upwind scheme smears by |v| epsilon/sqrt(pi).
    assert!(errors[..3].iter().all(|error| *error < 0.02), "{errors:?}");
    assert!(errors[3] > 0.03 && errors[3] < 0.08, "{errors:?}");
    Ok(())
}

#[test]
fn numerical_viscosity_of_upwind_is_reported_and_real() -> Result<()> {
    let n = 200;
    let (ring, neighbors) = ring(n)?;
    let gradient = UpwindGradient::new(ring.spacing()?.epsilon(1.0)?, ring.volumes()?);
    let scene = AdvectionDiffusion::<1>::new().advection([-0.5], gradient);
    let mut run = Eulerian::new(scene, &ring, &neighbors, Rk4::new())?;
    // Errata 35: |v| epsilon / sqrt(pi).
    let viscosity = run.discrete().numerical_viscosity(0.0);
    let reported = Promise::new("Accuracy", "numerical viscosity reported for upwind over v epsilon/sqrt(pi), less 1");
    reported.at_most(1e-14, (viscosity / (0.5 / n as f64 / PI.sqrt()) - 1.0).abs());
    let mut u: Vec<f64> = ring.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let start = norm(&u);
    run.advance(&mut u, 1.0, 1e-3)?;
    let decay = (norm(&u) / start).ln() / (TAU * TAU);
    // At epsilon = h the lattice has 1.8 % more of it than the integral.
    Promise::new("Accuracy", "numerical viscosity seen in an upwind run over the one reported").within(
        0.95,
        1.05,
        -decay / viscosity,
    );
    Ok(())
}

#[test]
fn inflow_comes_in_and_outflow_leaves_as_the_flow_turns() -> Result<()> {
    // u = f(x - s(t)) with ds/dt = v = cos t; both ends are inflow in turns.
    let f = |s: f64| 1.0 + 0.3 * (5.0 * s).sin();
    let mut errors = Vec::new();
    for n in [100, 200] {
        let line = Particles::lattice([0.0], [1.0], [n])?;
        let gradient = UpwindGradient::new(line.spacing()?.epsilon(1.0)?, line.volumes()?);
        let neighbors = CellList::build(&line, &Domain::open(), gradient.cutoff())?;
        let ends = [(0, [-1.0]), (n - 1, [1.0])];
        let scene = AdvectionDiffusion::<1>::new()
            .advection(|_: &[f64; 1], t: f64| [t.cos()], gradient.clone())
            .boundary(Boundary::new(1).inflow(ends), move |_, x, t| f(x[0] - t.sin()));
        let mut run = Eulerian::new(scene, &line, &neighbors, SspRk3::new())?;
        let mut u: Vec<f64> = line.points().iter().map(|x| f(x[0])).collect();
        run.advance(&mut u, 3.0, 0.5 / n as f64)?;
        let worst = line.points().iter().zip(&u).map(|(x, u)| (u - f(x[0] - 3.0_f64.sin())).abs());
        errors.push(worst.fold(0.0, f64::max));

        // Without them the particle that the flow comes in at is named.
        let scene = AdvectionDiffusion::<1>::new().advection([-1.0], gradient);
        let error = Eulerian::new(scene, &line, &neighbors, Euler::new()).err().unwrap();
        let expected = SolverError::NoUpstream { axis: 0, velocity: -1.0 };
        assert_eq!((error.kind(), error.particle()), (&ErrorKind::Solver(expected), Some(n - 1)));
    }
    assert!(errors[0] < 0.1, "{errors:?}");
    Promise::new("Orders", "upwind runs fed by inflow at either end in turns").within(
        0.8,
        1.2,
        (errors[0] / errors[1]).log2(),
    );
    Ok(())
}

#[test]
fn mirrors_hold_values_or_fluxes() -> Result<()> {
    let (n, d, end) = (80, 0.5, 0.1);
    let rod = Particles::lattice([0.0], [1.0], [n])?;
    let laplacian = Pse::new(Laplacian::<1>, 4, rod.spacing()?.epsilon(1.5)?, rod.volumes()?)?;
    let decay = (-d * PI * PI * end).exp();
    for face in [Face::MirrorEven, Face::MirrorOdd] {
        let wave = if face == Face::MirrorEven { f64::cos } else { f64::sin };
        let neighbors = CellList::build(&rod, &Domain::new([0.0], [1.0], [[face; 2]])?, laplacian.cutoff())?;
        let scene = AdvectionDiffusion::<1>::new().diffusion(d, laplacian.clone());
        let mut run = Eulerian::new(scene, &rod, &neighbors, Rk4::new())?;
        let mut u: Vec<f64> = rod.points().iter().map(|x| wave(PI * x[0])).collect();
        run.advance(&mut u, end, 2e-4)?;
        let worst = rod.points().iter().zip(&u).map(|(x, u)| (u - decay * wave(PI * x[0])).abs()).fold(0.0, f64::max);
        Promise::new("Accuracy", "heat between mirrors, PSE of order 4, h = 1/80")
            .case(format!("{face:?}"))
            .at_most(1e-6, worst);
        // Only even mirrors keep what is between them.
        let drift = run.ledger().fields[0].drift.abs();
        if face == Face::MirrorEven {
            Promise::new("Conservation", "mass of heat between even mirrors, PSE").at_most(1e-14, drift);
        } else {
            assert!(drift >= 1e-14, "{drift}");
        }
    }
    Ok(())
}
