//! Particles with fields as a file for ParaView and meshio.

use std::io::{self, Write};
use std::iter::repeat_n;

use super::base64::Base64;
use super::xml::{Escaped, check_name};
use super::{Counted, counted};
use crate::error::{Error, IoError, Result};
use crate::particles::Particles;

/// Particles and named fields on them as a VTK file, an `UnstructuredGrid` in XML with a vertex per particle.
///
/// Points have three coordinates, vectors of two components a third: what is missing is zero, as viewers expect. Numbers
/// stand in base64, little-endian, `Float64` or `Float32` as they were given, so that they are read back bit for bit.
/// D is at most 3.
///
/// ```
/// use parops::{Particles, Vtu};
/// let particles = Particles::lattice([0.0; 2], [1.0; 2], [8; 2])?;
/// let u: Vec<f64> = particles.points().iter().map(|x| x[0] * x[1]).collect();
/// let v: Vec<[f32; 2]> = vec![[1.0, -0.5]; 64];
/// let mut file = Vec::new();
/// Vtu::new(&particles).field("u", &u)?.field("v", &v)?.write(&mut file)?;
/// assert!(file.starts_with(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\""));
/// # parops::Result::Ok(())
/// ```
///
/// Source: Kitware, VTK file formats, XML section. See also: [`Pvd`](super::Pvd), a time series of such files.
#[derive(Clone, Debug)]
pub struct Vtu<'a, const D: usize> {
    particles: &'a Particles<D>,
    fields: Vec<(&'a str, VtuValues<'a>)>,
}

/// The values of a field, one per particle: slices or vectors of `f64`, `f32`, `[f64; C]` or `[f32; C]`, C >= 1.
#[derive(Clone, Copy, Debug)]
pub struct VtuValues<'a> {
    components: usize,
    numbers: Numbers<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Numbers<'a> {
    Double(&'a [f64]),
    Single(&'a [f32]),
}

impl<'a, const D: usize> Vtu<'a, D> {
    /// A file of these particles, without fields.
    pub fn new(particles: &'a Particles<D>) -> Self {
        const { assert!(D <= 3, "a VTK file has points in at most three dimensions") }
        Self { particles, fields: Vec::new() }
    }

    /// Adds a field; a refused one changes nothing.
    ///
    /// # Errors
    /// [`IoError::Unnamed`], [`IoError::Name`] and [`IoError::Repeated`] for a name that is empty, has a control
    /// character, U+FFFE or U+FFFF, or is taken; [`IoError::Length`] unless there is a value per particle;
    /// [`IoError::Value`] naming the first particle with a component that is not finite.
    pub fn field(&mut self, name: &'a str, values: impl Into<VtuValues<'a>>) -> Result<&mut Self> {
        let values = values.into();
        check_name(name, self.fields.iter().map(|(name, _)| *name))?;
        values.check(self.fields.len(), self.particles.len())?;
        self.fields.push((name, values));
        Ok(self)
    }

    /// Writes the file in pieces of a few kilobytes and flushes `out`.
    ///
    /// # Errors
    /// [`IoError::Write`] with the number of bytes taken before the writer failed.
    pub fn write(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        counted(out, |out| self.write_to(out))
    }

    fn write_to<W: Write + ?Sized>(&self, out: &mut Counted<'_, W>) -> io::Result<()> {
        let count = self.particles.len();
        out.write_all(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" ")?;
        out.write_all(b"byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n")?;
        out.write_all(format!("<Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\">\n<Points>\n").as_bytes())?;
        let points = self.particles.points();
        array(out, "Points", "Float64", 3, count, points.iter().flat_map(padded).map(f64::to_le_bytes))?;
        out.write_all(b"</Points>\n<Cells>\n")?;
        let indices = 0..count as i64;
        array(out, "connectivity", "Int64", 1, count, indices.clone().map(i64::to_le_bytes))?;
        array(out, "offsets", "Int64", 1, count, indices.map(|p| (p + 1).to_le_bytes()))?;
        array(out, "types", "UInt8", 1, count, repeat_n([VERTEX], count))?;
        out.write_all(b"</Cells>\n<PointData>\n")?;
        for (name, VtuValues { components, numbers }) in &self.fields {
            let written = if *components == 2 { 3 } else { *components };
            match numbers {
                Numbers::Double(values) => {
                    let values = values.chunks(*components).flat_map(|v| filled(v, written));
                    array(out, name, "Float64", written, count, values.map(f64::to_le_bytes))?;
                }
                Numbers::Single(values) => {
                    let values = values.chunks(*components).flat_map(|v| filled(v, written));
                    array(out, name, "Float32", written, count, values.map(f32::to_le_bytes))?;
                }
            }
        }
        out.write_all(b"</PointData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")
    }
}

/// The number VTK gives to a cell of one point.
const VERTEX: u8 = 1;

fn padded<const D: usize>(point: &[f64; D]) -> impl Iterator<Item = f64> + '_ {
    filled(point, 3)
}

/// The values, and zeros up to so many.
fn filled<T: Copy + Default>(values: &[T], count: usize) -> impl Iterator<Item = T> + '_ {
    values.iter().copied().chain(repeat_n(T::default(), count.saturating_sub(values.len())))
}

/// One array of `count` tuples, behind the number of its bytes.
fn array<const B: usize>(
    out: &mut impl Write,
    name: &str,
    kind: &str,
    components: usize,
    count: usize,
    values: impl Iterator<Item = [u8; B]>,
) -> io::Result<()> {
    let name = Escaped(name);
    let head =
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">");
    out.write_all(head.as_bytes())?;
    let mut text = Base64::new(out);
    text.put(&((count * components * B) as u64).to_le_bytes())?;
    for value in values {
        text.put(&value)?;
    }
    text.finish()?;
    out.write_all(b"</DataArray>\n")
}

impl VtuValues<'_> {
    fn check(&self, field: usize, needed: usize) -> Result<()> {
        let (length, bad) = match self.numbers {
            Numbers::Double(values) => (values.len(), first(values.iter().copied())),
            Numbers::Single(values) => (values.len(), first(values.iter().map(|&x| f64::from(x)))),
        };
        let found = length / self.components;
        if found != needed {
            return Err(IoError::Length { field, found, needed }.into());
        }
        match bad {
            Some((i, value)) => {
                let (particle, component) = (i / self.components, i % self.components);
                Err(Error::from(IoError::Value { field, component, value }).at(particle))
            }
            None => Ok(()),
        }
    }
}

/// The first value that is not finite.
fn first(values: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    values.enumerate().find(|(_, x)| !x.is_finite())
}

macro_rules! from_values {
    ($($number:ty: $variant:ident),*) => { $(
        impl<'a> From<&'a [$number]> for VtuValues<'a> {
            fn from(values: &'a [$number]) -> Self {
                Self { components: 1, numbers: Numbers::$variant(values) }
            }
        }
        impl<'a> From<&'a Vec<$number>> for VtuValues<'a> {
            fn from(values: &'a Vec<$number>) -> Self {
                values.as_slice().into()
            }
        }
        impl<'a, const C: usize> From<&'a [[$number; C]]> for VtuValues<'a> {
            fn from(values: &'a [[$number; C]]) -> Self {
                const { assert!(C > 0, "a field has at least one component") }
                Self { components: C, numbers: Numbers::$variant(values.as_flattened()) }
            }
        }
        impl<'a, const C: usize> From<&'a Vec<[$number; C]>> for VtuValues<'a> {
            fn from(values: &'a Vec<[$number; C]>) -> Self {
                values.as_slice().into()
            }
        }
    )* };
}

from_values!(f64: Double, f32: Single);
