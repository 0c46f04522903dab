//! The formats, by file extension.

use std::path::Path;

use super::error::MotionError;
use super::file::MotionFile;
use super::{csv, joint_trajectory, krl, rapid, urscript};

/// File format of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionFormat {
    /// Time, positions, velocities and accelerations at 500 points per second.
    Csv,
    /// `trajectory_msgs/JointTrajectory` of ROS 2 as YAML.
    JointTrajectory,
    /// A program for Universal Robots.
    UrScript,
    /// A program for KUKA; the controller chooses the speed.
    Krl,
    /// A module for ABB; the controller chooses the speed.
    Rapid,
}

impl MotionFormat {
    /// All formats with their file extensions.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Csv, "csv"),
        (Self::JointTrajectory, "yaml"),
        (Self::UrScript, "script"),
        (Self::Krl, "src"),
        (Self::Rapid, "mod"),
    ];

    /// Returns the format of a file extension.
    ///
    /// # Errors
    /// [`MotionError::Ending`].
    pub fn from_path(path: &Path) -> Result<Self, MotionError> {
        let ending = path.extension().and_then(|own| own.to_str()).unwrap_or_default();
        let matching_format =
            Self::ALL.into_iter().find(|(_, own)| own.eq_ignore_ascii_case(ending));
        matching_format
            .map(|(format, _)| format)
            .ok_or_else(|| MotionError::Ending { ending: ending.into() })
    }

    /// Returns true if the arm follows the motion in time. Otherwise the information of the motion
    /// cannot be predicted.
    pub fn keeps_time(self) -> bool {
        !matches!(self, Self::Krl | Self::Rapid)
    }

    /// Checks that the format supports this number of joints: programs have six axes.
    ///
    /// # Errors
    /// [`MotionError::SixAxes`].
    pub fn check_joint_count(self, joints: usize) -> Result<(), MotionError> {
        let maker = match self {
            Self::Csv | Self::JointTrajectory => return Ok(()),
            Self::UrScript => "Universal Robots",
            Self::Krl => "KUKA",
            Self::Rapid => "ABB",
        };
        if joints == 6 { Ok(()) } else { Err(MotionError::SixAxes { maker, joints }) }
    }

    /// Checks that the format keeps constant speeds as designed.
    ///
    /// # Errors
    /// [`MotionError::Sweep`].
    pub fn takes_sweeps(self) -> Result<(), MotionError> {
        matches!(self, Self::Csv | Self::JointTrajectory).then_some(()).ok_or(MotionError::Sweep)
    }

    /// Returns the content of the file.
    ///
    /// # Errors
    /// [`MotionError::SixAxes`], [`MotionError::Sweep`].
    pub fn write(self, file: &MotionFile<'_>, name: &str) -> Result<String, MotionError> {
        self.check_joint_count(file.motion.joints())?;
        let series = file.motion.series();
        Ok(match self {
            Self::Csv => csv::write(file),
            Self::JointTrajectory => joint_trajectory::write(file),
            Self::UrScript => urscript::write(file, series.ok_or(MotionError::Sweep)?, name),
            Self::Krl => krl::write(file, name),
            Self::Rapid => rapid::write(file, name),
        })
    }
}
