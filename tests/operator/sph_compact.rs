//! SPH with kernels of compact support: orders on lattices, plateaus on jittered sets, and pairing.

use std::f64::consts::{PI, TAU};

use parops::{
    Allowance, Apply, CellList, CubicSpline, D2, D3, Domain, Epsilon, Error, ErrorKind, Expression, KernelError,
    MultiIndex, OperatorError, Particles, QuinticSpline, Random, Rows, SmoothingKernel, Spacing, Sph, SphForm,
    WendlandC2, WendlandC4, WendlandC6, testing::Promise,
};

type Failure = Result<(), Error>;

/// Calls a generic test with the name, the kernel and its highest degree, for all five.
macro_rules! for_all {
    ($test:ident, $d:literal) => {
        $test("CubicSpline", CubicSpline::<$d>::new(), CubicSpline::<$d>::DERIVATIVE_LIMIT)?;
        $test("QuinticSpline", QuinticSpline::<$d>::new(), QuinticSpline::<$d>::DERIVATIVE_LIMIT)?;
        $test("WendlandC2", WendlandC2::<$d>::new(), WendlandC2::<$d>::DERIVATIVE_LIMIT)?;
        $test("WendlandC4", WendlandC4::<$d>::new(), WendlandC4::<$d>::DERIVATIVE_LIMIT)?;
        $test("WendlandC6", WendlandC6::<$d>::new(), WendlandC6::<$d>::DERIVATIVE_LIMIT)?;
    };
}

fn torus<const D: usize>() -> Domain<D> {
    Domain::periodic([0.0; D], [1.0; D]).expect("box")
}

/// sin(2 pi x) cos(2 pi y) and its derivatives.
fn wave(x: &[f64; 2], beta: [u8; 2]) -> f64 {
    let turn = |n: u8| f64::from(n) * 0.5 * PI;
    let factor = TAU.powi(i32::from(beta[0] + beta[1]));
    factor * (TAU * x[0] + turn(beta[0])).sin() * (TAU * x[1] + turn(beta[1])).cos()
}

fn expression<const D: usize>(beta: [u8; D]) -> Expression<D> {
    Expression::new([(MultiIndex::new(beta), 1.0)]).expect("one term")
}

/// Root mean square error of D^beta of the wave over (2 pi)^|beta|, for `overlap` = epsilon/h.
fn error<W: SmoothingKernel<f64, 2> + Clone>(
    kernel: &W,
    particles: &Particles<2>,
    beta: [u8; 2],
    overlap: f64,
    form: SphForm,
) -> Result<f64, Error> {
    let h = 1.0 / (particles.len() as f64).sqrt();
    let sph = Sph::new(expression(beta), kernel.clone(), Spacing(h).epsilon(overlap)?, particles.volumes()?)?
        .form(form)?
        .allow(Allowance::Everywhere);
    let rows = sph.assemble(&CellList::build(particles, &torus(), sph.cutoff())?)?;
    let f: Vec<f64> = particles.points().iter().map(|x| wave(x, [0, 0])).collect();
    let mut out = vec![f64::NAN; f.len()];
    rows.apply(&f, &mut out)?;
    let sum: f64 = particles.points().iter().zip(out).map(|(x, out)| (out - wave(x, beta)).powi(2)).sum();
    Ok((sum / f.len() as f64).sqrt() / TAU.powi(i32::from(beta[0] + beta[1])))
}

fn lattice(n: usize) -> Particles<2> {
    Particles::lattice([0.0; 2], [1.0; 2], [n; 2]).expect("lattice")
}

fn jittered(n: usize, seed: u64) -> Particles<2> {
    Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, seed).expect("jittered")
}

#[test]
fn value_and_gradient_converge_with_order_two_on_lattices_of_fixed_overlap() -> Failure {
    fn second_order<W: SmoothingKernel<f64, 2> + Clone>(name: &str, kernel: W, _: u32) -> Failure {
        for (beta, form) in [([0, 0], SphForm::Summation), ([1, 0], SphForm::Summation), ([0, 1], SphForm::Difference)]
        {
            let [coarse, fine] = [32, 64].map(|n| error(&kernel, &lattice(n), beta, 4.0, form));
            let order = (coarse? / fine?).log2();
            // (k epsilon)^2 M_4/M_2 is below 0.3 for the coarse one: 0.1 of the order.
            let promise = Promise::new("Orders", format!("{name} on lattices of fixed overlap, value and gradient"));
            promise.within(1.8, 2.2, order);
        }
        Ok(())
    }
    for_all!(second_order, 2);
    Ok(())
}

#[test]
fn laplacian_on_lattices_stalls_at_the_quadrature_error_which_falls_with_the_overlap() -> Failure {
    fn stalls<W: SmoothingKernel<f64, 2> + Clone>(name: &str, kernel: W, _: u32) -> Failure {
        // What is left on fine lattices is the defect of the second moment, the same at every h.
        let at = |overlap, n| error(&kernel, &lattice(n), [2, 0], overlap, SphForm::Difference);
        let (coarse, fine) = (at(6.0, 40)?, at(6.0, 80)?);
        assert!(fine < 0.35 * coarse, "{name}: order two with many neighbors, {coarse} {fine}");
        let (coarse, fine) = (at(1.5, 48)?, at(1.5, 96)?);
        assert!(fine > 0.3 * coarse, "{name}: {coarse} {fine}");
        Ok(())
    }
    for_all!(stalls, 2);
    Ok(())
}

#[test]
fn gradient_on_jittered_sets_of_fixed_overlap_has_a_plateau_or_diverges() -> Failure {
    fn plateau<W: SmoothingKernel<f64, 2> + Clone>(name: &str, kernel: W, _: u32) -> Failure {
        let ratio = |form| -> Result<(f64, f64), Error> {
            let [coarse, fine] = [32, 96].map(|n| error(&kernel, &jittered(n, 7), [1, 0], 1.5, form));
            let (coarse, fine) = (coarse?, fine?);
            Ok(((coarse / fine).ln() / 3.0_f64.ln(), fine))
        };
        // f_q - f_p leaves the defect of the first moment, of size one; the sum leaves M_0 f/epsilon.
        let (difference, defect) = ratio(SphForm::Difference)?;
        assert!(defect > 0.01, "{name}: {defect}");
        let order = |text| Promise::new("Orders", text).case(name);
        order("compact SPH gradient on jittered sets, differences").within(-0.35, 0.35, difference);
        let (summation, _) = ratio(SphForm::Summation)?;
        order("compact SPH gradient on jittered sets, sums").within(-1.35, -0.65, summation);
        Ok(())
    }
    for_all!(plateau, 2);
    Ok(())
}

#[test]
fn gradient_on_jittered_sets_converges_where_the_overlap_grows() -> Failure {
    fn converges<W: SmoothingKernel<f64, 2> + Clone>(name: &str, kernel: W, _: u32) -> Failure {
        // epsilon ~ h^(1/2): the defect of the first moment falls like (h/epsilon)^2 or so, mollification like h.
        let at = |n: usize, overlap| error(&kernel, &jittered(n, 5), [1, 0], overlap, SphForm::Difference);
        let order = (at(20, 2.0)? / at(80, 4.0)?).ln() / 4.0_f64.ln();
        let promise = Promise::new("Orders", "compact SPH gradient on jittered sets, growing overlap");
        promise.case(name).within(0.5, 1.7, order);
        Ok(())
    }
    for_all!(converges, 2);
    Ok(())
}

#[test]
fn difference_form_is_exactly_zero_for_constants_in_both_precisions() -> Failure {
    fn zero<W: SmoothingKernel<f64, 3> + Clone>(name: &str, kernel: W, limit: u32) -> Failure {
        let particles = Particles::jittered([0.0; 3], [1.0; 3], [8; 3], 0.25, 2)?;
        for beta in [[1, 0, 0], [0, 1, 1], [0, 0, limit as u8]] {
            let sph = Sph::new(expression(beta), kernel.clone(), Epsilon::global(0.15)?, particles.volumes()?)?
                .form(SphForm::Difference)?
                .allow(Allowance::Everywhere);
            let neighbors = CellList::build(&particles, &torus(), sph.cutoff())?;
            let mut out = vec![f64::NAN; 512];
            sph.assemble(&neighbors)?.apply(&vec![3.7; 512], &mut out)?;
            assert!(out.iter().all(|&x| x == 0.0), "{name} {beta:?}");
            let single = Rows::<_, f32>::assemble(&sph, &neighbors)?;
            let mut out = vec![f32::NAN; 512];
            single.apply(&vec![3.7_f32; 512], &mut out)?;
            assert!(out.iter().all(|&x| x == 0.0), "{name} {beta:?}");
        }
        Ok(())
    }
    for_all!(zero, 3);
    Ok(())
}

#[test]
fn single_precision_rows_follow_double_ones_on_a_line() -> Failure {
    fn follow<W: SmoothingKernel<f64, 1> + Clone>(name: &str, kernel: W, limit: u32) -> Failure {
        let particles = Particles::jittered([0.0], [1.0], [60], 0.2, 4)?;
        let f: Vec<f64> = particles.points().iter().map(|x| (TAU * x[0]).sin()).collect();
        let lifted: Vec<f32> = f.iter().map(|&f| f as f32).collect();
        for degree in 0..=limit as u8 {
            let sph = Sph::new(expression([degree]), kernel.clone(), Epsilon::global(0.06)?, particles.volumes()?)?
                .allow(Allowance::Everywhere);
            let neighbors = CellList::build(&particles, &torus(), sph.cutoff())?;
            let rows = sph.assemble(&neighbors)?;
            let (mut double, mut single) = (vec![f64::NAN; 60], vec![f32::NAN; 60]);
            rows.apply(&f, &mut double)?;
            Rows::<_, f32>::assemble(&sph, &neighbors)?.apply(&lifted, &mut single)?;
            // Weights, values, differences, products and sums, each rounded; |f_q - f_p| <= 2.
            let bound = 2.0 * (rows.report().most as f64 + 4.0) * f64::from(f32::EPSILON) * rows.report().sum_abs;
            for (double, single) in double.iter().zip(&single) {
                assert!((double - f64::from(*single)).abs() <= bound, "{name} {degree}: {double} {single}");
            }
        }
        Ok(())
    }
    for_all!(follow, 1);
    Ok(())
}

#[test]
fn operators_beyond_the_regularity_are_refused_when_they_are_made() -> Failure {
    let particles = lattice(8);
    let (epsilon, volumes) = (Epsilon::global(0.3)?, particles.volumes()?);
    let error = Sph::new(D2::<2, 1>::default(), CubicSpline::<2>::new(), epsilon.clone(), volumes).unwrap_err();
    let expected = KernelError::Regularity { kernel: "CubicSpline", degree: 3, limit: 2 };
    assert_eq!(*error.kind(), ErrorKind::Kernel(expected));
    assert!(Sph::new(D2::<2, 1>::default(), QuinticSpline::<2>::new(), epsilon.clone(), volumes).is_ok());
    let error = Sph::new(D3::<3, 2, 2>::default(), WendlandC6::<3>::new(), epsilon, volumes).unwrap_err();
    let expected = KernelError::Regularity { kernel: "WendlandC6", degree: 7, limit: 6 };
    assert_eq!(*error.kind(), ErrorKind::Kernel(expected));
    Ok(())
}

#[test]
fn rows_know_the_overlap_limit_of_the_kernel() -> Failure {
    let particles = lattice(40);
    let refused = |overlap: f64| -> Result<bool, Error> {
        let sph = Sph::new(
            expression([0, 0]),
            WendlandC2::<2>::new(),
            Spacing(1.0 / 40.0).epsilon(overlap)?,
            particles.volumes()?,
        )?;
        match sph.assemble(&CellList::build(&particles, &torus(), sph.cutoff())?) {
            Ok(_) => Ok(false),
            Err(error) => {
                let OperatorError::Overlap { limit, .. } = (match error.kind() {
                    ErrorKind::Operator(kind) => *kind,
                    _ => panic!("{error}"),
                }) else {
                    panic!("{error}")
                };
                assert_eq!(limit, 0.76);
                Ok(true)
            }
        }
    };
    assert!(!refused(1.0 / 0.76)? && !refused(1.5)? && refused(1.0 / 0.77)?);
    Ok(())
}

/// The least distance, over h, after `steps` steps along -grad sum_q W(x_p - x_q), epsilon = `overlap` h.
fn least_gap<W: SmoothingKernel<f64, 2>>(kernel: &W, overlap: f64, steps: usize) -> f64 {
    const N: usize = 12;
    let epsilon = overlap / N as f64;
    let mut random = Random::new(11);
    let mut noise = || 0.05 * (random.uniform() - 0.5);
    let mut x: Vec<[f64; 2]> =
        (0..N * N).map(|p| [p / N, p % N].map(|i| (i as f64 + 0.5 + noise()) / N as f64)).collect();
    let separation = |a: [f64; 2], b: [f64; 2]| -> [f64; 2] {
        std::array::from_fn(|axis| {
            let d = a[axis] - b[axis];
            d - d.round()
        })
    };
    // The stiffest mode has about the curvature W''(0) of every neighbor, of which there are about 1/h^2 times Int W.
    let curvature = kernel.derivative(MultiIndex::new([2, 0]), &[0.0; 2]).expect("smooth").abs();
    let step = 0.2 * epsilon / (curvature * overlap * overlap);
    for _ in 0..steps {
        let mut force = vec![[0.0; 2]; x.len()];
        for p in 0..x.len() {
            for q in 0..p {
                let z = separation(x[p], x[q]).map(|d| d / epsilon);
                if z[0].abs() < 3.0 && z[1].abs() < 3.0 {
                    let gradient = kernel.gradient(&z).expect("smooth");
                    for axis in 0..2 {
                        force[p][axis] -= gradient[axis];
                        force[q][axis] += gradient[axis];
                    }
                }
            }
        }
        for (x, force) in x.iter_mut().zip(&force) {
            for axis in 0..2 {
                x[axis] += step * force[axis];
            }
        }
    }
    let mut least = f64::INFINITY;
    for p in 0..x.len() {
        for q in 0..p {
            let [a, b] = separation(x[p], x[q]);
            least = least.min(a.hypot(b));
        }
    }
    least * N as f64
}

#[test]
fn splines_pair_at_large_overlap_and_wendland_functions_do_not() {
    for (name, gap) in [
        ("cubic, 2 h", least_gap(&CubicSpline::<2>::new(), 2.0, 1000)),
        ("cubic, 1.5 h", least_gap(&CubicSpline::<2>::new(), 1.5, 1000)),
        ("quintic, 1.5 h", least_gap(&QuinticSpline::<2>::new(), 1.5, 3000)),
    ] {
        assert!(gap < 0.4, "{name}: {gap}");
    }
    for (name, gap) in [
        ("cubic, 1.2 h", least_gap(&CubicSpline::<2>::new(), 1.2, 1000)),
        ("quintic, 1.2 h", least_gap(&QuinticSpline::<2>::new(), 1.2, 1000)),
        ("C2, 2 h", least_gap(&WendlandC2::<2>::new(), 2.0, 1000)),
        ("C4, 2 h", least_gap(&WendlandC4::<2>::new(), 2.0, 1000)),
        ("C6, 2 h", least_gap(&WendlandC6::<2>::new(), 2.0, 1000)),
    ] {
        assert!(gap > 0.9, "{name}: {gap}");
    }
}
