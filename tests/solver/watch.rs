//! What a run refuses to go on with, and whom it names: overlap, drift, the particle that sets a limit.

use std::f64::consts::TAU;

use parops::{
    AdvectionDiffusion, Carried, CellList, DcPse, Domain, ErrorKind, Euler, Eulerian, Lagrangian, Lambda, Laplacian,
    Limit, Mesh, MovingScene, Nearest, OverlapWatch, Particles, Remeshing, Rk4, SolverError, Steady, Trigger,
    testing::Promise,
};

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn swirls() -> impl MovingScene<2, Value = f64> {
    AdvectionDiffusion::<2>::new().advection(
        Steady(|x: &[f64; 2]| {
            let [a, b] = x.map(|x| TAU * x);
            [a.sin() * b.cos(), -a.cos() * b.sin()]
        }),
        Carried,
    )
}

const SIDE: usize = 24;

fn watch(every: u64, hole: f64, gap: f64) -> OverlapWatch<2> {
    OverlapWatch { mesh: Mesh::nodes(&torus(), [SIDE; 2]).unwrap(), every, hole, gap }
}

fn start() -> (Particles<2>, Vec<f64>) {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [SIDE; 2]).unwrap();
    let u = set.points().iter().map(|x| 1.0 + 0.5 * (TAU * x[0]).sin()).collect();
    (set, u)
}

#[test]
fn watched_run_refuses_lost_overlap_and_is_what_it_was_before_the_step() {
    let (set, u) = start();
    let mut run =
        Lagrangian::new(swirls(), &set, &u, &torus(), Rk4::new()).unwrap().watching(watch(1, 1.2, 0.4)).unwrap();
    assert_eq!((run.ledger().hole, run.ledger().gap), (None, None));
    let mut points = Vec::new();
    let mut rows = 0;
    let error = run
        .advance_with(1.0, 0.02, |row, run| {
            rows += 1;
            assert!(
                (0.5..=1.2).contains(&row.hole.unwrap()) && (0.4..=1.0 + 1e-9).contains(&row.gap.unwrap()),
                "{row:?}"
            );
            points = run.points().to_vec();
        })
        .unwrap_err();
    let ErrorKind::Solver(SolverError::OverlapLost { hole, most, gap, least }) = *error.kind() else {
        panic!("{error}")
    };
    assert!((most, least) == (1.2, 0.4) && (hole > most || gap < least));
    let kept = run.points() == points && run.ledger().step == rows;
    Promise::new("Input", "watched runs refuse lost overlap and stay as before the step").holds(rows > 2 && kept);
}

#[test]
fn watched_run_goes_on_where_remeshing_comes_first() {
    let (set, u) = start();
    let mesh = Mesh::nodes(&torus(), [SIDE; 2]).unwrap();
    let trigger = Trigger::Overlap { hole: 1.0, gap: 0.7 };
    let mut run = Lagrangian::new(swirls(), &set, &u, &torus(), Rk4::new())
        .unwrap()
        .watching(watch(3, 1.2, 0.4))
        .unwrap()
        .remeshing(Remeshing { kernel: Lambda::<4, 2>::new().unwrap(), mesh, trigger, threshold: 0.0 })
        .unwrap();
    let row = run.advance(0.6, 0.02).unwrap();
    assert!(row.remeshings > 0 && row.hole.is_some_and(|hole| hole <= 1.0) && row.gap.is_some_and(|gap| gap >= 0.7));
}

#[test]
fn illegal_watches_and_budgets_are_refused() {
    let (set, u) = start();
    let run = || Lagrangian::new(swirls(), &set, &u, &torus(), Rk4::new()).unwrap();
    for (illegal, value) in
        [(watch(0, 1.0, 0.5), 0.0), (watch(1, 0.5, 0.5), 0.5), (watch(1, 1.0, 1.0), 1.0), (watch(1, 1.0, -0.1), -0.1)]
    {
        let error = run().watching(illegal).err().unwrap();
        assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Trigger { value }));
    }
    for value in [0.0, -1.0] {
        let error = run().drift_budget(value).err().unwrap();
        assert_eq!(*error.kind(), ErrorKind::Solver(SolverError::Budget { value }));
    }
    assert!(run().drift_budget(f64::NAN).is_err() && run().watching(watch(1, f64::NAN, 0.5)).is_err());
}

#[test]
fn drift_above_its_budget_is_refused_and_the_field_kept() {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.3, 3).unwrap();
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let around = Nearest::build(&set, &torus(), laplacian.fewest_neighbors::<2>().unwrap()).unwrap();
    let scene = || AdvectionDiffusion::<2>::new().diffusion(1.0, laplacian.clone());
    let start: Vec<f64> = set.points().iter().map(|x| 1.0 + (TAU * x[0]).sin() * (TAU * x[1]).cos()).collect();
    let dt = 0.1 / 256.0;

    let mut free = Eulerian::new(scene(), &set, &around, Euler::new()).unwrap();
    let mut u = start.clone();
    let mut drifts = Vec::new();
    free.advance_with(&mut u, 40.0 * dt, dt, |row, _| drifts.push(row.fields[0].drift.abs() / row.fields[0].size))
        .unwrap();
    assert_eq!(free.ledger().budget, f64::INFINITY);
    let budget = 0.5 * drifts.iter().fold(0.0, |most: f64, drift| most.max(*drift));
    assert!(budget > 1e-6, "{budget}");
    let steps = drifts.iter().take_while(|drift| **drift <= budget).count();

    let mut bounded = Eulerian::new(scene(), &set, &around, Euler::new()).unwrap().drift_budget(budget).unwrap();
    let mut field = start.clone();
    let mut before = start.clone();
    let error = bounded.advance_with(&mut field, 40.0 * dt, dt, |_, u| before.copy_from_slice(u)).unwrap_err();
    let ErrorKind::Solver(SolverError::Drift { field: 0, drift, size, budget: limit }) = *error.kind() else {
        panic!("{error}")
    };
    let kept = drift.abs() > budget * size && limit == budget && field == before;
    Promise::new("Input", "steps that drift above their budget are refused and leave the field")
        .holds(kept && bounded.ledger().step as usize == steps);

    // What conserves keeps to any budget that rounding allows.
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [24; 2]).unwrap();
    let moving = AdvectionDiffusion::<2>::new().advection([0.3, 0.1], Carried);
    let u = vec![1.0; lattice.len()];
    let mut run = Lagrangian::new(moving, &lattice, &u, &torus(), Rk4::new()).unwrap().drift_budget(1e-14).unwrap();
    assert_eq!(run.advance(1.0, 0.1).unwrap().budget, 1e-14);
}

#[test]
fn refused_step_names_the_particle_that_sets_its_limit() {
    // dv/dx = 0.5 cos x is largest at x = 0.
    let ring = Domain::periodic([-3.0], [TAU - 3.0]).unwrap();
    let set = Particles::new((0..64).map(|i| [-3.0 + TAU * f64::from(i) / 64.0]).collect()).unwrap();
    let set = set.with_equal_volumes(TAU).unwrap();
    let scene = AdvectionDiffusion::<1>::new()
        .advection(Steady(|x: &[f64; 1]| [1.0 + 0.5 * x[0].sin()]), Carried)
        .divergence(|x: &[f64; 1], _: f64| 0.5 * x[0].cos());
    let mut run = Lagrangian::new(scene, &set, &vec![1.0; 64], &ring, Rk4::new()).unwrap();
    let error = run.step(1.1).unwrap_err();
    let nearest = (0..64).min_by(|&a, &b| set.points()[a][0].abs().total_cmp(&set.points()[b][0].abs())).unwrap();
    assert_eq!(error.particle(), Some(nearest));
    assert_eq!(run.limits().unwrap().particle(Limit::Distortion), Some(nearest));
    assert!(matches!(error.kind(), ErrorKind::Solver(SolverError::Limit { binding: Limit::Distortion, .. })));

    // The source decays fastest at the last particle.
    let set = Particles::lattice([0.0; 2], [1.0; 2], [8; 2]).unwrap();
    let around = CellList::build(&set, &torus(), parops::Cutoff(0.2)).unwrap();
    let source = |x: &[f64; 2], _: f64, u: f64| -100.0 * (x[0] + x[1]) * u;
    let scene = AdvectionDiffusion::<2>::new().source(source);
    let mut run = Eulerian::new(scene, &set, &around, Euler::new()).unwrap();
    let mut u = vec![1.0; 64];
    let error = run.step(&mut u, 0.1).unwrap_err();
    assert_eq!((error.particle(), u == vec![1.0; 64]), (Some(63), true));
}
