//! Errors of writing or reading a motion.

use std::path::PathBuf;

/// Why a motion cannot be written or read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MotionError {
    /// The file extension belongs to no format. Use a listed one.
    #[error(
        "a name that ends in `.{ending}` says no format; end it in .csv (table), .yaml (ROS 2), \
         .script (Universal Robots), .src (KUKA) or .mod (ABB)"
    )]
    Ending {
        /// The ending.
        ending: String,
    },
    /// Programs for this maker are only written for six revolute axes. Choose a table or a ROS 2
    /// trajectory.
    #[error(
        "a program for {maker} moves six axes that turn, and this arm has {joints} joints; write a \
         table (.csv) or a ROS 2 trajectory (.yaml)"
    )]
    SixAxes {
        /// The maker.
        maker: &'static str,
        /// Joints of the arm.
        joints: usize,
    },
    /// The spline or controller of a program does not keep the constant speeds of a sweep. Choose a
    /// table or a ROS 2 trajectory.
    #[error(
        "no program keeps the constant speeds of a sweep; write a table (.csv) or a ROS 2 \
        trajectory (.yaml)"
    )]
    Sweep,
    /// The file has no motion. Give a table as `didim design` writes it.
    #[error("{}: {problem}; give a table as `didim design` writes it", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The problem.
        problem: String,
    },
}
