//! Files of other tools: tables of measured signals, arms, models of arms, and motions.
//!
//! Contract: of the project it uses `didim-identification` alone. Signals of every format become a
//! [`Record`]: parts without gaps, each a [`Measurement`] on a uniform grid, with its side of the
//! transmission. Every error names the file and, if there is one, the line or the row.

mod bag;
mod capacity;
mod code;
mod columns;
mod disk_allocator;
mod export;
mod free_memory;
#[cfg(feature = "parquet")]
mod guarded;
mod long_table;
mod measurement;
mod missing_values;
mod motion;
mod record;
mod start;
mod table;
mod uniform;
mod urdf;
mod xml;

pub use bag::{BagContents, BagError, BagSpec, BagTime, BagTopic, list_bag, read_bag};
pub use capacity::Capacity;
pub use code::{CodeError, CodeModel, to_c, to_rust};
pub use columns::{AXIS, AxisColumns, Columns, INDEX, Quantity, TimeColumns};
pub use disk_allocator::DiskAllocator;
pub use export::{
    ExportError, ExportModel, Holder, LeftOut, to_matlab, to_mjcf, to_robot_file, to_urdf,
};
pub use long_table::{LongColumn, LongFormat, LongTableError, LongValues, read_long_table};
pub use measurement::{Measurement, RATE_TOLERANCE, Side};
pub use missing_values::{DisjointColumns, MissingValues};
pub use motion::{MotionError, MotionFile, MotionFormat, MotionPoints, read_motion};
pub use record::{Piece, Record};
pub use start::RecordingStart;
pub use table::{
    Place, Table, TableError, TableNames, is_parquet, list_table, read_csv, read_rows, read_table,
    write_csv,
};
pub use uniform::{Resampled, TimesError, mean_rate_hz};
pub use urdf::{UrdfArm, UrdfDrives, UrdfError, UrdfNote, UrdfValues, WRITTEN_BY};
