//! Multi-indices, exact rationals and kernels.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod accuracy;
mod checker;
mod lambda;
mod lattice_hat;
mod multi_index;
mod oracle;
mod rational;
mod rational_laplacian;
mod smoothing;
mod stated;
mod ulps;
mod values;
