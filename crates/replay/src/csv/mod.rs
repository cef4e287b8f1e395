//! Particles as CSV: `t,step,id,x,y,z,vx,vy,vz,radius,mass,charge,temperature,cluster`, those columns that the scene has.
//!
//! Numbers are written as the shortest text that reads back to the same 64 bits; what is not finite as `NaN`, `Infinity`,
//! `-Infinity`.

mod read;
mod write;

pub use read::{CsvError, read_particles};
pub(crate) use write::number;
pub use write::{Table, export};

/// All columns, in their order.
pub const COLUMNS: [&str; 14] =
    ["t", "step", "id", "x", "y", "z", "vx", "vy", "vz", "radius", "mass", "charge", "temperature", "cluster"];
