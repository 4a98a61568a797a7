//! Rows at work: on fields, by threads, written out, refused.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod export;
mod faults;
mod fields;
mod full;
mod threads;
mod vtu;
