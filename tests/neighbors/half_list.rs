//! Half lists: every pair once, for both partners; sums over them beside the full ones.

use crate::cases::cases;
use crate::properties::properties;
use parops::{
    Allowance, Apply, BruteForce, CellList, Cutoff, D1, D2, Domain, Epsilon, Error, Exchange, Face, Form, Gradient,
    HalfList, Kernel, Laplacian, MultiIndex, Nearest, Neighbor, NeighborError, NeighborList, Neighbors, OperatorError,
    Particles, Pse, Random, Result, Sign, SymmetricPse, Symmetry, Term, VerletList, Volumes, testing::Promise,
};
use proptest::prelude::*;

const AXES: [[Face; 2]; 7] = [
    [Face::Periodic, Face::Periodic],
    [Face::Open, Face::Open],
    [Face::MirrorEven, Face::Open],
    [Face::Open, Face::MirrorOdd],
    [Face::MirrorOdd, Face::MirrorEven],
    [Face::MirrorEven, Face::MirrorEven],
    [Face::Periodic, Face::Periodic],
];

fn domain<const D: usize>(kinds: [usize; 3]) -> Domain<D> {
    Domain::new([0.0; D], [1.0; D], std::array::from_fn(|axis| AXES[kinds[axis]])).unwrap()
}

/// Spread evenly, on a lattice with ties, coincident points and points on the faces, or clustered.
fn scattered<const D: usize>(shape: usize, n: usize, seed: u64) -> Particles<D> {
    let mut random = Random::new(seed);
    let place = |i: usize, x: f64| match shape {
        1 => (x * 9.0).floor() / 8.0,
        2 if !i.is_multiple_of(6) => 0.97 + 0.02 * x,
        _ => x,
    };
    Particles::new((0..n).map(|i| std::array::from_fn(|_| place(i, random.uniform()))).collect()).unwrap()
}

/// Source, bits of the separation and sign; adding zero makes -0 and +0 one number.
type Key<const D: usize> = (usize, [u64; D], i8);

fn key<const D: usize>(q: usize, separation: [f64; D], sign: i8) -> Key<D> {
    (q, separation.map(|s| (s + 0.0).to_bits()), sign)
}

/// Every row as a sorted set, with what the mutual pairs stand for put into both rows.
fn unfolded<const D: usize>(half: &HalfList<D>) -> Vec<Vec<Key<D>>> {
    let mut rows = vec![Vec::new(); half.particles()];
    half.for_each_pair(|pair| {
        rows[pair.p].push(key(pair.q, pair.separation, pair.sign));
        if pair.mutual {
            assert!(pair.q > pair.p && pair.sign == 1);
            rows[pair.q].push(key(pair.p, pair.separation.map(|s| -s), 1));
        }
    });
    rows.iter_mut().for_each(|row| row.sort_unstable());
    rows
}

fn rows<const D: usize>(provider: &impl Neighbors<D>, cutoff: f64) -> Vec<Vec<Key<D>>> {
    let row = |p: usize| {
        let mut row = Vec::new();
        provider.for_each(p, cutoff, |n| row.push(key(n.q, n.separation, n.sign)));
        row.sort_unstable();
        row
    };
    (0..provider.targets()).map(row).collect()
}

fn stands_for_full_rows<const D: usize>(kinds: [usize; 3], shape: usize, n: usize, seed: u64) {
    let (particles, domain) = (scattered::<D>(shape, n, seed), domain::<D>(kinds));
    let oracle = BruteForce::build(&particles, &domain, Cutoff(0.25)).unwrap();
    let cells = CellList::build(&particles, &domain, Cutoff(0.25)).unwrap();
    let verlet = VerletList::build(&particles, &domain, Cutoff(0.25), 0.1).unwrap();
    for cutoff in [0.25, 0.15] {
        let expected = rows(&oracle, cutoff);
        let halves = [
            HalfList::from_provider(&oracle, Cutoff(cutoff)).unwrap(),
            HalfList::from_provider(&cells, Cutoff(cutoff)).unwrap(),
            HalfList::from_provider(&NeighborList::from_provider(&cells).unwrap(), Cutoff(cutoff)).unwrap(),
            HalfList::from_provider(&verlet, Cutoff(cutoff)).unwrap(),
            HalfList::from_provider(&(&cells).canonical(), Cutoff(cutoff)).unwrap(),
        ];
        for half in &halves {
            Promise::new("Neighbor lists", "half lists unfolded against brute force, every provider")
                .equal(&unfolded(half), &expected);
            let total: usize = expected.iter().map(Vec::len).sum();
            assert_eq!(2 * half.mutual() + half.single(), total);
            if kinds[..D].iter().all(|&kind| [0, 1, 6].contains(&kind)) {
                assert_eq!(half.single(), 0, "without mirrors every neighbor has a partner");
            }
        }
    }
}

proptest! {
    #![proptest_config(properties(cases() / 4))]

    #[test]
    fn half_list_stands_for_the_rows_of_brute_force(
        kinds in [0_usize..7, 0_usize..7, 0_usize..7],
        shape in 0_usize..3,
        n in prop::sample::select(vec![0_usize, 1, 2, 33]),
        seed: u64,
    ) {
        stands_for_full_rows::<1>(kinds, shape, n, seed);
        stands_for_full_rows::<2>(kinds, shape, n, seed);
        stands_for_full_rows::<3>(kinds, shape, n, seed);
    }

    #[test]
    fn sums_over_pairs_are_the_full_sums(
        kinds in [0_usize..7, 0_usize..7, 0_usize..7],
        shape in 0_usize..3,
        n in 2_usize..40,
        seed: u64,
    ) {
        sums_of_pairs::<1>(kinds, shape, n, seed);
        sums_of_pairs::<2>(kinds, shape, n, seed);
        sums_of_pairs::<3>(kinds, shape, n, seed);
    }
}

#[test]
fn half_list_equals_brute_force_after_a_hundred_random_updates() {
    for (seed, kinds) in [[0; 3], [1; 3], [4, 0, 3], [5, 2, 0]].into_iter().enumerate() {
        let mut random = Random::new(seed as u64);
        let mut particles = scattered::<2>(seed % 3, 90, 7);
        let domain = domain::<2>(kinds);
        let mut verlet = VerletList::build(&particles, &domain, Cutoff(0.2), 0.1).unwrap();
        for _ in 0..100 {
            let step = |&[x, y]: &[f64; 2]| [x, y].map(|x| (x + 0.01 * (random.uniform() - 0.5)).clamp(0.0, 1.0));
            let points: Vec<_> = particles.points().iter().map(step).collect();
            particles.set_points(&points).unwrap();
            verlet.update(&particles).unwrap();
            let half = HalfList::from_provider(&verlet, Cutoff(0.2)).unwrap();
            let expected = rows(&BruteForce::build(&particles, &domain, Cutoff(0.2)).unwrap(), 0.2);
            Promise::new("Neighbor lists", "half lists of a Verlet list after 100 updates")
                .equal(&unfolded(&half), &expected);
            assert_eq!(half.validate(particles.generation()), Ok(()));
        }
        assert!(verlet.rebuilds() > 0 && verlet.rebuilds() < 60);
    }
}

/// The sum of numbers with the rounding errors carried along.
fn exact_sum(terms: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for x in terms {
        let next = sum + x;
        lost += if sum.abs() >= x.abs() { (sum - next) + x } else { (x - next) + sum };
        sum = next;
    }
    sum + lost
}

/// Two orders of n terms differ by up to n eps sum|.|, typically by its root: 8 is what is promised for some tens of them.
const AGREES: f64 = 8.0;
/// The sum over all particles.
const CONSERVES: f64 = 4.0;

/// A repulsion (one conserved component an axis) and a density (replicating) against the same sums over full rows.
fn sums_of_pairs<const D: usize>(kinds: [usize; 3], shape: usize, n: usize, seed: u64) {
    let (particles, domain) = (scattered::<D>(shape, n, seed), domain::<D>(kinds));
    let cells = CellList::build(&particles, &domain, Cutoff(0.25)).unwrap();
    let half = HalfList::from_provider(&cells, Cutoff(0.25)).unwrap();
    let charge = |p: usize| 1.0 + 0.125 * (p % 5) as f64;
    let force = |p: usize, n: &Neighbor<D>| {
        let squared: f64 = n.separation.iter().map(|x| x * x).sum();
        n.separation[0] * (charge(p) * charge(n.q)) * (1.0 - 16.0 * squared)
    };
    let density = |n: &Neighbor<D>| 1.0 - 16.0 * n.separation.iter().map(|x| x * x).sum::<f64>();
    let mut out = vec![[1.0, 0.0]; n];
    let symmetry = [Symmetry::Conserved, Symmetry::Replicating];
    half.accumulate(symmetry, &mut out, |pair| {
        let neighbor = Neighbor { q: pair.q, separation: pair.separation, sign: pair.sign };
        [force(pair.p, &neighbor), density(&neighbor)]
    })
    .unwrap();
    let (mut sizes, mut images) = (0.0, Vec::new());
    for (p, out) in out.iter().enumerate() {
        let (mut expected, mut size, mut terms) = ([1.0, 0.0], [1.0, 0.0], 1.0);
        cells.for_each(p, 0.25, |neighbor| {
            terms += 1.0;
            for (k, term) in [force(p, &neighbor), density(&neighbor)].into_iter().enumerate() {
                expected[k] += term;
                size[k] += term.abs();
            }
        });
        for k in 0..2 {
            let apart = (out[k] - expected[k]).abs();
            let promise = Promise::new("Conservation", "sums over pairs against full rows");
            // Two orders of n terms differ by up to n eps sum|.|.
            promise.in_units("n eps sum abs", terms * f64::EPSILON * size[k]).at_most(1.0, apart);
        }
        sizes += size[0];
    }
    half.for_each_pair(|pair| {
        if !pair.mutual {
            images.push(-force(pair.p, &Neighbor { q: pair.q, separation: pair.separation, sign: pair.sign }));
        }
    });
    // What flows through mirrors is left.
    let left = exact_sum(out.iter().flat_map(|out| [out[0], -1.0]).chain(images));
    let conserved = Promise::new("Conservation", "antisymmetric sums over pairs, total less what mirrors take");
    conserved.in_units("eps sum abs", f64::EPSILON * sizes).at_most(CONSERVES, left.abs());
}

/// What is known of one comparison, in eps of T times the sum of the absolute pair terms.
#[derive(Debug)]
struct Apart {
    /// The farthest result from that of the full gather.
    most: f64,
    /// sum_p V_p out_p, or sum_p out_p in strengths.
    sum: f64,
}

/// Compares a half list with the full gather, in both number types.
fn compare<const D: usize, const N: usize>(
    pse: Pse<Exchange<D>, N>,
    form: Form,
    sigma: f64,
    neighbors: &impl Neighbors<D>,
    volumes: &Volumes,
) -> Result<[Apart; 2]> {
    let pse = &pse.form(form)?;
    let (volume, strengths) = (|p: usize| volumes.get(p).unwrap(), form == Form::Strengths);
    let weight = |p: usize| if strengths { 1.0 } else { volume(p) };
    let half = pse.symmetric(neighbors)?;
    let rows = pse.assemble(neighbors)?;
    assert_eq!(half.report(), rows.report());
    let n = neighbors.targets();
    let f: Vec<f64> = (0..n).map(|p| (0.7 * p as f64).sin() + 0.3).collect();
    let f32s: Vec<f32> = f.iter().map(|&f| f as f32).collect();
    let (mut full, mut out) = (vec![[0.0; N]; n], vec![[9.0; N]; n]);
    let (mut short, mut short_full) = (vec![[9.0_f32; N]; n], vec![[0.0_f32; N]; n]);
    rows.apply_all(&f, &mut full)?;
    half.apply_all(&f, &mut out)?;
    half.apply_all(&f32s, &mut short)?;
    pse.matrix_free(neighbors)?.apply_all(&f32s, &mut short_full)?;

    // Terms of the full gather: w (f_q - f_p) with w = a s, and a share of the diagonal, (a s + b) f_p.
    let mut sizes = vec![[0.0; N]; n];
    for (p, sizes) in sizes.iter_mut().enumerate() {
        let (row, mut signs) = (rows.row(p).unwrap(), Vec::new());
        neighbors.for_each(p, pse.cutoff().0, |neighbor| signs.push(f64::from(neighbor.sign)));
        for ((&q, w), sign) in row.sources.iter().zip(row.weights).zip(signs) {
            let ratio = if strengths { volume(q as usize) / volume(p) } else { 1.0 };
            let terms = (f[q as usize] - f[p]).abs() + (sign + sigma * ratio).abs() * f[p].abs();
            sizes.iter_mut().zip(w).for_each(|(size, w)| *size += w.abs() * terms);
        }
    }
    let measure = |a: &dyn Fn(usize, usize) -> f64, b: &dyn Fn(usize, usize) -> f64, eps: f64| {
        let (mut most, mut sum) = (0.0_f64, 0.0_f64);
        for k in 0..N {
            for (p, size) in sizes.iter().map(|size| size[k]).enumerate().filter(|&(_, size)| size > 0.0) {
                most = most.max((a(p, k) - b(p, k)).abs() / (eps * size));
            }
            let total: f64 = sizes.iter().enumerate().map(|(p, size)| weight(p) * size[k]).sum();
            sum = sum.max(exact_sum((0..n).map(|p| weight(p) * a(p, k))).abs() / (eps * total));
        }
        Apart { most, sum }
    };
    let long = measure(&|p, k| out[p][k], &|p, k| full[p][k], f64::EPSILON);
    let eps = f64::from(f32::EPSILON);
    Ok([long, measure(&|p, k| f64::from(short[p][k]), &|p, k| f64::from(short_full[p][k]), eps)])
}

/// Volumes that differ by a factor of 4.
fn varying<const D: usize>(particles: Particles<D>) -> Particles<D> {
    let mean = 1.0 / particles.len() as f64;
    let volumes = (0..particles.len()).map(|p| mean * (0.5 + 0.1 * ((p * 7) % 16) as f64)).collect();
    particles.with_volumes(Volumes::each(volumes).unwrap()).unwrap()
}

fn conserves<const D: usize>(m: usize, wide: f64) -> Result<()> {
    let jittered = || Particles::jittered([0.0; D], [1.0; D], [m; D], 0.3, 5);
    let torus = Domain::periodic([0.0; D], [1.0; D])?;
    let epsilon = || Epsilon::global(wide / m as f64);
    for particles in [jittered()?, varying(jittered()?)] {
        let volumes = particles.volumes()?;
        for r in [2, 4] {
            let pse = Pse::new(Laplacian::<D>, r, epsilon()?, volumes)?.support(2.5)?.allow(Allowance::Everywhere);
            // An odd degree: conserved with '+', replicating with '-'.
            let gradient = Pse::new(Gradient::<D>, r, epsilon()?, volumes)?.support(2.5)?;
            let plus = gradient.allow(Allowance::Everywhere);
            let minus = plus.clone().sign(Sign::Minus)?;
            for domain in [torus, Domain::open()] {
                let cells = CellList::build(&particles, &domain, pse.cutoff())?;
                for form in [Form::Values, Form::Strengths] {
                    check(compare(pse.clone(), form, -1.0, &cells, volumes)?, true);
                    check(compare(plus.clone(), form, 1.0, &cells, volumes)?, true);
                    check(compare(minus.clone(), form, -1.0, &cells, volumes)?, false);
                }
            }
        }
    }
    Ok(())
}

fn check(found: [Apart; 2], conserved: bool) {
    for apart in found {
        let promise = |text| Promise::new("Conservation", text).in_units("eps sum abs", 1.0);
        promise("PSE over a half list against the full gather, f64 and f32").at_most(AGREES, apart.most);
        if conserved {
            promise("PSE over a half list, total, f64 and f32").at_most(CONSERVES, apart.sum);
        } else {
            assert!(apart.sum > 1e3, "'-' with an odd degree does not conserve: {apart:?}");
        }
    }
}

#[test]
fn pse_over_a_half_list_conserves_and_agrees_with_the_full_gather() -> Result<()> {
    conserves::<1>(64, 1.5)?;
    conserves::<2>(24, 1.5)?;
    conserves::<3>(10, 1.2)
}

#[test]
fn pse_behind_mirrors_agrees_with_the_full_gather() -> Result<()> {
    for (i, x) in AXES.into_iter().enumerate() {
        let domain = Domain::new([0.0; 2], [1.0; 2], [x, AXES[(i + 4) % 7]])?;
        let jittered = || Particles::jittered([0.0; 2], [1.0; 2], [20; 2], 0.3, 5);
        for particles in [jittered()?, varying(jittered()?)] {
            let (epsilon, volumes) = (Epsilon::global(0.075)?, particles.volumes()?);
            let laplacian = Pse::new(Laplacian::<2>, 2, epsilon.clone(), volumes)?.support(2.5)?;
            let laplacian = laplacian.allow(Allowance::Everywhere);
            let cells = CellList::build(&particles, &domain, laplacian.cutoff())?;
            let [long, short] = compare(laplacian, Form::Values, -1.0, &cells, volumes)?;
            assert!(long.most <= AGREES && short.most <= AGREES, "{x:?}: {long:?} {short:?}");
            // Even mirrors let nothing through.
            let odd = domain.faces().iter().flatten().any(|&face| face == Face::MirrorOdd);
            assert_eq!(long.sum <= CONSERVES, !odd, "{x:?}: {long:?}");
            let third = Pse::new(D2::<2, 1>::default(), 2, epsilon, volumes)?.support(2.5)?;
            let third = third.allow(Allowance::Everywhere);
            for form in [Form::Values, Form::Strengths] {
                let [long, short] = compare(third.clone(), form, 1.0, &cells, volumes)?;
                assert!(long.most <= AGREES && short.most <= AGREES, "{x:?} {form:?}: {long:?} {short:?}");
            }
        }
    }
    Ok(())
}

#[test]
fn pse_over_half_lists_of_any_provider_agrees_to_round_off() -> Result<()> {
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [32; 2], 0.3, 5)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let pse = Pse::new(Laplacian::<2>, 2, Epsilon::global(0.05)?, particles.volumes()?)?.support(4.0)?;
    let pse = pse.allow(Allowance::Everywhere);
    let cutoff = pse.cutoff();
    let cells = CellList::build(&particles, &torus, cutoff)?;
    let f: Vec<f64> = particles.points().iter().map(|[x, y]| (6.0 * x).sin() + y * y).collect();
    let apply = |half: SymmetricPse<'_, 2, Exchange<2>>| {
        let mut out = vec![0.0; f.len()];
        half.apply(&f, &mut out).unwrap();
        out
    };
    let reference = apply(pse.symmetric(&cells)?);
    let rows = pse.assemble(&cells)?;
    let others = [
        apply(pse.symmetric(&BruteForce::build(&particles, &torus, cutoff)?)?),
        apply(pse.symmetric(&(&cells).canonical())?),
        apply(pse.symmetric(&VerletList::build(&particles, &torus, cutoff, 0.02)?)?),
        apply(pse.symmetric(&Nearest::build(&particles, &torus, 60)?)?),
    ];
    for out in &others {
        for p in 0..f.len() {
            let row = rows.row(p).unwrap();
            let terms = row.sources.iter().zip(row.weights).map(|(&q, w)| (w[0] * (f[q as usize] - f[p])).abs());
            assert!((out[p] - reference[p]).abs() <= AGREES * f64::EPSILON * terms.sum::<f64>(), "particle {p}");
        }
    }
    // A list stored from the cell list is the same provider: the same bits.
    assert_eq!(apply(pse.symmetric(&NeighborList::from_provider(&cells)?)?), reference);
    Ok(())
}

/// More rows than two blocks hold, in the order of cells, with periodic faces and mirrors.
fn work() -> Vec<u64> {
    let faces = [[Face::Periodic; 2], [Face::MirrorOdd, Face::MirrorEven]];
    let domain = Domain::new([0.0; 2], [1.0; 2], faces).unwrap();
    let mut bits = Vec::new();
    let lattice = Particles::jittered([0.0; 2], [1.0; 2], [64; 2], 0.3, 5).unwrap();
    let (sorted, _) = lattice.sorted_by_cell(&domain, Cutoff(0.05)).unwrap();
    for particles in [lattice, sorted] {
        let pse = Pse::new(Laplacian::<2>, 4, Epsilon::global(1.5 / 64.0).unwrap(), particles.volumes().unwrap());
        let pse = pse.unwrap().support(3.0).unwrap().allow(Allowance::Everywhere);
        let half = pse.symmetric(&CellList::build(&particles, &domain, pse.cutoff()).unwrap()).unwrap();
        let mut random = Random::new(8);
        let f: Vec<f64> = (0..particles.len()).map(|_| random.normal()).collect();
        let mut out = vec![0.0; f.len()];
        half.apply(&f, &mut out).unwrap();
        bits.extend(out.iter().map(|x| x.to_bits()));
        let f32s: Vec<f32> = f.iter().map(|&f| f as f32).collect();
        let mut short = vec![0.0_f32; f.len()];
        half.apply(&f32s, &mut short).unwrap();
        bits.extend(short.iter().map(|x| u64::from(x.to_bits())));
        let mut sums = vec![[0.0; 3]; f.len()];
        let symmetry = [Symmetry::Conserved, Symmetry::Conserved, Symmetry::Replicating];
        let pair = |pair: &parops::Pair<2>| [pair.separation[0] * f[pair.q], pair.separation[1], f[pair.p]];
        half.pairs().accumulate(symmetry, &mut sums, pair).unwrap();
        bits.extend(sums.as_flattened().iter().map(|x| x.to_bits()));
    }
    bits
}

#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let with = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work);
    let one = with(1);
    for threads in [2, 3, 8] {
        for _ in 0..3 {
            assert_eq!(with(threads), one, "{threads} threads");
        }
    }
}

#[test]
fn a_second_run_gives_the_same_bits() {
    assert_eq!(work(), work());
}

#[test]
fn sums_of_products_have_the_bits_recorded_without_threads() {
    // Products and sums alone, which are the same on every machine; recorded without the feature `rayon`.
    let particles = Particles::jittered([0.0; 2], [1.0; 2], [64; 2], 0.3, 5).unwrap();
    let torus = Domain::periodic([0.0; 2], [1.0; 2]).unwrap();
    let half =
        HalfList::from_provider(&CellList::build(&particles, &torus, Cutoff(0.05)).unwrap(), Cutoff(0.05)).unwrap();
    let mut sums = vec![[0.0; 2]; particles.len()];
    let symmetry = [Symmetry::Conserved, Symmetry::Replicating];
    half.accumulate(symmetry, &mut sums, |pair| pair.separation.map(|x| x * x * x)).unwrap();
    let digest = sums.as_flattened().iter().fold(0_u64, |digest, x| digest.rotate_left(7) ^ x.to_bits());
    assert_eq!(digest, 2_412_557_812_176_569_310);
}

#[test]
fn particles_on_mirrors_and_at_one_place_are_served() {
    // On an even mirror a particle coincides with its image, and two of them with each other's.
    let half_plane = Domain::new([0.0; 2], [f64::INFINITY, 1.0], [AXES[2], AXES[1]]).unwrap();
    let points = vec![[0.0, 0.5], [0.0, 0.5], [0.0, 0.25], [0.125, 0.5], [0.125, 0.5]];
    let particles = Particles::new(points).unwrap();
    let oracle = BruteForce::build(&particles, &half_plane, Cutoff(0.5)).unwrap();
    let cells = CellList::build(&particles, &half_plane, Cutoff(0.5)).unwrap();
    let expected = rows(&oracle, 0.5);
    assert_eq!(unfolded(&HalfList::from_provider(&oracle, Cutoff(0.5)).unwrap()), expected);
    assert_eq!(unfolded(&HalfList::from_provider(&cells, Cutoff(0.5)).unwrap()), expected);
}

#[test]
fn rows_that_are_not_symmetric_serve_their_targets_alone() {
    // 0 sees 1 and its own image; 1 sees 0 and 2; 2 sees nobody.
    let near = |q: usize, x: f64| Neighbor { q, separation: [x], sign: 1 };
    let rows = [near(1, -0.25), near(0, 0.5), near(0, 0.25), near(2, -0.25)];
    let centers = [Some(0), Some(1), Some(2)];
    let list = NeighborList::from_rows(3, &centers, &[0, 2, 4, 4], &rows, Cutoff(1.0), 7).unwrap();
    let half = HalfList::from_provider(&list, Cutoff(1.0)).unwrap();
    assert_eq!((half.mutual(), half.single(), half.generation()), (1, 2, 7));
    let mut found = vec![[0.0]; 3];
    half.accumulate([Symmetry::Conserved], &mut found, |pair| pair.separation).unwrap();
    assert_eq!(found, [[0.25], [0.0], [0.0]]);
}

/// A kernel of the Laplacian that is not even.
struct Lopsided([Term<1>; 1]);

impl Kernel<f64, 1> for Lopsided {
    fn value(&self, z: &[f64; 1]) -> f64 {
        if z[0] > 0.0 { 2.0 } else { 1.0 }
    }
    fn terms(&self) -> &[Term<1>] {
        &self.0
    }
    fn order(&self) -> u32 {
        2
    }
    fn support(&self) -> f64 {
        2.5
    }
    fn overlap_limit(&self) -> f64 {
        1.0
    }
}

#[test]
fn refusals_name_the_numbers_and_change_nothing() -> Result<()> {
    let particles = Particles::lattice([0.0], [1.0], [16])?;
    let torus = Domain::periodic([0.0], [1.0])?;
    let cells = CellList::build(&particles, &torus, Cutoff(0.25))?;
    let refused = |cutoff: f64| HalfList::from_provider(&cells, Cutoff(cutoff)).unwrap_err();
    assert_eq!(refused(0.5), Error::from(NeighborError::Reach { cutoff: 0.5, reach: 0.25 }));
    assert_eq!(refused(-1.0), Error::from(NeighborError::Cutoff { cutoff: -1.0 }));
    assert!(HalfList::from_provider(&cells, Cutoff(f64::NAN)).is_err());
    let off = CellList::build_at(&[[0.5]], &particles, &torus, Cutoff(0.25))?;
    let error = HalfList::from_provider(&off, Cutoff(0.25)).unwrap_err();
    assert_eq!(error, Error::from(NeighborError::NotParticle { center: 16, sources: 16 }).at(0));

    let half = HalfList::from_provider(&cells, Cutoff(0.25))?;
    let mut sums = vec![[0.5]; 15];
    assert!(half.accumulate([Symmetry::Conserved], &mut sums, |pair| pair.separation).is_err());
    assert_eq!(sums, vec![[0.5]; 15]);
    let stale = NeighborError::Stale { list: particles.generation(), set: 0 };
    assert_eq!(half.validate(0), Err(Error::from(stale)));

    let volumes = particles.volumes()?;
    let each = Epsilon::each((0..16).map(|p| 0.05 + 1e-3 * f64::from(p)).collect())?;
    let pse = Pse::new(Laplacian::<1>, 2, each, volumes)?.support(3.0)?.allow(Allowance::Everywhere);
    let error = pse.symmetric(&cells).err();
    assert_eq!(error, Some(Error::from(OperatorError::VariableEpsilon { low: 0.05, high: 0.065 })));

    let term = Term { index: MultiIndex::new([2]), factor: 1.0 };
    let lopsided = Pse::with_kernels([Lopsided([term])], Epsilon::global(0.1)?, volumes)?;
    let lopsided = lopsided.allow(Allowance::Everywhere);
    let error = lopsided.symmetric(&cells).err().expect("refused");
    assert_eq!(error.particle(), Some(0));
    assert!(matches!(error.kind(), parops::ErrorKind::Operator(OperatorError::Parity { .. })), "{error}");

    let first = Pse::new(D1::<1>::default(), 2, Epsilon::global(0.05)?, volumes)?.support(5.0)?;
    let first = first.allow(Allowance::Everywhere);
    let first = first.symmetric(&cells)?;
    let mut f = vec![1.0; 16];
    let mut out = vec![0.25; 16];
    f[9] = f64::NAN;
    assert_eq!(first.apply(&f, &mut out).unwrap_err().particle(), Some(9));
    assert!(first.apply(&f[1..], &mut out).is_err());
    assert_eq!(out, vec![0.25; 16]);
    Ok(())
}
