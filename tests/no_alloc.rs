//! Nothing allocates where nothing should: a counting allocator under the whole test.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use parops::{
    Allowance, CellList, D2, DivTensorGrad, Domain, Epsilon, Euler, Gradient, Hessian, Laplacian, Leapfrog, Method,
    Neighbors, OneSided, Particles, Pse, Rk4, Rkl2, Side, Sph, SspRk3, Stencil, Stepper, Upwind, testing::Promise,
};
#[cfg(not(feature = "rayon"))]
use parops::{
    Apply, BiCgStab, BoundaryCondition, BoundaryRows, CsrMatrix, Gmres, Implicit, NeighborList, Rows, SparseSolver,
    Strided,
};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    // While a thread ends its counter may be gone; nothing is measured then.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is handed to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often this thread allocates in `f`.
fn allocations(f: impl FnOnce()) -> usize {
    let before = COUNT.get();
    f();
    COUNT.get() - before
}

/// Allocations that a promise says there are none of.
fn none(what: &'static str, f: impl FnOnce()) {
    let count = allocations(f);
    Promise::new("Allocations", what).at_most(0.0, count as f64);
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![0_u8; 100]))), 1);
    assert_eq!(allocations(|| {}), 0);
}

#[test]
fn steps_after_the_first_allocate_nothing() {
    let steppers: [Box<dyn Stepper<Vec<[f64; 2]>>>; 5] = [
        Box::new(Euler::new()),
        Box::new(Rk4::new()),
        Box::new(Leapfrog::new()),
        Box::new(SspRk3::new()),
        Box::new(Rkl2::new(5).unwrap().with_substeps(3)),
    ];
    for mut stepper in steppers {
        let mut u = vec![[1.0, 0.0]; 1000];
        let mut steps = |stepper: &mut dyn Stepper<_>, start: f64, dt: f64, n: u32| {
            for step in 0..n {
                let t = start + f64::from(step) * dt;
                let rotate = &mut |_: f64, u: &Vec<[f64; 2]>, du: &mut Vec<[f64; 2]>| {
                    du.iter_mut().zip(u).for_each(|(du, u)| *du = [-u[1], u[0]]);
                    Ok(())
                };
                stepper.step(t, dt, &mut u, rotate).unwrap();
            }
        };
        assert!(allocations(|| steps(&mut *stepper, 0.0, 0.1, 1)) > 0);
        none("explicit steps after the first", || steps(&mut *stepper, 0.1, 0.1, 10));
        stepper.reset();
        none("explicit steps after the first", || steps(&mut *stepper, 0.0, 0.05, 10));
    }
}

/// A scattered set, so that rows differ in length, with more than one block of rows.
fn particles() -> (Particles<2>, Domain<2>) {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [30; 2], 0.4, 3).unwrap();
    (particles, Domain::periodic([0.0; 2], [1.0; 2]).unwrap())
}

fn laplacian(particles: &Particles<2>) -> Pse<parops::Exchange<2>> {
    let epsilon = Epsilon::global(2.0 / 30.0).unwrap();
    let pse = Pse::new(Laplacian::<2>, 2, epsilon, particles.volumes().unwrap()).unwrap();
    pse.support(3.0).unwrap().allow(Allowance::Everywhere)
}

#[test]
fn weights_into_given_scratch_allocate_nothing_once_a_row_of_that_size_was_made() {
    let (particles, domain) = particles();
    let pse = laplacian(&particles);
    let sph = Sph::new(
        Gradient::<2>,
        parops::Gaussian::new(),
        Epsilon::global(2.0 / 30.0).unwrap(),
        particles.volumes().unwrap(),
    );
    let sph = sph.unwrap().support(3.0).unwrap().allow(Allowance::Everywhere);
    let neighbors = CellList::build(&particles, &domain, pse.cutoff()).unwrap();
    let rows = count_weights(&pse, &neighbors);
    assert!(rows > 0);
    assert_eq!(rows, count_weights(&sph, &neighbors));
    // Rows that the first solver does not certify go through the others: one of those was made by then too.
    let dcpse = parops::DcPse::<Gradient<2>, 2>::new();
    assert_eq!(rows, count_weights(&dcpse, &neighbors));

    let (epsilon, volumes) = (Epsilon::global(2.0 / 30.0).unwrap(), particles.volumes().unwrap());
    let upwind = Upwind::new(vec![[1.0, -1.0]; 900], epsilon.clone(), volumes).unwrap().support(3.0).unwrap();
    assert_eq!(rows, count_weights(&upwind, &neighbors));
    let closure = OneSided::new(D2::<2, 0>::default(), Side::Left, 2, epsilon.clone(), volumes).unwrap();
    // The longest half-stencil need not be that of the longest row: here every row is made before one is counted.
    assert_eq!(rows, count_weights_after(0..rows, &closure.support(3.0).unwrap(), &neighbors));
    let hessian = Pse::anisotropic(Hessian::<2>, epsilon, volumes).unwrap().support(3.0).unwrap();
    let tensors = vec![[[2.0, 0.5], [0.5, 1.0]]; 900];
    let tensor = DivTensorGrad::new(hessian.allow(Allowance::Everywhere), &tensors).unwrap();
    assert_eq!(rows, count_weights(&tensor, &neighbors));
}

/// Makes the longest row, then all of them, and returns how many were made without an allocation: all.
fn count_weights<M: Method<2>>(method: &M, neighbors: &CellList<2>) -> usize {
    let longest = (0..neighbors.targets()).max_by_key(|&p| neighbors.count(p, neighbors.reach())).unwrap();
    count_weights_after([longest], method, neighbors)
}

/// Makes the rows `first`, then all of them, and returns how many were made without an allocation: all.
fn count_weights_after<M: Method<2>>(
    first: impl IntoIterator<Item = usize>,
    method: &M,
    neighbors: &CellList<2>,
) -> usize {
    let cutoff = neighbors.reach();
    let most = (0..neighbors.targets()).map(|p| neighbors.count(p, cutoff)).max().unwrap();
    let mut row = Stencil::default();
    let mut scratch = method.scratch().unwrap();
    let mut weights = vec![<M::Out as parops::Outputs>::ZERO; most];
    let mut diagonal = <M::Out as parops::Outputs>::ZERO;
    let mut make = |p: usize| {
        neighbors.gather(p, cutoff, &mut row);
        let weights = &mut weights[..row.len()];
        method.weights(&row, &mut scratch, weights, &mut diagonal).unwrap();
        std::hint::black_box(method.report(&row, &scratch, weights, &diagonal).unwrap());
    };
    first.into_iter().for_each(&mut make);
    none("weights into given scratch after a row of that size", || (0..neighbors.targets()).for_each(&mut make));
    neighbors.targets()
}

/// Under the feature `rayon` the pool's own queues allocate.
#[cfg(not(feature = "rayon"))]
#[test]
fn applying_stored_rows_allocates_nothing_and_matrix_free_nothing_after_the_first_time() {
    let (particles, domain) = particles();
    let (n, pse) = (particles.len(), laplacian(&particles));
    let neighbors = CellList::build(&particles, &domain, pse.cutoff()).unwrap();
    let list = NeighborList::from_provider(&neighbors).unwrap();
    let (f, mut out) = (vec![1.0; n], vec![0.0; n]);
    let (f32s, mut short) = (vec![1.0_f32; n], vec![0.0_f32; n]);
    let rows = pse.assemble(&neighbors).unwrap();
    let single = Rows::<_, f32>::assemble(&pse, &neighbors).unwrap();
    none("applications of stored rows, and matrix-free after the first", || rows.apply(&f, &mut out).unwrap());
    none("applications of stored rows, and matrix-free after the first", || single.apply(&f32s, &mut short).unwrap());
    none("applications of stored rows, and matrix-free after the first", || {
        assert!(rows.apply(&f[1..], &mut out).is_err())
    });

    let gradient = Pse::new(Gradient::<2>, 2, Epsilon::global(2.0 / 30.0).unwrap(), particles.volumes().unwrap());
    let gradient = gradient.unwrap().support(3.0).unwrap().allow(Allowance::Everywhere).assemble(&neighbors).unwrap();
    let mut outs = vec![[0.0; 2]; n];
    none("applications of stored rows, and matrix-free after the first", || gradient.apply_all(&f, &mut outs).unwrap());
    none("applications of stored rows, and matrix-free after the first", || {
        gradient.apply_dot(&outs, &mut out).unwrap()
    });
    none("applications of stored rows, and matrix-free after the first", || {
        gradient.apply_along(&outs, &f, &mut out).unwrap()
    });
    none("applications of stored rows, and matrix-free after the first", || {
        gradient.apply_curl(&outs, &mut out).unwrap()
    });
    let any = parops::UpwindGradient::new(Epsilon::global(2.0 / 30.0).unwrap(), particles.volumes().unwrap());
    let any = any.support(3.0).unwrap().assemble(&neighbors).unwrap();
    none("applications of stored rows, and matrix-free after the first", || any.apply(&outs, &f, &mut out).unwrap());
    let mut jacobian = vec![[[0.0; 2]; 2]; n];
    none("applications of stored rows, and matrix-free after the first", || {
        gradient.apply_jacobian(&outs, &mut jacobian).unwrap()
    });
    let (fields, mut results) = (vec![[1.0; 5]; n], vec![[0.0; 5]; n]);
    none("applications of stored rows, and matrix-free after the first", || {
        rows.apply_fields(&fields, &mut results).unwrap()
    });
    let mut strided = || {
        let f = Strided::interleaved(fields.as_flattened(), 5).unwrap();
        rows.apply_strided(f, Strided::stacked(results.as_flattened_mut(), 5).unwrap()).unwrap();
    };
    none("applications of stored rows, and matrix-free after the first", &mut strided);

    let (cells, listed) = (pse.matrix_free(&neighbors).unwrap(), pse.matrix_free(&list).unwrap());
    let free: [&dyn Apply<f64>; 2] = [&cells, &listed];
    for operator in free {
        operator.apply(&f, &mut out).unwrap();
        none("applications of stored rows, and matrix-free after the first", || operator.apply(&f, &mut out).unwrap());
    }
    none("applications of stored rows, and matrix-free after the first", || cells.apply(&f32s, &mut short).unwrap());
}

#[cfg(not(feature = "rayon"))]
#[test]
fn sums_over_pairs_allocate_nothing_and_symmetric_pse_nothing_after_the_first_time() {
    let (particles, domain) = particles();
    let (n, pse) = (particles.len(), laplacian(&particles));
    let cells = CellList::build(&particles, &domain, pse.cutoff()).unwrap();
    let half = pse.symmetric(&cells).unwrap();
    let (f, mut out) = (vec![1.0; n], vec![0.0; n]);
    half.apply(&f, &mut out).unwrap();
    none("sums over pairs, and symmetric PSE after the first", || half.apply(&f, &mut out).unwrap());
    let mut sums = vec![[0.0; 2]; n];
    let symmetry = [parops::Symmetry::Conserved; 2];
    none("sums over pairs, and symmetric PSE after the first", || {
        half.pairs().accumulate(symmetry, &mut sums, |pair| pair.separation).unwrap()
    });
}

#[test]
fn updates_that_reuse_the_rows_of_a_verlet_list_allocate_nothing() {
    let (particles, domain) = particles();
    let mut list = parops::VerletList::build(&particles, &domain, parops::Cutoff(0.1), 0.05).unwrap();
    for by in [0.01, -0.015, 0.0] {
        let mut moved = particles.clone();
        moved.set_points(&particles.points().iter().map(|x| x.map(|x| x + by)).collect::<Vec<_>>()).unwrap();
        none("updates of a Verlet list that reuse its rows", || assert_eq!(list.update(&moved), Ok(false)));
        none("updates of a Verlet list that reuse its rows", || {
            assert!((0..particles.len()).all(|p| list.count(p, 0.1) > 10))
        });
    }
}

#[cfg(not(feature = "rayon"))]
#[test]
fn solves_after_the_first_allocate_nothing() -> parops::Result<()> {
    let (n, chain) = (300, |i: usize| [(i, i, 4.0), (i, (i + 1) % 300, -1.0), (i, (i + 17) % 300, -2.0)]);
    let matrix = parops::CsrMatrix::from_triplets(n, n, (0..n).flat_map(chain))?;
    let factors = parops::Ilu0::new(&matrix)?;
    let mut gmres = parops::Gmres::new().restart(4);
    // The second is a sparse LU with the feature `faer`.
    let solvers =
        [parops::SparseSolver::gmres(matrix.clone(), gmres.clone())?, parops::SparseSolver::new(matrix.clone())?];
    let mut x = vec![0.0; n];
    let (easy, hard): (Vec<f64>, Vec<f64>) = (0..n).map(|i| (1.0, (i as f64).sin())).unzip();
    gmres.solve(&matrix, Some(&factors), &easy, &mut x)?;
    none("sparse solves after the first", || {
        assert!(gmres.solve(&matrix, Some(&factors), &hard, &mut x).unwrap().iterations > 4)
    });
    for mut solver in solvers {
        solver.solve(&easy, &mut x)?;
        none("sparse solves after the first", || assert!(solver.solve(&hard, &mut x).is_ok()));
    }
    Ok(())
}

#[cfg(not(feature = "rayon"))]
#[test]
fn imposing_boundary_conditions_allocates_nothing_after_the_first_time() {
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [16; 2]).unwrap();
    let neighbors = CellList::build(&lattice, &Domain::open(), parops::Cutoff(0.5)).unwrap();
    // The lowest and the highest of the last coordinate.
    let flux = |p: usize, up: f64| BoundaryCondition::robin(p, [0.0, up], 1.0, 1.0);
    let conditions: Vec<_> = (0..16).flat_map(|i| [flux(16 * i, -1.0), flux(16 * i + 15, 1.0)]).collect();
    let mut boundary = BoundaryRows::build(&conditions, 2, &neighbors).unwrap();
    let mut u = vec![1.0; lattice.len()];
    let mut impose = |g: f64| assert!(boundary.impose(|p| g + p as f64, &mut u).unwrap().iterations > 0);
    impose(0.0);
    none("boundary conditions after the first", || (0..5).for_each(|n| impose(f64::from(n))));
    none("boundary conditions after the first", || boundary.replace_values(|_| 0.0, &mut u).unwrap());
}

#[cfg(not(feature = "rayon"))]
#[test]
fn eulerian_steps_after_the_first_allocate_nothing() -> parops::Result<()> {
    use parops::{AdvectionDiffusion, Boundary, DcPse, Eulerian, GrowthPolicy, Nearest, StepPolicy};
    let set = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.2, 3)?.with_equal_volumes(1.0)?;
    let neighbors = Nearest::build(&set, &Domain::open(), 20)?;
    let near = |x: &[f64; 2]| x.iter().any(|x| *x < 0.08 || *x > 0.92);
    let walls: Vec<_> = (0..set.len()).filter(|&p| near(&set.points()[p])).collect();
    let scene = || {
        AdvectionDiffusion::<2>::new()
            .fields::<[f64; 2]>()
            .diffusion(|x: &[f64; 2]| 0.1 + x[0], DcPse::<Laplacian<2>, 2>::new())
            .advection(|x: &[f64; 2], t: f64| [x[1], t], DcPse::<Gradient<2>, 2>::new())
            .computed_divergence()
            .source(|_, t, u: [f64; 2]| [u[1] - t, -u[0]])
    };
    let growth = GrowthPolicy::Allow;
    let mut free = Eulerian::with_policy(scene(), &set, &neighbors, Rk4::new(), StepPolicy::Refuse, growth)?;
    let bounded = scene()
        .boundary(Boundary::new(2).conditions(walls.into_iter().map(BoundaryCondition::dirichlet)), |_, x, t| {
            [x[0], t]
        });
    let adapt = StepPolicy::Adapt { most: 1000 };
    let mut cut = Eulerian::with_policy(bounded, &set, &neighbors, SspRk3::new(), adapt, growth)?;
    let mut u = vec![[1.0, -1.0]; set.len()];
    free.step(&mut u, 1e-4)?;
    none("Eulerian steps after the first", || (0..5).for_each(|_| assert!(free.step(&mut u, 1e-4).is_ok())));
    cut.step(&mut u, 0.01)?;
    none("Eulerian steps after the first", || (0..3).for_each(|_| assert!(cut.step(&mut u, 0.01).is_ok())));
    assert!(cut.ledger().substeps > 1);
    Ok(())
}

#[cfg(not(feature = "rayon"))]
#[test]
fn upwind_dcpse_and_hyperviscosity_allocate_nothing() -> parops::Result<()> {
    use parops::{Advect, DcPse, Hyperviscosity, Nearest, UpwindDcPse};
    let (set, torus) = particles();
    let n = set.len();
    let velocities: Vec<[f64; 2]> = set.points().iter().map(|x| [x[1] - 0.5, 0.5 - x[0]]).collect();
    let (f, mut out) = (vec![1.0; n], vec![0.0; n]);
    let (fields, mut results) = (vec![[1.0; 3]; n], vec![[0.0; 3]; n]);
    for method in [UpwindDcPse::half_stencils(), UpwindDcPse::biased(set.spacing()?)] {
        let rows = method.assemble(&Nearest::build(&set, &torus, method.neighbors::<2>()?)?)?;
        none("upwind DC-PSE and hyperviscosity", || rows.apply(&velocities, &f, &mut out).unwrap());
        none("upwind DC-PSE and hyperviscosity", || rows.advect(&velocities, &f, &mut out).unwrap());
        none("upwind DC-PSE and hyperviscosity", || rows.apply_fields(&velocities, &fields, &mut results).unwrap());
        none("upwind DC-PSE and hyperviscosity", || assert!(rows.rate_bound(&velocities).unwrap() > 0.0));
    }
    let laplacian = DcPse::<Laplacian<2>, 4>::new();
    let neighbors = Nearest::build(&set, &torus, laplacian.fewest_neighbors::<2>()?)?;
    let mut damping = Hyperviscosity::new(laplacian.assemble(&neighbors)?, 4, set.spacing()?, 0.1)?;
    none("upwind DC-PSE and hyperviscosity", || damping.add(&velocities, &f, &mut out).unwrap());
    Ok(())
}

#[cfg(not(feature = "rayon"))]
#[test]
fn steps_of_every_advection_scheme_after_the_first_allocate_nothing() -> parops::Result<()> {
    use parops::{AdvectionDiffusion, Boundary, Eulerian, GrowthPolicy, Nearest, Stabilized, StepPolicy, Transport};
    use parops::{UpwindDcPse, UpwindGradient};
    fn count<X: Transport<1>>(scheme: X, neighbors: &impl Neighbors<1>, set: &Particles<1>) -> parops::Result<()> {
        // The flow turns, and comes in at both ends in turns.
        let inflow = (0..4).map(|p| (p, [-1.0])).chain((36..40).map(|p| (p, [1.0])));
        let scene = AdvectionDiffusion::<1>::new()
            .advection(|_: &[f64; 1], t: f64| [(200.0 * t).sin()], scheme)
            .divergence(|x: &[f64; 1], t: f64| x[0] * t)
            .boundary(Boundary::new(1).inflow(inflow), |_, x, _| x[0]);
        let growth = GrowthPolicy::Unknown;
        let mut run = Eulerian::with_policy(scene, set, neighbors, Rk4::new(), StepPolicy::Refuse, growth)?;
        let mut u = vec![1.0; set.len()];
        run.step(&mut u, 1e-3)?;
        none("steps of upwind and stabilized schemes after the first", || {
            (0..40).for_each(|_| assert!(run.step(&mut u, 1e-3).is_ok()));
        });
        Ok(())
    }
    let line = Particles::lattice([0.0], [1.0], [40])?;
    let near = Nearest::build(&line, &Domain::open(), 12)?;
    let upwind = UpwindGradient::new(line.spacing()?.epsilon(1.0)?, line.volumes()?);
    let cells = CellList::build(&line, &Domain::open(), upwind.cutoff())?;
    count(upwind, &cells, &line)?;
    count(UpwindDcPse::half_stencils(), &near, &line)?;
    count(Stabilized::<1, 2>::new(line.spacing()?).gamma(0.1), &near, &line)?;
    Ok(())
}

#[cfg(not(feature = "rayon"))]
#[test]
fn lagrangian_steps_that_keep_their_neighbors_allocate_nothing() -> parops::Result<()> {
    use parops::{AdvectionDiffusion, Carried, DcPse, Lagrangian, MovingScene, MovingSettings, Steady};
    fn count<S: MovingScene<2, Value = f64>>(scene: S, set: &Particles<2>, torus: &Domain<2>) -> parops::Result<()> {
        let mut settings = MovingSettings::default();
        settings.skin = Some(0.05);
        let mut run = Lagrangian::with_settings(scene, set, &vec![1.0; set.len()], torus, Rk4::new(), settings)?;
        (0..2).try_for_each(|_| run.step(1e-4).map(|_| ()))?;
        let before = run.ledger().rebuilds;
        none("Lagrangian steps that keep their neighbors", || {
            (0..4).for_each(|_| assert!(run.step(1e-4).is_ok()));
        });
        assert_eq!(run.ledger().rebuilds, before);
        Ok(())
    }
    let set = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.2, 3)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let scene = AdvectionDiffusion::<2>::new;
    let shear = Steady(|x: &[f64; 2]| [x[1], 0.0]);
    count(scene().advection(shear, Carried), &set, &torus)?;
    let dcpse = DcPse::<Laplacian<2>, 2>::new;
    count(scene().advection(shear, Carried).diffusion(1e-3, dcpse()), &set, &torus)?;
    let pse = Pse::new(Laplacian::<2>, 2, set.spacing()?.epsilon(1.0)?, set.volumes()?)?.support(3.0)?;
    let pse = pse.allow(Allowance::Everywhere);
    count(scene().advection(shear, Carried).diffusion(1e-3, pse), &set, &torus)?;
    let spring = Steady(|x: &[f64; 2]| [0.1 * (std::f64::consts::TAU * x[0]).sin(), 0.0]);
    let spread = |x: &[f64; 2], _: f64| 0.1 * std::f64::consts::TAU * (std::f64::consts::TAU * x[0]).cos();
    let carried = || scene().advection(spring, Carried).divergence(spread).source(|_: &[f64; 2], _: f64, u: f64| -u);
    count(carried(), &set, &torus)?;
    count(carried().diffusion(1e-3, dcpse()), &set, &torus)?;
    let rising = |x: &[f64; 2]| 1e-3 * (1.0 + x[0]);
    count(scene().advection(shear, Carried).diffusion(rising, dcpse()), &set, &torus)?;
    Ok(())
}

#[cfg(not(feature = "rayon"))]
#[test]
fn implicit_steps_after_the_first_allocate_nothing() {
    let (particles, domain) = particles();
    let pse = laplacian(&particles);
    let rows = pse.assemble(&CellList::build(&particles, &domain, pse.cutoff()).unwrap()).unwrap();
    let solvers: &[fn(CsrMatrix) -> parops::Result<SparseSolver>] = &[
        |matrix| SparseSolver::bicgstab(matrix, BiCgStab::new()),
        |matrix| SparseSolver::gmres(matrix, Gmres::new()),
        #[cfg(feature = "faer")]
        SparseSolver::lu,
    ];
    for &solver in solvers {
        let mut stepper = Implicit::crank_nicolson(rows.to_csr(0).unwrap()).unwrap().solver(solver);
        let mut u: Vec<[f32; 2]> = particles.points().iter().map(|x| [x[0] as f32, 1.0]).collect();
        let mut step = |n: u32| {
            let source = &mut |t: f64, g: &mut [[f32; 2]]| {
                g.fill([t as f32, 0.0]);
                Ok(())
            };
            stepper.step(0.1 * f64::from(n), 0.1, &mut u, source).unwrap();
        };
        assert!(allocations(|| step(0)) > 0);
        none("implicit steps after the first", || (1..6).for_each(&mut step));
    }
}

#[test]
fn transfers_between_particles_and_mesh_allocate_nothing() {
    use parops::{Lambda, Mesh, MeshKernel};
    let mesh = Mesh::nodes(&Domain::periodic([0.0; 3], [1.0; 3]).unwrap(), [8; 3]).unwrap();
    let kernel = Lambda::<4, 2>::new().unwrap();
    let particles = Particles::jittered([0.0; 3], [1.0; 3], [9; 3], 0.3, 1).unwrap();
    let stencils = || {
        for x in particles.points() {
            std::hint::black_box(mesh.stencil(&kernel, x).unwrap().nodes().count());
        }
        std::hint::black_box(MeshKernel::<f32, 6>::weights(&kernel, 0.25));
    };
    none("transfers between particles and mesh", stencils);
    // The pool allocates, and the lists of several threads.
    #[cfg(not(feature = "rayon"))]
    {
        let (strengths, mut values, mut out) = (vec![1.0; 729], vec![0.0; 512], vec![0.0; 729]);
        none("transfers between particles and mesh", || {
            mesh.deposit(&kernel, particles.points(), &strengths, &mut values).unwrap()
        });
        none("transfers between particles and mesh", || {
            mesh.gather(&kernel, particles.points(), &values, &mut out).unwrap()
        });
    }
}
