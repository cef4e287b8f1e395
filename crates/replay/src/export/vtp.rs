//! VTK's XML PolyData (`.vtp`), a file per state, and the collection (`.pvd`) that lists them with their times. Opens in
//! ParaView, PyVista and OVITO.

use std::io::Write;

use agglo_core::state::{Columns, Particles};
use agglo_record::cloud::Frame;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::ExportError;

/// An array of a file: its name, type, components, and little-endian values.
struct Array<'a> {
    name: &'a str,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

impl<'a> Array<'a> {
    fn reals(name: &'a str, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self { name, kind: "Float64", components: 1, bytes }
    }

    fn vectors(name: &'a str, columns: &Columns, n: usize) -> Self {
        let bytes = (0..n).flat_map(|k| columns.axes().map(|axis| axis[k].to_le_bytes())).flatten().collect();
        Self { name, kind: "Float64", components: 3, bytes }
    }

    fn integers(name: &'a str, values: impl Iterator<Item = i64>) -> Self {
        Self { name, kind: "Int64", components: 1, bytes: values.flat_map(i64::to_le_bytes).collect() }
    }

    /// Its element, values in base64 behind their length.
    fn write<W: Write>(&self, writer: &mut Writer<W>) -> std::io::Result<()> {
        let mut packed = (self.bytes.len() as u64).to_le_bytes().to_vec();
        packed.extend_from_slice(&self.bytes);
        let text = STANDARD.encode(packed);
        let components = self.components.to_string();
        let attributes = [
            ("type", self.kind),
            ("Name", self.name),
            ("NumberOfComponents", components.as_str()),
            ("format", "binary"),
        ];
        let element = writer.create_element("DataArray").with_attributes(attributes);
        element.write_text_content(BytesText::from_escaped(text)).map(drop)
    }
}

/// Writes a state as PolyData: a vertex per particle, with velocity, radius, mass and what else the scene has. Returns the
/// number of particles.
///
/// # Errors
/// An output that refuses bytes.
pub fn write(out: impl Write, frame: &Frame, particles: &Particles) -> Result<u64, ExportError> {
    let Frame { t, step, position, velocity, temperature, cluster } = frame;
    let Particles { radius, mass, charge } = particles;
    let n = position.len().min(radius.len());
    let mut columns = vec![
        Array::reals("radius", &radius[..n]),
        Array::reals("mass", &mass[..n]),
        Array::vectors("velocity", velocity, n),
    ];
    for (name, column) in [("charge", charge), ("temperature", temperature)] {
        columns.extend(column.as_ref().map(|column| Array::reals(name, &column[..n])));
    }
    columns.extend(cluster.as_ref().map(|of| Array::integers("cluster", of[..n].iter().map(|&c| c.into()))));
    columns.push(Array::integers("id", 0..n as i64));

    let mut writer = Writer::new(out);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
    let root = [("type", "PolyData"), ("version", "1.0"), ("byte_order", "LittleEndian"), ("header_type", "UInt64")];
    writer.create_element("VTKFile").with_attributes(root).write_inner_content(|writer| {
        writer.create_element("PolyData").write_inner_content(|writer| {
            let count = n.to_string();
            let piece = [
                ("NumberOfPoints", count.as_str()),
                ("NumberOfVerts", count.as_str()),
                ("NumberOfLines", "0"),
                ("NumberOfStrips", "0"),
                ("NumberOfPolys", "0"),
            ];
            writer.create_element("Piece").with_attributes(piece).write_inner_content(|writer| {
                let scalars = if temperature.is_some() { "temperature" } else { "radius" };
                let active = [("Scalars", scalars), ("Vectors", "velocity")];
                writer
                    .create_element("PointData")
                    .with_attributes(active)
                    .write_inner_content(|writer| columns.iter().try_for_each(|array| array.write(writer)))?;
                writer
                    .create_element("Points")
                    .write_inner_content(|writer| Array::vectors("Points", position, n).write(writer))?;
                writer.create_element("Verts").write_inner_content(|writer| {
                    Array::integers("connectivity", 0..n as i64).write(writer)?;
                    Array::integers("offsets", 1..=n as i64).write(writer)
                })?;
                Ok(())
            })?;
            // Behind the particles: OVITO does not recognise files that begin with it.
            writer.create_element("FieldData").write_inner_content(|writer| {
                Array::reals("TimeValue", &[*t]).write_field(writer)?;
                Array::integers("Step", std::iter::once(*step as i64)).write_field(writer)
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    writer.into_inner().flush()?;
    Ok(n as u64)
}

impl Array<'_> {
    /// The element of a value of the whole file.
    fn write_field<W: Write>(&self, writer: &mut Writer<W>) -> std::io::Result<()> {
        let mut packed = (self.bytes.len() as u64).to_le_bytes().to_vec();
        packed.extend_from_slice(&self.bytes);
        let attributes = [("type", self.kind), ("Name", self.name), ("NumberOfTuples", "1"), ("format", "binary")];
        let element = writer.create_element("DataArray").with_attributes(attributes);
        element.write_text_content(BytesText::from_escaped(STANDARD.encode(packed))).map(drop)
    }
}

/// Writes the collection of files, each with its time [s].
///
/// # Errors
/// An output that refuses bytes.
pub fn write_collection(out: impl Write, files: &[(f64, String)]) -> Result<(), ExportError> {
    let mut writer = Writer::new_with_indent(out, b' ', 2);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
    let root = [("type", "Collection"), ("version", "1.0"), ("byte_order", "LittleEndian")];
    writer.create_element("VTKFile").with_attributes(root).write_inner_content(|writer| {
        writer.create_element("Collection").write_inner_content(|writer| {
            for (t, file) in files {
                let time = format!("{t:?}");
                let attributes = [("timestep", time.as_str()), ("part", "0"), ("file", file.as_str())];
                writer.create_element("DataSet").with_attributes(attributes).write_empty()?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    let mut out = writer.into_inner();
    writeln!(out)?;
    Ok(out.flush()?)
}
