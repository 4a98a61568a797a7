//! What upwind schemes ask of a set: rows on the sides that the flow comes from, at particles whose value is not given.

use parops::{
    AdvectionDiffusion, Allowance, Boundary, CellList, Domain, ErrorKind, Euler, Eulerian, Face, GrowthPolicy, Limit,
    Nearest, Neighbors, Particles, Result, Rk4, Scene, SemiDiscrete, SolverError, Steady, StepPolicy, Transport,
    UpwindDcPse, UpwindGradient,
};

const N: usize = 24;
const H: f64 = 1.0 / N as f64;

fn jittered() -> Result<Particles<2>> {
    Particles::jittered([0.0; 2], [1.0; 2], [N; 2], 0.25, 9)
}

/// Values given where x < wide.
fn inflow(set: &Particles<2>, wide: f64) -> Boundary<2> {
    let given = set.points().iter().enumerate().filter(|(_, x)| x[0] < wide);
    Boundary::new(2).inflow(given.map(|(p, _)| (p, [-1.0, 0.0])))
}

/// The rate of the advection term, and the largest sum_q |A_pq| of the matrix where no value is given.
fn rate_and_row_sum<S: Scene<2, Value = f64>>(
    scene: S,
    set: &Particles<2>,
    neighbors: &impl Neighbors<2>,
) -> Result<(f64, f64)> {
    let mut discrete = SemiDiscrete::new(scene, set, neighbors, GrowthPolicy::Unknown)?;
    let rate = discrete.linear_limits(0.0)?.rate(Limit::Advection);
    let (matrix, given) = (discrete.matrix(0.0)?, discrete.prescribed(0.0));
    let sum = |p: usize| matrix.row(p).map_or(0.0, |(_, values)| values.iter().map(|w| w.abs()).sum::<f64>());
    let most = (0..set.len()).filter(|p| !given.contains(p)).map(sum).fold(0.0, f64::max);
    Ok((rate.decay + rate.modulus, most))
}

#[test]
fn steps_are_bound_by_the_rows_in_use() -> Result<()> {
    fn scene<X: Transport<2>>(set: &Particles<2>, scheme: X, wide: f64) -> impl Scene<2, Value = f64> {
        let flow = Steady(|x: &[f64; 2]| [1.0, 0.3 * (x[1] - 0.5)]);
        AdvectionDiffusion::<2>::new().advection(flow, scheme).boundary(inflow(set, wide), |_, _, _| 1.0)
    }
    let set = jittered()?;
    let torus = Domain::new([0.0; 2], [1.0; 2], [[Face::Open; 2], [Face::Periodic; 2]])?;
    let first = UpwindGradient::new(set.spacing()?.epsilon(1.0)?, set.volumes()?).support(3.0)?;
    let first = first.allow(Allowance::Everywhere);
    let near = CellList::build(&set, &torus, first.cutoff())?;
    let (rate, sum) = rate_and_row_sum(scene(&set, first, 1.5 * H), &set, &near)?;
    assert!((rate / sum - 1.0).abs() < 1e-12, "{rate} {sum}");
    // 2 * 1.5/h or so without jitter.
    assert!(rate < 6.0 / H, "{rate}");

    for scheme in [UpwindDcPse::half_stencils(), UpwindDcPse::biased(set.spacing()?)] {
        let around = Nearest::build(&set, &torus, scheme.neighbors::<2>()?)?;
        let (rate, sum) = rate_and_row_sum(scene(&set, scheme, 4.0 * H), &set, &around)?;
        // Weights of two axes on one neighbor may cancel in the matrix.
        assert!((1.0 - 1e-12..1.5).contains(&(rate / sum)) && rate < 12.0 / H, "{rate} {sum}");
    }
    Ok(())
}

#[test]
fn moments_are_judged_where_a_steady_flow_comes_from() -> Result<()> {
    let (set, open) = (jittered()?, [Face::Open; 2]);
    let channel = Domain::new([0.0; 2], [1.0; 2], [open, [Face::Periodic; 2]])?;
    let scheme = UpwindGradient::<2>::new(set.spacing()?.epsilon(1.0)?, set.volumes()?).support(3.0)?;
    let neighbors = CellList::build(&set, &channel, scheme.cutoff())?;
    // The right of particles at the outflow is a sliver, far from what a row of order 1 can do with.
    assert!(scheme.assemble(&neighbors).is_err());
    let scene = || AdvectionDiffusion::<2>::new().boundary(inflow(&set, 2.5 * H), |_, _, _| 1.0);
    let mut run = Eulerian::new(scene().advection([1.0, 0.0], scheme.clone()), &set, &neighbors, Euler::new())?;
    let mut u = vec![1.0; set.len()];
    let dt = run.longest_step(&u)?;
    run.advance(&mut u, 2.0, dt)?;
    assert!(dt > 0.2 * H && u.iter().all(|u| (u - 1.0).abs() < 1e-11), "{dt}");
    // A flow that may turn wants all of them.
    let turning = |_: &[f64; 2], t: f64| [t.cos(), 0.0];
    assert!(Eulerian::new(scene().advection(turning, scheme), &set, &neighbors, Euler::new()).is_err());
    Ok(())
}

#[test]
fn components_of_rounding_come_from_nowhere() -> Result<()> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [16; 2])?;
    let faces = [[Face::Periodic; 2], [Face::Open; 2]];
    let neighbors = Nearest::build(&set, &Domain::new([0.0; 2], [1.0; 2], faces)?, 45)?;
    // 0 at the edges but for rounding: sin(pi) is 1e-16.
    let flow = |tiny: f64| {
        Steady(move |x: &[f64; 2]| {
            let edge = if x[1] < 0.1 { -1.0 } else { f64::from(u8::from(x[1] > 0.9)) };
            [1.0 + 0.1 * x[1], -tiny * edge]
        })
    };
    for scheme in [UpwindDcPse::half_stencils(), UpwindDcPse::biased(set.spacing()?)] {
        let run = |tiny| {
            let scene = AdvectionDiffusion::<2>::new().advection(flow(tiny), scheme);
            let settings = (StepPolicy::Refuse, GrowthPolicy::Unknown);
            let mut run = Eulerian::with_policy(scene, &set, &neighbors, Rk4::new(), settings.0, settings.1)?;
            let mut u: Vec<f64> = set.points().iter().map(|x| x[1]).collect();
            run.step(&mut u, 1e-3)?;
            Ok::<_, parops::Error>(u)
        };
        let (still, moved) = (run(0.0)?, run(1e-16)?);
        assert!(still.iter().zip(&moved).all(|(a, b)| (a - b).abs() < 1e-15));
        let refused = run(1e-10).unwrap_err();
        assert!(matches!(refused.kind(), ErrorKind::Solver(SolverError::NoUpstream { axis: 1, .. })), "{refused}");
    }
    Ok(())
}
