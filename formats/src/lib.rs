//! Files that other tools write and read: tables of measured signals, and arms.
//!
//! Contract: of the project it uses `didim-core` alone. Whatever the format, of signals a [`Measurement`] comes out:
//! signals on a uniform grid, with the side of the transmission they were measured on. Every error names
//! the file and, where there is one, the line.

mod bag;
mod columns;
mod csv;
mod measurement;
mod urdf;

pub use bag::{BagError, BagSpec, BagTime, Resampled, read_bag};
pub use columns::{AXIS, AxisColumns, Columns, INDEX, Quantity};
pub use csv::{CsvError, read_csv, write_csv};
pub use measurement::{MAX_SAMPLES, Measurement, RATE_TOLERANCE, Side};
pub use urdf::{UrdfArm, UrdfDrives, UrdfError, UrdfNote};
