//! Images of a source behind the faces of the box, and the separations to them.

use super::{Domain, Face};

/// Which image of a source is meant: two bits an axis, 0 direct, 1 behind the lower face, 2 behind the upper face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Image(u16);

const DIRECT: u16 = 0;
const LOWER: u16 = 1;
const UPPER: u16 = 2;

impl Image {
    /// The source itself.
    pub(crate) const OWN: Self = Self(0);

    #[inline(always)]
    fn side(self, axis: usize) -> u16 {
        (self.0 >> (2 * axis)) & 3
    }

    fn with(self, axis: usize, side: u16) -> Self {
        Self(self.0 | side << (2 * axis))
    }

    /// This image after its source has gone over to image `source` of its former place, and its target to `target`;
    /// `None` where it is now farther away than any image that counts. Only periodic axes are ever crossed.
    #[inline]
    pub(crate) fn crossed(self, source: Self, target: Self) -> Option<Self> {
        const STEPS: [i32; 4] = [0, -1, 1, 0];
        let mut image = Self::OWN;
        // Eight axes fit the sixteen bits.
        for axis in 0..8 {
            let steps = |image: Self| STEPS[usize::from(image.side(axis))];
            let side = match steps(self) + steps(source) - steps(target) {
                0 => DIRECT,
                -1 => LOWER,
                1 => UPPER,
                _ => return None,
            };
            image = image.with(axis, side);
        }
        Some(image)
    }

    /// Whether this is the image by a translation along every axis, such as the source itself.
    #[inline]
    pub(crate) fn is_shift<const D: usize>(self, domain: &Domain<D>) -> bool {
        (0..D).all(|axis| self.side(axis) == DIRECT || domain.faces[axis][0] == Face::Periodic)
    }
}

impl<const D: usize> Domain<D> {
    const IMAGES_FIT: () = assert!(1 <= D && D <= 8, "domains have 1 to 8 dimensions");

    /// Calls `visit` for every image of a source that can come within `reach` of a point of the box, the source
    /// itself first. With an infinite reach: every image there is.
    pub(crate) fn for_images(&self, source: &[f64; D], reach: f64, mut visit: impl FnMut(Image)) {
        let () = Self::IMAGES_FIT;
        let sides: [[bool; 3]; D] = std::array::from_fn(|axis| {
            let near = [source[axis] - self.lower[axis] <= reach, self.upper[axis] - source[axis] <= reach];
            match self.faces[axis] {
                // Behind the lower face lie the particles near the upper one.
                [Face::Periodic, _] => [true, near[1], near[0]],
                [lower, upper] => [true, lower.is_mirror() && near[0], upper.is_mirror() && near[1]],
            }
        });
        if sides.iter().all(|side| !side[1] && !side[2]) {
            return visit(Image::OWN);
        }
        let total = 3_usize.pow(D as u32);
        for number in 0..total {
            let (mut image, mut rest, mut exists) = (Image::OWN, number, true);
            for (axis, side) in sides.iter().enumerate() {
                exists &= side[rest % 3];
                image = image.with(axis, (rest % 3) as u16);
                rest /= 3;
            }
            if exists {
                visit(image);
            }
        }
    }

    /// x_p - x_q with x_q the image meant; see [`Domain`] for the expressions.
    #[inline]
    pub(crate) fn separation(&self, image: Image, target: &[f64; D], source: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| {
            let (p, q) = (target[axis], source[axis]);
            let (lower, upper) = (self.lower[axis], self.upper[axis]);
            let periodic = self.faces[axis][0] == Face::Periodic;
            match (image.side(axis), periodic) {
                (DIRECT, _) => p - q,
                (LOWER, true) => (p - q) + (upper - lower),
                (_, true) => (p - q) - (upper - lower),
                (LOWER, false) => (p - lower) + (q - lower),
                (_, false) => (p - upper) + (q - upper),
            }
        })
    }

    /// Where the image lies, up to rounding: to find it, never to measure separations.
    pub(crate) fn position(&self, image: Image, source: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| {
            let x = source[axis];
            let (lower, upper) = (self.lower[axis], self.upper[axis]);
            let periodic = self.faces[axis][0] == Face::Periodic;
            match (image.side(axis), periodic) {
                (DIRECT, _) => x,
                (LOWER, true) => x - (upper - lower),
                (_, true) => x + (upper - lower),
                (LOWER, false) => lower - (x - lower),
                (_, false) => upper - (x - upper),
            }
        })
    }

    /// The shortest way from one point of the box to another, and the image of the second it leads to.
    #[inline]
    pub(crate) fn displacement(&self, from: &[f64; D], to: &[f64; D]) -> ([f64; D], Image) {
        let (mut way, mut image) = ([0.0; D], Image::OWN);
        for axis in 0..D {
            way[axis] = to[axis] - from[axis];
            if self.faces[axis][0] == Face::Periodic {
                let width = self.upper[axis] - self.lower[axis];
                if way[axis] > 0.5 * width {
                    (way[axis], image) = (way[axis] - width, image.with(axis, LOWER));
                } else if way[axis] < -0.5 * width {
                    (way[axis], image) = (way[axis] + width, image.with(axis, UPPER));
                }
            }
        }
        (way, image)
    }

    /// -1 behind an odd number of odd mirrors, otherwise +1.
    #[inline]
    pub(crate) fn sign(&self, image: Image) -> i8 {
        let odd = (0..D).filter(|&axis| match image.side(axis) {
            DIRECT => false,
            LOWER => self.faces[axis][0] == Face::MirrorOdd,
            _ => self.faces[axis][1] == Face::MirrorOdd,
        });
        if odd.count() % 2 == 0 { 1 } else { -1 }
    }

    /// The points farther than `reach` from every face that casts images lie between these, axis by axis.
    pub(crate) fn inner(&self, reach: f64) -> [[f64; 2]; D] {
        std::array::from_fn(|axis| {
            let [lower, upper] = self.faces[axis].map(|face| face != Face::Open);
            [
                if lower { self.lower[axis] + reach } else { f64::NEG_INFINITY },
                if upper { self.upper[axis] - reach } else { f64::INFINITY },
            ]
        })
    }

    /// Whether a particle can cross a face and come back behind another.
    pub(crate) fn has_shifts(&self) -> bool {
        self.faces.iter().any(|faces| faces[0] == Face::Periodic)
    }

    /// A bound on the magnitude of every face that casts images, zero for open space.
    pub(crate) fn magnitude(&self) -> f64 {
        let faces = self.faces.iter().flatten();
        let places = self.lower.iter().zip(&self.upper).flat_map(|(lower, upper)| [lower, upper]);
        let closed = faces.zip(places).filter(|&(&face, _)| face != Face::Open);
        closed.fold(0.0, |high, (_, place)| place.abs().max(high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_a_corner_with_three_kinds_of_faces() {
        let faces = [[Face::MirrorEven, Face::Open], [Face::MirrorOdd, Face::MirrorOdd], [Face::Periodic; 2]];
        let domain = Domain::new([0.0; 3], [1.0; 3], faces).unwrap();
        let mut images = Vec::new();
        domain.for_images(&[0.1; 3], 0.2, |image| images.push(image));
        let mut found: Vec<_> =
            images.iter().map(|&image| (domain.position(image, &[0.1; 3]), domain.sign(image))).collect();
        found.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let mut expected = Vec::new();
        for x in [-0.1, 0.1] {
            for (y, sign) in [(-0.1, -1), (0.1, 1)] {
                expected.extend([0.1, 1.1].map(|z| ([x, y, z], sign)));
            }
        }
        assert_eq!(found, expected);
        assert_eq!(images.first(), Some(&Image::OWN));
    }
}
