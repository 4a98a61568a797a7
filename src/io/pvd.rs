//! A time series of files.

use std::io::Write;

use super::counted;
use super::xml::{Escaped, check_name};
use crate::error::{IoError, Result};

/// The files of a time series with their times, as the collection file that ParaView opens.
///
/// Names are as ParaView is to find them from the folder of the collection, times are written with the digits that read
/// back bit for bit. Written anew after every file, the collection is complete at any time.
///
/// ```
/// use parops::Pvd;
/// let (mut series, mut file) = (Pvd::new(), Vec::new());
/// series.push(0.0, "heat_0.vtu")?.push(0.125, "heat_1.vtu")?.write(&mut file)?;
/// let text = String::from_utf8_lossy(&file);
/// assert!(text.contains("<DataSet timestep=\"0.125\" group=\"\" part=\"0\" file=\"heat_1.vtu\"/>"));
/// # parops::Result::Ok(())
/// ```
///
/// Source: Kitware, ParaView data formats, PVD. See also: [`Vtu`](super::Vtu).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pvd {
    files: Vec<(f64, String)>,
}

impl Pvd {
    /// A series without files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file; a refused one changes nothing.
    ///
    /// # Errors
    /// [`IoError::Time`] for a time that is not finite or not above the last; [`IoError::Unnamed`], [`IoError::Name`] and
    /// [`IoError::Repeated`] as [`Vtu::field`](super::Vtu::field).
    pub fn push(&mut self, time: f64, file: &str) -> Result<&mut Self> {
        let last = self.files.last().map_or(f64::NEG_INFINITY, |(time, _)| *time);
        if !(time.is_finite() && time > last) {
            return Err(IoError::Time { entry: self.files.len(), time, last }.into());
        }
        check_name(file, self.files.iter().map(|(_, file)| file.as_str()))?;
        self.files.push((time, file.to_string()));
        Ok(self)
    }

    /// Writes the collection line by line and flushes `out`.
    ///
    /// # Errors
    /// [`IoError::Write`] with the number of bytes taken before the writer failed.
    pub fn write(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        counted(out, |out| {
            out.write_all(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" ")?;
            out.write_all(b"byte_order=\"LittleEndian\">\n<Collection>\n")?;
            for (time, file) in &self.files {
                let file = Escaped(file);
                let line = format!("<DataSet timestep=\"{time:?}\" group=\"\" part=\"0\" file=\"{file}\"/>\n");
                out.write_all(line.as_bytes())?;
            }
            out.write_all(b"</Collection>\n</VTKFile>\n")
        })
    }
}
