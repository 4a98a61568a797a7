//! Rows of methods that are made of another method.

use super::{MatrixFree, Rows};
use crate::error::Result;
use crate::neighbors::Neighbors;
use crate::operator::{DivGrad, Method};

impl<M> DivGrad<M> {
    /// Builds the rows of this operator, with `f64` weights; [`Rows::assemble`] rounds them to another type.
    ///
    /// # Errors
    /// As [`Rows::assemble`].
    pub fn assemble<const D: usize, P: Neighbors<D>>(&self, neighbors: &P) -> Result<Rows>
    where
        M: Method<D, Out = [f64; 1]>,
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
        M: Method<D, Out = [f64; 1]>,
    {
        MatrixFree::new(self, neighbors)
    }
}
