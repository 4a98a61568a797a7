//! div(D grad f): exactness, order, the two means across a jump, growing modes, refusals.

use parops::{
    Apply, CellList, DcPse, DivGrad, Domain, ErrorKind, Face, Laplacian, Mean, OperatorError, ParticleError, Particles,
    Pse,
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
    assert!(largest_error(&particles, &out, exact) < TOLERANCE);
    let mut free = vec![0.0; f.len()];
    div_grad.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(out, free);
    rows.apply(&vec![3.7; f.len()], &mut out)?;
    assert!(out.iter().all(|&out| out == 0.0), "a constant is not annihilated");
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
            assert!(plain.weights.iter().zip(scaled.weights).all(|(w, s)| 0.7 * w[0] == s[0]));
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
    let tolerance = 100.0 * f64::EPSILON * (N as f64 / 2.0).powi(2);
    assert!(half.iter().zip(&whole).all(|(half, whole)| (half - whole).abs() < tolerance), "{half:?} {whole:?}");
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
    assert!(error.particle().is_some());
    Ok(())
}
