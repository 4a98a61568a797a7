//! Errors carry a kind, the particle concerned and the numbers; their text shows all three.

use parops::{
    ApplyError, CellList, Cutoff, DcPse, Domain, DomainError, Epsilon, Error, ErrorKind, KernelError, Laplacian,
    MultiIndexError, NeighborError, OperatorError, ParticleError, Particles, Result, Side, Spacing, TimeError,
    Upstream, UpwindDcPse, Volumes,
};

/// One kind of every layer, with numbers that its sentence must show.
fn one_of_each() -> Vec<(ErrorKind, &'static [&'static str])> {
    vec![
        (MultiIndexError::UnequalDegree { first: 2, other: 7 }.into(), &["2", "7"]),
        (MultiIndexError::Count { dim: 31, degree: 41, order: 59 }.into(), &["31", "41", "59"]),
        (KernelError::Regularity { kernel: "Spline", degree: 4, limit: 3 }.into(), &["Spline", "4", "3"]),
        (DomainError::Faces { axis: 1, lower: 0.75, upper: -0.25 }.into(), &["axis 1", "0.75", "-0.25"]),
        (ParticleError::Coordinate { axis: 2, coordinate: f64::NAN }.into(), &["axis 2", "NaN"]),
        (NeighborError::Reach { cutoff: 0.5, reach: 0.375 }.into(), &["0.5", "0.375"]),
        (OperatorError::Overlap { h_over_epsilon: 1.25, limit: 0.9 }.into(), &["1.25", "0.9"]),
        (ApplyError::Input { found: 12, needed: 34 }.into(), &["12", "34"]),
        (TimeError::Limit { dt: 0.125, limit: 0.0625 }.into(), &["0.125", "0.0625"]),
        (ErrorKind::User { code: -17 }, &["-17"]),
    ]
}

#[test]
fn text_shows_the_numbers_and_the_particle_if_there_is_one() {
    for (kind, numbers) in one_of_each() {
        let error = Error::new(kind.clone());
        let text = error.to_string();
        for number in numbers {
            assert!(text.contains(number), "{text:?} lacks {number}");
        }
        assert_eq!(error.particle(), None);
        let placed = error.at(4711);
        assert_eq!((placed.particle(), placed.to_string()), (Some(4711), format!("particle 4711: {text}")));
        // Compared as text: a kind that holds NaN differs from itself.
        assert_eq!(format!("{:?}", placed.kind()), format!("{kind:?}"));
    }
}

#[test]
fn text_is_short_however_large_or_small_its_numbers_are() {
    for (value, text) in [
        (0.0, "0"),
        (-0.25, "-0.25"),
        (1e-5, "0.00001"),
        (9.9e-6, "9.9e-6"),
        (1.09e-60, "1.09e-60"),
        (1e15, "1000000000000000"),
        (-1e16, "-1e16"),
        (1e100, "1e100"),
        (f64::MIN_POSITIVE, "2.2250738585072014e-308"),
        (f64::INFINITY, "inf"),
        (f64::NAN, "NaN"),
    ] {
        let error = Error::from(NeighborError::Skin { skin: value });
        assert_eq!(error.to_string(), format!("skin {text} is not a finite number from 0 on"));
        let hinted = Error::user(1).wanting(value).to_string();
        assert!(hinted.ends_with(&format!("; a provider built with the cutoff {text} may serve")), "{hinted}");
    }
    // Two numbers of a hundred digits were 200 characters.
    let faces = Error::from(DomainError::Faces { axis: 0, lower: f64::MAX, upper: -f64::MAX });
    assert!(faces.to_string().len() < 120, "{faces}");
    // What has a format of its own keeps it.
    let range = NeighborError::CutoffRange { cutoff: 1e-70, low: 0.5, high: 2.0 }.to_string();
    assert_eq!(range, "cutoff 1e-70 is outside 5e-1 to 2e0");
}

#[test]
fn user_code_comes_back_unchanged() {
    for code in [0, i64::MIN, i64::MAX] {
        assert_eq!(*Error::user(code).kind(), ErrorKind::User { code });
    }
}

#[test]
fn error_crosses_threads_and_boxes() {
    fn refuse() -> std::result::Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Epsilon::global(0.0)?;
        Ok(())
    }
    let text = std::thread::spawn(|| refuse().unwrap_err().to_string()).join().unwrap();
    assert_eq!(text, "epsilon 0 is not positive and finite");
}

#[test]
fn first_bad_entry_of_an_array_is_named() {
    let bad: [fn(Vec<f64>) -> Result<()>; 2] = [|v| Epsilon::each(v).map(drop), |v| Volumes::each(v).map(drop)];
    for refuse in bad {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = refuse(vec![1.0, 2.0, value, -3.0]).unwrap_err();
            assert_eq!(error.particle(), Some(2), "{error}");
            assert!(error.to_string().contains(&value.to_string()), "{error}");
        }
        assert_eq!(refuse(vec![f64::MIN_POSITIVE, f64::MAX]), Ok(()));
    }
}

#[test]
fn a_set_too_small_for_any_cutoff_is_told_apart_from_a_short_cutoff() {
    let dcpse = DcPse::<Laplacian<2>, 2>::new();
    let needed = dcpse.fewest_neighbors().unwrap();
    let refusal = |set: &Particles<2>, domain: &Domain<2>, cutoff: f64| {
        let cells = CellList::build(set, domain, Cutoff(cutoff)).unwrap();
        let refused = dcpse.assemble(&cells).unwrap_err();
        let few = matches!(refused.kind(), ErrorKind::Operator(OperatorError::TooFew { .. }));
        assert!(few && refused.particle().is_some(), "{refused}");
        refused
    };
    for n in 1..=needed {
        let set = Particles::random([0.0; 2], [1.0; 2], n, 7).unwrap();
        let refused = refusal(&set, &Domain::open(), 10.0);
        assert_eq!(refused.wanted_cutoff(), None, "{refused}");
        let says = format!("; the whole set has {n} particles, at least {} are needed", needed + 1);
        assert!(refused.to_string().ends_with(&says), "{refused}");
        // Behind periodic faces there are images, which a wider cutoff may reach.
        let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
        assert!(refusal(&set, &torus, 0.01).wanted_cutoff().is_some());
    }
    let enough = Particles::random([0.0; 2], [1.0; 2], needed + 1, 7).unwrap();
    let short = refusal(&enough, &Domain::open(), 0.01);
    assert!(short.wanted_cutoff().is_some() && !short.to_string().contains("whole set"), "{short}");
    // Under another name the hint stays.
    let three = Particles::random([0.0; 2], [1.0; 2], 3, 7).unwrap();
    let around = CellList::build(&three, &Domain::open(), Cutoff(10.0)).unwrap();
    let thin = UpwindDcPse::half_stencils().assemble(&around).unwrap_err();
    assert!(matches!(thin.kind(), ErrorKind::Operator(OperatorError::ThinSide { .. })), "{thin}");
    assert!(thin.to_string().contains("; the whole set has 3 particles"), "{thin}");
}

#[test]
fn an_axis_that_does_not_exist_is_refused() {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [4; 2]).unwrap();
    let around = CellList::build(&set, &Domain::open(), Cutoff(0.4)).unwrap();
    for axis in [0, 1, 2, 7, usize::MAX] {
        let half = Upstream::half(&around, axis, Side::Left, 3).map(drop);
        let biased = Upstream::biased(&around, axis, Side::Right, Spacing(0.25), 3).map(drop);
        let expected = if axis < 2 { Ok(()) } else { Err(NeighborError::Axis { axis, axes: 2 }.into()) };
        assert_eq!((&half, &biased), (&expected, &expected));
    }
}
