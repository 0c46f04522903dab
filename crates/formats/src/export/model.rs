//! Content of an export, and reasons for its failure.

use didim_dynamics::robot::{Joint, JointIndex, JointKind, ParameterKind, Robot};
use didim_identification::feasibility::Body as LinkBody;
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3};

use crate::urdf::Body;

/// Reason why an arm cannot be exported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A link has no possible body. Export consistent parameters.
    #[error("link {link} has no possible body; export consistent parameters")]
    NoBody {
        /// The joint.
        link: usize,
    },
    /// A quantity of a joint is below 0 without the share of its coupled motors, which the format
    /// cannot hold.
    #[error(
        "{quantity} of joint {joint} without that of its coupled motors is {value}, and the format \
        takes none below 0; export to another format"
    )]
    Negative {
        /// Name of the quantity.
        quantity: &'static str,
        /// The joint.
        joint: JointIndex,
        /// The remaining value.
        value: f64,
    },
    /// The file name is no valid name of a MATLAB function.
    #[error(
        "MATLAB calls a function by the name of its file, and `{name}` is not a valid name. Use at \
        most 63 letters, digits and underscores, start with a letter, and avoid keywords"
    )]
    FunctionName {
        /// Name in the file.
        name: String,
    },
    /// The robot file states its nominal values in another form than a separate table.
    #[error(
        "the robot's file states `nominal` otherwise than as a table; write it as `[nominal]`, one \
        key a line"
    )]
    NoTable,
    /// The robot file with the new values is invalid.
    #[error(
        "the robot's file does not take the new values: {problem}; write it with one key a line"
    )]
    RobotFile {
        /// The resulting fault.
        problem: String,
    },
}

/// An arm to export.
#[derive(Clone, Copy, Debug)]
pub struct ExportModel<'a> {
    /// Its geometry, drives and friction laws.
    pub robot: &'a Robot,
    /// A value for each standard parameter.
    pub standard_parameters: &'a [f64],
    /// Provenance, one entry per line.
    pub origin: &'a [String],
}

impl ExportModel<'_> {
    /// Returns the value of a parameter, if the robot has it.
    pub fn value(&self, kind: ParameterKind, joint: usize) -> Option<f64> {
        let column = self.robot.parameters().column(kind, JointIndex::new(joint))?;
        self.standard_parameters.get(column).copied()
    }

    /// Returns the Coulomb friction of a sliding joint, with hysteresis \[N·m or N\].
    pub fn sliding_friction(&self, joint: usize) -> Option<f64> {
        let lagging = self.value(ParameterKind::Fh, joint).unwrap_or_default();
        self.value(ParameterKind::Fc, joint).map(|own| own + lagging)
    }

    /// Returns the body of a link in its frame.
    pub(super) fn body(&self, link: usize) -> Result<Body, ExportError> {
        let ten = ParameterKind::LINK.map(|kind| self.value(kind, link).unwrap_or(0.0));
        let body = LinkBody::from_parameters(ten);
        let possible = body.is_possible().then(|| Body::about_centre(&body));
        possible.flatten().ok_or(ExportError::NoBody { link: link + 1 })
    }
}

/// Returns the frame of a link in that of the previous one at q = 0.
pub(super) fn pose(joint: &Joint) -> IsometryMatrix3<f64> {
    let Joint { alpha, theta, d_m, r_m, .. } = *joint;
    let about_x =
        Matrix3::new(1.0, 0.0, 0.0, 0.0, alpha.cos, -alpha.sin, 0.0, alpha.sin, alpha.cos);
    let about_z =
        Matrix3::new(theta.cos, -theta.sin, 0.0, theta.sin, theta.cos, 0.0, 0.0, 0.0, 1.0);
    let rotation = Rotation3::from_matrix_unchecked(about_x * about_z);
    let place = Translation3::new(d_m, -r_m * alpha.sin, r_m * alpha.cos);
    IsometryMatrix3::from_parts(place, rotation)
}

/// Returns true for a prismatic joint.
pub(super) fn is_prismatic(joint: &Joint) -> bool {
    joint.kind == JointKind::Prismatic
}
