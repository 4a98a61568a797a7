//! Moving particles that are replaced by those of a mesh: orders, conservation, triggers, refusals.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Allowance, Carried, CellList, Cutoff, DcPse, Domain, DomainError, Error, ErrorKind, Euler,
    Face, Lagrangian, Lambda, Laplacian, Limit, Mesh, MeshError, MeshKernel, MovingState, OperatorError, ParticleError,
    Particles, Pse, Remeshing, Result, Rk4, SolverError, Spacing, Steady, StepPolicy, Trigger, fill_distance,
    least_gap, testing::Promise,
};

const EPS: f64 = f64::EPSILON;

fn every_step<const D: usize, K>(kernel: K, mesh: Mesh<D>) -> Remeshing<D, K> {
    Remeshing { kernel, mesh, trigger: Trigger::Steps(1), threshold: 0.0 }
}

/// Where a particle of the flow 1 + sin(x)/2 was a time t before.
pub(super) fn origin(x: f64, t: f64) -> f64 {
    const STEPS: u32 = 150;
    let (mut x, dt) = (x, -t / f64::from(STEPS));
    let v = |x: f64| 1.0 + 0.5 * x.sin();
    for _ in 0..STEPS {
        let a = v(x);
        let b = v(x + 0.5 * dt * a);
        let c = v(x + 0.5 * dt * b);
        let d = v(x + dt * c);
        x += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    x
}

/// The least-squares slope of log(error) over log(h).
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), (h, e)| (x + h.ln() / n, y + e.ln() / n));
    let (mut above, mut below) = (0.0, 0.0);
    for (h, e) in points {
        above += (h.ln() - mx) * (e.ln() - my);
        below += (h.ln() - mx).powi(2);
    }
    above / below
}

/// The L2 error at t = 6, before which the finer details of the start still bend the slopes, of u_t + (v u)_x = 0, v =
/// 1 + sin(x)/2, on a ring of n nodes with CFL = 1.5 dt/h.
fn compressive<const P: usize, const R: usize, const S: usize>(n: usize, cfl: f64) -> (f64, f64)
where
    Lambda<P, R>: MeshKernel<f64, S>,
{
    const END: f64 = 6.0;
    let ring = Domain::periodic([0.0], [TAU]).unwrap();
    let mesh = Mesh::nodes(&ring, [n]).unwrap();
    let h = mesh.spacings()[0];
    let particles = Particles::new(mesh.points().collect()).unwrap().with_equal_volumes(TAU).unwrap();
    let start = |x: f64| x.sin().exp();
    let u: Vec<f64> = particles.points().iter().map(|x| start(x[0])).collect();
    let scene = AdvectionDiffusion::<1>::new()
        .advection(Steady(|x: &[f64; 1]| [1.0 + 0.5 * x[0].sin()]), Carried)
        .divergence(|x: &[f64; 1], _: f64| 0.5 * x[0].cos());
    let mut run = Lagrangian::new(scene, &particles, &u, &ring, Rk4::new())
        .unwrap()
        .courant(0.99)
        .unwrap()
        .remeshing(every_step(Lambda::<P, R>::new().unwrap(), mesh))
        .unwrap();
    run.advance(END, cfl * h / 1.5).unwrap();
    assert_eq!(run.ledger().remeshings, run.ledger().step);
    let v = |x: f64| 1.0 + 0.5 * x.sin();
    let square: f64 = run
        .points()
        .iter()
        .zip(run.values())
        .map(|([x], u)| {
            let from = origin(*x, END);
            (u - start(from) * v(from) / v(*x)).powi(2)
        })
        .sum();
    (h, (square * h).sqrt())
}

#[test]
fn remeshed_runs_keep_the_order_of_the_kernel_in_a_compressive_flow() {
    const GRIDS: [usize; 6] = [96, 128, 192, 256, 384, 512];
    fn check<const P: usize, const R: usize, const S: usize>(expected: f64)
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        for cfl in [1.0, 2.0, 3.4] {
            let errors: Vec<_> = GRIDS.iter().map(|&n| compressive::<P, R, S>(n, cfl)).collect();
            let order = slope(&errors);
            println!("({P}, {R}) CFL {cfl}: order {order:.3}, errors {:.2e} to {:.2e}", errors[0].1, errors[5].1);
            // What the regularity warrants, and no more than the exactness P: one remeshing misses by h^(P+1).
            let promise = Promise::new("Orders", format!("remeshed runs in a compressive flow, Lambda({P}, {R})"));
            promise.within(expected, P as f64 + 0.5, order);
        }
    }
    check::<2, 1, 4>(1.9);
    check::<2, 2, 4>(1.9);
    check::<4, 2, 6>(2.9);
    check::<4, 4, 6>(3.9);
}

/// A set that a scene leaves where it is, remeshed once.
fn at_rest<const D: usize>() -> impl parops::MovingScene<D, Value = f64> {
    AdvectionDiffusion::<D>::new().advection([0.0; D], Carried)
}

#[test]
fn remeshing_keeps_the_mass_to_rounding_and_the_moments_to_the_exactness() {
    fn check<const P: usize, const R: usize, const S: usize>()
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        for seed in 0..8 {
            let bounded = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2]; 2]).unwrap();
            let particles = Particles::jittered([0.25; 2], [0.75; 2], [9; 2], 0.4, seed).unwrap();
            let u: Vec<f64> = particles.points().iter().map(|x| (9.0 * x[0]).sin() - x[1]).collect();
            let mesh = Mesh::nodes(&bounded, [31; 2]).unwrap();
            let mut run = Lagrangian::new(at_rest::<2>(), &particles, &u, &bounded, Euler::new())
                .unwrap()
                .remeshing(every_step(Lambda::<P, R>::new().unwrap(), mesh))
                .unwrap();
            let moment = |points: &[[f64; 2]], omega: &[f64], a: i32, b: i32| -> f64 {
                points.iter().zip(omega).map(|(x, omega)| omega * x[0].powi(a) * x[1].powi(b)).sum()
            };
            let (points, omega) = (run.points().to_vec(), run.strengths().to_vec());
            let size: f64 = omega.iter().map(|omega| omega.abs()).sum();
            run.step(0.1).unwrap();
            for a in 0..=P as i32 {
                for b in 0..=P as i32 - a {
                    let (before, after) = (moment(&points, &omega, a, b), moment(run.points(), run.strengths(), a, b));
                    let kept = |text| Promise::new("Conservation", text).in_units("eps sum abs", EPS * size);
                    let apart = (after - before).abs();
                    if a + b == 0 {
                        kept("mass under one remeshing in 2D").at_most(4.0 * 2.0, apart);
                    } else {
                        kept("moments to the exactness under one remeshing").at_most(64.0, apart);
                    }
                }
            }
            assert!(run.ledger().fields[0].drift.abs() <= 8.0 * EPS * size);
            assert_eq!(run.ledger().remeshings, 1);
        }
    }
    check::<2, 1, 4>();
    check::<4, 2, 6>();
    check::<4, 4, 6>();
    check::<6, 4, 8>();
}

/// The steady cellular flow of one period, whose stagnation points tear holes.
fn cells(x: &[f64; 2]) -> [f64; 2] {
    let [a, b] = x.map(|x| TAU * x);
    [a.sin() * b.cos(), -a.cos() * b.sin()]
}

#[test]
fn cellular_flow_tears_holes_that_remeshing_by_overlap_closes() -> Result<()> {
    const N: usize = 32;
    const H: f64 = 1.0 / N as f64;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [N; 2])?;
    let u = vec![1.0; N * N];
    let scene = || AdvectionDiffusion::<2>::new().advection(Steady(cells), Carried);
    let probes: Vec<_> = Mesh::nodes(&torus, [2 * N; 2])?.points().collect();
    let hole = |particles: &Particles<2>| -> Result<f64> {
        Ok(fill_distance(&CellList::build_at(&probes, particles, &torus, Cutoff(12.0 * H))?) / H)
    };
    let gap = |particles: &Particles<2>| -> Result<f64> {
        Ok(least_gap(&CellList::build(particles, &torus, Cutoff(2.0 * H))?) / H)
    };
    assert!((hole(&particles)? - 0.5 * 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((gap(&particles)? - 1.0).abs() < 1e-12);

    let mut free = Lagrangian::new(scene(), &particles, &u, &torus, Rk4::new())?;
    free.advance(0.4, 0.02)?;
    let (torn, squeezed) = (hole(&free.particles()?)?, gap(&free.particles()?)?);
    assert!(torn > 1.5 && squeezed < 0.4, "hole {torn}, gap {squeezed}");

    let trigger = Trigger::Overlap { hole: 1.0, gap: 0.6 };
    let mesh = Mesh::cells(&torus, [N; 2])?;
    let kernel = Lambda::<4, 2>::new()?;
    let mut run = Lagrangian::new(scene(), &particles, &u, &torus, Rk4::new())?.remeshing(Remeshing {
        kernel: kernel.clone(),
        mesh,
        trigger,
        threshold: 0.0,
    })?;
    let mut worst = (0.0_f64, f64::INFINITY);
    run.advance_with(0.4, 0.02, |_, run| {
        let particles = run.particles().unwrap();
        worst = (worst.0.max(hole(&particles).unwrap()), worst.1.min(gap(&particles).unwrap()));
    })?;
    // Probes twice as dense as those of the trigger find holes wider by their spacing.
    assert!(worst.0 <= 1.0 + 0.5 && worst.1 >= 0.6, "{worst:?}");
    let remeshings = run.ledger().remeshings;
    assert!((2..20).contains(&remeshings), "{remeshings}");

    // A translation distorts nothing.
    let scene = AdvectionDiffusion::<2>::new().advection([0.7, 0.3], Carried);
    let mut carried = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?.remeshing(Remeshing {
        kernel,
        mesh,
        trigger,
        threshold: 0.0,
    })?;
    carried.advance(1.0, 0.05)?;
    assert_eq!(carried.ledger().remeshings, 0);
    Ok(())
}

#[test]
fn rows_out_of_condition_trigger_a_remeshing() -> Result<()> {
    const N: usize = 16;
    const LIMIT: f64 = 4.0;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [N; 2])?;
    let u: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let run = |trigger: Trigger| -> Result<_> {
        let scene = AdvectionDiffusion::<2>::new()
            .diffusion(1e-4, DcPse::<Laplacian<2>, 2>::new())
            .advection(Steady(cells), Carried);
        let mesh = Mesh::cells(&torus, [N; 2])?;
        Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?
            .step_policy(StepPolicy::Adapt { most: 20 })
            .remeshing(Remeshing { kernel: Lambda::<2, 2>::new()?, mesh, trigger, threshold: 0.0 })
    };
    let (mut kept, mut left) = (run(Trigger::Condition(LIMIT))?, run(Trigger::Steps(1000))?);
    let (mut worst_kept, mut worst_left) = (0.0_f64, 0.0_f64);
    left.advance_with(0.8, 0.02, |row, _| worst_left = worst_left.max(row.condition))?;
    kept.advance_with(0.8, 0.02, |row, _| worst_kept = worst_kept.max(row.condition))?;
    println!("conditions {worst_kept} {worst_left} {}", kept.ledger().remeshings);
    assert!(worst_kept <= LIMIT && worst_left > 1.2 * LIMIT);
    assert!(kept.ledger().remeshings >= 1 && left.ledger().remeshings == 0);
    Ok(())
}

#[test]
fn dropped_strength_is_counted_and_completes_the_mass() -> Result<()> {
    let bounded = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2]; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [40; 2])?;
    let blob = |x: &[f64; 2]| (-((x[0] - 0.4).powi(2) + (x[1] - 0.5).powi(2)) / 0.005).exp();
    let u: Vec<[f64; 2]> = particles.points().iter().map(|x| [blob(x), -2.0 * blob(x)]).collect();
    // Particles near the faces would leave the mesh: only what has strength is taken along.
    let strong: Vec<usize> = (0..u.len()).filter(|&p| u[p][0] > 1e-6).collect();
    let points = strong.iter().map(|&p| particles.points()[p]).collect();
    let volume = particles.volumes()?.get(0)?;
    let particles = Particles::new(points)?.with_equal_volumes(volume * strong.len() as f64)?;
    let u: Vec<[f64; 2]> = strong.iter().map(|&p| u[p]).collect();
    let scene = AdvectionDiffusion::<2>::new().fields::<[f64; 2]>().advection([0.05, 0.0], Carried);
    let mesh = Mesh::nodes(&bounded, [41; 2])?;
    let remeshing = Remeshing { kernel: Lambda::<4, 2>::new()?, mesh, trigger: Trigger::Steps(1), threshold: 1e-8 };
    let mut run = Lagrangian::new(scene, &particles, &u, &bounded, Rk4::new())?.remeshing(remeshing)?;
    let before: Vec<f64> = run.ledger().fields.iter().map(|field| field.mass).collect();
    run.advance(1.0, 0.1)?;
    for (field, before) in run.ledger().fields.iter().zip(before) {
        assert!(field.dropped != 0.0 && field.dropped_size >= field.dropped.abs());
        assert!((field.drift + field.dropped).abs() <= 10.0 * 8.0 * EPS * field.size, "{field:?}");
        assert!((field.mass - before).abs() <= 1e-4 * field.size);
    }
    assert!(run.points().len() < mesh.len() / 2);
    let mut text = Vec::new();
    let mut ledger = parops::Ledger::default();
    ledger.push(run.ledger());
    ledger.write_csv(&mut text)?;
    let text = String::from_utf8(text).unwrap();
    let columns = |line: &str| line.split(',').count();
    let mut lines = text.lines();
    let (names, values) = (lines.next().unwrap(), lines.next().unwrap());
    assert!(names.contains("remeshings,rebuilds") && names.contains("dropped_1,dropped_size_1"));
    assert_eq!(columns(names), columns(values));
    Ok(())
}

/// What a run looks like from outside, bit for bit.
fn picture<const D: usize, S: parops::MovingScene<D, Value = f64>, St: parops::Stepper<MovingState<D, f64>>>(
    run: &Lagrangian<D, S, St>,
) -> (Vec<[u64; D]>, Vec<u64>, Vec<u64>, u64, String) {
    (
        run.points().iter().map(|x| x.map(f64::to_bits)).collect(),
        run.strengths().iter().map(|x| x.to_bits()).collect(),
        run.volumes().iter().map(|x| x.to_bits()).collect(),
        run.time().to_bits(),
        // Not a number equals itself as text.
        format!("{:?}", run.ledger()),
    )
}

#[test]
fn support_beyond_a_bounded_mesh_is_refused_and_changes_nothing() -> Result<()> {
    let bounded = Domain::new([0.0], [1.0], [[Face::Open; 2]])?;
    let particles = Particles::new(vec![[0.5], [0.8]])?.with_equal_volumes(0.1)?;
    let scene = || AdvectionDiffusion::<1>::new().advection([1.0], Carried);
    let mesh = Mesh::nodes(&bounded, [21])?;
    let mut run = Lagrangian::new(scene(), &particles, &[1.0, 2.0], &bounded, Rk4::new())?.remeshing(Remeshing {
        kernel: Lambda::<4, 2>::new()?,
        mesh,
        trigger: Trigger::Steps(2),
        threshold: 0.0,
    })?;
    run.step(0.07)?;
    let before = picture(&run);
    let error = run.step(0.07).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Mesh(MeshError::Support { axis: 0, .. })), "{error}");
    assert_eq!((error.particle(), picture(&run)), (Some(1), before));

    let mut run = Lagrangian::new(scene(), &particles, &[1.0, 2.0], &bounded, Rk4::new())?;
    let before = picture(&run);
    let error = run.step(0.25).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Domain(DomainError::Outside { axis: 0, .. })), "{error}");
    assert_eq!((error.particle(), picture(&run)), (Some(1), before));
    Ok(())
}

#[test]
fn remeshing_that_does_not_fit_is_refused_at_construction() -> Result<()> {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [32; 2])?;
    let u = vec![1.0; 1024];
    let refused = |order: u32, mesh: Mesh<2>, trigger: Trigger, threshold: f64| -> Option<Error> {
        let pse =
            Pse::new(Laplacian::<2>, order, Spacing(1.0 / 32.0).epsilon(1.5).unwrap(), particles.volumes().unwrap());
        let scene = AdvectionDiffusion::<2>::new()
            .diffusion(1e-3, pse.unwrap().allow(Allowance::Everywhere))
            .advection([1.0, 0.0], Carried);
        let run = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new()).unwrap();
        run.remeshing(Remeshing { kernel: Lambda::<2, 1>::new().unwrap(), mesh, trigger, threshold }).err()
    };
    let mesh = |n: usize| Mesh::cells(&torus, [n; 2]).unwrap();
    let kind = |error: Option<Error>| error.map(|error| error.kind().clone());
    let steps = Trigger::Steps(3);
    assert_eq!(refused(2, mesh(32), steps, 0.0), None);
    let exactness = Error::from(SolverError::Exactness { exactness: 2, order: 4 });
    assert_eq!(refused(4, mesh(32), steps, 0.0), Some(exactness));
    let overlap = kind(refused(2, mesh(20), steps, 0.0));
    assert!(matches!(overlap, Some(ErrorKind::Operator(OperatorError::Overlap { .. }))), "{overlap:?}");
    let open = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2]; 2])?;
    let axis = kind(refused(2, Mesh::cells(&open, [32; 2])?, steps, 0.0));
    assert!(matches!(axis, Some(ErrorKind::Solver(SolverError::MeshAxis { axis: 0, .. }))), "{axis:?}");
    let wider = Domain::periodic([0.0; 2], [1.0, 2.0])?;
    let axis = kind(refused(2, Mesh::cells(&wider, [32, 64])?, steps, 0.0));
    assert!(matches!(axis, Some(ErrorKind::Solver(SolverError::MeshAxis { axis: 1, .. }))), "{axis:?}");
    let threshold = kind(refused(2, mesh(32), steps, -1.0));
    assert!(matches!(threshold, Some(ErrorKind::Mesh(MeshError::Threshold { .. }))), "{threshold:?}");
    let triggers = [
        Trigger::Steps(0),
        Trigger::Overlap { hole: 0.7, gap: 0.5 },
        Trigger::Overlap { hole: f64::NAN, gap: 0.5 },
        Trigger::Overlap { hole: 2.0, gap: 1.0 },
        Trigger::Overlap { hole: 2.0, gap: 0.0 },
        // Rows of PSE solve no systems.
        Trigger::Condition(100.0),
    ];
    for trigger in triggers {
        let found = kind(refused(2, mesh(32), trigger, 0.0));
        assert!(matches!(found, Some(ErrorKind::Solver(SolverError::Trigger { .. }))), "{trigger:?}: {found:?}");
    }
    Ok(())
}

#[test]
fn mesh_too_coarse_for_rows_of_dcpse_is_refused_and_so_are_velocities_of_particles() -> Result<()> {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let u = vec![1.0; 256];
    let kernel = Lambda::<2, 1>::new()?;
    let mesh = |n: usize| Mesh::cells(&torus, [n; 2]).unwrap();
    let scene = || {
        AdvectionDiffusion::<2>::new().diffusion(1e-3, DcPse::<Laplacian<2>, 2>::new()).advection([1.0, 0.0], Carried)
    };
    let run = || Lagrangian::new(scene(), &particles, &u, &torus, Rk4::new());
    assert!(run()?.remeshing(every_step(kernel.clone(), mesh(16))).is_ok());
    let coarse = run()?.remeshing(every_step(kernel.clone(), mesh(6))).err().map(|error| error.kind().clone());
    assert!(matches!(coarse, Some(ErrorKind::Operator(OperatorError::TooFew { .. }))), "{coarse:?}");
    let scene = AdvectionDiffusion::<2>::new().advection(vec![[1.0, 0.0]; 256], Carried);
    let own = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?.remeshing(every_step(kernel, mesh(16)));
    let own = own.err().map(|error| error.kind().clone());
    assert!(matches!(own, Some(ErrorKind::Particle(ParticleError::Length { found: 256, needed: 257 }))), "{own:?}");
    Ok(())
}

/// Largest error at t = 0.25 of a wave that is carried and decays, with PSE of order 4 remeshed every step.
fn decaying_wave(n: usize) -> Result<f64> {
    const NU: f64 = 0.01;
    const END: f64 = 0.25;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let wave = |x: &[f64; 2], t: f64| {
        (-2.0 * NU * TAU * TAU * t).exp() * (TAU * (x[0] - 0.8 * t)).sin() * (TAU * (x[1] - 0.5 * t)).cos()
    };
    let u: Vec<f64> = particles.points().iter().map(|x| wave(x, 0.0)).collect();
    let pse = Pse::new(Laplacian::<2>, 4, particles.spacing()?.epsilon(1.6)?, particles.volumes()?)?;
    let scene = AdvectionDiffusion::<2>::new().diffusion(NU, pse).advection([0.8, 0.5], Carried);
    let mesh = Mesh::cells(&torus, [n; 2])?;
    let mut run = Lagrangian::new(scene, &particles, &u, &torus, Rk4::new())?
        .step_policy(StepPolicy::Adapt { most: 100 })
        .remeshing(every_step(Lambda::<4, 4>::new()?, mesh))?;
    run.advance(END, 1.3 / n as f64)?;
    let errors = run.points().iter().zip(run.values()).map(|(x, u)| (u - wave(x, END)).abs());
    Ok(errors.fold(0.0, f64::max))
}

#[test]
fn carried_wave_decays_at_the_order_of_pse() -> Result<()> {
    let errors = [24, 32, 48].map(|n| decaying_wave(n).map(|error| (1.0 / n as f64, error)));
    let errors = errors.into_iter().collect::<Result<Vec<_>>>()?;
    let order = slope(&errors);
    println!("{errors:?} {order}");
    assert!((3.7..4.6).contains(&order), "{order}");
    Ok(())
}

#[test]
fn lagrangian_cfl_binds_remeshed_runs_too() -> Result<()> {
    let ring = Domain::periodic([0.0], [TAU])?;
    let mesh = Mesh::nodes(&ring, [64])?;
    let particles = Particles::new(mesh.points().collect())?.with_equal_volumes(TAU)?;
    let scene = AdvectionDiffusion::<1>::new()
        .advection(Steady(|x: &[f64; 1]| [1.0 + 0.5 * x[0].sin()]), Carried)
        .computed_divergence();
    let mut run = Lagrangian::new(scene, &particles, &[1.0; 64], &ring, Rk4::new())?
        .remeshing(every_step(Lambda::<4, 2>::new()?, mesh))?;
    // dt 0.5 |cos x| = 1.2 is beyond anything; 0.5 is the default limit.
    let error = run.step(2.4).unwrap_err();
    let ErrorKind::Solver(SolverError::Limit { dt, limit, binding }) = error.kind() else { panic!("{error}") };
    assert_eq!((*dt, *binding), (2.4, Limit::Distortion));
    assert!((limit - 1.0).abs() < 1e-8, "{limit}");
    run.step(0.99)?;
    Ok(())
}

#[test]
fn set_whose_strength_is_all_dropped_goes_on_empty() -> Result<()> {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let scene =
        AdvectionDiffusion::<2>::new().diffusion(1e-3, DcPse::<Laplacian<2>, 2>::new()).advection([1.0, 0.0], Carried);
    let remeshing = Remeshing {
        kernel: Lambda::<2, 1>::new()?,
        mesh: Mesh::cells(&torus, [16; 2])?,
        trigger: Trigger::Steps(1),
        threshold: 1.0,
    };
    let mut run = Lagrangian::new(scene, &particles, &[1.0; 256], &torus, Rk4::new())?.remeshing(remeshing)?;
    run.step(0.01)?;
    assert!(run.points().is_empty());
    run.step(0.01)?;
    let field = &run.ledger().fields[0];
    assert_eq!((field.mass, run.ledger().remeshings), (0.0, 2));
    assert!((field.dropped - 1.0).abs() <= 8.0 * EPS && field.drift == -1.0);
    Ok(())
}
