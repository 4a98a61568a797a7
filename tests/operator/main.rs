//! PSE, SPH and one-sided operators, and what their rows owe to a change of the input.

#[path = "../cases/mod.rs"]
mod cases;
#[path = "../properties/mod.rs"]
mod properties;

mod anisotropic;
mod by_hand;
mod certificates;
mod checker;
mod diffusivity_rows;
mod div_grad;
mod expression;
mod invariance;
mod one_sided;
mod one_sided_rows;
mod order;
mod pse;
mod sph;
mod sph_compact;
mod stability;
