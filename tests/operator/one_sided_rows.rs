//! One-sided rows made by hand: their reports, the centers across, units, refusals.

use super::by_hand::{COUNT, EPSILON, Made, TARGET, gain, made, near, negative, stencil, sum_of, volume, volumes};
use parops::{
    Allowance, Breach, D2, Epsilon, ErrorKind, Expression, KernelError, Method, MultiIndex, Neighbor, OneSided,
    OperatorError, Outputs, ParticleError, Result, Side, Stencil, Upwind, UpwindGradient, Volumes,
};

/// |sum_q w_pq (x_q - x_p)| across the axis, images without their sign.
fn across<S: Outputs>(made: &Made<S>, output: usize, stencil: &Stencil<2>, axis: usize) -> f64 {
    let pairs = made.weights.iter().zip(stencil.signs()).zip(stencil.separations());
    pairs.map(|((w, &sign), s)| w.as_slice()[output] * f64::from(sign) * s[1 - axis]).sum::<f64>().abs()
}

#[test]
fn one_sided_rows_report_overlap_signs_and_the_moment_across() -> Result<()> {
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let within = stencil(Some(TARGET));
    // Beside a wall along the axis 0 no center across balances the side.
    let mut wall = Stencil::default();
    wall.reset(TARGET, Some(TARGET), 6.0 * EPSILON);
    within.iter().for_each(|n| wall.push(Neighbor { separation: [n.separation[0], n.separation[1].abs()], ..n }));
    let side = |axis, side| {
        let term = std::array::from_fn(|i| u8::from(i == axis));
        OneSided::new(sum_of(&[(term, 1.0)]), side, 1, epsilon.clone(), &volumes)
    };
    let upwind = |v: [f64; 2]| Upwind::new(vec![v; COUNT], epsilon.clone(), &volumes);
    for (stencil, balanced) in [(&within, true), (&wall, false)] {
        let left = made(&side(0, Side::Left)?, stencil)?;
        let sides = stencil.separations().iter().filter(|s| s[0] > 0.0).count();
        let defect = across(&left, 0, stencil, 0);
        assert_eq!(left.report.negative_weights, sides);
        assert!(near(left.report.moment_defect, defect) && (defect < 0.05) == balanced, "{defect}");
        let right = made(&side(0, Side::Right)?, stencil)?;
        assert_eq!(right.report.negative_weights, 0);
        // Every axis counts, whatever the speed along it.
        for v in [[1e-3, 0.0], [-2.0, 0.0], [7.0, 3.0], [-1.0, 5.0]] {
            let made = made(&upwind(v)?, stencil)?;
            let of = |x: f64| if x > 0.0 { &left } else { &right }.report.moment_defect;
            let up = if v[1] > 0.0 {
                super::by_hand::made(&side(1, Side::Left)?, stencil)?.report.moment_defect
            } else {
                0.0
            };
            assert!(near(made.report.moment_defect, of(v[0]).max(up)));
            assert_eq!(made.report.negative_weights, negative(&made, stencil));
            assert_eq!(made.report.breach.is_some(), made.report.moment_defect > 0.05);
        }
    }
    let closure = made(&OneSided::new(D2::<1, 0>::default(), Side::Left, 2, epsilon.clone(), &volumes)?, &within)?;
    assert_eq!(closure.report.negative_weights, negative(&closure, &within));
    assert_eq!((closure.report.conditions, closure.report.rank, closure.report.order), (5, 5, Some(2)));
    assert!(closure.report.residual < 1e-9 && closure.report.condition >= 1.0 && closure.report.rung.is_some());
    let mut plain = Stencil::default();
    plain.reset(TARGET, Some(TARGET), 6.0 * EPSILON);
    within.iter().for_each(|n| plain.push(Neighbor { sign: 1, ..n }));
    let any = made(&UpwindGradient::new(epsilon.clone(), &volumes), &plain)?;
    assert_eq!(any.report.negative_weights, negative(&any, &plain));
    let allowed = made(&upwind([1.0, 0.0])?.allow(Allowance::Everywhere), &wall)?.report;
    let defect = allowed.moment_defect;
    assert_eq!((allowed.breach, allowed.allowed), (Some(Breach::Moment { defect, limit: 0.05 }), true));
    let fine = made(&upwind([1.0, 0.0])?.moment_tolerance(defect)?.allow(Allowance::Everywhere), &wall)?.report;
    assert_eq!((fine.breach, fine.allowed), (None, false));
    for report in [closure.report, any.report, allowed] {
        assert!(near(report.h_over_epsilon, volume(TARGET).sqrt() / EPSILON));
    }
    for (report, gain) in [(any.report, gain(&any)), (closure.report, gain(&closure))] {
        assert!(near(report.sum_abs, gain) && near(report.spectral_bound, 2.0 * gain));
    }
    Ok(())
}

#[test]
fn one_sided_centers_are_found_up_to_three_epsilon_across_and_not_beyond() -> Result<()> {
    // Two sources on the left, s across and -s: the moments v exp(-|z|^2) s exp(2 c s) are equal in modulus where
    // exp(4 c s) is the ratio of the volumes.
    let defect = |s: f64, c: f64| -> Result<f64> {
        let volumes = Volumes::each(vec![0.01, 0.01, 0.01 * (4.0 * c * s).exp()])?;
        let mut stencil = Stencil::default();
        stencil.reset(0, Some(0), 6.0);
        stencil.push(Neighbor { q: 1, separation: [0.7, s], sign: 1 });
        stencil.push(Neighbor { q: 2, separation: [0.7, -s], sign: 1 });
        let left = OneSided::new(D2::<1, 0>::default(), Side::Left, 1, Epsilon::global(1.0)?, &volumes)?;
        Ok(made(&left, &stencil)?.report.moment_defect)
    };
    for s in [0.2, 0.5, 2.0, 3.0] {
        for c in [0.1, 0.3, 1.0, 1.25, 2.0, 2.74, 2.9] {
            for c in [c, -c] {
                // The sums are balanced to 8 eps of their terms.
                assert!(defect(s, c)? < 1e-12, "{s} {c}: {:e}", defect(s, c)?);
            }
        }
        // Without a center the heavier source counts as its volume does.
        for c in [3.1, 4.0, 10.0] {
            let left = s / 0.7 * (2.0 * c * s).tanh();
            assert!(near(defect(s, c)?, left) && near(defect(s, -c)?, left), "{s} {c}");
        }
    }
    Ok(())
}

#[test]
fn one_sided_weights_do_not_depend_on_the_unit_of_the_volumes() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let weights = |unit: f64| -> Result<_> {
        let volumes = Volumes::each((0..COUNT).map(|q| unit * volume(q)).collect())?;
        let left = OneSided::new(D2::<1, 0>::default(), Side::Left, 1, Epsilon::global(EPSILON)?, &volumes)?;
        Ok(made(&left, &stencil)?.weights)
    };
    for power in [-60, 60] {
        assert_eq!(weights(2.0_f64.powi(power))?, weights(1.0)?);
    }
    Ok(())
}

#[test]
fn one_sided_methods_refuse_epsilons_and_volumes_of_another_number_of_particles() -> Result<()> {
    fn refused<M: Method<2>>(made: impl Fn(Epsilon, &Volumes) -> Result<M>) -> Result<()> {
        let epsilon = |len| Epsilon::each(vec![EPSILON; len]);
        let volumes = |len| Volumes::each(vec![0.01; len]);
        let length = |found, needed| Err(ParticleError::Length { found, needed }.into());
        assert_eq!(made(epsilon(4)?, &volumes(5)?)?.validate(4, 5), Ok(()));
        assert_eq!(made(epsilon(3)?, &volumes(5)?)?.validate(4, 5), length(3, 4));
        assert_eq!(made(epsilon(4)?, &volumes(6)?)?.validate(4, 5), length(6, 5));
        assert_eq!(made(Epsilon::global(EPSILON)?, &Volumes::equal(0.01)?)?.validate(4, 5), Ok(()));
        Ok(())
    }
    refused(|epsilon, volumes| OneSided::new(D2::<1, 0>::default(), Side::Left, 1, epsilon, volumes))?;
    refused(|epsilon, volumes| Upwind::new(vec![[1.0; 2]; 4], epsilon, volumes))?;
    refused(|epsilon, volumes| Ok(UpwindGradient::new(epsilon, volumes)))
}

#[test]
fn one_sided_refusals_count_axes_orders_and_epsilons() -> Result<()> {
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let plane = [[2, 0, 0], [0, 2, 0]].map(|index| (MultiIndex::new(index), 1.0));
    let error = OneSided::new(Expression::new(plane)?, Side::Left, 1, epsilon.clone(), &volumes).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Kernel(KernelError::NotAlongAxis { degree: 2, axes: 2 }));
    let slope = |order| OneSided::new(D2::<1, 0>::default(), Side::Left, order, epsilon.clone(), &volumes);
    let limit = KernelError::OneSided { degree: 1, order: 8, limit: 8 };
    assert!(slope(7).is_ok() && *slope(8).unwrap_err().kind() == ErrorKind::Kernel(limit));
    // A line askew does not tell the derivatives along it apart; the support is 4 epsilon.
    let mut line = Stencil::default();
    line.reset(0, Some(0), 4.0 * EPSILON);
    (1..COUNT).for_each(|q| line.push(Neighbor { q, separation: [0.03 * q as f64; 2], sign: 1 }));
    let error = made(&slope(2)?, &line).err().expect("refused");
    let ErrorKind::Operator(OperatorError::Uncertified { neighbors, conditions, rank, ratio, .. }) = *error.kind()
    else {
        panic!("{error}")
    };
    assert_eq!((neighbors, conditions, rank), (COUNT - 1, 5, 2));
    assert!(near(ratio, 4.0), "{ratio}");
    // So far away that the window vanishes at all of them nothing is left to solve with.
    let mut far = Stencil::default();
    far.reset(0, Some(0), 60.0 * EPSILON);
    (1..COUNT).for_each(|q| far.push(Neighbor { q, separation: [(40.0 + 0.3 * q as f64) * EPSILON, 0.1], sign: 1 }));
    let error = made(&slope(2)?, &far).err().expect("refused");
    let ErrorKind::Operator(OperatorError::Uncertified { rank, condition, residual, .. }) = *error.kind() else {
        panic!("{error}")
    };
    assert_eq!((rank, condition, residual), (0, f64::INFINITY, 1.0));
    let error = made(&slope(2)?, &stencil(None)).err().expect("refused");
    assert_eq!(*error.kind(), ErrorKind::Operator(OperatorError::NoCenter { neighbors: COUNT - 1 }));
    // As many neighbors on the side as conditions are enough.
    let side = |count: usize| -> Result<_> {
        let mut few = Stencil::default();
        few.reset(0, Some(0), 4.0 * EPSILON);
        for (q, along, across) in [(1, 0.2, 0.3), (2, 0.4, -0.1), (3, 0.3, -0.3), (4, 0.1, 0.1), (5, 0.5, 0.2)] {
            let sign = if q <= count { 1.0 } else { -1.0 };
            few.push(Neighbor { q, separation: [sign * along, across], sign: 1 });
        }
        Ok(made(&slope(2)?, &few)?.report)
    };
    let report = side(5)?;
    assert!(report.rank == 5 && report.residual < 1e-9);
    let few = OperatorError::TooFew { neighbors: 4, conditions: 5, needed: 5 };
    assert_eq!(side(4), Err(few.into()));
    Ok(())
}
