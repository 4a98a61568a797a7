//! Everything a user can plug in, written as a user would write it, checked, and used wherever ours is used.

use std::f64::consts::{PI, TAU};

use parops::testing::{
    KernelLimits, Promise, check_kernel, check_method, check_method_moments, check_provider_against,
    check_smoothing_kernel, check_stepper,
};
use parops::{
    AdvectionDiffusion, Apply, BruteForce, Carried, CellList, CenterTerm, Central, Cutoff, D1, Domain, Epsilon, Error,
    ErrorKind, Euler, Eulerian, Gradient, Kernel, KernelError, Lagrangian, Laplacian, LatticeSpectrum, Limit,
    MatrixFree, Method, MultiIndex, Neighbor, NeighborList, Neighbors, OperatorError, Particles, Plan, Policy, Pse,
    Result, Rhs, RowReport, Rows, Scalar, SmoothingKernel, SolverError, Sph, SphForm, State, Stencil, StepLimit,
    Stepper, Term, TimeError, continuous_moment, discrete_moment, epsilon_from_neighbors, integrate,
    volumes_from_neighbors,
};

fn unit<const D: usize>(axis: usize, degree: u8) -> MultiIndex<D> {
    MultiIndex::new(std::array::from_fn(|i| if i == axis { degree } else { 0 }))
}

/// A foreign exchange kernel of the Laplacian in one dimension: 16 z^4 exp(-z^2) / (15 pi^1/2), M_2 = 2, order 2.
#[derive(Clone)]
struct Ring([Term<1>; 1]);

impl Ring {
    fn new() -> Self {
        Self([Term { index: unit(0, 2), factor: 1.0 }])
    }
}

impl<T: Scalar> Kernel<T, 1> for Ring {
    fn value(&self, z: &[T; 1]) -> T {
        // Int z^6 exp(-z^2) dz = 15/8 pi^1/2 makes M_2 = 2.
        let s = z[0] * z[0];
        s * s * (-s).exp() * T::lift(16.0 / (15.0 * PI.sqrt()))
    }

    fn terms(&self) -> &[Term<1>] {
        &self.0
    }

    fn order(&self) -> u32 {
        2
    }

    fn support(&self) -> f64 {
        6.0
    }

    fn overlap_limit(&self) -> f64 {
        0.5
    }
}

#[test]
fn foreign_kernel_serves_moments_pse_and_the_lattice_spectrum() -> Result<()> {
    let ring = Ring::new();
    check_kernel::<1>(&ring, KernelLimits::default()).unwrap();
    assert!((continuous_moment(&ring, unit(0, 2))?.value - 2.0).abs() < 1e-12);

    let n = 64;
    let particles = Particles::lattice([0.0], [1.0], [n])?;
    let epsilon = 2.0 / n as f64;
    let pse = Pse::with_kernels([Ring::new()], Epsilon::global(epsilon)?, particles.volumes()?)?;
    let neighbors = CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?;
    check_method(&pse, &neighbors).unwrap();
    check_method_moments(&pse, &neighbors, &Laplacian::<1>, 3, 1e-8).unwrap();
    let mut row = Stencil::default();
    neighbors.gather(3, 6.0 * epsilon, &mut row);
    let second = discrete_moment(&ring, &row, particles.volumes()?, epsilon, unit(0, 2), CenterTerm::Included)?;
    assert!((second - 2.0).abs() < 1e-8);

    // The fastest decay on the lattice is that of the rows: applied to the fastest wave that fits the ring.
    let spectrum = LatticeSpectrum::scan(&ring, 0.5, 6.0)?;
    let wave_number = (spectrum.fastest[0] / epsilon / TAU).round();
    let f: Vec<f64> = particles.points().iter().map(|x| (TAU * wave_number * x[0]).cos()).collect();
    let (mut stored, mut free) = (vec![0.0; n], vec![0.0; n]);
    pse.assemble(&neighbors)?.apply(&f, &mut stored)?;
    pse.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(stored, free);
    let decay = -stored[0] / f[0] * epsilon * epsilon;
    // The nearest wave is half a wave number away at most, where the maximum is flat: its square over 2.
    assert!(decay <= spectrum.lambda_max * (1.0 + 1e-12) && decay > 0.99 * spectrum.lambda_max, "{decay} {spectrum:?}");
    Ok(())
}

/// A foreign smoothing kernel: the quartic B-spline as a product along the axes, support 5/2, three times
/// differentiable, of which two are offered.
#[derive(Clone, Debug)]
struct Quartic([Term<2>; 1]);

impl Quartic {
    fn new() -> Self {
        Self([Term { index: MultiIndex::ZERO, factor: 1.0 }])
    }

    /// D^n of sum_j (-1)^j C(5, j) (5/2 - j - |x|)_+^4 / 24, j = 0, 1, 2.
    fn spline<T: Scalar>(n: u8, x: T) -> Result<T> {
        let power = 4 - i32::from(n);
        let front = [1.0 / 24.0, 1.0 / 6.0, 0.5].get(usize::from(n));
        let front = *front.ok_or(KernelError::Regularity { kernel: "foreign", degree: n.into(), limit: 2 })?;
        let mut sum = T::zero();
        for (j, binomial) in [1.0, -5.0, 10.0].into_iter().enumerate() {
            let left = T::lift(2.5 - j as f64) - x.abs();
            if left > T::zero() {
                sum += left.powi(power) * T::lift(binomial * front);
            }
        }
        // The inner derivative of |x|, once for every odd degree.
        Ok(if n == 1 && x > T::zero() { -sum } else { sum })
    }
}

impl<T: Scalar> Kernel<T, 2> for Quartic {
    fn value(&self, z: &[T; 2]) -> T {
        Self::spline(0, z[0]).unwrap_or(T::zero()) * Self::spline(0, z[1]).unwrap_or(T::zero())
    }

    fn terms(&self) -> &[Term<2>] {
        &self.0
    }

    fn order(&self) -> u32 {
        2
    }

    /// The corner of the square of half width 5/2.
    fn support(&self) -> f64 {
        2.5 * 2.0_f64.sqrt()
    }

    /// A B-spline replaces the integral exactly where 1/(h/epsilon) is a whole number; between, to 2e-3 at 1/2.
    fn overlap_limit(&self) -> f64 {
        0.5
    }

    fn positive_definite(&self) -> bool {
        false
    }
}

impl<T: Scalar> SmoothingKernel<T, 2> for Quartic {
    fn derivative(&self, beta: MultiIndex<2>, z: &[T; 2]) -> Result<T> {
        let [i, j] = beta.exponents();
        Ok(Self::spline(i, z[0])? * Self::spline(j, z[1])?)
    }

    fn normalization(&self) -> f64 {
        1.0 / 576.0
    }
}

#[test]
fn foreign_smoothing_kernel_serves_sph_and_volumes() -> Result<()> {
    let quartic = Quartic::new();
    // Its moments by quadrature converge with the sixth power of the spacing: 1e-8 is left.
    let limits = KernelLimits { moment: 1e-7, ..KernelLimits::default() };
    check_smoothing_kernel::<2>(&quartic, limits).unwrap();

    let n = 32;
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let epsilon = Epsilon::global(2.0 / n as f64)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let neighbors = CellList::build(&particles, &torus, epsilon.cutoff(3.6))?;
    let volumes = volumes_from_neighbors(&neighbors, &quartic, &epsilon)?;
    assert!((volumes.get(77)? * 1024.0 - 1.0).abs() < 1e-12);

    let f: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin() * (TAU * x[1]).cos()).collect();
    let sph = Sph::new(Gradient::<2>, quartic.clone(), epsilon.clone(), &volumes)?.form(SphForm::Difference)?;
    check_method(&sph, &neighbors).unwrap();
    let mut gradient = vec![[0.0; 2]; f.len()];
    sph.assemble(&neighbors)?.apply_all(&f, &mut gradient)?;
    // A B-spline of variance 5/12 damps a wave of |k|^2 epsilon^2 = 2 (2 pi/16)^2 by 6 %, each axis by 3 %.
    for (x, g) in particles.points().iter().zip(&gradient) {
        let exact = TAU * (TAU * x[0]).cos() * (TAU * x[1]).cos();
        assert!((g[0] - exact).abs() < 0.07 * TAU);
    }
    let third = Sph::new(parops::D2::<3, 0>::default(), quartic, epsilon, &volumes).unwrap_err();
    assert_eq!(*third.kind(), ErrorKind::Kernel(KernelError::Regularity { kernel: "foreign", degree: 3, limit: 2 }));
    Ok(())
}

/// A foreign provider: points of a periodic ring by index arithmetic, without any search.
struct Circle {
    count: usize,
    reach: usize,
    /// The set it is for.
    generation: u64,
}

impl Circle {
    fn spacing(&self) -> f64 {
        1.0 / self.count as f64
    }
}

impl Neighbors<1> for Circle {
    fn targets(&self) -> usize {
        self.count
    }

    fn sources(&self) -> usize {
        self.count
    }

    fn center(&self, p: usize) -> Option<usize> {
        (p < self.count).then_some(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.reach()
    }

    fn reach(&self) -> f64 {
        self.reach as f64 * self.spacing()
    }

    fn generation(&self) -> u64 {
        self.generation
    }

    fn for_each(&self, p: usize, cutoff: f64, mut visit: impl FnMut(Neighbor<1>)) {
        for step in 1..=self.reach {
            let distance = step as f64 * self.spacing();
            if distance <= cutoff {
                visit(Neighbor { q: (p + step) % self.count, separation: [-distance], sign: 1 });
                visit(Neighbor { q: (p + self.count - step) % self.count, separation: [distance], sign: 1 });
            }
        }
    }
}

#[test]
fn foreign_provider_serves_lists_pse_and_sph_stored_and_matrix_free() -> Result<()> {
    // With 64 points every coordinate and distance is exact, so that the oracle has the same bits.
    let particles = Particles::lattice([0.0], [1.0], [64])?;
    let circle = Circle { count: 64, reach: 12, generation: particles.generation() };
    let domain = Domain::periodic([0.0], [1.0])?;
    let oracle = BruteForce::build(&particles, &domain, Cutoff(circle.reach()))?;
    check_provider_against(&circle, &oracle).unwrap();
    check_provider_against(&NeighborList::from_provider(&circle)?, &oracle).unwrap();
    assert!(epsilon_from_neighbors(&circle, 1.0)?.get(5)? > 0.0);

    let epsilon = Epsilon::global(2.0 / 64.0)?;
    let f: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let pse = Pse::new(Laplacian::<1>, 4, epsilon.clone(), particles.volumes()?)?;
    let sph = Sph::new(D1::<1>::default(), parops::HighOrderGaussian::<1>::new(4)?, epsilon, particles.volumes()?)?;
    let (mut ours, mut stored, mut free) = (vec![0.0; 64], vec![0.0; 64], vec![0.0; 64]);
    pse.assemble(&oracle.clone().canonical())?.apply(&f, &mut ours)?;
    let canonical = circle.canonical();
    pse.assemble(&canonical)?.apply(&f, &mut stored)?;
    pse.matrix_free(&canonical)?.apply(&f, &mut free)?;
    assert_eq!((&stored, &free), (&ours, &ours));
    sph.assemble(&oracle.canonical())?.apply(&f, &mut ours)?;
    sph.assemble(&canonical)?.apply(&f, &mut stored)?;
    sph.matrix_free(&canonical)?.apply(&f, &mut free)?;
    assert_eq!((&stored, &free), (&ours, &ours));
    assert!((ours[9] / (TAU * (TAU * particles.points()[9][0]).cos()) - 1.0).abs() < 1e-3);
    Ok(())
}

/// A foreign method: the first derivative as the slope of the least-squares line through the particle, any points within
/// a cutoff.
struct Slope(f64);

impl Method<1> for Slope {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }

    fn cutoff(&self, _: usize) -> Result<Option<f64>> {
        Ok(Some(self.0))
    }

    fn weights(&self, row: &Stencil<1>, _: &mut (), w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        if row.center().is_none() {
            return Err(OperatorError::NoCenter { neighbors: row.len() }.into());
        }
        let squares: f64 = row.separations().iter().map(|s| s[0] * s[0]).sum();
        *diagonal = [0.0];
        for (w, neighbor) in w.iter_mut().zip(row.iter()) {
            // The line through (0, f_p): slope sum_q y_q (f_q - f_p) / sum_q y_q^2 with y_q = x_q - x_p.
            let weight = -neighbor.separation[0] / squares;
            let share;
            (w[0], share) = parops::spread(weight, -weight, neighbor.sign);
            diagonal[0] += share;
        }
        Ok(())
    }

    fn report(&self, row: &Stencil<1>, _: &(), w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        Ok(RowReport::of(row, w, diagonal))
    }
}

#[test]
fn foreign_method_runs_through_rows_and_matrix_free_over_the_cell_list() -> Result<()> {
    let particles = Particles::jittered([0.0], [1.0], [64], 0.4, 3)?;
    let mirrors = Domain::new([0.0], [1.0], [[parops::Face::MirrorOdd, parops::Face::MirrorEven]])?;
    let neighbors = CellList::build(&particles, &mirrors, Cutoff(0.04))?;
    check_method(&Slope(0.04), &neighbors).unwrap();
    // Exact for lines on any points; no condition is solved, so that rounding alone is left.
    check_method_moments(
        &Slope(0.04),
        &CellList::build(&particles, &Domain::open(), Cutoff(0.04))?,
        &D1::<1>::default(),
        1,
        1e-13,
    )
    .unwrap();

    let rows: Rows = Rows::assemble(&Slope(0.04), &neighbors)?;
    let free = MatrixFree::new(&Slope(0.04), &neighbors)?;
    let f: Vec<f64> = particles.points().iter().map(|x| (0.5 * PI * x[0]).sin()).collect();
    let (mut stored, mut again) = (vec![0.0; 64], vec![0.0; 64]);
    rows.apply(&f, &mut stored)?;
    free.apply(&f, &mut again)?;
    assert_eq!(stored, again);
    for (x, slope) in particles.points().iter().zip(&stored) {
        // |f''| <= (pi/2)^2 over half a stencil.
        assert!((slope - 0.5 * PI * (0.5 * PI * x[0]).cos()).abs() < 2.5 * 0.04);
    }
    let points = CellList::build_at(&[[0.5]], &particles, &Domain::open(), Cutoff(0.04))?;
    let error = Rows::<[f64; 1]>::assemble(&Slope(0.04), &points).unwrap_err();
    assert!(error.particle() == Some(0) && matches!(error.kind(), ErrorKind::Operator(OperatorError::NoCenter { .. })));
    Ok(())
}

/// A foreign stepper: Heun's method of order 3, of any state.
struct Heun<S> {
    held: Option<[S; 3]>,
}

impl<S> Default for Heun<S> {
    fn default() -> Self {
        Self { held: None }
    }
}

impl<S: State> Stepper<S> for Heun<S> {
    fn order(&self) -> u32 {
        3
    }

    fn negative_real_interval(&self) -> f64 {
        2.5127453266183286
    }

    fn imaginary_interval(&self) -> f64 {
        3.0_f64.sqrt()
    }

    fn step(&mut self, t: f64, dt: f64, u: &mut S, rhs: &mut Rhs<'_, S>) -> Result<()> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(TimeError::Step { dt }.into());
        }
        if t + dt == t {
            return Err(TimeError::NoProgress { t, dt }.into());
        }
        let finite = |u: &S, stage, t| match u.first_non_finite() {
            None => Ok(()),
            Some(p) => Err(Error::from(TimeError::NotFinite { stage, t }).at(p)),
        };
        let [first, rate, next] = self.held.get_or_insert_with(|| std::array::from_fn(|_| u.clone()));
        first.assign(u);
        rate.assign(u);
        next.assign(u);
        rhs(t, u, first)?;
        first.same_shape(u)?;
        finite(first, 1, t)?;
        next.set_sum(u, dt / 3.0, first);
        for (stage, share) in [(2, 2.0 / 3.0), (3, 0.75)] {
            let at = t + f64::from(stage - 1) / 3.0 * dt;
            rhs(at, next, rate)?;
            rate.same_shape(u)?;
            finite(rate, stage as usize, at)?;
            next.set_sum(u, share * dt, rate);
        }
        next.add_scaled(0.25 * dt, first);
        finite(next, 4, t + dt)?;
        std::mem::swap(u, next);
        Ok(())
    }
}

#[test]
fn foreign_stepper_passes_and_integrates_within_the_limit() -> Result<()> {
    let report = check_stepper(Heun::default).unwrap();
    assert_eq!(report.stages, 3);

    let n = 64;
    let particles = Particles::lattice([0.0], [1.0], [n])?;
    let pse = Pse::new(Laplacian::<1>, 2, Epsilon::global(2.0 / n as f64)?, particles.volumes()?)?;
    let rows = pse.assemble(&CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, pse.cutoff())?)?;
    let limit = StepLimit::from_spectral_bound(rows.report().spectral_bound, 1.0)?;
    let plan = Plan::new(0.0, 0.02, 1.0)?.limit(limit).cut_for(&Heun::<Vec<f64>>::default())?;
    assert!(limit.step(&Heun::<Vec<f64>>::default()) > 1.25 * limit.step(&Euler::<Vec<f64>>::new()));
    let start: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let mut u = start.clone();
    let run = integrate(
        &mut Heun::default(),
        &mut u,
        &plan,
        |_, u: &Vec<f64>, du: &mut Vec<f64>| rows.apply(u, du),
        |_, _, _| {},
    )?;
    assert!(run.within_limit);
    // The narrow Gaussian slows the decay by epsilon^2 k^2 / 8.
    let decay = (-TAU * TAU * 0.02).exp();
    assert!(u.iter().zip(&start).all(|(u, start)| (u - decay * start).abs() < 0.01), "{}", u[16] / start[16] / decay);
    let above = Plan::new(0.0, 0.02, 1.0)?.limit(limit);
    let mut refused = start.clone();
    let error = integrate(
        &mut Heun::default(),
        &mut refused,
        &above,
        |_, u: &Vec<f64>, du: &mut Vec<f64>| rows.apply(u, du),
        |_, _, _| {},
    );
    assert!(matches!(error.unwrap_err().kind(), ErrorKind::Time(TimeError::Limit { .. })));
    assert_eq!(refused, start);
    let allowed = above.policy(Policy::Allow);
    let run = integrate(
        &mut Heun::default(),
        &mut refused,
        &allowed,
        |_, u: &Vec<f64>, du: &mut Vec<f64>| rows.apply(u, du),
        |_, _, _| {},
    )?;
    assert!(!run.within_limit);
    Ok(())
}

#[test]
fn all_four_run_a_scene() -> Result<()> {
    // du/dt + u_x = D u_xx on the ring: kernel and method by the provider, moved by the stepper.
    const D: f64 = 0.02;
    const END: f64 = 0.25;
    let particles = Particles::lattice([0.0], [1.0], [64])?;
    let circle = Circle { count: 64, reach: 12, generation: particles.generation() };
    let pse = || Pse::with_kernels([Ring::new()], Epsilon::global(2.0 / 64.0)?, particles.volumes()?);
    let wave = |x: &[f64; 1], t: f64| (-D * TAU * TAU * t).exp() * (TAU * (x[0] - t)).sin();
    let mut u: Vec<f64> = particles.points().iter().map(|x| wave(x, 0.0)).collect();
    let start = u.clone();
    let scene = AdvectionDiffusion::<1>::new().diffusion(D, pse()?).advection([1.0], Central(Slope(1.5 / 64.0)));
    let mut run = Eulerian::new(scene, &particles, &circle, Heun::default())?;
    let limits = run.limits(&u)?;
    let dt = limits.step(&Heun::<Vec<f64>>::default());
    assert_eq!(limits.binding(&Heun::<Vec<f64>>::default()), Some(Limit::Advection));
    assert!(matches!(run.step(&mut u, 1.01 * dt).err().unwrap().kind(), ErrorKind::Solver(SolverError::Limit { .. })));
    run.advance(&mut u, END, dt)?;
    // The slope slows the wave by (k h)^2/6 of v k t = pi/2, the kernel its decay by 7 (k epsilon)^2/24 of D k^2 t = 0.2: 2.5e-3
    // and 2.2e-3; the stepper leaves (v k dt)^4/24 a step.
    let worst = particles.points().iter().zip(&u).map(|(x, u)| (u - wave(x, END)).abs()).fold(0.0, f64::max);
    let run_by_users = |text| Promise::new("Accuracy", text);
    run_by_users("a scene by a kernel, method, provider and stepper of the user's own, error").at_most(5e-3, worst);
    assert!(run.ledger().fields[0].drift.abs() < 1e-14);

    // Carried along, kernel and stepper alone: what is left is the decay.
    let scene = AdvectionDiffusion::<1>::new().diffusion(D, pse()?).advection([1.0], Carried);
    let ring = Domain::periodic([0.0], [1.0])?;
    let mut moving = Lagrangian::new(scene, &particles, &start, &ring, Heun::default())?;
    moving.advance(END, 0.01)?;
    let apart = |(x, u): (&[f64; 1], f64)| (u - wave(x, END)).abs();
    let worst = moving.points().iter().zip(moving.values()).map(apart).fold(0.0, f64::max);
    run_by_users("a moving scene by a kernel and stepper of the user's own, error").at_most(3e-3, worst);
    Ok(())
}
