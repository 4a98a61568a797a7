//! What kernels state of themselves, where no checker of kernels looks: constants, places, limits, orders on lattices.

use parops::{
    CubicSpline, Error, Exchange, Gaussian, HighOrderGaussian, Kernel, LatticeHat, MultiIndex, OneSidedGaussian,
    QuinticSpline, Random, RationalLaplacian, Scalar, Side, SmoothingKernel, Term, WendlandC2, WendlandC4, WendlandC6,
    WideGaussian, graded,
};

fn along<const D: usize>(axis: usize, degree: u8) -> Term<D> {
    Term { index: MultiIndex::new(std::array::from_fn(|i| if i == axis { degree } else { 0 })), factor: 1.0 }
}

#[test]
fn gaussian_is_its_normalization_at_the_origin() {
    fn holds<const D: usize>() {
        let kernel = Gaussian::<D>::new();
        assert_eq!(SmoothingKernel::<f64, D>::normalization(&kernel), Kernel::<f64, D>::value(&kernel, &[0.0; D]));
    }
    holds::<1>();
    holds::<3>();
}

#[test]
fn kernels_with_a_transform_that_is_nowhere_negative_say_so() {
    // A checker refutes such a claim, but cannot miss it.
    fn claim(kernel: &dyn Kernel<f64, 2>) -> bool {
        kernel.positive_definite()
    }
    assert!(claim(&Gaussian::new()) && claim(&WideGaussian::new()));
    for order in [2, 4, 6, 8] {
        let smoothing = HighOrderGaussian::new(order).expect("an order that exists");
        assert!(claim(&smoothing) && claim(smoothing.as_exchange()), "{order}");
    }
    let mixed = Exchange::new(&[Term { index: MultiIndex::new([1, 1]), factor: 1.0 }], 2).expect("a small kernel");
    assert!(!claim(&mixed) && !claim(&LatticeHat::new()));
}

#[test]
fn lattice_hat_has_the_order_of_its_first_lattice_moment_that_is_wrong() {
    fn first_wrong<const D: usize>(kernel: &dyn Kernel<f64, D>) -> u32 {
        let nodes: Vec<[f64; D]> = (0..5_usize.pow(D as u32))
            .map(|i| std::array::from_fn(|k| (i / 5_usize.pow(k as u32) % 5) as f64 - 2.0))
            .collect();
        let wrong = |alpha: &MultiIndex<D>| {
            let moment: f64 = nodes.iter().map(|z| alpha.power(z) * kernel.value(z)).sum();
            moment != if kernel.terms().iter().any(|term| term.index == *alpha) { 2.0 } else { 0.0 }
        };
        graded::<D>(1, 8).find(wrong).expect("no kernel has them all").degree()
    }
    let (line, plane) = (LatticeHat::<1>::new(), LatticeHat::<2>::new());
    assert_eq!(first_wrong(&line), 2 + Kernel::<f64, 1>::order(&line));
    assert_eq!(first_wrong(&plane), 2 + Kernel::<f64, 2>::order(&plane));
}

#[test]
fn limits_of_exchange_kernels_are_within_a_fifth_of_where_lattices_fail() {
    // What a lattice may miss of M_alpha, in units of alpha!.
    const STATED: f64 = 1e-4;
    for degree in 3..=12_u8 {
        for order in [2, 4, 6, 8] {
            let kernel = Exchange::<1>::new(&[along(0, degree)], order).expect("a small kernel");
            let defect = |h: f64| {
                let alphas = (1..u32::from(degree) + order).filter(|alpha| (alpha ^ u32::from(degree)) % 2 == 0);
                let defects = alphas.map(|alpha| {
                    let nodes = (1..=(14.0 / h) as u32).map(|j| f64::from(j) * h);
                    let sum: f64 = nodes.map(|z| 2.0 * h * z.powi(alpha as i32) * kernel.value(&[z])).sum();
                    let required =
                        if alpha == u32::from(degree) { f64::from(along::<1>(0, degree).index.sign()) } else { 0.0 };
                    (sum / (1..=alpha).map(f64::from).product::<f64>() - required).abs()
                });
                defects.fold(0.0, f64::max)
            };
            let limit = Kernel::<f64, 1>::overlap_limit(&kernel);
            let (at, beyond) = (defect(limit), defect(1.2 * limit));
            assert!(at <= STATED && beyond > STATED, "degree {degree}, order {order}: {at:e} {beyond:e}");
        }
    }
}

#[test]
fn one_sided_kernel_has_its_axis_and_its_side() -> Result<(), Error> {
    for axis in 0..3 {
        for side in [Side::Left, Side::Right] {
            let kernel = OneSidedGaussian::<3>::new(along(axis, 2), side, 1)?;
            assert_eq!((kernel.axis(), kernel.side()), (axis, side));
            let mut z = [0.25; 3];
            let left: f64 = kernel.value(&z);
            z[kernel.axis()] = -0.25;
            let right: f64 = kernel.value(&z);
            assert_eq!((left != 0.0, right != 0.0), (side == Side::Left, side == Side::Right));
        }
    }
    Ok(())
}

#[test]
fn one_sided_kernel_has_the_factor_of_its_term() -> Result<(), Error> {
    for side in [Side::Left, Side::Right] {
        let one: OneSidedGaussian<2> = OneSidedGaussian::new(along(1, 1), side, 2)?;
        let many = OneSidedGaussian::new(Term { factor: -8.0, ..along(1, 1) }, side, 2)?;
        for z in [[0.3, 0.4], [0.3, -0.4]] {
            assert_eq!(many.value(&z), -8.0 * one.value(&z));
        }
    }
    Ok(())
}

#[test]
fn lattice_at_the_limit_of_a_one_sided_kernel_misses_its_worst_moment_as_stated() -> Result<(), Error> {
    // The second term of the Euler-Maclaurin formula, where the limit is largest.
    const NEXT: f64 = 0.02;
    for degree in 1..8_u8 {
        for order in 1..=8 - u32::from(degree) {
            let kernel = OneSidedGaussian::<1>::new(along(0, degree), Side::Left, order)?;
            let h = Kernel::<f64, 1>::overlap_limit(&kernel);
            let mut factorial = 1.0;
            let mut worst = 0.0_f64;
            for n in 1..u32::from(degree) + order {
                factorial *= f64::from(n);
                let nodes = (1..=(8.0 / h) as u32).map(|j| f64::from(j) * h);
                let sum: f64 = nodes.map(|z| h * z.powi(n as i32) * kernel.value(&[z])).sum();
                let required = if n == u32::from(degree) {
                    factorial * f64::from(along::<1>(0, degree).index.sign())
                } else {
                    0.0
                };
                worst = worst.max((sum - required).abs() / factorial);
            }
            if degree == 1 && order == 1 {
                // z^2 exp(-z^2) has no kink.
                assert!(h == 2.0 / 3.0 && worst <= 1e-7, "{worst:e}");
            } else {
                assert!((worst / 5e-5 - 1.0).abs() <= NEXT, "degree {degree}, order {order}: {worst:e} at {h}");
            }
        }
    }
    Ok(())
}

#[test]
fn moments_outside_the_support_of_a_one_sided_kernel_are_as_small_as_stated() -> Result<(), Error> {
    // Simpson's rule along the radius, midpoints of the half circle.
    const RADII: u32 = 60;
    const ANGLES: u32 = 64;
    const STATED: f64 = 1e-5;
    for degree in 1..8_u8 {
        for order in 1..=8 - u32::from(degree) {
            let kernel = OneSidedGaussian::<2>::new(along(0, degree), Side::Left, order)?;
            let support = Kernel::<f64, 2>::support(&kernel);
            assert!((6.0..=7.0).contains(&support));
            let conditions: Vec<_> = graded::<2>(1, u32::from(degree) + order - 1).collect();
            let mut outside = vec![0.0; conditions.len()];
            let (dr, dt) = (2.0 / f64::from(RADII), std::f64::consts::PI / f64::from(ANGLES));
            for i in 0..=RADII {
                let weight = if i == 0 || i == RADII { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
                let r = support + f64::from(i) * dr;
                for j in 0..ANGLES {
                    let (sin, cos) = ((f64::from(j) + 0.5) * dt).sin_cos();
                    let z = [r * sin, r * cos];
                    let part = weight * dr / 3.0 * dt * r * kernel.value(&z);
                    outside.iter_mut().zip(&conditions).for_each(|(sum, alpha)| *sum += part * alpha.power(&z));
                }
            }
            for (alpha, lost) in conditions.iter().zip(outside) {
                let size = alpha.factorial()? as f64;
                assert!(lost.abs() < STATED * size, "degree {degree}, order {order}, {alpha}: {:e}", lost / size);
            }
        }
    }
    Ok(())
}

#[test]
fn gaussians_are_even_to_the_bit_wherever_they_have_not_vanished() {
    fn even<T: Scalar>(most: f64) {
        let mut random = Random::new(5);
        for _ in 0..500 {
            let z = [most, most, 0.1].map(|most| (2.0 * random.uniform() - 1.0) * most);
            let [there, turned] = [z, [-z[0], z[1], -z[2]]].map(|z| z.map(T::lift));
            let values = |z: &[T; 3]| [Kernel::value(&Gaussian::new(), z), Kernel::value(&WideGaussian::new(), z)];
            assert!(values(&there) == values(&turned), "{z:?}");
        }
    }
    even::<f64>(30.0);
    even::<f32>(12.9);
}

#[test]
fn default_kernels_are_those_of_new() {
    fn same<K: Kernel<f64, 3> + Default>(new: K) {
        let z = [0.3, -0.5, 0.7];
        let (value, default) = (new.value(&z), K::default().value(&z));
        assert!(value > 0.0 && value == default);
    }
    same(Gaussian::new());
    same(WideGaussian::new());
    same(LatticeHat::new());
    same(RationalLaplacian::new());
    same(CubicSpline::new());
    same(QuinticSpline::new());
    same(WendlandC2::new());
    same(WendlandC4::new());
    same(WendlandC6::new());
}
