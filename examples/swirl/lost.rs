//! What becomes of particles that are not remeshed: diffusion in a vortex that only winds up.

use parops::{
    AdvectionDiffusion, Carried, DcPse, ErrorKind, GrowthPolicy, Lagrangian, Lambda, Laplacian, Mesh, MovingScene,
    MovingSettings, MovingState, Particles, Remeshing, Result, Rk4, SolverError, Steady, StepPolicy, Trigger,
};

use crate::flow::{start, velocity};
use crate::scattered::torus;

/// Particles along an axis, and when the run ends.
const N: usize = 24;
const END: f64 = 2.0;
const DT: f64 = 0.02;

/// The worst condition number of a row, the mass less that of the start over it, and when the run is refused by default
/// because modes have come to grow.
pub struct Wound {
    pub condition: f64,
    pub drift: f64,
    pub refused: Option<f64>,
}

/// DC-PSE diffusion of order 2 on moving particles, remeshed or not; what follows the refusal is allowed to grow.
pub fn wind_up(remeshed: bool) -> Result<Wound> {
    let mut run = start_run(remeshed, GrowthPolicy::Refuse)?;
    let mut condition = 0.0_f64;
    let refused = match run.advance_with(END, DT, |row, _| condition = condition.max(row.condition)) {
        Ok(_) => None,
        Err(error) if matches!(error.kind(), ErrorKind::Solver(SolverError::Growing { .. })) => {
            let t = run.time();
            run = start_run(remeshed, GrowthPolicy::Allow)?;
            run.advance_with(END, DT, |row, _| condition = condition.max(row.condition))?;
            Some(t)
        }
        Err(error) => return Err(error),
    };
    let field = &run.ledger().fields[0];
    Ok(Wound { condition, drift: field.drift / (field.mass - field.drift), refused })
}

fn start_run(
    remeshed: bool,
    growth: GrowthPolicy,
) -> Result<Lagrangian<2, impl MovingScene<2, Value = f64>, Rk4<MovingState<2, f64>>>> {
    let set = Particles::lattice([0.0; 2], [1.0; 2], [N; 2])?;
    let u: Vec<f64> = set.points().iter().map(start).collect();
    let scene = AdvectionDiffusion::<2>::new()
        .diffusion(1e-3, DcPse::<Laplacian<2>, 2>::new())
        .advection(Steady(|x: &[f64; 2]| velocity(x, 0.0)), Carried);
    let mut settings = MovingSettings::default();
    settings.growth = growth;
    let run = Lagrangian::with_settings(scene, &set, &u, &torus()?, Rk4::new(), settings)?;
    let run = run.step_policy(StepPolicy::Adapt { most: 100 });
    if !remeshed {
        return Ok(run);
    }
    let (kernel, mesh) = (Lambda::<2, 2>::new()?, Mesh::cells(&torus()?, [N; 2])?);
    run.remeshing(Remeshing { kernel, mesh, trigger: Trigger::Steps(2), threshold: 0.0 })
}
