//! Files that other programs read.

mod base64;
mod counted;
mod pvd;
mod vtu;
mod xml;

pub(crate) use counted::{Counted, counted};
pub use pvd::Pvd;
pub use vtu::{Vtu, VtuValues};
#[cfg(feature = "testing")]
pub(crate) use xml::Escaped;
