//! Operators that are not consistent where they are used, and errors that are read where they are small.

use std::error::Error;
use std::f64::consts::{PI, TAU};

use parops::{
    Allowance, Apply, CellList, Cutoff, Domain, Epsilon, ErrorKind, Exchange, Laplacian, Nearest, Neighbors,
    OperatorError, Particles, Pse, SetQuality, SmoothingKernel, Spacing, Sph, Volumes, WendlandC2,
};

use super::sets::{
    cells, dcpse, derivative, laplacian, listed, nearest, order, relative_error, square, torus, values, wave,
};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// Overlap of the scenes, epsilon/h.
const OVERLAP: f64 = 1.5;

/// PSE of order 2 for the Laplacian, summed by hand: eps^-4 sum_q V (f_q - f_p) 4/pi exp(-|z|^2).
fn naive_pse(particles: &Particles<2>, f: &[f64], volume: f64, epsilon: f64) -> parops::Result<Vec<f64>> {
    let around = cells(particles, &torus()?, 5.0 * epsilon)?;
    let row = |p: usize| {
        let mut sum = 0.0;
        around.for_each(p, 5.0 * epsilon, |q| {
            let r2 = q.separation.iter().map(|s| s * s).sum::<f64>() / (epsilon * epsilon);
            sum += (f[q.q] - f[p]) * 4.0 / PI * (-r2).exp();
        });
        sum * volume / epsilon.powi(4)
    };
    Ok((0..f.len()).map(row).collect())
}

/// The SPH derivative along x in the summation form, by hand: eps^-3 sum_q V f_q dW/dz_0(z).
fn naive_sph(particles: &Particles<2>, f: &[f64], volume: f64, epsilon: f64) -> Result<Vec<f64>, Box<dyn Error>> {
    let (kernel, around) = (WendlandC2::<2>::new(), cells(particles, &torus()?, 2.0 * epsilon)?);
    let mut out = Vec::with_capacity(f.len());
    for p in 0..f.len() {
        let mut pairs = Vec::new();
        around.for_each(p, 2.0 * epsilon, |q| pairs.push((q.q, q.separation.map(|s| s / epsilon))));
        let mut sum = 0.0;
        for (q, z) in pairs {
            sum += f[q] * kernel.gradient(&z)?[0];
        }
        out.push(sum * volume / epsilon.powi(3));
    }
    Ok(out)
}

fn sides(quick: bool) -> &'static [usize] {
    if quick { &[16, 32, 48] } else { &[16, 32, 64, 128] }
}

/// 6. Fixed kernels on disordered sets.
pub fn disorder(case: &mut Case, quick: bool) -> Done {
    case.setup(format!(
        "Laplacian and gradient on jittered tori, 0.3 h, epsilon = {OVERLAP} h, m = {:?}",
        sides(quick)
    ));
    let (mut pse, mut sph, mut ours) = (Vec::new(), Vec::new(), Vec::new());
    for &m in sides(quick) {
        let (h, particles) = (1.0 / m as f64, square(m, 0.3, 4)?);
        let (u, lap) = (values(&particles, wave), values(&particles, |x| -2.0 * TAU * TAU * wave(x)));
        let dx = values(&particles, |x| TAU * (TAU * x[0]).cos() * (TAU * x[1]).cos());
        pse.push(relative_error(&naive_pse(&particles, &u, h * h, OVERLAP * h)?, &lap));
        sph.push(relative_error(&naive_sph(&particles, &u, h * h, OVERLAP * h)?, &dx));
        let method = dcpse(laplacian()?, 2)?;
        let mut out = vec![0.0; u.len()];
        method.assemble(&nearest(&particles, &torus()?, &method)?)?.apply(&u, &mut out)?;
        ours.push(relative_error(&out, &lap));
    }
    let ends = |errors: &[f64]| (errors[errors.len() - 2], errors[errors.len() - 1]);
    let ((pse_coarse, pse_fine), (sph_coarse, sph_fine)) = (ends(&pse), ends(&sph));
    case.naive(
        pse_fine > pse_coarse && sph_fine > sph_coarse,
        format!("errors grow with refinement: PSE Laplacian {}, SPH sum gradient {}", listed(pse), listed(sph)),
    );

    let m = sides(quick)[1];
    let (h, particles) = (1.0 / m as f64, square(m, 0.3, 4)?);
    let quality = SetQuality::measure(&particles, &torus()?, Cutoff(2.5 * h))?;
    let calm = SetQuality::measure(&square(m, 0.0, 4)?, &torus()?, Cutoff(2.5 * h))?;
    case.detects(
        quality.disorder > 0.02 && calm.disorder < 1e-12 && quality.most_disordered.is_some(),
        format!(
            "disorder {:.3}, at most {:.3} at particle {} (a lattice has {:.0e})",
            quality.disorder,
            quality.largest_disorder,
            quality.most_disordered.unwrap_or(0),
            calm.disorder
        ),
    );
    let operator = Pse::new(Laplacian::<2>, 2, Spacing(h).epsilon(OVERLAP)?, particles.volumes()?)?;
    let around = cells(&particles, &torus()?, operator.cutoff().0)?;
    let refusal = operator.assemble(&around).err();
    let allowed = operator.allow(Allowance::Everywhere).assemble(&around)?;
    let named = refusal.as_ref().is_some_and(|error| {
        let typed =
            matches!(error.kind(), ErrorKind::Operator(OperatorError::Moment { defect, limit }) if defect > limit);
        typed && error.particle().is_some()
    });
    case.reports(
        named && allowed.report().allowed > 0 && allowed.report().lower_moment > 0.0,
        format!(
            "{}; where it is allowed the report counts {} of {} rows and a lower moment of {:.2}",
            refusal.as_ref().map_or(String::from("accepted"), ToString::to_string),
            allowed.report().allowed,
            allowed.report().rows,
            allowed.report().lower_moment
        ),
    );
    let orders: Vec<f64> = ours
        .windows(2)
        .zip(sides(quick).windows(2))
        .map(|(e, m)| order(e[0], e[1], m[1] as f64 / m[0] as f64))
        .collect();
    let suggested = refusal.is_some_and(|error| error.to_string().contains("DC-PSE"));
    case.adapts(
        suggested && orders.last().is_some_and(|order| (1.8..2.3).contains(order)),
        format!(
            "the refusal names DC-PSE, whose errors on these sets are {} (orders {})",
            listed(ours),
            listed(orders)
        ),
    );
    Ok(())
}

/// 7. epsilon/h fixed under refinement.
pub fn fixed_overlap(case: &mut Case, quick: bool) -> Done {
    let sides: &[usize] = if quick { &[16, 32, 64, 128] } else { &[16, 32, 64, 128, 256] };
    case.setup(format!("d/dx by SPH (Wendland C2) on lattices m = {sides:?}, epsilon = {OVERLAP} h"));
    let errors = |overlap: &dyn Fn(usize) -> f64| -> Result<Vec<f64>, Box<dyn Error>> {
        let error = |&m: &usize| {
            let (h, particles) = (1.0 / m as f64, square(m, 0.0, 1)?);
            let exact = values(&particles, |x| TAU * (TAU * x[0]).cos() * (TAU * x[1]).cos());
            let found = naive_sph(&particles, &values(&particles, wave), h * h, overlap(m) * h)?;
            Ok(relative_error(&found, &exact))
        };
        sides.iter().map(error).collect()
    };
    let orders = |errors: &[f64]| errors.windows(2).map(|e| order(e[0], e[1], 2.0)).collect::<Vec<_>>();
    let fixed = errors(&|_| OVERLAP)?;
    let (first, last) = (orders(&fixed)[0], orders(&fixed)[sides.len() - 2]);
    case.naive(
        first > 1.3 && last < 1.2 && last < first - 0.5,
        format!("errors {}: the order falls from {first:.2} to {last:.2}", listed(fixed.iter().copied())),
    );

    let m = sides[sides.len() - 1];
    let (h, particles) = (1.0 / m as f64, square(m, 0.0, 1)?);
    let sph =
        Sph::new(derivative([1, 0])?, WendlandC2::<2>::new(), Spacing(h).epsilon(OVERLAP)?, particles.volumes()?)?;
    let rows = sph.assemble(&cells(&particles, &torus()?, sph.cutoff().0)?)?;
    let (defect, floor) = (rows.report().moment_defect, fixed[sides.len() - 1]);
    case.reports(
        (0.5..1.5).contains(&(defect / floor)),
        format!(
            "the report's moment defect {defect:.2e} is the quadrature error at which they stop ({floor:.2e} so far)"
        ),
    );
    let growing = errors(&|m| OVERLAP * (m as f64 / 16.0).powf(0.4))?;
    let kept = orders(&growing);
    case.adapts(
        kept.iter().all(|order| *order > 1.1) && kept[kept.len() - 1] > last,
        format!("with epsilon/h growing as m^0.4: errors {}, orders {}", listed(growing), listed(kept)),
    );
    case.documents(
        include_str!("../../../src/operator/sph.rs"),
        "on lattices of fixed overlap it converges with r until the second part shows",
    );
    Ok(())
}

/// Whether a value of A is taken where one of B is asked, as the compiler sees it.
struct Taken<A, B>(std::marker::PhantomData<(A, B)>);

trait NotTaken {
    const TAKEN: bool = false;
}

impl<A, B> NotTaken for Taken<A, B> {}

impl<A: Into<B>, B> Taken<A, B> {
    const TAKEN: bool = true;
}

/// 28. One length in the place of another.
pub fn wrong_length(case: &mut Case, _: bool) -> Done {
    const M: usize = 24;
    case.setup("the Laplacian of x^2 + y^2 on a lattice, epsilon = 2 h handed over as the spacing h");
    let (h, particles) = (1.0 / M as f64, square(M, 0.0, 1)?);
    let p = M * M / 2 + M / 2;
    let paraboloid: Vec<f64> = values(&particles, |x| {
        let [a, b] = [x[0] - particles.points()[p][0], x[1] - particles.points()[p][1]];
        (a - a.round()).powi(2) + (b - b.round()).powi(2)
    });
    // The volume from what is taken for the spacing.
    let sum = |spacing: f64| naive_pse(&particles, &paraboloid, spacing * spacing, 2.0 * h).map(|lap| lap[p]);
    let (right, wrong) = (sum(h)?, sum(2.0 * h)?);
    case.naive(
        (wrong / right - 4.0).abs() < 1e-9,
        format!("plain numbers: {wrong:.3} instead of {right:.3}, off by {:.3}", wrong / right),
    );

    let taken = [
        Taken::<Spacing, Epsilon>::TAKEN,
        Taken::<Epsilon, Spacing>::TAKEN,
        Taken::<Spacing, Cutoff>::TAKEN,
        Taken::<Cutoff, Spacing>::TAKEN,
        Taken::<Epsilon, Cutoff>::TAKEN,
        Taken::<Cutoff, Epsilon>::TAKEN,
        Taken::<f64, Spacing>::TAKEN,
        Taken::<f64, Epsilon>::TAKEN,
        Taken::<f64, Cutoff>::TAKEN,
    ];
    // That the question can be answered with yes.
    let works = Taken::<f32, f64>::TAKEN;
    let converted = taken.iter().filter(|taken| **taken).count();
    case.prevents(
        works && converted == 0,
        format!("Spacing, Epsilon and Cutoff are types of their own: of 9 confusions among them and plain numbers {converted} compile"),
    );
    let volumes = Volumes::equal(4.0 * h * h)?;
    let refusal = Pse::<Exchange<2>>::new(Laplacian::<2>, 2, Spacing(h).epsilon(2.0)?, &volumes).and_then(|pse| {
        let around = cells(&particles, &torus()?, pse.cutoff().0)?;
        pse.assemble(&around)
    });
    let refusal = refusal.err();
    case.detects(
        matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Operator(OperatorError::Overlap { h_over_epsilon, .. })) if *h_over_epsilon == 1.0),
        format!("volumes four times too large all the same, epsilon = 2 h: {}", refusal.map_or(String::from("accepted"), |error| error.to_string())),
    );
    Ok(())
}

/// 31. An error read at the particles only.
pub fn between_particles(case: &mut Case, _: bool) -> Done {
    const NARROW: f64 = 0.7;
    const FACTOR: f64 = 3.0;
    case.setup("a field made of Wendland C2 blobs on lattices m = 16, 32, epsilon = 0.7 h, fitted at the particles");
    let kernel = WendlandC2::<2>::new();
    let blobs = |targets: &[[f64; 2]], particles: &Particles<2>, c: &[f64], h: f64| -> parops::Result<Vec<f64>> {
        let epsilon = NARROW * h;
        let around = CellList::build_at(targets, particles, &torus()?, Cutoff(2.0 * epsilon))?;
        let value = |p: usize| {
            let mut sum = 0.0;
            around.for_each(p, 2.0 * epsilon, |q| {
                sum += c[q.q] * parops::Kernel::<f64, 2>::value(&kernel, &q.separation.map(|s| s / epsilon));
            });
            sum * h * h / (epsilon * epsilon)
        };
        Ok((0..targets.len()).map(value).collect())
    };
    let (mut at, mut between, mut ours) = (Vec::new(), Vec::new(), Vec::new());
    for m in [16_usize, 32] {
        let (h, particles) = (1.0 / m as f64, square(m, 0.0, 1)?);
        // A lattice of its own, that never falls on the particles.
        let probes = Particles::lattice([0.0; 2], [1.0; 2], [(FACTOR * m as f64) as usize + 1; 2])?;
        let (u, exact) = (values(&particles, wave), values(&probes, wave));
        let mut c = u.clone();
        for _ in 0..80 {
            let fitted = blobs(particles.points(), &particles, &c, h)?;
            c.iter_mut().zip(u.iter().zip(&fitted)).for_each(|(c, (u, fitted))| *c += 0.7 * (u - fitted));
        }
        at.push(relative_error(&blobs(particles.points(), &particles, &c, h)?, &u));
        between.push(relative_error(&blobs(probes.points(), &particles, &c, h)?, &exact));

        let scattered = square(m, 0.3, 6)?;
        let method = dcpse(derivative([0, 0])?, 2)?;
        let around = Nearest::build_at(probes.points(), &scattered, &torus()?, method.fewest_neighbors::<2>()? + 1)?;
        let mut found = vec![0.0; probes.len()];
        method.assemble(&around)?.apply(&values(&scattered, wave), &mut found)?;
        ours.push(relative_error(&found, &exact));
    }
    case.naive(
        at[1] < 1e-6 && between[1] > 1e3 * at[1] && between[1] > 0.5 * between[0],
        format!(
            "errors at the particles {}, between them {}: the norm at particles sees nothing",
            listed(at),
            listed(between)
        ),
    );
    let (h, particles) = (1.0 / 32.0, square(32, 0.0, 1)?);
    let sph = Sph::new(derivative([0, 0])?, kernel, Spacing(h).epsilon(NARROW)?, particles.volumes()?)?;
    let refusal = cells(&particles, &Domain::periodic([0.0; 2], [1.0; 2])?, sph.cutoff().0)
        .and_then(|around| sph.assemble(&around))
        .err();
    case.detects(
        matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Operator(OperatorError::Overlap { h_over_epsilon, limit })) if h_over_epsilon > limit),
        refusal.map_or(String::from("accepted"), |error| error.to_string()),
    );
    let found = order(ours[0], ours[1], 2.0);
    case.prevents(
        (1.6..2.6).contains(&found),
        format!(
            "orders are read on a lattice of probes: DC-PSE from jittered particles has {} there, order {found:.2}",
            listed(ours)
        ),
    );
    Ok(())
}
