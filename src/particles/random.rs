//! A small generator of our own, so that a seed means the same particles forever.

/// The SplitMix64 generator: 64 bits of state, every seed legal, period 2^64.
///
/// Bits and uniform variates are the same on every platform; normal variates up to the rounding of its logarithm
/// and cosine.
///
/// ```
/// use parops::Random;
/// let mut random = Random::new(1234567);
/// assert_eq!(random.bits(), 6457827717110365317);
/// assert!((0.0..1.0).contains(&random.uniform()));
/// ```
///
/// Source: Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators", with Vigna's constants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Random(u64);

impl Random {
    /// The generator of this seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next variate uniform in [0, 1), a multiple of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        unit(self.bits())
    }

    /// The next standard normal variate, sqrt(-2 ln r1) sin(2 pi r2), with r1 uniform in (0, 1] and r2 in [0, 1).
    ///
    /// Source: Box and Muller 1958; notes 001, eq. 4.2 with errata 58: the root does not cover the sine.
    pub fn normal(&mut self) -> f64 {
        let r1 = 1.0 - self.uniform();
        let r2 = self.uniform();
        (-2.0 * r1.ln()).sqrt() * (std::f64::consts::TAU * r2).sin()
    }
}

/// The upper 53 bits as a number in [0, 1).
pub(super) fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}
