//! The PSE runs: one order, one stepper, one number type, one number of particles.

use std::time::Instant;

use parops::{
    Allowance, Apply, CellList, Domain, Epsilon, Euler, Exchange, Exponential, Face, Field, Kernel, Laplacian,
    LatticeSpectrum, Particles, Plan, Pse, Result, Rk4, Rows, Stepper, WideGaussian, integrate,
};

use crate::benchmark::{D, DT, Record, T, X_PSE, exact, norms};

/// What one run gave: its row of the table and its solution.
pub struct Outcome {
    pub record: Record,
    pub solution: Vec<(f64, f64)>,
}

/// Which propagator is used.
#[derive(Clone, Copy, PartialEq)]
pub enum Propagator {
    Euler,
    Rk4,
    /// The exact exponential of the semi-discrete system: what is left is the space error.
    Exact,
}

impl Propagator {
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Rk4 => "rk4",
            Self::Exact => "exact",
        }
    }
}

/// Runs PSE of the given order: order 2 with the wide Gaussian of eq. 5.27 and epsilon = h, orders 4, 6 and 8 with the
/// narrow kernels and epsilon = 2 h.
pub fn run<S: Field>(scalar: &'static str, order: u32, propagator: Propagator, n: usize) -> Result<Outcome>
where
    Vec<S>: parops::State,
{
    let h = X_PSE / n as f64;
    if order == 2 {
        solve::<S, _>(scalar, WideGaussian::<1>::new(), h, propagator, n)
    } else {
        let mut terms = Vec::new();
        parops::Operator::<1>::terms(&Laplacian::<1>, &mut |_, index, factor| {
            terms.push(parops::Term { index, factor })
        });
        solve::<S, _>(scalar, Exchange::<1>::new(&terms, order)?, 2.0 * h, propagator, n)
    }
}

fn solve<S: Field, K: Kernel<f64, 1>>(
    scalar: &'static str,
    kernel: K,
    epsilon: f64,
    propagator: Propagator,
    n: usize,
) -> Result<Outcome>
where
    Vec<S>: parops::State,
{
    let start = Instant::now();
    let h = X_PSE / n as f64;
    let order = kernel.order();
    let spectrum = LatticeSpectrum::scan(&kernel, h / epsilon, kernel.support())?;
    let limit = spectrum.limit(D, epsilon)?;

    // Placement x_p = (p + 1/2) h, the odd image at x = 0, and an open end where u is below round-off: there, and
    // only there, the kernels may find too few neighbors.
    let particles = Particles::lattice([0.0], [X_PSE], [n])?;
    let x: Vec<f64> = particles.points().iter().map(|point| point[0]).collect();
    let domain = Domain::new([0.0], [X_PSE], [[Face::MirrorOdd, Face::Open]])?;
    let pse = Pse::with_kernels([kernel], Epsilon::global(epsilon)?, particles.volumes()?)?;
    let cutoff = pse.cutoff();
    let open_end = (0..n).filter(|&p| x[p] > X_PSE - cutoff.0);
    let pse = pse.allow(Allowance::at(open_end));
    let neighbors = CellList::build(&particles, &domain, cutoff)?;
    let rows = Rows::<_, S>::assemble(&pse, &neighbors)?;

    let mut u: Vec<S> = x.iter().map(|&x| S::lift(exact(x, 0.0))).collect();
    let plan = Plan::new(0.0, T, DT)?.limit(limit);
    let (dt, steps) = match propagator {
        Propagator::Euler => advance(&mut Euler::new(), &rows, &mut u, plan)?,
        Propagator::Rk4 => advance(&mut Rk4::new(), &rows, &mut u, plan)?,
        Propagator::Exact => {
            let mut wide: Vec<f64> = u.iter().map(|u| u.as_()).collect();
            let double = Rows::<_, f64>::assemble(&pse, &neighbors)?;
            let exponential = Exponential::new(n, |f, out| double.apply(f, out))?;
            exponential.propagate(D * T, &mut wide)?;
            u = wide.into_iter().map(S::lift).collect();
            (T, 1)
        }
    };
    let seconds = start.elapsed().as_secs_f64();
    let solution: Vec<(f64, f64)> = x.iter().zip(&u).map(|(&x, u)| (x, u.as_())).collect();
    let (l2, linf) = norms(solution.iter().map(|&(x, u)| exact(x, T) - u));
    let record = Record {
        method: "pse",
        scalar,
        order,
        stepper: propagator.name(),
        n,
        h,
        epsilon,
        cutoff: cutoff.0,
        dt,
        steps,
        l2,
        linf,
        observed_order: None,
        seconds,
    };
    Ok(Outcome { record, solution })
}

/// Takes the planned steps, cut to the limit of the stepper; returns the step and how many there were.
fn advance<S: Field, P: Stepper<Vec<S>>>(
    stepper: &mut P,
    rows: &Rows<[f64; 1], S>,
    u: &mut Vec<S>,
    plan: Plan,
) -> Result<(f64, u64)>
where
    Vec<S>: parops::State,
{
    let plan = plan.cut_for(stepper)?;
    let diffusivity = S::lift(D);
    let rhs = |_: f64, u: &Vec<S>, du: &mut Vec<S>| {
        rows.apply(u, du)?;
        du.iter_mut().for_each(|du| *du *= diffusivity);
        Ok(())
    };
    let run = integrate(stepper, u, &plan, rhs, |_, _, _| {})?;
    Ok((run.dt, run.steps))
}
