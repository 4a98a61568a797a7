#![doc = include_str!("../docs/guide.md")]

#[doc = include_str!("../docs/choosing_a_method.md")]
pub mod choosing_a_method {}

#[doc = include_str!("../docs/choosing_epsilon.md")]
pub mod choosing_epsilon {}

#[doc = include_str!("../docs/bad_rows.md")]
pub mod bad_rows {}

#[doc = include_str!("../docs/extending.md")]
pub mod extending {}

#[doc = include_str!("../docs/sph.md")]
pub mod sph {}

#[doc = include_str!("../docs/pse.md")]
pub mod pse {}

#[doc = include_str!("../docs/dcpse.md")]
pub mod dcpse {}

#[doc = include_str!("../docs/upwind.md")]
pub mod upwind {}

#[doc = include_str!("../docs/moving.md")]
pub mod moving {}

#[doc = include_str!("../docs/time_stepping.md")]
pub mod time_stepping {}
