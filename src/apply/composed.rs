//! Rows of methods that are made of another method.

use super::{MatrixFree, Rows};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::{Contraction, DivGrad, DivTensorGrad, Hessian, Method, Operator};

macro_rules! composed {
    ($(impl [$($generics:tt)*] $ty:ty, outputs $k:tt $(, where $bound:ty: $of:path)?;)*) => { $(
        impl<$($generics)*> $ty {
            /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
            ///
            /// # Errors
            /// As [`Rows::assemble`].
            pub fn assemble<const D: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows>
            where
                M: Method<D, Out = [f64; $k]>,
                $($bound: $of,)?
            {
                Rows::assemble(self, neighbors)
            }

            /// The same operator without stored weights: they are computed anew in every application.
            ///
            /// # Errors
            /// As [`Rows::assemble`].
            pub fn matrix_free<'a, const D: usize, P: Neighbors<D>>(
                &'a self,
                neighbors: &'a P,
            ) -> Result<MatrixFree<'a, D, Self, P>>
            where
                M: Method<D, Out = [f64; $k]>,
                $($bound: $of,)?
            {
                MatrixFree::new(self, neighbors)
            }
        }
    )* };
}

composed! {
    impl [M] DivGrad<M>, outputs 1;
    impl [M, const K: usize] Contraction<M, K>, outputs K;
    impl [M, const K: usize] DivTensorGrad<M, K>, outputs K, where Hessian<D>: Operator<D, Out = [f64; K]>;
}
