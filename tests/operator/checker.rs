//! The method checker: ours pass, and every broken promise is caught as the fault it is.

use std::sync::atomic::{AtomicU32, Ordering};

use parops::testing::{MethodFault, check_method, check_method_moments};
use parops::{
    Allowance, Breach, CellList, D2, Domain, Epsilon, Error, Face, Form, Gaussian, Gradient, HighOrderGaussian,
    Laplacian, Method, Operator, PairScratch, Particles, Pse, Random, Result, RowReport, Sign, Sph, SphForm, Stencil,
    Volumes, WideGaussian,
};

/// A set, a domain and volumes that spare no method: scattered, mirrors of both kinds, unequal volumes.
fn scattered() -> (Particles<2>, Domain<2>) {
    let mut random = Random::new(4);
    let volumes = Volumes::each((0..64).map(|_| (0.5 + random.uniform()) / 64.0).collect()).unwrap();
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [8; 2], 0.3, 2).unwrap().with_volumes(volumes).unwrap();
    let faces = [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]];
    (particles, Domain::new([0.0; 2], [1.0; 2], faces).unwrap())
}

#[test]
fn pse_keeps_the_promises_on_a_scattered_set_with_mirrors() {
    let (particles, domain) = scattered();
    let (epsilon, volumes) = (Epsilon::global(0.15).unwrap(), particles.volumes().unwrap());
    let neighbors = CellList::build(&particles, &domain, epsilon.cutoff(3.0)).unwrap();
    let laplacian = Pse::new(Laplacian::<2>, 4, epsilon.clone(), volumes).unwrap().support(3.0).unwrap();
    assert_eq!(check_method(&laplacian, &neighbors), Ok(()));
    assert_eq!(check_method(&laplacian.clone().allow(Allowance::at([3, 5])), &neighbors), Ok(()));
    assert_eq!(check_method(&laplacian.form(Form::Strengths).unwrap(), &neighbors), Ok(()));
    for sign in [Sign::Minus, Sign::Plus] {
        let gradient = Pse::new(Gradient::<2>, 2, epsilon.clone(), volumes).unwrap().support(3.0).unwrap();
        assert_eq!(check_method(&gradient.sign(sign).unwrap(), &neighbors), Ok(()));
    }
    let each = Epsilon::each((0..64).map(|p| 0.15 - 1e-3 * f64::from(p)).collect()).unwrap();
    let wide = Pse::with_kernels([WideGaussian::<2>::new()], each, volumes).unwrap().support(3.0).unwrap();
    assert_eq!(check_method(&wide, &neighbors), Ok(()));
}

#[test]
fn sph_keeps_the_promises_at_particles_and_points() {
    let (particles, domain) = scattered();
    let (epsilon, volumes) = (Epsilon::global(0.15).unwrap(), particles.volumes().unwrap());
    let neighbors = CellList::build(&particles, &domain, epsilon.cutoff(3.0)).unwrap();
    let points = [[0.2, 0.3], [0.5, 0.0], [0.9, 1.0]];
    let between = CellList::build_at(&points, &particles, &domain, epsilon.cutoff(3.0)).unwrap();
    for form in [SphForm::Summation, SphForm::Difference] {
        let kernel = HighOrderGaussian::<2>::new(4).unwrap();
        let sph = Sph::new(Gradient::<2>, kernel, epsilon.clone(), volumes).unwrap().support(3.0).unwrap();
        let sph = sph.form(form).unwrap();
        assert_eq!(check_method(&sph, &neighbors), Ok(()));
        match (form, check_method(&sph, &between)) {
            (SphForm::Summation, found) => assert_eq!(found, Ok(())),
            (SphForm::Difference, found) => assert!(matches!(found, Err(MethodFault::Refused { .. }))),
        }
    }
    let smooth = Sph::new(D2::<0, 0>::default(), Gaussian::<2>::new(), epsilon, volumes).unwrap().support(3.0).unwrap();
    assert_eq!(check_method(&smooth, &between), Ok(()));
}

/// PSE and SPH miss the conditions on a lattice by aliasing and truncation: below 1e-8 of the absolute terms at
/// h/epsilon = 1/2 and a support of 6.
const LATTICE: f64 = 1e-8;

#[test]
fn rows_on_lattices_are_exact_up_to_degree_plus_order_minus_one_and_not_beyond() {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [32; 2]).unwrap();
    let (epsilon, volumes) = (Epsilon::global(2.0 / 32.0).unwrap(), particles.volumes().unwrap());
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let points = [[0.51, 0.52], [0.3, 0.97]];
    for order in [2, 4] {
        let neighbors = CellList::build(&particles, &torus, epsilon.cutoff(6.0)).unwrap();
        let pse = Pse::new(Laplacian::<2>, order, epsilon.clone(), volumes).unwrap();
        assert_eq!(check_method_moments(&pse, &neighbors, &Laplacian::<2>, order + 1, LATTICE), Ok(()));
        let beyond = check_method_moments(&pse, &neighbors, &Laplacian::<2>, order + 2, LATTICE);
        assert!(matches!(beyond, Err(MethodFault::Moment { alpha, .. }) if alpha.degree() == order + 2));

        // The same conditions at points that are no particles, for the gradient of a smooth approximation.
        let between = CellList::build_at(&points, &particles, &torus, epsilon.cutoff(6.0)).unwrap();
        let kernel = HighOrderGaussian::<2>::new(order).unwrap();
        let sph = Sph::new(Gradient::<2>, kernel, epsilon.clone(), volumes).unwrap();
        assert_eq!(check_method_moments(&sph, &between, &Gradient::<2>, order, LATTICE), Ok(()));
        let beyond = check_method_moments(&sph, &between, &Gradient::<2>, order + 1, LATTICE);
        assert!(matches!(beyond, Err(MethodFault::Moment { alpha, .. }) if alpha.degree() == order + 1));
    }
}

/// What a broken method does wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    NanCutoff,
    Refuses,
    SkipsWeight,
    SkipsDiagonal,
    Overflows,
    Counts,
    Remembers,
    ReportsOther,
    ReportsNoNeighbors,
    DropsSumAbs,
    NanDefect,
    NegativeBound,
    SmallBreach,
    EmptyLeave,
    IgnoresSigns,
    ForgetsDiagonal,
    NoBound,
    Doubles,
}

/// PSE of the Laplacian, broken at target 5.
struct Broken {
    inner: Pse<parops::Exchange<2>>,
    how: How,
    calls: AtomicU32,
}

impl Method<2> for Broken {
    type Out = [f64; 1];
    type Scratch = (PairScratch<2>, Option<usize>);

    fn scratch(&self) -> Result<Self::Scratch> {
        Ok((self.inner.scratch()?, None))
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        if self.how == How::NanCutoff && p == 5 { Ok(Some(f64::NAN)) } else { Method::cutoff(&self.inner, p) }
    }

    fn weights(
        &self,
        row: &Stencil<2>,
        (scratch, before): &mut Self::Scratch,
        w: &mut [[f64; 1]],
        diagonal: &mut [f64; 1],
    ) -> Result<()> {
        let (last, held, own) = (w.len() - 1, w[w.len() - 1], *diagonal);
        self.inner.weights(row, scratch, w, diagonal)?;
        let again = before.replace(row.target()).is_some();
        if row.target() != 5 {
            return Ok(());
        }
        match self.how {
            How::Refuses => return Err(Error::user(7)),
            How::SkipsWeight => w[last] = held,
            How::SkipsDiagonal => *diagonal = own,
            How::Overflows => w[0] = [f64::INFINITY],
            How::Counts => w[0][0] += f64::from(self.calls.fetch_add(1, Ordering::Relaxed)),
            How::Remembers if again => w[0][0] *= 1.0 + f64::EPSILON,
            How::IgnoresSigns => {
                for (w, &sign) in w.iter_mut().zip(row.signs()) {
                    w[0] *= f64::from(sign);
                }
            }
            How::ForgetsDiagonal => *diagonal = [0.0],
            How::Doubles => w.iter_mut().for_each(|w| w[0] *= 2.0),
            _ => {}
        }
        Ok(())
    }

    fn report(&self, row: &Stencil<2>, _: &Self::Scratch, w: &[[f64; 1]], diagonal: &[f64; 1]) -> Result<RowReport> {
        let mut report = RowReport::of(row, w, diagonal);
        if self.how == How::NoBound {
            report.spectral_bound = 0.0;
        }
        if row.target() != 5 {
            return Ok(report);
        }
        match self.how {
            How::ReportsOther => report.target = 6,
            How::ReportsNoNeighbors => report.neighbors = 0,
            How::DropsSumAbs => report.sum_abs *= 0.999,
            How::NanDefect => report.moment_defect = f64::NAN,
            How::NegativeBound => report.spectral_bound = -1.0,
            How::SmallBreach => report.breach = Some(Breach::Moment { defect: 0.5, limit: 1.0 }),
            How::EmptyLeave => report.allowed = true,
            _ => {}
        }
        Ok(report)
    }
}

fn fault(how: How) -> Option<MethodFault<2>> {
    let (particles, domain) = scattered();
    let epsilon = Epsilon::global(0.15).unwrap();
    let neighbors = CellList::build(&particles, &domain, epsilon.cutoff(3.0)).unwrap();
    let inner = Pse::new(Laplacian::<2>, 2, epsilon, particles.volumes().unwrap()).unwrap().support(3.0).unwrap();
    check_method(&Broken { inner, how, calls: AtomicU32::new(0) }, &neighbors).err()
}

#[test]
fn every_broken_promise_is_caught_at_its_target() {
    let caught = |how| fault(how).unwrap_or_else(|| panic!("{how:?} passes"));
    assert!(matches!(caught(How::NanCutoff), MethodFault::Cutoff { p: 5, cutoff, .. } if cutoff.is_nan()));
    assert_eq!(caught(How::Refuses), MethodFault::Refused { error: Error::user(7).at(5) });
    assert!(matches!(caught(How::SkipsWeight), MethodFault::Unwritten { p: 5, q: Some(_) }));
    assert_eq!(caught(How::SkipsDiagonal), MethodFault::Unwritten { p: 5, q: None });
    assert!(matches!(caught(How::Overflows), MethodFault::NotFinite { p: 5, q: Some(_), value: f64::INFINITY }));
    assert_eq!(caught(How::Counts), MethodFault::Unsteady { p: 5 });
    assert_eq!(caught(How::Remembers), MethodFault::Scratch { p: 5 });
    assert!(matches!(caught(How::ReportsOther), MethodFault::Named { p: 5, target: 6, .. }));
    assert!(matches!(caught(How::ReportsNoNeighbors), MethodFault::Named { p: 5, neighbors: 0, expected: 1.., .. }));
    assert!(matches!(caught(How::DropsSumAbs), MethodFault::SumAbs { p: 5, found, expected } if found < expected));
    assert!(matches!(caught(How::NanDefect), MethodFault::Figure { p: 5, figure } if figure.is_nan()));
    assert_eq!(caught(How::NegativeBound), MethodFault::Figure { p: 5, figure: -1.0 });
    assert_eq!(caught(How::SmallBreach), MethodFault::Breach { p: 5, severity: 0.5 });
    assert_eq!(caught(How::EmptyLeave), MethodFault::Breach { p: 5, severity: 0.0 });
    assert!(matches!(caught(How::IgnoresSigns), MethodFault::Sign { p: 5, q: Some(_), .. }));
    assert!(matches!(caught(How::ForgetsDiagonal), MethodFault::Sign { p: 5, q: None, weight: 0.0, turned: 0.0 }));
    assert!(matches!(caught(How::NoBound), MethodFault::SpectralBound { bound: 0.0, mean } if mean > 0.0));
}

#[test]
fn weights_of_another_operator_are_caught_by_their_moments() {
    let particles = Particles::lattice([0.0; 2], [1.0; 2], [32; 2]).unwrap();
    let epsilon = Epsilon::global(2.0 / 32.0).unwrap();
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let neighbors = CellList::build(&particles, &torus, epsilon.cutoff(6.0)).unwrap();
    let inner = Pse::new(Laplacian::<2>, 2, epsilon, particles.volumes().unwrap()).unwrap();
    let twice = Broken { inner: inner.clone(), how: How::Doubles, calls: AtomicU32::new(0) };
    let Err(MethodFault::Moment { p: 5, output: 0, alpha, found, required, .. }) =
        check_method_moments(&twice, &neighbors, &Laplacian::<2>, 3, LATTICE)
    else {
        panic!("twice the weights pass");
    };
    assert_eq!((alpha.degree(), required), (2, 2.0));
    assert!((found - 4.0).abs() < 1e-6);
    let other = D2::<2, 0>::default() + 0.5 * D2::<0, 2>::default();
    assert!(moments(&inner, &neighbors, &other).is_err());
    assert!(moments(&inner, &neighbors, &(D2::<0, 2>::default() + D2::<2, 0>::default())).is_ok());
}

fn moments(
    method: &impl Method<2, Out = [f64; 1]>,
    neighbors: &CellList<2>,
    operator: &impl Operator<2, Out = [f64; 1]>,
) -> std::result::Result<(), MethodFault<2>> {
    check_method_moments(method, neighbors, operator, 3, LATTICE)
}

#[test]
fn faults_read_as_sentences_with_their_numbers() {
    assert_eq!(fault(How::NegativeBound).unwrap().to_string(), "target 5: a figure of the report is -1");
    assert_eq!(fault(How::SkipsDiagonal).unwrap().to_string(), "target 5: the diagonal is not written");
}
