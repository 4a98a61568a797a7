//! Writers that fail.

use std::io::{self, ErrorKind, Write};

/// A writer that takes so many bytes, a few at a time, and then fails: with an error, or by taking nothing.
pub struct Full {
    pub room: usize,
    pub kind: Option<ErrorKind>,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(self.room).min(7);
        self.room -= taken;
        match self.kind {
            Some(kind) if taken == 0 => Err(kind.into()),
            _ => Ok(taken),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.kind.map_or(Ok(()), |kind| Err(kind.into()))
    }
}

/// Lets `write` write `length` bytes to writers that fail at every one of them, and then at the flush: each time it must
/// say with what and after how many bytes.
pub fn check_every_byte(length: usize, write: impl Fn(&mut Full) -> parops::Result<()>) -> parops::Result<()> {
    let refused = |room: usize, kind: Option<ErrorKind>| write(&mut Full { room, kind }).unwrap_err();
    let wanted = |kind: ErrorKind, bytes: usize| parops::IoError::Write { kind, bytes: bytes as u64 }.into();
    for room in 0..length {
        for kind in [ErrorKind::StorageFull, ErrorKind::BrokenPipe] {
            assert_eq!(refused(room, Some(kind)), wanted(kind, room));
        }
        assert_eq!(refused(room, None), wanted(ErrorKind::WriteZero, room));
    }
    // All bytes are taken, and the flush fails.
    assert_eq!(refused(length, Some(ErrorKind::StorageFull)), wanted(ErrorKind::StorageFull, length));
    write(&mut Full { room: length, kind: None })
}
