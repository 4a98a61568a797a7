//! Remeshing kernels Lambda_{P,R}, derived exactly.

use super::interpolation::{centered, pieces};
use super::mesh_kernel::MeshKernel;
use super::rational::Rational;
use crate::error::{KernelError, Result};
use crate::scalar::Scalar;

/// The interpolation kernel Lambda_{P,R}: even, of class C^R, zero for |s| >= P/2 + 1, and of degree 2R + 1 between
/// neighboring integers.
///
/// sum_k k^a Lambda(x - k) = x^a for a = 0..=P and every x, and Lambda(j) = 0 for the integers j != 0, Lambda(0) = 1. So
/// depositing conserves the moments 0 to P, and gathering reproduces polynomials of degree P. P is even,
/// from 2 to 2R + 1; (2,1), (2,2), (4,2), (4,4), (6,4), (6,6) and (8,4) are the usual ones.
///
/// The kernel is negative at a distance: its least value is -0.074 to -0.156 for the seven, so that
/// strengths may change their sign and steps overshoot.
///
/// The coefficients are derived in exact rationals, shifted exactly to powers of u = t - 1/2, t = s - floor(s), and
/// rounded once: there the sum of the weights is 1 to 4 eps, in powers of t it misses by up to 7000 eps, and in powers
/// of s all digits go. Making one costs microseconds to milliseconds; weights allocate nothing.
///
/// ```
/// use parops::{Lambda, MeshKernel};
/// let kernel = Lambda::<4, 2>::new()?;
/// assert_eq!(kernel.piece(2).unwrap()[1].to_string(), "1/12");
/// assert_eq!((kernel.value(0.0), kernel.value(1.0), kernel.value(3.0)), (1.0, 0.0, 0.0));
/// let sum: f64 = kernel.weights(0.3).iter().sum();
/// assert!((sum - 1.0).abs() <= 4.0 * f64::EPSILON);
/// # parops::Result::Ok(())
/// ```
///
/// Source: Cottet, Etancelin, Perignon, Picard 2014; notes 001, eq. 7.21 and 7.22 with errata 39, 40 and 43. That the
/// values at the nodes are those of central differences, and P <= 2R + 1, is our derivation.
#[derive(Clone, Debug, PartialEq)]
pub struct Lambda<const P: usize, const R: usize> {
    pieces: Vec<Vec<Rational>>,
    /// Piece j is E_j(u^2) + u O_j(u^2), node REACH - 1 - j sees it at u and node REACH + j at -u. Row n holds the
    /// coefficients of u^2n, those of all E_j and then of all O_j: the lanes of one Horner scheme in u^2.
    powers: Vec<f64>,
}

impl<const P: usize, const R: usize> Lambda<P, R> {
    /// Nodes on either side, P/2 + 1, which is also where the support ends.
    const REACH: usize = P / 2 + 1;
    const NODES: usize = 2 * Self::REACH;

    /// Derives the kernel.
    ///
    /// # Errors
    /// [`KernelError::Lambda`] unless P is even and from 2 to 2R + 1, and [`KernelError::LambdaOverflow`] where a
    /// coefficient does not fit 128-bit rationals.
    pub fn new() -> Result<Self> {
        let (exactness, regularity) = (P as u64, R as u64);
        if !P.is_multiple_of(2) || P == 0 || P / 2 > R {
            return Err(KernelError::Lambda { exactness, regularity }.into());
        }
        let overflow = || KernelError::LambdaOverflow { exactness, regularity };
        // Factorials to 2R + 1 enter: far beyond the range there is nothing to try.
        if R > Self::HOPELESS {
            return Err(overflow().into());
        }
        let pieces = pieces(P, R).ok_or_else(overflow)?;
        let mut powers = vec![0.0; (R + 1) * Self::NODES];
        for (j, piece) in pieces.iter().enumerate() {
            for (n, coefficient) in centered(piece).ok_or_else(overflow)?.into_iter().enumerate() {
                powers[Self::place(n, j)] = coefficient.to_f64();
            }
        }
        Ok(Self { pieces, powers })
    }

    const HOPELESS: usize = 64;

    /// Where the coefficient of u^n of piece j is kept.
    const fn place(n: usize, j: usize) -> usize {
        n / 2 * Self::NODES + n % 2 * Self::REACH + j
    }

    /// The exact coefficients of t^0 to t^(2R+1) on j <= s <= j + 1, t = s - j; `None` beyond the support.
    pub fn piece(&self, j: usize) -> Option<&[Rational]> {
        self.pieces.get(j).map(Vec::as_slice)
    }

    /// Lambda(s), s in spacings.
    pub fn value<T: Scalar>(&self, s: T) -> T {
        self.differentiated(0, s)
    }

    /// The m-th derivative of Lambda at s, m = `degree`, in spacings^-m.
    ///
    /// # Errors
    /// [`KernelError::Regularity`] for m > R, where the derivative jumps at the integers.
    pub fn derivative<T: Scalar>(&self, degree: u32, s: T) -> Result<T> {
        if degree as usize > R {
            return Err(KernelError::Regularity { kernel: "Lambda", degree, limit: R as u32 }.into());
        }
        Ok(self.differentiated(degree, s))
    }

    /// sum_n n (n-1) ... (n-m+1) c_n u^(n-m) on the piece of |s|, odd derivatives with the sign of s.
    fn differentiated<T: Scalar>(&self, degree: u32, s: T) -> T {
        let distance = s.abs();
        // Written so that NaN stays.
        let Some(j) = (0..Self::REACH).find(|&j| !(distance >= T::lift((j + 1) as f64))) else { return T::zero() };
        let u = (distance - T::lift(j as f64)) - T::lift(0.5);
        let degree = degree as usize;
        let mut sum = T::zero();
        for n in (degree..2 * R + 2).rev() {
            let factor = (n - degree + 1..=n).fold(1.0, |product, i| product * i as f64);
            let coefficient = self.powers.get(Self::place(n, j)).copied().unwrap_or_default();
            sum = sum * u + T::lift(factor * coefficient);
        }
        if degree % 2 == 1 && s < T::zero() { -sum } else { sum }
    }

    #[inline(always)]
    fn horner<T: Scalar, const S: usize>(&self, u: T) -> [T; S] {
        let (square, mut sums) = (u * u, [T::zero(); S]);
        for row in self.powers.as_chunks::<S>().0.iter().take(R + 1).rev() {
            for (sum, &coefficient) in sums.iter_mut().zip(row) {
                *sum = *sum * square + T::lift(coefficient);
            }
        }
        std::array::from_fn(|k| {
            if k < S / 2 { sums[S / 2 - 1 - k] + u * sums[S - 1 - k] } else { sums[k - S / 2] - u * sums[k] }
        })
    }
}

/// P + 2 cannot be computed in a type. From P = 30 on no kernel fits 128-bit rationals.
macro_rules! nodes {
    ($($p:literal $s:literal),*) => { $(
        impl<T: Scalar, const R: usize> MeshKernel<T, $s> for Lambda<$p, R> {
            #[inline(always)]
            fn weights(&self, u: T) -> [T; $s] {
                self.horner(u)
            }

            fn exactness(&self) -> u32 {
                $p
            }
        }
    )* };
}

nodes!(2 4, 4 6, 6 8, 8 10, 10 12, 12 14, 14 16, 16 18, 18 20, 20 22, 22 24, 24 26, 26 28, 28 30);
