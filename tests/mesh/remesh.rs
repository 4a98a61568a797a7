//! Remeshing: what becomes a particle, what is counted as dropped, and what 400 remeshings leave of a step.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Cic, Domain, Error, ErrorKind, Face, Lambda, Mesh, MeshError, MeshKernel, Particles, Random, Result, Volumes,
    testing::Promise,
};
use proptest::prelude::*;

/// What 400 remeshings make of a step: the relative mass error, and by how much it is overshot after one and after all.
struct Record {
    mass: f64,
    once: f64,
    finally: f64,
}

/// A step of height 1 over half a ring of 100 nodes, moved by `shift` spacings and remeshed, 400 times.
fn remesh_step<const S: usize>(kernel: &impl MeshKernel<f64, S>, shift: f64) -> Record {
    let mesh = Mesh::nodes(&Domain::periodic([0.0], [1.0]).unwrap(), [100]).unwrap();
    let h = mesh.spacings()[0];
    let mut values: Vec<f64> = mesh.points().map(|[x]| if (0.25..0.75).contains(&x) { h } else { 0.0 }).collect();
    let before: f64 = values.iter().sum();
    let overshoot = |values: &[f64]| values.iter().map(|&omega| (omega / h - 1.0).max(-omega / h)).fold(0.0, f64::max);
    let (mut once, mut dropped) = (0.0, 0.0);
    for step in 0..400 {
        let remeshed = mesh.remesh(&values, 0.0).unwrap();
        dropped += remeshed.dropped.absolute;
        let moved: Vec<[f64; 1]> = remeshed.particles.points().iter().map(|[x]| [x + shift * h]).collect();
        values.fill(0.0);
        mesh.deposit(kernel, &moved, &remeshed.strengths, &mut values).unwrap();
        if step == 0 {
            once = overshoot(&values);
        }
    }
    assert_eq!(dropped, 0.0, "only exact zeros are dropped");
    let mass = (values.iter().sum::<f64>() - before).abs() / before;
    Record { mass, once, finally: overshoot(&values) }
}

#[test]
fn step_remeshed_400_times_keeps_its_mass_and_overshoots_as_measured() {
    const MASS: f64 = 2e-13;
    const SHIFTS: [f64; 6] = [0.37, 0.05, 0.1, 0.25, 0.5, 0.71];
    // Half a unit of the last digit recorded.
    const DIGITS: f64 = 5e-5;
    /// Overshoots at the shift 0.37 after one and after 400 remeshings, and the largest after 400 over all shifts.
    fn check<const P: usize, const R: usize, const S: usize>(recorded: [f64; 3])
    where
        Lambda<P, R>: MeshKernel<f64, S>,
    {
        let kernel = Lambda::<P, R>::new().unwrap();
        let records: Vec<Record> = SHIFTS.iter().map(|&shift| remesh_step(&kernel, shift)).collect();
        let largest = |figure: fn(&Record) -> f64| records.iter().map(figure).fold(0.0, f64::max);
        let mass = Promise::new("Conservation", "relative mass of a step remeshed 400 times, every Lambda");
        mass.at_most(MASS, largest(|r| r.mass));
        let found = [records[0].once, records[0].finally, largest(|r| r.finally)];
        let same = found.iter().zip(recorded).all(|(found, recorded)| (found - recorded).abs() <= DIGITS);
        assert!(same, "({P}, {R}): {found:?}");
    }
    check::<2, 1, 4>([0.0734, 0.1072, 0.2514]);
    check::<2, 2, 4>([0.0805, 0.1456, 0.2595]);
    check::<4, 2, 6>([0.1010, 0.1175, 0.1960]);
    check::<4, 4, 6>([0.1078, 0.1308, 0.2020]);
    check::<6, 4, 8>([0.1162, 0.1101, 0.1903]);
    check::<6, 6, 8>([0.1196, 0.1136, 0.1904]);
    check::<8, 4, 10>([0.1210, 0.1207, 0.1538]);
    // Linear interpolation never overshoots; it smears instead.
    assert!(SHIFTS.iter().all(|&shift| remesh_step(&Cic, shift).finally == 0.0));
}

/// The sum of numbers with the rounding errors carried along.
fn exact_sum(terms: &[f64]) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for &x in terms {
        let next = sum + x;
        lost += if sum.abs() >= x.abs() { (sum - next) + x } else { (x - next) + sum };
        sum = next;
    }
    sum + lost
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn kept_and_dropped_add_up_to_the_mesh(seed in any::<u64>(), threshold in 0.0..2.0_f64) {
        let mesh = Mesh::cells(&Domain::periodic([0.0; 2], [2.0, 3.0]).unwrap(), [6, 7]).unwrap();
        let mut random = Random::new(seed);
        let values: Vec<f64> = (0..42).map(|i| if i % 5 == 0 { 0.0 } else { random.normal() }).collect();
        let remeshed = mesh.remesh(&values, threshold).unwrap();
        let kept: Vec<usize> = (0..42).filter(|&node| values[node].abs() > threshold).collect();
        prop_assert_eq!(remeshed.particles.len(), kept.len());
        for (p, &node) in kept.iter().enumerate() {
            prop_assert_eq!(remeshed.particles.points()[p], mesh.point(mesh.indices(node)));
            prop_assert_eq!(remeshed.strengths[p], values[node]);
        }
        prop_assert_eq!(remeshed.particles.volumes().unwrap(), &Volumes::equal(mesh.cell_volume()).unwrap());
        let left = || (0..42).filter(|node| !kept.contains(node)).map(|node| values[node]);
        prop_assert_eq!(remeshed.dropped.count, left().count());
        prop_assert_eq!(remeshed.dropped.sum, left().sum::<f64>() + 0.0);
        prop_assert_eq!(remeshed.dropped.absolute, left().map(f64::abs).sum::<f64>() + 0.0);
    }

    #[test]
    fn one_remeshing_keeps_the_mass_to_a_few_eps(seed in any::<u64>()) {
        let mesh = Mesh::nodes(&Domain::periodic([0.0; 3], [1.0; 3]).unwrap(), [6; 3]).unwrap();
        let particles = Particles::random([0.0; 3], [1.0; 3], 40, seed).unwrap();
        let mut random = Random::new(seed);
        let strengths: Vec<f64> = (0..40).map(|_| random.normal()).collect();
        let mut values = vec![0.0; mesh.len()];
        mesh.deposit(&Lambda::<4, 2>::new().unwrap(), particles.points(), &strengths, &mut values).unwrap();
        let remeshed = mesh.remesh(&values, 0.0).unwrap();
        let [before, after] = [&strengths, &remeshed.strengths].map(|x| exact_sum(x));
        let absolute: f64 = strengths.iter().map(|omega| omega.abs()).sum();
        let one = Promise::new("Conservation", "mass under one remeshing in 3D").in_units("D eps sum abs", 3.0 * f64::EPSILON * absolute);
        one.at_most(4.0, (before - after - remeshed.dropped.sum).abs());
    }
}

#[test]
fn remeshed_particles_are_ready_for_operators_and_for_the_next_remeshing() -> Result<()> {
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [40; 2], 0.3, 3)?;
    let volume = particles.volumes()?.get(0)?;
    let wave = |x: &[f64; 2]| (std::f64::consts::TAU * x[0]).sin() + 2.0;
    let strengths: Vec<f64> = particles.points().iter().map(|x| volume * wave(x)).collect();
    let mesh = Mesh::cells(&torus, [32; 2])?;
    let mut values = vec![0.0; mesh.len()];
    mesh.deposit(&Lambda::<2, 2>::new()?, particles.points(), &strengths, &mut values)?;
    let remeshed = mesh.remesh(&values, 0.0)?;
    // The cells of a mesh are the cells of a lattice, to the bit.
    assert_eq!(remeshed.particles.points(), Particles::lattice([0.0; 2], [1.0; 2], [32; 2])?.points());
    let u = remeshed.particles.points().iter().zip(&remeshed.strengths);
    // Equal volumes on jittered places carry noise of the jitter; the field is there.
    let error = u.map(|(x, omega)| (omega / mesh.cell_volume() - wave(x)).powi(2)).sum::<f64>() / 1024.0;
    assert!(error.sqrt() < 0.5, "{error}");
    let pse = parops::Pse::new(
        parops::Laplacian::<2>,
        2,
        remeshed.particles.spacing()?.epsilon(2.0)?,
        remeshed.particles.volumes()?,
    )?;
    assert_eq!(pse.assemble(&parops::CellList::build(&remeshed.particles, &torus, pse.cutoff())?)?.targets(), 1024);
    Ok(())
}

#[test]
fn several_fields_are_kept_where_any_exceeds_its_threshold() -> Result<()> {
    let mesh = Mesh::nodes(&Domain::new([0.0], [3.0], [[Face::Open; 2]])?, [4])?;
    let values = [[1.0, 0.0], [0.5, 1.0], [0.25, 10.0], [-2.0, 20.0_f32]];
    let remeshed = mesh.remesh_fields(&values, [0.75, 5.0])?;
    assert_eq!(remeshed.particles.points(), [[0.0], [2.0], [3.0]]);
    assert_eq!(remeshed.strengths, [values[0], values[2], values[3]]);
    let dropped = remeshed.dropped;
    assert_eq!((dropped.count, dropped.sum, dropped.absolute), (1, [0.5, 1.0], [0.5, 1.0]));
    // Two small strengths of opposite sign: their sum hides what the magnitudes tell.
    let remeshed = mesh.remesh(&[0.25, -0.25, 4.0, 0.0], 0.5)?;
    assert_eq!((remeshed.dropped.count, remeshed.dropped.sum, remeshed.dropped.absolute), (3, 0.0, 0.5));
    // In single precision ten million tiny ones still count.
    let wide = Mesh::nodes(&Domain::periodic([0.0], [1.0])?, [1 << 24])?;
    let dropped = wide.remesh(&vec![0.1_f32; 1 << 24], 0.5)?.dropped;
    let exact = f64::from(0.1_f32) * f64::from(1 << 24);
    assert!((f64::from(dropped.sum) / exact - 1.0).abs() <= f32::EPSILON.into());
    assert!(mesh.remesh(&[0.0; 4], 0.0)?.particles.is_empty());
    Ok(())
}

#[test]
fn values_and_thresholds_that_are_no_numbers_are_refused() -> Result<()> {
    let mesh = Mesh::nodes(&Domain::periodic([0.0], [1.0])?, [4])?;
    let length = Error::from(MeshError::Length { found: 3, needed: 4 });
    assert_eq!(mesh.remesh(&[0.0; 3], 0.0).map(|_| ()), Err(length));
    let threshold = Error::from(MeshError::Threshold { field: 1, threshold: -1.0 });
    assert_eq!(mesh.remesh_fields(&[[0.0; 2]; 4], [0.0, -1.0]).map(|_| ()), Err(threshold));
    let error = mesh.remesh(&[0.0; 4], f64::NAN).unwrap_err();
    assert!(matches!(*error.kind(), ErrorKind::Mesh(MeshError::Threshold { field: 0, .. })));
    let error = mesh.remesh(&[0.0, 1.0, f64::INFINITY, f64::NAN], 0.0).unwrap_err();
    assert_eq!(error, Error::from(MeshError::Value { node: 2, field: 0, value: f64::INFINITY }));
    Ok(())
}
