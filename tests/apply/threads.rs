//! The same bits, and the same first error, whatever the number of threads.

use parops::{
    Allowance, Apply, CellList, Cutoff, DcPse, Domain, Epsilon, Error, Exchange, Face, Gradient, Laplacian, Method,
    PairScratch, Particles, Pse, Random, Report, Result, RowReport, Rows, Sign, Stencil, Strided, testing::Promise,
};

/// More rows than three blocks of work hold, with all kinds of faces.
fn particles() -> (Particles<2>, Domain<2>) {
    let faces = [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]];
    (Particles::jittered([0.0; 2], [1.0; 2], [45; 2], 0.3, 5).unwrap(), Domain::new([0.0; 2], [1.0; 2], faces).unwrap())
}

/// Everything that threads take part in, as bits.
#[derive(Debug, PartialEq)]
struct Bits {
    rows: Rows,
    single: Rows<[f64; 1], f32>,
    gradient: Rows<[f64; 2]>,
    corrected: Rows,
    corrected_gradient: Rows<[f64; 2]>,
    free: Report,
    applied: Vec<Vec<u64>>,
}

fn work(particles: &Particles<2>, domain: &Domain<2>) -> Bits {
    let epsilon = Epsilon::global(2.0 / 45.0).unwrap();
    let volumes = particles.volumes().unwrap();
    let laplacian = Pse::new(Laplacian::<2>, 4, epsilon.clone(), volumes).unwrap().allow(Allowance::Everywhere);
    let laplacian = laplacian.support(4.0).unwrap();
    let gradient = Pse::new(Gradient::<2>, 2, epsilon, volumes).unwrap().allow(Allowance::Everywhere);
    let gradient = gradient.sign(Sign::Plus).unwrap().support(4.0).unwrap();
    let neighbors = CellList::build(particles, domain, laplacian.cutoff()).unwrap();
    let rows = laplacian.assemble(&neighbors).unwrap();
    let single = Rows::<_, f32>::assemble(&laplacian, &neighbors).unwrap();
    let gradient = gradient.assemble(&neighbors).unwrap();
    let free = laplacian.matrix_free(&neighbors).unwrap();
    let near = CellList::build(particles, domain, Cutoff(4.0 / 45.0)).unwrap();
    let corrected = DcPse::<Laplacian<2>, 4>::new();
    let corrected_free = corrected.matrix_free(&near).unwrap();
    let (corrected, corrected_gradient) =
        (corrected.assemble(&near).unwrap(), DcPse::<Gradient<2>, 3>::new().assemble(&near).unwrap());

    let n = particles.len();
    let mut random = Random::new(8);
    let f: Vec<f64> = (0..n).map(|_| random.normal()).collect();
    let f32s: Vec<f32> = f.iter().map(|&f| f as f32).collect();
    let (mut out, mut outs, mut short) = (vec![0.0; n], vec![[0.0; 2]; n], vec![0.0_f32; n]);
    let mut applied = Vec::new();
    let bits = |out: &[f64]| out.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    rows.apply(&f, &mut out).unwrap();
    applied.push(bits(&out));
    free.apply(&f, &mut out).unwrap();
    applied.push(bits(&out));
    gradient.apply_all(&f, &mut outs).unwrap();
    applied.push(bits(outs.as_flattened()));
    gradient.apply_dot(&outs, &mut out).unwrap();
    applied.push(bits(&out));
    gradient.apply_along(&outs, &f, &mut out).unwrap();
    applied.push(bits(&out));
    gradient.apply_curl(&outs, &mut out).unwrap();
    applied.push(bits(&out));
    let (stacked, mut results) = ([&f[..], &out].concat(), vec![0.0; 2 * n]);
    let two = || Strided::stacked(&stacked[..], 2).unwrap();
    rows.apply_strided(two(), Strided::stacked(&mut results[..], 2).unwrap()).unwrap();
    applied.push(bits(&results));
    rows.apply_strided(two(), Strided::interleaved(&mut results[..], 2).unwrap()).unwrap();
    applied.push(bits(&results));
    single.apply(&f32s, &mut short).unwrap();
    applied.push(short.iter().map(|x| u64::from(x.to_bits())).collect());
    free.apply(&f32s, &mut short).unwrap();
    applied.push(short.iter().map(|x| u64::from(x.to_bits())).collect());
    corrected.apply(&f, &mut out).unwrap();
    applied.push(bits(&out));
    corrected_free.apply(&f, &mut out).unwrap();
    applied.push(bits(&out));
    let free = *free.report();
    Bits { rows, single, gradient, corrected, corrected_gradient, free, applied }
}

/// PSE that refuses some targets, the first of them late in the second block.
struct Refusing(Pse<Exchange<2>>);

const REFUSED: [usize; 4] = [1023, 1024, 1600, 2024];

impl Method<2> for Refusing {
    type Out = [f64; 1];
    type Scratch = PairScratch<2>;

    fn scratch(&self) -> Result<PairScratch<2>> {
        self.0.scratch()
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        Method::cutoff(&self.0, p)
    }

    fn weights(
        &self,
        row: &Stencil<2>,
        scratch: &mut PairScratch<2>,
        w: &mut [[f64; 1]],
        d: &mut [f64; 1],
    ) -> Result<()> {
        if REFUSED.contains(&row.target()) {
            return Err(Error::user(row.target() as i64));
        }
        self.0.weights(row, scratch, w, d)
    }

    fn report(&self, row: &Stencil<2>, scratch: &PairScratch<2>, w: &[[f64; 1]], d: &[f64; 1]) -> Result<RowReport> {
        self.0.report(row, scratch, w, d)
    }
}

/// The errors of a build that fails row by row, of one that fails by its worst row, and of an application.
fn errors(particles: &Particles<2>, domain: &Domain<2>) -> Vec<Error> {
    let epsilon = Epsilon::global(2.0 / 45.0).unwrap();
    let pse = Pse::new(Laplacian::<2>, 2, epsilon, particles.volumes().unwrap()).unwrap().support(4.0).unwrap();
    let neighbors = CellList::build(particles, domain, pse.cutoff()).unwrap();
    let worst = pse.assemble(&neighbors).unwrap_err();
    let refusing = Refusing(pse.allow(Allowance::Everywhere));
    let first = Rows::<[f64; 1]>::assemble(&refusing, &neighbors).unwrap_err();
    let free = parops::MatrixFree::new(&refusing, &neighbors).err().unwrap();
    let rows = refusing.0.assemble(&neighbors).unwrap();
    let mut f = vec![1.0; particles.len()];
    (f[1999], f[700]) = (f64::INFINITY, f64::INFINITY);
    let field = rows.apply(&f, &mut vec![0.0; particles.len()]).unwrap_err();
    let huge: Vec<f64> =
        (0..particles.len()).map(|p| if p >= 600 && p % 2 == 0 { 1.7e308 } else { -1.7e308 }).collect();
    let overflow = rows.apply(&huge, &mut vec![0.0; particles.len()]).unwrap_err();
    vec![worst, first, free, field, overflow]
}

#[test]
fn a_second_run_gives_the_same_bits_and_errors() {
    let (particles, domain) = particles();
    let again = Promise::new("Reproducibility", "rows, reports, applications, bits of a second run");
    again.equal(&work(&particles, &domain), &work(&particles, &domain));
    let errors = errors(&particles, &domain);
    assert_eq!(format!("{errors:?}"), format!("{:?}", self::errors(&particles, &domain)));
    assert_eq!(errors[1], Error::user(REFUSED[0] as i64).at(REFUSED[0]));
    assert_eq!((&errors[2], errors[3].particle()), (&errors[1], Some(700)));
    assert!(errors[4].particle().is_some_and(|p| p < 600), "a neighbor of 600 or of its image comes before it");
}

#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_gives_the_same_bits_and_errors() {
    let (particles, domain) = particles();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (work(&particles, &domain), errors(&particles, &domain)))
    };
    let (bits, errors) = with(1);
    for threads in [2, 3, 8] {
        for _ in 0..3 {
            let (again, error) = with(threads);
            let same = |text| Promise::new("Reproducibility", text);
            same("rows, reports, applications, bits on 1, 2, 3, 8 threads").equal(&bits, &again);
            let (errors, error) = (format!("{errors:?}"), format!("{error:?}"));
            same("first errors of builds and applications on 1, 2, 3, 8 threads").equal(&errors, &error);
        }
    }
}
