//! Moments, the solvers of moment systems, and the rows of DC-PSE.

#[path = "../../examples/orders/bands.rs"]
mod bands;
#[path = "../cases/mod.rs"]
mod cases;
#[path = "../../examples/orders/measure.rs"]
mod measure;
#[path = "../properties/mod.rs"]
mod properties;
#[path = "../../examples/orders/sets.rs"]
mod sets;

mod accuracy;
mod catalogue;
mod conservation;
mod dimensions;
mod drawn;
mod exactness;
mod method;
mod moments;
mod named;
mod order;
mod relations;
mod reproduction;
mod rows;
mod solvers;
mod stencils;
mod support;
mod systems;
