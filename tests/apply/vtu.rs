//! Files of particles: what a reader of its own finds in them, and what is refused.

use crate::full;
use parops::{Error, IoError, Particles, Pvd, Random, Result, Vtu, VtuValues, testing::Promise};

/// An element of a file: its name behind those around it, its attributes, and the text in it.
#[derive(Debug)]
struct Element {
    path: String,
    attributes: Vec<(String, String)>,
    text: String,
}

impl Element {
    fn get(&self, name: &str) -> &str {
        let found: Vec<&str> = self.attributes.iter().filter(|(key, _)| key == name).map(|(_, v)| v.as_str()).collect();
        assert_eq!(found.len(), 1, "{name} in {self:?}");
        found[0]
    }

    /// The tuples of an array of numbers of B bytes each.
    fn numbers<const B: usize>(&self, kind: &str) -> Vec<[u8; B]> {
        assert_eq!((self.get("type"), self.get("format")), (kind, "binary"));
        let bytes = decoded(&self.text);
        let (head, data) = bytes.split_first_chunk::<8>().unwrap();
        assert_eq!(u64::from_le_bytes(*head), data.len() as u64);
        let (numbers, rest) = data.as_chunks::<B>();
        assert!(rest.is_empty());
        numbers.to_vec()
    }

    /// Bits of doubles, tuple by tuple.
    fn doubles(&self) -> Vec<Vec<u64>> {
        let numbers: Vec<u64> = self.numbers("Float64").into_iter().map(u64::from_le_bytes).collect();
        numbers.chunks(self.get("NumberOfComponents").parse().unwrap()).map(<[u64]>::to_vec).collect()
    }

    fn singles(&self) -> Vec<Vec<u32>> {
        let numbers: Vec<u32> = self.numbers("Float32").into_iter().map(u32::from_le_bytes).collect();
        numbers.chunks(self.get("NumberOfComponents").parse().unwrap()).map(<[u32]>::to_vec).collect()
    }
}

fn decoded(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("{c} is no digit"),
    };
    let (groups, rest) = text.as_bytes().as_chunks::<4>();
    assert!(rest.is_empty());
    let mut bytes = Vec::new();
    for (i, group) in groups.iter().enumerate() {
        let padding = group.iter().filter(|&&c| c == b'=').count();
        assert!(
            padding == 0 || i + 1 == groups.len() && padding < 3 && group[4 - padding..].iter().all(|&c| c == b'=')
        );
        let digits = group.map(|c| if c == b'=' { 0 } else { u32::from(digit(c)) });
        let bits = digits.iter().fold(0, |bits, digit| bits << 6 | digit);
        bytes.extend_from_slice(&bits.to_be_bytes()[1..4 - padding]);
    }
    bytes
}

fn unescaped(text: &str) -> String {
    assert!(!text.contains(['<', '>', '"']));
    let entities = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&amp;", "&")];
    entities.iter().fold(text.to_string(), |text, (entity, c)| text.replace(entity, c))
}

/// The elements of a file in order; tags must be nested, and only arrays may hold text.
fn read(file: &[u8]) -> Vec<Element> {
    let text = std::str::from_utf8(file).unwrap().strip_prefix("<?xml version=\"1.0\"?>\n").unwrap();
    let (mut elements, mut open): (Vec<Element>, Vec<&str>) = (Vec::new(), Vec::new());
    for piece in text.split('<').skip(1) {
        let (tag, behind) = piece.split_once('>').unwrap();
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!((Some(name), behind), (open.pop(), "\n"));
            continue;
        }
        let (tag, closed) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, rest) = tag.split_once(' ').unwrap_or((tag, ""));
        assert!(name == "DataArray" || behind == "\n");
        let quoted: Vec<&str> = rest.split('"').collect();
        let pairs = quoted.as_chunks::<2>().0.iter();
        let attributes = pairs.map(|[key, v]| (key.trim().strip_suffix('=').unwrap().to_string(), unescaped(v)));
        open.push(name);
        let (path, attributes) = (open.join("/"), attributes.collect());
        elements.push(Element { path, attributes, text: behind.to_string() });
        if closed {
            open.pop();
        }
    }
    assert!(open.is_empty());
    elements
}

fn written<const D: usize>(vtu: &Vtu<D>) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    vtu.write(&mut file)?;
    Ok(file)
}

const PIECE: &str = "VTKFile/UnstructuredGrid/Piece";

/// The elements with this path below the piece.
fn below<'a>(elements: &'a [Element], path: &str) -> Vec<&'a Element> {
    elements.iter().filter(|element| element.path == format!("{PIECE}/{path}")).collect()
}

/// A set of N particles in a box around zero.
fn scattered<const D: usize>(count: usize) -> Result<Particles<D>> {
    Particles::random([-1.5; D], [2.5; D], count, 7)
}

fn structure<const D: usize>(count: usize) -> Result<()> {
    let particles = scattered::<D>(count)?;
    let elements = read(&written(&Vtu::new(&particles))?);
    let paths: Vec<&str> = elements.iter().map(|element| element.path.as_str()).collect();
    let arrays = ["Points", "Points/DataArray", "Cells", "Cells/DataArray", "Cells/DataArray", "Cells/DataArray"];
    let inner: Vec<String> = arrays.iter().chain(&["PointData"]).map(|path| format!("{PIECE}/{path}")).collect();
    let outer = ["VTKFile", "VTKFile/UnstructuredGrid", PIECE];
    assert_eq!(paths, outer.into_iter().chain(inner.iter().map(String::as_str)).collect::<Vec<_>>());

    let file = &elements[0];
    assert_eq!((file.get("type"), file.get("version")), ("UnstructuredGrid", "1.0"));
    assert_eq!((file.get("byte_order"), file.get("header_type")), ("LittleEndian", "UInt64"));
    let number = count.to_string();
    assert_eq!((elements[2].get("NumberOfPoints"), elements[2].get("NumberOfCells")), (&number[..], &number[..]));

    let bits = |x: &[f64; D]| (0..3).map(|axis| x.get(axis).copied().unwrap_or(0.0).to_bits()).collect::<Vec<_>>();
    assert_eq!(
        below(&elements, "Points/DataArray")[0].doubles(),
        particles.points().iter().map(bits).collect::<Vec<_>>()
    );
    let cells = below(&elements, "Cells/DataArray");
    assert_eq!(cells.iter().map(|cell| cell.get("Name")).collect::<Vec<_>>(), ["connectivity", "offsets", "types"]);
    let indices = |from: i64| (from..from + count as i64).map(i64::to_le_bytes).collect::<Vec<_>>();
    assert_eq!((cells[0].numbers("Int64"), cells[1].numbers("Int64")), (indices(0), indices(1)));
    assert_eq!(cells[2].numbers("UInt8"), vec![[1]; count]);
    Ok(())
}

#[test]
fn file_holds_a_vertex_per_particle_with_three_coordinates() -> Result<()> {
    // Arrays of every length modulo 3 and some longer than what is written at once.
    for count in (0..=20).chain([383, 384, 385, 3000]) {
        structure::<1>(count)?;
        structure::<2>(count)?;
        structure::<3>(count)?;
    }
    Ok(())
}

/// Numbers of all magnitudes, some of them the ends of the format.
fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let ends = [0.0, -0.0, 5e-324, f64::MIN_POSITIVE, -f64::MAX, f64::MAX, 0.1, -1.0 / 3.0];
    let mut random = Random::new(seed);
    let mut any = || (random.uniform() - 0.5) * 10_f64.powi((600.0 * random.uniform()) as i32 - 300);
    (0..count).map(|i| if i % 3 == 0 { ends[i / 3 % ends.len()] } else { any() }).collect()
}

fn tuples<const C: usize>(count: usize) -> Vec<[f64; C]> {
    numbers(C * count, C as u64).as_chunks().0.to_vec()
}

/// The bits of tuples with zeros up to `written` components.
fn bits<const C: usize>(values: &[[f64; C]], written: usize) -> Vec<Vec<u64>> {
    let bits = |v: &[f64; C]| (0..written).map(|c| v.get(c).copied().unwrap_or(0.0).to_bits()).collect();
    values.iter().map(bits).collect()
}

#[test]
fn fields_read_back_have_equal_bits() -> Result<()> {
    for count in [0, 1, 2, 3, 100, 1000] {
        let particles = scattered::<2>(count)?;
        let (scalar, vector) = (numbers(count, 5), tuples::<2>(count));
        let (one, three, nine) = (tuples::<1>(count), tuples::<3>(count), tuples::<9>(count));
        let short: Vec<f32> =
            scalar.iter().map(|&x| if x.abs() > 3e38 { f32::MIN_POSITIVE } else { x as f32 }).collect();
        let short_vector: Vec<[f32; 2]> = short.iter().map(|&x| [x, 1e-45]).collect();
        let mut vtu = Vtu::new(&particles);
        vtu.field("scalar", &scalar)?.field("vector", &vector)?.field("one", &one[..])?.field("three", &three)?;
        vtu.field("nine", &nine)?.field("short", &short)?.field("short vector", &short_vector[..])?;

        let elements = read(&written(&vtu)?);
        let fields = below(&elements, "PointData/DataArray");
        let names: Vec<&str> = fields.iter().map(|field| field.get("Name")).collect();
        assert_eq!(names, ["scalar", "vector", "one", "three", "nine", "short", "short vector"]);
        let scalars: Vec<[f64; 1]> = scalar.iter().map(|&x| [x]).collect();
        let wanted = [bits(&scalars, 1), bits(&vector, 3), bits(&one, 1), bits(&three, 3), bits(&nine, 9)];
        let same = || Promise::new("Exports", "fields read back from VTU files, bits, f64 and f32");
        for (field, wanted) in fields.iter().zip(wanted) {
            same().case(field.get("Name")).equal(&field.doubles(), &wanted);
        }
        same().equal(&fields[5].singles(), &short.iter().map(|x| vec![x.to_bits()]).collect::<Vec<_>>());
        let wanted: Vec<_> = short_vector.iter().map(|[x, y]| vec![x.to_bits(), y.to_bits(), 0]).collect();
        same().equal(&fields[6].singles(), &wanted);
    }
    Ok(())
}

#[test]
fn names_of_any_legal_characters_are_read_back() -> Result<()> {
    let (particles, ones) = (scattered::<3>(2)?, [1.0; 2]);
    let names = ["a<b>&\"c'", "&lt;", " u, v ", "\u{3b5}/h \u{1f300}", "]]>", "Points", "\u{fffd}"];
    let mut vtu = Vtu::new(&particles);
    for name in names {
        vtu.field(name, &ones[..])?;
    }
    let elements = read(&written(&vtu)?);
    let found: Vec<&str> = below(&elements, "PointData/DataArray").iter().map(|field| field.get("Name")).collect();
    assert_eq!(found, names);
    Ok(())
}

#[test]
fn refused_field_is_a_typed_error_and_leaves_the_file_as_it_was() -> Result<()> {
    let particles = scattered::<2>(4)?;
    let (u, v) = (vec![1.0; 4], vec![[0.5_f32; 3]; 4]);
    let mut vtu = Vtu::new(&particles);
    vtu.field("u", &u)?.field("v", &v)?;
    let before = written(&vtu)?;
    let refused = |name: &str, values: VtuValues| {
        let mut vtu = vtu.clone();
        let error = vtu.field(name, values).unwrap_err();
        Promise::new("Input", "refused fields leave a VTU file as it was").equal(&written(&vtu).unwrap(), &before);
        error
    };

    assert_eq!(refused("", (&u).into()), IoError::Unnamed { entry: 2 }.into());
    for character in ['\0', '\n', '\t', '\r', '\u{1b}', '\u{7f}', '\u{85}', '\u{fffe}', '\u{ffff}'] {
        let kind = IoError::Name { entry: 2, place: 2, character };
        assert_eq!(refused(&format!("\u{e9}u{character}v"), (&u).into()), kind.into());
    }
    assert_eq!(refused("v", (&u).into()), IoError::Repeated { entry: 2, first: 1 }.into());
    for found in [0, 3, 5] {
        let kind = IoError::Length { field: 2, found, needed: 4 };
        assert_eq!(refused("w", (&vec![0.0_f32; found]).into()), kind.into());
        assert_eq!(refused("w", (&vec![[0.0, 1.0]; found]).into()), kind.into());
    }
    for value in [f64::INFINITY, f64::NEG_INFINITY] {
        let at = |component: usize, p: usize| Error::from(IoError::Value { field: 2, component, value }).at(p);
        assert_eq!(refused("w", (&[0.0, 1.0, 2.0, value][..]).into()), at(0, 3));
        let single = [[0.0, 1.0], [0.0, value as f32], [value as f32, 0.0], [0.0, 1.0]];
        assert_eq!(refused("w", (&single[..]).into()), at(1, 1));
    }
    let nan = refused("w", (&[0.0, f64::NAN, 2.0, f64::NAN][..]).into());
    assert_eq!(nan.to_string(), "particle 1: component 0 of field 2 is NaN");
    Ok(())
}

#[test]
fn writer_that_fails_at_any_byte_is_a_typed_error() -> Result<()> {
    let particles = scattered::<2>(5)?;
    let (u, v) = (numbers(5, 1), vec![[0.5_f32; 2]; 5]);
    let mut vtu = Vtu::new(&particles);
    vtu.field("u", &u)?.field("v & w", &v)?;
    full::check_every_byte(written(&vtu)?.len(), |out| vtu.write(out))?;

    let mut series = Pvd::new();
    series.push(-0.5, "a&b.vtu")?.push(0.1, "c.vtu")?;
    let mut file = Vec::new();
    series.write(&mut file)?;
    full::check_every_byte(file.len(), |out| series.write(out))
}

#[test]
fn series_read_back_has_equal_times_and_names() -> Result<()> {
    let entries = [
        (-f64::MAX, "first.vtu"),
        (-1.0 / 3.0, "folder/a & b.vtu"),
        (0.0, "\"quoted\" <0>.vtu"),
        (5e-324, "\u{3b5}.vtu"),
        (0.1 + 0.2, "5.vtu"),
        (1e22, "6.vtu"),
        (f64::MAX, "last.vtu"),
    ];
    let mut series = Pvd::new();
    for (count, (time, name)) in entries.iter().enumerate() {
        let mut file = Vec::new();
        series.write(&mut file)?;
        let elements = read(&file);
        assert_eq!((elements[0].path.as_str(), elements[0].get("type")), ("VTKFile", "Collection"));
        assert_eq!(elements[1].path, "VTKFile/Collection");
        let found: Vec<(u64, &str)> = elements[2..]
            .iter()
            .map(|element| (element.get("timestep").parse::<f64>().unwrap().to_bits(), element.get("file")))
            .collect();
        assert!(elements[2..].iter().all(|element| element.path == "VTKFile/Collection/DataSet"));
        let wanted: Vec<_> = entries[..count].iter().map(|(time, name)| (time.to_bits(), *name)).collect();
        Promise::new("Exports", "times and names read back from PVD files, bits").equal(&found, &wanted);
        series.push(*time, name)?;
    }
    Ok(())
}

#[test]
fn refused_file_of_a_series_is_a_typed_error_and_leaves_it_as_it_was() -> Result<()> {
    let mut series = Pvd::new();
    assert_eq!(
        series.push(f64::INFINITY, "a.vtu").unwrap_err(),
        IoError::Time { entry: 0, time: f64::INFINITY, last: f64::NEG_INFINITY }.into()
    );
    series.push(0.0, "a.vtu")?.push(1.0, "b.vtu")?;
    let before = series.clone();
    for time in [1.0, 0.5, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(series.push(time, "c.vtu").unwrap_err(), IoError::Time { entry: 2, time, last: 1.0 }.into());
    }
    assert_eq!(series.push(f64::NAN, "c.vtu").unwrap_err().to_string(), "entry 2 has the time NaN after 1");
    assert_eq!(series.push(2.0, "").unwrap_err(), IoError::Unnamed { entry: 2 }.into());
    let kind = IoError::Name { entry: 2, place: 1, character: '\n' };
    assert_eq!(series.push(2.0, "c\n.vtu").unwrap_err(), kind.into());
    assert_eq!(series.push(2.0, "a.vtu").unwrap_err(), IoError::Repeated { entry: 2, first: 0 }.into());
    assert_eq!(series, before);
    Ok(())
}
