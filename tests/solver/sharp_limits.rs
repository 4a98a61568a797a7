//! Limits are sharp: at 0.99 of them no mode of a small periodic set grows, at 1.01 one does; and what the bounds from the
//! rows are worth beside them.

use nalgebra::DMatrix;
use parops::{
    AdvectionDiffusion, Allowance, CellList, DcPse, Domain, Epsilon, ErrorKind, Euler, Eulerian, Exchange, Gradient,
    GrowthPolicy, ImplicitScheme, Laplacian, LatticeSpectrum, Limit, MultiIndex, Nearest, Neighbors, Particles, Pse,
    Rate, Result, Rk4, Rkl2, Scene, SolverError, SspRk3, StepPolicy, Stepper, Term, TimeScheme, UpwindDcPse,
    UpwindGradient, testing::Promise,
};

use crate::dense;

/// By how much rounding may take the spectral radius of a stable step above 1.
const STABLE: f64 = 1e-11;

type Field = Vec<f64>;
type AnyStepper = Box<dyn Stepper<Field>>;

fn torus<const D: usize>() -> Result<Domain<D>> {
    Domain::periodic([0.0; D], [1.0; D])
}

/// Side n, jitter of a share of h.
fn set<const D: usize>(n: usize, jitter: f64) -> Result<Particles<D>> {
    Particles::jittered([0.0; D], [1.0; D], [n; D], jitter, 5)
}

/// The matrix that one step of a run multiplies fields by.
fn step_matrix<const D: usize, S: Scene<D, Value = f64>, St: TimeScheme<D, S>>(
    run: &mut Eulerian<D, S, St>,
    dt: f64,
) -> Result<DMatrix<f64>> {
    let n = run.discrete().site().points().len();
    let mut matrix = DMatrix::zeros(n, n);
    for (q, mut column) in matrix.column_iter_mut().enumerate() {
        let mut u = vec![0.0; n];
        u[q] = 1.0;
        run.step(&mut u, dt)?;
        column.copy_from_slice(&u);
    }
    Ok(matrix)
}

/// Its spectral radius, |G^k|^(1/k) for k = 2^40 by squaring: rounding of a square counts 2^-j at the j-th, and what the
/// norm is above the radius log(condition) 2^-40.
fn radius(matrix: &DMatrix<f64>) -> f64 {
    let (mut power, mut logarithm, mut share) = (matrix.clone(), 0.0, 1.0);
    for _ in 0..40 {
        let size = power.norm();
        logarithm += share * size.ln();
        power /= size;
        power = &power * &power;
        share *= 0.5;
    }
    f64::exp(logarithm + share * power.norm().ln())
}

fn radius_of(text: &'static str) -> Promise {
    Promise::new("Limits of steps", text)
}

/// A run with this sharp rate refuses 1.01 of its limit by name and takes 0.99, and rightly so. Returns how many times
/// longer the sharp limit is than that of the rows.
fn sharp<const D: usize, S: Scene<D, Value = f64>>(
    scene: S,
    set: &Particles<D>,
    neighbors: &impl Neighbors<D>,
    stepper: impl Fn() -> AnyStepper,
    (of, rate): (Limit, Rate),
) -> Result<f64> {
    let (refuse, allow) = (StepPolicy::Refuse, StepPolicy::Allow);
    let mut run = Eulerian::with_policy(scene, set, neighbors, stepper(), refuse, GrowthPolicy::Unknown)?;
    let mut u: Field = (0..set.len()).map(|p| f64::from(u8::from(p == 3))).collect();
    let rows = run.limits(&u)?.step(&stepper());
    let mut run = run.sharp(of, rate);
    let limit = run.limits(&u)?.step(&stepper());
    let error = run.step(&mut u, 1.01 * limit).err().unwrap();
    let expected = SolverError::Limit { dt: 1.01 * limit, limit, binding: of };
    assert_eq!(*error.kind(), ErrorKind::Solver(expected));
    run.step(&mut u, 0.99 * limit)?;
    let mut run = run.step_policy(allow);
    let inside = radius(&step_matrix(&mut run, 0.99 * limit)?);
    let outside = radius(&step_matrix(&mut run, 1.01 * limit)?);
    radius_of("spectral radius of a step at 0.99 of a sharp limit, less 1").at_most(STABLE, inside - 1.0);
    radius_of("spectral radius of a step at 1.01 of a sharp limit, less 1").at_least(1e-6, outside - 1.0);
    Ok(limit / rows)
}

fn explicit() -> Result<Vec<fn() -> AnyStepper>> {
    Ok(vec![
        || Box::new(Euler::new()),
        || Box::new(SspRk3::new()),
        || Box::new(Rk4::new()),
        || Box::new(Rkl2::new(2).expect("two stages")),
        || Box::new(Rkl2::new(4).expect("four stages")),
        || Box::new(Rkl2::new(10).expect("ten stages")),
    ])
}

/// Order r of PSE with epsilon over h on a set of side n, cut at 4.5 epsilon.
fn pse<const D: usize>(set: &Particles<D>, r: u32, overlap: f64, n: usize) -> Result<Pse<Exchange<D>>> {
    let pse = Pse::new(Laplacian::<D>, r, Epsilon::global(overlap / n as f64)?, set.volumes()?)?;
    Ok(if D == 1 { pse } else { pse.support(4.5)? }.allow(Allowance::Everywhere))
}

#[test]
fn diffusion_limits_of_pse_are_sharp_with_the_table_of_a_lattice() -> Result<()> {
    const N: usize = 64;
    for (r, overlap) in [(2, 1.5), (4, 1.5), (6, 1.5), (8, 2.0)] {
        let set = set::<1>(N, 0.0)?;
        let pse = pse(&set, r, overlap, N)?;
        let neighbors = CellList::build(&set, &torus()?, pse.cutoff())?;
        let kernel = Exchange::new(&[Term { index: MultiIndex::new([2]), factor: 1.0 }], r)?;
        let lambda = LatticeSpectrum::scan(&kernel, 1.0 / overlap, 6.0)?.lambda_max * (N as f64 / overlap).powi(2);
        for stepper in explicit()? {
            let scene = AdvectionDiffusion::<1>::new().diffusion(1.0, pse.clone());
            let safer = sharp(scene, &set, &neighbors, stepper, (Limit::Diffusion, Rate::decay(lambda)))?;
            // Kernels within their support are positive definite: the sum of their weights is hardly more than lambda_max.
            assert!((1.0..1.1).contains(&safer), "{r}: {safer}");
        }
    }
    Ok(())
}

#[test]
fn diffusion_limits_of_pse_are_sharp_on_scattered_sets_with_their_eigenvalues() -> Result<()> {
    const N: usize = 14;
    for r in [2, 4, 6, 8] {
        let set = set::<2>(N, 0.1)?;
        let pse = pse(&set, r, 1.5, N)?;
        let neighbors = CellList::build(&set, &torus()?, pse.cutoff())?;
        let rows = pse.assemble(&neighbors)?;
        let lambda = radius(&dense::matrix(set.len(), |u, du| parops::Apply::apply(&rows, u, du)));
        for stepper in explicit()? {
            let scene = AdvectionDiffusion::<2>::new().diffusion(1.0, pse.clone());
            let safer = sharp(scene, &set, &neighbors, stepper, (Limit::Diffusion, Rate::decay(lambda)))?;
            // Cut off inside their support they may have faster modes, and Gershgorin's bound holds.
            assert!((1.5..2.2).contains(&safer), "{r}: {safer}");
        }
    }
    Ok(())
}

/// A scheme whose factor is the exponential series to so many stages.
type Taylor = (fn() -> AnyStepper, u32);

/// The longest step of the scheme with the factor sum_k z^k / k!, k up to `stages`, by bisection over all modes: its
/// region is star-shaped.
fn longest(modes: &[nalgebra::Complex<f64>], stages: u32) -> f64 {
    let radius = modes.iter().fold(0.0_f64, |outer, z| outer.max(z.norm()));
    let (mut inside, mut outside) = (0.0, 8.0 / radius);
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if dense::amplification(modes, middle, stages) <= 1.0 + 1e-9 { inside = middle } else { outside = middle }
    }
    inside
}

/// The same for a scene, whose modes may lie anywhere to the left: the limit is that of its eigenvalues.
fn sharp_by_modes<const D: usize, S: Scene<D, Value = f64>>(
    scene: impl Fn() -> S,
    set: &Particles<D>,
    neighbors: &impl Neighbors<D>,
    of: Limit,
    steppers: &[Taylor],
) -> Result<Vec<f64>> {
    let mut discrete = parops::SemiDiscrete::new(scene(), set, neighbors, GrowthPolicy::Unknown)?;
    let modes = dense::eigenvalues(&dense::matrix(set.len(), |u, du| discrete.rate(0.0, u, du)));
    let limit = |&(stepper, stages): &Taylor| {
        sharp(scene(), set, neighbors, stepper, (of, Rate::frequency(1.0 / longest(&modes, stages))))
    };
    steppers.iter().map(limit).collect()
}

fn taylor() -> [Taylor; 3] {
    [(|| Box::new(Euler::new()), 1), (|| Box::new(SspRk3::new()), 3), (|| Box::new(Rk4::new()), 4)]
}

#[test]
fn diffusion_limits_of_dcpse_are_sharp_with_complex_eigenvalues_in_2d_and_3d() -> Result<()> {
    let plane = set::<2>(14, 0.3)?;
    let scene = || AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::<Laplacian<2>, 2>::new());
    let second = sharp_by_modes(scene, &plane, &Nearest::build(&plane, &torus()?, 20)?, Limit::Diffusion, &taylor())?;
    let scene = || AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::<Laplacian<2>, 4>::new());
    let fourth = sharp_by_modes(scene, &plane, &Nearest::build(&plane, &torus()?, 44)?, Limit::Diffusion, &taylor())?;
    let space = set::<3>(6, 0.2)?;
    let scene = || AdvectionDiffusion::<3>::new().diffusion(1.0, DcPse::<Laplacian<3>, 2>::new());
    let third = sharp_by_modes(scene, &space, &Nearest::build(&space, &torus()?, 38)?, Limit::Diffusion, &taylor())?;
    for safer in second.into_iter().chain(fourth).chain(third) {
        assert!((1.5..2.2).contains(&safer), "{safer}");
    }
    Ok(())
}

#[test]
fn advection_limits_are_sharp_with_complex_eigenvalues_on_scattered_sets() -> Result<()> {
    const N: usize = 14;
    let scattered = set::<2>(N, 0.2)?;
    let upwind = UpwindGradient::new(Epsilon::global(1.0 / N as f64)?, scattered.volumes()?);
    let near = CellList::build(&scattered, &torus()?, upwind.cutoff())?;
    let scene = || AdvectionDiffusion::<2>::new().advection([1.0, -0.6], upwind.clone());
    let first = sharp_by_modes(scene, &scattered, &near, Limit::Advection, &taylor())?;
    let half = UpwindDcPse::half_stencils();
    let near = Nearest::build(&scattered, &torus()?, half.neighbors::<2>()?)?;
    let scene = || AdvectionDiffusion::<2>::new().advection([1.0, -0.6], half);
    let second = sharp_by_modes(scene, &scattered, &near, Limit::Advection, &taylor()[1..])?;
    // Central rows on a lattice: modes on the imaginary axis.
    let lattice = set::<2>(N, 0.0)?;
    let gradient = Pse::new(Gradient::<2>, 2, Epsilon::global(1.5 / N as f64)?, lattice.volumes()?)?.support(4.5)?;
    let gradient = gradient.allow(Allowance::Everywhere);
    let near = CellList::build(&lattice, &torus()?, gradient.cutoff())?;
    let scene = || AdvectionDiffusion::<2>::new().advection([1.0, -0.6], gradient.clone());
    let central = sharp_by_modes(scene, &lattice, &near, Limit::Advection, &taylor()[1..])?;
    for safer in first.into_iter().chain(central) {
        assert!((1.5..2.2).contains(&safer), "{safer}");
    }
    // Their modes are counted on anywhere within their row sums, in the half-disc that SSP-RK3 and RK4 share.
    for safer in second {
        assert!((1.5..4.2).contains(&safer), "{safer}");
    }
    Ok(())
}

/// The matrix of one step on fields modulo constants, by their differences to particle 0, for a run that keeps constants
/// to the bit: its spectral radius and 1 are those of the whole.
fn beside_constants<const D: usize, S: Scene<D, Value = f64>, St: TimeScheme<D, S>>(
    run: &mut Eulerian<D, S, St>,
    dt: f64,
) -> Result<DMatrix<f64>> {
    let mut constant = vec![0.7; run.discrete().site().points().len()];
    run.step(&mut constant, dt)?;
    assert!(constant.iter().all(|u| *u == 0.7));
    let mut matrix = step_matrix(run, dt)?.remove_column(0);
    let first = matrix.row(0).into_owned();
    matrix.row_iter_mut().for_each(|mut row| row -= &first);
    Ok(matrix.remove_row(0))
}

#[test]
fn implicit_steps_of_a_million_explicit_ones_amplify_no_mode() -> Result<()> {
    const NUMBER: f64 = 1e6;
    let scattered = set::<2>(14, 0.2)?;
    let near = Nearest::build(&scattered, &torus()?, 20)?;
    let lattice = set::<2>(14, 0.0)?;
    let pse = pse(&lattice, 4, 1.5, 14)?;
    let around = CellList::build(&lattice, &torus()?, pse.cutoff())?;
    for scheme in [ImplicitScheme::euler, ImplicitScheme::crank_nicolson] {
        // By sparse LU where there is one, and by BiCGSTAB.
        for rows in [2000, 0] {
            let scene = AdvectionDiffusion::<2>::new().diffusion(1.0, DcPse::<Laplacian<2>, 2>::new());
            let mut run = Eulerian::new(scene, &scattered, &near, scheme().lu_up_to(rows))?;
            let dt = NUMBER * run.limits(&vec![0.0; 196])?.step(&Euler::<Field>::new());
            let first = radius(&beside_constants(&mut run, dt)?);
            let scene = AdvectionDiffusion::<2>::new().diffusion(1.0, pse.clone());
            let mut run = Eulerian::new(scene, &lattice, &around, scheme().lu_up_to(rows))?;
            let dt = NUMBER * run.limits(&vec![0.0; 196])?.step(&Euler::<Field>::new());
            let second = radius(&beside_constants(&mut run, dt)?);
            assert!(first - 1.0 <= STABLE && second - 1.0 <= STABLE, "{rows}: {first} {second}");
        }
    }
    Ok(())
}
