//! Bytes read as numbers: any bytes are legal, and past their end all are zero.

use crate::domain::{LENGTH_HIGH, LENGTH_LOW};
use crate::particles::COORDINATE_HIGH;

/// The bytes that are left.
#[derive(Clone, Debug)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl Bytes<'_> {
    pub(super) fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((&first, rest)) => {
                self.0 = rest;
                first
            }
            None => 0,
        }
    }

    /// One of the choices.
    pub(super) fn choose<T: Copy, const N: usize>(&mut self, choices: [T; N]) -> T {
        choices[usize::from(self.byte()) % N]
    }

    /// A whole number from 0 to `high`, itself below 256.
    pub(super) fn up_to(&mut self, high: usize) -> usize {
        usize::from(self.byte()) % (high + 1)
    }

    /// True once in so many.
    pub(super) fn once_in(&mut self, many: u8) -> bool {
        self.byte() % many == many - 1
    }

    /// A multiple of 2^-16 from 0 to 1.
    pub(super) fn fraction(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65536.0
    }

    /// Any number at all: NaN, infinities, zeros, subnormals, the ends of the legal ranges, any bits.
    pub(super) fn any(&mut self) -> f64 {
        const TABLE: [f64; 24] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            5e-324,
            -1e-310,
            f64::MIN_POSITIVE,
            1e-300,
            1e300,
            f64::MAX,
            f64::MIN,
            LENGTH_LOW,
            LENGTH_LOW.next_down(),
            LENGTH_HIGH,
            LENGTH_HIGH.next_up(),
            COORDINATE_HIGH,
            -COORDINATE_HIGH,
            COORDINATE_HIGH.next_up(),
            1e12,
            1e-12,
        ];
        let which = usize::from(self.byte());
        match TABLE.get(which % 32) {
            Some(&special) => special,
            None => f64::from_le_bytes(std::array::from_fn(|_| self.byte())),
        }
    }

    /// `tame`, or once in so many any number at all, where that is wanted.
    pub(super) fn or_any(&mut self, wild: bool, many: u8, tame: f64) -> f64 {
        if wild && self.once_in(many) { self.any() } else { tame }
    }
}
