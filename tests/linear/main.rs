//! Sparse matrices, spectra, and the systems of boundary rows.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod boundary;
mod dense;
mod hyperviscosity;
mod matrices;
mod spectrum;
mod upwind_rows;
