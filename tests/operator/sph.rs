//! SPH: the smooth approximation of a field and its derivatives, at particles and anywhere else.

use std::f64::consts::{PI, TAU};

use parops::{
    Allowance, Apply, BruteForce, CellList, Cutoff, D2, Differentiated, Domain, Epsilon, Error, ErrorKind, Expression,
    Face, Gaussian, Gradient, HighOrderGaussian, Kernel, KernelError, Laplacian, Method, MultiIndex, Neighbors,
    OperatorError, Particles, Random, Rows, SmoothingKernel, Sph, SphForm, Stencil, Term, Volumes, testing::Promise,
};

type Failure = Result<(), Error>;

/// Round-off of a row of n terms in units of its sum_abs times the largest value: n additions and products, and as
/// much again for the kernel values, each a few eps.
fn round_off(n: usize) -> f64 {
    4.0 * n as f64 * f64::EPSILON
}

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn lattice(n: usize) -> Particles<2> {
    Particles::lattice([0.0; 2], [1.0; 2], [n; 2]).unwrap()
}

/// sin(2 pi x) cos(2 pi y), a sum of waves of |k|^2 = 2 (2 pi)^2, and its derivatives by exponents.
fn wave(x: &[f64; 2], beta: [u8; 2]) -> f64 {
    let turn = |n: u8| f64::from(n) * 0.5 * PI;
    let factor = TAU.powi(i32::from(beta[0] + beta[1]));
    factor * (TAU * x[0] + turn(beta[0])).sin() * (TAU * x[1] + turn(beta[1])).cos()
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |largest, v| if v.abs() > largest || v.is_nan() { v.abs() } else { largest })
}

fn derivative(beta: [u8; 2]) -> Expression<2> {
    Expression::new([(MultiIndex::new(beta), 1.0)]).unwrap()
}

fn anywhere(count: usize) -> Vec<[f64; 2]> {
    let mut random = Random::new(17);
    (0..count).map(|_| [random.uniform(), random.uniform()]).collect()
}

/// A kernel with an overlap epsilon/h and a cutoff at which truncation and aliasing are below 1e-14.
#[derive(Clone)]
enum Choice {
    Plain(Gaussian<2>),
    High(HighOrderGaussian<2>, u32),
}

impl Choice {
    fn all() -> Vec<Self> {
        let high = [2, 4, 6, 8].map(|order| Self::High(HighOrderGaussian::new(order).unwrap(), order));
        std::iter::once(Self::Plain(Gaussian::new())).chain(high).collect()
    }

    fn order(&self) -> u32 {
        match self {
            Self::Plain(_) => 2,
            Self::High(_, order) => *order,
        }
    }

    fn epsilon(&self, n: usize) -> f64 {
        match self {
            Self::Plain(_) => 1.5 / n as f64,
            Self::High(..) => 2.5 / n as f64,
        }
    }

    /// The transform of the kernel at |k|^2 = 2 (2 pi)^2: what it damps the wave by.
    fn damping(&self, epsilon: f64) -> f64 {
        let square = 2.0 * TAU * TAU * epsilon * epsilon;
        match self {
            Self::Plain(_) => (-0.5 * square).exp(),
            Self::High(_, order) => {
                let s = 0.25 * square;
                let (mut term, mut sum) = (1.0, 0.0);
                for j in 0..order / 2 {
                    sum += term;
                    term *= s / f64::from(j + 1);
                }
                sum * (-s).exp()
            }
        }
    }

    /// D^beta of the wave at the targets of `build`, and the report's sum_abs and most neighbors.
    fn apply<P: Neighbors<2>>(
        &self,
        particles: &Particles<2>,
        beta: [u8; 2],
        form: SphForm,
        build: impl Fn(Cutoff) -> P,
    ) -> (Vec<f64>, f64) {
        let n = (particles.len() as f64).sqrt().round() as usize;
        let epsilon = Epsilon::global(self.epsilon(n)).unwrap();
        let volumes = particles.volumes().unwrap();
        let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
        match self {
            // Cutoffs at which the Gaussian is 3e-20 and 5e-22 of its top.
            Self::Plain(kernel) => {
                let sph = Sph::new(derivative(beta), kernel.clone(), epsilon, volumes).unwrap().form(form).unwrap();
                run(&sph.support(9.5).unwrap(), &f, build)
            }
            Self::High(kernel, _) => {
                let sph = Sph::new(derivative(beta), kernel.clone(), epsilon, volumes).unwrap().form(form).unwrap();
                run(&sph.support(7.0).unwrap(), &f, build)
            }
        }
    }
}

fn run<W: SmoothingKernel<f64, 2>, P: Neighbors<2>>(
    sph: &Sph<W, 2>,
    f: &[f64],
    build: impl Fn(Cutoff) -> P,
) -> (Vec<f64>, f64) {
    let neighbors = build(sph.cutoff());
    let rows = sph.assemble(&neighbors).unwrap();
    let mut out = vec![f64::NAN; neighbors.targets()];
    rows.apply(f, &mut out).unwrap();
    (out, round_off(rows.report().most) * rows.report().sum_abs)
}

const DERIVATIVES: [[u8; 2]; 5] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1]];

#[test]
fn smooth_approximation_on_a_lattice_damps_a_wave_by_the_transform_of_the_kernel() {
    let (n, targets) = (48, anywhere(60));
    let particles = lattice(n);
    for choice in Choice::all() {
        let damping = choice.damping(choice.epsilon(n));
        for beta in DERIVATIVES {
            let at = |cutoff| CellList::build_at(&targets, &particles, &torus(), cutoff).unwrap();
            let (out, bound) = choice.apply(&particles, beta, SphForm::Summation, at);
            for (x, out) in targets.iter().zip(out) {
                let expected = damping * wave(x, beta);
                assert!((out - expected).abs() <= bound, "r = {}, {beta:?}: {out} {expected}", choice.order());
            }
        }
    }
}

#[test]
fn derivatives_of_every_degree_converge_with_the_order_of_the_kernel_on_lattices() {
    // Errata 9: r, not r - |beta|. The finest pair whose error is above the round-off of 1/epsilon^m.
    let targets = anywhere(60);
    for choice in Choice::all() {
        let n = 36;
        for beta in DERIVATIVES {
            let mut forms = vec![(SphForm::Summation, false)];
            match beta {
                [1, 0] => forms.push((SphForm::Summation, true)),
                [2, 0] => forms.push((SphForm::Difference, true)),
                _ => {}
            }
            for (form, at_particles) in forms {
                let error = |n: usize| {
                    let particles = lattice(n);
                    let (out, points) = if at_particles {
                        let build = |cutoff| CellList::build(&particles, &torus(), cutoff).unwrap();
                        (choice.apply(&particles, beta, form, build).0, particles.points())
                    } else {
                        let at = |cutoff| CellList::build_at(&targets, &particles, &torus(), cutoff).unwrap();
                        (choice.apply(&particles, beta, form, at).0, &targets[..])
                    };
                    largest(points.iter().zip(out).map(|(x, out)| out - wave(x, beta)))
                };
                let observed = (error(n) / error(2 * n)).log2();
                // The next term of the error is at most a tenth of the leading one here, which is 0.15 in the order.
                let r = f64::from(choice.order());
                Promise::new("Orders", format!("SPH on lattices, r = {r}")).within(r - 0.2, r + 0.2, observed);
            }
        }
    }
}

#[test]
fn difference_form_is_exactly_zero_for_constants_on_scattered_sets_and_summation_is_not() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.3, 5)?;
    let n = particles.len();
    for beta in [[1, 0], [0, 2], [1, 1]] {
        let sph = Sph::new(derivative(beta), Gaussian::<2>::new(), Epsilon::global(0.06)?, particles.volumes()?)?
            .support(6.0)?
            .allow(Allowance::Everywhere);
        let neighbors = CellList::build(&particles, &torus(), sph.cutoff())?;
        let mut out = vec![f64::NAN; n];
        sph.assemble(&neighbors)?.apply(&vec![1.0; n], &mut out)?;
        assert!(largest(out.iter().copied()) > 0.1);
        let difference = sph.form(SphForm::Difference)?;
        difference.assemble(&neighbors)?.apply(&vec![-7.3; n], &mut out)?;
        assert!(out.iter().all(|&x| x == 0.0));
        let mut out = vec![f32::NAN; n];
        Rows::<_, f32>::assemble(&difference, &neighbors)?.apply(&vec![0.1; n], &mut out)?;
        assert!(out.iter().all(|&x| x == 0.0));
    }
    Ok(())
}

/// |M_0 - required| and the relative defect of M_beta, for D^beta of a Gaussian, by hand.
fn moments(neighbors: &BruteForce<2>, p: usize, beta: [u8; 2], epsilon: f64, volume: f64) -> (f64, f64) {
    let w = Gaussian::<2>::new();
    let index = MultiIndex::new(beta);
    let mut row = Stencil::default();
    neighbors.gather(p, 6.0 * epsilon, &mut row);
    let factorial = f64::from(index.sign()) * index.factorial().unwrap() as f64;
    let scaled = volume / epsilon / epsilon;
    let own = if row.center().is_some() { scaled * w.derivative(index, &[0.0; 2]).unwrap() } else { 0.0 };
    let (mut zeroth, mut moment) = (own, 0.0);
    for separation in row.separations() {
        let z = separation.map(|s| s / epsilon);
        let value = scaled * w.derivative(index, &z).unwrap();
        zeroth += value;
        moment += value * index.power::<f64>(&z);
    }
    if beta == [0, 0] { ((zeroth - 1.0).abs(), 0.0) } else { (zeroth.abs(), (moment / factorial - 1.0).abs()) }
}

#[test]
fn summation_on_scattered_sets_is_refused_at_the_worst_zeroth_or_own_moment_unless_allowed() -> Failure {
    let particles = Particles::random([0.0; 2], [1.0; 2], 400, 2)?;
    let (epsilon, volume) = (0.07, 1.0 / 400.0);
    for beta in [[0, 0], [1, 0], [2, 0]] {
        let sph = Sph::new(derivative(beta), Gaussian::<2>::new(), Epsilon::global(epsilon)?, particles.volumes()?)?
            .support(6.0)?;
        let neighbors = BruteForce::build(&particles, &torus(), sph.cutoff())?;
        let difference = sph.clone().form(if beta == [0, 0] { SphForm::Summation } else { SphForm::Difference })?;
        for (sph, with_zeroth) in [(sph, true), (difference, beta == [0, 0])] {
            let error = sph.assemble(&neighbors).unwrap_err();
            let ErrorKind::Operator(OperatorError::Moment { defect, limit }) = *error.kind() else { panic!("{error}") };
            let all = (0..400).map(|p| {
                let (zeroth, own) = moments(&neighbors, p, beta, epsilon, volume);
                (p, if with_zeroth { zeroth.max(own) } else { own })
            });
            let (worst, expected) = all.fold((0, 0.0), |worst, one| if one.1 > worst.1 { one } else { worst });
            assert_eq!((error.particle(), limit), (Some(worst), 0.05));
            // About 70 terms with a sum of moduli below 10.
            assert!((defect - expected).abs() <= 10.0 * round_off(70), "{defect} {expected}");
            let rows = sph.allow(Allowance::Everywhere).assemble(&neighbors)?;
            assert_eq!(rows.report().moment_defect, defect);
            assert!(rows.report().allowed > 0);
        }
    }
    Ok(())
}

#[test]
fn particle_is_its_own_neighbor_in_a_sum_whether_it_is_the_center_or_a_point() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.2, 3)?;
    let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0]) + 2.0).collect();
    for beta in [[0, 0], [2, 0]] {
        let sph = Sph::new(derivative(beta), Gaussian::<2>::new(), Epsilon::global(0.08)?, particles.volumes()?)?
            .support(6.0)?
            .allow(Allowance::Everywhere);
        let rows = sph.assemble(&CellList::build(&particles, &torus(), sph.cutoff())?)?;
        let points = CellList::build_at(particles.points(), &particles, &torus(), sph.cutoff())?;
        let at_points = sph.assemble(&points)?;
        let (mut a, mut b) = (vec![0.0; 400], vec![0.0; 400]);
        rows.apply(&f, &mut a)?;
        at_points.apply(&f, &mut b)?;
        // f is at most 3; sum_abs of the rows at particles holds the difference form of the same sum.
        let bound = 3.0 * round_off(rows.report().most) * rows.report().sum_abs;
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= bound));
        assert_eq!(at_points.report().most, rows.report().most + 1);
        assert!((rows.report().moment_defect - at_points.report().moment_defect).abs() <= bound);
    }
    Ok(())
}

#[test]
fn mirrors_continue_odd_and_even_fields_at_particles_and_on_the_wall() -> Failure {
    let n = 64;
    let epsilon = 1.5 / n as f64;
    let particles = Particles::lattice([0.0], [1.0], [n])?;
    let targets = [[0.0], [0.013], [0.5], [0.99], [1.0]];
    // Fields that continue smoothly: waves of the doubled box, damped by exp(-pi^2 epsilon^2 / 2).
    let damping = (-0.5 * (PI * epsilon).powi(2)).exp();
    for (face, phase) in [(Face::MirrorOdd, 0.0), (Face::MirrorEven, 0.5 * PI)] {
        let domain = Domain::new([0.0], [1.0], [[face; 2]])?;
        let f: Vec<f64> = particles.points().iter().map(|x| (PI * x[0] + phase).sin()).collect();
        for degree in 0..3_u8 {
            let operator = Expression::new([(MultiIndex::new([degree]), 1.0)])?;
            let sph = Sph::new(operator, Gaussian::<1>::new(), Epsilon::global(epsilon)?, particles.volumes()?)?
                .support(9.5)?;
            let exact = |x: &[f64; 1]| {
                let turned = PI * x[0] + phase + f64::from(degree) * 0.5 * PI;
                damping * PI.powi(i32::from(degree)) * turned.sin()
            };
            let check = |rows: Rows, points: &[[f64; 1]]| -> Failure {
                let mut out = vec![f64::NAN; points.len()];
                rows.apply(&f, &mut out)?;
                // Positions behind a mirror are rounded to eps of the box, which the slope 1/epsilon of W magnifies.
                let bound = (round_off(rows.report().most) + 4.0 * f64::EPSILON / epsilon) * rows.report().sum_abs;
                for (x, out) in points.iter().zip(out) {
                    assert!((out - exact(x)).abs() <= bound, "{face:?}, degree {degree}, {x:?}: {out}");
                }
                Ok(())
            };
            check(sph.assemble(&CellList::build(&particles, &domain, sph.cutoff())?)?, particles.points())?;
            check(sph.assemble(&CellList::build_at(&targets, &particles, &domain, sph.cutoff())?)?, &targets)?;
        }
    }
    Ok(())
}

#[test]
fn open_faces_and_empty_surroundings_are_refused_by_the_zeroth_moment() -> Failure {
    let particles = lattice(24);
    let sph = Sph::new(derivative([0, 0]), Gaussian::<2>::new(), Epsilon::global(0.06)?, particles.volumes()?)?;
    // In the corner a quarter of the kernel is left, outside nothing.
    for (target, due) in [([0.0, 0.0], 0.75), ([4.0, 0.5], 1.0)] {
        let at = CellList::build_at(&[[0.5, 0.5], target], &particles, &Domain::open(), sph.cutoff())?;
        let error = sph.assemble(&at).unwrap_err();
        let ErrorKind::Operator(OperatorError::Moment { defect, .. }) = *error.kind() else { panic!("{error}") };
        assert_eq!(error.particle(), Some(1));
        assert!((defect - due).abs() < 1e-6, "{defect}");
    }
    Ok(())
}

#[test]
fn target_off_the_particles_has_no_difference_form() -> Failure {
    let particles = lattice(24);
    let sph = Sph::new(derivative([1, 0]), Gaussian::<2>::new(), Epsilon::global(0.06)?, particles.volumes()?)?
        .support(6.0)?;
    let between = CellList::build_at(&[[0.51, 0.52], [0.3, 0.3]], &particles, &torus(), sph.cutoff())?;
    assert!(sph.assemble(&between).is_ok());
    let error = sph.form(SphForm::Difference)?.assemble(&between).unwrap_err();
    assert!(matches!(*error.kind(), ErrorKind::Operator(OperatorError::NoCenter { neighbors }) if neighbors > 0));
    assert_eq!(error.particle(), Some(0));
    Ok(())
}

#[test]
fn gradient_divergence_and_velocity_contract_one_set_of_rows() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.2, 6)?;
    let (n, epsilon) = (particles.len(), Epsilon::global(0.07)?);
    let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
    for form in [SphForm::Summation, SphForm::Difference] {
        let kernel = HighOrderGaussian::<2>::new(4)?;
        let sph = Sph::new(Gradient::<2>, kernel.clone(), epsilon.clone(), particles.volumes()?)?
            .form(form)?
            .allow(Allowance::Everywhere);
        let neighbors = CellList::build(&particles, &torus(), sph.cutoff())?;
        let rows = sph.assemble(&neighbors)?;
        let mut gradient = vec![[f64::NAN; 2]; n];
        rows.apply_all(&f, &mut gradient)?;
        let mut components = [vec![f64::NAN; n], vec![f64::NAN; n]];
        for (component, beta) in components.iter_mut().zip([[1, 0], [0, 1]]) {
            let one = Sph::new(derivative(beta), kernel.clone(), epsilon.clone(), particles.volumes()?)?
                .form(form)?
                .allow(Allowance::Everywhere);
            one.assemble(&neighbors)?.apply(&f, component)?;
        }
        assert!((0..n).all(|p| gradient[p] == [components[0][p], components[1][p]]), "the same bits output by output");

        let velocity: Vec<[f64; 2]> = particles.points().iter().map(|x| [-x[1], 0.5 * x[0]]).collect();
        let field: Vec<[f64; 2]> = f.iter().map(|&f| [f, -2.0 * f]).collect();
        let (mut along, mut divergence) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        rows.apply_along(&velocity, &f, &mut along)?;
        rows.apply_dot(&field, &mut divergence)?;
        let bound = 4.0 * round_off(rows.report().most) * rows.report().sum_abs;
        for p in 0..n {
            let [x, y] = gradient[p];
            assert!((along[p] - velocity[p][0] * x - velocity[p][1] * y).abs() <= bound);
            assert!((divergence[p] - (x - 2.0 * y)).abs() <= bound);
        }
    }
    Ok(())
}

#[test]
fn stored_and_matrix_free_rows_agree_in_both_precisions_at_particles_and_points() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.1, 4)?;
    let mixed = Domain::new([0.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]])?;
    let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
    let single: Vec<f32> = f.iter().map(|&f| f as f32).collect();
    let sph =
        Sph::new(D2::<0, 1>::default(), HighOrderGaussian::<2>::new(2)?, Epsilon::global(0.08)?, particles.volumes()?)?
            .allow(Allowance::Everywhere);
    let points = anywhere(37);
    for neighbors in [
        CellList::build(&particles, &mixed, sph.cutoff())?,
        CellList::build_at(&points, &particles, &mixed, sph.cutoff())?,
    ] {
        let n = neighbors.targets();
        let (rows, free) = (sph.assemble(&neighbors)?, sph.matrix_free(&neighbors)?);
        assert_eq!(free.report(), rows.report());
        let (mut a, mut b) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        rows.apply(&f, &mut a)?;
        free.apply(&f, &mut b)?;
        assert_eq!(a, b);
        let (mut c, mut d) = (vec![f32::NAN; n], vec![f32::NAN; n]);
        Rows::<_, f32>::assemble(&sph, &neighbors)?.apply(&single, &mut c)?;
        free.apply(&single, &mut d)?;
        assert_eq!(c, d);
        // Weights, values, differences, products and sums, each rounded in f32; |f_q - f_p| <= 2.
        let bound = 2.0 * (rows.report().most as f64 + 4.0) * f64::from(f32::EPSILON) * rows.report().sum_abs;
        assert!(a.iter().zip(&c).all(|(a, c)| (a - f64::from(*c)).abs() <= bound));
    }
    Ok(())
}

#[test]
fn epsilon_of_a_target_off_the_particles_is_the_target_s_own() -> Failure {
    let particles = lattice(32);
    let points = [[0.31, 0.42], [0.31, 0.42]];
    let epsilons = [0.05, 0.06];
    let at = |epsilon| -> Result<Vec<f64>, Error> {
        let sph = Sph::new(derivative([0, 0]), Gaussian::<2>::new(), epsilon, particles.volumes()?)?.support(7.0)?;
        let neighbors = CellList::build_at(&points, &particles, &torus(), Cutoff(0.43))?;
        let mut out = vec![0.0; 2];
        let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
        sph.assemble(&neighbors)?.apply(&f, &mut out)?;
        Ok(out)
    };
    let each = at(Epsilon::each(epsilons.to_vec())?)?;
    assert_eq!(each[0], at(Epsilon::global(epsilons[0])?)?[0]);
    assert_eq!(each[1], at(Epsilon::global(epsilons[1])?)?[1]);
    assert_ne!(each[0], each[1]);
    Ok(())
}

#[test]
fn laplacian_is_the_sum_of_its_terms() -> Failure {
    let particles = lattice(32);
    let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
    let mut sums = vec![vec![f64::NAN; 1024]; 3];
    for (out, operator) in
        sums.iter_mut().zip([Expression::of(&Laplacian::<2>)?, derivative([2, 0]), derivative([0, 2])])
    {
        let sph = Sph::new(operator, Gaussian::<2>::new(), Epsilon::global(0.05)?, particles.volumes()?)?;
        sph.assemble(&CellList::build(&particles, &torus(), sph.cutoff())?)?.apply(&f, out)?;
    }
    // Sums of about 2500 terms with moduli of V epsilon^-4 |D^beta W|, together below 2 / epsilon^2.
    let bound = round_off(2500) * 4.0 / 0.05 / 0.05;
    assert!((0..1024).all(|p| (sums[0][p] - sums[1][p] - sums[2][p]).abs() <= bound));
    Ok(())
}

#[test]
fn settings_are_checked() -> Failure {
    let volumes = Volumes::equal(0.01)?;
    let smooth =
        || Sph::new(derivative([0, 0]), Gaussian::<2>::new(), Epsilon::global(0.1).unwrap(), &volumes).unwrap();
    assert_eq!(smooth().cutoff(), Cutoff(8.5 * 0.1));
    assert_eq!(Method::cutoff(&smooth().support(5.0)?, 3)?, Some(0.5));
    let degree = smooth().form(SphForm::Difference).unwrap_err();
    assert_eq!(*degree.kind(), ErrorKind::Operator(OperatorError::Degree { degree: 0, low: 1 }));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let setting = |error: Error| matches!(*error.kind(), ErrorKind::Operator(OperatorError::Setting { value }) if value.to_bits() == bad.to_bits());
        assert!(setting(smooth().support(bad).unwrap_err()));
        assert!(setting(smooth().moment_tolerance(bad).unwrap_err()));
    }
    let kernel = HighOrderGaussian::<2>::new(4)?;
    let rough = Sph::new(derivative([128, 128]), kernel, Epsilon::global(0.1)?, &volumes).unwrap_err();
    assert_eq!(
        *rough.kind(),
        ErrorKind::Kernel(KernelError::Regularity { kernel: "HighOrderGaussian", degree: 256, limit: 255 })
    );
    Ok(())
}

#[test]
fn overlap_limit_is_that_of_the_smoothing_kernel() -> Failure {
    let particles = lattice(40);
    let h = 1.0 / 40.0;
    let limit = 2.0_f64.sqrt() * 2.0 / 3.0;
    for (ratio, legal) in [(limit, true), (1.01 * limit, false)] {
        let sph =
            Sph::new(derivative([1, 0]), Gaussian::<2>::new(), Epsilon::global(h / ratio)?, particles.volumes()?)?;
        let targets = [[0.4, 0.6]];
        for neighbors in [
            CellList::build(&particles, &torus(), sph.cutoff())?,
            CellList::build_at(&targets, &particles, &torus(), sph.cutoff())?,
        ] {
            match sph.assemble(&neighbors) {
                Ok(_) => assert!(legal),
                Err(error) => {
                    let overlap = matches!(error.kind(), ErrorKind::Operator(OperatorError::Overlap { .. }));
                    assert!(!legal && overlap, "{error}");
                }
            }
        }
    }
    Ok(())
}

#[test]
fn differentiated_kernel_keeps_order_support_and_overlap_limit_of_its_kernel() -> Failure {
    fn keeps<W: SmoothingKernel<f64, 2> + Clone>(kernel: W) -> Failure {
        let term = Term { index: MultiIndex::new([1, 1]), factor: 2.0 };
        let differentiated = Differentiated::new(kernel.clone(), vec![term])?;
        assert_eq!(differentiated.order(), kernel.order());
        assert_eq!(differentiated.support(), kernel.support());
        assert_eq!(differentiated.overlap_limit(), kernel.overlap_limit());
        assert_eq!(differentiated.terms(), [term]);
        assert_eq!(differentiated.value(&[0.3, -0.4]), 2.0 * kernel.derivative(term.index, &[0.3, -0.4])?);
        Ok(())
    }
    keeps(Gaussian::<2>::new())?;
    keeps(HighOrderGaussian::<2>::new(4)?)
}

/// The Gaussian, with derivatives at the middle alone.
#[derive(Clone)]
struct MiddleOnly(Gaussian<2>);

impl Kernel<f64, 2> for MiddleOnly {
    fn value(&self, z: &[f64; 2]) -> f64 {
        self.0.value(z)
    }

    fn terms(&self) -> &[Term<2>] {
        Kernel::<f64, 2>::terms(&self.0)
    }

    fn order(&self) -> u32 {
        Kernel::<f64, 2>::order(&self.0)
    }

    fn support(&self) -> f64 {
        Kernel::<f64, 2>::support(&self.0)
    }

    fn overlap_limit(&self) -> f64 {
        Kernel::<f64, 2>::overlap_limit(&self.0)
    }
}

impl SmoothingKernel<f64, 2> for MiddleOnly {
    fn derivative(&self, beta: MultiIndex<2>, z: &[f64; 2]) -> Result<f64, Error> {
        if *z == [0.0; 2] {
            return self.0.derivative(beta, z);
        }
        Err(KernelError::Regularity { kernel: "MiddleOnly", degree: beta.degree(), limit: 0 }.into())
    }

    fn normalization(&self) -> f64 {
        SmoothingKernel::<f64, 2>::normalization(&self.0)
    }
}

#[test]
fn kernel_that_loses_its_derivatives_after_all_gives_no_row() -> Failure {
    let particles = lattice(12);
    let sph = Sph::new(derivative([1, 0]), MiddleOnly(Gaussian::new()), Epsilon::global(0.12)?, particles.volumes()?)?;
    let cells = CellList::build(&particles, &torus(), Cutoff(0.4))?;
    let error = sph.support(3.0)?.allow(Allowance::Everywhere).assemble(&cells).unwrap_err();
    let ErrorKind::Operator(OperatorError::Weight { weight, .. }) = *error.kind() else { panic!("{error}") };
    assert!(weight.is_nan() && error.particle().is_some());
    Ok(())
}
