//! Transfer between particles and meshes.

#[path = "../cases/mod.rs"]
mod cases;

mod remesh;
mod transfer;
