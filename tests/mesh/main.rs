//! Transfer between particles and meshes.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod remesh;
mod transfer;
