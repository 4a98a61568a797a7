//! How properties are tried.

use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;

/// `cases` cases, the same in every run, so that what is measured on them can be measured again; `PROPTEST_RNG_SEED`
/// sets other ones.
pub fn properties(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let rng_seed = if default.rng_seed == RngSeed::Random { RngSeed::Fixed(1) } else { default.rng_seed };
    let (cases, max_global_rejects) = (cases.max(1), cases.max(default.max_global_rejects));
    ProptestConfig { cases, max_global_rejects, rng_seed, failure_persistence: None, ..default }
}
