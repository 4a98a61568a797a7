//! Functions of any bytes that build neighbors and operators and check what comes of it: targets for fuzzers.

mod bytes;
mod fault;
mod neighbor;
mod operator;
mod oracle;
mod own_rows;
mod pairwise;
mod row;
mod rules;
mod scene;
mod solved;
mod upwind;

pub use fault::{FuzzFault, FuzzOutcome};
pub use neighbor::fuzz_neighbor_build;
pub use operator::fuzz_operator_build;

type Checked<T = ()> = Result<T, FuzzFault>;
