//! Growth of diffusion that stands at its edge: conserving nothing, a free set has an eigenvalue 0 of many with one
//! eigenvector, since A x^2 is a constant, A x^4 a multiple of x^2, and so on up to the order of the rows.

use parops::{
    AdvectionDiffusion, DcPse, Domain, ErrorKind, Eulerian, Fields, Gradient, GrowthPolicy, Laplacian, Limit, Method,
    Nearest, Particles, Result, Rk4, SemiDiscrete, Sign, SolverError, Spectrum, SpectrumEstimator,
};

type Rod = AdvectionDiffusion<1>;

fn rod(count: usize, seed: u64) -> Result<(Particles<1>, Nearest<1>)> {
    let set = Particles::jittered([0.0], [1.0], [count], 0.35, seed)?;
    let neighbors = Nearest::build(&set, &Domain::open(), 7)?;
    Ok((set, neighbors))
}

/// The spectrum of u'' from all eigenvalues.
fn all(set: &Particles<1>, neighbors: &Nearest<1>) -> Result<Spectrum> {
    let scene = Rod::new().diffusion(1.0, DcPse::<Laplacian<1>, 2>::new());
    let mut discrete = SemiDiscrete::new(scene, set, neighbors, GrowthPolicy::Allow)?;
    let (mut field, mut rate) = (vec![0.0; set.len()], vec![0.0; set.len()]);
    let spectrum = SpectrumEstimator::new().estimate(set.len(), |u, du| {
        field.copy_from_slice(u);
        discrete.rate(0.0, &field, &mut rate)?;
        du.copy_from_slice(&rate);
        Ok(())
    })?;
    assert!(spectrum.exact);
    Ok(spectrum)
}

#[test]
fn eigenvalue_zero_torn_in_two_is_no_growth() -> Result<()> {
    for seed in 0..160 {
        let (set, neighbors) = rod(40 + seed as usize, seed)?;
        let scene = Rod::new().diffusion(1.0, DcPse::<Laplacian<1>, 2>::new());
        let run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
        // Nothing positive is claimed but rounding, and there is nothing but what rounding makes of 0.
        assert!(!(run.ledger().growth > 1e-3), "{} with seed {seed}", run.ledger().growth);
        let found = all(&set, &neighbors)?;
        assert!(found.relative_growth() < 1e-6 && found.abscissa <= found.error.max(1e-12 * found.radius), "{found:?}");
    }
    // Beyond the sets whose eigenvalues are all found neither growth nor none is claimed.
    let (set, neighbors) = rod(700, 7)?;
    let scene = Rod::new().diffusion(1.0, DcPse::<Laplacian<1>, 2>::new());
    let mut run = Eulerian::new(scene, &set, &neighbors, Rk4::new())?;
    let (growth, limits) = (run.ledger().growth, run.limits(&vec![0.0; set.len()])?);
    // The rate of decay bounds the radius from above.
    assert!(!(growth > 1e-8 * limits.rate(Limit::Diffusion).decay), "{growth}");
    Ok(())
}

/// The growth that a free set of count^D jittered particles is refused for, or else what its ledger claims, over the radius.
fn claimed<E: Fields, const D: usize, const R: u32>(
    count: usize,
    jitter: f64,
    seed: u64,
) -> Result<std::result::Result<f64, f64>>
where
    DcPse<Laplacian<D>, R>: Method<D, Out = [f64; 1]> + Clone,
{
    let set = Particles::jittered([0.0; D], [1.0; D], [count; D], jitter, seed)?;
    let method = DcPse::<Laplacian<D>, R>::new();
    let neighbors = Nearest::build(&set, &Domain::open(), method.fewest_neighbors()?)?;
    let scene = AdvectionDiffusion::<D>::new().fields::<E>().diffusion(1.0, method);
    match Eulerian::new(scene, &set, &neighbors, Rk4::new()) {
        Ok(mut run) => {
            // The rate of decay bounds the radius from above.
            let radius = run.limits(&vec![E::ZERO; set.len()])?.rate(Limit::Diffusion).decay;
            Ok(Ok(run.ledger().growth / radius))
        }
        Err(error) => match *error.kind() {
            ErrorKind::Solver(SolverError::Growing { rate, radius, .. }) => Ok(Err(rate / radius)),
            _ => Err(error),
        },
    }
}

#[test]
fn rows_of_any_order_and_precision_claim_no_growth_of_a_free_rod() -> Result<()> {
    // 4e-5 of the radius at order 4, 4e-4 at 6 and 4e-3 at 8 are what rounding tears 0 apart by; 6e-3 in f32.
    for (case, count) in [30, 64, 100, 150, 700, 1500].into_iter().enumerate() {
        for seed in 3 * case as u64..3 * case as u64 + 3 {
            let found = [
                claimed::<f64, 1, 3>(count, 0.3, seed)?,
                claimed::<f64, 1, 4>(count, 0.3, seed)?,
                claimed::<f64, 1, 6>(count, 0.3, seed)?,
                claimed::<f64, 1, 8>(count, 0.3, seed)?,
                claimed::<f32, 1, 2>(count, 0.3, seed)?,
                claimed::<f32, 1, 4>(count, 0.3, seed)?,
            ];
            // NaN, or 0 but for the rounding of `f32`.
            assert!(found.iter().all(|x| matches!(x, Ok(rate) if !(*rate > 2e-6))), "{count} with {seed}: {found:?}");
        }
    }
    Ok(())
}

#[test]
fn growth_of_a_free_square_is_refused_at_any_order_and_precision() -> Result<()> {
    for count in [12, 28] {
        for seed in 0..2 {
            let found = [
                claimed::<f64, 2, 2>(count, 0.3, seed)?,
                claimed::<f64, 2, 4>(count, 0.3, seed)?,
                claimed::<f64, 2, 6>(count, 0.3, seed)?,
                claimed::<f32, 2, 2>(count, 0.3, seed)?,
                claimed::<f32, 2, 4>(count, 0.3, seed)?,
            ];
            assert!(found.iter().all(|x| matches!(x, Err(rate) if *rate > 0.1)), "{count} {seed} {found:?}");
        }
    }
    Ok(())
}

#[test]
fn slow_growth_is_refused_in_single_precision_too() -> Result<()> {
    // Of a free rod: the field is 10^5 times as large after 3000 steps.
    for found in [claimed::<f64, 1, 4>(60, 0.45, 38)?, claimed::<f32, 1, 4>(60, 0.45, 38)?] {
        assert!(matches!(found, Err(rate) if (0.05..0.07).contains(&rate)), "{found:?}");
    }
    // Of advection on more particles than all eigenvalues are found for.
    for seed in 0..2 {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [30; 2], 0.1, seed)?;
        let around = Nearest::build(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, 14)?;
        let gradient = DcPse::<Gradient<2>, 2>::new().sign(Sign::Plus);
        let scene = AdvectionDiffusion::<2>::new().fields::<f32>().advection([0.8, -0.6], gradient);
        let error = Eulerian::new(scene, &set, &around, Rk4::new()).err().unwrap();
        let ErrorKind::Solver(SolverError::Growing { rate, radius, .. }) = *error.kind() else { panic!("{error}") };
        assert!((2e-3..1e-2).contains(&(rate / radius)), "{}", rate / radius);
    }
    Ok(())
}

#[test]
fn spectrum_of_diffusion_is_found_in_any_unit() -> Result<()> {
    let (set, neighbors) = rod(100, 3)?;
    let rate = |scale: f64| {
        let scene = Rod::new().diffusion(scale, DcPse::<Laplacian<1>, 2>::new());
        let mut discrete = SemiDiscrete::new(scene, &set, &neighbors, GrowthPolicy::Allow)?;
        discrete.spectrum(0.0)
    };
    let unit = rate(1.0)?;
    for scale in [1e-250, 1e-200, 1e-165, 1e155, 1e200] {
        let found = rate(scale)?;
        let (a, b) = (found.relative_growth(), unit.relative_growth());
        assert!((a - b).abs() <= 1e-7 && (found.radius / scale / unit.radius - 1.0).abs() < 1e-6, "{scale}: {a} {b}");
    }
    Ok(())
}
