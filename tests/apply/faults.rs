//! Bad inputs that reach operators, their application and time: each its own typed error, and nothing changed.

use std::panic::{AssertUnwindSafe, catch_unwind};

use parops::{
    Allowance, Apply, ApplyError, BruteForce, CellList, Cutoff, D2, Domain, Draft, Epsilon, Error, ErrorKind, Euler,
    Expression, Gaussian, Gradient, Kernel, KernelError, Laplacian, MatrixFree, Method, MultiIndex, MultiIndexError,
    Neighbor, NeighborError, NeighborList, Neighbors, OperatorError, ParticleError, Particles, Plan, Policy, Pse,
    Result, Rk4, RowReport, Rows, Sign, Sph, SphForm, Stencil, StepLimit, Stepper, Term, TimeError, Volumes, integrate,
    testing::Promise,
};

fn torus() -> Domain<2> {
    Domain::periodic([0.0; 2], [1.0; 2]).unwrap()
}

fn laplacian(epsilon: f64, volumes: &Volumes) -> Pse<parops::Exchange<2>> {
    Pse::new(Laplacian::<2>, 2, Epsilon::global(epsilon).unwrap(), volumes).unwrap()
}

/// Builds over the points by both ways and returns the one error both give; checks that the set is as it was.
fn refused(points: Vec<[f64; 2]>, epsilon: f64, volume: f64) -> Error {
    let particles = Particles::new(points).unwrap().with_volumes(Volumes::equal(volume).unwrap()).unwrap();
    let (before, generation) = (particles.clone(), particles.generation());
    let pse = laplacian(epsilon, particles.volumes().unwrap());
    let neighbors = CellList::build(&particles, &Domain::open(), pse.cutoff()).unwrap();
    let error = pse.assemble(&neighbors).unwrap_err();
    assert_eq!(pse.matrix_free(&neighbors).err(), Some(error.clone()));
    assert_eq!((particles.points(), particles.generation()), (before.points(), generation));
    assert_eq!(particles.volumes(), before.volumes());
    // With leave the same rows exist and apply to finite numbers.
    let allowed = pse.allow(Allowance::Everywhere).assemble(&neighbors).unwrap();
    let mut out = vec![f64::NAN; particles.len()];
    allowed.apply(&vec![1.5; particles.len()], &mut out).unwrap();
    assert!(out.iter().all(|&x| x == 0.0));
    error
}

fn input(text: &'static str) -> Promise {
    Promise::new("Input", text)
}

fn is_moment(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Operator(OperatorError::Moment { defect, limit }) if defect > limit)
}

#[test]
fn degenerate_sets_are_refused_by_their_moments_and_never_panic() {
    let h = 0.05;
    let lattice = |i: usize| [(i % 20) as f64 * h, (i / 20) as f64 * h];
    let mut coincident: Vec<_> = (0..400).map(lattice).collect();
    coincident[7] = coincident[200];
    let one_line = (0..100).map(|i| [f64::from(i) * h, 0.3]).collect();
    let shared: Vec<_> = (0..100).map(|i| [0.5, f64::from(i * i % 101) * h]).collect();
    for (name, points) in [
        ("one", vec![[0.5, 0.5]]),
        ("two coincident", vec![[0.5, 0.5]; 2]),
        ("all coincident", vec![[0.25, 0.5]; 50]),
        ("a pair at 1e-300", vec![[0.0, 0.0], [1e-300, 0.0], [0.0, 0.1]]),
        ("two on one place in a lattice", coincident),
        ("collinear", one_line),
        ("one coordinate shared", shared),
        ("two sets far apart", vec![[0.0, 0.0], [0.05, 0.0], [1e12, 0.0], [1e12, 0.05]]),
    ] {
        let error = refused(points, 2.0 * h, h * h);
        input("coincident, collinear and scattered sets are refused by their moments, with a particle")
            .case(format!("{name}: {error}"))
            .holds(is_moment(&error) && error.particle().is_some());
    }
}

#[test]
fn coplanar_particles_are_refused_in_three_dimensions() -> Result<()> {
    let h = 0.1;
    let plane = (0..100).map(|i| [f64::from(i % 10) * h, f64::from(i / 10) * h, 0.5]).collect();
    let particles = Particles::new(plane)?.with_volumes(Volumes::equal(h * h * h)?)?;
    let pse = Pse::new(Laplacian::<3>, 2, Epsilon::global(2.0 * h)?, particles.volumes()?)?;
    let error = pse.assemble(&CellList::build(&particles, &Domain::open(), pse.cutoff())?).unwrap_err();
    // No second moment across the plane: the defect is all of it, or more along the plane.
    assert!(matches!(*error.kind(), ErrorKind::Operator(OperatorError::Moment { defect, .. }) if defect > 0.5));
    Ok(())
}

#[test]
fn kernel_narrower_than_the_gaps_or_wider_than_its_cutoff_is_refused() -> Result<()> {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let h = 1.0 / 16.0;
    // epsilon far below the spacing: every weight underflows, which the overlap tells.
    let narrow = laplacian(0.01 * h, particles.volumes()?);
    let error = narrow.assemble(&CellList::build(&particles, &torus(), narrow.cutoff())?).unwrap_err();
    assert!(matches!(*error.kind(), ErrorKind::Operator(OperatorError::Overlap { h_over_epsilon, .. })
        if (h_over_epsilon - 100.0).abs() < 1e-9));
    // A cutoff of one epsilon: the kernel is flat over the stencil and most of its moments is lost.
    let flat = laplacian(2.0 * h, particles.volumes()?).support(1.0)?;
    let error = flat.assemble(&CellList::build(&particles, &torus(), flat.cutoff())?).unwrap_err();
    assert!(is_moment(&error));
    Ok(())
}

#[test]
fn illegal_numbers_are_refused_at_the_door() {
    let refused = || input("illegal epsilon, volumes, orders and signs give errors with particle and numbers");
    for bad in [0.0, -1.0, f64::INFINITY] {
        refused().equal(&Epsilon::global(bad).unwrap_err(), &Error::from(ParticleError::Epsilon { epsilon: bad }));
        let each = Epsilon::each(vec![1.0, bad]).unwrap_err();
        refused().equal(&each, &Error::from(ParticleError::Epsilon { epsilon: bad }).at(1));
        let volumes = Volumes::each(vec![1.0, 1.0, bad]).unwrap_err();
        refused().equal(&volumes, &Error::from(ParticleError::Volume { volume: bad }).at(2));
    }
    assert!(Epsilon::global(f64::NAN).is_err() && Volumes::equal(f64::NAN).is_err());
    let (epsilon, volumes) = (Epsilon::global(0.1).unwrap(), Volumes::equal(0.01).unwrap());
    for order in [0, 1, 3, 10] {
        let error = Pse::new(Laplacian::<2>, order, epsilon.clone(), &volumes).unwrap_err();
        refused().equal(error.kind(), &ErrorKind::Kernel(KernelError::Order { order }));
    }
    let high = Expression::new([(MultiIndex::new([255, 255]), 1.0)]).unwrap();
    let error = Pse::new(high, 8, epsilon.clone(), &volumes).unwrap_err();
    assert!(matches!(
        error.kind(),
        ErrorKind::Kernel(KernelError::Overflow { .. }) | ErrorKind::MultiIndex(MultiIndexError::Degree { .. })
    ));
    let even = laplacian(0.1, &volumes).sign(Sign::Plus).unwrap_err();
    refused().equal(even.kind(), &ErrorKind::Operator(OperatorError::PlusEven { degree: 2 }));
    let bare = Particles::new(vec![[0.0, 0.0]; 3]).unwrap();
    refused().equal(&bare.volumes().unwrap_err(), &Error::from(ParticleError::NoVolumes { count: 3 }));
}

#[test]
fn lists_of_the_user_s_own_are_refused_before_an_operator_sees_them() {
    let row = |neighbors: &[Neighbor<2>]| {
        let offsets = [0, neighbors.len(), neighbors.len(), neighbors.len()];
        NeighborList::from_rows(3, &[Some(0), Some(1), Some(2)], &offsets, neighbors, Cutoff(1.0), 7).unwrap_err()
    };
    let near = Neighbor { q: 1, separation: [0.5, 0.0], sign: 1 };
    let due = [
        (vec![Neighbor { q: 0, separation: [0.0, 0.0], sign: 1 }], NeighborError::OwnCenter { q: 0 }),
        (vec![near, near], NeighborError::Repeated { q: 1 }),
        (
            vec![Neighbor { separation: [0.0, f64::INFINITY], ..near }],
            NeighborError::Separation { q: 1, axis: 1, separation: f64::INFINITY },
        ),
        (vec![Neighbor { q: 3, ..near }], NeighborError::Source { q: 3, sources: 3 }),
        (vec![Neighbor { sign: 0, ..near }], NeighborError::Sign { q: 1, sign: 0 }),
    ];
    for (neighbors, due) in due {
        input("faulty lists of neighbors give errors with target and numbers")
            .equal(&row(&neighbors), &Error::from(due).at(0));
    }
    let nan = row(&[Neighbor { separation: [f64::NAN, 0.0], ..near }]);
    assert!(
        matches!(*nan.kind(), ErrorKind::Neighbor(NeighborError::Separation { separation, .. }) if separation.is_nan())
    );
}

/// Rows over a small torus, with the set and the field of ones they act on.
fn rows() -> (Particles<2>, Rows, CellList<2>, Pse<parops::Exchange<2>>) {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [16; 2]).unwrap();
    let pse = laplacian(0.096, particles.volumes().unwrap()).support(5.0).unwrap();
    let neighbors = CellList::build(&particles, &torus(), pse.cutoff()).unwrap();
    (particles, pse.assemble(&neighbors).unwrap(), neighbors, pse)
}

#[test]
fn wrong_lengths_and_fields_that_are_no_numbers_change_nothing() {
    let (_, stored, neighbors, pse) = rows();
    let free = pse.matrix_free(&neighbors).unwrap();
    let operators: [&dyn Apply<f64>; 2] = [&stored, &free];
    for operator in operators {
        let field = vec![1.0; 256];
        for (f, n, due) in [
            (&field[..255], 256, ApplyError::Input { found: 255, needed: 256 }),
            (&field[..], 257, ApplyError::Output { found: 257, needed: 256 }),
            (&[], 256, ApplyError::Input { found: 0, needed: 256 }),
        ] {
            let mut out = vec![42.0; n];
            assert_eq!(operator.apply(f, &mut out).unwrap_err(), Error::from(due));
            input("refused applications write nothing").holds(out.iter().all(|&x| x == 42.0));
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            // Two bad values: the first is named, and its neighbors are not.
            let mut f = field.clone();
            (f[200], f[33]) = (bad, bad);
            let mut out = vec![42.0; 256];
            let error = operator.apply(&f, &mut out).unwrap_err();
            assert_eq!(error.particle(), Some(33));
            assert!(
                matches!(*error.kind(), ErrorKind::Apply(ApplyError::Field { value }) if value.to_bits() == bad.to_bits())
            );
            input("refused applications write nothing").holds(out.iter().all(|&x| x == 42.0));
        }
    }
}

#[test]
fn vector_applications_check_every_slice() {
    let (particles, _, neighbors, _) = rows();
    let gradient = Pse::new(Gradient::<2>, 2, Epsilon::global(0.096).unwrap(), particles.volumes().unwrap()).unwrap();
    let rows = gradient.support(5.0).unwrap().assemble(&neighbors).unwrap();
    let (f, v) = (vec![1.0; 256], vec![[1.0; 2]; 256]);
    let mut bad = v.clone();
    bad[9] = [0.0, f64::NAN];
    let (mut out, mut outs) = (vec![42.0; 256], vec![[42.0; 2]; 256]);
    let kind = |result: Result<()>| result.unwrap_err().kind().clone();
    assert_eq!(
        kind(rows.apply_all(&f[1..], &mut outs)),
        ErrorKind::Apply(ApplyError::Input { found: 255, needed: 256 })
    );
    assert_eq!(
        kind(rows.apply_all(&f, &mut outs[1..])),
        ErrorKind::Apply(ApplyError::Output { found: 255, needed: 256 })
    );
    assert_eq!(
        kind(rows.apply_dot(&v[2..], &mut out)),
        ErrorKind::Apply(ApplyError::Input { found: 254, needed: 256 })
    );
    assert_eq!(rows.apply_dot(&bad, &mut out).unwrap_err().particle(), Some(9));
    assert_eq!(rows.apply_along(&bad, &f, &mut out).unwrap_err().particle(), Some(9));
    assert!(rows.apply_along(&v[3..], &f, &mut out).is_err());
    assert!(out.iter().all(|&x| x == 42.0) && outs.iter().all(|&x| x == [42.0; 2]));
}

#[test]
fn results_that_overflow_are_errors_and_not_numbers_that_are_none() {
    let (_, stored, neighbors, pse) = rows();
    let free = pse.matrix_free(&neighbors).unwrap();
    // Differences of +-1e308 overflow, and infinities of both signs make NaN.
    let f: Vec<f64> = (0..256).map(|p| if p % 2 == 0 { 1e308 } else { -1e308 }).collect();
    let operators: [&dyn Apply<f64>; 2] = [&stored, &free];
    for operator in operators {
        let error = operator.apply(&f, &mut vec![0.0; 256]).unwrap_err();
        assert_eq!(error.particle(), Some(0));
        assert!(matches!(*error.kind(), ErrorKind::Apply(ApplyError::Overflow { value }) if !value.is_finite()));
    }
}

#[test]
fn weights_beyond_f32_are_refused_where_they_are_rounded() -> Result<()> {
    // epsilon^-2 = 2.5e39 at h = 1e-20 is a number in f64 only.
    let h = 1e-20;
    let points = (0..30).map(|p| [f64::from(p) * h]).collect();
    let particles = Particles::new(points)?.with_volumes(Volumes::equal(h)?)?;
    let pse =
        Pse::new(Laplacian::<1>, 2, Epsilon::global(2.0 * h)?, particles.volumes()?)?.allow(Allowance::Everywhere);
    let neighbors = BruteForce::build(&particles, &Domain::open(), pse.cutoff())?;
    assert!(pse.assemble(&neighbors).is_ok());
    let error = Rows::<[f64; 1], f32>::assemble(&pse, &neighbors).unwrap_err();
    assert_eq!(error.particle(), Some(0));
    assert!(matches!(*error.kind(), ErrorKind::Operator(OperatorError::Weight { weight: f64::INFINITY, .. })));
    // Without stored weights the same shows in the result.
    let f: Vec<f32> = (0..30_u8).map(f32::from).collect();
    let error = pse.matrix_free(&neighbors)?.apply(&f, &mut [0.0_f32; 30]).unwrap_err();
    assert!(matches!(*error.kind(), ErrorKind::Apply(ApplyError::Overflow { .. })));
    Ok(())
}

#[test]
fn own_term_of_a_sum_that_overflows_is_refused() -> Result<()> {
    // V epsilon^-2 W(0) = 1e300 * 1e20 is no number, and there is no neighbor whose weight could tell.
    let particles = Particles::new(vec![[0.0, 0.0]])?.with_volumes(Volumes::equal(1e300)?)?;
    let sph = Sph::new(D2::<0, 0>::default(), Gaussian::<2>::new(), Epsilon::global(1e-10)?, particles.volumes()?)?
        .allow(Allowance::Everywhere);
    let error = sph.assemble(&BruteForce::build(&particles, &Domain::open(), sph.cutoff())?).unwrap_err();
    assert_eq!(error, Error::from(OperatorError::Weight { q: 0, weight: f64::INFINITY }).at(0));
    Ok(())
}

#[test]
fn rows_of_another_generation_are_told_from_their_own() -> Result<()> {
    let (mut particles, rows, ..) = rows();
    let built_for = particles.generation();
    assert_eq!(rows.validate(built_for), Ok(()));
    let points = particles.points().to_vec();
    particles.set_points(&points)?;
    let stale = ApplyError::Stale { rows: built_for, set: particles.generation() };
    assert_eq!(rows.validate(particles.generation()), Err(Error::from(stale)));
    Ok(())
}

#[test]
fn crowds_that_break_a_limit_are_refused_before_all_of_them_are_looked_at() -> Result<()> {
    // 1e10 pairs would take minutes.
    let crowd = Particles::new(vec![[0.5; 2]; 100_000])?;
    let pse = laplacian(0.05, &Volumes::equal(1e-4)?);
    let cells = CellList::build(&crowd, &Domain::open(), pse.cutoff())?;
    let error = pse.assemble(&cells).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::Moment { .. })), "{error}");
    assert_eq!((error.particle(), pse.matrix_free(&cells).err()), (Some(0), Some(error)));
    Ok(())
}

#[test]
fn excluded_neighbors_are_skipped_and_never_multiplied_by_zero() -> Result<()> {
    // Sources 1 and 2 are beyond the cutoff of the method though the list holds them; a term of theirs would be
    // 0 * 1e308 * 1e308, and with the moments z^alpha 0 * infinity.
    let far = |q, x| Neighbor { q, separation: [x, 0.0], sign: 1 };
    let list =
        NeighborList::from_rows(4, &[Some(0)], &[0, 3], &[far(1, 1e58), far(2, -1e59), far(3, 0.01)], Cutoff(1e60), 0)?;
    let pse = laplacian(0.05, &Volumes::equal(1e-4)?).allow(Allowance::Everywhere);
    let rows = pse.assemble(&list)?;
    assert_eq!(rows.row(0).unwrap().sources, [3]);
    let mut out = [f64::NAN];
    rows.apply(&[1.0, 1e308, -1e308, 2.0], &mut out)?;
    assert!(out[0].is_finite() && rows.report().moment_defect.is_finite());
    // Within the cutoff of the method, where the kernel underflows and z^2 = (1e58 / 1e-150)^2 overflows.
    let pse = laplacian(1e-150, &Volumes::equal(1e-300)?).support(1e210)?.allow(Allowance::Everywhere);
    let rows = pse.assemble(&list)?;
    assert_eq!(rows.row(0).unwrap().sources.len(), 3);
    assert_eq!(rows.report().moment_defect, 1.0);
    Ok(())
}

/// A provider that breaks its word.
struct Liar {
    sources: usize,
    counted: usize,
    center: usize,
}

impl Neighbors<2> for Liar {
    fn targets(&self) -> usize {
        2
    }
    fn sources(&self) -> usize {
        self.sources
    }
    fn center(&self, _: usize) -> Option<usize> {
        Some(self.center)
    }
    fn cutoff(&self, _: usize) -> f64 {
        1.0
    }
    fn reach(&self) -> f64 {
        1.0
    }
    fn generation(&self) -> u64 {
        0
    }
    fn for_each(&self, _: usize, _: f64, mut visit: impl FnMut(Neighbor<2>)) {
        for q in 1..4 {
            visit(Neighbor { q, separation: [0.01 * q as f64, 0.0], sign: 1 });
        }
    }
    fn count(&self, _: usize, _: f64) -> usize {
        self.counted
    }
}

#[test]
fn providers_that_break_their_word_are_refused_and_never_panic() -> Result<()> {
    let pse = laplacian(0.05, &Volumes::equal(1e-4)?).allow(Allowance::Everywhere);
    let kind = |liar: &Liar| pse.assemble(liar).unwrap_err().kind().clone();
    let unknown = Liar { sources: 3, counted: 3, center: 0 };
    assert_eq!(kind(&unknown), ErrorKind::Neighbor(NeighborError::Source { q: 3, sources: 3 }));
    assert!(pse.matrix_free(&unknown).is_err());
    for counted in [0, 2, 4] {
        let miscounted = Liar { sources: 4, counted, center: 0 };
        assert!(matches!(kind(&miscounted), ErrorKind::Neighbor(NeighborError::Offsets { row: 0, .. })));
    }
    let off_center = Liar { sources: 4, counted: 3, center: 9 };
    assert_eq!(kind(&off_center), ErrorKind::Neighbor(NeighborError::Source { q: 9, sources: 4 }));
    assert!(pse.matrix_free(&off_center).is_err());
    Ok(())
}

/// A method that writes what it is told and knows its defect as NaN.
struct Careless(f64);

impl Method<2> for Careless {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }
    fn weights(&self, _: &Stencil<2>, _: &mut (), w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        *diagonal = [0.0];
        w.fill([self.0]);
        Ok(())
    }
    fn report(&self, row: &Stencil<2>, _: &(), w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        let mut report = RowReport::of(row, w, diagonal);
        (report.moment_defect, report.condition, report.residual) = (f64::NAN, f64::NAN, f64::NAN);
        Ok(report)
    }
}

#[test]
fn weights_of_a_foreign_method_that_are_no_numbers_are_refused_and_unknown_defects_show() -> Result<()> {
    let (particles, _, neighbors, _) = rows();
    for bad in [f64::NAN, f64::NEG_INFINITY] {
        let stored = Rows::<[f64; 1]>::assemble(&Careless(bad), &neighbors).unwrap_err();
        let free = MatrixFree::new(&Careless(bad), &neighbors).err().unwrap();
        for error in [stored, free] {
            assert_eq!(error.particle(), Some(0));
            assert!(
                matches!(*error.kind(), ErrorKind::Operator(OperatorError::Weight { weight, .. }) if weight.to_bits() == bad.to_bits())
            );
        }
    }
    let rows = Rows::<[f64; 1]>::assemble(&Careless(1.0), &neighbors)?;
    assert!(rows.report().moment_defect.is_nan(), "a defect nobody knows is not the best of all");
    assert!(rows.report().condition.is_nan() && rows.report().residual.is_nan());
    assert_eq!(rows.report().worst().map(|worst| worst.target), Some(0));
    assert_eq!(rows.targets(), particles.len());
    Ok(())
}

/// A provider that gathers rows of another target, or counts beyond all bounds.
struct Astray<'a> {
    cells: &'a CellList<2>,
    shift: usize,
    counted: Option<usize>,
    targets: usize,
}

impl Neighbors<2> for Astray<'_> {
    fn targets(&self) -> usize {
        self.targets
    }
    fn sources(&self) -> usize {
        self.cells.sources()
    }
    fn center(&self, p: usize) -> Option<usize> {
        self.cells.center(p)
    }
    fn cutoff(&self, p: usize) -> f64 {
        self.cells.cutoff(p)
    }
    fn reach(&self) -> f64 {
        self.cells.reach()
    }
    fn generation(&self) -> u64 {
        0
    }
    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<2>)) {
        self.cells.for_each(p, cutoff, visit);
    }
    fn gather(&self, p: usize, cutoff: f64, row: &mut Stencil<2>) {
        row.reset(p + self.shift, self.center(p), cutoff);
        self.for_each(p, cutoff, |neighbor| row.push(neighbor));
    }
    fn count(&self, p: usize, cutoff: f64) -> usize {
        self.counted.unwrap_or_else(|| self.cells.count(p, cutoff))
    }
}

#[test]
fn providers_that_lead_astray_are_refused_and_never_panic() -> Result<()> {
    let (particles, _, neighbors, _) = rows();
    let fair = Astray { cells: &neighbors, shift: 0, counted: None, targets: particles.len() };
    assert!(Rows::<[f64; 1]>::assemble(&Careless(1.0), &fair).is_ok());
    for shift in [1, 1000] {
        let astray = Astray { shift, ..fair };
        let stored = Rows::<[f64; 1]>::assemble(&Careless(1.0), &astray).unwrap_err();
        assert_eq!(stored, Error::new(NeighborError::Misnamed { found: shift }).at(0));
        assert_eq!(MatrixFree::new(&Careless(1.0), &astray).err(), Some(stored));
    }
    let endless = [Astray { counted: Some(usize::MAX / 2), ..fair }, Astray { targets: usize::MAX, ..fair }];
    for astray in endless {
        let error = Rows::<[f64; 1]>::assemble(&Careless(1.0), &astray).unwrap_err();
        assert_eq!(*error.kind(), ErrorKind::Particle(ParticleError::Memory { count: usize::MAX }));
    }
    Ok(())
}

/// A method that leaves its drafts in disorder.
struct Untidy(fn(&mut Draft<2, [f64; 1]>));

impl Method<2> for Untidy {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }
    fn weights(&self, row: &Stencil<2>, _: &mut (), w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        Careless(1.0).weights(row, &mut (), w, diagonal)
    }
    fn report(&self, row: &Stencil<2>, _: &(), w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        Careless(1.0).report(row, &(), w, diagonal)
    }
    fn weights_batch(&self, drafts: &mut [Draft<2, [f64; 1]>], scratch: &mut ()) {
        Careless(1.0).weights_batch(drafts, scratch);
        drafts.iter_mut().for_each(|draft| self.0(draft));
    }
}

fn widened(draft: &mut Draft<2, [f64; 1]>) {
    if let Ok(report) = &mut draft.report {
        report.grown = 1;
    }
}

#[test]
fn methods_that_leave_disorder_are_refused_and_never_panic() {
    let (.., neighbors, _) = rows();
    assert_eq!(neighbors.sources(), 256, "the index below names none");
    let untidy: [fn(&mut Draft<2, [f64; 1]>); 6] = [
        |draft| draft.weights.truncate(1),
        |draft| draft.weights.push([1.0]),
        |draft| draft.stencil.reset(100_000, None, 1.0),
        |draft| {
            widened(draft);
            draft.stencil.reset(1, Some(1), 1.0);
            draft.weights.clear();
        },
        |draft| {
            widened(draft);
            draft.stencil.reset(draft.stencil.target(), None, 1.0);
        },
        |draft| {
            widened(draft);
            draft.stencil.push(Neighbor { q: 256, separation: [0.0; 2], sign: 1 });
            draft.weights.push([1.0]);
        },
    ];
    for (i, untidy) in untidy.into_iter().enumerate() {
        let stored = Rows::<[f64; 1]>::assemble(&Untidy(untidy), &neighbors).unwrap_err();
        assert_eq!(MatrixFree::new(&Untidy(untidy), &neighbors).err(), Some(stored.clone()));
        assert_eq!(stored.particle(), Some(0));
        match *stored.kind() {
            ErrorKind::Operator(OperatorError::Draft { .. }) => assert!(i < 5),
            ErrorKind::Neighbor(NeighborError::Source { q: 256, sources: 256 }) => assert_eq!(i, 5),
            ref other => panic!("{i}: {other}"),
        }
    }
}

/// A kernel whose support, terms or values are none.
struct Odd {
    terms: Vec<Term<2>>,
    support: f64,
    value: f64,
}

impl Kernel<f64, 2> for Odd {
    fn value(&self, _: &[f64; 2]) -> f64 {
        self.value
    }
    fn terms(&self) -> &[Term<2>] {
        &self.terms
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        self.support
    }
    fn overlap_limit(&self) -> f64 {
        1.0
    }
}

#[test]
fn kernels_of_the_user_s_own_that_are_none_are_refused() -> Result<()> {
    let second = vec![Term { index: MultiIndex::new([2, 0]), factor: 1.0 }];
    let (epsilon, volumes) = (Epsilon::global(0.096)?, Volumes::equal(1.0 / 256.0)?);
    let make = |terms: &[Term<2>], support, value| {
        let kernel = Odd { terms: terms.to_vec(), support, value };
        Pse::with_kernels([kernel], epsilon.clone(), &volumes).map(|pse| pse.allow(Allowance::Everywhere))
    };
    let kind = |made: Result<_>| made.map(|_: Pse<Odd>| ()).unwrap_err().kind().clone();
    assert_eq!(kind(make(&[], 5.0, 1.0)), ErrorKind::MultiIndex(MultiIndexError::Empty { output: 0 }));
    for support in [0.0, -1.0, f64::INFINITY] {
        let due = OperatorError::Setting { value: support };
        assert_eq!(kind(make(&second, support, 1.0)), ErrorKind::Operator(due));
    }
    assert!(make(&second, f64::NAN, 1.0).is_err());
    let (_, _, neighbors, _) = rows();
    let nan = make(&second, 5.0, f64::NAN)?.assemble(&neighbors).unwrap_err();
    assert!(matches!(*nan.kind(), ErrorKind::Operator(OperatorError::Weight { weight, .. }) if weight.is_nan()));
    assert_eq!(nan.particle(), Some(0));
    Ok(())
}

#[test]
fn points_off_the_particles_are_refused_a_difference_by_pse_and_sph() -> Result<()> {
    let (particles, _, _, pse) = rows();
    let between = CellList::build_at(&[[0.5, 0.47]], &particles, &torus(), pse.cutoff())?;
    let sph = Sph::new(D2::<1, 0>::default(), Gaussian::<2>::new(), Epsilon::global(0.096)?, particles.volumes()?)?
        .support(5.0)?
        .form(SphForm::Difference)?;
    for error in [pse.assemble(&between).unwrap_err(), sph.assemble(&between).unwrap_err()] {
        assert_eq!(error.particle(), Some(0));
        assert!(matches!(error.kind(), ErrorKind::Operator(OperatorError::NoCenter { .. })));
    }
    Ok(())
}

type Field = Vec<f64>;

fn steppers() -> [Box<dyn Stepper<Field>>; 2] {
    [Box::new(Euler::new()), Box::new(Rk4::new())]
}

#[test]
fn illegal_steps_and_right_hand_sides_leave_state_and_operator_as_they_were() {
    let (_, rows, ..) = rows();
    let (kept, start): (Rows, Field) = (rows.clone(), (0..256).map(|p| f64::from(p) / 256.0).collect());
    for mut stepper in steppers() {
        let mut u = start.clone();
        let mut diffuse = |_: f64, u: &Field, du: &mut Field| rows.apply(u, du);
        for dt in [0.0, -1e-3, f64::INFINITY] {
            let error = stepper.step(0.0, dt, &mut u, &mut diffuse).unwrap_err();
            assert_eq!(error, Error::from(TimeError::Step { dt }));
        }
        assert!(stepper.step(0.0, f64::NAN, &mut u, &mut diffuse).is_err());
        let error = stepper.step(1e6, 1e-12, &mut u, &mut diffuse).unwrap_err();
        assert_eq!(error, Error::from(TimeError::NoProgress { t: 1e6, dt: 1e-12 }));

        // A source that turns NaN is reported with particle, stage and time; the operator names a NaN it is given.
        let mut source = |t: f64, _: &Field, du: &mut Field| {
            du.fill(0.0);
            du[17] = if t >= 0.5 { f64::NAN } else { 0.0 };
            Ok(())
        };
        let error = stepper.step(0.5, 1e-3, &mut u, &mut source).unwrap_err();
        assert_eq!(error, Error::from(TimeError::NotFinite { stage: 1, t: 0.5 }).at(17));
        let mut short = |_: f64, u: &Field, du: &mut Field| rows.apply(&u[1..], du);
        let error = stepper.step(0.0, 1e-3, &mut u, &mut short).unwrap_err();
        assert_eq!(error, Error::from(ApplyError::Input { found: 255, needed: 256 }));

        // A panic passes through, and the stepper serves again as if it had not happened.
        let mut panics =
            |_: f64, _: &Field, _: &mut Field| -> Result<()> { std::panic::resume_unwind(Box::new("mine")) };
        let caught = catch_unwind(AssertUnwindSafe(|| stepper.step(0.0, 1e-3, &mut u, &mut panics)));
        assert!(caught.is_err());
        input("refused and panicking steps leave state and rows").equal(&(&u, &rows), &(&start, &kept));
        let mut fresh = start.clone();
        stepper.step(0.0, 1e-4, &mut u, &mut diffuse).unwrap();
        stepper.reset();
        stepper.step(0.0, 1e-4, &mut fresh, &mut diffuse).unwrap();
        assert_eq!(u, fresh);
    }
}

#[test]
fn step_above_the_limit_is_refused_before_the_first_evaluation_unless_allowed() -> Result<()> {
    let (_, rows, ..) = rows();
    let limit = StepLimit::from_spectral_bound(rows.report().spectral_bound, 1.0)?;
    for mut stepper in steppers() {
        let largest = limit.step(&stepper);
        let plan = Plan::new(0.0, 20.0 * largest, 1.1 * largest)?.limit(limit);
        let start: Field = (0..256).map(|p| f64::from(p % 2)).collect();
        let (mut u, mut calls) = (start.clone(), 0);
        let mut rhs = |_: f64, u: &Field, du: &mut Field| {
            calls += 1;
            rows.apply(u, du)
        };
        let error = integrate(&mut stepper, &mut u, &plan, &mut rhs, |_, _, _| {}).unwrap_err();
        assert_eq!(*error.kind(), ErrorKind::Time(TimeError::Limit { dt: plan.dt(), limit: largest }));
        input("a step above the limit is refused before the first evaluation").equal(&u, &start);
        let run = integrate(&mut stepper, &mut u, &plan.policy(Policy::Allow), &mut rhs, |_, _, _| {})?;
        assert!(!run.within_limit && calls > 0);
    }
    Ok(())
}
