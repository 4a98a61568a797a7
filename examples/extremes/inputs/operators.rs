//! Bad operators and bad stencils.

use std::error::Error;
use std::f64::consts::TAU;

use parops::{
    Apply, BruteForce, CellList, Cutoff, DcPse, Epsilon, ErrorKind, Expression, Form, KernelError, Laplacian,
    MultiIndex, MultiIndexError, Nearest, Neighbor, NeighborError, NeighborList, Neighbors, OperatorError,
    ParticleError, Particles, Pse, Upwind, Volumes,
};

use super::world::{H, SIDE, World, refused};
use crate::case::Case;
use crate::failures::{naive_dcpse, sets};
use crate::is;

type Done = Result<(), Box<dyn Error>>;

fn epsilon(case: &mut Case, bad: f64, naive: f64) -> Done {
    let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Particle(ParticleError::Epsilon { epsilon }) if epsilon.to_bits() == bad.to_bits());
    case.naive(
        !(naive > 0.0 && naive.is_finite()),
        format!("the kernel (2 pi eps^2)^(-1/2) exp(-z^2/2) at z = 0 is {naive}"),
    );
    refused(case, &mut (), None, due, |_, ()| Epsilon::global(bad))?;
    refused(case, &mut vec![1.0, bad], Some(1), due, |_, each| Epsilon::each(each.clone()))?;
    Ok(())
}

fn gaussian(epsilon: f64) -> f64 {
    1.0 / (TAU.sqrt() * epsilon)
}

/// 40. An epsilon of zero.
pub fn zero_epsilon(case: &mut Case, _: bool) -> Done {
    case.setup("epsilon 0");
    epsilon(case, 0.0, gaussian(0.0))
}

/// 41. An epsilon below zero, or no number.
pub fn bad_epsilon(case: &mut Case, _: bool) -> Done {
    case.setup("epsilon -0.1 and NaN");
    epsilon(case, f64::NAN, gaussian(f64::NAN))?;
    epsilon(case, -0.1, gaussian(-0.1))
}

/// 42. A degree whose factorial overflows.
pub fn high_degree(case: &mut Case, _: bool) -> Done {
    case.setup("D^(255,255), order 8");
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    let term = |k: u32| factorial(255) / (factorial(k) * factorial(255 - k)) * (f64::from(k) * H).sin();
    let quotient = (0..=255).map(|k| if k % 2 == 0 { -term(k) } else { term(k) }).sum::<f64>() / H.powi(255);
    case.naive(
        !quotient.is_finite(),
        format!(
            "the 255th difference quotient of the sine, its binomials by factorials (255! = {}): {quotient}",
            factorial(255)
        ),
    );
    let mut own = Expression::new([(MultiIndex::new([255_u8, 255]), 1.0)])?;
    let due = |kind: &ErrorKind| {
        matches!(
            kind,
            ErrorKind::Kernel(KernelError::Overflow { .. }) | ErrorKind::MultiIndex(MultiIndexError::Degree { .. })
        )
    };
    refused(case, &mut own, None, due, |world, own| {
        Pse::new(own.clone(), 8, Epsilon::global(2.0 * H)?, world.particles.volumes()?)
    })?;
    let mut high = sets::derivative([171, 0])?;
    let degree = is!(MultiIndex, MultiIndexError::Degree { degree: 171, limit } if *limit < 171);
    refused(case, &mut high, None, degree, |world, high| DcPse::at_order(high.clone(), 8)?.assemble(&world.cells))?;
    Ok(())
}

/// 43. Order 0.
pub fn zero_order(case: &mut Case, _: bool) -> Done {
    case.setup("the Laplacian to order 0");
    let around = naive_dcpse::cut(World::new()?.particles.points(), 0, 20, naive_dcpse::wrapped);
    let separations: Vec<[f64; 2]> = around.iter().map(|(_, s)| *s).collect();
    let row = naive_dcpse::row(&separations, [2, 0], 0, H);
    let found = row.apply(&separations, |x| 0.5 * x[0] * x[0]);
    case.naive(
        found == 0.0 && row.weights.len() == 20,
        format!(
            "{} conditions of degree below 2 ask for nothing of degree 2: d2/dx2 of x^2/2 on 20 neighbors is {found} where 1 is right",
            naive_dcpse::conditions([2, 0], 0).len()
        ),
    );
    let order = is!(MultiIndex, MultiIndexError::Order { order: 0, low: 1, high: 8 });
    refused(case, &mut (), None, order, |_, ()| DcPse::at_order(Laplacian::<2>, 0))?;
    let kernel = is!(Kernel, KernelError::Order { order: 0 });
    refused(case, &mut (), None, kernel, |world, ()| {
        Pse::new(Laplacian::<2>, 0, Epsilon::global(2.0 * H)?, world.particles.volumes()?)
    })?;
    Ok(())
}

/// D^2 along the first axis on the k nearest of particle 0 of a set, by normal equations: the miss of x^2/2, and the least
/// pivot over the largest.
fn naive_error(set: &Particles<2>, k: usize) -> (f64, f64) {
    let around = naive_dcpse::cut(set.points(), 0, k, naive_dcpse::wrapped);
    let separations: Vec<[f64; 2]> = around.iter().map(|(_, s)| *s).collect();
    let row = naive_dcpse::row(&separations, [2, 0], 2, H);
    // x^2 / 2 has the second derivative 1.
    ((row.apply(&separations, |x| 0.5 * x[0] * x[0]) - 1.0).abs(), row.pivot)
}

/// 44. Fewer neighbors than conditions.
pub fn too_few(case: &mut Case, _: bool) -> Done {
    case.setup("the 5 nearest, 9 moment conditions, d2/dx2 of x^2/2 on a jittered set");
    let (miss, pivot) = naive_error(&World::new()?.particles, 5);
    case.naive(
        !(miss < 1e-3),
        format!("normal equations with a pivot of {pivot:.0e} of the largest give weights that miss it by {miss:.1e}"),
    );
    let due = is!(Operator, OperatorError::TooFew { neighbors, conditions: 9, .. } if *neighbors < 9);
    let mut own = DcPse::<Laplacian<2>, 2>::new().neighbors_per_condition(1.0)?;
    // A cutoff grows thrice by 1.15 before its row is refused: the first particle with fewer than 9 even then.
    let world = World::new()?;
    let nearest = Nearest::build(&world.particles, &world.torus, 5)?;
    let everyone = BruteForce::build(&world.particles, &world.torus, Cutoff(nearest.reach()))?;
    let grown = |p: usize| nearest.reach().min(nearest.cutoff(p) * 1.15_f64.powi(3));
    let first = (0..world.particles.len()).find(|&p| everyone.count(p, grown(p)) < 9);
    refused(case, &mut own, first, due, |_, own| own.assemble(&nearest))?;
    Ok(())
}

/// 45. As many neighbors as conditions, on a lattice.
pub fn lattice(case: &mut Case, _: bool) -> Done {
    case.setup("a lattice, stencils of as many neighbors as conditions, cut from a sorted list, d3/dx3");
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [SIDE; 2])?;
    let method = DcPse::at_order(sets::derivative([3, 0])?, 1)?;
    let method = method.sign(parops::Sign::Minus).neighbors_per_condition(1.0)?;
    let n = method.fewest_neighbors::<2>()?;
    let around = naive_dcpse::cut(lattice.points(), 0, n, naive_dcpse::wrapped);
    let separations: Vec<[f64; 2]> = around.iter().map(|(_, s)| *s).collect();
    let third = naive_dcpse::row(&separations, [3, 0], 1, H);
    let miss = (third.apply(&separations, |x| x[0].powi(3) / 6.0) - 1.0).abs();
    case.naive(
        !(miss < 1e-3),
        format!("normal equations on {n} neighbors with a pivot of {:.0e} of the largest miss d3/dx3 of x^3/6 by {miss:.1e}", third.pivot),
    );
    let row: Vec<Neighbor<2>> = around.iter().map(|(q, s)| Neighbor { q: *q, separation: *s, sign: 1 }).collect();
    let mut own = NeighborList::from_rows(lattice.len(), &[Some(0)], &[0, n], &row, Cutoff(4.0 * H), 0)?;
    let due = is!(Operator, OperatorError::Uncertified { .. } | OperatorError::Singular { .. });
    refused(case, &mut own, Some(0), due, |_, own| method.assemble(own))?;
    Ok(())
}

/// A list of one row of given separations.
fn row_of(separations: &[[f64; 2]]) -> parops::Result<NeighborList<2>> {
    let row: Vec<Neighbor<2>> =
        separations.iter().enumerate().map(|(i, s)| Neighbor { q: i + 1, separation: *s, sign: 1 }).collect();
    NeighborList::from_rows(row.len() + 1, &[Some(0)], &[0, row.len()], &row, Cutoff(8.0 * H), 0)
}

/// 46. Places that do not determine the derivative.
pub fn on_a_circle(case: &mut Case, _: bool) -> Done {
    case.setup("24 neighbors on one circle about the particle: x^3 + x y^2 is r^2 x there, d3/dx3");
    let separations: Vec<[f64; 2]> = (0..24)
        .map(|i| f64::from(i) / 24.0 * TAU + 0.1)
        .map(|angle| [2.0 * H * angle.cos(), 2.0 * H * angle.sin()])
        .collect();
    let row = naive_dcpse::row(&separations, [3, 0], 1, H);
    let miss = (row.apply(&separations, |x| x[0].powi(3) / 6.0) - 1.0).abs();
    case.naive(
        !(miss < 0.1),
        format!("normal equations with a pivot of {:.0e} of the largest miss d3/dx3 of x^3/6 by {miss:.1e}", row.pivot),
    );
    let due = is!(Operator, OperatorError::Uncertified { .. } | OperatorError::Singular { .. });
    let method = DcPse::at_order(sets::derivative([3, 0])?, 1)?.sign(parops::Sign::Minus);
    refused(case, &mut row_of(&separations)?, Some(0), due, |_, own| method.assemble(own))?;
    Ok(())
}

/// 47. A condition above what rounding bears.
pub fn ill_conditioned(case: &mut Case, _: bool) -> Done {
    case.setup("24 neighbors whose extent along y is 1e-9 of that along x, d2/dy2");
    let mut random = parops::Random::new(8);
    let mut place = || 2.0 * H * (2.0 * random.uniform() - 1.0);
    let separations: Vec<[f64; 2]> = (0..24).map(|_| [place(), 1e-9 * place()]).collect();
    let row = naive_dcpse::row(&separations, [0, 2], 2, H);
    let gain = row.gain(H, 2);
    case.naive(
        !(gain < 1e10),
        format!("normal equations give weights that multiply noise by sum |w| h^2 = {gain:.1e}"),
    );
    let due = is!(Operator, OperatorError::Uncertified { .. } | OperatorError::Singular { .. });
    let method = DcPse::at_order(sets::derivative([0, 2])?, 2)?;
    refused(case, &mut row_of(&separations)?, Some(0), due, |_, own| method.assemble(own))?;
    Ok(())
}

/// 48. A window that vanishes within the gaps.
pub fn narrow_window(case: &mut Case, _: bool) -> Done {
    case.setup("epsilon = h/100");
    let weight = (-0.5 * 100.0_f64.powi(2)).exp();
    case.naive(
        weight == 0.0,
        format!("the kernel at the nearest neighbor is {weight}: the derivative is zero everywhere"),
    );
    let mut own = Epsilon::global(0.01 * H)?;
    let window = is!(Operator, OperatorError::Window { ratio, high, .. } if ratio > high);
    refused(case, &mut own, Some(0), window, |world, own| {
        DcPse::<Laplacian<2>, 2>::new().epsilon(own.clone()).assemble(&world.cells)
    })?;
    let overlap = is!(Operator, OperatorError::Overlap { h_over_epsilon, limit } if h_over_epsilon > limit);
    refused(case, &mut own, Some(0), overlap, |world, own| {
        Pse::new(Laplacian::<2>, 2, own.clone(), world.particles.volumes()?)?.assemble(&world.cells)
    })?;
    Ok(())
}

/// 49. A window that is flat within the cutoff.
pub fn flat_window(case: &mut Case, _: bool) -> Done {
    case.setup("cutoff 2.5 h, epsilon = 25 h; PSE with a support of one epsilon");
    // Of the second moment of the kernel (4/pi) exp(-|z|^2) z_i^2 over the plane, 2, what is within |z| < 0.1.
    let kept = 1.0 - (1.0 + 0.01) * (-0.01_f64).exp();
    case.naive(kept < 1e-3, format!("a kernel cut at 0.1 epsilon keeps {kept:.0e} of its second moment"));
    let mut own = Epsilon::global(25.0 * H)?;
    let window = is!(Operator, OperatorError::Window { ratio, low, .. } if ratio < low);
    refused(case, &mut own, Some(0), window, |world, own| {
        DcPse::<Laplacian<2>, 2>::new().epsilon(own.clone()).assemble(&world.cells)
    })?;
    let moment = is!(Operator, OperatorError::Moment { defect, limit } if defect > limit);
    // The worst of all is named: that whose second moments, along either axis, miss 2 by most.
    let world = World::new()?;
    let within = BruteForce::build(&world.particles, &world.torus, Cutoff(2.0 * H))?;
    let missed = |p: usize| {
        let mut moments = [0.0_f64; 2];
        within.for_each(p, 2.0 * H, |neighbor| {
            let z = neighbor.separation.map(|s| s / (2.0 * H));
            let eta = 4.0 / std::f64::consts::PI * (-z[0] * z[0] - z[1] * z[1]).exp();
            moments.iter_mut().zip(z).for_each(|(moment, z)| *moment += 0.25 * eta * z * z);
        });
        moments.map(|moment| (moment - 2.0).abs()).into_iter().fold(0.0, f64::max)
    };
    let worst = (0..world.particles.len()).max_by(|&p, &q| missed(p).total_cmp(&missed(q)));
    refused(case, &mut (), worst, moment, |world, ()| {
        let pse = Pse::new(Laplacian::<2>, 2, Epsilon::global(2.0 * H)?, world.particles.volumes()?)?.support(1.0)?;
        pse.assemble(&CellList::build(&world.particles, &world.torus, pse.cutoff())?)
    })?;
    Ok(())
}

fn bad_row(case: &mut Case, row: &[Neighbor<2>], due: impl Fn(&ErrorKind) -> bool) -> Done {
    refused(case, &mut row.to_vec(), Some(0), due, |_, row| {
        NeighborList::from_rows(
            3,
            &[Some(0), Some(1), Some(2)],
            &[0, row.len(), row.len(), row.len()],
            row,
            Cutoff(1.0),
            7,
        )
    })?;
    Ok(())
}

const NEAR: Neighbor<2> = Neighbor { q: 1, separation: [0.5, 0.0], sign: 1 };

/// 50. The particle in its own stencil.
pub fn own_center(case: &mut Case, _: bool) -> Done {
    case.setup("a row of the caller's own that holds its own particle");
    let weight = 0.0 / 0.0_f64.powi(2);
    case.naive(weight.is_nan(), format!("(f_p - f_p) / r^2 = {weight}"));
    bad_row(
        case,
        &[Neighbor { q: 0, separation: [0.0; 2], sign: 1 }, NEAR],
        is!(Neighbor, NeighborError::OwnCenter { q: 0 }),
    )
}

/// 51. A neighbor that stands twice in a row.
pub fn repeated(case: &mut Case, _: bool) -> Done {
    case.setup("a row of the caller's own that holds a neighbor twice");
    let square: f64 = [0.5, -0.5, 0.5].iter().map(|s: &f64| s * s).sum();
    let twice = square / (2.0 * 0.25);
    case.naive(twice == 1.5, format!("the second difference of x^2 comes to {twice} of what it is"));
    bad_row(case, &[NEAR, NEAR], is!(Neighbor, NeighborError::Repeated { q: 1 }))
}

/// 52. An offset that is no number.
pub fn nan_offset(case: &mut Case, _: bool) -> Done {
    case.setup("a row of the caller's own with a separation that is NaN");
    let weight = (-0.5 * f64::NAN * f64::NAN).exp();
    case.naive(weight.is_nan(), format!("the kernel there is {weight}, and so is the whole row"));
    bad_row(
        case,
        &[Neighbor { separation: [f64::NAN, 0.0], ..NEAR }],
        is!(Neighbor, NeighborError::Separation { q: 1, axis: 0, separation } if separation.is_nan()),
    )
}

/// 53. Upwind where nothing flows.
pub fn still_flow(case: &mut Case, _: bool) -> Done {
    case.setup("upwind on a set at rest");
    let direction = 0.0 / 0.0_f64.hypot(0.0);
    case.naive(direction.is_nan(), format!("the direction v / |v| is {direction}"));
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [SIDE; 2])?;
    let upwind = Upwind::new(vec![[0.0; 2]; lattice.len()], lattice.spacing()?.epsilon(1.0)?, lattice.volumes()?)?;
    let torus = parops::Domain::periodic([0.0; 2], [1.0; 2])?;
    let rows = upwind.assemble(&CellList::build(&lattice, &torus, upwind.cutoff())?)?;
    let u: Vec<f64> = lattice.points().iter().map(|x| (9.0 * x[0]).exp()).collect();
    let mut out = vec![f64::NAN; u.len()];
    rows.apply(&u, &mut out)?;
    case.prevents(out.iter().all(|out| *out == 0.0), "legal: v . grad u is exactly zero at all particles");
    // The least of all velocities in place of none.
    let tiny = Upwind::new(vec![[5e-324, 0.0]; u.len()], lattice.spacing()?.epsilon(1.0)?, lattice.volumes()?)?;
    tiny.assemble(&CellList::build(&lattice, &torus, tiny.cutoff())?)?.apply(&u, &mut out)?;
    case.prevents(out.iter().all(|out| out.is_finite()), "and finite for the least velocity there is, 5e-324");
    Ok(())
}

/// 54. Nobody upstream.
pub fn empty_side(case: &mut Case, _: bool) -> Done {
    case.setup("upwind at the end of an open line that the flow comes in at");
    let line = Particles::lattice([0.0], [1.0], [20])?;
    let upstream = line.points().iter().filter(|x| x[0] < line.points()[0][0]).count();
    let naive: f64 = line.points()[..upstream].iter().map(|x| x[0]).sum();
    case.naive(
        upstream == 0 && naive == 0.0,
        format!("the sum over {upstream} sources is {naive}: nothing flows in, in silence"),
    );
    let mut own = Upwind::new(vec![[1.0]; 20], line.spacing()?.epsilon(1.0)?, line.volumes()?)?;
    let due = is!(Operator, OperatorError::EmptySide { axis: 0, neighbors, .. } if *neighbors > 0);
    refused(case, &mut own, Some(0), due, |_, own| {
        own.assemble(&CellList::build(&line, &parops::Domain::open(), own.cutoff())?)
    })?;
    Ok(())
}

/// 55. Unequal volumes, or lengths, for an operator that is to conserve.
pub fn unequal_volumes(case: &mut Case, _: bool) -> Done {
    case.setup("PSE by pairs on volumes that vary by 10 %, and an epsilon that varies");
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [20; 2])?;
    let torus = parops::Domain::periodic([0.0; 2], [1.0; 2])?;
    let h = 1.0 / 20.0;
    let volumes: Vec<f64> = (0..400).map(|p| h * h * (1.0 + 0.1 * f64::from(p % 2))).collect();
    let f: Vec<f64> = lattice.points().iter().map(|x| (TAU * x[0]).sin() + x[1]).collect();
    let method = Pse::new(Laplacian::<2>, 2, Epsilon::global(1.6 * h)?, &Volumes::each(volumes.clone())?)?
        .moment_tolerance(1.0)?;
    let cells = CellList::build(&lattice, &torus, method.cutoff())?;
    let mut out = vec![0.0; 400];
    method.assemble(&cells)?.apply(&f, &mut out)?;
    // Each particle weighted alike, as the symmetric sum of equal volumes would be.
    let naive: f64 = out.iter().map(|out| out * h * h).sum();
    case.naive(naive.abs() > 1e-6, format!("sum_p h^2 (L f)_p = {naive:.1e}: volumes taken for equal do not conserve"));
    method.symmetric(&cells)?.apply(&f, &mut out)?;
    let (sum, size) =
        out.iter().zip(&volumes).fold((0.0, 0.0), |(sum, size), (out, v)| (sum + v * out, size + (v * out).abs()));
    // 400 terms, each within a few roundings.
    case.prevents(
        sum.abs() <= 64.0 * f64::EPSILON * size,
        format!("each pair exchanges V_p V_q: the sum is {sum:.0e} of {size:.1e}"),
    );
    let mut each = Epsilon::each((0..400).map(|p| h * (1.6 + 0.1 * f64::from(p % 2))).collect())?;
    let due = is!(Operator, OperatorError::VariableEpsilon { low, high } if low < high);
    refused(case, &mut each, None, due, |_, each| {
        let method = Pse::new(Laplacian::<2>, 2, each.clone(), lattice.volumes()?)?;
        method.symmetric(&cells).map(drop)
    })?;
    refused(case, &mut each, None, due, |_, each| {
        Pse::new(Laplacian::<2>, 2, each.clone(), lattice.volumes()?)?.form(Form::Strengths)
    })?;
    Ok(())
}
