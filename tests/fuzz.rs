//! The fuzz targets, on random bytes and on bytes that stand for plausible scenes.

#[path = "cases/mod.rs"]
mod cases;

use parops::Random;
use parops::testing::{FuzzFault, FuzzOutcome, Promise, fuzz_neighbor_build, fuzz_operator_build};

type Target = fn(&[u8]) -> Result<FuzzOutcome, FuzzFault>;

/// The least share of cases from which something must be built, or the target has nothing to check: a half of what was
/// measured for operators, a quarter for neighbors. Random bytes must also be refused now and then.
const FEWEST: f64 = 0.15;

/// Of fewer cases no share is asked for: the shares of so few are chance.
const ENOUGH: usize = 100;

/// Enough for 60 points with all that belongs to them.
const LONGEST: usize = 700;

fn below(random: &mut Random, limit: usize) -> usize {
    (random.uniform() * limit as f64) as usize
}

fn random_bytes(random: &mut Random) -> Vec<u8> {
    (0..below(random, LONGEST)).map(|_| below(random, 256) as u8).collect()
}

fn promise(text: &'static str) -> Promise {
    Promise::new("Input", text)
}

/// Runs the target and tells whether something was built.
fn built(target: Target, bytes: &[u8]) -> bool {
    let outcome = target(bytes);
    if let Err(fault) = &outcome {
        println!("{fault}\nbytes: {bytes:?}");
    }
    promise("what fuzzed bytes build equals the oracle and its moments, or is refused for a reason")
        .holds(outcome.is_ok());
    outcome.is_ok_and(|outcome| outcome == FuzzOutcome::Built)
}

/// From how many of the cases something was built.
struct Share {
    built: usize,
    cases: usize,
}

impl Share {
    fn is_at_least_the_fewest(&self, text: &'static str) {
        if self.cases >= ENOUGH {
            promise(text).at_least(FEWEST, self.built as f64 / self.cases as f64);
        }
    }

    fn is_not_all(&self) {
        assert!(self.cases < ENOUGH || self.built < self.cases, "nothing is refused");
    }
}

/// The share of random bytes from which something is built.
fn share_of_random_bytes(target: Target, seed: u64) -> Share {
    let mut random = Random::new(seed);
    let cases = cases::cases() as usize;
    let built = (0..cases).filter(|_| built(target, &random_bytes(&mut random))).count();
    Share { built, cases }
}

/// The share of scenes none of whose parts may be anything at all, then changed, cut or grown in a few places.
fn share_of_scenes(target: Target, seed: u64) -> Share {
    let mut random = Random::new(seed);
    let cases = cases::cases() as usize / 2;
    let mut count = 0;
    for _ in 0..cases {
        let mut bytes = random_bytes(&mut random);
        bytes.resize(bytes.len().max(2), 0);
        bytes[1] %= 128;
        for _ in 0..below(&mut random, 4) {
            let at = below(&mut random, bytes.len());
            match below(&mut random, 4) {
                0 => bytes[at] = below(&mut random, 256) as u8,
                1 => bytes.insert(at, below(&mut random, 256) as u8),
                2 => bytes.truncate(at.max(2)),
                _ => bytes[at] ^= 1 << below(&mut random, 8),
            }
        }
        count += usize::from(built(target, &bytes));
    }
    Share { built: count, cases }
}

#[test]
fn neighbors_built_from_random_bytes_equal_the_oracle_or_are_refused_for_a_reason() {
    let share = share_of_random_bytes(fuzz_neighbor_build, 1);
    share.is_at_least_the_fewest("share of random bytes that build neighbors");
    share.is_not_all();
}

#[test]
fn neighbors_built_from_plausible_scenes_equal_the_oracle() {
    let share = share_of_scenes(fuzz_neighbor_build, 2);
    share.is_at_least_the_fewest("share of plausible scenes that build neighbors");
}

#[test]
fn operators_built_from_random_bytes_keep_their_promises_or_are_refused_for_a_reason() {
    let share = share_of_random_bytes(fuzz_operator_build, 3);
    share.is_at_least_the_fewest("share of random bytes that build operators");
    share.is_not_all();
}

#[test]
fn operators_built_from_plausible_scenes_keep_their_promises() {
    let share = share_of_scenes(fuzz_operator_build, 4);
    share.is_at_least_the_fewest("share of plausible scenes that build operators");
}
