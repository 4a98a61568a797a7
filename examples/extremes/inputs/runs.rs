//! Bad fields, steps, functions and writers.

use std::error::Error;
use std::f64::consts::TAU;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use parops::{
    AdvectionDiffusion, Apply, ApplyError, COURANT, Central, DcPse, ErrorKind, Eulerian, Face, Gradient, IoError,
    Lambda, Laplacian, Limit, Mesh, MeshError, Nearest, Particles, Rk4, Rows, SolverError, StepPolicy, TimeError, Vtu,
};

use super::world::{SIDE, World, refused};
use crate::case::Case;
use crate::failures::ring;
use crate::is;

type Done = Result<(), Box<dyn Error>>;

const N: usize = SIDE * SIDE;

/// 56. An output of the wrong length.
pub fn output_length(case: &mut Case, _: bool) -> Done {
    case.setup("an output of one place less, and of one more");
    let written = vec![1.0; N].iter().zip(&vec![0.0; N - 1]).count();
    case.naive(written < N, format!("{written} of {N} values are written, and the last is lost in silence"));
    for found in [N - 1, N + 1] {
        let due = is!(Apply, ApplyError::Output { found: f, needed: N } if *f == found);
        refused(case, &mut vec![42.0; found], None, due, |world, out| world.rows.apply(&world.u, out))?;
    }
    Ok(())
}

/// sum_q w_pq (f_q - f_p) of a row.
fn sum_of(rows: &Rows, p: usize, f: &[f64]) -> f64 {
    let change = |(q, w): (&u32, &[f64; 1])| w[0] * (f[*q as usize] - f[p]);
    rows.row(p).map_or(0.0, |row| row.sources.iter().zip(row.weights).map(change).sum())
}

/// 57. Rows of another generation of the particles.
pub fn stale_rows(case: &mut Case, _: bool) -> Done {
    case.setup("the particles of the world take the places of another jittered set, its rows stay");
    let mut now = World::new()?;
    let other = Particles::jittered([0.0; 2], [1.0; 2], [SIDE; 2], 0.2, 77)?;
    let f: Vec<f64> = other.points().iter().map(|x| (TAU * x[0]).sin()).collect();
    let lap: Vec<f64> = (0..N).map(|p| sum_of(&now.rows, p, &f)).collect();
    let miss = lap.iter().zip(&f).map(|(lap, f)| (lap + TAU * TAU * f).abs()).fold(0.0, f64::max) / (TAU * TAU);
    case.naive(
        miss > 0.5,
        format!("sum_q w_pq (f_q - f_p) with the old weights on the new places: the Laplacian is wrong by {miss:.1} of its largest value"),
    );
    now.particles.set_points(other.points())?;
    let mut out = vec![0.0; N];
    now.rows.apply(&f, &mut out)?;
    let largest = lap.iter().fold(0.0_f64, |most, lap| most.max(lap.abs()));
    // 24 terms a row at most, whose sizes add up to some times the largest sum.
    let same = out.iter().zip(&lap).all(|(out, lap)| (out - lap).abs() < 1e-12 * largest);
    case.reports(
        same,
        "rows hold weights and no places: apply gives the same, without an error; whether they are of now is for the caller to ask of validate:",
    );
    let due = is!(Apply, ApplyError::Stale { rows, set } if rows != set);
    refused(case, &mut now, None, due, |_, now| now.rows.validate(now.particles.generation()))?;
    Ok(())
}

/// 58. A field that is no number at one particle.
pub fn nan_field(case: &mut Case, _: bool) -> Done {
    const AT: usize = 33;
    case.setup(format!("u is NaN at particle {AT}"));
    let world = World::new()?;
    let mut u = world.u.clone();
    u[AT] = f64::NAN;
    let mut spread = u.clone();
    for _ in 0..3 {
        let before = spread;
        spread = (0..N).map(|p| before[p] + 1e-4 * sum_of(&world.rows, p, &before)).collect();
    }
    let lost = spread.iter().filter(|u| u.is_nan()).count();
    case.naive(lost > 20, format!("after 3 steps {lost} of {N} values are NaN"));
    let field = is!(Apply, ApplyError::Field { value } if value.is_nan());
    refused(case, &mut (u.clone(), vec![42.0; N]), Some(AT), field, |world, (u, out)| world.rows.apply(u, out))?;
    let named = |kind: &ErrorKind| matches!(kind, ErrorKind::Apply(_) | ErrorKind::Time(_));
    refused(case, &mut u, Some(AT), named, |world, u| world.run.step(u, 1e-3).map(drop))?;
    Ok(())
}

/// 59. Steps that are none.
pub fn bad_step(case: &mut Case, _: bool) -> Done {
    case.setup("dt = 0, -0.001, NaN and infinity");
    let (mut t, mut steps) = (0.0, 0);
    while t < 1.0 && steps < 1_000_000 {
        t += 0.0;
        steps += 1;
    }
    case.naive(t == 0.0, format!("after {steps} steps of 0 the time is {t}: the loop does not end"));
    for dt in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        let due = |kind: &ErrorKind| matches!(kind, ErrorKind::Time(TimeError::Step { dt: found }) if found.to_bits() == dt.to_bits());
        refused(case, &mut (), None, due, |world, ()| world.run.step(&mut world.u, dt).map(drop))?;
    }
    Ok(())
}

/// 60. A step that does not change the time.
pub fn no_progress(case: &mut Case, _: bool) -> Done {
    case.setup("dt = 1e-12 at t = 1e6");
    const START: f64 = 1e6;
    const END: f64 = START + 1e-9;
    let (mut t, mut u, mut steps) = (START, 1.0_f64, 0);
    while t < END && steps < 100_000 {
        (t, u) = (t + 1e-12, u - 1e-12 * 1e9 * u);
        steps += 1;
    }
    case.naive(
        t == START && u < 1e-40,
        format!("u' = -1e9 u for 1e-9: after {steps} steps where 1000 were meant the time is still {t:e}, and u is {u:.0e} in place of 0.37"),
    );
    let world = World::new()?;
    let mut late = world.u.clone();
    let due = is!(Time, TimeError::NoProgress { t: 1e6, dt: 1e-12 });
    refused(case, &mut late, None, due, |world, late| {
        let near = Nearest::build(&world.particles, &world.torus, 20)?;
        let scene = AdvectionDiffusion::<2>::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new());
        Eulerian::new(scene, &world.particles, &near, Rk4::new())?.at(1e6).step(late, 1e-12).map(drop)
    })?;
    Ok(())
}

/// 61. Steps above the limits of diffusion, of advection and of the distortion of a moving set.
pub fn above_limits(case: &mut Case, _: bool) -> Done {
    case.setup("steps 1.5 times the limits of diffusion (CFL and LCFL likewise), policy refuse");
    let world = World::new()?;
    let limit = World::new()?.run.longest_step(&world.u)?;
    let mut rough = World::new()?.run.step_policy(StepPolicy::Allow);
    let mut u: Vec<f64> = (0..N).map(|p| if p == 70 { 1.0 } else { 0.0 }).collect();
    for _ in 0..60 {
        rough.step(&mut u, 3.0 * limit)?;
    }
    let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    case.naive(largest > 1e3, format!("60 steps of 3 limits take a peak of 1 to {largest:.0e}"));
    let due = |term: Limit| move |kind: &ErrorKind| matches!(kind, ErrorKind::Solver(SolverError::Limit { dt, limit, binding }) if dt > limit && *binding == term);
    refused(case, &mut (), None, due(Limit::Diffusion), |world, ()| {
        world.run.step(&mut world.u, 1.5 * limit).map(drop)
    })?;
    // A lattice, on which central differences do not grow.
    let lattice = Particles::lattice([0.0; 2], [1.0; 2], [SIDE; 2])?;
    let near = Nearest::build(&lattice, &world.torus, 20)?;
    let flow = AdvectionDiffusion::<2>::new().advection([1.0, 0.5], Central(DcPse::<Gradient<2>, 2>::new()));
    let mut run = Eulerian::new(flow, &lattice, &near, Rk4::new())?;
    let mut wave = lattice.points().iter().map(|x| (TAU * x[0]).sin()).collect::<Vec<f64>>();
    let longest = run.longest_step(&wave)?;
    refused(case, &mut wave, None, due(Limit::Advection), |_, wave| run.step(wave, 1.5 * longest).map(drop))?;
    let mut moving = ring::run(64, 1.0, 0.5)?.remeshing(ring::each_step(64)?)?;
    // The wave of the ring is 0.5 high.
    let (longest, start) = (COURANT / 0.5, moving.strengths().to_vec());
    let steepest = ring::run(64, 1.0, 0.5)?.remeshing(ring::each_step(64)?)?.step(1.5 * longest).err();
    let named = steepest.and_then(|error| error.particle());
    refused(case, &mut start.clone(), named, due(Limit::Distortion), |_, _| moving.step(1.5 * longest).map(drop))?;
    let steepest = named.map(|p| ring::mesh(64).map(|mesh| mesh.points().nth(p).map_or(0.0, |x| x[0].cos().abs())));
    case.prevents(
        steepest.transpose()?.is_some_and(|steepest| steepest > 1.0 - 1e-12)
            && moving.time() == 0.0
            && moving.strengths() == start,
        "the limit of distortion names the particle, and the moving set is as it was",
    );
    Ok(())
}

/// 62. A source that returns NaN.
pub fn nan_source(case: &mut Case, _: bool) -> Done {
    const AT: usize = 37;
    const DT: f64 = 1.0 / 1024.0;
    case.setup(format!("a source that is NaN at particle {AT} from t = {DT:.5} / 4 on"));
    let bad = World::new()?.particles.points()[AT];
    let source = move |x: &[f64; 2], t: f64, u: f64| if *x == bad && t >= 0.25 * DT { f64::NAN } else { -u };
    let (mut u, mut lost) = (vec![1.0; N], Vec::new());
    let world = World::new()?;
    for step in 0..4 {
        let t = f64::from(step) * DT;
        let change = |p: usize| 0.01 * sum_of(&world.rows, p, &u) + source(&world.particles.points()[p], t, u[p]);
        u = (0..N).map(|p| u[p] + DT * change(p)).collect();
        lost.push(u.iter().filter(|u| u.is_nan()).count());
    }
    case.naive(
        lost[1] == 1 && lost[3] > 20,
        format!("explicit Euler with diffusion: after 1 to 4 steps {lost:?} of {N} values are NaN"),
    );
    for policy in [StepPolicy::Refuse, StepPolicy::Adapt { most: 50 }] {
        let calls = AtomicUsize::new(0);
        let counted = |x: &[f64; 2], t: f64, u: f64| {
            calls.fetch_add(1, Ordering::Relaxed);
            source(x, t, u)
        };
        let near = Nearest::build(&world.particles, &world.torus, 20)?;
        let scene = AdvectionDiffusion::<2>::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new()).source(counted);
        let mut run = Eulerian::new(scene, &world.particles, &near, Rk4::new())?.step_policy(policy);
        let mut field = world.u.clone();
        let due = is!(Time, TimeError::NotFinite { stage: 2, t } if *t == 0.5 * DT);
        refused(case, &mut field, Some(AT), due, |_, field| run.step(field, DT).map(drop))?;
        // Two values a particle for the limit at the start, as far as the bad one for that at the end, then two stages; a
        // retry would ask for more.
        let asked = calls.load(Ordering::Relaxed);
        case.prevents(
            asked <= 4 * N + 2 * (AT + 1) && run.time() == 0.0,
            format!("{policy:?}: {asked} calls for {N} particles, no retry: an error of a function is final"),
        );
    }
    Ok(())
}

/// 63. A function that panics.
pub fn panicking(case: &mut Case, _: bool) -> Done {
    const DT: f64 = 1e-3;
    case.setup("a source that panics in the third stage");
    let mut u = vec![1.0; N];
    let third = catch_unwind(AssertUnwindSafe(|| {
        for (p, u) in u.iter_mut().enumerate() {
            if p == 70 {
                std::panic::resume_unwind(Box::new("the caller's own"));
            }
            *u *= 0.5;
        }
    }));
    let halved = u.iter().filter(|u| **u == 0.5).count();
    case.naive(
        third.is_err() && halved == 70,
        format!("a field updated in place is left with {halved} new values and {} old ones", N - halved),
    );
    let world = World::new()?;
    let near = Nearest::build(&world.particles, &world.torus, 20)?;
    let left = AtomicUsize::new(usize::MAX);
    let source = |_: &[f64; 2], _: f64, u: f64| {
        if left.fetch_sub(1, Ordering::Relaxed) == 0 {
            // Without the message of the default hook.
            std::panic::resume_unwind(Box::new("the caller's own"));
        }
        -u
    };
    let scene = || AdvectionDiffusion::<2>::new().diffusion(0.01, DcPse::<Laplacian<2>, 2>::new()).source(source);
    let mut run = Eulerian::new(scene(), &world.particles, &near, Rk4::new())?;
    let mut u = world.u.clone();
    run.step(&mut u, DT)?;
    let before = (format!("{u:?}"), run.time(), format!("{:?}", run.ledger()));
    left.store(4 * N + N / 2, Ordering::Relaxed);
    let caught = catch_unwind(AssertUnwindSafe(|| run.step(&mut u, DT).map(drop))).is_err();
    let same = before == (format!("{u:?}"), run.time(), format!("{:?}", run.ledger()));
    case.prevents(caught && same, "the panic passes through; field, time and ledger are as they were");
    left.store(usize::MAX, Ordering::Relaxed);
    run.step(&mut u, DT)?;
    let mut again = Eulerian::new(scene(), &world.particles, &near, Rk4::new())?;
    let mut v = world.u.clone();
    again.step(&mut v, DT)?;
    again.step(&mut v, DT)?;
    case.prevents(
        u.iter().zip(&v).all(|(u, v)| u.to_bits() == v.to_bits()),
        "the run goes on, with the bits of one in which nothing happened",
    );
    Ok(())
}

/// Strengths on particles of the unit interval, deposited on a bounded mesh of another.
fn bounded(lower: f64, upper: f64) -> parops::Result<Mesh<1>> {
    Mesh::nodes(&parops::Domain::new([lower], [upper], [[Face::Open; 2]])?, [41])
}

/// 64. A mesh that does not cover the particles.
pub fn uncovered(case: &mut Case, _: bool) -> Done {
    case.setup("20 particles of the unit interval, a mesh from -0.5 to 0.8");
    let line = Particles::lattice([0.0], [1.0], [20])?;
    let inside = line.points().iter().filter(|x| x[0] < 0.8).count();
    case.naive(inside < 20, format!("who is not covered is left out: the mass is {inside} of 20"));
    let mut own = (bounded(-0.5, 0.8)?, vec![0.25; 41], vec![1.0; 20]);
    let first = line.points().iter().position(|x| x[0] > 0.8 - 2.0 * 1.3 / 40.0);
    let due = is!(Mesh, MeshError::Support { axis: 0, coordinate, high, .. } if coordinate > high);
    refused(case, &mut own, first, due, |_, (mesh, values, omega)| {
        mesh.deposit(&Lambda::<4, 2>::new()?, line.points(), omega, values)
    })?;
    Ok(())
}

/// 65. A remeshing kernel that crosses a wall.
pub fn across_a_wall(case: &mut Case, _: bool) -> Done {
    case.setup("a particle at half a node from the wall at 0, Lambda_4,2, which takes 3 nodes on either side");
    let mesh = bounded(0.0, 1.0)?;
    let x = 0.5 * mesh.spacings()[0];
    let kernel = Lambda::<4, 2>::new()?;
    let wide = bounded(-1.0, 1.0)?;
    let fine = Mesh::nodes(&parops::Domain::new([-1.0], [1.0], [[Face::Open; 2]])?, [81])?;
    let mut values = vec![0.0; 81];
    fine.deposit(&kernel, &[[x]], &[1.0], &mut values)?;
    let kept: f64 = fine.points().zip(&values).filter(|(x, _)| x[0] >= 0.0).map(|(_, value)| value).sum();
    case.naive(
        (kept - 1.0).abs() > 1e-3 && wide.len() == 41,
        format!("nodes behind the wall left out: the mass is {kept:.4}"),
    );
    let mut own = (mesh, vec![0.25; 41]);
    let due = is!(Mesh, MeshError::Support { axis: 0, coordinate, low, .. } if coordinate < low);
    refused(case, &mut own, Some(1), due, |_, (mesh, values)| {
        mesh.deposit(&kernel, &[[0.5], [x]], &[1.0, 1.0], values)
    })?;
    Ok(())
}

/// A writer that takes so many bytes.
struct Full {
    left: usize,
}

impl std::io::Write for Full {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let taken = bytes.len().min(self.left);
        self.left -= taken;
        if taken == 0 { Err(std::io::ErrorKind::StorageFull.into()) } else { Ok(taken) }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// 66. A writer that fails.
pub fn failing_writer(case: &mut Case, quick: bool) -> Done {
    use std::io::Write;
    case.setup("a disk that is full after k bytes, for k through the whole file");
    let mut buffer = std::io::BufWriter::new(Full { left: 100 });
    let written = buffer.write(&[b'x'; 1000]).is_ok();
    // Dropped without a flush, as at the end of a scope.
    drop(buffer);
    case.naive(
        written,
        "1000 bytes into a buffer: accepted; the error of its flush at the end of the scope is dropped",
    );
    let world = World::new()?;
    let mut whole = Vec::new();
    Vtu::new(&world.particles).field("u", world.u.as_slice())?.write(&mut whole)?;
    for k in [0, 100, whole.len() - 1] {
        let due = is!(Io, IoError::Write { kind: std::io::ErrorKind::StorageFull, bytes } if *bytes == k as u64);
        refused(case, &mut (), None, due, |world, ()| {
            Vtu::new(&world.particles).field("u", world.u.as_slice())?.write(&mut Full { left: k })
        })?;
    }
    let every = if quick { 13 } else { 1 };
    let failed = (0..whole.len()).step_by(every).filter(|&k| {
        let file = Vtu::new(&world.particles).field("u", world.u.as_slice()).and_then(|file| file.write(&mut Full { left: k }));
        matches!(file.map_err(|error| error.kind().clone()), Err(ErrorKind::Io(IoError::Write { bytes, .. })) if bytes == k as u64)
    });
    let failed = failed.count();
    case.prevents(
        failed == whole.len().div_ceil(every)
            && Vtu::new(&world.particles)
                .field("u", world.u.as_slice())?
                .write(&mut Full { left: whole.len() })
                .is_ok(),
        format!(
            "{failed} of {} lengths fail with the bytes that were taken, and the whole of {} is written",
            whole.len().div_ceil(every),
            whole.len()
        ),
    );
    Ok(())
}
