//! Bytes as base64 text, in pieces of a few kilobytes.

use std::io::{self, Write};

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Bytes held back before they are written.
const HELD: usize = 3 << 10;

/// Writes bytes to `out` as base64; [`finish`](Self::finish) writes the rest.
///
/// Source: S. Josefsson, RFC 4648, 2006, sec. 4.
pub(super) struct Base64<'a, W> {
    out: &'a mut W,
    bytes: Vec<u8>,
    text: Vec<u8>,
}

impl<'a, W: Write> Base64<'a, W> {
    pub(super) fn new(out: &'a mut W) -> Self {
        Self { out, bytes: Vec::with_capacity(2 * HELD), text: Vec::with_capacity(2 * HELD) }
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.bytes.extend_from_slice(bytes);
        if self.bytes.len() < HELD {
            return Ok(());
        }
        self.write(self.bytes.len() / 3 * 3)
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.write(self.bytes.len())
    }

    /// Writes the first so many bytes; a last group of fewer than three is padded.
    fn write(&mut self, count: usize) -> io::Result<()> {
        self.text.clear();
        for group in self.bytes.drain(..count).as_slice().chunks(3) {
            let bits = group.iter().zip([16, 8, 0]).fold(0, |bits, (&byte, shift)| bits | usize::from(byte) << shift);
            let digit = |i: usize| if i <= group.len() { ALPHABET[bits >> (18 - 6 * i) & 63] } else { b'=' };
            self.text.extend([0, 1, 2, 3].map(digit));
        }
        self.out.write_all(&self.text)
    }
}
