//! Rows with coefficients, made by hand: signs and bounds, contrasts, growing modes, means, shares of images.

use super::by_hand::{COUNT, EPSILON, Made, TARGET, gain, made, near, negative, stencil, volumes};
use parops::{
    CONTRAST_LIMIT, CellList, Contraction, DcPse, DivGrad, DivTensorGrad, Domain, Epsilon, ErrorKind, Form, Hessian,
    Laplacian, Mean, Method, Neighbor, Operator, OperatorError, Particles, Pse, Random, Result, RowReport, Stencil,
    testing::Promise,
};

#[test]
fn contracted_rows_report_their_own_signs_and_bounds() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let hessian = Pse::new(Hessian::<2>, 4, Epsilon::global(EPSILON)?, &volumes())?;
    let made = made(&Contraction::new(hessian.clone(), vec![[2.0, -0.7, 0.3]; COUNT])?, &stencil)?;
    assert_eq!(made.report.negative_weights, negative(&made, &stencil));
    assert!(near(made.report.sum_abs, gain(&made)) && near(made.report.spectral_bound, 2.0 * gain(&made)));
    let none = super::by_hand::made(&Contraction::new(hessian, vec![[0.0; 3]; COUNT])?, &stencil)?;
    assert_eq!((none.report.negative_weights, none.report.sum_abs), (0, 0.0));
    Ok(())
}

#[test]
fn contrast_is_the_largest_over_the_smallest_diffusivity_of_the_stencil_the_center_included() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let with = |d: &dyn Fn(usize) -> f64| -> Result<Made<[f64; 1]>> {
        let laplacian = Pse::new(Laplacian::<2>, 4, epsilon.clone(), &volumes)?;
        made(&DivGrad::new(laplacian, (0..COUNT).map(d).collect::<Vec<_>>())?, &stencil)
    };
    let contrast = |d: &dyn Fn(usize) -> f64| with(d).map(|made| made.report.contrast);
    assert_eq!(contrast(&|q| 1.0 + q as f64)?, COUNT as f64);
    assert_eq!(contrast(&|q| if q == TARGET { 8.0 } else { 0.5 })?, 16.0);
    assert_eq!(contrast(&|q| if q == TARGET { 0.5 } else { 8.0 })?, 16.0);
    assert_eq!(contrast(&|q| if q == 7 { 0.0 } else { 8.0 })?, f64::INFINITY);
    // Nothing differs from nothing.
    assert_eq!((contrast(&|_| 3.0)?, contrast(&|_| 0.0)?), (1.0, 1.0));
    let made = with(&|q| 1.0 + q as f64)?;
    assert!(near(made.report.sum_abs, gain(&made)) && near(made.report.spectral_bound, 2.0 * gain(&made)));
    Ok(())
}

/// A method whose diagonal is off by a part of n eps times the shares of odd images, output by output.
struct Offset<M> {
    method: M,
    part: f64,
}

impl<M: Method<2, Out = [f64; K]>, const K: usize> Method<2> for Offset<M> {
    type Out = [f64; K];
    type Scratch = M::Scratch;

    fn scratch(&self) -> Result<M::Scratch> {
        self.method.scratch()
    }

    fn weights(
        &self,
        row: &Stencil<2>,
        scratch: &mut M::Scratch,
        w: &mut [[f64; K]],
        diagonal: &mut [f64; K],
    ) -> Result<()> {
        self.method.weights(row, scratch, w, diagonal)?;
        for (k, diagonal) in diagonal.iter_mut().enumerate() {
            // An odd image turns w (f_q - f_p) into -w (f_q - f_p) - 2 w f_p.
            let odd = w.iter().zip(row.signs()).filter(|&(_, &sign)| sign < 0);
            let shares: f64 = odd.map(|(w, _)| 2.0 * w[k].abs()).sum();
            *diagonal += self.part * row.len() as f64 * f64::EPSILON * shares;
        }
        Ok(())
    }

    fn report(&self, row: &Stencil<2>, scratch: &M::Scratch, w: &[[f64; K]], diagonal: &[f64; K]) -> Result<RowReport> {
        self.method.report(row, scratch, w, diagonal)
    }
}

#[test]
fn diagonals_that_belong_to_no_pair_are_refused_beyond_the_rounding_of_their_shares() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let scalar = |part| -> Result<_> {
        let method = Pse::new(Laplacian::<2>, 2, epsilon.clone(), &volumes)?;
        made(&DivGrad::new(Offset { method, part }, vec![2.0; COUNT])?, &stencil)
    };
    let tensor = |part| -> Result<_> {
        let method = Pse::new(Hessian::<2>, 2, epsilon.clone(), &volumes)?;
        made(&DivTensorGrad::new(Offset { method, part }, &[[[2.0, 0.5], [0.5, 1.0]]; COUNT])?, &stencil)
    };
    for part in [0.0, 0.8, -0.8] {
        assert_eq!(scalar(part)?.diagonal, scalar(0.0)?.diagonal);
        assert_eq!(tensor(part)?.diagonal, tensor(0.0)?.diagonal);
    }
    for part in [1.2, -1.2, 1e3] {
        for error in [scalar(part).err(), tensor(part).err()] {
            let error = error.expect("refused");
            let ErrorKind::Operator(OperatorError::NotDifference { found, expected }) = *error.kind() else {
                panic!("{error}")
            };
            assert!(found != expected, "{found} {expected}");
        }
    }
    Ok(())
}

/// The contrast of traces t_q = 1 + q, split unequally over the diagonal.
fn trace_contrast<const D: usize, const K: usize>() -> Result<[f64; 2]>
where
    Hessian<D>: Operator<D, Out = [f64; K]>,
{
    let mut random = Random::new(9);
    let mut stencil = Stencil::default();
    stencil.reset(0, Some(0), 6.0 * EPSILON);
    for q in 1..COUNT {
        let separation = std::array::from_fn(|_| 4.0 * EPSILON * (random.uniform() - 0.4));
        stencil.push(Neighbor { q, separation, sign: 1 });
    }
    let with = |trace: &dyn Fn(usize) -> f64| -> Result<f64> {
        let tensor = |q: usize| {
            // A multiple of v v^T, whose trace is |v|^2.
            let v: [f64; D] = std::array::from_fn(|i| 1.0 + ((q + i) % 3) as f64);
            let size = trace(q) / v.iter().map(|v| v * v).sum::<f64>();
            std::array::from_fn(|i| std::array::from_fn(|j| size * v[i] * v[j]))
        };
        let tensors: Vec<[[f64; D]; D]> = (0..COUNT).map(tensor).collect();
        let pse = Pse::anisotropic(Hessian::<D>, Epsilon::global(EPSILON)?, &volumes())?;
        Ok(made(&DivTensorGrad::new(pse, &tensors)?, &stencil)?.report.contrast)
    };
    Ok([with(&|q| 1.0 + q as f64)?, with(&|_| 0.0)?])
}

#[test]
fn contrast_of_tensors_is_that_of_their_traces() -> Result<()> {
    for [found, none] in [trace_contrast::<1, 1>()?, trace_contrast::<2, 3>()?, trace_contrast::<3, 6>()?] {
        assert!(near(found, COUNT as f64) && none == 1.0, "{found} {none}");
    }
    Ok(())
}

#[test]
fn modes_grow_only_with_the_arithmetic_mean_above_the_contrast_limit_order_two_and_weights_of_one_sign() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let layers = |contrast: f64| (0..COUNT).map(|q| if q % 2 == 0 { contrast } else { 1.0 }).collect::<Vec<_>>();
    let above = CONTRAST_LIMIT * (1.0 + f64::EPSILON);
    let pse = |order| Pse::new(Laplacian::<2>, order, epsilon.clone(), &volumes);
    let scalar = |order, contrast, mean| -> Result<RowReport> {
        Ok(made(&DivGrad::new(pse(order)?, layers(contrast))?.mean(mean), &stencil)?.report)
    };
    assert!(scalar(4, above, Mean::Arithmetic)?.growing && scalar(4, 100.0, Mean::Arithmetic)?.growing);
    assert!(!scalar(4, CONTRAST_LIMIT, Mean::Arithmetic)?.growing && !scalar(4, 1.0, Mean::Arithmetic)?.growing);
    assert!(!scalar(4, 100.0, Mean::Harmonic)?.growing);
    let positive = scalar(2, 100.0, Mean::Arithmetic)?;
    assert_eq!((positive.negative_weights, positive.growing), (0, false));
    let dcpse = DivGrad::new(DcPse::<Laplacian<2>, 2>::new(), layers(100.0))?;
    let second = made(&dcpse, &stencil)?.report;
    assert!(second.order == Some(2) && second.negative_weights > 0 && !second.growing);

    let tensors = |contrast: f64, off: f64| layers(contrast).iter().map(|&d| [[d, off * d], [off * d, d]]).collect();
    let tensor = |order, contrast| -> Result<RowReport> {
        let hessian = Pse::new(Hessian::<2>, order, epsilon.clone(), &volumes)?.form(Form::Values)?;
        let tensors: Vec<[[f64; 2]; 2]> = tensors(contrast, 0.5);
        Ok(made(&DivTensorGrad::new(hessian, &tensors)?, &stencil)?.report)
    };
    assert!(tensor(4, above)?.growing && tensor(4, 100.0)?.growing);
    assert!(!tensor(4, CONTRAST_LIMIT)?.growing && !tensor(4, 1.0)?.growing);
    let positive = Pse::anisotropic(Hessian::<2>, epsilon.clone(), &volumes)?;
    let positive = made(&DivTensorGrad::new(positive, &tensors(100.0, 0.0))?, &stencil)?.report;
    assert_eq!((positive.negative_weights, positive.growing), (0, false));
    let second = DivTensorGrad::new(DcPse::<Hessian<2>, 2>::new(), &tensors(100.0, 0.5))?;
    let second = made(&second, &stencil)?.report;
    assert!(second.order == Some(2) && second.negative_weights > 0 && !second.growing);
    let fourth = DivTensorGrad::new(DcPse::<Hessian<2>, 4>::new(), &tensors(100.0, 0.5))?;
    let fourth = made(&fourth, &stencil)?.report;
    assert!(fourth.order == Some(4) && fourth.negative_weights > 0 && fourth.growing);
    Ok(())
}

#[test]
fn means_are_symmetric_to_the_bit_and_right_where_products_and_ratios_leave_the_range() {
    let mut random = Random::new(2);
    for mean in [Mean::Arithmetic, Mean::Harmonic] {
        for _ in 0..100 {
            let [a, b] = std::array::from_fn(|_| 10.0_f64.powf(600.0 * random.uniform() - 300.0));
            Promise::new("Metamorphic relations", "means of two diffusivities, either way round, bits")
                .equal(&mean.of(a, b).to_bits(), &mean.of(b, a).to_bits());
            assert_eq!(mean.of(a, a), a);
        }
        assert_eq!((mean.of(0.0, 0.0), mean.of(1e308, 1e308)), (0.0, 1e308));
    }
    // The smaller one twice, where the other is so much larger.
    for (a, b) in [(1e-200, 1e200), (1e-300, 1e300)] {
        assert_eq!((Mean::Harmonic.of(a, b), Mean::Harmonic.of(b, a)), (2.0 * a, 2.0 * a));
    }
}

#[test]
fn contracted_weights_that_overflow_are_refused_with_the_neighbor() -> Result<()> {
    // Weights of some hundreds, each of them finite.
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    let (laplacian, hessian) = (DcPse::<Laplacian<2>, 2>::new(), DcPse::<Hessian<2>, 2>::new());
    let cells = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let large = 1e307;
    let contracted = Contraction::new(laplacian, vec![[large]; 144])?.assemble(&cells).err();
    let tensors = DivTensorGrad::new(hessian, &[[[large, 0.0], [0.0, large]]; 144])?.assemble(&cells).err();
    for error in [contracted, tensors] {
        let error = error.expect("refused");
        let ErrorKind::Operator(OperatorError::Weight { q, weight }) = *error.kind() else { panic!("{error}") };
        assert!(error.particle().is_some_and(|p| p < 144) && q < 144 && !weight.is_finite(), "{error}");
    }
    Ok(())
}
