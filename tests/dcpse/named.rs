//! Named operators and coefficients per particle, by DC-PSE on scattered sets up to their edges.

use parops::{
    Along, AlongTwice, Apply, BiLaplacian, CellList, Contraction, Curl, Cutoff, DcPse, DivGrad, Domain, ErrorKind,
    Fallback, Gradient, Hessian, Laplacian, Neighbor, Neighbors, Operator, ParticleError, Particles, Rows, Sign,
    testing::Promise,
};

type Failure = Result<(), parops::Error>;

/// A miss of 1e-12 in scaled units, times epsilon^-m of the sets below (10^2 for second, 10^4 for fourth derivatives)
/// and values of f below 10, summed over a row.
const MISS: [f64; 5] = [0.0, 1e-9, 1e-8, 1e-7, 1e-6];

fn scattered<const D: usize>(m: usize) -> Particles<D> {
    Particles::jittered([0.0; D], [1.0; D], [m; D], 0.3, 7).unwrap()
}

fn sampled<const D: usize, V>(particles: &Particles<D>, f: impl Fn(&[f64; D]) -> V) -> Vec<V> {
    particles.points().iter().map(f).collect()
}

fn rows<Op, const D: usize, const K: usize, const R: u32>(
    dcpse: &DcPse<Op, R>,
    particles: &Particles<D>,
) -> Rows<[f64; K]>
where
    Op: Operator<D, Out = [f64; K]>,
{
    let cutoff = dcpse.cutoff(particles).unwrap();
    dcpse.assemble(&CellList::build(particles, &Domain::open(), cutoff).unwrap()).unwrap()
}

/// The largest difference between two fields of several values.
fn miss<'a>(found: impl IntoIterator<Item = &'a f64>, exact: impl IntoIterator<Item = &'a f64>) -> f64 {
    let mut exact = exact.into_iter();
    let miss = found.into_iter().map(|found| (found - exact.next().unwrap()).abs()).fold(0.0, f64::max);
    assert!(exact.next().is_none());
    miss
}

fn is_exact(degree: usize, miss: f64) {
    let text = format!("named operators of degree {degree} on polynomials of their exactness, to the edges");
    Promise::new("Residuals", text).at_most(MISS[degree], miss);
}

/// (x^2 y - 2 x y z + z^3 ...) and what it becomes, in three dimensions.
fn cubic(x: &[f64; 3]) -> f64 {
    let [x, y, z] = *x;
    x * x * y - 2.0 * x * y * z + z * z * z + x * x - y * z + 4.0
}

fn cubic_hessian(x: &[f64; 3]) -> [f64; 6] {
    let [x, y, z] = *x;
    [2.0 * y + 2.0, 2.0 * x - 2.0 * z, -2.0 * y, 0.0, -2.0 * x - 1.0, 6.0 * z]
}

#[test]
fn hessian_of_a_cubic_is_exact_in_the_order_xx_xy_xz_yy_yz_zz() -> Failure {
    let particles = scattered::<3>(8);
    let hessian = rows(&DcPse::<Hessian<3>, 2>::new(), &particles);
    let mut out = vec![[0.0; 6]; particles.len()];
    hessian.apply_all(&sampled(&particles, cubic), &mut out)?;
    is_exact(2, miss(out.as_flattened(), sampled(&particles, cubic_hessian).as_flattened()));

    let plane = scattered::<2>(12);
    let mut out = vec![[0.0; 3]; plane.len()];
    rows(&DcPse::<Hessian<2>, 2>::new(), &plane).apply_all(&sampled(&plane, |x| x[0] * x[0] * x[1]), &mut out)?;
    let exact = sampled(&plane, |x| [2.0 * x[1], 2.0 * x[0], 0.0]);
    is_exact(2, miss(out.as_flattened(), exact.as_flattened()));

    let line = scattered::<1>(20);
    let mut out = vec![[0.0; 1]; line.len()];
    rows(&DcPse::<Hessian<1>, 2>::new(), &line).apply_all(&sampled(&line, |x| x[0].powi(3)), &mut out)?;
    is_exact(2, miss(out.as_flattened(), &sampled(&line, |x| 6.0 * x[0])));
    Ok(())
}

#[test]
fn laplacian_of_the_laplacian_is_exact_to_degree_five_in_one_solve() -> Failure {
    let particles = scattered::<2>(14);
    let bi = rows(&DcPse::<BiLaplacian<2>, 2>::new(), &particles);
    let f = sampled(&particles, |&[x, y]| x.powi(4) * y + 3.0 * x * x * y.powi(3) - y.powi(4) + x * y);
    let mut out = vec![0.0; f.len()];
    bi.apply(&f, &mut out)?;
    let exact = sampled(&particles, |&[_, y]| 24.0 * y + 2.0 * 36.0 * y - 24.0);
    is_exact(4, miss(&out, &exact));
    let space = scattered::<3>(8);
    let f = sampled(&space, |&[x, y, z]| x.powi(4) + x * x * y * y + y * y * z * z - z);
    let mut out = vec![0.0; f.len()];
    rows(&DcPse::<BiLaplacian<3>, 1>::new(), &space).apply(&f, &mut out)?;
    // 24 + 2 * 4 + 2 * 4
    is_exact(4, miss(&out, &vec![40.0; f.len()]));
    Ok(())
}

#[test]
fn directional_second_derivative_is_the_contraction_of_the_hessian_with_v_v() -> Failure {
    let particles = scattered::<3>(8);
    let v = [0.5, -2.0, 1.5];
    let f = sampled(&particles, cubic);
    let (mut one, mut contracted) = (vec![0.0; f.len()], vec![0.0; f.len()]);
    rows(&DcPse::<_, 2>::of(AlongTwice(v)), &particles).apply(&f, &mut one)?;
    let exact = |x: &[f64; 3]| {
        let packed = Hessian::<3>::packed(&v.map(|a| v.map(|b| a * b)));
        cubic_hessian(x).iter().zip(packed).map(|(h, a)| h * a).sum::<f64>()
    };
    assert!(miss(&one, &sampled(&particles, exact)) < 10.0 * MISS[2]);
    let hessian = DcPse::<Hessian<3>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), hessian.cutoff(&particles)?)?;
    let packed = Hessian::<3>::packed(&v.map(|a| v.map(|b| a * b)));
    Contraction::new(hessian, vec![packed; f.len()])?.assemble(&neighbors)?.apply(&f, &mut contracted)?;
    assert!(miss(&one, &contracted) < 10.0 * MISS[2]);
    Ok(())
}

#[test]
fn gradient_rows_give_divergence_curl_and_jacobian_of_quadratic_fields() -> Failure {
    let space = scattered::<3>(8);
    for sign in [Sign::Plus, Sign::Minus] {
        let rows = rows(&DcPse::<Curl<3>, 2>::new().sign(sign), &space);
        let f = sampled(&space, |&[x, y, z]| [x * y, y * z - x * x, x * z + 1.0]);
        let n = f.len();
        let (mut curl, mut divergence, mut jacobian) = (vec![[0.0; 3]; n], vec![0.0; n], vec![[[0.0; 3]; 3]; n]);
        rows.apply_curl(&f, &mut curl)?;
        rows.apply_dot(&f, &mut divergence)?;
        rows.apply_jacobian(&f, &mut jacobian)?;
        let exact = sampled(&space, |&[x, y, z]| [-y, -z, -2.0 * x - x]);
        is_exact(1, miss(curl.as_flattened(), exact.as_flattened()));
        is_exact(1, miss(&divergence, &sampled(&space, |&[x, y, z]| y + z + x)));
        let exact = sampled(&space, |&[x, y, z]| [[y, x, 0.0], [-2.0 * x, z, y], [z, 0.0, x]]);
        is_exact(1, miss(jacobian.as_flattened().as_flattened(), exact.as_flattened().as_flattened()));
    }
    let plane = scattered::<2>(12);
    let rows = rows(&DcPse::<Gradient<2>, 2>::new(), &plane);
    let mut curl = vec![0.0; plane.len()];
    rows.apply_curl(&sampled(&plane, |&[x, y]| [x * y - y * y, x * x]), &mut curl)?;
    is_exact(1, miss(&curl, &sampled(&plane, |&[x, y]| x + 2.0 * y)));
    Ok(())
}

#[test]
fn curl_and_jacobian_have_the_bits_of_their_parts_stored_and_matrix_free() -> Failure {
    let particles = scattered::<3>(8);
    let gradient = DcPse::<Gradient<3>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), gradient.cutoff(&particles)?)?;
    let (rows, free) = (gradient.assemble(&neighbors)?, gradient.matrix_free(&neighbors)?);
    let f = sampled(&particles, |&[x, y, z]| [x.sin(), (y * z).cos(), x - z * z]);
    let n = f.len();
    let (mut jacobian, mut again) = (vec![[[0.0; 3]; 3]; n], vec![[[0.0; 3]; 3]; n]);
    rows.apply_jacobian(&f, &mut jacobian)?;
    free.apply_jacobian(&f, &mut again)?;
    assert_eq!(jacobian, again);
    for i in 0..3 {
        let (component, mut alone) = (f.iter().map(|f| f[i]).collect::<Vec<_>>(), vec![[0.0; 3]; n]);
        rows.apply_all(&component, &mut alone)?;
        assert!(jacobian.iter().zip(&alone).all(|(jacobian, alone)| jacobian[i] == *alone));
    }
    let (mut curl, mut again) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    rows.apply_curl(&f, &mut curl)?;
    free.apply_curl(&f, &mut again)?;
    assert_eq!(curl, again);
    // curl grad = 0 only for exact second derivatives; against the Jacobian it holds to the rounding of the sums.
    let parts = jacobian.iter().map(|j| [j[2][1] - j[1][2], j[0][2] - j[2][0], j[1][0] - j[0][1]]).collect::<Vec<_>>();
    let sum_abs = rows.report().sum_abs;
    assert!(miss(curl.as_flattened(), parts.as_flattened()) < 100.0 * f64::EPSILON * 2.0 * sum_abs);
    Ok(())
}

#[test]
fn velocity_per_particle_is_one_weight_a_pair_and_equals_the_contraction_in_the_sweep() -> Failure {
    let particles = scattered::<2>(12);
    let gradient = DcPse::<Gradient<2>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), gradient.cutoff(&particles)?)?;
    let velocity = sampled(&particles, |&[x, y]| [-y, x + 0.5]);
    let f = sampled(&particles, |&[x, y]| x * x - x * y + 2.0 * y + 1.0);
    let (mut stored, mut swept, mut free) = (vec![0.0; f.len()], vec![0.0; f.len()], vec![0.0; f.len()]);
    let along = Contraction::new(gradient.clone(), velocity.clone())?;
    let rows = along.assemble(&neighbors)?;
    rows.apply(&f, &mut stored)?;
    along.matrix_free(&neighbors)?.apply(&f, &mut free)?;
    assert_eq!(stored, free);
    let rows_of_gradient = gradient.assemble(&neighbors)?;
    rows_of_gradient.apply_along(&velocity, &f, &mut swept)?;
    is_exact(1, miss(&stored, &sampled(&particles, |&[x, y]| -y * (2.0 * x - y) + (x + 0.5) * (2.0 - x))));
    assert!(miss(&stored, &swept) < 100.0 * f64::EPSILON * 4.0 * rows_of_gradient.report().sum_abs);
    // The certificate is that of the gradient, the gain that of the weights stored.
    let (report, of_gradient) = (rows.report(), rows_of_gradient.report());
    assert_eq!((report.condition, report.residual), (of_gradient.condition, of_gradient.residual));
    let gain = |p| rows.row(p).map(|row| row.diagonal[0].abs() + row.weights.iter().map(|w| w[0].abs()).sum::<f64>());
    let largest = (0..f.len()).filter_map(gain).fold(0.0, f64::max);
    assert!((report.sum_abs / largest - 1.0).abs() < 1e-14);

    let constant = Contraction::new(gradient, vec![[0.5, -2.0]; f.len()])?.assemble(&neighbors)?;
    constant.apply(&f, &mut stored)?;
    DcPse::<_, 2>::of(Along([0.5, -2.0])).assemble(&neighbors)?.apply(&f, &mut swept)?;
    is_exact(1, miss(&stored, &swept));
    Ok(())
}

#[test]
fn scalar_per_particle_multiplies_the_bits_of_one_output() -> Failure {
    let particles = scattered::<2>(10);
    let laplacian = DcPse::<Laplacian<2>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), laplacian.cutoff(&particles)?)?;
    let c = sampled(&particles, |x| [x[0] - 0.5]);
    let (plain, scaled) =
        (laplacian.assemble(&neighbors)?, Contraction::new(laplacian, c.clone())?.assemble(&neighbors)?);
    for (p, c) in c.iter().enumerate() {
        let (plain, scaled) = (plain.row(p).unwrap(), scaled.row(p).unwrap());
        assert!(plain.weights.iter().zip(scaled.weights).all(|(w, s)| c[0] * w[0] == s[0]));
    }
    Ok(())
}

/// Asks for a narrower support than it reaches, so that rows are refused and widened.
struct Narrow<'a>(&'a CellList<2>, f64);

impl Neighbors<2> for Narrow<'_> {
    fn targets(&self) -> usize {
        self.0.targets()
    }

    fn sources(&self) -> usize {
        self.0.sources()
    }

    fn center(&self, p: usize) -> Option<usize> {
        self.0.center(p)
    }

    fn cutoff(&self, _: usize) -> f64 {
        self.1
    }

    fn reach(&self) -> f64 {
        self.0.reach()
    }

    fn generation(&self) -> u64 {
        self.0.generation()
    }

    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(Neighbor<2>)) {
        self.0.for_each(p, cutoff, visit);
    }
}

#[test]
fn widened_lowered_and_empty_rows_pass_through_coefficients_bit_for_bit() -> Failure {
    let particles = scattered::<2>(14);
    let n = particles.len();
    for fallback in [Fallback::LowerOrder, Fallback::Empty] {
        let laplacian = DcPse::<Laplacian<2>, 4>::new().fallback(fallback);
        let cells = CellList::build(&particles, &Domain::open(), Cutoff(0.36))?;
        let neighbors = Narrow(&cells, 0.29);
        let plain = laplacian.assemble(&neighbors)?;
        let report = plain.report();
        assert!(report.grown > 0 && report.lowered + report.empty > 0 && report.grown < n, "{report:?}");
        let scaled = Contraction::new(laplacian.clone(), vec![[0.7]; n])?;
        let diffusion = DivGrad::new(laplacian, vec![0.7; n])?;
        for rows in [scaled.assemble(&neighbors)?, diffusion.assemble(&neighbors)?] {
            let found = rows.report();
            let of = |report: &parops::Report| (report.grown, report.lowered, report.empty, report.order, report.rungs);
            assert_eq!(of(found), of(report));
            for p in 0..n {
                let (plain, row) = (plain.row(p).unwrap(), rows.row(p).unwrap());
                assert!(plain.sources == row.sources);
                assert!(plain.weights.iter().zip(row.weights).all(|(w, s)| 0.7 * w[0] == s[0]));
            }
        }
    }
    // Without a policy the refusal is that of the method, with its particle.
    let laplacian = DcPse::<Laplacian<2>, 4>::new();
    let cells = CellList::build(&particles, &Domain::open(), Cutoff(0.3))?;
    let refused = laplacian.assemble(&cells).unwrap_err();
    assert_eq!(DivGrad::new(laplacian.clone(), vec![0.7; n])?.assemble(&cells).unwrap_err(), refused);
    assert_eq!(Contraction::new(laplacian, vec![[0.7]; n])?.assemble(&cells).unwrap_err(), refused);
    Ok(())
}

#[test]
fn coefficients_that_do_not_fit_are_refused_by_name() -> Failure {
    let particles = scattered::<2>(8);
    let gradient = DcPse::<Gradient<2>, 2>::new();
    let neighbors = CellList::build(&particles, &Domain::open(), gradient.cutoff(&particles)?)?;
    let mut velocity = vec![[1.0, 0.0]; 64];
    velocity[9][1] = f64::NEG_INFINITY;
    let error = Contraction::new(gradient.clone(), velocity).unwrap_err();
    let kind = ParticleError::Coefficient { output: 1, coefficient: f64::NEG_INFINITY };
    assert_eq!((error.particle(), error.kind()), (Some(9), &ErrorKind::Particle(kind)));
    let error = Contraction::new(gradient, vec![[1.0; 2]; 65])?.assemble(&neighbors).unwrap_err();
    assert_eq!(*error.kind(), ErrorKind::Particle(ParticleError::Length { found: 65, needed: 64 }));
    Ok(())
}
