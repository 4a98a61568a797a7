//! Bad particle sets.

use std::error::Error;

use parops::{
    Allowance, Apply, BruteForce, CellList, Cic, Cutoff, DcPse, Domain, Epsilon, ErrorKind, Laplacian, MatrixFree,
    Mesh, Nearest, NeighborError, NeighborList, Neighbors, OperatorError, PARTICLES_HIGH, ParticleError, Particles,
    Pse, SetQuality, VerletList, Volumes, Vtu,
};

use super::world::{H, SIDE, World, refused};
use crate::case::Case;
use crate::is;

type Done = Result<(), Box<dyn Error>>;

fn laplacian(epsilon: f64, volume: f64) -> parops::Result<Pse<parops::Exchange<2>>> {
    Pse::new(Laplacian::<2>, 2, Epsilon::global(epsilon)?, &Volumes::equal(volume)?)
}

/// The Laplacian of a function at particle 0 by PSE, unchecked.
fn unchecked(points: &[[f64; 2]], h: f64, f: impl Fn(&[f64; 2]) -> f64) -> parops::Result<f64> {
    let method = laplacian(2.0 * h, h * h)?.allow(Allowance::Everywhere);
    let particles = Particles::new(points.to_vec())?;
    let cells = CellList::build(&particles, &Domain::open(), method.cutoff())?;
    let mut out = vec![0.0; points.len()];
    method.matrix_free(&cells)?.apply(&points.iter().map(f).collect::<Vec<_>>(), &mut out)?;
    Ok(out[0])
}

/// (f_q - f_p) / |x_q - x_p|^2 of the first two points, f = |x|^2.
fn quotient(points: &[[f64; 2]]) -> f64 {
    let square = |x: &[f64; 2]| x[0] * x[0] + x[1] * x[1];
    let (x, y) = (&points[0], &points[1]);
    (square(y) - square(x)) / square(&[y[0] - x[0], y[1] - x[1]])
}

/// A set that is legal as a set and refused by PSE, for its moments, and by DC-PSE.
fn degenerate(case: &mut Case, points: Vec<[f64; 2]>, at: [usize; 2]) -> Done {
    let mut own = Particles::new(points)?.with_volumes(Volumes::equal(H * H)?)?;
    let moment = is!(Operator, OperatorError::Moment { defect, limit } if defect > limit);
    refused(case, &mut own, Some(at[0]), moment, |_, own| {
        let method = laplacian(2.0 * H, H * H)?;
        method.assemble(&CellList::build(own, &Domain::open(), method.cutoff())?)
    })?;
    let unsolvable = is!(
        Operator,
        OperatorError::TooFew { .. } | OperatorError::Singular { .. } | OperatorError::Uncertified { .. }
    );
    refused(case, &mut own, Some(at[1]), unsolvable, |_, own| {
        DcPse::<Laplacian<2>, 2>::new().assemble(&CellList::build(own, &Domain::open(), Cutoff(3.0 * H))?)
    })?;
    Ok(())
}

/// 1. No particle.
pub fn empty(case: &mut Case, _: bool) -> Done {
    case.setup("a set of no particles, through lists, rows, meshes, solver and file");
    let none: [f64; 0] = [];
    let mean = none.iter().sum::<f64>() / none.len() as f64;
    case.naive(mean.is_nan(), format!("the mean over the particles is {mean}"));
    let set = Particles::<2>::new(Vec::new())?.with_equal_volumes(1.0)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let cells = CellList::build(&set, &torus, Cutoff(0.25))?;
    let targets = [
        cells.targets(),
        BruteForce::build(&set, &torus, Cutoff(0.25))?.targets(),
        VerletList::build(&set, &torus, Cutoff(0.25), 0.1)?.targets(),
        NeighborList::from_provider(&cells)?.targets(),
        Nearest::build(&set, &torus, 20)?.targets(),
    ];
    let pse = laplacian(0.05, 0.01)?.assemble(&cells)?;
    let dcpse = DcPse::<Laplacian<2>, 2>::new().assemble(&cells)?;
    pse.apply(&[] as &[f64], &mut [])?;
    dcpse.apply(&[] as &[f64], &mut [])?;
    let mesh = Mesh::cells(&torus, [4; 2])?;
    let mut values = vec![0.5; 16];
    mesh.deposit::<f64, 2>(&Cic, set.points(), &[], &mut values)?;
    let mut file = Vec::new();
    Vtu::new(&set).field("u", &[] as &[f64])?.write(&mut file)?;
    let quality = SetQuality::measure(&set, &torus, Cutoff(0.25))?;
    let still = targets == [0; 5] && values == [0.5; 16] && !file.is_empty();
    case.reports(
        still && (pse.report().rows, dcpse.report().rows, quality.most) == (0, 0, 0) && quality.loneliest.is_none(),
        format!(
            "all verbs are no-ops; reports of {} rows, most neighbors {}, no loneliest particle, fill {}",
            dcpse.report().rows,
            quality.most,
            quality.fill
        ),
    );
    refused(case, &mut set.clone(), None, is!(Particle, ParticleError::TooFew { count: 0, needed: 1 }), |_, set| {
        set.spacing()
    })?;
    Ok(())
}

/// 2. One particle.
pub fn one(case: &mut Case, _: bool) -> Done {
    case.setup("one particle, the Laplacian of |x|^2");
    let points = vec![[0.5, 0.5]];
    let naive = unchecked(&points, H, |x| x[0] * x[0] + x[1] * x[1])?;
    case.naive(naive == 0.0, format!("an empty sum: {naive} where 4 is right, without a word"));
    degenerate(case, points, [0, 0])
}

/// 3. Two at one place.
pub fn two(case: &mut Case, _: bool) -> Done {
    case.setup("two particles at one place");
    let points = vec![[0.5, 0.5]; 2];
    let naive = quotient(&points);
    case.naive(naive.is_nan(), format!("(f_q - f_p) / r^2 = {naive}"));
    degenerate(case, points, [0, 0])
}

/// 4. All at one place.
pub fn coincident(case: &mut Case, _: bool) -> Done {
    case.setup("50 particles at one place");
    let points = vec![[0.25, 0.5]; 50];
    let naive = (quotient(&points), unchecked(&points, H, |x| x[0])?);
    case.naive(
        naive.0.is_nan() && naive.1 == 0.0,
        format!("(f_q - f_p) / r^2 = {}, a kernel sum {}", naive.0, naive.1),
    );
    let none = is!(Particle, ParticleError::Spacing { spacing: 0.0 });
    refused(case, &mut Particles::new(points.clone())?, None, none, |_, own| own.spacing())?;
    degenerate(case, points, [0, 0])
}

/// 5. A pair whose distance has no square.
pub fn close_pair(case: &mut Case, _: bool) -> Done {
    case.setup("a pair 1e-300 apart, and a third particle");
    let points = vec![[0.0, 0.0], [1e-300, 0.0], [0.0, 0.1]];
    let naive = quotient(&points);
    case.naive(naive.is_nan(), format!("r^2 underflows: (f_q - f_p) / r^2 = {naive}"));
    degenerate(case, points, [0, 0])
}

fn bad_coordinate(case: &mut Case, bad: f64) -> Done {
    const AT: usize = 17;
    case.setup(format!("coordinate {bad} of particle {AT}, in a new set and in one that is moved"));
    let cell = (bad / H) as i64;
    let near = (0..SIDE).filter(|i| (*i as f64 * H - bad).abs() <= 1.0).count();
    case.naive(near == 0, format!("its cell is {cell}, and it has {near} neighbors: it is lost without an error"));
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Particle(ParticleError::Coordinate { axis: 1, coordinate }) if coordinate.to_bits() == bad.to_bits());
    let mut points = World::new()?.particles.points().to_vec();
    points[AT][1] = bad;
    refused(case, &mut points, Some(AT), due, |world, points| world.particles.set_points(points))?;
    refused(case, &mut points, Some(AT), due, |_, points| Particles::new(points.clone()))?;
    Ok(())
}

/// 6. A coordinate that is no number.
pub fn nan_coordinate(case: &mut Case, _: bool) -> Done {
    bad_coordinate(case, f64::NAN)
}

/// 7. An infinite coordinate.
pub fn infinite_coordinate(case: &mut Case, _: bool) -> Done {
    bad_coordinate(case, f64::INFINITY)
}

/// 8. A coordinate at minus infinity.
pub fn negative_infinity(case: &mut Case, _: bool) -> Done {
    bad_coordinate(case, f64::NEG_INFINITY)
}

fn bad_strength(case: &mut Case, bad: f64) -> Done {
    const AT: usize = 33;
    case.setup(format!("strength {bad} of particle {AT}, deposited on a mesh and stepped in time"));
    let mut omega = vec![1.0; SIDE * SIDE];
    omega[AT] = bad;
    let sum: f64 = omega.iter().sum();
    case.naive(!sum.is_finite(), format!("the mass becomes {sum}"));
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Apply(parops::ApplyError::FieldOf { value, .. } | parops::ApplyError::Field { value }) if value.to_bits() == bad.to_bits());
    let mut own = (Mesh::cells(&Domain::periodic([0.0; 2], [1.0; 2])?, [8; 2])?, vec![0.25; 64], omega);
    refused(case, &mut own, Some(AT), due, |world, (mesh, values, omega)| {
        mesh.deposit(&Cic, world.particles.points(), omega, values)
    })?;
    let named = |kind: &ErrorKind| matches!(kind, ErrorKind::Apply(_) | ErrorKind::Time(_));
    refused(case, &mut own.2, Some(AT), named, |world, omega| world.run.step(omega, 1e-3).map(drop))?;
    Ok(())
}

/// 9. A strength that is no number.
pub fn nan_strength(case: &mut Case, _: bool) -> Done {
    bad_strength(case, f64::NAN)
}

/// 10. An infinite strength.
pub fn infinite_strength(case: &mut Case, _: bool) -> Done {
    bad_strength(case, f64::INFINITY)
}

fn bad_volume(case: &mut Case, bad: f64, naive: f64, broken: &str) -> Done {
    const AT: usize = 5;
    case.setup(format!("volume {bad} of particle {AT}"));
    case.naive(!(naive > 0.0 && naive.is_finite()), format!("{broken} = {naive}"));
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Particle(ParticleError::Volume { volume }) if volume.to_bits() == bad.to_bits());
    let mut volumes = vec![H * H; SIDE * SIDE];
    volumes[AT] = bad;
    refused(case, &mut volumes, Some(AT), due, |world, volumes| {
        world.particles.set_volumes(Volumes::each(volumes.clone())?)
    })?;
    refused(case, &mut (), None, due, |world, ()| world.particles.set_volumes(Volumes::equal(bad)?))?;
    Ok(())
}

/// 11. No volume.
pub fn zero_volume(case: &mut Case, _: bool) -> Done {
    bad_volume(case, 0.0, 1.0 / 0.0_f64, "the field value omega / V")
}

/// 12. A negative volume.
pub fn negative_volume(case: &mut Case, _: bool) -> Done {
    bad_volume(case, -H * H, (-H * H).sqrt(), "the spacing V^(1/2)")
}

/// 13. A volume that is no number.
pub fn nan_volume(case: &mut Case, _: bool) -> Done {
    bad_volume(case, f64::NAN, (0..SIDE).map(|i| if i == 5 { f64::NAN } else { H * H }).sum(), "the sum of all volumes")
}

/// 14. Arrays of unequal lengths.
pub fn unequal(case: &mut Case, _: bool) -> Done {
    const N: usize = SIDE * SIDE;
    case.setup(format!("{N} particles with {} points to move to, volumes, strengths or values", N - 1));
    let short = vec![1.0; N - 1];
    let paired = World::new()?.particles.points().iter().zip(&short).count();
    case.naive(paired == N - 1, format!("pairs up {paired} of {N}, and the last particle is left out in silence"));
    let length = is!(Particle, ParticleError::Length { found, needed } if (*found, *needed) == (N - 1, N));
    let mut points = World::new()?.particles.points()[1..].to_vec();
    refused(case, &mut points, None, length, |world, points| world.particles.set_points(points))?;
    refused(case, &mut short.clone(), None, length, |world, short| {
        world.particles.set_volumes(Volumes::each(short.clone())?)
    })?;
    let mut own = (Mesh::cells(&Domain::periodic([0.0; 2], [1.0; 2])?, [8; 2])?, vec![0.25; 64]);
    refused(case, &mut own, None, length, |world, (mesh, values)| {
        mesh.deposit(&Cic, world.particles.points(), &short, values)
    })?;
    let shape = is!(Time, parops::TimeError::Shape { found, needed } if (*found, *needed) == (N - 1, N));
    refused(case, &mut short.clone(), None, shape, |world, short| world.run.step(short, 1e-3).map(drop))?;
    Ok(())
}

/// 15. More particles than an index can name.
pub fn too_many(case: &mut Case, _: bool) -> Done {
    const TEST: &str = "particle_count_beyond_the_index_type_is_refused";
    case.setup(format!("{} particles; indices have 32 bits", PARTICLES_HIGH + 1));
    let (last, first) = ((PARTICLES_HIGH + 2) as u32, 0_u32);
    case.naive(last == first, format!("a cast makes index {} the index {last}", PARTICLES_HIGH + 2));
    let due = is!(Particle, ParticleError::TooMany { count, limit: PARTICLES_HIGH } if *count > PARTICLES_HIGH);
    refused(case, &mut (), None, due, |_, ()| Particles::<2>::random([0.0; 2], [1.0; 2], PARTICLES_HIGH + 1, 1))?;
    refused(case, &mut (), None, due, |_, ()| {
        Particles::<3>::lattice([0.0; 3], [1.0; 3], [1 << 11, 1 << 11, 1 << 11])
    })?;
    let source = include_str!("../../../src/particles/mod.rs");
    case.prevents(
        source.contains(&format!("fn {TEST}()")) && source.contains("check_count(256, 255)"),
        format!(
            "before anything is allocated; with a limit of 255 and a set that fits memory: particles::tests::{TEST}"
        ),
    );
    Ok(())
}

/// 16. Coordinates whose squares overflow.
pub fn far(case: &mut Case, _: bool) -> Done {
    case.setup("particle 3 at 1e200");
    let square = 1e200_f64 * 1e200;
    case.naive(square.is_infinite(), format!("r^2 = {square}"));
    let mut points = World::new()?.particles.points().to_vec();
    points[3][0] = 1e200;
    let due = is!(Particle, ParticleError::Range { axis: 0, value: 1e200, .. });
    refused(case, &mut points, Some(3), due, |world, points| world.particles.set_points(points))?;
    refused(case, &mut points, Some(3), due, |_, points| Particles::new(points.clone()))?;
    Ok(())
}

/// 17. A spacing below the normal numbers.
pub fn subnormal(case: &mut Case, _: bool) -> Done {
    case.setup("a lattice of spacing 1e-310");
    let square = 1e-310_f64 * 1e-310;
    case.naive(square == 0.0, format!("r^2 = {square} between particles that differ"));
    let points = (0..25).map(|i| [f64::from(i % 5) * 1e-310, f64::from(i / 5) * 1e-310]).collect();
    let mut own = Particles::new(points)?;
    let due = is!(Neighbor, NeighborError::CutoffRange { cutoff, low, .. } if cutoff < low);
    refused(case, &mut own, None, due, |_, own| CellList::build(own, &Domain::open(), Cutoff(2e-310)))?;
    refused(case, &mut own, None, due, |_, own| BruteForce::build(own, &Domain::open(), Cutoff(2e-310)))?;
    Ok(())
}

/// 18. A line in the plane.
pub fn collinear(case: &mut Case, _: bool) -> Done {
    case.setup("100 particles on a line of the plane, the Laplacian of y^2 in the middle");
    let mut points: Vec<[f64; 2]> = (0..100).map(|i| [f64::from(i) * H, 0.3]).collect();
    points.swap(0, 50);
    let naive = unchecked(&points, H, |x| x[1] * x[1])?;
    case.naive(naive == 0.0, format!("{naive} where 2 is right"));
    degenerate(case, points, [0, 0])
}

/// 19. A plane in space.
pub fn coplanar(case: &mut Case, _: bool) -> Done {
    const SPACING: f64 = 0.1;
    case.setup("10 x 10 particles on a plane of space, the Laplacian of z^2");
    let mut points: Vec<[f64; 3]> =
        (0..100).map(|i| [f64::from(i % 10) * SPACING, f64::from(i / 10) * SPACING, 0.5]).collect();
    points.swap(0, 55);
    let mut own = Particles::new(points)?.with_volumes(Volumes::equal(SPACING.powi(3))?)?;
    let method = Pse::new(Laplacian::<3>, 2, Epsilon::global(2.0 * SPACING)?, own.volumes()?)?;
    let cells = CellList::build(&own, &Domain::open(), method.cutoff())?;
    let f: Vec<f64> = own.points().iter().map(|x| x[2] * x[2]).collect();
    let mut out = vec![0.0; f.len()];
    method.clone().allow(Allowance::Everywhere).assemble(&cells)?.apply(&f, &mut out)?;
    case.naive(out[0] == 0.0, format!("{} where 2 is right", out[0]));
    let moment = is!(Operator, OperatorError::Moment { defect, .. } if *defect > 0.5);
    refused(case, &mut own, Some(0), moment, |_, _| method.assemble(&cells))?;
    let unsolvable = is!(Operator, OperatorError::Singular { .. } | OperatorError::Uncertified { .. });
    refused(case, &mut own, Some(0), unsolvable, |_, own| {
        DcPse::<Laplacian<3>, 2>::new().assemble(&CellList::build(own, &Domain::open(), Cutoff(0.5))?)
    })?;
    Ok(())
}

/// 20. Thousands that share one coordinate.
pub fn shared_coordinate(case: &mut Case, _: bool) -> Done {
    const N: usize = 4096;
    case.setup(format!("{N} particles of the unit torus, all with x = 0.5"));
    let points: Vec<[f64; 2]> = (0..N).map(|i| [0.5, (i as f64 + 0.5) / N as f64]).collect();
    let guessed = (1.0 / N as f64).sqrt();
    let factor = guessed * N as f64;
    case.naive(
        factor > 60.0,
        format!("(volume / N)^(1/2) = {guessed:.4} is taken for the spacing, {factor:.0} times too long"),
    );
    let set = Particles::new(points)?.with_equal_volumes(1.0)?;
    let torus = Domain::periodic([0.0; 2], [1.0; 2])?;
    let cutoff = Cutoff(4.0 / N as f64);
    let (cells, brute) = (CellList::build(&set, &torus, cutoff)?, BruteForce::build(&set, &torus, cutoff)?);
    let counted = (0..N).step_by(64).all(|p| cells.count(p, cutoff.0) == brute.count(p, cutoff.0));
    let quality = SetQuality::measure(&set, &torus, cutoff)?;
    case.reports(
        counted && quality.fill.is_infinite() && quality.fewest >= 6,
        format!(
            "legal: {} to {} neighbors by every provider; the quality of the set has a hole of {} within a cutoff of {:.4}",
            quality.fewest, quality.most, quality.fill, cutoff.0
        ),
    );
    Ok(())
}

/// 21. A million at one place.
pub fn many_coincident(case: &mut Case, _: bool) -> Done {
    const N: usize = 1_000_000;
    case.setup(format!("{N} particles at one place"));
    let pairs = (N as f64 - 1.0) * N as f64 * 12.0;
    case.naive(pairs > 1e13, format!("a stored list of all pairs would take {pairs:.0e} bytes"));
    let all = Particles::new(vec![[0.5, 0.5]; N])?;
    refused(case, &mut all.len(), None, is!(Particle, ParticleError::Spacing { spacing: 0.0 }), |_, _| all.spacing())?;
    let cells = CellList::build(&all, &Domain::open(), Cutoff(2.0 * H))?;
    let found = cells.count(7, H);
    case.prevents(found == N - 1, format!("the cell list answers: {found} neighbors"));
    // A bad row of so many neighbors is refused at once: all of them would be 1e12 pairs.
    let mut own = all.with_volumes(Volumes::equal(H * H)?)?;
    let method = laplacian(2.0 * H, H * H)?;
    let moment = is!(Operator, OperatorError::Moment { defect, .. } if *defect > 0.5);
    let cells = CellList::build(&own, &Domain::open(), method.cutoff())?;
    refused(case, &mut own, Some(0), moment, |_, _| MatrixFree::new(&method, &cells).map(drop))?;
    refused(case, &mut own, Some(0), moment, |_, _| method.assemble(&cells))?;
    Ok(())
}

/// 22. One particle far from all others.
pub fn outlier(case: &mut Case, _: bool) -> Done {
    case.setup("the jittered set, and one particle 1e12 h away");
    let far = 1e12 * H;
    let table = (far / (2.5 * H)).powi(2) * 4.0;
    case.naive(table > 1e20, format!("a dense table of cells takes {table:.0e} bytes"));
    let mut points = World::new()?.particles.points().to_vec();
    points.push([far; 2]);
    let (set, lonely) = (Particles::new(points)?, SIDE * SIDE);
    let quality = SetQuality::measure(&set, &Domain::open(), Cutoff(2.5 * H))?;
    case.reports(
        (quality.fewest, quality.loneliest) == (0, Some(lonely)),
        format!(
            "legal; the quality of the set names particle {lonely} with {} neighbors, the median has {}",
            quality.fewest, quality.median
        ),
    );
    let unsolvable = is!(Operator, OperatorError::TooFew { neighbors: 0, .. });
    refused(case, &mut set.clone(), Some(lonely), unsolvable, |_, set| {
        DcPse::<Laplacian<2>, 2>::new().assemble(&CellList::build(set, &Domain::open(), Cutoff(6.0 * H))?)
    })?;
    Ok(())
}

/// 23. Volumes that do not add up to the box.
pub fn volume_defect(case: &mut Case, _: bool) -> Done {
    case.setup("volumes of 1.1 h^2 each on the unit torus");
    let set = World::new()?.particles.with_volumes(Volumes::equal(1.1 * H * H)?)?;
    let mut whole = 0.0;
    for p in 0..set.len() {
        whole += set.volumes()?.get(p)?;
    }
    case.naive((whole - 1.1).abs() < 1e-12, format!("the integral of 1 over the unit torus is {whole:.3}"));
    let quality = SetQuality::measure(&set, &Domain::periodic([0.0; 2], [1.0; 2])?, Cutoff(2.5 * H))?;
    let defect = quality.volume_defect.unwrap_or(f64::NAN);
    case.reports(
        (defect - 0.1).abs() < 1e-12,
        format!("legal; the quality of the set has a volume defect of {defect:.3}"),
    );
    Ok(())
}
