//! The neighbors of several stencils side by side, with their windows.

use super::window::{Window, Windows};
use crate::exp::exp;
use crate::lanes::Lanes;

/// Neighbors that are worked on together: sums over neighbors are then loaded and stored a quarter as often, and what
/// belongs to a group still fits the registers.
pub(super) const GROUP: usize = 4;

/// One quantity of a group of neighbors, of L stencils each.
pub(super) type Group<const L: usize> = [Lanes<L>; GROUP];

/// Scaled separations and windows of L stencils, neighbor beside neighbor.
///
/// Shorter stencils are filled up with neighbors at 0 of window 0, which add exact zeros to every sum.
#[derive(Clone, Debug, Default)]
pub(super) struct Nodes<const L: usize> {
    /// z, axis after axis for each group.
    places: Vec<Group<L>>,
    /// phi(|z|).
    windows: Vec<Group<L>>,
}

impl<const L: usize> Nodes<L> {
    /// Number of groups.
    #[inline(always)]
    pub(super) fn groups(&self) -> usize {
        self.windows.len()
    }

    /// Places, axis after axis, and windows of each group.
    #[inline(always)]
    pub(super) fn iter<const D: usize>(&self) -> impl Iterator<Item = (&[Group<L>], &Group<L>)> {
        self.places.chunks_exact(D).zip(&self.windows)
    }

    #[inline(always)]
    pub(super) fn load<const D: usize>(&mut self, z: [&[[f64; D]]; L], windows: Windows<D, L>) {
        let (shortest, longest) =
            z.iter().fold((usize::MAX, 0), |(low, high), z| (low.min(z.len()), high.max(z.len())));
        let (full, groups) = (shortest / GROUP, longest.div_ceil(GROUP));
        let blank = [Lanes::ZERO; GROUP];
        self.places.clear();
        self.places.resize(groups * D, blank);
        for (group, places) in self.places.chunks_exact_mut(D).take(full).enumerate() {
            for q in 0..GROUP {
                let here = z.map(|z| z[group * GROUP + q]);
                for (axis, place) in places.iter_mut().enumerate() {
                    place[q] = Lanes(here.map(|z| z[axis]));
                }
            }
        }
        for (i, z) in z.iter().enumerate() {
            let ragged = self.places.chunks_exact_mut(D).zip(z.chunks(GROUP)).skip(full);
            for (places, z) in ragged {
                for (q, z) in z.iter().enumerate() {
                    places.iter_mut().zip(z).for_each(|(place, &z)| place[q].0[i] = z);
                }
            }
        }
        self.windows.clear();
        self.windows.resize(groups, blank);
        let Windows { shape, radius, middle } = windows;
        let middle: [Lanes<L>; D] = std::array::from_fn(|axis| Lanes(middle.map(|middle| middle[axis])));
        for (values, places) in self.windows.iter_mut().zip(self.places.chunks_exact(D)) {
            for (q, value) in values.iter_mut().enumerate() {
                let squared = places.iter().zip(&middle).fold(Lanes::ZERO, |sum, (place, &middle)| {
                    let away = place[q] - middle;
                    sum + away * away
                });
                *value = match shape {
                    Window::Exponential => exp(Lanes::ZERO - squared),
                    Window::Wendland => squared.zip(Lanes(radius), |squared, radius| {
                        let root = shape.root(squared, radius);
                        root * root
                    }),
                };
            }
        }
        for (i, z) in z.iter().enumerate() {
            let all = self.windows.iter_mut().flatten();
            all.skip(z.len()).for_each(|window| window.0[i] = 0.0);
        }
    }
}
