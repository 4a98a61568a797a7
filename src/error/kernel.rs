//! Why kernels are refused.

use super::kinds;

kinds! {
    /// Refusals of the kernel layer.
    KernelError {
        /// An order for which no such kernel exists.
        Order {
            /// The order asked for.
            order: u32,
        } => "full-space kernels exist for orders 2, 4, 6 and 8, not {order}",
        /// The exact derivation left the range of 128-bit integers, or would have too many monomials.
        Overflow {
            /// Degree |beta|.
            degree: u32,
            /// Order r.
            order: u32,
        } => "the exact kernel of degree {degree} and order {order} does not fit 128-bit rationals, or has too many monomials",
        /// A derivative that is not along one axis, where only such have a kernel.
        NotAlongAxis {
            /// Degree |beta|.
            degree: u32,
            /// Number of axes it is taken along.
            axes: usize,
        } => "one-sided kernels exist for derivatives along one axis, not for degree {degree} along {axes}",
        /// A degree and an order for which no one-sided kernel is derived.
        OneSided {
            /// Degree beta.
            degree: u32,
            /// Order r.
            order: u32,
            /// Largest legal beta + r.
            limit: u32,
        } => "one-sided kernels have order 1 or more and degree plus order up to {limit}, not {degree} and {order}",
        /// A term of another degree than two, for an anisotropic second-order operator.
        NotSecond {
            /// Degree |beta|.
            degree: u32,
        } => "the anisotropic Gaussian serves second derivatives, not degree {degree}",
        /// A derivative of higher degree than the kernel has.
        Regularity {
            /// The kernel, by the name of its type.
            kernel: &'static str,
            /// Degree asked for.
            degree: u32,
            /// Highest degree the kernel is differentiable to.
            limit: u32,
        } => "{kernel} has derivatives to degree {limit}, not {degree}",
        /// A support radius or overlap limit that is not positive and finite, or whose square or volume is not.
        Radii {
            /// Support, in units of epsilon.
            support: f64,
            /// Largest h / epsilon.
            overlap_limit: f64,
        } => "support {support} and overlap limit {overlap_limit} must be positive and finite, the volume within too",
        /// A remeshing kernel Lambda_{P,R} that does not exist.
        Lambda {
            /// P, the degree it should reproduce.
            exactness: u64,
            /// R, how often it should be differentiable.
            regularity: u64,
        } => "Lambda_{exactness},{regularity} does not exist: P must be even and from 2 to 2 R + 1",
        /// The exact derivation of Lambda_{P,R} left the range of 128-bit integers.
        LambdaOverflow {
            /// P.
            exactness: u64,
            /// R.
            regularity: u64,
        } => "Lambda_{exactness},{regularity} does not fit 128-bit rationals",
        /// A quadrature of too many points.
        Points {
            /// Number of points.
            points: f64,
            /// Largest legal number.
            limit: f64,
        } => "a quadrature of {points:e} points is beyond the {limit:e} allowed",
    }
}
