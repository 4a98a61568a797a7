//! What six scenes take: bytes a particle against what the arithmetic says, allocations, sweeps over rows a step or solve.
//!
//! Their packages and the size of their programs are checked by `.ci/lean`, their results by the examples `lean_*`.
//! Several threads have pools that allocate: nothing is measured with the feature `rayon`.
#![cfg(not(feature = "rayon"))]
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use parops::{
    AdvectionDiffusion, Apply, Boundary, BoundaryCondition, Carried, CellList, DcPse, Domain, Euler, Eulerian, Fields,
    Gradient, ImplicitScheme, Lagrangian, Lambda, Laplacian, Mesh, Nearest, Neighbors, OneSidedRows, Particles, Plan,
    Pse, Rate, Remeshing, Report, Result, Rk4, Site, Spacing, Transport, TransportRows, Trigger, UpwindGradient,
    integrate, steady, testing::Promise,
};

struct Measuring;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    /// Below zero where a thread gives back what another one took.
    static USED: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
    /// Rows that are swept: how often one is taken, by whatever goes through them.
    static TAKEN: Cell<usize> = const { Cell::new(0) };
}

/// While a thread ends its counters may be gone; nothing is measured then.
fn taken(bytes: usize) {
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
    let used = USED.try_with(|used| {
        used.set(used.get() + bytes as isize);
        used.get()
    });
    let _ = used.and_then(|used| PEAK.try_with(|peak| peak.set(peak.get().max(used))));
}

fn given_back(bytes: usize) {
    let _ = USED.try_with(|used| used.set(used.get() - bytes as isize));
}

// SAFETY: every call is handed to the system allocator unchanged.
unsafe impl GlobalAlloc for Measuring {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        taken(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        given_back(layout.size());
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Measuring = Measuring;

/// What `f` took, in bytes a particle: held by what it returns, and at the worst moment; and how often it allocated.
#[derive(Debug)]
struct Cost {
    held: f64,
    peak: f64,
    allocations: usize,
}

fn cost<R>(f: impl FnOnce() -> R) -> (R, Cost) {
    let (used, count) = (USED.get(), COUNT.get());
    PEAK.set(used);
    let result = f();
    let each = |bytes: isize| (bytes - used) as f64 / N as f64;
    let (held, peak) = (each(USED.get()), each(PEAK.get()));
    (result, Cost { held, peak, allocations: COUNT.get() - count })
}

/// Particles along an axis, and all.
const SIDE: usize = 64;
const N: usize = SIDE * SIDE;

/// A point and a number, in bytes.
const POINT: f64 = 16.0;
const NUMBER: f64 = 8.0;

/// What does not grow with the particles, such as the masses of a ledger: 2 kB.
const CONSTANT: f64 = 0.5;

/// Working memory of an assembly: 512 rows of 4096 wait in it at a time.
const BLOCK: f64 = 1.0 / 8.0;

/// Bytes of stored rows: an offset, and a column and K weights a pair.
fn rows(pairs: f64, outputs: f64) -> f64 {
    NUMBER + pairs * (4.0 + outputs * NUMBER)
}

/// What was found is what the arithmetic says, in bytes a particle.
fn exactly(what: &'static str, found: f64, bytes: f64) {
    Promise::new("Allocations", format!("{what}, bytes a particle less the arithmetic")).within(
        -CONSTANT,
        CONSTANT,
        found - bytes,
    );
}

/// Allocations of a list that doubles from 4 entries to 4096.
const DOUBLINGS: f64 = 11.0;
/// Scratch of the moment solver: tables of exponents and monomials, windows, and matrices and vectors of one batch of rows;
/// in lists that double to at most 64 entries. The Laplacian has two tables, with the constant and without.
const GRADIENT: f64 = 64.0;
const LAPLACIAN: f64 = 90.0;

/// Allocations of an assembly, where each of eight rows made side by side takes some for sources, separations, signs and
/// weights, and the method takes some for scratch. There are besides the workers, four arrays of the rows and the list of
/// drafts; and the reports of eight blocks, in a list that doubles. None is for a particle.
fn assembling(draft: f64, scratch: f64) -> f64 {
    6.0 + 4.0 + 8.0 * draft + scratch
}

fn allocations(what: &'static str, most: f64, cost: &Cost) {
    Promise::new("Allocations", what).at_most(most, cost.allocations as f64);
}

/// Products with the matrix that a solve took, as its report counts them.
fn products(what: &'static str, most: usize, found: usize) {
    Promise::new("Work", format!("products of {what}")).at_most(most as f64, found as f64);
}

fn torus() -> Result<Domain<2>> {
    Domain::periodic([0.0; 2], [1.0; 2])
}

fn scattered() -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.2, 1)?.with_equal_volumes(1.0)
}

/// Mean number of neighbors within the cutoff of each.
fn pairs(neighbors: &impl Neighbors<2>, cutoff: impl Fn(usize) -> f64) -> f64 {
    (0..N).map(|p| neighbors.count(p, cutoff(p))).sum::<usize>() as f64 / N as f64
}

/// An upwind scheme whose rows are counted when they are taken.
struct Counted(UpwindGradient<2>);

struct CountedRows<E: Fields>(OneSidedRows<2, E>);

impl Transport<2> for Counted {
    type Rows<E: Fields> = CountedRows<E>;
    const APPLIES: usize = <UpwindGradient<2> as Transport<2>>::APPLIES;

    fn build<E: Fields, P: Neighbors<2>>(
        &self,
        site: &Site<2>,
        flow: impl Fn(usize) -> [f64; 2] + Sync,
        steady: bool,
        solenoidal: bool,
        neighbors: &P,
    ) -> Result<CountedRows<E>> {
        self.0.build(site, flow, steady, solenoidal, neighbors).map(CountedRows)
    }
}

impl<E: Fields> TransportRows<2, E> for CountedRows<E> {
    fn along(&self, p: usize, v: &[f64; 2], u: &[E]) -> E {
        TAKEN.set(TAKEN.get() + 1);
        self.0.along(p, v, u)
    }

    fn entries(&self, p: usize, v: &[f64; 2], entry: &mut dyn FnMut(usize, f64)) {
        TAKEN.set(TAKEN.get() + 1);
        self.0.entries(p, v, entry);
    }

    fn rate(&self, p: usize, v: &[f64; 2]) -> Result<Rate> {
        TransportRows::<2, E>::rate(&self.0, p, v)
    }

    fn monotone(&self) -> bool {
        TransportRows::<2, E>::monotone(&self.0)
    }

    fn report(&self) -> &Report {
        TransportRows::<2, E>::report(&self.0)
    }
}

#[test]
fn counters_count() {
    let (kept, cost) = cost(|| {
        drop(std::hint::black_box(vec![0_u8; 3 * N]));
        vec![0_u8; 2 * N]
    });
    assert_eq!((cost.held, cost.peak, cost.allocations, kept.len()), (2.0, 3.0, 2, 2 * N));
}

#[test]
fn derivative_takes_its_rows() -> Result<()> {
    let set = scattered()?;
    let gradient = DcPse::<Gradient<2>, 2>::new();
    let (neighbors, provider) = cost(|| Nearest::build(&set, &Domain::open(), gradient.fewest_neighbors::<2>()?));
    let neighbors = neighbors?;
    // A cutoff, and four cell lists of even spacing: each holds the points twice, a source, an image, a slot and cells.
    assert!(provider.held <= NUMBER + 4.0 * (2.0 * POINT + 16.0), "{provider:?}");

    let (made, assembly) = cost(|| gradient.assemble(&neighbors));
    let made = made?;
    // The signs of a first derivative are '+', so that there is a diagonal.
    let expected = rows(pairs(&neighbors, |p| neighbors.cutoff(p)), 2.0) + 2.0 * NUMBER;
    exactly("rows of a gradient", assembly.held, expected);
    assert!(assembly.peak <= expected * (1.0 + BLOCK), "{assembly:?}");
    // Nearest neighbors are counted: the four lists of a draft come at once.
    allocations("assembling a gradient of 4096 particles", assembling(4.0, GRADIENT), &assembly);

    let (values, mut slopes) = (vec![1.0; N], vec![[0.0; 2]; N]);
    let (applied, apply) = cost(|| made.apply_all(&values, &mut slopes));
    assert_eq!((applied, apply.allocations), (Ok(()), 0));
    Ok(())
}

#[test]
fn lattice_diffusion_takes_rows_and_four_states_and_applies_once_a_stage() -> Result<()> {
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [SIDE; 2])?;
    let pse = Pse::new(Laplacian::<2>, 4, lattice.spacing()?.epsilon(2.0)?, lattice.volumes()?)?;
    let neighbors = CellList::build(&lattice, &torus()?, pse.cutoff())?;
    let (laplacian, assembly) = cost(|| pse.assemble(&neighbors));
    let laplacian = laplacian?;
    // Volumes and epsilon are one number each.
    let expected = rows(pairs(&neighbors, |_| pse.cutoff().0), 1.0);
    exactly("rows of PSE on a lattice", assembly.held, expected);
    assert!(assembly.peak <= expected * (1.0 + BLOCK), "{assembly:?}");
    // 440 neighbors: sources and separations take 8 allocations, signs, of which 8 come first, 7, weights 1. Scratch of
    // the kernel is 4.
    allocations("assembling PSE on a lattice of 4096 particles", assembling(24.0, 4.0), &assembly);

    for steps in [2_u32, 20] {
        let plan = Plan::new(0.0, 1e-6 * f64::from(steps), 1e-6)?;
        let (mut u, mut applied) = (vec![1.0; N], 0);
        let heat = |_, u: &Vec<f64>, du: &mut Vec<f64>| {
            applied += 1;
            laplacian.apply(u, du)
        };
        let (done, run) = cost(|| integrate(&mut Rk4::new(), &mut u, &plan, heat, |_, _, _| {}));
        done?;
        // The copy that is stepped and three stages, however many steps there are.
        allocations("a run of RK4 with any number of steps", 4.0, &run);
        assert_eq!((run.peak, run.allocations, applied), (4.0 * NUMBER, 4, 4 * steps));
    }
    Ok(())
}

/// Bytes of a sparse matrix: an offset, and a column and a value an entry.
fn matrix(entries: f64) -> f64 {
    NUMBER + entries * 12.0
}

#[test]
fn poisson_takes_rows_three_matrices_and_two_bases() -> Result<()> {
    /// Steps of GMRES at its defaults before it restarts: with ILU(0) one basis serves this many particles.
    const RESTART: usize = 60;
    /// Krylov vectors of GMRES at its defaults, once for the solution and once for the condition.
    const BASES: f64 = 2.0 * 61.0;
    /// Points, walls and what belongs to them, in lists that double to 252 walls, and tables of monomials of their rows.
    const WALLS: f64 = 96.0;
    /// Lists of the scene, triplets, arrays of three matrices with the orders they are made by, vectors of the solve, and
    /// both bases with their small matrices.
    const SOLVE: f64 = 64.0;
    /// Points and terms of the scene, right sides, scales, residuals.
    const VECTORS: f64 = 20.0;
    let set = scattered()?;
    let edge = |i: usize| i == 0 || i == SIDE - 1;
    let walls: Vec<_> = (0..N).filter(|p| edge(p % SIDE) || edge(p / SIDE)).map(BoundaryCondition::dirichlet).collect();
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&set, &Domain::open(), laplacian.fewest_neighbors::<2>()?)?;
    let pairs = pairs(&neighbors, |p| neighbors.cutoff(p));
    let boundary = Boundary::new(2).conditions(walls);
    let scene = AdvectionDiffusion::<2>::new().diffusion(1.0, laplacian).source(|_, _, _| 1.0);
    let scene = scene.boundary(boundary, |_, _, _| 0.0);
    let (state, solve) = cost(|| steady(scene, &set, &neighbors));
    let state = state?;
    assert_eq!(state.u.len(), N);
    products("a steady solve of 4096 particles", RESTART, state.report.iterations);
    // The matrix, its factors, its transpose.
    let expected = rows(pairs, 1.0) + 3.0 * matrix(pairs + 1.0) + (BASES + VECTORS) * NUMBER;
    let peak = Promise::new("Allocations", "peak of a steady solve over rows, three matrices and two bases");
    peak.at_most(1.0, solve.peak / expected);
    // The matrices of a batch are made twice, and longer lists beside them.
    let rows = assembling(4.0, LAPLACIAN + 24.0);
    allocations("a steady solve of 4096 particles", WALLS + rows + SOLVE, &solve);
    Ok(())
}

#[test]
fn upwind_takes_rows_and_places_and_sweeps_once_a_step() -> Result<()> {
    let set = scattered()?;
    let upwind = UpwindGradient::new(Spacing(1.0 / SIDE as f64).epsilon(1.0)?, set.volumes()?).support(3.0)?;
    let cutoff = upwind.cutoff();
    let neighbors = CellList::build(&set, &torus()?, cutoff)?;
    let calls = AtomicUsize::new(0);
    let wind = |_: &[f64; 2], _: f64| {
        calls.fetch_add(1, Relaxed);
        [1.0, 0.5]
    };
    let scene = AdvectionDiffusion::<2>::new().advection(wind, Counted(upwind));
    let (run, build) = cost(|| Eulerian::new(scene, &set, &neighbors, Euler::new()));
    let mut run = run?;
    // Two weights a pair serve any velocity; a row sum for each of four sides bounds the step where the flow comes from.
    let expected = rows(pairs(&neighbors, |_| cutoff.0), 2.0) + POINT + 4.0 * NUMBER;
    exactly("an upwind scene", build.held, expected);
    assert!(build.peak <= expected * (1.0 + BLOCK), "{build:?}");
    // Drafts of up to 32 neighbors: 4, 4, 3 and 1 as above. Scratch are weights that grow once more in every draft
    // and lists of the kernel. The scene has points, sides, terms and four vectors.
    allocations("an upwind scene of 4096 particles", assembling(12.0, 18.0) + 7.0, &build);

    let mut u = vec![1.0; N];
    // Euler has a rate and the next state.
    let (stepped, first) = cost(|| run.step(&mut u, 1e-4).map(drop));
    assert!(stepped.is_ok());
    exactly("the first upwind step of Euler", first.held, 2.0 * NUMBER);
    calls.store(0, Relaxed);
    TAKEN.set(0);
    let (stepped, later) = cost(|| (0..5).try_for_each(|_| run.step(&mut u, 1e-4).map(drop)));
    let sweeps = TAKEN.get() as f64 / (5 * N) as f64;
    Promise::new("Work", "sweeps over the rows of an upwind step of Euler").at_most(1.0, sweeps);
    // One velocity a particle for its row, one each for the limits at both ends of the step, because it may change.
    assert_eq!((stepped, later.peak, later.allocations, calls.load(Relaxed)), (Ok(()), 0.0, 0, 5 * 3 * N));
    Ok(())
}

#[test]
fn remeshed_particles_take_places_and_strengths_and_no_rows() -> Result<()> {
    /// Steps between two remeshings.
    const PERIOD: u64 = 4;
    let torus = torus()?;
    let mesh = Mesh::nodes(&torus, [SIDE; 2])?;
    let nodes = Particles::new(mesh.points().collect())?.with_equal_volumes(1.0)?;
    let (calls, u) = (AtomicUsize::new(0), vec![1.0; N]);
    let wind = |x: &[f64; 2], _: f64| {
        calls.fetch_add(1, Relaxed);
        [x[1], 0.5]
    };
    let scene = AdvectionDiffusion::<2>::new().advection(wind, Carried);
    let remeshing = Remeshing { kernel: Lambda::<4, 2>::new()?, mesh, trigger: Trigger::Steps(PERIOD), threshold: 0.0 };
    let (run, build) =
        cost(|| Lagrangian::new(scene, &nodes, &u, &torus, Rk4::new()).and_then(|run| run.remeshing(remeshing)));
    let mut run = run?;
    // Places of the state, of a step that may fail, of the stage, and of the stage inside the domain; strengths and
    // volumes do not change, and stand once.
    exactly("a remeshed run", build.held, 4.0 * POINT + 2.0 * NUMBER);
    // Three lists double to all particles, three are made at once, and three things are small.
    allocations("a remeshed run of 4096 particles", 3.0 * DOUBLINGS + 3.0 + 3.0, &build);

    // Three stages of places.
    let (stepped, first) = cost(|| run.step(1e-4).map(drop));
    assert_eq!((stepped, first.held), (Ok(()), 3.0 * POINT));
    for remeshed in [false, false, true, false, false, false, true] {
        calls.store(0, Relaxed);
        let (stepped, step) = cost(|| run.step(1e-4).map(drop));
        // The four stages, and four differences and the velocity itself for |grad v| at both ends of the step.
        assert_eq!((stepped, calls.load(Relaxed)), (Ok(()), (4 + 2 * 5) * N));
        if remeshed {
            // Values on the mesh, new particles with strengths and volumes, and lists of the nodes in use.
            assert!(step.peak <= 2.0 * POINT + 4.0 * NUMBER, "{step:?}");
            // Places, strengths and volumes, and a list that doubles beyond the nodes.
            allocations("a step with a remeshing", 3.0 + DOUBLINGS + 1.0, &step);
        } else {
            assert_eq!(step.peak, 0.0);
            allocations("a step between remeshings", 0.0, &step);
        }
    }
    assert_eq!(run.ledger().remeshings, 2);
    Ok(())
}

#[test]
fn implicit_steps_take_rows_and_three_matrices() -> Result<()> {
    /// Of BiCGSTAB 8, of the scheme 8, of the solver 4, of the factors 1.
    const VECTORS: f64 = 21.0;
    /// Of the estimate of growth: 33 of its space, and those that go through the scene.
    const SPACE: f64 = 40.0;
    /// Of the estimate of growth: its two searches, rightmost and largest, take 17 each, and 28 small matrices a restart; ten
    /// restarts were found, two more may come.
    const GROWTH: f64 = 2.0 * 17.0 + 12.0 * 28.0;
    /// Points, a list of the scene that doubles to all particles, and seven of vectors and lists.
    const SCENE: f64 = 1.0 + DOUBLINGS + 7.0;
    /// Products of one solve: two a step of BiCGSTAB, whose steps grow with the root of the condition of the Laplacian, the
    /// particles along an axis; 63 were found.
    const PRODUCTS: usize = SIDE + SIDE / 4;
    let set = scattered()?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = Nearest::build(&set, &torus()?, laplacian.fewest_neighbors::<2>()?)?;
    let pairs = pairs(&neighbors, |p| neighbors.cutoff(p));
    let scene = AdvectionDiffusion::<2>::new().diffusion(1.0, laplacian).source(|_, _, _| 1.0);
    let (run, build) = cost(|| Eulerian::new(scene, &set, &neighbors, ImplicitScheme::euler()));
    let mut run = run?;
    let expected = rows(pairs, 1.0) + POINT;
    exactly("an implicit scene", build.held, expected);
    assert!(build.peak <= expected + SPACE * NUMBER, "{build:?}");
    // Drafts of up to 32 neighbors as above.
    allocations("an implicit scene of 4096 particles", SCENE + assembling(12.0, LAPLACIAN) + GROWTH, &build);

    let mut u: Vec<f64> = set.points().iter().map(|x| (6.0 * x[0]).sin()).collect();
    let (stepped, first) = cost(|| run.step(&mut u, 0.1).map(drop));
    // The matrix of the scene, that of the step with room for a diagonal it may lack, its factors; which rows are algebraic.
    let expected = 3.0 * matrix(pairs + 1.0) + 12.0 + VECTORS * NUMBER + 1.0;
    assert!(stepped.is_ok());
    exactly("the first implicit step", first.held, expected);
    exactly("the peak of the first implicit step", first.peak, expected);
    let (stepped, later) = cost(|| (0..5).try_for_each(|_| run.step(&mut u, 0.1).map(drop)));
    assert_eq!((stepped, later.peak, later.allocations), (Ok(()), 0.0, 0));
    for _ in 0..5 {
        run.step(&mut u, 0.1)?;
        products("an implicit step of 4096 particles", PRODUCTS, run.stepper().last_solve().iterations);
    }
    Ok(())
}

#[test]
fn balances_and_implicit_steps_sweep_their_rows_for_their_matrix_alone() -> Result<()> {
    /// Rows are taken once to be counted and once to be stored: products, factors and later steps are the matrix's own.
    const MATRIX: f64 = 2.0;
    let set = scattered()?;
    let upwind = UpwindGradient::new(Spacing(1.0 / SIDE as f64).epsilon(1.0)?, set.volumes()?).support(3.0)?;
    let neighbors = CellList::build(&set, &torus()?, upwind.cutoff())?;
    // Rows of advection are swept with those of diffusion; the source gives the field a level.
    let scene = || {
        let diffusing = AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::<Laplacian<2>, 2>::new());
        diffusing.advection([1.0, 0.5], Counted(upwind.clone())).source(|_, _, u| 1.0 - u)
    };
    TAKEN.set(0);
    let swept = |what: &'static str, most: f64| {
        let sweeps = TAKEN.replace(0) as f64 / N as f64;
        Promise::new("Work", format!("sweeps over the rows of {what}")).at_most(most, sweeps);
    };
    steady(scene(), &set, &neighbors)?;
    swept("a steady solve", MATRIX);
    let mut run = Eulerian::new(scene(), &set, &neighbors, ImplicitScheme::euler())?;
    swept("an implicit scene when it is made", 0.0);
    let mut u = vec![0.5; N];
    run.step(&mut u, 0.1)?;
    swept("the first implicit step", MATRIX);
    for _ in 0..5 {
        run.step(&mut u, 0.1)?;
        swept("an implicit step after the first", 0.0);
    }
    Ok(())
}
