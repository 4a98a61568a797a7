//! Transfer between particles and meshes: moments, reproduction, adjointness, periodic seams, bounds, threads.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    ApplyError, Centering, Cic, Domain, Error, Face, Lambda, Mesh, MeshError, MeshKernel, Ngp, ParticleError, Random,
    Result, Tsc, Volumes, testing::Promise,
};
use proptest::prelude::*;

/// Calls `$check::<D, _, S>(&kernel, "name", arguments)` for every kernel.
macro_rules! each_kernel {
    ($check:ident::<$d:literal>($($argument:expr),*)) => {{
        $check::<$d, 1>(&Ngp, "NGP", $($argument),*);
        $check::<$d, 2>(&Cic, "CIC", $($argument),*);
        $check::<$d, 3>(&Tsc, "TSC", $($argument),*);
        $check::<$d, 4>(&Lambda::<2, 1>::new().unwrap(), "(2, 1)", $($argument),*);
        $check::<$d, 4>(&Lambda::<2, 2>::new().unwrap(), "(2, 2)", $($argument),*);
        $check::<$d, 6>(&Lambda::<4, 2>::new().unwrap(), "(4, 2)", $($argument),*);
        $check::<$d, 6>(&Lambda::<4, 4>::new().unwrap(), "(4, 4)", $($argument),*);
        $check::<$d, 8>(&Lambda::<6, 4>::new().unwrap(), "(6, 4)", $($argument),*);
        $check::<$d, 8>(&Lambda::<6, 6>::new().unwrap(), "(6, 6)", $($argument),*);
        $check::<$d, 10>(&Lambda::<8, 4>::new().unwrap(), "(8, 4)", $($argument),*);
    }};
}

fn bounded<const D: usize>(lower: [f64; D], upper: [f64; D]) -> Domain<D> {
    Domain::new(lower, upper, [[Face::Open; 2]; D]).unwrap()
}

fn random_points<const D: usize>(count: usize, low: f64, high: f64, seed: u64) -> Vec<[f64; D]> {
    let mut random = Random::new(seed);
    (0..count).map(|_| std::array::from_fn(|_| low + (high - low) * random.uniform())).collect()
}

fn random_numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    (0..count).map(|_| random.normal()).collect()
}

/// A bounded mesh of spacing 1 around the origin, 7 spacings to either side, and how far from it any support fits.
fn unit_mesh<const D: usize>(centering: Centering) -> (Mesh<D>, f64) {
    let domain = bounded([-7.0; D], [7.0; D]);
    match centering {
        Centering::Nodes => (Mesh::nodes(&domain, [15; D]).unwrap(), 3.0),
        Centering::Cells => (Mesh::cells(&domain, [14; D]).unwrap(), 2.5),
    }
}

/// prod_i x_i^a_i for all a_i <= exactness, with the exponents in mixed radix.
fn monomials<const D: usize>(exactness: u32) -> impl Iterator<Item = [u32; D]> {
    let radix = exactness + 1;
    (0..radix.pow(D as u32)).map(move |i| std::array::from_fn(|axis| i / radix.pow(axis as u32) % radix))
}

fn power<const D: usize>(x: &[f64; D], exponents: [u32; D]) -> f64 {
    x.iter().zip(exponents).map(|(x, n)| x.powi(n as i32)).product()
}

/// prod_i (|x_i| + 1)^a_i, a bound on x^a and on its slopes within a spacing: 64 eps of it cover the roundings of the
/// terms and the place of a particle, of up to 16 spacings, being rounded by 8 eps.
fn size<const D: usize>(x: &[f64; D], exponents: [u32; D]) -> f64 {
    power(&x.map(|x| x.abs() + 1.0), exponents)
}

/// sum_p omega_p x_p^a.
fn moment<const D: usize>(points: &[[f64; D]], strengths: &[f64], exponents: [u32; D]) -> f64 {
    points.iter().zip(strengths).map(|(x, omega)| omega * power(x, exponents)).sum()
}

#[test]
fn depositing_conserves_all_moments_the_kernel_promises() {
    fn check<const D: usize, const S: usize>(kernel: &impl MeshKernel<f64, S>, name: &str, centering: Centering) {
        let (mesh, reach) = unit_mesh::<D>(centering);
        let points = random_points::<D>(60, -reach, reach, 11);
        let strengths = random_numbers(points.len(), 12);
        let mut values = vec![0.0; mesh.len()];
        mesh.deposit(kernel, &points, &strengths, &mut values).unwrap();
        let nodes: Vec<_> = mesh.points().collect();
        for exponents in monomials::<D>(kernel.exactness()) {
            let (before, after) = (moment(&points, &strengths, exponents), moment(&nodes, &values, exponents));
            let each = |(omega, x): (&f64, &[f64; D])| {
                let nodes = mesh.stencil(kernel, x).unwrap();
                let term =
                    |(node, w): (usize, f64)| (omega * w * size(&mesh.point(mesh.indices(node)), exponents)).abs();
                nodes.nodes().map(term).sum::<f64>()
            };
            let size: f64 = strengths.iter().zip(&points).map(each).sum();
            let moments = Promise::new("Conservation", "moments to the exactness under deposition, every kernel");
            moments.case(name).in_units("eps sum abs", f64::EPSILON * size).at_most(64.0, (before - after).abs());
        }
    }
    for centering in [Centering::Nodes, Centering::Cells] {
        each_kernel!(check::<1>(centering));
        each_kernel!(check::<2>(centering));
    }
    check::<3, 3>(&Tsc, "TSC", Centering::Cells);
    check::<3, 4>(&Lambda::<2, 1>::new().unwrap(), "(2, 1)", Centering::Nodes);
    check::<3, 6>(&Lambda::<4, 2>::new().unwrap(), "(4, 2)", Centering::Cells);
}

#[test]
fn gathering_reproduces_polynomials_and_the_next_degree_not() {
    fn check<const D: usize, const S: usize>(kernel: &impl MeshKernel<f64, S>, name: &str, centering: Centering) {
        let (mesh, reach) = unit_mesh::<D>(centering);
        let points = random_points::<D>(40, -reach, reach, 21);
        let mut out = vec![0.0; points.len()];
        let nodes: Vec<_> = mesh.points().collect();
        for exponents in monomials::<D>(kernel.exactness()) {
            let values: Vec<_> = nodes.iter().map(|x| power(x, exponents)).collect();
            mesh.gather(kernel, &points, &values, &mut out).unwrap();
            for (x, out) in points.iter().zip(&out) {
                let stencil = mesh.stencil(kernel, x).unwrap();
                let size: f64 = stencil.nodes().map(|(node, w)| w.abs() * size(&nodes[node], exponents)).sum();
                let error = (out - power(x, exponents)).abs();
                let exact = Promise::new("Conservation", "polynomials to the exactness come back by gathering");
                exact.in_units("eps sum abs", f64::EPSILON * size).at_most(64.0, error);
            }
        }
        let next: [u32; D] = std::array::from_fn(|axis| if axis == 0 { kernel.exactness() + 1 } else { 0 });
        let values: Vec<_> = nodes.iter().map(|x| power(x, next)).collect();
        mesh.gather(kernel, &points, &values, &mut out).unwrap();
        let worst = points.iter().zip(&out).map(|(x, out)| (out - power(x, next)).abs()).fold(0.0, f64::max);
        assert!(worst > 0.05, "{name}: degree {next:?} comes back too well, {worst}");
    }
    for centering in [Centering::Nodes, Centering::Cells] {
        each_kernel!(check::<1>(centering));
        each_kernel!(check::<2>(centering));
    }
    check::<3, 3>(&Tsc, "TSC", Centering::Nodes);
    check::<3, 6>(&Lambda::<4, 2>::new().unwrap(), "(4, 2)", Centering::Cells);
}

/// The kernel as a function of the distance, by its definition.
trait Profile<const S: usize>: MeshKernel<f64, S> {
    fn profile(&self, s: f64) -> f64;
}

impl Profile<1> for Ngp {
    fn profile(&self, s: f64) -> f64 {
        f64::from((-0.5..0.5).contains(&s))
    }
}

impl Profile<2> for Cic {
    fn profile(&self, s: f64) -> f64 {
        (1.0 - s.abs()).max(0.0)
    }
}

impl Profile<3> for Tsc {
    fn profile(&self, s: f64) -> f64 {
        if s.abs() < 0.5 { 0.75 - s * s } else { 0.5 * (1.5 - s.abs()).max(0.0).powi(2) }
    }
}

impl Profile<6> for Lambda<4, 2> {
    fn profile(&self, s: f64) -> f64 {
        self.value(s)
    }
}

impl Profile<10> for Lambda<8, 4> {
    fn profile(&self, s: f64) -> f64 {
        self.value(s)
    }
}

/// Every node, every image, by the definition of the kernel.
fn by_definition<const D: usize, const S: usize>(
    mesh: &Mesh<D>,
    kernel: &impl Profile<S>,
    points: &[[f64; D]],
    strengths: &[f64],
) -> Vec<f64> {
    let (h, widths, faces) = (mesh.spacings(), mesh.domain().widths(), mesh.domain().faces());
    let weight = |axis: usize, x: f64, node: f64| -> f64 {
        let images = if faces[axis][0] == Face::Periodic { -12..=12 } else { 0..=0 };
        images.map(|k| kernel.profile((x - node + f64::from(k) * widths[axis]) / h[axis])).sum()
    };
    let at = |node: [f64; D]| {
        let product = |x: &[f64; D]| (0..D).map(|axis| weight(axis, x[axis], node[axis])).product::<f64>();
        points.iter().zip(strengths).map(|(x, omega)| omega * product(x)).sum()
    };
    mesh.points().map(at).collect()
}

#[test]
fn depositing_is_the_sum_over_all_nodes_and_images() {
    fn check<const D: usize, const S: usize>(kernel: &impl Profile<S>, mesh: &Mesh<D>) {
        // Random places never meet an edge of NGP to round-off. Kernels have slopes up to 2, and places up to 40
        // spacings are rounded; 24 terms of 25 images are summed.
        const TOLERANCE: f64 = 40.0 * 40.0 * f64::EPSILON;
        let lower = mesh.domain().lower()[0];
        let width = mesh.domain().widths()[0];
        // Periodic axes wrap what lies beyond them.
        let beyond = if mesh.domain().faces()[0][0] == Face::Periodic { 1.0 } else { -0.35 };
        let points = random_points::<D>(24, lower - beyond * width, lower + (1.0 + beyond) * width, 31);
        let strengths = random_numbers(points.len(), 32);
        let mut values = vec![0.0; mesh.len()];
        mesh.deposit(kernel, &points, &strengths, &mut values).unwrap();
        for (node, (found, expected)) in values.iter().zip(by_definition(mesh, kernel, &points, &strengths)).enumerate()
        {
            assert!((found - expected).abs() <= TOLERANCE, "{mesh:?}, {S} nodes, value {node}: {found} and {expected}");
        }
    }
    fn every<const D: usize>(mesh: &Mesh<D>) {
        check(&Ngp, mesh);
        check(&Cic, mesh);
        check(&Tsc, mesh);
        check(&Lambda::<4, 2>::new().unwrap(), mesh);
    }
    let ring = |counts| Domain::periodic([-1.5], [2.0]).and_then(|domain| Mesh::nodes(&domain, [counts])).unwrap();
    // Down to one node, where all weights of a stencil meet.
    for count in [20, 7, 6, 5, 3, 2, 1] {
        every(&ring(count));
        check(&Lambda::<8, 4>::new().unwrap(), &ring(count));
    }
    every(&Mesh::cells(&Domain::periodic([-1.5], [2.0]).unwrap(), [9]).unwrap());
    every(&Mesh::nodes(&bounded([-1.5], [2.0]), [40]).unwrap());
    every(&Mesh::cells(&bounded([-1.5], [2.0]), [40]).unwrap());
    let torus = Domain::periodic([-1.5; 2], [2.0, 1.0]).unwrap();
    every(&Mesh::nodes(&torus, [7, 8]).unwrap());
    every(&Mesh::cells(&torus, [5, 11]).unwrap());
    let mixed = Domain::new([-1.5; 2], [2.0, 2.0], [[Face::Open, Face::MirrorEven], [Face::Periodic; 2]]).unwrap();
    let mixed = Mesh::cells(&mixed, [30, 4]).unwrap();
    let inside: Vec<[f64; 2]> = random_points(9, -0.3, 0.8, 3);
    let (strengths, mut values) = (vec![1.0; 9], vec![0.0; 120]);
    mixed.deposit(&Tsc, &inside, &strengths, &mut values).unwrap();
    assert!(values.iter().zip(by_definition(&mixed, &Tsc, &inside, &strengths)).all(|(a, b)| (a - b).abs() < 1e-13));
    let cube = Domain::periodic([-1.5; 3], [2.0; 3]).unwrap();
    every(&Mesh::nodes(&cube, [7, 6, 8]).unwrap());
    every(&Mesh::cells(&cube, [3, 9, 2]).unwrap());
}

proptest! {
    #![proptest_config(properties(cases()))]

    #[test]
    fn depositing_and_gathering_are_adjoint_and_conserve_the_total(
        seed in any::<u64>(),
        counts in [1..12_usize, 1..12_usize],
        cells in any::<bool>(),
        which in 0..4,
    ) {
        let domain = Domain::periodic([-1.0, 3.0], [1.5, 4.0]).unwrap();
        let mesh = if cells { Mesh::cells(&domain, counts) } else { Mesh::nodes(&domain, counts) }.unwrap();
        fn transfers<const S: usize>(kernel: &impl MeshKernel<f64, S>, mesh: &Mesh<2>, points: &[[f64; 2]], omega: &[f64], u: &[f64]) -> Result<[Vec<f64>; 2]> {
            let (mut values, mut out) = (vec![0.0; mesh.len()], vec![0.0; points.len()]);
            mesh.deposit(kernel, points, omega, &mut values)?;
            mesh.gather(kernel, points, u, &mut out)?;
            Ok([values, out])
        }
        let points = random_points::<2>(15, -6.0, 6.0, seed);
        let (omega, u) = (random_numbers(15, seed ^ 1), random_numbers(mesh.len(), seed ^ 2));
        let [values, out] = match which {
            0 => transfers(&Ngp, &mesh, &points, &omega, &u),
            1 => transfers(&Tsc, &mesh, &points, &omega, &u),
            2 => transfers(&Lambda::<4, 4>::new().unwrap(), &mesh, &points, &omega, &u),
            _ => transfers(&Lambda::<2, 1>::new().unwrap(), &mesh, &points, &omega, &u),
        }.unwrap();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (total, size): (f64, f64) = (omega.iter().sum(), omega.iter().map(|omega| omega.abs()).sum());
        // 15 particles of up to 36 nodes, whose magnitudes add up to 1.39^2 of each.
        const ROUNDING: f64 = 64.0;
        const UNIT: f64 = 1.39 * 1.39 * f64::EPSILON;
        let sums = |text| Promise::new("Conservation", text);
        let deposited = (values.iter().sum::<f64>() - total).abs();
        sums("total under deposition on any torus").in_units("1.39^2 eps sum abs", UNIT * size).at_most(ROUNDING, deposited);
        let largest = u.iter().fold(0.0, |largest: f64, u| largest.max(u.abs()));
        let apart = (dot(&values, &u) - dot(&omega, &out)).abs();
        sums("deposition and gathering are adjoint").in_units("1.39^2 eps sum abs max u", UNIT * size * largest).at_most(ROUNDING, apart);
    }

    #[test]
    fn nearest_grid_point_is_the_cell_a_particle_is_in(x in -10.0..10.0_f64, y in -10.0..10.0_f64) {
        // The spacing is 1 and the faces are integers, as on the sheet: nothing rounds but the test itself.
        let mesh = Mesh::cells(&bounded([-10.0; 2], [10.0; 2]), [20; 2]).unwrap();
        let stencil = mesh.stencil(&Ngp, &[x, y]).unwrap();
        let [k, l] = [x, y].map(|x| (x + 10.0).floor() as usize);
        prop_assert_eq!(stencil.nodes().collect::<Vec<_>>(), [(20 * k + l, 1.0)]);
    }

    #[test]
    fn shifting_particles_by_whole_cells_shifts_the_mesh_bit_by_bit(seed in any::<u64>(), by in [0..8_usize, 0..8_usize]) {
        // Spacing 1/8 and places in multiples of 2^-40: no sum and no quotient rounds.
        let mesh = Mesh::nodes(&Domain::periodic([0.0; 2], [1.0; 2]).unwrap(), [8; 2]).unwrap();
        let mut random = Random::new(seed);
        let points: Vec<[f64; 2]> =
            (0..10).map(|_| [0; 2].map(|_| (random.bits() >> 24) as f64 / (1_u64 << 40) as f64)).collect();
        let moved: Vec<[f64; 2]> = points.iter().map(|x| [x[0] + by[0] as f64 / 8.0, x[1] + by[1] as f64 / 8.0]).collect();
        let omega = random_numbers(10, seed);
        let kernel = Lambda::<4, 2>::new().unwrap();
        let [mut here, mut there] = [[0.0; 64]; 2];
        mesh.deposit(&kernel, &points, &omega, &mut here).unwrap();
        mesh.deposit(&kernel, &moved, &omega, &mut there).unwrap();
        for (i, j) in (0..64).map(|node| (node / 8, node % 8)) {
            let to = 8 * ((i + by[0]) % 8) + (j + by[1]) % 8;
            let shifted = Promise::new("Metamorphic relations", "M11 deposition shifted by whole cells keeps its bits");
            shifted.equal(&here[8 * i + j].to_bits(), &there[to].to_bits());
        }
    }
}

#[test]
fn several_fields_have_the_bits_of_each_alone() -> Result<()> {
    let mesh = Mesh::nodes(&Domain::periodic([0.0; 3], [1.0; 3])?, [9, 8, 7])?;
    let kernel = Lambda::<4, 2>::new()?;
    let points = random_points::<3>(200, -1.0, 2.0, 41);
    let strengths: Vec<[f64; 3]> =
        random_numbers(600, 42).chunks(3).map(|omega| [omega[0], omega[1], omega[2]]).collect();
    let mut values = vec![[1.0; 3]; mesh.len()];
    mesh.deposit_fields(&kernel, &points, &strengths, &mut values)?;
    let mut out = vec![[0.0; 3]; points.len()];
    mesh.gather_fields(&kernel, &points, &values, &mut out)?;
    let mut back = vec![[0.0; 3]; points.len()];
    let volumes = Volumes::each((1..=200).map(f64::from).collect())?;
    mesh.gather_strength_fields(&kernel, &points, &volumes, &values, &mut back)?;
    for field in 0..3 {
        let alone: Vec<f64> = strengths.iter().map(|omega| omega[field]).collect();
        // Depositing adds to what is there.
        let mut single = vec![1.0; mesh.len()];
        mesh.deposit(&kernel, &points, &alone, &mut single)?;
        assert!(single.iter().zip(&values).all(|(single, values)| single.to_bits() == values[field].to_bits()));
        let mut gathered = vec![0.0; points.len()];
        mesh.gather(&kernel, &points, &single, &mut gathered)?;
        assert!(gathered.iter().zip(&out).all(|(single, out)| single.to_bits() == out[field].to_bits()));
        let mut strength = vec![0.0; points.len()];
        mesh.gather_strengths(&kernel, &points, &volumes, &single, &mut strength)?;
        assert!(strength.iter().zip(&back).all(|(single, back)| single.to_bits() == back[field].to_bits()));
    }
    Ok(())
}

#[test]
fn single_precision_fields_follow_double_ones() -> Result<()> {
    let mesh = Mesh::cells(&Domain::periodic([0.0; 2], [1.0; 2])?, [16; 2])?;
    let kernel = Lambda::<6, 4>::new()?;
    let points = random_points::<2>(500, 0.0, 1.0, 51);
    let omega: Vec<f32> = random_numbers(500, 52).into_iter().map(|omega| omega as f32).collect();
    let wide: Vec<f64> = omega.iter().map(|&omega| omega.into()).collect();
    let (mut values, mut exact) = (vec![0.0_f32; 256], vec![0.0; 256]);
    mesh.deposit(&kernel, &points, &omega, &mut values)?;
    mesh.deposit(&kernel, &points, &wide, &mut exact)?;
    // About 500 * 64 / 256 = 125 particles reach a node, at most half their sum of magnitudes 1.49^2 each.
    let tolerance = 125.0 * f64::from(f32::EPSILON);
    assert!(values.iter().zip(&exact).all(|(a, b)| (f64::from(*a) - b).abs() < tolerance));
    let (mut out, mut exact_out) = (vec![0.0_f32; 500], vec![0.0; 500]);
    mesh.gather(&kernel, &points, &values, &mut out)?;
    mesh.gather(&kernel, &points, &exact, &mut exact_out)?;
    assert!(out.iter().zip(&exact_out).all(|(a, b)| (f64::from(*a) - b).abs() < 4.0 * tolerance));
    Ok(())
}

#[test]
fn strengths_come_back_as_volume_times_density_and_not_by_swapping_roles() -> Result<()> {
    // Errata 42: 80 unit particles spaced 0.7 h.
    let mesh = Mesh::nodes(&bounded([0.0], [79.0]), [80])?;
    let points: Vec<[f64; 1]> = (10..90).map(|p| [0.7 * f64::from(p)]).collect();
    let (kernel, omega) = (Lambda::<2, 1>::new()?, vec![1.0; 80]);
    let [mut values, mut swapped, mut back] = [(); 3].map(|()| vec![0.0; 80]);
    mesh.deposit(&kernel, &points, &omega, &mut values)?;
    let total = |x: &[f64]| x.iter().sum::<f64>();
    assert!((total(&values) - 80.0).abs() < 80.0 * 8.0 * f64::EPSILON);
    mesh.gather(&kernel, &points, &values, &mut swapped)?;
    assert!((total(&swapped) - 113.94).abs() < 0.005, "{}", total(&swapped));
    mesh.gather_strengths(&kernel, &points, &Volumes::equal(0.7)?, &values, &mut back)?;
    // Inside the row every particle has its strength again, up to the ripple that 0.7 and 1 make; at its ends the
    // density is that of an edge.
    const RIPPLE: f64 = 0.04;
    assert!((20..60).all(|p| (back[p] - 1.0).abs() < RIPPLE), "{back:?}");
    assert!((total(&back) - 80.0).abs() < 0.5, "{}", total(&back));
    Ok(())
}

#[test]
fn the_first_particle_whose_support_leaves_is_named_and_nothing_is_deposited() -> Result<()> {
    let mesh = Mesh::nodes(&bounded([0.0, 0.0], [8.0, 16.0]), [9, 17])?;
    let kernel = Lambda::<4, 2>::new()?;
    let mut points = vec![[4.0, 8.0]; 9000];
    let before = random_numbers(mesh.len(), 61);
    let check = |points: &[[f64; 2]], strengths: &[f64], p: usize, expected: &dyn Fn(&Error) -> bool| {
        let mut values = before.clone();
        let error = mesh.deposit(&kernel, points, strengths, &mut values).unwrap_err();
        assert!(error.particle() == Some(p) && expected(&error), "{error}");
        assert_eq!(values, before);
        if strengths.iter().all(|omega| omega.is_finite()) {
            let mut out = vec![7.0; points.len()];
            let gathered = mesh.gather(&kernel, points, &values, &mut out).unwrap_err();
            // As text, in which NaN equals itself.
            assert_eq!(format!("{gathered:?}"), format!("{error:?}"));
            assert!(out.iter().all(|&out| out == 7.0));
            let alone = mesh.stencil(&kernel, &points[p]).unwrap_err().at(p);
            assert_eq!(format!("{alone:?}"), format!("{error:?}"));
        }
    };
    let ones = vec![1.0; 9000];
    let support = |axis, coordinate, low, high| Error::from(MeshError::Support { axis, coordinate, low, high });
    points[8123] = [4.0, 14.5];
    check(&points, &ones, 8123, &|error| *error == support(1, 14.5, 2.0, 14.0).at(8123));
    points[4100] = [1.75, 14.5];
    check(&points, &ones, 4100, &|error| *error == support(0, 1.75, 2.0, 6.0).at(4100));
    let mut bad = ones.clone();
    bad[4101] = f64::NAN;
    check(&points, &bad, 4100, &|error| *error == support(0, 1.75, 2.0, 6.0).at(4100));
    bad[4100] = f64::INFINITY;
    let strength = Error::from(ApplyError::FieldOf { field: 0, value: f64::INFINITY }).at(4100);
    check(&points, &bad, 4100, &|error| *error == strength);
    for x in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
        points[17] = [4.0, x];
        check(&points, &ones, 17, &|error| {
            matches!(*error.kind(), parops::ErrorKind::Particle(ParticleError::Coordinate { axis: 1, coordinate })
                if coordinate.to_bits() == x.to_bits())
        });
    }
    points[3] = [-1e300, 8.0];
    let range = ParticleError::Range { axis: 0, value: -1e300, high: parops::COORDINATE_HIGH };
    check(&points, &ones, 3, &|error| *error == Error::from(range).at(3));
    Ok(())
}

#[test]
fn a_particle_on_the_last_place_within_is_within_whatever_rounds() -> Result<()> {
    fn check<const D: usize, const S: usize>(
        kernel: &impl MeshKernel<f64, S>,
        name: &str,
        lower: f64,
        width: f64,
        count: usize,
    ) {
        let domain = bounded([lower; D], [lower + width; D]);
        for mesh in [Mesh::nodes(&domain, [count; D]).unwrap(), Mesh::cells(&domain, [count; D]).unwrap()] {
            let h = mesh.spacings()[0];
            let (start, last) = (mesh.point([0; D])[0], mesh.point([count - 1; D])[0]);
            // From the middle of the first S values half a spacing down and from that of the last half a spacing up; for
            // one node on a face, no farther than the coordinates of a box go.
            let middle = (S as f64 - 1.0) / 2.0;
            let (low, high) = (start + (middle - 0.5) * h, last - (middle - 0.5) * h);
            for x in [low, high] {
                let stencil = mesh
                    .stencil(kernel, &[x; D])
                    .unwrap_or_else(|error| panic!("{name}, {lower}, {width}, {count}: {error}"));
                let nodes: Vec<_> = stencil.nodes().collect();
                assert!(nodes.iter().all(|&(node, _)| node < mesh.len()));
                assert!((nodes.iter().map(|node| node.1).sum::<f64>() - 1.0).abs() < 8.0 * f64::EPSILON);
            }
            for (x, distance) in [(low, -1e-6 * h), (high, 1e-6 * h)] {
                assert!(mesh.stencil(kernel, &[x + distance; D]).is_err(), "{name}, {lower}, {width}, {count}");
            }
        }
    }
    for count in [10, 11, 23, 50, 77] {
        for (lower, width) in [(0.0, 1.0), (0.1, 0.7), (-3.3, 1e-3), (1000.3, 0.11), (-7.7e5, 3e5)] {
            each_kernel!(check::<1>(lower, width, count));
            each_kernel!(check::<2>(lower, width, count));
        }
    }
    // All nodes of a bounded mesh take linear interpolation, the last one too.
    let mesh = Mesh::nodes(&bounded([0.3], [1.1]), [8])?;
    for (i, x) in mesh.points().enumerate() {
        let mut values = [0.0_f64; 8];
        mesh.deposit(&Cic, &[x], &[1.0], &mut values)?;
        assert!((values[i] - 1.0).abs() <= 16.0 * f64::EPSILON, "{i}: {values:?}");
    }
    Ok(())
}

#[test]
fn meshes_and_arrays_that_do_not_fit_are_refused() -> Result<()> {
    let open = Domain::<1>::open();
    let (lower, upper) = (f64::NEG_INFINITY, f64::INFINITY);
    assert_eq!(Mesh::nodes(&open, [4]), Err(MeshError::Infinite { axis: 0, lower, upper }.into()));
    let (box2, high) = (bounded([0.0; 2], [1.0; 2]), Mesh::<2>::COUNT_HIGH);
    let count = |axis, count, low| Error::from(MeshError::Count { axis, count, low, high });
    assert_eq!(Mesh::nodes(&box2, [2, 1]), Err(count(1, 1, 2)));
    assert_eq!(Mesh::cells(&box2, [0, 1]), Err(count(0, 0, 1)));
    assert_eq!(Mesh::cells(&box2, [3, high + 1]), Err(count(1, high + 1, 1)));
    let cube = bounded([0.0; 3], [1.0; 3]);
    let values = (high as f64).powi(3);
    let limit = (isize::MAX as usize / 64) as f64;
    assert_eq!(Mesh::cells(&cube, [high; 3]), Err(MeshError::TooLarge { values, limit }.into()));

    let mesh = Mesh::cells(&box2, [4; 2])?;
    assert_eq!((mesh.len(), mesh.is_empty(), mesh.counts(), mesh.spacings()), (16, false, [4; 2], [0.25; 2]));
    assert_eq!((mesh.cell_volume(), mesh.centering(), *mesh.domain()), (0.0625, Centering::Cells, box2));
    let points = [[0.5; 2]; 3];
    let mut values = [1.0; 16];
    let length = |found, needed| Error::from(ParticleError::Length { found, needed });
    assert_eq!(mesh.deposit(&Cic, &points, &[1.0; 2], &mut values), Err(length(2, 3)));
    let short = Error::from(MeshError::Length { found: 15, needed: 16 });
    assert_eq!(mesh.deposit(&Cic, &points, &[1.0; 3], &mut values[..15]), Err(short.clone()));
    assert_eq!(mesh.gather(&Cic, &points, &values, &mut [0.0; 4]), Err(length(4, 3)));
    assert_eq!(mesh.gather(&Cic, &points, &values[..15], &mut [0.0; 3]), Err(short));
    let volumes = Volumes::each(vec![1.0; 2])?;
    assert_eq!(mesh.gather_strengths(&Cic, &points, &volumes, &values, &mut [0.0; 3]), Err(length(2, 3)));
    values[5] = f64::NAN;
    let error = mesh.gather(&Cic, &points, &values, &mut [0.0; 3]).unwrap_err();
    assert!(
        matches!(*error.kind(), parops::ErrorKind::Mesh(MeshError::Value { node: 5, field: 0, value }) if value.is_nan())
    );
    // Fewer nodes than the kernel has: no place is legal.
    let narrow = mesh.stencil(&Lambda::<4, 2>::new()?, &[0.5; 2]).unwrap_err();
    assert!(matches!(*narrow.kind(), parops::ErrorKind::Mesh(MeshError::Support { low, high, .. }) if high < low));
    assert_eq!(mesh.deposit(&Cic, &[], &[] as &[f64], &mut [0.0; 16]), Ok(()));
    Ok(())
}

#[test]
fn results_that_overflow_are_errors() -> Result<()> {
    let mesh = Mesh::nodes(&Domain::periodic([0.0], [1.0])?, [8])?;
    let kernel = Lambda::<2, 1>::new()?;
    let mut values = [0.0; 8];
    let error = mesh.deposit(&kernel, &[[0.5]; 2], &[f64::MAX; 2], &mut values).unwrap_err();
    assert_eq!(error, Error::from(MeshError::Value { node: 4, field: 0, value: f64::INFINITY }));
    // Halfway between nodes the weights are -1/16, 9/16, 9/16, -1/16: their magnitudes add up to 1.25.
    let signs = [-1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0].map(|sign: f64| sign * f64::MAX);
    let error = mesh.gather(&kernel, &[[0.5], [1.5 / 8.0]], &signs, &mut [0.0; 2]).unwrap_err();
    assert_eq!(error, Error::from(ApplyError::OverflowOf { field: 0, value: f64::INFINITY }).at(1));
    Ok(())
}

/// The cubic B-spline, a kernel of the user's own: it smooths, and reproduces lines.
struct Spline;

impl MeshKernel<f64, 4> for Spline {
    fn weights(&self, u: f64) -> [f64; 4] {
        let outer = |t: f64| t * t * t / 6.0;
        let inner = |t: f64| 2.0 / 3.0 - t * t * (1.0 - 0.5 * t);
        let (below, above) = (0.5 - u, 0.5 + u);
        [outer(below), inner(above), inner(below), outer(above)]
    }

    fn exactness(&self) -> u32 {
        1
    }
}

#[test]
fn a_kernel_of_the_users_own_is_checked_and_taken() -> Result<()> {
    assert_eq!(parops::testing::check_mesh_kernel(&Spline, 4.0), Ok(()));
    let (mesh, reach) = unit_mesh::<2>(Centering::Nodes);
    let points = random_points::<2>(50, -reach, reach, 91);
    let (mut values, mut out) = (vec![0.0; mesh.len()], vec![0.0; 50]);
    let run_time: &dyn MeshKernel<f64, 4> = &Spline;
    mesh.deposit(run_time, &points, &[1.0; 50], &mut values)?;
    assert!((values.iter().sum::<f64>() - 50.0).abs() <= 50.0 * 8.0 * f64::EPSILON);
    let plane: Vec<f64> = mesh.points().map(|[x, y]| 2.0 + 3.0 * x - y).collect();
    mesh.gather(run_time, &points, &plane, &mut out)?;
    // Values up to 30 are weighted by positive weights.
    assert!(points.iter().zip(&out).all(|([x, y], out)| (out - 2.0 - 3.0 * x + y).abs() <= 30.0 * 16.0 * f64::EPSILON));
    Ok(())
}

/// Everything that threads take part in, as bits.
fn bits() -> Vec<u64> {
    fn transfer<const D: usize, const S: usize>(mesh: &Mesh<D>, kernel: &impl MeshKernel<f64, S>, bits: &mut Vec<u64>) {
        let points = random_points::<D>(9000, -2.0, 3.0, 71);
        let strengths: Vec<[f64; 2]> = points.iter().map(|x| [x[0] + 0.3, 1.0 - x[D - 1] * x[D - 1]]).collect();
        let mut values = vec![[0.1; 2]; mesh.len()];
        mesh.deposit_fields(kernel, &points, &strengths, &mut values).unwrap();
        let mut out = vec![[0.0; 2]; points.len()];
        mesh.gather_fields(kernel, &points, &values, &mut out).unwrap();
        bits.extend(values.as_flattened().iter().chain(out.as_flattened()).map(|x| x.to_bits()));
    }
    let mut bits = Vec::new();
    let lambda = Lambda::<4, 2>::new().unwrap();
    // Slabs of equal and unequal thickness, a thin last one, and meshes too thin to be cut.
    for count in [4, 25, 26, 49, 64, 100, 301] {
        let ring = Domain::periodic([0.0], [1.0]).unwrap();
        transfer(&Mesh::nodes(&ring, [count]).unwrap(), &lambda, &mut bits);
        transfer(&Mesh::cells(&ring, [count]).unwrap(), &Tsc, &mut bits);
        let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
        transfer(&Mesh::nodes(&torus, [count, 5]).unwrap(), &lambda, &mut bits);
        transfer(&Mesh::cells(&bounded([-4.0; 2], [5.0; 2]), [count.max(20), 19]).unwrap(), &lambda, &mut bits);
    }
    transfer(&Mesh::nodes(&Domain::periodic([0.0; 3], [1.0; 3]).unwrap(), [53, 5, 7]).unwrap(), &lambda, &mut bits);
    bits
}

/// Nothing but sums, products, quotients and whole numbers enters: the bits are those of every build and machine.
#[test]
fn the_bits_are_those_of_every_build() {
    let hash = bits().iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, bits| (hash ^ bits).wrapping_mul(0x0100_0000_01b3));
    let everywhere = Promise::new("Reproducibility", "hash of deposited and gathered bits, every build and machine");
    everywhere.equal(&hash, &0x1faf_f4ef_a58b_a191);
}

#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_deposits_the_same_bits_and_names_the_same_particle() {
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mesh = Mesh::cells(&bounded([0.0], [1.0]), [200]).unwrap();
            let points: Vec<[f64; 1]> = (0..20_000).map(|p| [if p < 9000 { 0.5 } else { -f64::from(p) }]).collect();
            let error = mesh.deposit(&Cic, &points, &vec![1.0; 20_000], &mut [0.0; 200]).unwrap_err();
            (bits(), error)
        })
    };
    let one = with(1);
    assert_eq!(one.1.particle(), Some(9000));
    for threads in [2, 3, 8] {
        for _ in 0..2 {
            let same = Promise::new("Reproducibility", "deposition, gathering and errors, bits on 1, 2, 3, 8 threads");
            same.holds(with(threads) == one);
        }
    }
}
