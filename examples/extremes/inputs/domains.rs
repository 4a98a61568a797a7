//! Bad domains and bad neighbor searches.

use std::error::Error;

use parops::{
    ApplyError, BruteForce, CellList, Cutoff, DcPse, Domain, DomainError, ErrorKind, Eulerian, Face, Laplacian,
    Nearest, NeighborError, NeighborList, Neighbors, Particles, Rk4, VerletList,
};

use super::world::{H, World, refused};
use crate::case::Case;
use crate::failures::naive_dcpse::wrapped;
use crate::is;

type Done = Result<(), Box<dyn Error>>;

fn faces(case: &mut Case, lower: f64, upper: f64) -> parops::Result<()> {
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Domain(DomainError::Faces { axis: 0, lower: l, upper: u }) if (l.to_bits(), u.to_bits()) == (lower.to_bits(), upper.to_bits()));
    refused(case, &mut (), None, due, |_, ()| Domain::periodic([lower], [upper]))?;
    refused(case, &mut (), None, due, |_, ()| Domain::new([lower], [upper], [[Face::Open; 2]]))?;
    refused(case, &mut (), None, due, |_, ()| Particles::lattice([lower], [upper], [4]))
}

/// 24. A box without inside.
pub fn reversed(case: &mut Case, _: bool) -> Done {
    case.setup("faces at 1 and 1, and at 2 and 1");
    let inside = |x: f64, lower: f64, upper: f64| lower + (x - lower).rem_euclid(upper - lower);
    let (empty, turned) = (inside(1.5, 1.0, 1.0), inside(1.5, 2.0, 1.0));
    case.naive(
        empty.is_nan() && !(1.0..=2.0).contains(&turned),
        format!("x = 1.5 wrapped by the width is {empty} in the first, and {turned}, beyond both faces, in the second"),
    );
    faces(case, 1.0, 1.0)?;
    Ok(faces(case, 2.0, 1.0)?)
}

/// 25. A face that is no number.
pub fn nan_face(case: &mut Case, _: bool) -> Done {
    case.setup("a lower or an upper face that is NaN");
    let naive = 0.25_f64.rem_euclid(f64::NAN);
    case.naive(naive.is_nan(), format!("a coordinate modulo the width is {naive}"));
    faces(case, f64::NAN, 1.0)?;
    Ok(faces(case, 0.0, f64::NAN)?)
}

/// 26. A periodic axis narrower than two cutoffs.
pub fn narrow(case: &mut Case, _: bool) -> Done {
    const CUTOFF: f64 = 0.6;
    case.setup("8 particles on a ring of length 1, cutoff 0.6");
    let x = |i: usize| (i as f64 + 0.5) / 8.0;
    let (mut shortest, mut all) = (0, 0);
    for i in 1..8 {
        let s: f64 = x(i) - x(0);
        shortest += usize::from((s - s.round()).abs() <= CUTOFF);
        all += (-2..=2).filter(|&k| (s + f64::from(k)).abs() <= CUTOFF).count();
    }
    case.naive(shortest < all, format!("by the shortest image {shortest} neighbors, there are {all}"));
    let mut own = (Particles::lattice([0.0], [1.0], [8])?, Domain::periodic([0.0], [1.0])?);
    let due = is!(Domain, DomainError::Narrow { axis: 0, width, cutoff } if *width == 1.0 && *cutoff >= CUTOFF);
    refused(case, &mut own, None, due, |_, (set, ring)| CellList::build(set, ring, Cutoff(CUTOFF)))?;
    refused(case, &mut own, None, due, |_, (set, ring)| BruteForce::build(set, ring, Cutoff(CUTOFF)))?;
    refused(case, &mut own, None, due, |_, (set, ring)| VerletList::build(set, ring, Cutoff(CUTOFF), 0.1))?;
    Ok(())
}

/// 27. A particle outside.
pub fn outside(case: &mut Case, _: bool) -> Done {
    case.setup("particle 1 at y = -0.25 in a box from 0 to 1 with open faces, and one that moves there");
    let cell = (-0.25_f64 / 0.1) as usize;
    case.naive(cell == 0, format!("the cast puts it into cell {cell}, inside"));
    let domain = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2]; 2])?;
    let mut own = Particles::new(vec![[0.5, 0.5], [0.5, -0.25]])?;
    let due = is!(Domain, DomainError::Outside { axis: 1, coordinate: -0.25, lower: 0.0, upper: 1.0 });
    refused(case, &mut own, Some(1), due, |_, set| CellList::build(set, &domain, Cutoff(0.2)))?;
    refused(case, &mut own, Some(1), due, |_, set| BruteForce::build(set, &domain, Cutoff(0.2)))?;
    let inside = Particles::new(vec![[0.5, 0.5], [0.5, 0.25]])?;
    let mut list = VerletList::build(&inside, &domain, Cutoff(0.3), 0.05)?;
    refused(case, &mut own, Some(1), due, |_, moved| list.update(moved))?;
    let (kept, answers) = (list.validate(inside.generation()).is_ok(), [list.count(0, 0.3), list.count(1, 0.3)]);
    case.prevents(kept && answers == [1, 1], "the list still answers for the places before");
    Ok(())
}

/// 28. Exactly on the upper face.
pub fn upper_face(case: &mut Case, _: bool) -> Done {
    case.setup("x = 1 on a ring from 0 to 1, with a neighbor at 0.05");
    let cell = (1.0_f64 / 0.1) as usize;
    case.naive(cell == 10, format!("cell {cell} of 10, counted from 0"));
    let ring = Domain::periodic([0.0], [1.0])?;
    let [wrapped] = ring.wrap(&[1.0])?;
    let set = Particles::new(vec![[1.0], [0.05]])?;
    let cells = CellList::build(&set, &ring, Cutoff(0.1))?;
    case.adapts(
        wrapped == 0.0 && cells.count(0, 0.1) == 1 && cells.count(1, 0.1) == 1,
        format!("it is at {wrapped}, and both see each other"),
    );
    Ok(())
}

/// 29. One ulp below the lower face.
pub fn below_face(case: &mut Case, _: bool) -> Done {
    let x = 0.0_f64.next_down();
    case.setup(format!("x = {x:e} on a ring from 0 to 1, and one ulp below 1 on a ring from 1 to 2"));
    let naive = x.rem_euclid(1.0);
    case.naive(naive == 1.0, format!("x modulo 1 is {naive}, the upper face"));
    let [first] = Domain::periodic([0.0], [1.0])?.wrap(&[x])?;
    let [second] = Domain::periodic([1.0], [2.0])?.wrap(&[1.0_f64.next_down()])?;
    let ring = Domain::periodic([0.0], [1.0])?;
    let cells = CellList::build(&Particles::new(vec![[x], [0.05], [0.95]])?, &ring, Cutoff(0.1))?;
    case.adapts(
        (0.0..1.0).contains(&first) && (1.0..2.0).contains(&second) && cells.count(0, 0.1) == 2,
        format!("they are at {first} and {second}, inside; the first sees both of its neighbors"),
    );
    Ok(())
}

fn width(case: &mut Case, width: f64, naive: f64) -> Done {
    case.setup(format!("a box of width {width:e}"));
    case.naive(naive == 0.0 || naive.is_infinite(), format!("the square of the width is {naive}"));
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Domain(DomainError::Width { axis: 0, width: w, low, high }) if *w == width && !(*low..=*high).contains(w));
    refused(case, &mut (), None, due, |_, ()| Domain::periodic([0.0], [width]))?;
    refused(case, &mut (), None, due, |_, ()| Domain::new([0.0], [width], [[Face::MirrorEven; 2]]))?;
    Ok(())
}

/// 30. A box of no size.
pub fn thin_box(case: &mut Case, _: bool) -> Done {
    width(case, 1e-300, 1e-300 * 1e-300)
}

/// 31. A box of endless size.
pub fn wide_box(case: &mut Case, _: bool) -> Done {
    width(case, 1e300, 1e300 * 1e300)
}

fn cutoff(case: &mut Case, bad: f64, naive: impl FnOnce(&World) -> (bool, String)) -> Done {
    case.setup(format!("cutoff {bad}, for lists of all kinds"));
    let world = World::new()?;
    let (exposed, text) = naive(&world);
    case.naive(exposed, text);
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Neighbor(NeighborError::Cutoff { cutoff }) if cutoff.to_bits() == bad.to_bits());
    refused(case, &mut (), None, due, |w, ()| CellList::build(&w.particles, &w.torus, Cutoff(bad)))?;
    refused(case, &mut (), None, due, |w, ()| BruteForce::build(&w.particles, &w.torus, Cutoff(bad)))?;
    refused(case, &mut (), None, due, |w, ()| VerletList::build(&w.particles, &w.torus, Cutoff(bad), 0.1 * H))?;
    Ok(())
}

/// How many of the world are within a distance of particle 0, by a comparison of squares.
fn within(world: &World, cutoff: f64) -> usize {
    let points = world.particles.points();
    let square = |x: &[f64; 2]| (x[0] - points[0][0]).powi(2) + (x[1] - points[0][1]).powi(2);
    points[1..].iter().filter(|x| square(x) <= cutoff * cutoff).count()
}

/// 32. No cutoff.
pub fn zero_cutoff(case: &mut Case, _: bool) -> Done {
    cutoff(case, 0.0, |_| {
        let cells = (1.0 / 0.0_f64) as i64;
        (cells == i64::MAX, format!("{cells} cells along an axis"))
    })
}

/// 33. A negative cutoff.
pub fn negative_cutoff(case: &mut Case, _: bool) -> Done {
    cutoff(case, -2.0 * H, |world| {
        let found = within(world, -2.0 * H);
        (found > 0, format!("compared by squares, {found} neighbors are within a cutoff below zero"))
    })
}

/// 34. A cutoff that is no number.
pub fn nan_cutoff(case: &mut Case, _: bool) -> Done {
    cutoff(case, f64::NAN, |world| {
        let found = within(world, f64::NAN);
        (found == 0, format!("{found} neighbors, without an error"))
    })
}

/// 35. An infinite cutoff.
pub fn infinite_cutoff(case: &mut Case, _: bool) -> Done {
    cutoff(case, f64::INFINITY, |world| {
        let found = within(world, f64::INFINITY);
        (found == world.particles.len() - 1, format!("all {found} others, each of whose images are endlessly many"))
    })
}

/// 36. More cells along an axis than can be counted.
pub fn cells(case: &mut Case, _: bool) -> Done {
    case.setup("two groups 2^33 and 2^100 cutoffs apart");
    let cell = 2.0_f64.powi(33) as i32;
    case.naive(cell == i32::MAX, format!("a cell number of 32 bits stops at {cell}"));
    let set = |far: f64| Particles::new(vec![[0.0], [0.5], [far], [far + 0.5]]);
    let near = set(2.0_f64.powi(33))?;
    let list = CellList::build(&near, &Domain::open(), Cutoff(1.0))?;
    let counts: Vec<usize> = (0..4).map(|p| list.count(p, 1.0)).collect();
    case.adapts(counts == [1; 4], format!("2^33 cells are legal, with {counts:?} neighbors"));
    let due = is!(Neighbor, NeighborError::Cells { axis: 0, cells, limit } if cells > limit);
    refused(case, &mut set(2.0_f64.powi(100))?, None, due, |_, set| {
        CellList::build(set, &Domain::open(), Cutoff(1.0))
    })?;
    Ok(())
}

/// Whether a type has a value by default.
macro_rules! defaults {
    ($type:ty) => {{
        struct Probe<T>(std::marker::PhantomData<T>);
        #[allow(dead_code)]
        trait Otherwise {
            const DEFAULTS: bool = false;
        }
        impl<T> Otherwise for Probe<T> {}
        #[allow(dead_code)]
        impl<T: Default> Probe<T> {
            const DEFAULTS: bool = true;
        }
        <Probe<$type>>::DEFAULTS
    }};
}

/// The public functions of a source file that make a value from none of its kind, and cannot fail.
fn infallible(source: &str) -> Vec<&str> {
    let makes = |signature: &&str| {
        let (arguments, result) = signature.split_once("->").unwrap_or((signature, ""));
        !arguments.contains("self") && result.contains("Self") && !result.trim_start().starts_with("Result<")
    };
    source.split("pub fn ").skip(1).map(|rest| rest.split('{').next().unwrap_or("")).filter(makes).collect()
}

/// 37. A query before the build.
pub fn unbuilt(case: &mut Case, _: bool) -> Done {
    case.setup("a list that was never built, and a target that does not exist");
    let table: Vec<Vec<u32>> = Vec::new();
    let found = table.first().map_or(0, Vec::len);
    case.naive(found == 0, format!("an empty table answers {found} neighbors for any particle"));
    // A type whose fields are private and that has no value by default can only come from its own functions.
    let sources = [
        ("BruteForce", include_str!("../../../src/neighbors/brute_force.rs")),
        ("CellList", include_str!("../../../src/neighbors/cell_list.rs")),
        ("HalfList", include_str!("../../../src/neighbors/half.rs")),
        ("KdTree", include_str!("../../../src/neighbors/tree.rs")),
        ("Nearest", include_str!("../../../src/neighbors/nearest.rs")),
        ("NeighborList", include_str!("../../../src/neighbors/list.rs")),
        ("Selected", include_str!("../../../src/neighbors/selected.rs")),
        ("Upstream", include_str!("../../../src/neighbors/upstream.rs")),
        ("VerletList", include_str!("../../../src/neighbors/verlet.rs")),
    ];
    let sealed = |(name, source): &(&str, &str)| {
        let fields = source.split(&format!("pub struct {name}<")).nth(1).and_then(|rest| rest.split("\n}").next());
        fields.is_some_and(|fields| !fields.contains("    pub ")) && infallible(source).is_empty()
    };
    let by_default = [
        defaults!(BruteForce<2>),
        defaults!(CellList<2>),
        defaults!(parops::HalfList<2>),
        #[cfg(feature = "kiddo")]
        defaults!(parops::KdTree<2>),
        defaults!(Nearest<2>),
        defaults!(NeighborList<2>),
        defaults!(parops::Selected<CellList<2>>),
        defaults!(parops::Upstream<'static, CellList<2>>),
        defaults!(VerletList<2>),
    ];
    // The two checks find what there is to find.
    let awake = defaults!(Vec<u8>) && infallible("pub fn new(n: usize) -> Self {}").len() == 1;
    case.prevents(
        awake && !by_default.contains(&true) && sources.iter().all(sealed),
        "no provider has a value that was not built: none implements Default or has public fields, and every public function that makes one returns a Result",
    );
    let due = is!(Neighbor, NeighborError::Target { p: 999, .. });
    refused(case, &mut (), Some(999), due, |world, ()| parops::mean_neighbor_distance(&world.cells, 999))?;
    Ok(())
}

/// Rows by comparing each place with all others on the unit torus.
fn by_hand(points: &[[f64; 2]], cutoff: f64) -> Vec<Vec<usize>> {
    let near = |x: &[f64; 2], y: &[f64; 2]| {
        let s = wrapped(x, y);
        s[0] * s[0] + s[1] * s[1] <= cutoff * cutoff
    };
    let row = |p: usize| (0..points.len()).filter(|&q| q != p && near(&points[p], &points[q])).collect();
    (0..points.len()).map(row).collect()
}

/// The rows of a provider, in the order of the numbers.
fn rows_of(count: usize, list: impl Fn(usize, &mut Vec<usize>)) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new(); count];
    for (p, row) in all.iter_mut().enumerate() {
        list(p, row);
        row.sort_unstable();
    }
    all
}

/// 38. A query after the particles have moved.
pub fn stale(case: &mut Case, _: bool) -> Done {
    const CUTOFF: f64 = 2.5 * H;
    case.setup("the particles move by 2 h, the skin is 0.2 h");
    let world = World::new()?;
    let mut random = parops::Random::new(4);
    let moved: Vec<[f64; 2]> =
        world.particles.points().iter().map(|x| x.map(|x| x + 2.0 * H * (2.0 * random.uniform() - 1.0))).collect();
    let mut now = world.particles.clone();
    now.set_points(&moved)?;
    let (old, new) = (by_hand(world.particles.points(), CUTOFF), by_hand(&moved, CUTOFF));
    let lost: usize = new.iter().zip(&old).map(|(new, old)| new.iter().filter(|q| !old.contains(q)).count()).sum();
    case.naive(
        lost > 0,
        format!("a table of before misses {lost} of {} pairs of now", new.iter().map(Vec::len).sum::<usize>()),
    );
    let kept = rows_of(now.len(), |p, row| world.cells.for_each(p, CUTOFF, |q| row.push(q.q)));
    case.reports(
        kept == old,
        "a list answers for the places it was built at, without an error; whether they are those of now is for the caller to ask of validate, and a solver asks:",
    );
    let list = is!(Neighbor, NeighborError::Stale { list, set } if list != set);
    refused(case, &mut now.clone(), None, list, |world, now| world.verlet.validate(now.generation()))?;
    let rows = is!(Apply, ApplyError::Stale { rows, set } if rows != set);
    refused(case, &mut now.clone(), None, rows, |world, now| {
        let scene = parops::AdvectionDiffusion::<2>::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new());
        Eulerian::new(scene, now, &world.cells, Rk4::new())
    })?;
    let mut verlet = world.verlet.clone();
    let again = verlet.update(&now)?;
    let same = rows_of(now.len(), |p, row| verlet.for_each(p, CUTOFF, |q| row.push(q.q))) == new;
    case.adapts(
        again && same,
        "an update finds that the skin is used up, and searches all rows anew: they are those of now",
    );
    Ok(())
}

/// 39. A neighbor at exactly the cutoff.
pub fn tie(case: &mut Case, _: bool) -> Done {
    const N: usize = 100;
    case.setup("a lattice of spacing 0.1 on a unit torus, cutoff 0.3");
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [10; 2])?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let cutoff = 0.3;
    let (mut by_root, mut by_square) = (0, 0);
    for x in lattice.points() {
        for y in lattice.points() {
            let s = [x[0] - y[0], x[1] - y[1]].map(|s: f64| s - s.round());
            let square = s[0] * s[0] + s[1] * s[1];
            by_root += usize::from(square.sqrt() <= cutoff);
            by_square += usize::from(square / (cutoff * cutoff) <= 1.0);
        }
    }
    case.naive(
        (2501..2900).contains(&by_root) && (2501..2900).contains(&by_square),
        // 24 are nearer, 4 at the cutoff, and each sees itself.
        format!(
            "of 400 pairs at the cutoff |s| <= r_c takes {}, |s|^2 / r_c^2 <= 1 takes {}: rounding decides",
            by_root - 2500,
            by_square - 2500
        ),
    );
    let cells = CellList::build(&lattice, &torus, Cutoff(cutoff))?;
    let brute = BruteForce::build(&lattice, &torus, Cutoff(cutoff))?;
    let list = NeighborList::from_provider(&cells)?;
    let verlet = VerletList::build(&lattice, &torus, Cutoff(cutoff), 0.02)?;
    let found = [
        rows_of(N, |p, row| brute.for_each(p, cutoff, |q| row.push(q.q))),
        rows_of(N, |p, row| cells.for_each(p, cutoff, |q| row.push(q.q))),
        rows_of(N, |p, row| list.for_each(p, cutoff, |q| row.push(q.q))),
        rows_of(N, |p, row| verlet.for_each(p, cutoff, |q| row.push(q.q))),
    ];
    let same = found.windows(2).all(|pair| pair[0] == pair[1]);
    #[cfg(feature = "kiddo")]
    let same = {
        let tree = parops::KdTree::build(&lattice, &torus, Cutoff(cutoff))?;
        same && found[0] == rows_of(N, |p, row| tree.for_each(p, cutoff, |q| row.push(q.q)))
    };
    let pairs: usize = found[0].iter().map(Vec::len).sum();
    case.prevents(same, format!("every provider compares the same bits: {pairs} pairs, the same ones"));
    let mirrored = |p: usize| found[0][p].iter().all(|&q| found[0][q].contains(&p));
    case.prevents(same && pairs > 0 && (0..N).all(mirrored), "each pair from both of its sides");
    Ok(())
}
