//! Parameters that a format cannot hold.

use core::fmt;

use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};

use super::model::ExportModel;

/// Format of an exported arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportKind {
    /// URDF: bodies, viscous and Coulomb friction.
    Urdf,
    /// MJCF: drive inertias and coupled motors too.
    Mjcf,
    /// A list of all parameters.
    Parameters,
}

/// A part of the model that a format cannot hold, with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Name of the parameter; `None` without one.
    pub name: Option<String>,
    /// Its SI value.
    pub value: Option<f64>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Its name.
    pub quantity: &'static str,
    /// The joint or motor.
    pub joint: JointIndex,
    /// Number and name of the joint.
    pub joint_label: String,
}

impl LeftOut {
    /// Lists everything that a format omits of an arm, in the order of its parameters.
    pub fn list(model: &ExportModel<'_>, holder: ExportKind) -> Vec<Self> {
        let ExportModel { robot, standard_parameters: standard, .. } = model;
        let table = robot.parameters();
        let parameters = table.parameters().iter().zip(table.names()).zip(*standard);
        let mut omitted: Vec<Self> = parameters
            .filter_map(|((parameter, name), value)| {
                let quantity = unsupported_quantity(robot, parameter.kind, holder)?;
                let unit = parameter.kind.unit(robot.chain()[parameter.joint].kind);
                let (name, value) = (Some(name.clone()), Some(*value));
                let joint = parameter.joint;
                let joint_label = robot.joint_label(joint);
                Some(Self { name, value, unit, quantity, joint, joint_label })
            })
            .collect();
        let known_torques =
            robot.known_torques().iter().enumerate().filter(|(_, available)| available.is_some());
        omitted.extend(known_torques.map(|(joint, _)| Self {
            name: None,
            value: None,
            unit: robot.chain()[joint].kind.torque_unit(),
            quantity: "additional torque from the robot file",
            joint: JointIndex::new(joint),
            joint_label: robot.joint_label(JointIndex::new(joint)),
        }));
        omitted
    }
}

/// Describes a parameter that a format cannot hold; `None` for one that it holds.
fn unsupported_quantity(
    robot: &Robot,
    kind: ParameterKind,
    holder: ExportKind,
) -> Option<&'static str> {
    use ParameterKind::{
        FcLoad, FcMotor, Fh, Fs, FvAsymmetric, FvCubic, FvMotor, FvQuadratic, Ia, Off,
    };

    let coupled = (0..robot.joints()).any(|motor| robot.transmission().is_coupled(motor));
    match (kind, holder) {
        (_, ExportKind::Parameters) => None,
        (Ia, ExportKind::Urdf) => Some("drive inertia"),
        (FvMotor, ExportKind::Urdf) if coupled => Some("viscous friction of a coupled motor"),
        (FcMotor, ExportKind::Urdf) if coupled => Some("Coulomb friction of a coupled motor"),
        (Off, _) => Some("offset of the torque"),
        (FvQuadratic, _) => Some("viscous friction with the square of the speed"),
        (FvCubic, _) => Some("viscous friction with the cube of the speed"),
        (FvAsymmetric, _) => Some("difference of viscous friction between the directions"),
        (FcLoad, _) => Some("Coulomb friction that grows with the load"),
        (Fs, _) => Some("Stribeck friction"),
        (Fh, _) => {
            Some("the lag of friction at reversals, whose torque is in the Coulomb friction")
        }
        _ => None,
    }
}

impl LeftOut {
    /// Returns the quantity and its joint.
    pub fn subject(&self) -> String {
        format!("{}, joint {}", self.quantity, self.joint_label)
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, unit, .. } = self;
        f.write_str(&self.subject())?;
        if let (Some(name), Some(value)) = (name, value) {
            // Six significant digits, without zeros at the end.
            let rounded = format!("{value:.5e}").parse().unwrap_or(*value);
            write!(f, ": {name} = {rounded:?} {unit}")?;
        }
        Ok(())
    }
}
