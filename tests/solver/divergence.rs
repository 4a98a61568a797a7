//! The computed divergence beside mirrors.

use std::f64::consts::{PI, TAU};

use parops::testing::{Promise, check_provider_against};
use parops::{
    AdvectionDiffusion, Carried, CellList, DcPse, Domain, ErrorKind, Face, Gradient, GrowthPolicy, Lagrangian, Nearest,
    NeighborList, Neighbors, Particles, Pse, Result, Rk4, SemiDiscrete, SolverError, Spacing, Stabilized, Transport,
    UpwindGradient,
};

/// Mirrors across axis 0 that leave this flow as it is, and periods along axis 1.
fn channel(faces: [Face; 2]) -> Result<Domain<2>> {
    Domain::new([0.0; 2], [1.0; 2], [faces, [Face::Periodic; 2]])
}

fn flow(x: &[f64; 2], t: f64) -> [f64; 2] {
    let grow = 1.0 + t;
    [grow * (PI * x[0]).sin() * (1.0 + 0.3 * (TAU * x[1]).cos()), (2.0 + (PI * x[0]).cos()) * (TAU * x[1]).sin() / TAU]
}

fn divergence(x: &[f64; 2], t: f64) -> f64 {
    let along = PI * (1.0 + t) * (PI * x[0]).cos() * (1.0 + 0.3 * (TAU * x[1]).cos());
    along + (2.0 + (PI * x[0]).cos()) * (TAU * x[1]).cos()
}

/// The largest difference between the divergence given and computed.
fn miss<X: Transport<2> + Clone>(scheme: &X, set: &Particles<2>, neighbors: &impl Neighbors<2>) -> Result<f64> {
    let base = || AdvectionDiffusion::<2>::new().advection(flow, scheme.clone());
    let u = vec![2.0; set.len()];
    let [mut a, mut b] = [u.clone(), u.clone()];
    SemiDiscrete::new(base().divergence(divergence), set, neighbors, GrowthPolicy::Allow)?.rate(0.5, &u, &mut a)?;
    SemiDiscrete::new(base().computed_divergence(), set, neighbors, GrowthPolicy::Allow)?.rate(0.5, &u, &mut b)?;
    Ok(a.iter().zip(&b).map(|(a, b)| 0.5 * (a - b).abs()).fold(0.0, f64::max))
}

/// The order of the largest error, which one particle of a scattered set has: that of the rows but for 0.3.
fn order_of(text: &'static str, r: f64, found: f64) {
    println!("{text}: {found:.3}");
    Promise::new("Orders", text).within(r - 0.3, r + 0.3, found);
}

const WALLS: [[Face; 2]; 3] = [[Face::MirrorEven; 2], [Face::MirrorOdd; 2], [Face::MirrorOdd, Face::MirrorEven]];

#[test]
fn computed_divergence_beside_mirrors_keeps_the_order_of_the_rows() -> Result<()> {
    fn orders<const R: u32>(faces: [Face; 2], k: usize) -> Result<f64> {
        let scheme = DcPse::<Gradient<2>, R>::new();
        let at = |n: usize| {
            let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 8)?;
            miss(&scheme, &set, &Nearest::build(&set, &channel(faces)?, k)?)
        };
        Ok((at(24)? / at(48)?).log2())
    }
    for faces in WALLS {
        let (second, fourth) = (orders::<2>(faces, 20)?, orders::<4>(faces, 36)?);
        order_of("divergence computed beside mirrors, DC-PSE of order 2", 2.0, second);
        order_of("divergence computed beside mirrors, DC-PSE of order 4", 4.0, fourth);
    }
    Ok(())
}

#[test]
fn computed_divergence_keeps_its_order_in_corners_and_on_mirrors() -> Result<()> {
    // The flow goes along all four walls; the first row and column of the particles stand on theirs.
    let walls = Domain::new([0.0; 2], [1.0; 2], [[Face::MirrorEven; 2]; 2])?;
    let at = |n: usize| {
        let moved = Particles::<2>::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 8)?;
        let snapped = |x: &[f64; 2]| x.map(|x| if x < 1.0 / n as f64 { 0.0 } else { x });
        let set = Particles::new(moved.points().iter().map(snapped).collect())?;
        miss(&DcPse::<Gradient<2>, 2>::new(), &set, &Nearest::build(&set, &walls, 24)?)
    };
    let order = (at(24)? / at(48)?).log2();
    order_of("divergence computed in corners and on mirrors, DC-PSE of order 2", 2.0, order);
    Ok(())
}

/// A provider that keeps to itself which domain its images are of.
struct Silent(Nearest<2>);

impl Neighbors<2> for Silent {
    fn targets(&self) -> usize {
        self.0.targets()
    }
    fn sources(&self) -> usize {
        self.0.sources()
    }
    fn center(&self, p: usize) -> Option<usize> {
        self.0.center(p)
    }
    fn cutoff(&self, p: usize) -> f64 {
        self.0.cutoff(p)
    }
    fn reach(&self) -> f64 {
        self.0.reach()
    }
    fn generation(&self) -> u64 {
        self.0.generation()
    }
    fn for_each(&self, p: usize, cutoff: f64, visit: impl FnMut(parops::Neighbor<2>)) {
        self.0.for_each(p, cutoff, visit);
    }
}

#[test]
fn images_of_a_domain_that_is_not_named_are_refused_where_the_divergence_is_computed() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [16; 2], 0.2, 8)?;
    let scheme = DcPse::<Gradient<2>, 2>::new();
    let silent = Silent(Nearest::build(&set, &channel([Face::MirrorEven; 2])?, 20)?);
    let refused = miss(&scheme, &set, &silent).unwrap_err();
    assert!(matches!(refused.kind(), ErrorKind::Solver(SolverError::UnknownImage { .. })), "{refused}");
    // Without images there is nothing to know.
    let open = |of: Nearest<2>| miss(&scheme, &set, &Silent(of));
    let nearest = Nearest::build(&set, &Domain::open(), 20)?;
    assert_eq!(open(nearest.clone())?, miss(&scheme, &set, &nearest)?);
    Ok(())
}

#[test]
fn signs_of_the_field_at_a_mirror_are_not_those_of_the_velocity() -> Result<()> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [40; 2])?;
    let pse = Pse::new(Gradient::<2>, 2, set.spacing()?.epsilon(2.0)?, set.volumes()?)?;
    let mut misses = Vec::new();
    for faces in WALLS {
        let neighbors = CellList::build(&set, &channel(faces)?, pse.cutoff())?;
        misses.push(miss(&pse, &set, &neighbors)?);
        // Rows that were stored, and those of the user's own, know the mirrors too.
        let stored = NeighborList::from_provider(&neighbors.clone().canonical())?;
        assert_eq!(check_provider_against(&stored, &neighbors), Ok(()));
        assert!((miss(&pse, &set, &stored)? / misses[0] - 1.0).abs() < 1e-9);
    }
    // epsilon^2 beside the fourth derivatives: the leading error of a kernel of order 2.
    assert!(misses.iter().all(|&miss| miss < PI.powi(3) * 1.5 * 1.3 * (2.0 / 40.0_f64).powi(2)), "{misses:?}");
    assert!(misses.iter().all(|&miss| (miss / misses[0] - 1.0).abs() < 1e-9), "{misses:?}");
    Ok(())
}

#[test]
fn schemes_with_central_rows_compute_the_divergence_at_mirrors_and_others_refuse() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.2, 8)?;
    let walls = channel([Face::MirrorEven; 2])?;
    let neighbors = Nearest::build(&set, &walls, 24)?;
    let bare = miss(&DcPse::<Gradient<2>, 2>::new(), &set, &neighbors)?;
    let stabilized = miss(&Stabilized::<2, 2>::new(Spacing(1.0 / 24.0)).gamma(0.1), &set, &neighbors)?;
    assert_eq!(bare.to_bits(), stabilized.to_bits());
    let set = Particles::lattice([0.0; 2], [1.0; 2], [24; 2])?;
    let upwind = UpwindGradient::new(set.spacing()?.epsilon(1.5)?, set.volumes()?);
    let refused = miss(&upwind, &set, &CellList::build(&set, &walls, upwind.cutoff())?).unwrap_err();
    assert_eq!(*refused.kind(), ErrorKind::Solver(SolverError::NoDivergence { t: 0.5 }));
    Ok(())
}

#[test]
fn flow_across_a_mirror_is_refused_where_the_divergence_is_computed() -> Result<()> {
    let set = Particles::jittered([0.0; 2], [1.0; 2], [24; 2], 0.2, 8)?;
    let neighbors = Nearest::build(&set, &channel([Face::MirrorEven; 2])?, 20)?;
    let scheme = DcPse::<Gradient<2>, 2>::new();
    let scene = AdvectionDiffusion::<2>::new().advection([0.5, 1.0], scheme.clone()).computed_divergence();
    let refused = SemiDiscrete::new(scene, &set, &neighbors, GrowthPolicy::Allow).err().expect("crosses");
    let crosses = SolverError::CrossesMirror { axis: 0, value: 0.5, t: 0.0 };
    assert_eq!(refused.kind(), &ErrorKind::Solver(crosses));
    let p = refused.particle().expect("a particle");
    assert!(set.points()[p][0] < 0.2 || set.points()[p][0] > 0.8);
    // Along the walls it may go, and through periods.
    let scene = AdvectionDiffusion::<2>::new().advection([0.0, 1.0], scheme).computed_divergence();
    let mut along = SemiDiscrete::new(scene, &set, &neighbors, GrowthPolicy::Allow)?;
    let (u, mut du) = (vec![1.0; set.len()], vec![0.0; set.len()]);
    along.rate(0.0, &u, &mut du)?;
    assert!(du.iter().all(|du| du.abs() < 1e-11));
    Ok(())
}

#[test]
fn velocities_of_moving_particles_have_their_divergence_beside_mirrors() -> Result<()> {
    let walls = channel([Face::MirrorEven; 2])?;
    let worst = |n: usize| -> Result<f64> {
        let set = Particles::jittered([0.0; 2], [1.0; 2], [n; 2], 0.2, 8)?.with_equal_volumes(1.0)?;
        let v: Vec<[f64; 2]> = set.points().iter().map(|x| flow(x, 0.0)).collect();
        let scene = AdvectionDiffusion::<2>::new().advection(v, Carried).computed_divergence();
        let mut run = Lagrangian::new(scene, &set, &vec![1.0; set.len()], &walls, Rk4::new())?;
        let dt = 1e-6;
        run.step(dt)?;
        // dV/dt = V div v.
        let rate = |p: usize| Result::Ok((run.particles()?.volumes()?.get(p)? * set.len() as f64 - 1.0) / dt);
        let miss = |(p, x)| Ok((rate(p)? - divergence(x, 0.0)).abs());
        set.points().iter().enumerate().map(miss).try_fold(0.0_f64, |most, miss: Result<f64>| Ok(most.max(miss?)))
    };
    let (coarse, fine) = (worst(24)?, worst(48)?);
    // Rows of order 2 for a first derivative.
    order_of("divergence of moving particles beside mirrors", 2.0, (coarse / fine).log2());
    Ok(())
}
