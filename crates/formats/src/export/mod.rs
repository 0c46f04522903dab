//! Export of an arm with a value for each standard parameter to other tools.

mod left_out;
mod matlab;
mod mjcf;
mod model;
mod robot_file;
mod urdf;

pub use left_out::{ExportKind, LeftOut};
pub use matlab::to_matlab;
pub use mjcf::to_mjcf;
pub use model::{ExportError, ExportModel};
pub use robot_file::to_robot_file;
pub use urdf::to_urdf;
