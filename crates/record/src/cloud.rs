//! States as rows of `foxglove.PointCloud`: x y z vx vy vz, then temperature, cluster and colour as the scene has them.
//!
//! Numbers are little-endian. Protobuf fields may come in any order, so the rows are written straight behind the encoded
//! rest of the message, without a copy.

use agglo_core::scene::Precision;
use agglo_core::state::{Columns, State};
use prost::Message;
use prost::encoding::{WireType, encode_key, encode_varint};

use crate::channels::Effects;
use crate::convert::{Malformed, timestamp};
use crate::proto::foxglove::packed_element_field::NumericType;
use crate::proto::foxglove::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};

/// The name of the one frame of reference.
pub const FRAME_ID: &str = "world";

/// Number of the field `data` of `foxglove.PointCloud`.
const DATA_FIELD: u32 = 6;

/// The pose at the origin.
#[must_use]
pub fn identity() -> Pose {
    Pose { position: Some(Vector3::default()), orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }) }
}

/// A recorded state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Time [s].
    pub t: f64,
    /// Step number.
    pub step: u64,
    /// Positions of the centres [m].
    pub position: Columns,
    /// Velocities [m/s].
    pub velocity: Columns,
    /// Temperatures [K]; `None` without `thermal`.
    pub temperature: Option<Vec<f64>>,
    /// Cluster of every particle, numbered by first member; `None` where clusters are not counted.
    pub cluster: Option<Vec<u32>>,
}

/// Writes states as point clouds; keeps what does not change from one to the next.
#[derive(Clone, Debug)]
pub struct CloudWriter {
    message: PointCloud,
    precision: Precision,
}

impl CloudWriter {
    /// A writer of the columns that such a scene has.
    #[must_use]
    pub fn new(effects: &Effects) -> Self {
        let float = match effects.precision {
            Precision::F64 => NumericType::Float64,
            Precision::F32 => NumericType::Float32,
        };
        let mut columns = vec![("x", float), ("y", float), ("z", float), ("vx", float), ("vy", float), ("vz", float)];
        if effects.thermal {
            columns.push(("temperature", float));
        }
        if effects.clusters {
            columns.push(("cluster", NumericType::Uint32));
        }
        if effects.markers {
            columns.extend(["red", "green", "blue", "alpha"].map(|name| (name, NumericType::Uint8)));
        }
        let mut stride = 0;
        let mut fields = Vec::with_capacity(columns.len());
        for (name, format) in columns {
            fields.push(PackedElementField { name: name.to_owned(), offset: stride, r#type: format.into() });
            stride += width(format);
        }
        let message = PointCloud {
            timestamp: None,
            frame_id: FRAME_ID.to_owned(),
            pose: Some(identity()),
            point_stride: stride,
            fields,
            data: Vec::new(),
            t: 0.0,
            step: 0,
        };
        Self { message, precision: effects.precision }
    }

    /// Length of a row [bytes].
    #[must_use]
    pub fn stride(&self) -> usize {
        self.message.point_stride as usize
    }

    /// Appends the encoded message of a state to `buffer`. `cluster` and `colors` must be there where the scene has
    /// them; all columns have the length n.
    pub fn encode(
        &mut self,
        buffer: &mut Vec<u8>,
        (t, step, log_time): (f64, u64, u64),
        state: &State,
        cluster: Option<&[u32]>,
        colors: Option<&[[u8; 4]]>,
    ) {
        self.message.t = t;
        self.message.step = step;
        self.message.timestamp = Some(timestamp(log_time));
        let length = state.position.len() * self.stride();
        // The header's length is not worth computing: it is far below this reserve.
        buffer.reserve(length + 1024);
        // Encoding into a Vec cannot run out of space.
        let _ = self.message.encode(buffer);
        encode_key(DATA_FIELD, WireType::LengthDelimited, buffer);
        encode_varint(length as u64, buffer);
        match self.precision {
            Precision::F64 => self.rows(buffer, f64::to_le_bytes, state, cluster, colors),
            Precision::F32 => self.rows(buffer, |value| (value as f32).to_le_bytes(), state, cluster, colors),
        }
    }

    /// The rows, each number made into B bytes by `bytes`.
    fn rows<const B: usize>(
        &self,
        buffer: &mut Vec<u8>,
        bytes: impl Fn(f64) -> [u8; B],
        state: &State,
        cluster: Option<&[u32]>,
        colors: Option<&[[u8; 4]]>,
    ) {
        let State { position, velocity, temperature } = state;
        let n = position.len();
        let [x, y, z] = position.axes();
        let [vx, vy, vz] = velocity.axes();
        let start = buffer.len();
        buffer.resize(start + n * self.stride(), 0);
        for (k, row) in buffer[start..].chunks_exact_mut(self.stride()).enumerate() {
            let mut rest = row;
            for column in [x, y, z, vx, vy, vz] {
                put(&mut rest, bytes(column[k]));
            }
            if let Some(temperature) = temperature {
                put(&mut rest, bytes(temperature[k]));
            }
            if let Some(cluster) = cluster {
                put(&mut rest, cluster[k].to_le_bytes());
            }
            if let Some(colors) = colors {
                put(&mut rest, colors[k]);
            }
        }
    }
}

fn put<const B: usize>(row: &mut &mut [u8], bytes: [u8; B]) {
    let (head, tail) = std::mem::take(row).split_at_mut(B);
    head.copy_from_slice(&bytes);
    *row = tail;
}

/// Bytes of a number format; 0 for one that is not known.
fn width(format: NumericType) -> u32 {
    match format {
        NumericType::Unknown => 0,
        NumericType::Uint8 | NumericType::Int8 => 1,
        NumericType::Uint16 | NumericType::Int16 => 2,
        NumericType::Uint32 | NumericType::Int32 | NumericType::Float32 => 4,
        NumericType::Float64 => 8,
    }
}

/// Reads a state back.
///
/// # Errors
/// Rows that are cut off, a column that is missing or of a format that this version does not write.
pub fn decode(message: &PointCloud) -> Result<Frame, Malformed> {
    let PointCloud { timestamp: _, frame_id: _, pose: _, point_stride, fields, data, t, step } = message;
    let stride = *point_stride as usize;
    if stride == 0 || data.len() % stride != 0 {
        return Err(Malformed(format!("a point cloud of {} bytes in rows of {stride} bytes", data.len())));
    }
    let find = |name: &str| fields.iter().find(|field| field.name == name);
    let column = |name: &str| -> Result<Vec<f64>, Malformed> {
        let field = find(name).ok_or_else(|| Malformed(format!("a point cloud without the column {name}")))?;
        let offset = field.offset as usize;
        let cells = |width| cells(data, stride, offset, width, name);
        match field.r#type() {
            NumericType::Float64 => Ok(cells(8)?.map(|cell| f64::from_le_bytes(array(cell))).collect()),
            NumericType::Float32 => Ok(cells(4)?.map(|cell| f64::from(f32::from_le_bytes(array(cell)))).collect()),
            other => Err(Malformed(format!("the column {name} of a point cloud holds {}", other.as_str_name()))),
        }
    };
    let cluster = match find("cluster") {
        None => None,
        Some(field) if field.r#type() == NumericType::Uint32 => {
            let cells = cells(data, stride, field.offset as usize, 4, "cluster")?;
            Some(cells.map(|cell| u32::from_le_bytes(array(cell))).collect())
        }
        Some(field) => {
            let held = field.r#type().as_str_name();
            return Err(Malformed(format!("the column cluster of a point cloud holds {held}")));
        }
    };
    Ok(Frame {
        t: *t,
        step: *step,
        position: Columns { x: column("x")?, y: column("y")?, z: column("z")? },
        velocity: Columns { x: column("vx")?, y: column("vy")?, z: column("vz")? },
        temperature: find("temperature").map(|_| column("temperature")).transpose()?,
        cluster,
    })
}

fn cells<'a>(
    data: &'a [u8],
    stride: usize,
    offset: usize,
    width: usize,
    name: &str,
) -> Result<impl Iterator<Item = &'a [u8]>, Malformed> {
    if offset.checked_add(width).is_none_or(|end| end > stride) {
        return Err(Malformed(format!("the column {name} reaches beyond its row of {stride} bytes")));
    }
    Ok(data.chunks_exact(stride).map(move |row| &row[offset..offset + width]))
}

/// The bytes of a cell, whose width has been checked.
fn array<const B: usize>(cell: &[u8]) -> [u8; B] {
    cell.try_into().unwrap_or([0; B])
}
