//! Steppers and runs.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../linear/dense/mod.rs"]
mod dense;
#[path = "../properties/mod.rs"]
mod properties;

mod checker;
mod implicit;
mod steppers;
mod super_time_stepping;
