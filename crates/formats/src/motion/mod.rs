//! A motion as a file that moves an arm, or that others read: what a person runs, didim never does.

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
