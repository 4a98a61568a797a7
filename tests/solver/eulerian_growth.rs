//! Growth of diffusion that stands at its edge: conserving nothing, a free set has an eigenvalue 0 of two with one
//! eigenvector, since A x^2 is a constant.

use parops::{
    AdvectionDiffusion, DcPse, Domain, Eulerian, GrowthPolicy, Laplacian, Limit, Nearest, Particles, Result, Rk4,
    SemiDiscrete, Spectrum, SpectrumEstimator,
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
