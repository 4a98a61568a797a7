//! A method some of whose rows are left out, or refused.

use super::draft::Draft;
use super::expression::Outputs;
use super::method::Method;
use super::row_report::RowReport;
use crate::error::{Error, OperatorError, Result};
use crate::stencil::{Side, Stencil};

/// Which rows of a method are left out before they are made, and which are refused afterwards.
pub(crate) trait Screen<const D: usize>: Sync {
    /// Whether target p gets a row of zeros: there a row may not even exist.
    fn leaves_out(&self, p: usize) -> bool {
        let _ = p;
        false
    }

    /// Refuses a row, or hands its report on.
    ///
    /// # Errors
    /// Of the kind that the method would refuse the row with.
    fn check(&self, row: &Stencil<D>, known: RowReport) -> Result<RowReport> {
        let _ = row;
        Ok(known)
    }
}

/// Refuses a row with less than half of its neighbors on a side, as one of too few: so a stencil at an edge is never made of
/// what lies downwind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) axis: usize,
    pub(crate) side: Side,
}

impl<const D: usize> Screen<D> for Facing {
    fn check(&self, row: &Stencil<D>, known: RowReport) -> Result<RowReport> {
        let upstream = |s: &&[f64; D]| s.get(self.axis).is_some_and(|x| self.side.sign() * x > 0.0);
        let (neighbors, needed) = (row.separations().iter().filter(upstream).count(), row.len().div_ceil(2));
        if neighbors < needed {
            return Err(OperatorError::TooFew { neighbors, conditions: known.conditions, needed }.into());
        }
        Ok(known)
    }
}

/// The rows of a method as a screen lets them through.
#[derive(Clone, Debug)]
pub(crate) struct Screened<'a, M, S> {
    pub(crate) method: &'a M,
    pub(crate) screen: S,
}

impl<M: Method<D>, S: Screen<D>, const D: usize> Method<D> for Screened<'_, M, S> {
    type Out = M::Out;
    type Scratch = M::Scratch;

    fn scratch(&self) -> Result<M::Scratch> {
        self.method.scratch()
    }

    fn validate(&self, targets: usize, sources: usize) -> Result<()> {
        self.method.validate(targets, sources)
    }

    fn cutoff(&self, p: usize) -> Result<Option<f64>> {
        self.method.cutoff(p)
    }

    fn weights(
        &self,
        row: &Stencil<D>,
        scratch: &mut M::Scratch,
        w: &mut [M::Out],
        diagonal: &mut M::Out,
    ) -> Result<()> {
        if self.screen.leaves_out(row.target()) {
            w.fill(M::Out::ZERO);
            *diagonal = M::Out::ZERO;
            return Ok(());
        }
        self.method.weights(row, scratch, w, diagonal)
    }

    fn report(&self, row: &Stencil<D>, scratch: &M::Scratch, w: &[M::Out], diagonal: &M::Out) -> Result<RowReport> {
        if self.screen.leaves_out(row.target()) {
            return Ok(RowReport::of(row, w, diagonal));
        }
        self.screen.check(row, self.method.report(row, scratch, w, diagonal)?)
    }

    fn weights_batch(&self, drafts: &mut [Draft<D, M::Out>], scratch: &mut M::Scratch) {
        let left_out = |draft: &Draft<D, M::Out>| self.screen.leaves_out(draft.stencil.target());
        for run in drafts.chunk_by_mut(|a, b| left_out(a) == left_out(b)) {
            if run.first().is_some_and(left_out) {
                for draft in run {
                    draft.clear();
                    draft.report = Ok(RowReport::of(&draft.stencil, &draft.weights, &draft.diagonal));
                }
                continue;
            }
            self.method.weights_batch(run, scratch);
            for draft in run {
                if let Ok(known) = draft.report {
                    draft.report = self.screen.check(&draft.stencil, known);
                }
            }
        }
    }

    fn growths(&self) -> u32 {
        self.method.growths()
    }

    fn can_grow(&self, refusal: &Error) -> bool {
        self.method.can_grow(refusal)
    }

    fn stand_in(&self, draft: &mut Draft<D, M::Out>, scratch: &mut M::Scratch) {
        self.method.stand_in(draft, scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ParticleError;
    use crate::operator::{DcPse, DivGrad, Laplacian};
    use crate::stencil::Neighbor;

    /// Neighbors in a spiral around target p, turned a little for each.
    fn stencil(p: usize) -> Stencil<2> {
        let mut stencil = Stencil::default();
        stencil.reset(p, Some(p), 2.0);
        for q in 0..24_u32 {
            let (sine, cosine) = (f64::from(q) + 0.1 * p as f64).sin_cos();
            let radius = 0.3 + 0.03 * f64::from(q);
            stencil.push(Neighbor { q: 10 + q as usize, separation: [radius * cosine, radius * sine], sign: 1 });
        }
        stencil
    }

    struct Without(usize);

    impl Screen<2> for Without {
        fn leaves_out(&self, p: usize) -> bool {
            p == self.0
        }
    }

    type Made = (Vec<[f64; 1]>, [f64; 1], RowReport);

    fn single<M: Method<2, Out = [f64; 1]>>(method: &M, p: usize) -> Result<Made> {
        let (row, mut scratch) = (stencil(p), method.scratch()?);
        let (mut w, mut diagonal) = (vec![[f64::NAN]; row.len()], [f64::NAN]);
        method.weights(&row, &mut scratch, &mut w, &mut diagonal)?;
        let report = method.report(&row, &scratch, &w, &diagonal)?;
        Ok((w, diagonal, report))
    }

    #[test]
    fn rows_left_out_are_zero_and_all_others_those_of_the_method_alone_and_in_batches() -> Result<()> {
        let method = DcPse::<Laplacian<2>, 2>::new();
        let screened = Screened { method: &method, screen: Without(2) };
        let drafts = |p| {
            let mut draft = Draft { stencil: stencil(p), ..Draft::default() };
            draft.clear();
            draft
        };
        let mut batch: Vec<Draft<2, [f64; 1]>> = (0..5).map(drafts).collect();
        screened.weights_batch(&mut batch, &mut screened.scratch()?);
        for (p, draft) in batch.into_iter().enumerate() {
            let made = single(&screened, p)?;
            assert_eq!((draft.weights, draft.diagonal, draft.report?), made);
            if p == 2 {
                let (row, zeros) = (stencil(p), vec![[0.0]; 24]);
                let known = RowReport::of(&row, &zeros, &[0.0]);
                assert_eq!(made, (zeros, [0.0], known));
            } else {
                assert_eq!(made, single(&method, p)?);
            }
        }
        let thin = OperatorError::TooFew { neighbors: 3, conditions: 5, needed: 5 };
        for refusal in [thin, OperatorError::NoCenter { neighbors: 3 }].map(Error::from) {
            assert_eq!(screened.can_grow(&refusal), method.can_grow(&refusal));
        }
        let method = DivGrad::new(method, vec![1.0; 5])?;
        let screened = Screened { method: &method, screen: Without(2) };
        assert_eq!(screened.validate(5, 6), Err(ParticleError::Length { found: 5, needed: 6 }.into()));
        Ok(())
    }

    #[test]
    fn rows_facing_a_side_are_refused_below_half_of_their_neighbors_there() {
        let facing = |side, along: &[f64]| {
            let mut row = Stencil::<2>::default();
            row.reset(0, Some(0), 1.0);
            along.iter().for_each(|&x| row.push(Neighbor { q: 1, separation: [0.5, x], sign: 1 }));
            let known = RowReport { conditions: 7, ..RowReport::of(&row, &vec![[0.0]; row.len()], &[0.0]) };
            Facing { axis: 1, side }.check(&row, known).map(|report| assert_eq!(report, known))
        };
        // Sources on the left have a separation above zero; one beside the target is on neither side.
        for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
            assert_eq!(facing(side, &[sign, sign, -sign, 0.0]), Ok(()));
            assert_eq!(facing(side, &[sign, sign, -sign]), Ok(()));
            for (along, neighbors, needed) in
                [(vec![sign, -sign, -sign], 1, 2), (vec![sign, sign, -sign, 0.0, -sign], 2, 3)]
            {
                let refused = OperatorError::TooFew { neighbors, conditions: 7, needed };
                assert_eq!(facing(side, &along), Err(refused.into()));
            }
        }
    }
}
