//! What reports of PSE and SPH rows say, recomputed from the stencil: overlap, moments, signs, bounds, breaches.

use super::by_hand::{COUNT, EPSILON, Made, TARGET, gain, made, near, stencil, sum_of, volume, volumes};
use parops::{
    Allowance, Breach, Epsilon, Exchange, Expression, Gaussian, Gradient, Hessian, Kernel, Laplacian, MultiIndex,
    Operator, Outputs, Pse, Result, Sign, SmoothingKernel, Sph, SphForm, Stencil, Term,
};

/// How a pair enters, and what bounds the eigenvalues.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pair {
    Difference,
    /// With a positive definite kernel of one epsilon.
    Definite,
    Sum,
    Summation,
}

/// Holds a report against the sums over V_q epsilon^-D z^alpha eta(z), one kernel an output.
fn holds<K: Kernel<f64, 2>, S: Outputs>(made: &Made<S>, stencil: &Stencil<2>, kernels: &[K], epsilon: f64, pair: Pair) {
    let report = &made.report;
    let eta = |k: &K, s: &[f64; 2]| k.value(&s.map(|x| x / epsilon));
    let scaled = |q: u32| volume(q as usize) / (epsilon * epsilon);
    let (mut defect, mut lower, mut bound) = (0.0_f64, 0.0_f64, 0.0_f64);
    for kernel in kernels {
        let moment = |[a, b]: [u8; 2]| -> f64 {
            let terms = stencil.sources().iter().zip(stencil.separations()).map(|(&q, s)| {
                let power = (s[0] / epsilon).powi(a.into()) * (s[1] / epsilon).powi(b.into());
                scaled(q) * power * eta(kernel, s)
            });
            terms.sum()
        };
        let degree = kernel.terms()[0].index.degree();
        // (-1)^|beta| beta! times the factors of beta.
        let required = |index: MultiIndex<2>| {
            let factors = kernel.terms().iter().filter(|term| term.index == index).map(|term| term.factor);
            (-1.0_f64).powi(degree as i32) * index.factorial().unwrap() as f64 * factors.sum::<f64>()
        };
        let largest = kernel.terms().iter().map(|term| required(term.index).abs()).fold(0.0, f64::max);
        let unit = if largest > 0.0 { largest } else { 1.0 };
        if degree > 0 {
            for term in kernel.terms() {
                let [a, b] = term.index.exponents();
                defect = defect.max((moment([a, b]) - required(term.index)).abs() / unit);
            }
        }
        for below in 1..degree as u8 {
            for a in 0..=below {
                lower = lower.max(moment([a, below - a]).abs() / unit);
            }
        }
        let own = stencil.center().map_or(0.0, |p| scaled(p as u32) * kernel.value(&[0.0; 2]));
        let sum = |map: fn(f64) -> f64| -> f64 {
            stencil.sources().iter().zip(stencil.separations()).map(|(&q, s)| scaled(q) * map(eta(kernel, s))).sum()
        };
        defect = defect.max(match pair {
            Pair::Difference | Pair::Definite => 0.0,
            Pair::Sum => moment([0, 0]).abs(),
            Pair::Summation => (moment([0, 0]) + own - f64::from(degree == 0)).abs(),
        });
        let total = match pair {
            Pair::Difference | Pair::Sum => 2.0 * sum(f64::abs),
            Pair::Definite => sum(|eta| eta) + own,
            Pair::Summation => sum(f64::abs) + own.abs(),
        };
        bound = bound.max(total / epsilon.powi(degree as i32));
    }
    let volume = match stencil.center() {
        Some(p) => volume(p),
        None => stencil.sources().iter().map(|&q| volume(q as usize)).sum::<f64>() / stencil.len() as f64,
    };
    let negative = kernels.iter().map(|k| stencil.separations().iter().filter(|s| eta(k, s) < 0.0).count()).sum();
    assert!(near(report.h_over_epsilon, volume.sqrt() / epsilon), "{}", report.h_over_epsilon);
    assert!(near(report.moment_defect, defect), "{} {defect}", report.moment_defect);
    assert!(near(report.lower_moment, lower), "{} {lower}", report.lower_moment);
    assert!(near(report.spectral_bound, bound), "{pair:?} {} {bound}", report.spectral_bound);
    assert!(near(report.sum_abs, gain(made)));
    assert_eq!((report.negative_weights, report.order), (negative, None));
}

fn exchange<Op: Operator<2>>(operator: &Op, order: u32) -> Vec<Exchange<2>> {
    let mut terms = vec![Vec::new(); Op::Out::K];
    operator.terms(&mut |output, index, factor| terms[output].push(Term { index, factor }));
    terms.iter().map(|terms| Exchange::new(terms, order).unwrap()).collect()
}

#[test]
fn pse_rows_report_overlap_moments_signs_and_bounds_of_their_kernels() -> Result<()> {
    let (stencil, volumes) = (stencil(Some(TARGET)), volumes());
    let global = Epsilon::global(EPSILON)?;
    let each = Epsilon::each((0..COUNT).map(|p| 0.2 + 0.1 * p as f64 / TARGET as f64).collect())?;
    for operator in [
        Expression::of(&Laplacian::<2>)?,
        sum_of(&[([2, 0], -1.0), ([0, 2], 5.0)]),
        sum_of(&[([1, 1], 0.25)]),
        sum_of(&[([2, 1], 2.0), ([0, 3], 0.5)]),
        sum_of(&[([2, 0], 0.0)]),
    ] {
        for order in [2, 4] {
            let kernels = exchange(&operator, order);
            let pse = Pse::new(operator.clone(), order, global.clone(), &volumes)?;
            let pse = if operator.degree() == 3 { pse.sign(Sign::Minus)? } else { pse };
            let pair = if operator == Expression::of(&Laplacian::<2>)? { Pair::Definite } else { Pair::Difference };
            holds(&made(&pse, &stencil)?, &stencil, &kernels, EPSILON, pair);
            // Cut off, or with an epsilon per particle, no kernel is positive definite any longer.
            let cut = made(&pse.clone().support(5.9)?, &stencil)?;
            holds(&cut, &stencil, &kernels, EPSILON, Pair::Difference);
            let pse = Pse::new(operator.clone(), order, each.clone(), &volumes)?;
            let pse = if operator.degree() == 3 { pse.sign(Sign::Minus)? } else { pse };
            holds(&made(&pse, &stencil)?, &stencil, &kernels, EPSILON, Pair::Difference);
        }
    }
    let hessian = Pse::new(Hessian::<2>, 4, global.clone(), &volumes)?;
    holds(&made(&hessian, &stencil)?, &stencil, &exchange(&Hessian::<2>, 4), EPSILON, Pair::Difference);
    let gradient = Pse::new(Gradient::<2>, 2, global, &volumes)?;
    let kernels = exchange(&Gradient::<2>, 2);
    holds(&made(&gradient, &stencil)?, &stencil, &kernels, EPSILON, Pair::Sum);
    holds(&made(&gradient.sign(Sign::Minus)?, &stencil)?, &stencil, &kernels, EPSILON, Pair::Difference);
    Ok(())
}

/// A derivative of the Gaussian, as a kernel.
struct Derivative([Term<2>; 1]);

impl Kernel<f64, 2> for Derivative {
    fn value(&self, z: &[f64; 2]) -> f64 {
        self.0[0].factor * Gaussian::<2>::new().derivative(self.0[0].index, z).unwrap()
    }

    fn terms(&self) -> &[Term<2>] {
        &self.0
    }

    fn order(&self) -> u32 {
        2
    }

    fn support(&self) -> f64 {
        8.5
    }

    fn overlap_limit(&self) -> f64 {
        1.0
    }
}

#[test]
fn sph_rows_report_overlap_moments_signs_and_bounds_at_particles_and_points() -> Result<()> {
    let (volumes, epsilon) = (volumes(), Epsilon::global(EPSILON)?);
    let [at_particle, at_point] = [stencil(Some(TARGET)), stencil(None)];
    for index in [[0, 0], [1, 0], [1, 1], [0, 2]] {
        let kernel = [Derivative([Term { index: MultiIndex::new(index), factor: -3.0 }])];
        let sph = Sph::new(sum_of(&[(index, -3.0)]), Gaussian::<2>::new(), epsilon.clone(), &volumes)?;
        holds(&made(&sph, &at_particle)?, &at_particle, &kernel, EPSILON, Pair::Summation);
        holds(&made(&sph, &at_point)?, &at_point, &kernel, EPSILON, Pair::Summation);
        if index != [0, 0] {
            let difference = sph.form(SphForm::Difference)?;
            holds(&made(&difference, &at_particle)?, &at_particle, &kernel, EPSILON, Pair::Difference);
        }
    }
    Ok(())
}

#[test]
fn operators_of_zero_factors_have_no_defect_and_no_weights() -> Result<()> {
    let zero = Pse::new(0.0 * Laplacian::<2>, 2, Epsilon::global(EPSILON)?, &volumes())?;
    let Made { weights, report, .. } = made(&zero, &stencil(Some(TARGET)))?;
    assert!(weights.iter().all(|w| w[0] == 0.0));
    assert_eq!((report.moment_defect, report.lower_moment, report.breach), (0.0, 0.0, None));
    assert_eq!((report.negative_weights, report.sum_abs, report.spectral_bound), (0, 0.0, 0.0));
    Ok(())
}

#[test]
fn breaches_name_overlap_before_moments_with_their_numbers_and_are_allowed_where_covered() -> Result<()> {
    let stencil = stencil(Some(TARGET));
    let pse = |epsilon| Pse::new(Laplacian::<2>, 2, Epsilon::global(epsilon)?, &volumes());
    let report = |pse: &Pse<Exchange<2>>| made(pse, &stencil).map(|made| made.report);
    let poor = report(&pse(EPSILON)?)?;
    let defect = poor.moment_defect;
    assert!(defect > 0.05 && poor.h_over_epsilon < 0.5);
    assert_eq!((poor.breach, poor.allowed), (Some(Breach::Moment { defect, limit: 0.05 }), false));
    assert!(near(poor.severity(), defect / 0.05));
    assert!(report(&pse(EPSILON)?.allow(Allowance::at([TARGET])))?.allowed);
    assert!(!report(&pse(EPSILON)?.allow(Allowance::at([TARGET + 1])))?.allowed);
    // The limit itself is legal, and where nothing is broken nothing needs leave.
    let fair = report(&pse(EPSILON)?.moment_tolerance(defect)?.allow(Allowance::Everywhere))?;
    assert_eq!((fair.breach, fair.allowed, fair.severity()), (None, false, 0.0));
    // h/epsilon is 2/3 at most, a spacing computed from a volume may exceed it by a rounding.
    let narrow = |part: f64| report(&pse(volume(TARGET).sqrt() * 1.5 / part)?.moment_tolerance(1e3)?);
    assert_eq!(narrow(1.0 + 4.0 * f64::EPSILON)?.breach, None);
    let thin = narrow(1.0 + 1e-9)?;
    let h_over_epsilon = thin.h_over_epsilon;
    assert_eq!(thin.breach, Some(Breach::Overlap { h_over_epsilon, limit: 2.0 / 3.0 }));
    assert!(near(thin.severity(), 1.0 + 1e-9) && thin.severity() > 1.0);
    let both = report(&pse(0.5 * volume(TARGET).sqrt())?)?;
    assert!(matches!(both.breach, Some(Breach::Overlap { h_over_epsilon, .. }) if near(h_over_epsilon, 2.0)));
    assert!(near(both.severity(), 3.0) && both.moment_defect > 0.05);
    assert_eq!(Breach::Moment { defect: f64::NAN, limit: 0.05 }.severity(), f64::INFINITY);
    Ok(())
}
