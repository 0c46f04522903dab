//! Files of other tools: tables of measured signals, arms, models of arms, and motions.
//!
//! Contract: of the project it uses `didim-identification` alone. Signals of every format become a
//! [`Record`]: parts without gaps, each a [`Measurement`] on a uniform grid, with its side of the
//! transmission. Every error names the file and, if there is one, the line or the row.
//!
//! # Examples
//! An arm from a URDF, and its inverse dynamics:
//! ```
//! use didim_dynamics::dynamics::{Model, Workspace};
//! use didim_dynamics::robot::Robot;
//! use didim_formats::{UrdfArm, UrdfDrives};
//!
//! let urdf = r#"<robot name="pendulum">
//!   <link name="base"/>
//!   <link name="link"><inertial>
//!     <origin xyz="0.5 0 0"/><mass value="4"/>
//!     <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
//!   </inertial></link>
//!   <joint name="hinge" type="revolute">
//!     <parent link="base"/><child link="link"/><axis xyz="0 1 0"/>
//!     <limit lower="-2" upper="2" velocity="5" effort="50"/>
//!   </joint>
//! </robot>"#;
//! let arm = UrdfArm::read(urdf, None, None)?;
//! let robot = Robot::from_toml(&arm.to_toml(&UrdfDrives::with_assumed_drives(arm.joints())))?;
//! let nominal = robot.nominal().ok_or("a link has no body")?;
//!
//! let mut torque_nm = [0.0];
//! Model::new(&robot).inverse_dynamics(
//!     &mut Workspace::new(),
//!     nominal.standard_parameters(),
//!     &[0.0], // rad
//!     &[0.0], // rad/s
//!     &[0.0], // rad/s²
//!     &mut torque_nm,
//! );
//! // The axis points along y: a positive torque lowers the link.
//! // A negative torque holds it.
//! assert!((torque_nm[0] + 4.0 * 9.81 * 0.5).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A table of signals, with the columns that didim writes itself:
//! ```
//! use didim_formats::{Side, read_csv};
//!
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join("recording.csv");
//! std::fs::write(
//!     &file,
//!     "time_s,motor_position_rad_1,motor_torque_nm_1
//! 0.000,0.1,2.0
//! 0.001,0.2,2.1
//! 0.002,0.3,2.2
//! ",
//! )?;
//! let recording = read_csv(&file, None)?;
//! assert_eq!(recording.side, Side::Motor);
//! assert_eq!(recording.signals.position_rad, [[0.1, 0.2, 0.3]]);
//! assert!((recording.signals.sample_rate_hz - 1000.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bag;
mod capacity;
mod code;
mod columns;
mod container;
mod export;
mod free_memory;
mod guarded;
mod long_table;
mod measurement;
mod mesh;
mod missing_values;
mod motion;
mod record;
mod row_times;
mod start;
mod table;
mod text_kind;
mod time_limits;
mod uniform;
mod urdf;
mod xml;

pub use bag::{BagContents, BagError, BagSpec, BagTime, BagTopic, is_sqlite, list_bag, read_bag};
pub use capacity::Capacity;
pub use code::{CodeError, CodeModel, to_c, to_rust};
pub use columns::{
    AXIS_PLACEHOLDER, AxisColumns, AxisCorrections, Columns, INDEX_PLACEHOLDER, OwnColumns,
    Quantity, TableColumns, TimeColumns, unwrap_turns,
};
pub use container::foreign_container;
pub use export::{
    ExportError, ExportKind, ExportModel, LeftOut, to_matlab, to_mjcf, to_robot_file, to_urdf,
};
pub use long_table::{
    LongColumn, LongFormat, LongTable, LongTableError, LongValues, read_long_table,
};
pub use measurement::{Measurement, Side};
pub use mesh::{MeshError, MeshFolders};
pub use missing_values::{DisjointColumns, MissingValues};
pub use motion::{MotionError, MotionFile, MotionFormat, MotionPoints, read_motion};
pub use record::{Piece, Record};
pub use row_times::{join_times, mean_rate_hz};
pub use start::RecordingStart;
pub use table::{
    RowPlace, SignalArrays, Table, TableError, TableNames, is_gzip, is_parquet, list_names,
    list_table, own_side, read_csv, read_rows, read_table, write_csv,
};
pub use text_kind::TextKind;
pub use time_limits::TimeLimits;
pub use uniform::{Resampled, TimesError};
pub use urdf::{
    UnreadAttribute, UrdfArm, UrdfDrives, UrdfError, UrdfGeometry, UrdfNote, UrdfShape, UrdfValues,
    WRITTEN_BY,
};
