//! Several fields at once: the bits of each alone, any strides, refusals that name particle and field.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Apply, ApplyError, BruteForce, CellList, Cutoff, D2, DcPse, Domain, Error, ErrorKind, Face, Field, Laplacian,
    Particles, Pse, Random, Rows, Strided, testing::Promise,
};
use proptest::prelude::*;

type Failure = Result<(), Error>;

/// A scattered set with odd images, so that rows have diagonals; more rows than one block of work.
fn rows<T: Field>() -> Rows<[f64; 1], T> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [26; 2], 0.3, 5).unwrap();
    let domain = Domain::new([0.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorOdd; 2]]).unwrap();
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    Rows::assemble(&dcpse, &CellList::build(&particles, &domain, Cutoff(3.5 / 26.0)).unwrap()).unwrap()
}

/// Rows off the particles: interpolation, as many targets as sources times three.
fn off_particles() -> Rows {
    let sources = Particles::jittered([0.0; 2], [1.0; 2], [12; 2], 0.3, 5).unwrap();
    let targets = Particles::jittered([0.2; 2], [0.8; 2], [20; 2], 0.4, 6).unwrap();
    let neighbors = BruteForce::build_at(targets.points(), &sources, &Domain::open(), Cutoff(0.35)).unwrap();
    DcPse::<D2<0, 0>, 2>::new().assemble(&neighbors).unwrap()
}

fn noise<T: Field>(count: usize, seed: u64) -> Vec<T> {
    let mut random = Random::new(seed);
    (0..count).map(|_| T::lift(random.normal())).collect()
}

/// Applies the rows to each field by itself and compares bits with what `got` says of particle and field.
fn each_alone<T: Field>(
    rows: &Rows<[f64; 1], T>,
    count: usize,
    f: impl Fn(usize, usize) -> T,
    got: impl Fn(usize, usize) -> T,
) {
    for i in 0..count {
        let alone: Vec<T> = (0..rows.sources()).map(|q| f(q, i)).collect();
        let mut out = vec![T::zero(); rows.targets()];
        rows.apply(&alone, &mut out).unwrap();
        for (p, &out) in out.iter().enumerate() {
            assert_eq!(got(p, i), out, "particle {p}, field {i} of {count}");
        }
    }
}

fn interleaved<T: Field, const F: usize>(rows: &Rows<[f64; 1], T>) {
    let f: Vec<[T; F]> = noise::<T>(rows.sources() * F, F as u64).as_chunks().0.to_vec();
    let mut out = vec![[T::zero(); F]; rows.targets()];
    rows.apply_fields(&f, &mut out).unwrap();
    each_alone(rows, F, |q, i| f[q][i], |p, i| out[p][i]);
}

#[test]
fn interleaved_fields_have_the_bits_of_each_alone_in_f64_and_f32_and_off_the_particles() {
    let (double, single, off) = (rows::<f64>(), rows::<f32>(), off_particles());
    interleaved::<f64, 1>(&double);
    interleaved::<f64, 3>(&double);
    interleaved::<f64, 16>(&double);
    interleaved::<f32, 7>(&single);
    interleaved::<f32, 16>(&single);
    interleaved::<f64, 5>(&off);
    // No field at all is legal and writes nothing.
    double.apply_fields(&vec![[]; double.sources()], &mut vec![[]; double.targets()]).unwrap();
}

#[test]
fn matrix_free_fields_have_the_bits_of_stored_rows() -> Failure {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [26; 2], 0.3, 5)?;
    let domain = Domain::new([0.0; 2], [1.0; 2], [[Face::Periodic; 2], [Face::MirrorOdd; 2]])?;
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = CellList::build(&particles, &domain, Cutoff(3.5 / 26.0))?;
    let (stored, free) = (dcpse.assemble(&neighbors)?, dcpse.matrix_free(&neighbors)?);
    let f: Vec<[f64; 4]> = noise::<f64>(particles.len() * 4, 3).as_chunks().0.to_vec();
    let (mut out, mut again) = (vec![[0.0; 4]; f.len()], vec![[0.0; 4]; f.len()]);
    stored.apply_fields(&f, &mut out)?;
    free.apply_fields(&f, &mut again)?;
    Promise::new("Reproducibility", "matrix-free applications of several fields, bits of stored rows")
        .equal(&out, &again);
    Ok(())
}

#[test]
fn strided_fields_have_the_bits_of_each_alone_for_any_layout() {
    let cases = cases() / 10;
    let (rows, n) = (rows::<f64>(), 26 * 26);
    // Fields, gaps between fields and between particles, and which of the two is the outer one; of input and output.
    let layout = || (0..4_usize, 0..3_usize, any::<bool>());
    let config = properties(cases);
    proptest!(config, |(count in 0..36_usize, input in layout(), output in layout(), seed in any::<u64>())| {
        let strides = |(outer, inner, stacked): (usize, usize, bool)| {
            let inner = inner + 1;
            if stacked { [inner, n * inner + outer] } else { [count * inner + outer, inner] }
        };
        let (from, to) = (strides(input), strides(output));
        let length = |[s, t]: [usize; 2]| (n - 1) * s + count.saturating_sub(1) * t + 1;
        let f = noise::<f64>(length(from), seed);
        // The gaps of an output must stay as they are.
        const UNTOUCHED: f64 = 1234.5;
        let mut out = vec![UNTOUCHED; length(to)];
        let view = Strided::new(&f[..], [n, count], from).unwrap();
        rows.apply_strided(view, Strided::new(&mut out[..], [n, count], to).unwrap()).unwrap();
        each_alone(&rows, count, |q, i| f[q * from[0] + i * from[1]], |p, i| out[p * to[0] + i * to[1]]);
        let untouched = out.iter().filter(|&&out| out == UNTOUCHED).count();
        prop_assert_eq!(untouched, out.len() - n * count);
    });
}

#[test]
fn a_value_that_is_not_finite_is_named_with_particle_and_field_and_nothing_is_written() {
    let rows = rows::<f64>();
    let n = rows.targets();
    let mut f = vec![1.0; 3 * n];
    // Particle 11 comes before particle 20, whatever the order of the fields.
    (f[20], f[2 * n + 11], f[n + 11]) = (f64::NAN, f64::INFINITY, f64::NEG_INFINITY);
    let mut out = vec![7.0; 3 * n];
    let view = Strided::stacked(&f[..], 3).unwrap();
    let error = rows.apply_strided(view, Strided::interleaved(&mut out[..], 3).unwrap()).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Apply(ApplyError::FieldOf { field: 1, value: f64::NEG_INFINITY }));
    assert_eq!((error.particle(), out.iter().all(|&out| out == 7.0)), (Some(11), true));

    let mut f = vec![[0.0; 2]; n];
    f[4][1] = f64::MAX;
    let error = rows.apply_fields(&f, &mut vec![[0.0; 2]; n]).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Apply(ApplyError::OverflowOf { field: 1, .. })));
    assert!(error.particle().is_some());
}

#[test]
fn views_that_do_not_fit_are_refused() {
    let kind = |error: Error| error.kind().clone();
    let strides = |strides, places| {
        let view = Strided::new(&[0.0; 12][..places], [3, 2], strides);
        view.map_err(kind).map(|_| ()).map_err(|kind| {
            assert_eq!(kind, ErrorKind::Apply(ApplyError::Strides { particles: 3, fields: 2, strides, places }));
        })
    };
    assert_eq!(strides([1, 3], 6), Ok(()));
    assert_eq!(strides([2, 1], 6), Ok(()));
    assert_eq!(strides([2, 5], 10), Ok(()));
    for (shared, places) in [([1, 2], 12), ([0, 3], 12), ([1, 0], 12), ([2, 2], 12), ([1, 3], 5), ([5, 1], 11)] {
        assert_eq!(strides(shared, places), Err(()), "{shared:?}");
    }
    assert_eq!(strides([usize::MAX, 1], 12), Err(()));
    assert!(Strided::stacked(&[0.0; 7][..], 2).is_err() && Strided::interleaved(&[0.0; 7][..], 0).is_err());

    let rows = rows::<f64>();
    let n = rows.targets();
    let (f, mut out) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
    let pair = || Strided::stacked(&f[..], 2).unwrap();
    let error = rows.apply_strided(pair(), Strided::stacked(&mut out[..n], 1).unwrap()).map_err(kind);
    assert_eq!(error, Err(ErrorKind::Apply(ApplyError::Fields { found: 1, needed: 2 })));
    let error = rows.apply_strided(pair(), Strided::stacked(&mut out[2..], 2).unwrap()).map_err(kind);
    assert_eq!(error, Err(ErrorKind::Apply(ApplyError::Output { found: n - 1, needed: n })));
    let error = rows.apply_strided(Strided::stacked(&f[2..], 2).unwrap(), Strided::stacked(&mut out[..], 2).unwrap());
    assert_eq!(error.map_err(kind), Err(ErrorKind::Apply(ApplyError::Input { found: n - 1, needed: n })));
}

#[test]
fn pse_rows_take_fields_too() -> Failure {
    let lattice = Particles::lattice([0.0], [1.0], [32])?;
    let pse = Pse::new(Laplacian::<1>, 2, lattice.spacing()?.epsilon(2.0)?, lattice.volumes()?)?;
    interleaved::<f64, 4>(&pse.assemble(&CellList::build(
        &lattice,
        &Domain::periodic([0.0], [1.0])?,
        pse.cutoff(),
    )?)?);
    Ok(())
}

#[test]
fn strides_of_nothing_lead_nowhere() {
    let particles = Particles::<2>::new(Vec::new()).unwrap();
    let neighbors = parops::BruteForce::build(&particles, &Domain::open(), Cutoff(0.3)).unwrap();
    let rows = DcPse::<Laplacian<2>, 2>::new().assemble(&neighbors).unwrap();
    let (f, mut out): ([f64; 0], [f64; 0]) = ([], []);
    for fields in [16, usize::MAX] {
        let shape = ([0, fields], [1, usize::MAX]);
        let (f, out) = (Strided::new(&f[..], shape.0, shape.1), Strided::new(&mut out[..], shape.0, shape.1));
        rows.apply_strided(f.unwrap(), out.unwrap()).unwrap();
    }
}
