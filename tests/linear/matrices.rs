//! Sparse matrices, their incomplete factors, GMRES and BiCGSTAB, against dense algebra.

use crate::cases::cases;
use crate::properties::properties;
use nalgebra::{DMatrix, DVector};
use parops::{
    Apply, ApplyError, BiCgStab, CellList, CsrMatrix, DcPse, Domain, Error, ErrorKind, Gmres, Ilu0, Laplacian,
    LinearError, Particles, Random, Result, SparseSolver, testing::Promise,
};
use proptest::prelude::*;

const EPS: f64 = f64::EPSILON;

fn dense(a: &CsrMatrix) -> DMatrix<f64> {
    let mut full = DMatrix::zeros(a.rows(), a.columns());
    a.triplets().for_each(|(row, column, value)| full[(row, column)] = value);
    full
}

fn linear(error: Error) -> LinearError {
    match error.kind() {
        ErrorKind::Linear(kind) => *kind,
        other => panic!("{other:?} is no refusal of the linear layer"),
    }
}

/// A matrix with about `fill` entries a row, dominated by its diagonal by the factor `dominance`.
fn random_matrix(n: usize, fill: usize, dominance: f64, seed: u64) -> Result<CsrMatrix> {
    let mut random = Random::new(seed);
    let mut entries = Vec::new();
    for row in 0..n {
        let mut sum = 0.0;
        for _ in 0..fill {
            let column = (random.uniform() * n as f64) as usize;
            let value = random.uniform() - 0.5;
            sum += value.abs();
            entries.push((row, column.min(n - 1), value));
        }
        entries.push((row, row, dominance * sum + 0.1));
    }
    CsrMatrix::from_triplets(n, n, entries)
}

/// The five-point Laplacian with convection on an m x m grid, Dirichlet walls left out.
fn convection(m: usize, speed: f64) -> Result<CsrMatrix> {
    let mut entries = Vec::new();
    for i in 0..m {
        for j in 0..m {
            let own = i * m + j;
            entries.push((own, own, 4.0));
            let mut neighbor = |there: bool, q: usize, value: f64| {
                if there {
                    entries.push((own, q, value));
                }
            };
            neighbor(i > 0, own.wrapping_sub(m), -1.0 - speed);
            neighbor(i + 1 < m, own + m, -1.0 + speed);
            neighbor(j > 0, own.wrapping_sub(1), -1.0);
            neighbor(j + 1 < m, own + 1, -1.0);
        }
    }
    CsrMatrix::from_triplets(m * m, m * m, entries)
}

fn residual(a: &CsrMatrix, b: &[f64], x: &[f64]) -> f64 {
    let r = DVector::from_row_slice(b) - dense(a) * DVector::from_row_slice(x);
    r.norm() / DVector::from_row_slice(b).norm()
}

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    (0..n).map(|_| random.uniform() - 0.5).collect()
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn matrix_of_triplets_multiplies_like_the_dense_one(
        rows in 0_usize..9, columns in 1_usize..9,
        entries in prop::collection::vec((0_usize..9, 0_usize..9, -8_i32..9), 0..40),
    ) {
        let entries: Vec<_> = entries.into_iter()
            .filter(|e| e.0 < rows && e.1 < columns).map(|(p, q, v)| (p, q, f64::from(v))).collect();
        let a = CsrMatrix::from_triplets(rows, columns, entries.iter().copied()).unwrap();
        let mut full = DMatrix::zeros(rows, columns);
        entries.iter().for_each(|&(p, q, v)| full[(p, q)] += v);
        // Small integers: every sum is exact.
        prop_assert_eq!(&dense(&a), &full);
        for row in 0..rows {
            prop_assert!(a.row(row).unwrap().0.is_sorted_by(|p, q| p < q));
        }
        let x: Vec<f64> = (0..columns).map(|q| q as f64 - 2.0).collect();
        let mut y = vec![f64::NAN; rows];
        a.multiply(&x, &mut y).unwrap();
        prop_assert_eq!(DVector::from_vec(y), &full * DVector::from_vec(x));
        prop_assert_eq!(dense(&a.transposed().unwrap()), full.transpose());
        prop_assert_eq!(&CsrMatrix::from_triplets(rows, columns, a.triplets()).unwrap(), &a);
    }

    #[test]
    fn gmres_reaches_its_tolerance_on_random_dominant_matrices(seed in any::<u64>(), n in 1_usize..60) {
        let a = random_matrix(n, 4, 1.0, seed).unwrap();
        let b = noise(n, seed ^ 1);
        let mut x = vec![f64::NAN; n];
        let report = Gmres::new().solve(&a, Some(&Ilu0::new(&a).unwrap()), &b, &mut x).unwrap();
        Promise::new("Residuals", "GMRES on random dominant matrices, relative").at_most(1e-13, report.residual);
        // The residual is computed here in another order: n eps |A| |x| / |b| apart at most.
        let scale = dense(&a).norm() * DVector::from_row_slice(&x).norm() / DVector::from_row_slice(&b).norm();
        prop_assert!((residual(&a, &b, &x) - report.residual).abs() <= n as f64 * EPS * (1.0 + scale));
    }

    #[test]
    fn bicgstab_reaches_its_tolerance_on_random_dominant_matrices(seed in any::<u64>(), n in 1_usize..60) {
        let a = random_matrix(n, 4, 1.2, seed).unwrap();
        let b = noise(n, seed ^ 1);
        let mut x = vec![f64::NAN; n];
        let report = BiCgStab::new().solve(&a, Some(&Ilu0::new(&a).unwrap()), &b, &mut x).unwrap();
        Promise::new("Residuals", "BiCGSTAB on random dominant matrices, relative").at_most(1e-13, report.residual);
        let scale = dense(&a).norm() * DVector::from_row_slice(&x).norm() / DVector::from_row_slice(&b).norm();
        prop_assert!((residual(&a, &b, &x) - report.residual).abs() <= n as f64 * EPS * (1.0 + scale));
    }

    #[test]
    fn better_guesses_take_fewer_iterations_to_the_same_residual(seed in any::<u64>(), n in 20_usize..60) {
        let a = random_matrix(n, 4, 1.2, seed).unwrap();
        let b = noise(n, seed ^ 1);
        for mut solver in solvers(&a).unwrap() {
            let mut x = vec![0.0; n];
            let whole = solver.solve(&b, &mut x).unwrap();
            let mut near: Vec<f64> = x.iter().zip(noise(n, seed ^ 2)).map(|(x, noise)| x * (1.0 + 1e-8 * noise)).collect();
            let rest = solver.improve(&b, &mut near).unwrap();
            prop_assert!(rest.iterations <= whole.iterations && rest.residual <= 1e-13);
            // Both are within the residual of the solution, the matrix being dominant.
            let size = x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            prop_assert!(x.iter().zip(&near).all(|(x, y)| (x - y).abs() < 1e-10 * size));
        }
    }

    #[test]
    fn incomplete_factors_match_the_matrix_on_its_pattern(seed in any::<u64>(), n in 1_usize..25, weak in 1_usize..9) {
        let a = random_matrix(n, 3, 1.2, seed).unwrap();
        // Some rows, or all of them, without a large diagonal.
        let weaken = |(p, q, w): (usize, usize, f64)| (p, q, if p == q && p % weak == 0 { 0.1 * w } else { w });
        let a = CsrMatrix::from_triplets(n, n, a.triplets().map(weaken)).unwrap();
        let factors = Ilu0::new(&a);
        // Rejects are counted: too many of them fail.
        prop_assume!(factors.is_ok());
        let factors = factors.unwrap();
        // The columns of (L U)^-1, inverted, are L U.
        let mut inverse = DMatrix::zeros(n, n);
        let mut transposed = DMatrix::zeros(n, n);
        for q in 0..n {
            let mut unit = vec![0.0; n];
            unit[q] = 1.0;
            let mut other = unit.clone();
            factors.solve(&mut unit).unwrap();
            factors.solve_transposed(&mut other).unwrap();
            inverse.set_column(q, &DVector::from_vec(unit));
            transposed.set_column(q, &DVector::from_vec(other));
        }
        let bound = 100.0 * n as f64 * EPS * inverse.norm();
        prop_assert!((&inverse - transposed.transpose()).norm() <= bound);
        let product = inverse.clone().try_inverse().unwrap();
        let condition = product.norm() * inverse.norm();
        for (row, column, value) in a.triplets() {
            prop_assert!((product[(row, column)] - value).abs() <= 10.0 * n as f64 * EPS * condition * product.norm());
        }
    }
}

#[test]
fn incomplete_factors_are_complete_on_tridiagonal_matrices() -> Result<()> {
    let n = 200;
    let band = (0..n).flat_map(|i| [(i, i, 2.5), (i, (i + 1).min(n - 1), -1.0), (i, i.max(1) - 1, -1.2)]);
    let a = CsrMatrix::from_triplets(n, n, band)?;
    let b = noise(n, 5);
    let mut x = vec![0.0; n];
    let report = Gmres::new().solve(&a, Some(&Ilu0::new(&a)?), &b, &mut x)?;
    assert!(report.iterations <= 2, "{report:?}");
    Ok(())
}

#[test]
fn gmres_needs_fewer_iterations_with_the_incomplete_factor() -> Result<()> {
    let a = convection(40, 0.4)?;
    let b = noise(1600, 3);
    let mut x = vec![0.0; 1600];
    let plain = Gmres::new().restart(200).solve(&a, None, &b, &mut x)?;
    let factored = Gmres::new().restart(200).solve(&a, Some(&Ilu0::new(&a)?), &b, &mut x)?;
    assert!(2 * factored.iterations < plain.iterations, "{factored:?} {plain:?}");
    let restarted = Gmres::new().restart(10).solve(&a, Some(&Ilu0::new(&a)?), &b, &mut x)?;
    assert!(restarted.iterations > factored.iterations && residual(&a, &b, &x) < 2e-13, "{restarted:?}");
    Ok(())
}

#[test]
fn gmres_gives_equal_bits_again_and_under_scaling_by_powers_of_two() -> Result<()> {
    let a = convection(15, 0.2)?;
    let factors = Ilu0::new(&a)?;
    let b = noise(225, 9);
    let mut gmres = Gmres::new();
    let (mut first, mut again) = (vec![0.0; 225], vec![7.0; 225]);
    gmres.solve(&a, Some(&factors), &b, &mut first)?;
    gmres.solve(&a, Some(&factors), &noise(225, 10), &mut again)?;
    gmres.solve(&a, Some(&factors), &b, &mut again)?;
    assert_eq!(first, again);
    for power in [-700, 5, 700] {
        let factor = 2.0_f64.powi(power);
        let scaled: Vec<f64> = b.iter().map(|b| b * factor).collect();
        gmres.solve(&a, Some(&factors), &scaled, &mut again)?;
        assert!(first.iter().zip(&again).all(|(x, y)| x * factor == *y), "2^{power}");
    }
    Ok(())
}

#[test]
fn gmres_solves_matrices_of_any_scale() -> Result<()> {
    let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 3.0), (2, 2, 1.0), (2, 0, 0.5)];
    for scale in [1e-300, 1e-160, 1e160, 1e300] {
        let a = CsrMatrix::from_triplets(3, 3, entries.map(|(p, q, value)| (p, q, scale * value)))?;
        let mut x = [0.0; 3];
        let report = Gmres::new().solve(&a, None, &[3.0, 4.0, 1.5], &mut x)?;
        assert!(report.iterations <= 4 && x.iter().all(|x| (x * scale - 1.0).abs() < 1e-12), "{scale:e}: {x:?}");
    }
    Ok(())
}

#[test]
fn gmres_with_nothing_on_the_right_gives_nothing() -> Result<()> {
    let a = convection(4, 0.0)?;
    let mut x = [f64::NAN; 16];
    let report = Gmres::new().solve(&a, None, &[0.0; 16], &mut x)?;
    assert_eq!((x, report.iterations, report.residual), ([0.0; 16], 0, 0.0));
    Ok(())
}

#[test]
fn gmres_says_how_far_it_came_where_it_does_not_converge() -> Result<()> {
    let a = convection(20, 0.3)?;
    let b = noise(400, 1);
    let mut x = vec![0.0; 400];
    let error = Gmres::new().restart(5).most(12).solve(&a, None, &b, &mut x).unwrap_err();
    let LinearError::NotConverged { iterations: 12, residual: left, tolerance: 1e-13 } = linear(error.clone()) else {
        panic!("{error}");
    };
    assert!((left / residual(&a, &b, &x) - 1.0).abs() < 1e-9, "{left}");
    // A cyclic shift: no restart before n iterations gains anything, and the solver sees that at once.
    let shift = CsrMatrix::from_triplets(30, 30, (0..30).map(|i| (i, (i + 1) % 30, 1.0)))?;
    let mut unit = [0.0; 30];
    unit[0] = 1.0;
    let error = Gmres::new().restart(10).solve(&shift, None, &unit, &mut x[..30]).unwrap_err();
    assert_eq!(linear(error), LinearError::NotConverged { iterations: 10, residual: 1.0, tolerance: 1e-13 });
    Gmres::new().restart(30).solve(&shift, None, &unit, &mut x[..30])?;
    assert_eq!(x[1], 1.0);
    // A singular matrix and a right-hand side outside its range.
    let flat = CsrMatrix::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, 1.0)])?;
    let error = Gmres::new().solve(&flat, None, &[1.0, 1.0], &mut [0.0; 2]).unwrap_err();
    assert!(matches!(linear(error), LinearError::NotConverged { residual, .. } if residual > 0.7));
    Ok(())
}

#[test]
fn bicgstab_gives_equal_bits_again_and_under_scaling_by_powers_of_two() -> Result<()> {
    let a = convection(15, 0.2)?;
    let factors = Ilu0::new(&a)?;
    let b = noise(225, 9);
    let mut bicgstab = BiCgStab::new();
    let (mut first, mut again) = (vec![0.0; 225], vec![7.0; 225]);
    bicgstab.solve(&a, Some(&factors), &b, &mut first)?;
    bicgstab.solve(&a, None, &noise(225, 10), &mut again)?;
    for power in [-700, 0, 5, 700] {
        let factor = 2.0_f64.powi(power);
        let scaled: Vec<f64> = b.iter().map(|b| b * factor).collect();
        bicgstab.solve(&a, Some(&factors), &scaled, &mut again)?;
        assert!(first.iter().zip(&again).all(|(x, y)| x * factor == *y), "2^{power}");
    }
    let report = bicgstab.solve(&a, None, &[0.0; 225], &mut again)?;
    assert!(again == [0.0; 225] && report.iterations == 0);
    Ok(())
}

#[test]
fn bicgstab_solves_matrices_of_any_scale() -> Result<()> {
    let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 3.0), (2, 2, 1.0), (2, 0, 0.5)];
    for scale in [1e-300, 1e-160, 1e160, 1e300] {
        let a = CsrMatrix::from_triplets(3, 3, entries.map(|(p, q, value)| (p, q, scale * value)))?;
        let mut x = [0.0; 3];
        BiCgStab::new().solve(&a, None, &[3.0, 4.0, 1.5], &mut x)?;
        assert!(x.iter().all(|x| (x * scale - 1.0).abs() < 1e-12), "{scale:e}: {x:?}");
    }
    Ok(())
}

#[test]
fn bicgstab_says_how_far_it_came_where_it_does_not_converge_or_breaks_down() -> Result<()> {
    let a = convection(20, 0.3)?;
    let b = noise(400, 1);
    let mut x = vec![0.0; 400];
    for most in [1, 12, 13] {
        let error = BiCgStab::new().most(most).solve(&a, None, &b, &mut x).unwrap_err();
        let LinearError::NotConverged { iterations, residual: left, tolerance: 1e-13 } = linear(error.clone()) else {
            panic!("{error}");
        };
        assert!(iterations == most && (left / residual(&a, &b, &x) - 1.0).abs() < 1e-9, "{left}");
        assert!(left <= 1.0);
    }
    // A rotation: every residual is orthogonal to its image, so that no second half of an iteration gains anything.
    let rotation = CsrMatrix::from_triplets(2, 2, [(0, 1, 1.0), (1, 0, -1.0)])?;
    let error = BiCgStab::new().solve(&rotation, None, &[1.0, 2.0], &mut x[..2]).unwrap_err();
    assert!(
        matches!(linear(error), LinearError::NotConverged { iterations, residual, .. } if iterations < 50 && residual <= 1.0)
    );
    // A singular matrix and a right-hand side outside its range.
    let flat = CsrMatrix::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, 1.0)])?;
    let error = BiCgStab::new().solve(&flat, None, &[1.0, 1.0], &mut [0.0; 2]).unwrap_err();
    assert!(matches!(linear(error), LinearError::NotConverged { residual, .. } if residual > 0.7));
    assert_eq!(
        linear(BiCgStab::new().tolerance(1.0).unwrap_err()),
        LinearError::Setting { value: 1.0, low: 0.0, high: 1.0 }
    );
    let wide = CsrMatrix::<f64>::from_triplets(2, 3, [])?;
    let error = BiCgStab::new().solve(&wide, None, &[1.0; 2], &mut [0.0; 2]).unwrap_err();
    assert_eq!(linear(error), LinearError::NotSquare { rows: 2, columns: 3 });
    Ok(())
}

#[test]
fn matrices_refuse_entries_that_do_not_fit() {
    let refused = |entry| CsrMatrix::from_triplets(2, 3, [(0, 0, 1.0), entry]).unwrap_err();
    let outside = |row, column| LinearError::Index { row, column, rows: 2, columns: 3 };
    assert_eq!(linear(refused((2, 0, 1.0))), outside(2, 0));
    assert_eq!(linear(refused((0, 3, 1.0))), outside(0, 3));
    assert_eq!(refused((1, 2, f64::INFINITY)).particle(), Some(1));
    let sum = CsrMatrix::from_triplets(1, 1, [(0, 0, f64::MAX), (0, 0, f64::MAX)]).unwrap_err();
    assert_eq!(linear(sum), LinearError::Entry { column: 0, value: f64::INFINITY });
    assert!(matches!(
        linear(CsrMatrix::<f64>::from_triplets(0, usize::MAX, []).unwrap_err()),
        LinearError::Columns { columns: usize::MAX, .. }
    ));
    let memory = CsrMatrix::<f64>::from_triplets(usize::MAX, 1, []).unwrap_err();
    assert!(matches!(memory.kind(), ErrorKind::Particle(parops::ParticleError::Memory { .. })));
}

#[test]
fn replaced_rows_are_those_of_the_other_matrix_or_none() -> Result<()> {
    let a = random_matrix(40, 5, 1.0, 4)?;
    let other = random_matrix(40, 2, 1.0, 8)?;
    let mut mixed = a.clone();
    mixed.replace_rows(&other, [(3, 0), (39, 39), (3, 7)])?;
    let mut one_by_one = a.clone();
    for (row, from) in [(3, 7), (39, 39)] {
        let mut entries: Vec<_> = other.triplets().filter(|e| e.0 == from).map(|e| (e.1, e.2)).collect();
        entries.reverse();
        one_by_one.replace_row(row, &entries)?;
    }
    assert_eq!(mixed, one_by_one);
    for row in 0..40 {
        let expected = match row {
            3 => other.row(7),
            39 => other.row(39),
            _ => a.row(row),
        };
        assert_eq!(mixed.row(row), expected);
    }
    let kept = mixed.clone();
    assert_eq!(
        linear(mixed.replace_row(40, &[]).unwrap_err()),
        LinearError::Index { row: 40, column: 0, rows: 40, columns: 40 }
    );
    assert_eq!(
        linear(mixed.replace_row(1, &[(0, 1.0), (40, 1.0)]).unwrap_err()),
        LinearError::Index { row: 1, column: 40, rows: 40, columns: 40 }
    );
    assert_eq!(mixed.replace_row(1, &[(0, f64::NAN)]).unwrap_err().particle(), Some(1));
    assert!(mixed.replace_rows(&other, [(0, 40)]).is_err() && mixed.replace_rows(&other, [(40, 0)]).is_err());
    let narrow = CsrMatrix::identity(3)?;
    assert_eq!(linear(mixed.replace_rows(&narrow, []).unwrap_err()), LinearError::Length { found: 3, needed: 40 });
    assert_eq!(mixed, kept);
    Ok(())
}

#[test]
fn zero_pivot_names_its_row() -> Result<()> {
    let swap = CsrMatrix::from_triplets(2, 2, [(0, 1, 1.0), (1, 0, 1.0)])?;
    let error = Ilu0::new(&swap).unwrap_err();
    assert_eq!((error.particle(), linear(error)), (Some(0), LinearError::ZeroPivot { pivot: 0.0, largest: 1.0 }));
    // The second row is a third of the first, but for rounding; so is what elimination leaves, at any scale.
    for scale in [1e-200, 1.0, 1e200] {
        let third = scale / 3.0;
        let thirds = [(0, 0, scale * 0.7), (0, 1, scale * 0.3), (1, 0, third * 0.7), (1, 1, third * 0.3)];
        let error = Ilu0::new(&CsrMatrix::from_triplets(2, 2, thirds)?).unwrap_err();
        assert_eq!(error.particle(), Some(1), "scale {scale}");
    }
    let wide = CsrMatrix::<f64>::from_triplets(2, 3, [])?;
    assert_eq!(linear(Ilu0::new(&wide).unwrap_err()), LinearError::NotSquare { rows: 2, columns: 3 });
    Ok(())
}

#[test]
fn solvers_refuse_vectors_that_do_not_fit() -> Result<()> {
    let a = CsrMatrix::identity(3)?;
    let factors = Ilu0::new(&a)?;
    let mut x = [7.0; 3];
    let mut refused =
        |preconditioner: Option<&Ilu0>, b: &[f64]| Gmres::new().solve(&a, preconditioner, b, &mut x).unwrap_err();
    assert_eq!(linear(refused(None, &[1.0; 2])), LinearError::Length { found: 2, needed: 3 });
    let small = Ilu0::new(&CsrMatrix::identity(2)?)?;
    assert_eq!(linear(refused(Some(&small), &[1.0; 3])), LinearError::Length { found: 2, needed: 3 });
    let error = refused(Some(&factors), &[1.0, f64::NEG_INFINITY, f64::NAN]);
    assert_eq!((error.particle(), linear(error)), (Some(1), LinearError::Value { value: f64::NEG_INFINITY }));
    assert!(refused(None, &[f64::NAN; 3]).particle() == Some(0));
    assert_eq!(x, [7.0; 3]);
    assert!(Gmres::new().solve(&a, None, &[1.0; 3], &mut [0.0; 2]).is_err());
    assert_eq!(linear(factors.solve(&mut [0.0; 2]).unwrap_err()), LinearError::Length { found: 2, needed: 3 });
    for tolerance in [0.0, 1.0, -1.0, f64::NAN] {
        assert!(Gmres::new().tolerance(tolerance).is_err());
    }
    let error = a.multiply(&[0.0, f64::NAN, 0.0], &mut [0.0; 3]).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Apply(ApplyError::Field { .. })));
    assert_eq!((Apply::<f64>::targets(&a), Apply::<f64>::sources(&a)), (3, 3));
    Ok(())
}

/// |A|_1 |A^-1|_1 of the matrix whose rows are scaled as the solver scales them.
fn condition(a: &CsrMatrix) -> f64 {
    let mut full = dense(a);
    for mut row in full.row_iter_mut() {
        row *= 2.0_f64.powi(-(row.amax().log2().floor() as i32));
    }
    let one_norm = |a: &DMatrix<f64>| a.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    one_norm(&full) * one_norm(&full.clone().try_inverse().unwrap())
}

/// Every method; LU where the feature is on.
fn solvers(a: &CsrMatrix) -> Result<Vec<SparseSolver>> {
    let mut solvers = vec![SparseSolver::gmres(a.clone(), Gmres::new())?];
    solvers.push(SparseSolver::bicgstab(a.clone(), BiCgStab::new())?);
    #[cfg(feature = "faer")]
    solvers.push(SparseSolver::lu(a.clone())?);
    solvers.push(SparseSolver::new(a.clone())?);
    Ok(solvers)
}

/// Rows of a Laplacian, h^-2 in size, between Dirichlet rows and one-sided Neumann rows: a square of m x m points.
fn steady(m: usize) -> Result<CsrMatrix> {
    let h = 1.0 / (m - 1) as f64;
    let mut entries = Vec::new();
    for p in 0..m * m {
        let (i, j) = (p / m, p % m);
        if i == 0 || j == 0 || j == m - 1 {
            entries.push((p, p, 1.0));
        } else if i == m - 1 {
            entries.extend([(p, p, 1.5 / h), (p, p - m, -2.0 / h), (p, p - 2 * m, 0.5 / h)]);
        } else {
            let w = 1.0 / (h * h);
            entries.extend([(p, p, -4.0 * w), (p, p - 1, w), (p, p + 1, w), (p, p - m, w), (p, p + m, w)]);
        }
    }
    CsrMatrix::from_triplets(m * m, m * m, entries)
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn solver_inverts_random_matrices_and_knows_their_condition(seed in any::<u64>(), n in 1_usize..40) {
        let a = random_matrix(n, 4, 0.7, seed).unwrap();
        let b = noise(n, seed ^ 3);
        let exact = dense(&a).lu().solve(&DVector::from_row_slice(&b)).unwrap();
        let condition = condition(&a);
        for mut solver in solvers(&a).unwrap() {
            let mut x = vec![f64::NAN; n];
            solver.solve(&b, &mut x).unwrap();
            // Relative residual 1e-13, or rounding of (k + 1) terms, in norms that differ by n.
            let bound = (1e-13 + 8.0 * EPS) * n as f64 * condition;
            prop_assert!((DVector::from_vec(x) - &exact).norm() <= bound * exact.norm());
            let estimate = solver.condition().unwrap();
            // A lower bound but for the accuracy of the solves.
            prop_assert!(estimate <= condition * (1.0 + 1e-7), "{} {}", estimate, condition);
            prop_assert!(estimate >= condition / 10.0, "{} {}", estimate, condition);
        }
    }
}

#[test]
fn condition_estimate_is_rarely_below_half_the_true_value() -> Result<()> {
    const SEEDS: u64 = 1000;
    let mut low = 0;
    for seed in 0..SEEDS {
        let a = random_matrix(5 + seed as usize % 30, 4, 0.7, seed)?;
        let estimate = SparseSolver::gmres(a.clone(), Gmres::new())?.condition()?;
        low += usize::from(estimate < 0.5 * condition(&a));
    }
    // Of 20,000 such matrices 12 were below.
    assert!(low <= 5, "{low} of {SEEDS}");
    Ok(())
}

#[test]
fn solver_of_nothing_solves_nothing() -> Result<()> {
    for mut solver in solvers(&CsrMatrix::identity(0)?)? {
        assert_eq!(solver.solve(&[], &mut [])?.residual, 0.0);
        assert_eq!(solver.condition()?, 0.0);
    }
    Ok(())
}

#[test]
fn solver_serves_rows_of_different_scale_and_any_right_hand_side() -> Result<()> {
    let m = 40;
    let a = steady(m)?;
    let exact: Vec<f64> = (0..m * m).map(|p| ((p / m) as f64 * 0.1).sin() + (p % m) as f64 * 0.02).collect();
    let mut b = vec![0.0; m * m];
    a.multiply(&exact, &mut b)?;
    for mut solver in solvers(&a)? {
        let condition = solver.condition()?;
        assert!((1e3..1e5).contains(&condition), "{condition}");
        let mut x = vec![0.0; m * m];
        let report = solver.solve(&b, &mut x)?;
        let error = x.iter().zip(&exact).fold(0.0_f64, |worst, (x, exact)| worst.max((x - exact).abs()));
        assert!(error <= condition * 1e-13, "{error} {report:?}");
        // A smooth source and homogeneous walls: |A| |x| is h^-2 |b|, so 1e-13 is below rounding, and known to be.
        let source: Vec<f64> = (0..m * m).map(|p| if p % m == 0 || p % m == m - 1 { 0.0 } else { 1.0 }).collect();
        assert!(solver.solve(&source, &mut x)?.residual < 1e-11);
        assert_eq!(solver.solve(&vec![0.0; m * m], &mut x)?.residual, 0.0);
        assert!(x.iter().all(|&x| x == 0.0));
    }
    Ok(())
}

#[test]
fn solver_gives_equal_bits_when_rows_are_scaled_by_powers_of_two() -> Result<()> {
    let a = random_matrix(50, 5, 0.9, 77)?;
    let b = noise(50, 78);
    let power = |row: usize| 2.0_f64.powi((row * 37 % 400) as i32 - 200);
    let scaled = CsrMatrix::from_triplets(50, 50, a.triplets().map(|(p, q, value)| (p, q, value * power(p))))?;
    let scaled_b: Vec<f64> = b.iter().enumerate().map(|(p, b)| b * power(p)).collect();
    for (mut one, mut other) in solvers(&a)?.into_iter().zip(solvers(&scaled)?) {
        let (mut x, mut y) = (vec![0.0; 50], vec![0.0; 50]);
        one.solve(&b, &mut x)?;
        other.solve(&scaled_b, &mut y)?;
        assert_eq!(x, y);
        assert_eq!(one.condition()?, other.condition()?);
    }
    Ok(())
}

#[test]
fn solver_refuses_what_it_cannot_solve() -> Result<()> {
    let wide = CsrMatrix::<f64>::from_triplets(2, 3, [])?;
    assert_eq!(linear(SparseSolver::new(wide).unwrap_err()), LinearError::NotSquare { rows: 2, columns: 3 });
    for mut solver in solvers(&convection(5, 0.1)?)? {
        let mut x = [7.0; 25];
        let mut b = [1.0; 25];
        assert_eq!(linear(solver.solve(&b[1..], &mut x).unwrap_err()), LinearError::Length { found: 24, needed: 25 });
        assert_eq!(linear(solver.solve(&b, &mut x[1..]).unwrap_err()), LinearError::Length { found: 24, needed: 25 });
        b[9] = f64::NAN;
        assert_eq!(solver.solve(&b, &mut x).unwrap_err().particle(), Some(9));
        assert_eq!(x, [7.0; 25]);
    }
    let mut slow = SparseSolver::gmres(convection(20, 0.0)?, Gmres::new().most(3))?;
    let error = slow.solve(&[1.0; 400], &mut [0.0; 400]).unwrap_err();
    assert!(matches!(linear(error), LinearError::NotConverged { iterations: 3, residual, .. } if residual > 1e-3));
    assert!(matches!(linear(slow.condition().unwrap_err()), LinearError::NotConverged { .. }));
    Ok(())
}

#[test]
fn solver_recovers_a_cubic_from_dcpse_rows_and_dirichlet_rows() -> Result<()> {
    const M: usize = 24;
    let (h, m) = (1.0 / (M - 1) as f64, M);
    let mut random = Random::new(31);
    let points = (0..m * m).map(|p| {
        [p / m, p % m].map(|i| {
            let jitter = if i == 0 || i == m - 1 { 0.0 } else { 0.2 * (random.uniform() - 0.5) };
            (i as f64 + jitter) * h
        })
    });
    let particles = Particles::new(points.collect())?;
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let cells = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let mut matrix = laplacian.assemble(&cells)?.to_csr(0)?;
    let walls = |p: &usize| [p / m, p % m].iter().any(|&i| i == 0 || i == m - 1);
    matrix.replace_rows(&CsrMatrix::identity(m * m)?, (0..m * m).filter(walls).map(|p| (p, p)))?;

    // Order 2 reproduces cubics, so only rounding is left: of the weights, and of the solve.
    let cubic = |[x, y]: [f64; 2]| x * x * x - 2.0 * x * y * y + y * y - x + 0.5;
    let source = |[x, _]: [f64; 2]| 6.0 * x - 4.0 * x + 2.0;
    let right = |(p, x): (usize, &[f64; 2])| if walls(&p) { cubic(*x) } else { source(*x) };
    let b: Vec<f64> = particles.points().iter().enumerate().map(right).collect();
    let exact = condition(&matrix);
    for mut solver in solvers(&matrix)? {
        let mut u = vec![0.0; m * m];
        let report = solver.solve(&b, &mut u)?;
        let error = u.iter().zip(particles.points()).fold(0.0_f64, |worst, (u, x)| worst.max((u - cubic(*x)).abs()));
        let estimate = solver.condition()?;
        assert!((0.3 * exact..=exact * (1.0 + 1e-7)).contains(&estimate), "{estimate} {exact}");
        assert!(error <= 1e-13 * exact, "{error:e} {exact:e} {report:?}");
    }
    Ok(())
}

#[cfg(feature = "faer")]
#[test]
fn lu_solves_where_an_incomplete_factor_has_no_pivot_and_refuses_singular_matrices() -> Result<()> {
    let swap = CsrMatrix::from_triplets(2, 2, [(0, 1, 1.0), (1, 0, 2.0)])?;
    assert!(SparseSolver::gmres(swap.clone(), Gmres::new()).is_err());
    let mut x = [0.0; 2];
    SparseSolver::lu(swap)?.solve(&[3.0, 8.0], &mut x)?;
    assert_eq!(x, [4.0, 3.0]);
    let refused = |n: usize, entries: &[(usize, usize, f64)]| -> LinearError {
        linear(SparseSolver::lu(CsrMatrix::from_triplets(n, n, entries.iter().copied()).unwrap()).unwrap_err())
    };
    let singular = |error| matches!(error, LinearError::Singular { condition } if condition > 1e15);
    assert!(singular(refused(2, &[(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 4.0)])));
    assert!(singular(refused(2, &[(0, 0, 1.0), (1, 0, 1.0)])), "an empty column");
    assert!(singular(refused(2, &[(0, 0, 1.0), (0, 1, 1.0)])), "an empty row");
    assert!(singular(refused(1, &[])), "nothing");
    let counted: Vec<_> = (0..9).map(|i| (i / 3, i % 3, (i + 1) as f64)).collect();
    assert!(singular(refused(3, &counted)));
    // A Laplacian with nothing but Neumann walls annihilates constants.
    let m = 30_usize;
    let mut walls = Vec::new();
    for p in 0..m * m {
        let (i, j) = (p / m, p % m);
        for q in [(i > 0, p.wrapping_sub(m)), (i + 1 < m, p + m), (j > 0, p.wrapping_sub(1)), (j + 1 < m, p + 1)] {
            if q.0 {
                walls.extend([(p, q.1, 1.0), (p, p, -1.0)]);
            }
        }
    }
    assert!(singular(refused(m * m, &walls)));
    Ok(())
}

#[cfg(feature = "faer")]
#[test]
fn faer_matrices_hold_the_same_entries() -> Result<()> {
    let a = CsrMatrix::from_triplets(3, 4, [(2, 3, 1.5), (0, 1, -1.0), (2, 0, 4.0), (1, 1, 0.5)])?;
    let (rows, columns) = (a.to_faer_rows(), a.to_faer_columns()?);
    assert_eq!((rows.nrows(), rows.ncols(), columns.nrows(), columns.ncols()), (3, 4, 3, 4));
    for p in 0..3 {
        for q in 0..4 {
            let entry = a.triplets().find(|e| (e.0, e.1) == (p, q)).map(|e| e.2);
            assert_eq!((rows.get(p, q).copied(), columns.get(p, q).copied()), (entry, entry));
        }
    }
    Ok(())
}
