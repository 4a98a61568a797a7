//! Scenes, and Eulerian and Lagrangian runs.

mod eulerian;
mod eulerian_faults;
mod eulerian_ledger;
mod eulerian_limits;
mod eulerian_order;
mod eulerian_schemes;
mod eulerian_stiff;
mod lagrangian;
mod remeshed;
mod resume;
mod scene;
mod steady;
mod watch;
