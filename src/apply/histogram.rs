//! How a figure of the certificate is spread over the rows.

/// Number of rows per decade of a figure.
///
/// Bin i counts the rows with 10^(i - 32) <= x < 10^(i - 31); the first bin takes what is smaller, zero included, the
/// last what is larger, NaN included; what is negative counts as small.
///
/// ```
/// use parops::Histogram;
/// let mut rows = Histogram::default();
/// [0.0, 3e-16, 4e-16, 20.0, f64::NAN].into_iter().for_each(|x| rows.add(x));
/// assert_eq!((rows.total(), rows.at(3e-16), rows.at(99.0)), (5, 2, 1));
/// assert_eq!(rows.decades().nth(1), Some((1e-16, 2)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "Vec<usize>", try_from = "Vec<usize>"))]
pub struct Histogram {
    counts: [usize; BINS],
}

const BINS: usize = 64;
/// The exponent of the lower edge of the first bin.
const LOWEST: i32 = -32;

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: [0; BINS] }
    }
}

#[cfg(feature = "serde")]
impl From<Histogram> for Vec<usize> {
    fn from(histogram: Histogram) -> Self {
        histogram.counts.to_vec()
    }
}

#[cfg(feature = "serde")]
impl TryFrom<Vec<usize>> for Histogram {
    type Error = crate::error::Error;

    fn try_from(counts: Vec<usize>) -> crate::error::Result<Self> {
        let found = counts.len();
        let wrong = |_| crate::error::ParticleError::Length { found, needed: BINS };
        Ok(Self { counts: counts.try_into().map_err(wrong)? })
    }
}

impl Histogram {
    /// Counts one row.
    pub fn add(&mut self, x: f64) {
        self.counts[bin(x)] += 1;
    }

    /// Adds the counts of other rows.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(count, more)| *count += more);
    }

    /// Number of rows counted.
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Number of rows in the decade of x.
    pub fn at(&self, x: f64) -> usize {
        self.counts[bin(x)]
    }

    /// The decades that hold rows: their lower edges and the number of rows, ascending.
    pub fn decades(&self) -> impl Iterator<Item = (f64, usize)> + '_ {
        EDGES.into_iter().zip(self.counts).filter(|&(_, count)| count > 0)
    }
}

fn bin(x: f64) -> usize {
    if !(x < EDGES[BINS - 1]) {
        return BINS - 1;
    }
    if x < EDGES[1] {
        return 0;
    }
    // The binary exponent names the decade but for one, without a logarithm.
    let exponent = (x.to_bits() >> 52) as i32 - 1023;
    let decade = ((exponent * 315_653) >> 20) - LOWEST;
    let guess = decade.clamp(0, BINS as i32 - 1) as usize;
    guess + usize::from(guess + 1 < BINS && x >= EDGES[guess + 1])
}

/// Lower edges of the bins; written out, because products of tens are not the nearest numbers.
#[rustfmt::skip]
const EDGES: [f64; BINS] = [
    1e-32, 1e-31, 1e-30, 1e-29, 1e-28, 1e-27, 1e-26, 1e-25, 1e-24, 1e-23, 1e-22, 1e-21, 1e-20, 1e-19, 1e-18, 1e-17,
    1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1,
    1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21,
    1e22, 1e23, 1e24, 1e25, 1e26, 1e27, 1e28, 1e29, 1e30, 1e31,
];
