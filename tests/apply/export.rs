//! Stored rows as matrices, as text and as right-hand sides of other integrators.

use crate::full;
use parops::{
    Apply, CellList, CsrMatrix, Cutoff, D1, D2, DcPse, Domain, ErrorKind, Euler, Face, Field, Gradient, Laplacian,
    LinearError, MultiIndexError, Outputs, Particles, Plan, Pse, Random, Result, Rk4, Rows, Stepper, integrate,
    testing::Promise,
};

fn jittered(n: usize, seed: u64) -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.3, seed)
}

fn noise<T: Field>(n: usize, seed: u64) -> Vec<T> {
    let mut random = Random::new(seed);
    (0..n).map(|_| T::lift(random.uniform() - 0.5)).collect()
}

/// Gradient rows with the '+' sign on a torus, and Laplacian rows next to it.
fn torus(n: usize) -> Result<(Rows<[f64; 2]>, Rows)> {
    let (particles, box_) = (jittered(n, 3)?, Domain::periodic([0.0; 2], [1.0; 2])?);
    let (gradient, laplacian) = (DcPse::<Gradient<2>, 3>::new(), DcPse::<Laplacian<2>, 2>::new());
    let cutoff = gradient.cutoff(&particles)?;
    let cells = CellList::build(&particles, &box_, cutoff)?;
    Ok((gradient.assemble(&cells)?, laplacian.assemble(&cells)?))
}

/// PSE on sixteen particles between mirrors: many sources stand twice in a row, and so does the target itself.
fn small_boxes() -> Result<Vec<Rows>> {
    let particles = Particles::lattice([0.0], [1.0], [16])?;
    let epsilon = particles.spacing()?.epsilon(2.0)?;
    let faces = [[Face::MirrorOdd, Face::MirrorEven], [Face::MirrorOdd; 2], [Face::MirrorEven; 2]];
    let mut all = Vec::new();
    for faces in faces {
        let box_ = Domain::new([0.0], [1.0], [faces])?;
        let laplacian = Pse::new(Laplacian::<1>, 2, epsilon.clone(), particles.volumes()?)?.support(3.9)?;
        all.push(laplacian.assemble(&CellList::build(&particles, &box_, laplacian.cutoff())?)?);
        let slope = Pse::new(D1::<1>::default(), 2, epsilon.clone(), particles.volumes()?)?.support(3.9)?;
        all.push(slope.assemble(&CellList::build(&particles, &box_, slope.cutoff())?)?);
    }
    Ok(all)
}

/// Compares the matrix of every output with the rows, entry structure included.
fn matrix_is_the_operator<const K: usize, T: Field>(rows: &Rows<[f64; K], T>) -> Result<()> {
    let f: Vec<T> = noise(rows.sources(), 17);
    let mut direct = vec![[T::zero(); K]; rows.targets()];
    rows.apply_all(&f, &mut direct)?;
    let eps: f64 = T::default_epsilon().as_();
    for k in 0..K {
        let matrix = rows.to_csr(k)?;
        assert_eq!((matrix.rows(), matrix.columns()), (rows.targets(), rows.sources()));
        let mut product = vec![T::zero(); rows.targets()];
        matrix.multiply(&f, &mut product)?;
        for p in 0..rows.targets() {
            let (columns, _) = matrix.row(p).unwrap();
            assert!(columns.is_sorted_by(|a, b| a < b));
            let row = rows.row(p).unwrap();
            let own = rows.center(p).map(|q| f[q].as_());
            if let Some(center) = rows.center(p) {
                assert!(columns.contains(&(center as u32)));
            }
            // Both sums round n + 2 terms of this size, each made with two more roundings.
            let mut size = own.map_or(0.0, |own: f64| (row.diagonal[k].as_() * own).abs());
            for (&q, w) in row.sources.iter().zip(row.weights) {
                let w: f64 = w[k].as_();
                size += w.abs() * (f[q as usize].as_().abs() + own.map_or(0.0, f64::abs));
            }
            let miss: f64 = (direct[p][k] - product[p]).as_();
            let acts = Promise::new("Exports", "CSR matrices act as the rows they are made of, f64 and f32");
            let unit = (row.sources.len() + 4) as f64 * eps * size;
            acts.case(format!("row {p}")).in_units("(n + 4) eps sum abs", unit).at_most(2.0, miss.abs());
        }
    }
    Ok(())
}

#[test]
fn matrix_of_rows_acts_like_them_with_images_signs_and_both_scalars() -> Result<()> {
    let (gradient, laplacian) = torus(12)?;
    matrix_is_the_operator(&gradient)?;
    matrix_is_the_operator(&laplacian)?;
    for rows in small_boxes()? {
        let images = (0..16).any(|p| {
            let mut sources = rows.row(p).unwrap().sources.to_vec();
            sources.sort_unstable();
            sources.windows(2).any(|pair| pair[0] == pair[1])
        });
        assert!(images, "no source stands twice");
        matrix_is_the_operator(&rows)?;
    }
    let particles = jittered(15, 8)?;
    let mixed = DcPse::<D2<1, 1>, 2>::new();
    let cells = CellList::build(&particles, &Domain::open(), mixed.cutoff(&particles)?)?;
    matrix_is_the_operator(&Rows::<_, f32>::assemble(&mixed, &cells)?)
}

#[test]
fn matrix_of_rows_off_the_particles_holds_plain_weights() -> Result<()> {
    let particles = jittered(15, 5)?;
    let targets = [[0.5, 0.5], [0.21, 0.77], [0.9, 0.1]];
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let cells = CellList::build_at(&targets, &particles, &Domain::open(), Cutoff(0.3))?;
    let rows = laplacian.assemble(&cells)?;
    assert!((0..3).all(|p| rows.center(p).is_none()));
    matrix_is_the_operator(&rows)?;
    let matrix = rows.to_csr(0)?;
    for p in 0..3 {
        let row = rows.row(p).unwrap();
        assert_eq!(matrix.row(p).unwrap().0.len(), row.sources.len());
        for (&q, w) in row.sources.iter().zip(row.weights) {
            assert!(matrix.triplets().any(|entry| entry == (p, q as usize, w[0])));
        }
    }
    Ok(())
}

#[test]
fn rows_of_a_matrix_sum_to_nothing_where_the_operator_annihilates_constants() -> Result<()> {
    let (_, laplacian) = torus(12)?;
    let matrix = laplacian.to_csr(0)?;
    for p in 0..matrix.rows() {
        let (columns, values) = matrix.row(p).unwrap();
        let size: f64 = values.iter().map(|value| value.abs()).sum();
        assert!(values.iter().sum::<f64>().abs() <= columns.len() as f64 * f64::EPSILON * size);
    }
    Ok(())
}

#[test]
fn raw_rows_are_those_of_the_operator_without_a_copy() -> Result<()> {
    let (gradient, _) = torus(12)?;
    let raw = gradient.raw();
    assert_eq!(raw.offsets.len(), gradient.targets() + 1);
    assert_eq!(raw.weights.len(), *raw.offsets.last().unwrap());
    for p in 0..gradient.targets() {
        let row = gradient.row(p).unwrap();
        let range = raw.offsets[p]..raw.offsets[p + 1];
        assert!(std::ptr::eq(row.sources, &raw.columns[range.clone()]));
        assert!(std::ptr::eq(row.weights, &raw.weights[range]));
        assert_eq!((raw.diagonal[p], gradient.center(p)), (row.diagonal, Some(p)));
    }
    assert_eq!(gradient.center(gradient.targets()), None);
    let (_, laplacian) = torus(12)?;
    assert!(laplacian.raw().diagonal.is_empty());
    Ok(())
}

#[test]
fn output_that_does_not_exist_and_sums_beyond_the_scalar_are_refused() -> Result<()> {
    let (gradient, _) = torus(12)?;
    let error = gradient.to_csr(2).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::MultiIndex(MultiIndexError::Output { output: 2, outputs: 2 }));
    // Weights of 2e38 fit into f32, the diagonal of two neighbors does not.
    let particles = Particles::new(vec![[0.25], [0.5], [0.75]])?;
    let rows = Rows::<_, f32>::assemble(&Heavy, &CellList::build(&particles, &Domain::open(), Cutoff(0.6))?)?;
    let error = rows.to_csr(0).unwrap_err();
    assert_eq!(error.particle(), Some(0));
    assert!(matches!(
        error.kind(),
        ErrorKind::Linear(LinearError::Entry { value: f64::INFINITY | f64::NEG_INFINITY, .. })
    ));
    Ok(())
}

/// Gives every pair the weight 2e38.
struct Heavy;

impl parops::Method<1> for Heavy {
    type Out = [f64; 1];
    type Scratch = ();

    fn scratch(&self) -> Result<()> {
        Ok(())
    }

    fn weights(&self, _: &parops::Stencil<1>, _: &mut (), w: &mut [[f64; 1]], diagonal: &mut [f64; 1]) -> Result<()> {
        w.fill([2e38]);
        *diagonal = [0.0];
        Ok(())
    }

    fn report(
        &self,
        row: &parops::Stencil<1>,
        _: &(),
        w: &[[f64; 1]],
        diagonal: &[f64; 1],
    ) -> Result<parops::RowReport> {
        Ok(parops::RowReport::of(row, w, diagonal))
    }
}

/// Reads Matrix Market text, by the rules of the format and not by those of the writer.
fn read<T: Field>(text: &str, parse: impl Fn(&str) -> T) -> Result<CsrMatrix<T>> {
    let mut lines = text.lines();
    let header: Vec<_> = lines.next().unwrap().split_whitespace().collect();
    assert_eq!(header, ["%%MatrixMarket", "matrix", "coordinate", "real", "general"]);
    let mut lines = lines.filter(|line| !line.starts_with('%') && !line.trim().is_empty());
    let sizes: Vec<usize> = lines.next().unwrap().split_whitespace().map(|size| size.parse().unwrap()).collect();
    let entries: Vec<_> = lines
        .map(|line| {
            let words: Vec<_> = line.split_whitespace().collect();
            (words[0].parse::<usize>().unwrap() - 1, words[1].parse::<usize>().unwrap() - 1, parse(words[2]))
        })
        .collect();
    assert_eq!(entries.len(), sizes[2]);
    CsrMatrix::from_triplets(sizes[0], sizes[1], entries)
}

fn read_back() -> Promise {
    Promise::new("Exports", "matrices read back from Matrix Market text, bits")
}

#[test]
fn matrix_read_back_from_matrix_market_has_equal_bits() -> Result<()> {
    let (gradient, _) = torus(12)?;
    let extremes = [f64::MIN_POSITIVE, 5e-324, f64::MAX, -1.0 / 3.0, 0.1, 1e22, 9007199254740993.0];
    let extremes = CsrMatrix::from_triplets(3, 9, extremes.into_iter().enumerate().map(|(i, v)| (i % 2, i, v)))?;
    for matrix in [gradient.to_csr(0)?, gradient.to_csr(1)?, extremes, CsrMatrix::from_triplets(0, 0, [])?] {
        let mut text = Vec::new();
        matrix.write_matrix_market(&mut text)?;
        let again = read(std::str::from_utf8(&text).unwrap(), |word| word.parse::<f64>().unwrap())?;
        read_back().equal(&again, &matrix);
    }
    let short = CsrMatrix::from_triplets(1, 3, [(0, 0, 0.1_f32), (0, 1, f32::MAX), (0, 2, -1e-45)])?;
    let mut text = Vec::new();
    short.write_matrix_market(&mut text)?;
    read_back().equal(&read(std::str::from_utf8(&text).unwrap(), |word| word.parse::<f32>().unwrap())?, &short);
    Ok(())
}

#[test]
fn writer_that_fails_at_any_byte_is_a_typed_error() -> Result<()> {
    let matrix = CsrMatrix::from_triplets(2, 2, [(0, 0, 0.1), (1, 0, -2.0)])?;
    let mut text = Vec::new();
    matrix.write_matrix_market(&mut text)?;
    full::check_every_byte(text.len(), |out| matrix.write_matrix_market(out))
}

/// Heun's method as somebody else would write it.
fn heun<E>(
    u: &mut [f64],
    dt: f64,
    steps: usize,
    mut f: impl FnMut(f64, &[f64], &mut [f64]) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let (mut a, mut b, mut middle) = (vec![0.0; u.len()], vec![0.0; u.len()], vec![0.0; u.len()]);
    for n in 0..steps {
        f(n as f64 * dt, u, &mut a)?;
        (0..u.len()).for_each(|i| middle[i] = u[i] + dt * a[i]);
        f((n + 1) as f64 * dt, &middle, &mut b)?;
        (0..u.len()).for_each(|i| u[i] += 0.5 * dt * (a[i] + b[i]));
    }
    Ok(())
}

#[test]
fn right_hand_side_drives_foreign_integrators_and_our_steppers() -> Result<()> {
    let particles = Particles::lattice([0.0], [1.0], [32])?;
    let laplacian = Pse::new(Laplacian::<1>, 2, particles.spacing()?.epsilon(2.0)?, particles.volumes()?)?;
    let cells = CellList::build(&particles, &Domain::periodic([0.0], [1.0])?, laplacian.cutoff())?;
    let rows = laplacian.assemble(&cells)?;
    let start: Vec<f64> = particles.points().iter().map(|x| (std::f64::consts::TAU * x[0]).sin()).collect();
    // The sine is a mode of the periodic lattice: it decays by exp(-rate t).
    let mut rate = vec![0.0; 32];
    rows.apply(&start, &mut rate)?;
    let (rate, end, steps) = (-rate[5] / start[5], 0.05, 400);
    let decay = (-rate * end).exp();
    let dt = end / steps as f64;
    let error = |u: &[f64]| u.iter().zip(&start).fold(0.0_f64, |worst, (u, s)| worst.max((u - s * decay).abs()));
    // Heun misses (rate dt)^3 / 6 a step, relative; twice for what follows in the series.
    let second = 2.0 * steps as f64 * (rate * dt).powi(3) / 6.0;

    let mut u = start.clone();
    heun(&mut u, dt, steps, rows.rhs())?;
    assert!(error(&u) <= second && error(&u) > second / 20.0, "{} {second}", error(&u));
    let mut matrix = start.clone();
    heun(&mut matrix, dt, steps, rows.to_csr(0)?.rhs())?;
    assert!(error(&matrix) <= second);
    let free = laplacian.matrix_free(&cells)?;
    let mut by_free = start.clone();
    heun(&mut by_free, dt, steps, free.rhs())?;
    assert_eq!(by_free, u);

    let mut ours = start.clone();
    integrate(&mut Rk4::new(), &mut ours, &Plan::new(0.0, end, dt)?, rows.rhs(), |_, _, _| {})?;
    assert!(error(&ours) <= 1e-3 * second, "{}", error(&ours));
    let mut stepped = start.clone();
    Euler::new().step(0.0, dt, &mut stepped, &mut rows.rhs())?;
    let mut array: [f64; 32] = start.clone().try_into().unwrap();
    Euler::new().step(0.0, dt, &mut array, &mut rows.rhs())?;
    assert_eq!(stepped, array);
    let dynamic: &dyn Apply<f64> = &rows;
    heun(&mut matrix, dt, 1, |_, u: &[f64], du: &mut [f64]| dynamic.apply(u, du))?;

    let mut broken = vec![f64::NAN; 32];
    assert_eq!(heun(&mut broken, dt, 1, rows.rhs()).unwrap_err().particle(), Some(0));
    Ok(())
}

#[test]
fn weights_of_every_output_are_seen_through_the_trait() -> Result<()> {
    fn entries<S: Outputs>(rows: &Rows<S>) -> Result<usize> {
        (0..S::K).map(|k| Ok(rows.to_csr(k)?.entries())).sum()
    }
    let (gradient, laplacian) = torus(12)?;
    assert_eq!(entries(&gradient)?, 2 * (gradient.raw().columns.len() + gradient.targets()));
    assert_eq!(entries(&laplacian)?, laplacian.raw().columns.len() + laplacian.targets());
    Ok(())
}

#[cfg(feature = "serde")]
mod saved {
    use super::*;
    use parops::{ApplyError, DivGrad, Report, RowReport};
    use serde::{Serialize, de::DeserializeOwned};
    use serde_json::{Value, json};

    fn reloaded<R: Serialize + DeserializeOwned>(rows: &R) -> R {
        serde_json::from_str(&serde_json::to_string(rows).unwrap()).unwrap()
    }

    fn equal_bits<const K: usize, T: Field + Serialize + DeserializeOwned>(rows: &Rows<[f64; K], T>) {
        let again = reloaded(rows);
        let (a, b) = (rows.raw(), again.raw());
        let same = || Promise::new("Reproducibility", "rows saved and reloaded, bits");
        same().equal(&(a.offsets, a.columns), &(b.offsets, b.columns));
        let bits = |w: &[[T; K]]| -> Vec<u64> { w.as_flattened().iter().map(|&w| AsF64::of(w).to_bits()).collect() };
        same().equal(&bits(a.weights), &bits(b.weights));
        same().equal(&bits(a.diagonal), &bits(b.diagonal));
        assert!((0..=rows.targets()).all(|p| rows.center(p) == again.center(p)));
        assert_eq!((rows.sources(), rows.report()), (again.sources(), again.report()));
    }

    /// f32 to f64 is exact, the sign of zero included.
    struct AsF64;

    impl AsF64 {
        fn of<T: Field>(x: T) -> f64 {
            x.as_()
        }
    }

    #[test]
    fn reloaded_rows_have_equal_bits() -> Result<()> {
        let (gradient, laplacian) = torus(12)?;
        equal_bits(&gradient);
        equal_bits(&laplacian);
        small_boxes()?.iter().for_each(equal_bits);
        let particles = jittered(15, 8)?;
        let mixed = DcPse::<D2<1, 1>, 2>::new();
        let cells = CellList::build(&particles, &Domain::open(), mixed.cutoff(&particles)?)?;
        equal_bits(&Rows::<_, f32>::assemble(&mixed, &cells)?);
        equal_bits(&Rows::<_, f64>::assemble(&mixed, &cells)?);
        let off = CellList::build_at(&[[0.4, 0.4], [0.5, 0.6]], &particles, &Domain::open(), Cutoff(0.3))?;
        equal_bits(&mixed.assemble(&off)?);
        // Beside an insulator the contrast is infinite.
        let layers: Vec<_> = (0..225).map(|p| f64::from(p % 2)).collect();
        let cells = CellList::build(&particles, &Domain::open(), Cutoff(0.4))?;
        let insulated = DivGrad::new(DcPse::<Laplacian<2>, 2>::new(), layers)?.assemble(&cells)?;
        assert_eq!(insulated.report().contrast, f64::INFINITY);
        equal_bits(&insulated);
        let nothing = Particles::new(Vec::<[f64; 2]>::new())?;
        equal_bits(&mixed.assemble(&CellList::build(&nothing, &Domain::open(), Cutoff(0.3))?)?);
        Ok(())
    }

    #[test]
    fn reloaded_rows_are_stale_until_bound_to_as_many_particles() -> Result<()> {
        let particles = jittered(12, 3)?;
        let laplacian = DcPse::<Laplacian<2>, 2>::new();
        let cells = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
        let rows = laplacian.assemble(&cells)?;
        rows.validate(particles.generation())?;
        let mut again = reloaded(&rows);
        let stale = |error: parops::Error| matches!(error.kind(), ErrorKind::Apply(ApplyError::Stale { .. }));
        assert!(stale(again.validate(particles.generation()).unwrap_err()));
        let error = again.bind(&jittered(11, 3)?).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::Particle(parops::ParticleError::Length { found: 121, needed: 144 })));
        again.bind(&particles)?;
        again.validate(particles.generation())?;
        assert_eq!(again, rows);
        again.bind(&particles)?;
        // Rows that know their particles do not change them.
        let other = jittered(12, 4)?;
        assert!(
            stale(again.bind(&other).unwrap_err()) && stale(reloaded(&rows).validate(other.generation()).unwrap_err())
        );
        Ok(())
    }

    #[test]
    fn tampered_rows_are_refused() -> Result<()> {
        let particles = jittered(12, 3)?;
        let gradient = DcPse::<Gradient<2>, 2>::new();
        let targets = [[0.5, 0.5], [0.3, 0.6], [0.45, 0.2]];
        let domain = Domain::open();
        let near = CellList::build_at(&targets, &particles, &domain, Cutoff(0.35))?;
        let off = serde_json::to_value(gradient.assemble(&near)?).unwrap();
        let cells = CellList::build(&particles, &domain, gradient.cutoff(&particles)?)?;
        let on = serde_json::to_value(gradient.assemble(&cells)?).unwrap();
        let pairs = on["columns"].as_array().unwrap().len();
        type Change<'a> = &'a dyn Fn(&mut Value);
        let changes: [(&str, &Value, Change); 20] = [
            ("must be", &on, &|rows| rows["offsets"][3] = json!(0)),
            ("must be", &on, &|rows| rows["offsets"][0] = json!(1)),
            ("must be", &on, &|rows| rows["offsets"][144] = json!(pairs - 1)),
            ("must be", &on, &|rows| rows["offsets"][100] = json!(u64::MAX)),
            ("needed", &on, &|rows| rows["offsets"] = json!([])),
            ("does not exist", &on, &|rows| rows["columns"][17] = json!(144)),
            ("must be", &on, &|rows| drop(rows["columns"].as_array_mut().unwrap().pop())),
            ("needed", &on, &|rows| drop(rows["weights"].as_array_mut().unwrap().pop())),
            ("needed", &on, &|rows| drop(rows["diagonal"].as_array_mut().unwrap().pop())),
            ("null", &on, &|rows| rows["weights"][5] = Value::Null),
            ("expected f64", &on, &|rows| rows["weights"][5] = json!("NaN")),
            ("does not exist", &on, &|rows| rows["sources"] = json!(143)),
            ("more than", &on, &|rows| rows["sources"] = json!(u64::MAX)),
            ("needed", &on, &|rows| rows["outputs"] = json!(3)),
            ("missing field", &on, &|rows| drop(rows.as_object_mut().unwrap().remove("report"))),
            ("unknown field", &on, &|rows| rows["more"] = json!(1)),
            ("needed", &off, &|rows| drop(rows["centers"].as_array_mut().unwrap().pop())),
            ("does not exist", &off, &|rows| rows["centers"][1] = json!(144)),
            ("needed", &on, &|rows| rows["report"]["rows"] = json!(143)),
            ("needed", &on, &|rows| drop(rows["report"]["sums"].as_array_mut().unwrap().pop())),
        ];
        for (i, (reason, rows, change)) in changes.into_iter().enumerate() {
            let mut rows = rows.clone();
            assert!(serde_json::from_value::<Rows<[f64; 2]>>(rows.clone()).is_ok());
            change(&mut rows);
            let refused = serde_json::from_value::<Rows<[f64; 2]>>(rows);
            let error = refused.err().map(|error| error.to_string()).unwrap_or_default();
            let named = Promise::new("Input", "files of rows that were tampered with are refused by what is wrong");
            named.case(format!("change {i}: {error}")).holds(error.contains(reason));
        }
        // A number that f64 holds and f32 does not.
        let mut large = on.clone();
        large["weights"][3] = json!(1e300);
        assert!(serde_json::from_value::<Rows<[f64; 2]>>(large.clone()).is_ok());
        let error = serde_json::from_value::<Rows<[f64; 2], f32>>(large).unwrap_err().to_string();
        assert!(error.contains("weight of neighbor"), "{error}");
        Ok(())
    }

    /// A method that knows nothing of its rows and says so.
    struct Unknowing;

    impl parops::Method<1> for Unknowing {
        type Out = [f64; 1];
        type Scratch = ();

        fn scratch(&self) -> Result<()> {
            Ok(())
        }

        fn weights(&self, _: &parops::Stencil<1>, _: &mut (), w: &mut [[f64; 1]], d: &mut [f64; 1]) -> Result<()> {
            w.fill([1.0]);
            *d = [0.0];
            Ok(())
        }

        fn report(&self, row: &parops::Stencil<1>, _: &(), w: &[[f64; 1]], d: &[f64; 1]) -> Result<RowReport> {
            let mut report = RowReport::of(row, w, d);
            (report.moment_defect, report.condition, report.residual) = (f64::NAN, f64::INFINITY, 1.0);
            Ok(report)
        }
    }

    #[test]
    fn figures_that_are_not_finite_survive_a_file() -> Result<()> {
        let particles = Particles::lattice([0.0], [1.0], [4])?;
        let rows = Rows::<_, f64>::assemble(&Unknowing, &CellList::build(&particles, &Domain::open(), Cutoff(0.3))?)?;
        let report: Report = reloaded(rows.report());
        assert!(report.moment_defect.is_nan() && rows.report().moment_defect.is_nan());
        assert_eq!((report.condition, report.residual), (f64::INFINITY, 1.0));
        let (row, worst): (RowReport, _) = (reloaded(report.worst().unwrap()), rows.report().worst().unwrap());
        assert!(row.moment_defect.is_nan());
        assert_eq!((row.condition, row.target, row.sum_abs), (f64::INFINITY, worst.target, worst.sum_abs));
        assert!(
            serde_json::from_str::<RowReport>(&serde_json::to_string(&row).unwrap().replace("inf", "much")).is_err()
        );
        Ok(())
    }
}
