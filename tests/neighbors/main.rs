//! Domains, particle sets, and the providers of neighbors.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod checker;
mod domain;
mod half_list;
mod nearest;
mod particles;
mod providers_agree;
mod quality;
mod verlet;
