//! Numbers in sentences: the very large and the very small as powers of ten, not as rows of zeros.

use std::fmt;

/// A value as the sentence of an error shows it.
pub(super) trait Shown: Copy {
    /// What is written for it.
    type As: Copy;

    fn shown(self) -> Self::As;
}

/// An `f64` that is written as 0.25 from 1e-5 up to 1e16, and as 2.5e-7 beyond.
#[derive(Clone, Copy)]
pub(super) struct Number(f64);

impl Shown for f64 {
    type As = Number;

    fn shown(self) -> Number {
        Number(self)
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0.0 => fmt::Display::fmt(&self.0, f),
            value if (1e-5..1e16).contains(&value.abs()) => fmt::Display::fmt(&value, f),
            value => fmt::LowerExp::fmt(&value, f),
        }
    }
}

impl fmt::LowerExp for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::LowerExp::fmt(&self.0, f)
    }
}

impl fmt::Debug for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.0, f)
    }
}

impl<const N: usize> Shown for [f64; N] {
    type As = [Number; N];

    fn shown(self) -> [Number; N] {
        self.map(Number)
    }
}

/// What is written as it is.
macro_rules! plain {
    ($($name:ty),* $(,)?) => { $(
        impl Shown for $name {
            type As = Self;

            fn shown(self) -> Self {
                self
            }
        }
    )* };
}

plain!(usize, u32, u64, i8, char, &'static str, [usize; 2], std::io::ErrorKind, crate::stencil::Side, super::Limit);
