//! What becomes of particles that are not remeshed: diffusion in a vortex that only winds up.

use parops::{
    AdvectionDiffusion, Carried, DcPse, Lagrangian, Lambda, Laplacian, Mesh, Particles, Remeshing, Result, Rk4, Steady,
    StepPolicy, Trigger,
};

use crate::flow::{start, velocity};
use crate::runs::torus;

/// Particles along an axis, and when the run ends.
const N: usize = 24;
const END: f64 = 3.0;
const DT: f64 = 0.02;

/// The worst condition number of a row, and the mass less that of the start over it.
pub struct Wound {
    pub condition: f64,
    pub drift: f64,
}

/// DC-PSE diffusion of order 2 on moving particles, remeshed or not.
pub fn wind_up(remeshed: bool) -> Result<Wound> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [N; 2])?;
    let u: Vec<f64> = set.points().iter().map(start).collect();
    let scene = AdvectionDiffusion::<2>::new()
        .diffusion(1e-3, DcPse::<Laplacian<2>, 2>::new())
        .advection(Steady(|x: &[f64; 2]| velocity(x, 0.0)), Carried);
    let mut run = Lagrangian::new(scene, &set, &u, &torus()?, Rk4::new())?.step_policy(StepPolicy::Adapt { most: 100 });
    if remeshed {
        let (kernel, mesh) = (Lambda::<2, 2>::new()?, Mesh::cells(&torus()?, [N; 2])?);
        run = run.remeshing(Remeshing { kernel, mesh, trigger: Trigger::Steps(2), threshold: 0.0 })?;
    }
    let mut condition = 0.0_f64;
    let row = run.advance_with(END, DT, |row, _| condition = condition.max(row.condition))?;
    Ok(Wound { condition, drift: row.fields[0].drift / (row.fields[0].mass - row.fields[0].drift) })
}
