//! A writer that counts, so that its failure can say where.

use std::io::{self, Write};

use crate::error::{IoError, Result};

/// A writer that counts the bytes taken.
pub(crate) struct Counted<'a, W: ?Sized> {
    out: &'a mut W,
    bytes: u64,
}

impl<W: Write + ?Sized> Write for Counted<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = self.out.write(bytes)?;
        self.bytes += taken as u64;
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Lets `write` write to `out`, and flushes it; a failure says after how many bytes.
pub(crate) fn counted<W: Write + ?Sized>(
    out: &mut W,
    write: impl FnOnce(&mut Counted<'_, W>) -> io::Result<()>,
) -> Result<()> {
    let mut out = Counted { out, bytes: 0 };
    let written = write(&mut out).and_then(|()| out.flush());
    written.map_err(|error| IoError::Write { kind: error.kind(), bytes: out.bytes }.into())
}
