//! A motion as a file for a robot controller or for other tools. A person runs it; didim never
//! moves an arm.

mod csv;
mod error;
mod file;
mod format;
mod joint_trajectory;
mod krl;
mod rapid;
mod spline;
mod urscript;

pub use self::csv::{MotionPoints, read_motion};
pub use error::MotionError;
pub use file::MotionFile;
pub use format::MotionFormat;
