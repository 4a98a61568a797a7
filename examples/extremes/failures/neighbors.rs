//! Neighbors: images, faces, seams, duplicates, searches without end, and numbers too large for an index.

use std::error::Error;
use std::f64::consts::TAU;

use parops::{
    Apply, BruteForce, CellList, Cutoff, Domain, DomainError, ErrorKind, Fallback, Laplacian, Mesh, MeshError, Nearest,
    NeighborError, NeighborList, Neighbors, PARTICLES_HIGH, ParticleError, Particles, Pse, Rows, Selected,
    epsilon_from_neighbors,
};

use super::sets::{cells, dcpse, laplacian, square, torus, values, wave};
use crate::case::Case;

type Done = Result<(), Box<dyn Error>>;

/// The neighbors of every particle as sorted lists.
fn sorted(provider: &impl Neighbors<2>, cutoff: f64) -> Vec<Vec<u32>> {
    let row = |p: usize| {
        let mut row = Vec::new();
        provider.for_each(p, cutoff, |neighbor| row.push(neighbor.q as u32));
        row.sort_unstable();
        row
    };
    (0..provider.targets()).map(row).collect()
}

/// Pairs within a cutoff on the unit torus, every image in its own right.
fn all_images(points: &[[f64; 2]], cutoff: f64) -> usize {
    let mut count = 0;
    for (p, x) in points.iter().enumerate() {
        for (q, y) in points.iter().enumerate() {
            for i in -1..=1 {
                for j in -1..=1 {
                    let s = [x[0] - y[0] - f64::from(i), x[1] - y[1] - f64::from(j)];
                    count += usize::from((p != q || i != 0 || j != 0) && s[0] * s[0] + s[1] * s[1] <= cutoff * cutoff);
                }
            }
        }
    }
    count
}

/// 22. Cutoffs beyond half the box, and few cells.
pub fn images(case: &mut Case, _: bool) -> Done {
    case.setup("300 random particles on the unit torus, cutoff 0.51; then 0.49, two cells an axis");
    let particles = Particles::random([0.0; 2], [1.0; 2], 300, 8)?;
    let points = particles.points();
    let nearest_image = |cutoff: f64| {
        let within = |x: &[f64; 2], y: &[f64; 2]| {
            let s = super::naive_dcpse::wrapped(x, y);
            s[0] * s[0] + s[1] * s[1] <= cutoff * cutoff
        };
        points
            .iter()
            .enumerate()
            .map(|(p, x)| points.iter().enumerate().filter(|(q, y)| *q != p && within(x, y)).count())
            .sum::<usize>()
    };
    // Two cells an axis, their eight neighbors visited without a look at which are the same.
    let two_cells = |cutoff: f64| {
        let cell = |x: &[f64; 2]| x.map(|x| usize::from(x >= 0.5));
        let mut count = 0;
        for (p, x) in points.iter().enumerate() {
            for (i, j) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let wanted = [cell(x)[0] as i32 + i, cell(x)[1] as i32 + j].map(|c| c.rem_euclid(2) as usize);
                let near = points.iter().enumerate().filter(|(q, y)| {
                    let s = super::naive_dcpse::wrapped(x, y);
                    *q != p && cell(y) == wanted && s[0] * s[0] + s[1] * s[1] <= cutoff * cutoff
                });
                count += near.count();
            }
        }
        count
    };
    let (exact, lost) = (all_images(points, 0.51), nearest_image(0.51));
    let (right, doubled) = (all_images(points, 0.49), two_cells(0.49));
    case.naive(
        lost < exact && doubled > right,
        format!("nearest image only: {} of {exact} pairs lost; two cells an axis: {doubled} pairs counted in place of {right}", exact - lost),
    );
    let refusal = cells(&particles, &torus()?, 0.51).err();
    let typed = matches!(refusal.as_ref().map(parops::Error::kind), Some(ErrorKind::Domain(DomainError::Narrow { width, cutoff, .. })) if *width == 1.0 && *cutoff == 0.51);
    case.detects(typed, refusal.map_or(String::from("accepted"), |error| error.to_string()));
    let cutoff = Cutoff(0.49);
    let found: Vec<Vec<Vec<u32>>> = vec![
        sorted(&CellList::build(&particles, &torus()?, cutoff)?, 0.49),
        sorted(&BruteForce::build(&particles, &torus()?, cutoff)?, 0.49),
        sorted(&NeighborList::from_provider(&CellList::build(&particles, &torus()?, cutoff)?)?, 0.49),
    ];
    let counts: Vec<usize> = found.iter().map(|rows| rows.iter().map(Vec::len).sum()).collect();
    case.prevents(
        counts.iter().all(|count| *count == right) && found.windows(2).all(|pair| pair[0] == pair[1]),
        format!("with cutoff 0.49 cell list, list and brute force find {counts:?} pairs, as all images do"),
    );
    Ok(())
}

/// 23. A coordinate that wraps onto the upper face.
pub fn wrap(case: &mut Case, _: bool) -> Done {
    case.setup(
        "x = -1e-17 and its neighbors in floating point, periodic boxes [0, 1), [-1, 1), [0.1, 0.7), [1e6, 1e6 + 1)",
    );
    let naive = (-1e-17_f64).rem_euclid(1.0);
    let cell = (naive / 0.25) as usize;
    case.naive(
        naive == 1.0 && cell == 4,
        format!("x mod 1 = {naive}, which is the upper face: cell {cell} of 4, counted from 0"),
    );
    let (mut wrong, mut tried) = (0, 0);
    for (low, high) in [(0.0, 1.0), (-1.0, 1.0), (0.1, 0.7), (1e6, 1e6 + 1.0)] {
        let domain = Domain::periodic([low], [high])?;
        let width: f64 = high - low;
        for face in [low, high, low - width, high + width] {
            let mut around = vec![face, face - 1e-17, face + 1e-17];
            let (mut below, mut above) = (face, face);
            for _ in 0..4 {
                (below, above) = (below.next_down(), above.next_up());
                around.extend([below, above]);
            }
            for x in around {
                let [y] = domain.wrap(&[x])?;
                tried += 1;
                let inside = (low..high).contains(&y);
                let near = ((y - low).abs()).min((high - y).abs()) <= 1e-9 * width.max(1.0);
                wrong += usize::from(!(inside && near && domain.wrap(&[y])? == [y]));
            }
        }
    }
    case.adapts(
        wrong == 0,
        format!(
            "half-open: of {tried} places within 4 ulp of a face {wrong} leave the box; -1e-17 becomes {}",
            Domain::periodic([0.0], [1.0])?.wrap(&[-1e-17])?[0]
        ),
    );
    Ok(())
}

/// 24. Sums that depend on who computes them.
pub fn seams(case: &mut Case, quick: bool) -> Done {
    let (m, steps) = (32, if quick { 40 } else { 100 });
    case.setup(format!("diffusion by PSE on {m}x{m} particles, jitter 0.1 h, {steps} steps by 1, 2, 3 and 8 threads, each with its own part"));
    let particles = square(m, 0.1, 4)?;
    let h = 1.0 / m as f64;
    let method =
        Pse::new(Laplacian::<2>, 2, particles.spacing()?.epsilon(1.5)?, particles.volumes()?)?.moment_tolerance(1.0)?;
    let around = cells(&particles, &torus()?, method.cutoff().0)?;
    let dt = 0.1 * h * h;
    let start = values(&particles, wave);

    // Every thread scatters the pairs of its part into a field of its own; the fields are then added up.
    let whole = method.assemble(&around)?;
    let scattered = |threads: usize| {
        let mut u = start.clone();
        for _ in 0..steps {
            let part = |t: usize| {
                let mut own = vec![0.0; u.len()];
                for p in (0..u.len()).filter(|p| p * threads / u.len() == t) {
                    if let Some(row) = whole.row(p) {
                        for (&q, [w]) in row.sources.iter().zip(row.weights) {
                            let q = q as usize;
                            own[p] += 0.5 * w * (u[q] - u[p]);
                            own[q] -= 0.5 * w * (u[q] - u[p]);
                        }
                    }
                }
                own
            };
            let parts: Vec<Vec<f64>> = std::thread::scope(|scope| {
                let handles: Vec<_> = (0..threads).map(|t| scope.spawn(move || part(t))).collect();
                handles.into_iter().filter_map(|handle| handle.join().ok()).collect()
            });
            u.iter_mut().enumerate().for_each(|(p, u)| *u += dt * parts.iter().map(|part| part[p]).sum::<f64>());
        }
        u
    };
    let different = |a: &[f64], b: &[f64]| a.iter().zip(b).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    let one = scattered(1);
    let naive: Vec<usize> = [2, 3, 8].map(|threads| different(&one, &scattered(threads))).to_vec();
    case.naive(
        naive.iter().all(|count| *count > 0),
        format!("values that differ from those of one thread, for 2, 3 and 8: {naive:?} of {}", m * m),
    );

    // Every thread owns the rows of its part, and reads the whole field.
    let owned = |threads: usize| -> parops::Result<Vec<f64>> {
        let targets = |t: usize| (0..m * m).filter(|p| p * threads / (m * m) == t).collect::<Vec<_>>();
        let parts: Vec<Vec<usize>> = (0..threads).map(targets).collect();
        let rows: Vec<Rows> =
            parts.iter().map(|part| method.assemble(&Selected::new(&around, part)?)).collect::<Result<_, _>>()?;
        let (mut u, mut lap) = (start.clone(), vec![0.0; m * m]);
        for _ in 0..steps {
            let mut rest = lap.as_mut_slice();
            let done = std::thread::scope(|scope| {
                let mut handles = Vec::new();
                for rows in &rows {
                    let (own, others) = std::mem::take(&mut rest).split_at_mut(rows.targets());
                    rest = others;
                    let u = &u;
                    handles.push(scope.spawn(move || rows.apply(u, own)));
                }
                handles.into_iter().all(|handle| matches!(handle.join(), Ok(Ok(()))))
            });
            assert!(done, "a part failed");
            u.iter_mut().zip(&lap).for_each(|(u, lap)| *u += dt * lap);
        }
        Ok(u)
    };
    let one = owned(1)?;
    let ours: Vec<usize> =
        [2, 3, 8].iter().map(|&threads| owned(threads).map(|u| different(&one, &u))).collect::<Result<_, _>>()?;
    case.prevents(
        ours.iter().all(|count| *count == 0),
        format!("each row by one owner in its own order: {ours:?} values differ"),
    );
    #[cfg(feature = "rayon")]
    {
        let mut pools = Vec::new();
        for threads in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            pools.push(pool.install(|| -> parops::Result<Vec<f64>> {
                let rows = method.assemble(&around)?;
                let (mut u, mut lap) = (start.clone(), vec![0.0; m * m]);
                for _ in 0..steps {
                    rows.apply(&u, &mut lap)?;
                    u.iter_mut().zip(&lap).for_each(|(u, lap)| *u += dt * lap);
                }
                Ok(u)
            })?);
        }
        let counts: Vec<usize> = pools.iter().map(|u| different(&one, u)).collect();
        case.prevents(
            counts.iter().all(|count| *count == 0),
            format!("pools of 1, 2, 3 and 8 threads inside the library: {counts:?}"),
        );
    }
    Ok(())
}

/// The depth of a tree that halves by value at the median until a leaf holds one point; it ends at a limit.
fn naive_depth(values: &mut [f64], depth: usize, limit: usize) -> usize {
    if values.len() <= 1 || depth == limit {
        return depth;
    }
    values.sort_by(f64::total_cmp);
    let median = values[values.len() / 2];
    let below = values.iter().filter(|x| **x <= median).count();
    let (left, right) = values.split_at_mut(below);
    naive_depth(left, depth + 1, limit).max(naive_depth(right, depth + 1, limit))
}

/// 25. Duplicates and aligned points.
pub fn duplicates(case: &mut Case, quick: bool) -> Done {
    let count = if quick { 100_000 } else { 300_000 };
    case.setup(format!("33 points with one x, 1000 at one place, and {count} values rounded to 4 digits"));
    let mut random = parops::Random::new(5);
    let mut aligned = vec![0.25; 33];
    let mut rounded: Vec<f64> = (0..count).map(|_| (1e4 * random.uniform()).round() / 1e4).collect();
    const LIMIT: usize = 1000;
    let (a, b) = (naive_depth(&mut aligned, 0, LIMIT), naive_depth(&mut rounded[..2000].to_vec(), 0, LIMIT));
    case.naive(a == LIMIT && b == LIMIT, format!("a tree split at the median does not end: depth {a} on 33 aligned values, {b} on 2000 rounded ones, where it was stopped"));

    let wall: Vec<[f64; 2]> = (0..33).map(|i| [0.25, 0.03 * f64::from(i)]).collect();
    let heap = vec![[0.5, 0.5]; 1000];
    let mut agree = true;
    for (points, cutoff) in [(wall, 0.1), (heap, 0.1)] {
        let particles = Particles::new(points)?;
        let brute = sorted(&BruteForce::build(&particles, &Domain::open(), Cutoff(cutoff))?, cutoff);
        agree &= sorted(&cells(&particles, &Domain::open(), cutoff)?, cutoff) == brute;
        let closest = Nearest::build(&particles, &Domain::open(), 4)?;
        agree &= (0..particles.len()).all(|p| closest.count(p, closest.cutoff(p)) >= 4);
        #[cfg(feature = "kiddo")]
        {
            agree &= sorted(&parops::KdTree::build(&particles, &Domain::open(), Cutoff(cutoff))?, cutoff) == brute;
        }
    }
    let line = Particles::new(rounded.iter().map(|x| [*x]).collect())?;
    let list = CellList::build(&line, &Domain::open(), Cutoff(1.5e-4))?;
    // Whoever is within one step of the last digit, counted from the sorted values.
    rounded.sort_by(f64::total_cmp);
    let expected =
        |x: f64| rounded.partition_point(|y| *y <= x + 1.5e-4) - rounded.partition_point(|y| *y < x - 1.5e-4) - 1;
    let right = (0..count).step_by(97).filter(|&p| list.count(p, 1.5e-4) == expected(line.points()[p][0])).count();
    case.prevents(
        agree && right == count.div_ceil(97),
        format!("no tree to overflow: all providers agree with brute force on both sets, and {right} of {} rows of the line are those of a sorted array", count.div_ceil(97)),
    );
    Ok(())
}

/// 27. A number of neighbors that an isolated particle never has.
pub fn isolated(case: &mut Case, _: bool) -> Done {
    const WANTED: usize = 60;
    case.setup("24x24 jittered particles and one 40 h away; epsilon is varied until each has 60 +- 5 neighbors, 10 times at most");
    let h = 1.0 / 24.0;
    let mut points = square(24, 0.2, 6)?.points().to_vec();
    points.push([1.0 + 40.0 * h, 0.5]);
    let lonely = points.len() - 1;
    let count = |p: usize, r: f64| {
        points
            .iter()
            .enumerate()
            .filter(|(q, y)| *q != p && (y[0] - points[p][0]).hypot(y[1] - points[p][1]) <= r)
            .count()
    };
    let mut radius = 3.0 * h;
    let mut deleted = true;
    for _ in 0..10 {
        let found = count(lonely, radius);
        if found.abs_diff(WANTED) <= 5 {
            deleted = false;
            break;
        }
        // The usual iteration: half of the way to the radius that would hold as many, by a factor of 1.2 at most.
        radius *= (0.5 + 0.5 * (WANTED as f64 / found.max(1) as f64).sqrt()).clamp(0.8, 1.2);
    }
    let naive = count(lonely, radius);
    case.naive(
        deleted,
        format!(
            "no convergence: {naive} neighbors after 10 rounds, so the particle is dropped or its rates are set to zero"
        ),
    );

    let particles = Particles::new(points.clone())?;
    let open = Domain::open();
    let refusal = epsilon_from_neighbors(&cells(&particles, &open, 4.0 * h)?, 1.5).err();
    let named = refusal.as_ref().is_some_and(|error| {
        error.particle() == Some(lonely) && matches!(error.kind(), ErrorKind::Neighbor(NeighborError::Isolated { .. }))
    });
    case.reports(named, refusal.map_or(String::from("accepted"), |error| error.to_string()));
    let method = dcpse(laplacian()?, 2)?;
    let near = cells(&particles, &open, 5.0 * h)?;
    let refused = method.assemble(&near).err();
    let flagged = method.clone().fallback(Fallback::Empty).assemble(&near)?;
    let report = flagged.report();
    let worst = report.worst().map(|row| (row.target, row.empty));
    case.reports(
        refused.is_some() && report.rows == points.len() && report.empty >= 1 && worst == Some((lonely, true)),
        format!(
            "rows: {}; an empty row is only left where that is asked for, and counted: {} of {}, particle {}",
            refused.map_or(String::from("accepted"), |error| error.to_string()),
            report.empty,
            report.rows,
            worst.map_or(0, |(p, _)| p)
        ),
    );
    let all = Nearest::build(&particles, &open, WANTED)?;
    let found = all.count(lonely, all.cutoff(lonely));
    case.adapts(
        (WANTED..=WANTED + 5).contains(&found) && all.targets() == points.len(),
        format!(
            "a cutoff per particle by search, not by iteration: {found} neighbors within {:.1} h of it",
            all.cutoff(lonely) / h
        ),
    );
    Ok(())
}

/// 29. Numbers beyond the index.
pub fn index_overflow(case: &mut Case, _: bool) -> Done {
    case.setup("an index of 8 bits with 300 points; then sets and meshes of 2000^3 and more points by request");
    let points: Vec<f64> = (0..300).map(|i| f64::from(i) * 0.5).collect();
    let order: Vec<u8> = (0..points.len()).map(|i| i as u8).collect();
    let wrong = (1..points.len()).filter(|&i| points[order[i] as usize] - points[order[i - 1] as usize] != 0.5).count();
    let distance = (points[order[256] as usize] - points[order[0] as usize]).abs();
    case.naive(
        wrong > 0 && distance == 0.0,
        format!("the cast wraps: point 256 is taken for point 0, distance {distance}, without an error"),
    );
    let refused = [
        Particles::<3>::lattice([0.0; 3], [1.0; 3], [2000; 3]).err(),
        Particles::<3>::lattice([0.0; 3], [1.0; 3], [1 << 22; 3]).err(),
        Particles::<2>::random([0.0; 2], [1.0; 2], PARTICLES_HIGH + 1, 1).err(),
        Particles::<2>::quasi_random([0.0; 2], [1.0; 2], usize::MAX, 1).err(),
    ];
    let too_many = |error: &Option<parops::Error>| matches!(error.as_ref().map(parops::Error::kind), Some(ErrorKind::Particle(ParticleError::TooMany { limit: PARTICLES_HIGH, count })) if *count > PARTICLES_HIGH);
    let first = refused[0].as_ref().map_or(String::from("accepted"), ToString::to_string);
    case.detects(refused.iter().all(too_many), format!("refused before anything is allocated: {first}"));
    let mesh = Mesh::cells(&Domain::periodic([0.0; 3], [TAU; 3])?, [1 << 22; 3]).err();
    let typed = matches!(
        mesh.as_ref().map(parops::Error::kind),
        Some(ErrorKind::Mesh(MeshError::Count { .. } | MeshError::TooLarge { .. }))
    );
    case.prevents(typed, format!("2^66 cells: {}", mesh.map_or(String::from("accepted"), |error| error.to_string())));
    Ok(())
}
