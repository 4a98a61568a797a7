//! Scenes, and Eulerian and Lagrangian runs.

mod compressing;
#[path = "../linear/dense/mod.rs"]
mod dense;
mod divergence;
mod eulerian;
mod eulerian_faults;
mod eulerian_growth;
mod eulerian_ledger;
mod eulerian_limits;
mod eulerian_order;
mod eulerian_schemes;
mod eulerian_stiff;
mod hyperviscosity;
mod jump;
mod lagrangian;
mod lagrangian_faults;
mod lagrangian_growth;
mod longest_step;
mod one_sided_limits;
mod relations;
mod remeshed;
mod remeshed_substeps;
mod resume;
mod scene;
mod sharp_limits;
mod steady;
mod steady_sources;
mod watch;
