//! div(D grad f): exactness, order, the two means across a jump, growing modes, refusals.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use parops::{
    Apply, CellList, Cutoff, DcPse, DivGrad, Domain, ErrorKind, Face, Laplacian, Mean, OperatorError, ParticleError,
    Particles, Pse, Rows, testing::Promise,
};

type Failure = Result<(), parops::Error>;

fn sampled<const D: usize>(particles: &Particles<D>, f: impl Fn(&[f64; D]) -> f64) -> Vec<f64> {
    particles.points().iter().map(f).collect()
}

/// The largest difference to the exact values.
fn largest_error<const D: usize>(particles: &Particles<D>, out: &[f64], exact: impl Fn(&[f64; D]) -> f64) -> f64 {
    particles.points().iter().zip(out).map(|(x, out)| (out - exact(x)).abs()).fold(0.0, f64::max)
}

#[test]
fn dcpse_is_exact_where_the_degrees_of_diffusivity_and_field_add_up_to_r_plus_one() -> Failure {
    // Misses of 1e-12 in scaled units times f, at epsilon^-2 of about 100.
    const TOLERANCE: f64 = 1e-8;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [14; 2], 0.3, 3)?;
    let laplacian = DcPse::<Laplacian<2>, 4>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let div_grad = DivGrad::new(laplacian, sampled(&particles, |x| 2.0 + x[0] * x[1]))?;
    let f = sampled(&particles, |x| x[0].powi(3) - x[0] * x[1] * x[1] + x[1]);
    let exact = |x: &[f64; 2]| {
        let [x, y] = *x;
        (2.0 + x * y) * 4.0 * x + y * (3.0 * x * x - y * y) + x * (1.0 - 2.0 * x * y)
    };
    let mut out = vec![0.0; f.len()];
    let rows = div_grad.assemble(&neighbors)?;
    rows.apply(&f, &mut out)?;
    Promise::new("Residuals", "div(D grad f) of r = 4, degrees of D and f add up to 5")
        .at_most(TOLERANCE, largest_error(&particles, &out, exact));
    let mut free = vec![0.0; f.len()];
    div_grad.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    Promise::new("Reproducibility", "matrix-free div(D grad f), bits of stored rows").equal(&out, &free);
    rows.apply(&vec![3.7; f.len()], &mut out)?;
    let size = out.iter().fold(0.0_f64, |size, out| size.max(out.abs()));
    Promise::new("Metamorphic relations", "M9 div(D grad f) of a constant").at_most(0.0, size);
    Ok(())
}

#[test]
fn constant_diffusivity_gives_the_bits_of_the_laplacian_times_it_for_either_mean() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let plain = laplacian.assemble(&neighbors)?;
    for mean in [Mean::Arithmetic, Mean::Harmonic] {
        let scaled = DivGrad::new(laplacian.clone(), vec![0.7; particles.len()])?.mean(mean).assemble(&neighbors)?;
        for p in 0..particles.len() {
            let (plain, scaled) = (plain.row(p).unwrap(), scaled.row(p).unwrap());
            Promise::new(
                "Metamorphic relations",
                "rows of div(D grad f) for a constant D, bits of D times the Laplacian",
            )
            .holds(plain.weights.iter().zip(scaled.weights).all(|(w, s)| 0.7 * w[0] == s[0]));
        }
    }
    Ok(())
}

#[test]
fn shares_of_odd_images_are_scaled_pair_by_pair() -> Failure {
    // u = sin(pi x) is odd in both faces and D = 2 + cos(pi x) even: on the half domain with mirrors the operator must
    // give what it gives on the doubled, periodic domain.
    const N: usize = 24;
    let half = Particles::lattice([0.0], [1.0], [N])?;
    let whole = Particles::lattice([0.0], [2.0], [2 * N])?;
    let mirror = Domain::new([0.0], [1.0], [[Face::MirrorOdd, Face::MirrorOdd]])?;
    let torus = Domain::periodic([0.0], [2.0])?;
    let diffusivity = |x: &[f64; 1]| 2.0 + (std::f64::consts::PI * x[0]).cos();
    let u = |x: &[f64; 1]| (std::f64::consts::PI * x[0]).sin();
    let apply = |particles: &Particles<1>, domain: &Domain<1>| -> Result<Vec<f64>, parops::Error> {
        let pse = Pse::new(Laplacian::<1>, 2, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
        let neighbors = CellList::build(particles, domain, pse.cutoff())?;
        let mut out = vec![0.0; particles.len()];
        DivGrad::new(pse, sampled(particles, diffusivity))?
            .assemble(&neighbors)?
            .apply(&sampled(particles, u), &mut out)?;
        Ok(out)
    };
    let (half, whole) = (apply(&half, &mirror)?, apply(&whole, &torus)?);
    // Sums of 24 pairs whose weights are up to (h epsilon^2)^-1 h.
    let unit = f64::EPSILON * (N as f64 / 2.0).powi(2);
    let off = half.iter().zip(&whole).map(|(half, whole)| (half - whole).abs()).fold(0.0, f64::max);
    Promise::new("Metamorphic relations", "div(D grad f) between odd mirrors against the doubled torus")
        .in_units("eps/epsilon^2", unit)
        .at_most(100.0, off);
    Ok(())
}

#[test]
fn refusals_name_the_particle_and_the_numbers() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [8; 2], 0.3, 1)?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let mut diffusivity = vec![1.0; 64];
        diffusivity[17] = bad;
        let error = DivGrad::new(laplacian.clone(), diffusivity).unwrap_err();
        assert_eq!(error.particle(), Some(17));
        assert!(matches!(error.kind(), ErrorKind::Particle(ParticleError::Diffusivity { diffusivity })
            if diffusivity.to_bits() == bad.to_bits()));
    }
    let neighbors = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let error = DivGrad::new(laplacian.clone(), vec![1.0; 63])?.assemble(&neighbors).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Particle(ParticleError::Length { found: 63, needed: 64 }));
    let plus = DcPse::<parops::D2<1, 0>, 2>::new();
    let error = DivGrad::new(plus, vec![1.0; 64])?.assemble(&neighbors).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::NotDifference { expected: 0.0, .. })));
    // No wider support makes a difference of a sum.
    assert!(error.particle().is_some() && error.wanted_cutoff().is_none());
    Ok(())
}

/// 1.3 times the cutoff whose ball holds the fewest neighbors of a row in the mean: enough for every row of a torus.
fn on_torus(particles: &Particles<2>, r: u32) -> Result<(DcPse<Laplacian<2>>, CellList<2>), parops::Error> {
    let dcpse = DcPse::at_order(Laplacian::<2>, r)?;
    let needed = dcpse.fewest_neighbors::<2>()? as f64 / particles.len() as f64;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let neighbors = CellList::build(particles, &torus, Cutoff(1.3 * (needed / PI).sqrt()))?;
    Ok((dcpse, neighbors))
}

/// Fit of the root mean square error over four jittered sets on a torus; the median of five seeds.
fn observed_order(r: u32, mean: Mean) -> Result<f64, parops::Error> {
    let sizes = [40, 54, 74, 100];
    let exact = |&[x, y]: &[f64; 2]| {
        let (d, dx) = (2.0 + 0.5 * (TAU * x).sin(), 0.5 * TAU * (TAU * x).cos());
        let ux = TAU * (TAU * x).cos();
        let lap = -TAU * TAU * ((TAU * x).sin() + (TAU * y).cos());
        d * lap + dx * ux
    };
    let mut orders = Vec::new();
    for seed in 0..5 {
        let mut points = Vec::new();
        for n in sizes {
            let particles = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.3, seed)?;
            let (dcpse, neighbors) = on_torus(&particles, r)?;
            let diffusivity = sampled(&particles, |x| 2.0 + 0.5 * (TAU * x[0]).sin());
            let rows = DivGrad::new(dcpse, diffusivity)?.mean(mean).assemble(&neighbors)?;
            let mut out = vec![0.0; particles.len()];
            rows.apply(&sampled(&particles, |&[x, y]| (TAU * x).sin() + (TAU * y).cos()), &mut out)?;
            let squares = particles.points().iter().zip(&out).map(|(x, out)| (out - exact(x)).powi(2));
            points.push((-(n as f64).ln(), 0.5 * (squares.sum::<f64>() / out.len() as f64).ln()));
        }
        orders.push(slope(&points));
    }
    orders.sort_by(f64::total_cmp);
    Ok(orders[2])
}

/// The slope of the line through these points with the least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let (over, under) = points
        .iter()
        .fold((0.0, 0.0), |(over, under), p| (over + (p.0 - mean.0) * (p.1 - mean.1), under + (p.0 - mean.0).powi(2)));
    over / under
}

#[test]
fn smooth_diffusivity_keeps_the_order_of_the_laplacian_on_jittered_sets_with_either_mean() -> Failure {
    for mean in [Mean::Arithmetic, Mean::Harmonic] {
        for r in [2, 4] {
            let order = observed_order(r, mean)?;
            let design = f64::from(r);
            Promise::new("Orders", format!("div(D grad f) on jittered sets, {mean:?} mean, r = {r}")).within(
                design - 0.1,
                design + 0.1,
                order,
            );
        }
    }
    Ok(())
}

/// Root mean square error of the steady state in a square of two layers, D = 1 to x = 1/2 and `contrast` beyond, with a
/// flux of 1 / (1/2 + 1/2 / `contrast`) along x; the values in a frame of 0.15 are given.
fn layered_error<const D: usize>(n: usize, seed: u64, r: u32, mean: Mean, contrast: f64) -> Result<f64, parops::Error> {
    let particles = Particles::jittered([0.0; D], [1.0; D], [n; D], 0.3, seed)?;
    let diffusivity = sampled(&particles, |x| if x[0] < 0.5 { 1.0 } else { contrast });
    let flux = 1.0 / (0.5 + 0.5 / contrast);
    let exact = |x: &[f64; D]| flux * (x[0].min(0.5) + (x[0] - 0.5).max(0.0) / contrast);
    let dcpse = DcPse::at_order(Laplacian::<D>, r)?;
    let neighbors = CellList::build(&particles, &Domain::open(), dcpse.cutoff(&particles)?)?;
    let mut matrix = dense(&DivGrad::new(dcpse, diffusivity)?.mean(mean).assemble(&neighbors)?);
    let mut right = DVector::zeros(particles.len());
    for (p, x) in particles.points().iter().enumerate() {
        if x.iter().any(|x| !(0.15..0.85).contains(x)) {
            matrix.row_mut(p).fill(0.0);
            matrix[(p, p)] = 1.0;
            right[p] = exact(x);
        }
    }
    let u = matrix.lu().solve(&right).unwrap();
    let squares = particles.points().iter().zip(u.iter()).map(|(x, u)| (u - exact(x)).powi(2));
    Ok((squares.sum::<f64>() / particles.len() as f64).sqrt())
}

fn dense(rows: &Rows) -> DMatrix<f64> {
    let n = rows.targets();
    let mut matrix = DMatrix::zeros(n, n);
    for p in 0..n {
        let row = rows.row(p).unwrap();
        matrix[(p, p)] += row.diagonal[0];
        for (&q, w) in row.sources.iter().zip(row.weights) {
            matrix[(p, q as usize)] += w[0];
            matrix[(p, p)] -= w[0];
        }
    }
    matrix
}

#[test]
fn flux_through_a_jump_is_right_with_the_harmonic_mean_and_several_times_worse_with_the_arithmetic() -> Failure {
    // Both are of first order; the means over three seeds differ by 6 to 10 times.
    let mean_error = |n: usize, mean| -> Result<f64, parops::Error> {
        let sum: Result<f64, _> = (0..3).map(|seed| layered_error::<1>(n, seed, 2, mean, 100.0)).sum();
        Ok(sum? / 3.0)
    };
    let worse = Promise::new("Accuracy", "error across a jump of 100, arithmetic over harmonic mean");
    let mut points = Vec::new();
    for n in [20, 40, 80, 160] {
        let (harmonic, arithmetic) = (mean_error(n, Mean::Harmonic)?, mean_error(n, Mean::Arithmetic)?);
        worse.at_least(5.0, arithmetic / harmonic);
        points.push((-(n as f64).ln(), harmonic.ln()));
    }
    let order = slope(&points);
    Promise::new("Orders", "div(D grad f) across a jump of 100 in 1D, harmonic mean").within(0.8, 1.5, order);
    for r in [2, 4] {
        let harmonic = layered_error::<2>(24, 1, r, Mean::Harmonic, 100.0)?;
        let arithmetic = layered_error::<2>(24, 1, r, Mean::Arithmetic, 100.0)?;
        worse.at_least(5.0, arithmetic / harmonic);
        assert!(harmonic < 0.02, "{r}: {harmonic}");
    }
    Ok(())
}

/// What a torus with a layer of D = `contrast` gives: the largest real part of an eigenvalue over the largest modulus,
/// the rows, and how many of them reach over a face of the layer.
fn growth(r: u32, mean: Mean, contrast: f64, seed: u64) -> Result<(f64, Rows, usize), parops::Error> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.3, seed)?;
    let (dcpse, neighbors) = on_torus(&particles, r)?;
    let diffusivity = sampled(&particles, |x| if x[0] < 0.5 { contrast } else { 1.0 });
    let rows = DivGrad::new(dcpse, diffusivity.clone())?.mean(mean).assemble(&neighbors)?;
    let mixed = |p: &usize| rows.row(*p).unwrap().sources.iter().any(|&q| diffusivity[q as usize] != diffusivity[*p]);
    let mixed = (0..rows.targets()).filter(mixed).count();
    let values = dense(&rows).complex_eigenvalues();
    let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
    let growing = values.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
    Ok((growing / largest, rows, mixed))
}

#[test]
fn order_four_with_the_arithmetic_mean_grows_across_a_contrast_of_100_and_nothing_else_does() -> Failure {
    // Constants have eigenvalue zero: their rounding, over the largest eigenvalue.
    const ZERO: f64 = 1e-12;
    for seed in 0..3 {
        let (growing, rows, mixed) = growth(4, Mean::Arithmetic, 100.0, seed)?;
        Promise::new("Limits of steps", "growth of r = 4 across a contrast of 100, arithmetic mean, of the radius")
            .at_least(1e-3, growing);
        let report = rows.report();
        assert_eq!((report.contrast, report.growing), (100.0, mixed));
        assert!(0 < mixed && mixed < rows.targets());
    }
    for (r, mean, contrast) in [
        (2, Mean::Arithmetic, 100.0),
        (2, Mean::Harmonic, 100.0),
        (4, Mean::Harmonic, 100.0),
        (4, Mean::Arithmetic, 10.0),
        (4, Mean::Arithmetic, 1.0),
    ] {
        let (stable, rows, _) = growth(r, mean, contrast, 0)?;
        assert_eq!((rows.report().contrast, rows.report().growing), (contrast, 0));
        Promise::new("Limits of steps", "growth of div(D grad f) that the report does not flag, of the radius")
            .case(format!("r = {r}, {mean:?}, contrast {contrast}"))
            .at_most(ZERO, stable);
    }
    Ok(())
}

#[test]
fn targets_off_the_particles_have_no_flux_though_their_laplacian_has_a_row() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 1)?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let between = CellList::build_at(&[[0.51, 0.52]], &particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let rows = laplacian.assemble(&between)?;
    let error = DivGrad::new(laplacian, vec![1.0; particles.len()])?.assemble(&between).unwrap_err();
    let neighbors = rows.row(0).map_or(0, |row| row.sources.len());
    let due = ErrorKind::Operator(OperatorError::NoCenter { neighbors });
    assert_eq!((error.kind(), error.particle()), (&due, Some(0)));
    Ok(())
}
