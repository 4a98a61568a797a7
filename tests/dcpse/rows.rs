//! Rows of single stencils: their windows, one by one and side by side, and weights that overflow.

use crate::solvers::stencil;
use parops::{
    D2, DcPse, Draft, Epsilon, Error, ErrorKind, Expression, Fallback, Laplacian, Method, MovingMethod, MultiIndex,
    Neighbor, OperatorError, ParticleError, Qr, RowReport, Sign, Stencil, Window,
};

const EPS: f64 = f64::EPSILON;
const CUTOFF: f64 = 0.5;

/// The stencil of some separations scaled to the cutoff, all lengths in some unit; its particle is number 7, if it has
/// one.
fn row(particle: bool, sign: impl Fn(usize) -> i8, z: &[[f64; 2]], unit: f64) -> Stencil<2> {
    let mut row = Stencil::default();
    row.reset(0, particle.then_some(7), CUTOFF * unit);
    for (i, z) in z.iter().enumerate() {
        let separation = z.map(|x| x * CUTOFF / parops::CUTOFF_OVER_EPSILON * unit);
        row.push(Neighbor { q: 10 + i, separation, sign: sign(i) });
    }
    row
}

type Made = parops::Result<(Vec<[f64; 1]>, [f64; 1], RowReport)>;

fn make<M: Method<2, Out = [f64; 1]>>(method: &M, row: &Stencil<2>) -> Made {
    let mut scratch = method.scratch()?;
    let (mut w, mut diagonal) = (vec![[f64::NAN]; row.len()], [f64::NAN]);
    method.weights(row, &mut scratch, &mut w, &mut diagonal)?;
    let report = method.report(row, &scratch, &w, &diagonal)?;
    Ok((w, diagonal, report))
}

#[test]
fn means_of_order_one_are_weighted_by_the_window_around_the_middle() {
    // One condition: w_q = phi(z_q - middle) / sum phi, a mean of Shepard.
    let mut row = row(false, |_| 1, &stencil::<2>(12, 0.3, 1, 3), 1.0);
    for (middle, ratio) in [([0.0; 2], 2.2), ([0.0; 2], 3.5), ([0.11, -0.06], 2.2), ([-0.2, 0.1], 5.0)] {
        row.set_middle(middle);
        let epsilon = CUTOFF / ratio;
        for window in [Window::Exponential, Window::Wendland] {
            let phi: Vec<f64> = row
                .separations()
                .iter()
                .map(|x| {
                    let s = (x[0] - middle[0]).hypot(x[1] - middle[1]);
                    match window {
                        Window::Exponential => (-(s / epsilon).powi(2)).exp(),
                        Window::Wendland => (1.0 - s / CUTOFF).max(0.0).powi(4) * (4.0 * s / CUTOFF + 1.0),
                    }
                })
                .collect();
            let sum: f64 = phi.iter().sum();
            let mean = DcPse::<D2<0, 0>, 1>::default().epsilon(Epsilon::global(epsilon).unwrap()).window(window);
            for (w, diagonal, report) in [make(&mean, &row).unwrap(), make(&mean.solver(Qr), &row).unwrap()] {
                let near = |w: f64, phi: f64| (w - phi / sum).abs() <= 64.0 * EPS * (1.0 + phi / sum);
                assert!(
                    w.iter().zip(&phi).all(|(w, &phi)| near(w[0], phi)),
                    "{middle:?} {ratio} {window:?} {:?}",
                    report.rung
                );
                assert_eq!((diagonal, report.conditions, report.rank, report.negative_weights), ([0.0], 1, 1, 0));
                assert!((report.condition - 1.0).abs() < 8.0 * EPS, "{}", report.condition);
            }
        }
    }
}

#[test]
fn rows_made_together_have_the_bits_they_have_alone_particles_or_not() {
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    // Fours of particles, of none, and of both in any place; one that is refused, and three left over.
    let particles = 0b010_1110_0111_0001_1100_0000_1111_u32;
    let rows: Vec<Stencil<2>> = (0..27)
        .map(|i| {
            let count = if i == 9 { 12 } else { 20 + i % 5 };
            row(particles >> i & 1 == 1, |_| 1, &stencil(count, 0.3, i % 2, i as u64), 1.0)
        })
        .collect();
    let mut drafts: Vec<Draft<2, [f64; 1]>> = Vec::new();
    for row in &rows {
        let mut draft = Draft { stencil: row.clone(), ..Draft::default() };
        draft.clear();
        drafts.push(draft);
    }
    dcpse.weights_batch(&mut drafts, &mut Method::<2>::scratch(&dcpse).unwrap());
    for (i, (row, draft)) in rows.iter().zip(drafts).enumerate() {
        let together = draft.report.map(|report| (draft.weights, draft.diagonal, report));
        let alone = make(&dcpse, row);
        assert_eq!(together, alone, "{i}");
        let refused = matches!(
            alone.map_err(|error| error.kind().clone()),
            Err(ErrorKind::Operator(OperatorError::TooFew { neighbors: 12, .. }))
        );
        assert_eq!(refused, i == 9);
    }
}

fn derivative(index: [u8; 2], factor: f64, order: u32) -> DcPse<Expression<2>> {
    DcPse::at_order(Expression::new([(MultiIndex::new(index), factor)]).unwrap(), order).unwrap()
}

fn largest(w: &[[f64; 1]]) -> f64 {
    w.iter().fold(0.0, |largest, w| largest.max(w[0].abs()))
}

fn refused(made: &Made) -> Option<(usize, f64)> {
    match made.as_ref().map_err(|error| error.kind().clone()) {
        Err(ErrorKind::Operator(OperatorError::Weight { q, weight })) => Some((q, weight)),
        _ => None,
    }
}

#[test]
fn rows_in_tiny_units_are_multiples_or_name_the_first_weight_that_overflows() {
    let z = stencil::<2>(30, 0.3, 1, 5);
    for (degree, sign, images) in [(2, Sign::Plus, 0), (2, Sign::Plus, 3), (3, Sign::Plus, 0), (3, Sign::Minus, 2)] {
        for particle in [true, false] {
            let row = |unit| row(particle, |i| if images > 0 && i % images == 0 { -1 } else { 1 }, &z, unit);
            let dcpse = derivative([degree, 0], 1.0, 2).sign(sign);
            let (plain, diagonal, _) = make(&dcpse, &row(1.0)).unwrap();
            let (mut made, mut overflown) = (0, 0);
            for exponent in 1000 / i32::from(degree)..1030 / i32::from(degree) {
                let unit = 2.0_f64.powi(-exponent);
                let gain = unit.powi(-i32::from(degree));
                // epsilon^-m comes first.
                let scale = (parops::CUTOFF_OVER_EPSILON / CUTOFF / unit).powi(degree.into());
                let finite = |w: &[f64; 1]| scale.is_finite() && (w[0] * gain).is_finite();
                let found = make(&dcpse, &row(unit));
                match plain.iter().position(|w| !finite(w)) {
                    Some(i) => {
                        overflown += 1;
                        let (q, weight) = refused(&found).unwrap();
                        assert!(q == 10 + i && !weight.is_finite(), "{exponent} {q} {weight} {i}");
                    }
                    None => match &found {
                        Ok((w, d, _)) => {
                            made += 1;
                            assert!(w.iter().zip(&plain).all(|(w, plain)| w[0] == plain[0] * gain), "{exponent}");
                            assert_eq!(d[0], diagonal[0] * gain);
                        }
                        // A sum of the diagonal overflows.
                        _ => assert!(particle && refused(&found).is_some_and(|(q, _)| q == 7), "{exponent} {found:?}"),
                    },
                }
            }
            assert!(made > 2 && overflown > 2, "{degree} {made} {overflown}");
        }
    }
}

/// The unit in which second derivatives are 4^TINY times as large.
const TINY: i32 = 505;

#[test]
fn diagonals_that_overflow_are_refused_though_no_weight_does() {
    let z = stencil::<2>(24, 0.3, 0, 5);
    // Behind odd mirrors w_pq (-f_q - f_p) = -w_pq (f_q - f_p) - 2 w_pq f_p.
    let row = |unit| row(true, |_| -1, &z, unit);
    let (w, [diagonal], _) = make(&derivative([2, 0], 1.0, 2), &row(1.0)).unwrap();
    assert!(diagonal.abs() > 2.0 * largest(&w));
    let factor = 0.9 * (f64::MAX / 4.0_f64.powi(TINY)) / largest(&w);
    let made = make(&derivative([2, 0], factor, 2), &row(2.0_f64.powi(-TINY)));
    assert_eq!(refused(&made), Some((7, diagonal.signum() * f64::INFINITY)));
}

#[test]
fn refusals_that_no_lower_order_is_asked_about_stay() {
    let z = stencil::<2>(48, 0.3, 0, 5);
    let [high, low] = [4, 2].map(|order| {
        let (w, _, _) = make(&derivative([2, 0], 1.0, order), &row(true, |_| 1, &z, 1.0)).unwrap();
        largest(&w)
    });
    assert!(high > low);
    let factor = f64::MAX / 4.0_f64.powi(TINY) / (high * low).sqrt();
    let row = row(true, |_| 1, &z, 2.0_f64.powi(-TINY));
    assert!(make(&derivative([2, 0], factor, 2), &row).is_ok());
    for fallback in [Fallback::Refuse, Fallback::LowerOrder, Fallback::Empty] {
        let dcpse = derivative([2, 0], factor, 4).fallback(fallback);
        let mut draft = Draft { stencil: row.clone(), ..Draft::default() };
        draft.clear();
        let mut scratch = Method::<2>::scratch(&dcpse).unwrap();
        dcpse.weights_batch(std::slice::from_mut(&mut draft), &mut scratch);
        let before = draft.report.clone();
        let overflown = |error: &Error| matches!(error.kind(), ErrorKind::Operator(OperatorError::Weight { .. }));
        assert!(before.as_ref().is_err_and(overflown), "{before:?}");
        dcpse.stand_in(&mut draft, &mut scratch);
        assert_eq!(draft.report, before, "{fallback:?}");
    }
}

#[test]
fn one_epsilon_a_target_is_asked_for() {
    let each = |n| DcPse::<Laplacian<2>, 2>::new().epsilon(Epsilon::each(vec![0.2; n]).unwrap());
    let validated =
        |dcpse: DcPse<Laplacian<2>, 2>| Method::<2>::validate(&dcpse, 4, 9).map_err(|error| error.kind().clone());
    for found in [3, 5, 9] {
        assert_eq!(validated(each(found)), Err(ErrorKind::Particle(ParticleError::Length { found, needed: 4 })));
    }
    assert_eq!(validated(each(4)), Ok(()));
    assert_eq!(validated(DcPse::new().epsilon(Epsilon::global(0.2).unwrap())), Ok(()));
    assert_eq!(validated(DcPse::new()), Ok(()));
}

#[test]
fn orders_are_told_to_what_moves_the_particles() {
    for order in 1..=4 {
        let dcpse = DcPse::at_order(Laplacian::<2>, order).unwrap();
        assert_eq!(MovingMethod::<2>::order(&dcpse), order);
    }
}
