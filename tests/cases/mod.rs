//! How many cases a property is tried on.

/// `PAROPS_CASES`, or 1000.
pub fn cases() -> u32 {
    std::env::var("PAROPS_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1000)
}
