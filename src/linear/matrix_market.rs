//! Matrices as text that other programs read.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::csr::CsrMatrix;
use crate::apply::Field;
use crate::error::{LinearError, Result};

impl<T: Field> CsrMatrix<T> {
    /// Writes the matrix in the Matrix Market format `coordinate real general`, rows and columns counted from 1.
    ///
    /// Values have 17 significant digits, which give equal bits when read back. `out` is written line by line and
    /// flushed; wrap a file in a `BufWriter`.
    ///
    /// # Errors
    /// [`LinearError::Write`] with the number of bytes taken before the writer failed.
    ///
    /// ```
    /// let mut text = Vec::new();
    /// parops::CsrMatrix::from_triplets(2, 3, [(0, 2, 0.5)])?.write_matrix_market(&mut text)?;
    /// assert_eq!(text, b"%%MatrixMarket matrix coordinate real general\n2 3 1\n1 3 5.0000000000000000e-1\n");
    /// # parops::Result::Ok(())
    /// ```
    ///
    /// Source: R. F. Boisvert, R. Pozo and K. A. Remington, The Matrix Market exchange formats, 1996.
    pub fn write_matrix_market(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        let mut out = Counted { out, bytes: 0 };
        self.write_to(&mut out).map_err(|error| LinearError::Write { kind: error.kind(), bytes: out.bytes }.into())
    }

    fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(b"%%MatrixMarket matrix coordinate real general\n")?;
        let mut line = format!("{} {} {}\n", self.rows(), self.columns(), self.entries());
        out.write_all(line.as_bytes())?;
        for (row, column, value) in self.triplets() {
            let value: f64 = value.as_();
            line.clear();
            writeln!(line, "{} {} {value:.16e}", row + 1, column + 1).map_err(io::Error::other)?;
            out.write_all(line.as_bytes())?;
        }
        out.flush()
    }
}

/// A writer that counts the bytes taken.
pub(crate) struct Counted<'a, W: ?Sized> {
    pub(crate) out: &'a mut W,
    pub(crate) bytes: u64,
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
