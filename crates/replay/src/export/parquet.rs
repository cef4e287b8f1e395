//! Parquet: the columns of the CSV, for pandas, polars and the like.

use std::io::Write;
use std::sync::Arc;

use ::parquet::basic::{Compression, Repetition, Type as Physical, ZstdLevel};
use ::parquet::data_type::{DataType, DoubleType, Int32Type, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::Type;
use agglo_core::state::Particles;
use agglo_record::cloud::Frame;

use super::ExportError;

/// Rows after which a row group is closed, at the end of a state: readers take one at a time.
const GROUP: usize = 1 << 17;

impl From<ParquetError> for ExportError {
    fn from(error: ParquetError) -> Self {
        // What it wraps tells a full disk from other failures.
        Self::Write(match error {
            ParquetError::External(source) => match source.downcast::<std::io::Error>() {
                Ok(error) => *error,
                Err(other) => std::io::Error::other(other.to_string()),
            },
            other => std::io::Error::other(other.to_string()),
        })
    }
}

/// The rows of a row group.
#[derive(Debug, Default)]
struct Columns {
    t: Vec<f64>,
    step: Vec<i64>,
    id: Vec<i32>,
    /// x y z vx vy vz radius mass, and charge and temperature as the scene has them.
    reals: Vec<Vec<f64>>,
    cluster: Vec<i32>,
}

/// Writes states one behind the other.
pub struct ParquetWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    rows: Columns,
    clusters: bool,
}

impl<W: Write + Send> ParquetWriter<W> {
    /// Starts a file; its columns are those of the first state.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn new(out: W, first: &Frame, particles: &Particles) -> Result<Self, ExportError> {
        let mut reals = vec!["x", "y", "z", "vx", "vy", "vz", "radius", "mass"];
        reals.extend(particles.charge.is_some().then_some("charge"));
        reals.extend(first.temperature.is_some().then_some("temperature"));
        let clusters = first.cluster.is_some();
        let field = |name: &str, kind| {
            Type::primitive_type_builder(name, kind).with_repetition(Repetition::REQUIRED).build().map(Arc::new)
        };
        let mut fields =
            vec![field("t", Physical::DOUBLE)?, field("step", Physical::INT64)?, field("id", Physical::INT32)?];
        for name in &reals {
            fields.push(field(name, Physical::DOUBLE)?);
        }
        if clusters {
            fields.push(field("cluster", Physical::INT32)?);
        }
        let schema = Arc::new(Type::group_type_builder("particles").with_fields(fields).build()?);
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
            .set_created_by("agglo".to_owned())
            .build();
        let file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
        let rows = Columns { reals: vec![Vec::new(); reals.len()], ..Columns::default() };
        Ok(Self { file, rows, clusters })
    }

    /// Writes a state; returns the number of rows.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn write(&mut self, frame: &Frame, particles: &Particles) -> Result<u64, ExportError> {
        let Frame { t, step, position, velocity, temperature, cluster } = frame;
        let Particles { radius, mass, charge } = particles;
        let n = position.len().min(radius.len());
        let rows = &mut self.rows;
        rows.t.resize(rows.t.len() + n, *t);
        rows.step.resize(rows.step.len() + n, *step as i64);
        rows.id.extend(0..n as i32);
        let columns = position.axes().into_iter().chain(velocity.axes()).chain([&radius[..], &mass[..]]);
        let extra = [charge, temperature].into_iter().flatten().map(|column| &column[..]);
        for (to, from) in rows.reals.iter_mut().zip(columns.chain(extra)) {
            to.extend_from_slice(&from[..n]);
        }
        if self.clusters {
            rows.cluster.extend(cluster.iter().flatten().take(n).map(|&number| number as i32));
            rows.cluster.resize(rows.t.len(), -1);
        }
        if rows.t.len() >= GROUP {
            self.close_group()?;
        }
        Ok(n as u64)
    }

    fn close_group(&mut self) -> Result<(), ExportError> {
        let rows = &mut self.rows;
        let mut group = self.file.next_row_group()?;
        column::<DoubleType, W>(&mut group, &mut rows.t)?;
        column::<Int64Type, W>(&mut group, &mut rows.step)?;
        column::<Int32Type, W>(&mut group, &mut rows.id)?;
        for values in &mut rows.reals {
            column::<DoubleType, W>(&mut group, values)?;
        }
        if self.clusters {
            column::<Int32Type, W>(&mut group, &mut rows.cluster)?;
        }
        group.close()?;
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn finish(mut self) -> Result<(), ExportError> {
        if !self.rows.t.is_empty() {
            self.close_group()?;
        }
        let mut out = self.file.into_inner()?;
        Ok(out.flush()?)
    }
}

/// Writes the next column of a row group.
fn column<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &mut Vec<T::T>,
) -> Result<(), ExportError> {
    if let Some(mut writer) = group.next_column()? {
        writer.typed::<T>().write_batch(values, None, None)?;
        writer.close()?;
    }
    values.clear();
    Ok(())
}
