//! One run of one method, quarter by quarter of the period.

use std::time::Instant;

use parops::{
    AdvectionDiffusion, Carried, CellList, Eulerian, GrowthPolicy, Lagrangian, Lambda, LedgerRow, Mesh, MeshKernel,
    Nearest, Neighbors, Particles, Remeshing, Result, Rk4, Spacing, StepPolicy, Transport, Trigger, UpwindDcPse,
    UpwindGradient,
};

use crate::flow::{FASTEST, PERIOD, start, velocity};
use crate::record::{Moment, Record};
use crate::scattered::{Gammas, nearest, scattered, stabilized, torus};

/// A way to advect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// One-sided kernels of order 1.
    Upwind,
    /// DC-PSE of order 3 on stencils centered upstream.
    Biased,
    /// Central DC-PSE with hyperviscosity, of order 2 or 4.
    Central(u32),
    /// Particles that move, remeshed by Lambda_{p,r} after every step.
    Remeshed(usize, usize),
    /// The same by Lambda_{4,2} as soon as overlap is lost.
    Late,
    /// Particles that move, never remeshed.
    Free,
}

impl Method {
    pub const ALL: [Self; 10] = [
        Self::Upwind,
        Self::Biased,
        Self::Central(2),
        Self::Central(4),
        Self::Remeshed(2, 1),
        Self::Remeshed(2, 2),
        Self::Remeshed(4, 2),
        Self::Remeshed(4, 4),
        Self::Late,
        Self::Free,
    ];

    pub fn name(self) -> String {
        match self {
            Self::Upwind => "upwind r = 1".into(),
            Self::Biased => "upwind DC-PSE r = 3".into(),
            Self::Central(order) => format!("DC-PSE r = {order}"),
            Self::Remeshed(p, r) => format!("Lambda {p} {r}"),
            Self::Late => "Lambda 4 2 by overlap".into(),
            Self::Free => "not remeshed".into(),
        }
    }

    /// Whether particles stay.
    pub fn stays(self) -> bool {
        matches!(self, Self::Upwind | Self::Biased | Self::Central(_))
    }
}

/// Steps of particles that move, in h over the greatest speed.
const CFL: f64 = 2.0;
/// When overlap is lost, in h.
const LOST: Trigger = Trigger::Overlap { hole: 1.2, gap: 0.5 };

/// One run with n particles along an axis; `watch` sees the start and every quarter.
pub fn solve(method: Method, n: usize, gammas: &Gammas, watch: impl FnMut(Moment)) -> Result<Record> {
    let each = Trigger::Steps(1);
    match method {
        Method::Upwind => {
            let set = scattered(n)?;
            let upwind = UpwindGradient::new(set.spacing()?.epsilon(1.0)?, set.volumes()?);
            let cutoff = upwind.cutoff();
            fixed(method, n, |set| Ok((CellList::build(set, &torus()?, cutoff)?, upwind)), watch)
        }
        Method::Biased => {
            let upwind = UpwindDcPse::biased(Spacing(1.0 / n as f64));
            let build = |set: &_| Ok((Nearest::build(set, &torus()?, upwind.neighbors::<2>()?)?, upwind));
            fixed(method, n, build, watch)
        }
        Method::Central(4) => central::<4>(method, n, gammas.fourth, watch),
        Method::Central(_) => central::<2>(method, n, gammas.second, watch),
        Method::Remeshed(2, 1) => moving(method, n, Some((Lambda::<2, 1>::new()?, each)), watch),
        Method::Remeshed(2, _) => moving(method, n, Some((Lambda::<2, 2>::new()?, each)), watch),
        Method::Remeshed(_, 2) => moving(method, n, Some((Lambda::<4, 2>::new()?, each)), watch),
        Method::Remeshed(..) => moving(method, n, Some((Lambda::<4, 4>::new()?, each)), watch),
        Method::Late => moving(method, n, Some((Lambda::<4, 2>::new()?, LOST)), watch),
        Method::Free => moving(method, n, None::<(Lambda<4, 2>, Trigger)>, watch),
    }
}

fn central<const R: u32>(method: Method, n: usize, gamma: f64, watch: impl FnMut(Moment)) -> Result<Record> {
    let build = |set: &Particles<2>| Ok((nearest::<R>(set)?, stabilized::<R>(n).gamma(gamma)));
    fixed(method, n, build, watch)
}

/// Particles that stay.
fn fixed<N: Neighbors<2>, X: Transport<2>>(
    method: Method,
    n: usize,
    build: impl FnOnce(&Particles<2>) -> Result<(N, X)>,
    watch: impl FnMut(Moment),
) -> Result<Record> {
    let set = scattered(n)?;
    let mut u: Vec<f64> = set.points().iter().map(start).collect();
    let clock = Instant::now();
    let (neighbors, scheme) = build(&set)?;
    let scene = AdvectionDiffusion::<2>::new().advection(velocity, scheme);
    // What hyperviscosity leaves to grow is slower than the flow; nothing else here does grow.
    // It is as fast at the end as at the start, and then comes from the other sides, which may bear a little less.
    let (steps, growth) = (StepPolicy::Adapt { most: 2 }, GrowthPolicy::Unknown);
    let mut run = Eulerian::with_policy(scene, &set, &neighbors, Rk4::new(), steps, growth)?;
    let dt = run.longest_step(&u)?;
    let build = clock.elapsed().as_secs_f64();

    quarters(Record::new(method, n, build), watch, |end| {
        let clock = Instant::now();
        if end > 0.0 {
            run.advance(&mut u, end, dt)?;
        }
        let seconds = clock.elapsed().as_secs_f64();
        Ok((Moment { t: end, particles: set.clone(), u: u.clone() }, run.ledger().clone(), seconds))
    })
}

/// Particles that move.
fn moving<K: MeshKernel<f64, S> + 'static, const S: usize>(
    method: Method,
    n: usize,
    remeshing: Option<(K, Trigger)>,
    watch: impl FnMut(Moment),
) -> Result<Record> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [n; 2])?;
    let u: Vec<f64> = set.points().iter().map(start).collect();
    let clock = Instant::now();
    let scene = AdvectionDiffusion::<2>::new().advection(velocity, Carried);
    let mut run = Lagrangian::new(scene, &set, &u, &torus()?, Rk4::new())?;
    if let Some((kernel, trigger)) = remeshing {
        let mesh = Mesh::cells(&torus()?, [n; 2])?;
        run = run.remeshing(Remeshing { kernel, mesh, trigger, threshold: 0.0 })?;
    }
    let build = clock.elapsed().as_secs_f64();

    quarters(Record::new(method, n, build), watch, |end| {
        let clock = Instant::now();
        if end > 0.0 {
            run.advance(end, CFL / (FASTEST * n as f64))?;
        }
        let seconds = clock.elapsed().as_secs_f64();
        Ok((Moment { t: end, particles: run.particles()?, u: run.values().collect() }, run.ledger().clone(), seconds))
    })
}

/// Advances a run to the start and to every quarter, and notes what it came to.
fn quarters(
    mut record: Record,
    mut watch: impl FnMut(Moment),
    mut advance: impl FnMut(f64) -> Result<(Moment, LedgerRow<2>, f64)>,
) -> Result<Record> {
    for quarter in 0..=4 {
        let (moment, ledger, seconds) = advance(0.25 * f64::from(quarter) * PERIOD)?;
        record.run += seconds;
        match quarter {
            2 => record.half(&moment)?,
            4 => record.end(&moment, &ledger),
            _ => {}
        }
        watch(moment);
    }
    Ok(record)
}
