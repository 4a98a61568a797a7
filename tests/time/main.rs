//! Steppers and runs.

#[path = "../cases/mod.rs"]
mod cases;

mod checker;
mod implicit;
mod steppers;
mod super_time_stepping;
