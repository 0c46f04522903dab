//! The standard parameters of an arm: their order and their names.

use core::fmt;

use super::{FrictionTerms, Joint, JointFriction, JointIndex, ParameterKind, Transmission};

/// One standard parameter: its kind and the joint, link or motor it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its meaning.
    pub kind: ParameterKind,
    /// Joint, link or motor.
    pub joint: JointIndex,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.kind.symbol(), self.joint)
    }
}

/// The standard parameters in the order of the regressor's columns: per joint xx xy xz yy yz zz
/// mx my mz m ia fv fvq fvc fva fc fcl fs fh off, then fv_m and fc_m of every coupled motor; only
/// what the robot has.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterTable {
    parameters: Vec<Parameter>,
    names: Vec<String>,
}

impl ParameterTable {
    pub(super) fn new(
        joints: &[Joint],
        friction: FrictionTerms,
        own_friction: &[JointFriction],
        transmission: &Transmission,
    ) -> Self {
        use ParameterKind::{
            Fc, FcLoad, FcMotor, Fh, Fs, Fv, FvAsymmetric, FvCubic, FvMotor, FvQuadratic, Ia, Off,
        };

        let mut parameters = Vec::new();
        for (joint, (has, laws)) in joints.iter().zip(own_friction).enumerate() {
            let joint = JointIndex::new(joint);
            parameters.extend(ParameterKind::LINK.map(|kind| Parameter { kind, joint }));
            let law = |kind| (kind, laws.laws.iter().any(|law| law.kind() == kind));
            let drive_kinds = [
                (Ia, has.drive_inertia),
                (Fv, friction.viscous),
                law(FvQuadratic),
                law(FvCubic),
                law(FvAsymmetric),
                (Fc, friction.coulomb),
                law(FcLoad),
                law(Fs),
                law(Fh),
                (Off, friction.offset),
            ];
            let drive_kinds = drive_kinds.into_iter().filter(|(_, present)| *present);
            parameters.extend(drive_kinds.map(|(kind, _)| Parameter { kind, joint }));
        }
        for joint in (0..joints.len()).filter(|motor| transmission.is_coupled(*motor)) {
            let motor_kinds = [(FvMotor, friction.viscous), (FcMotor, friction.coulomb)];
            let motor_kinds = motor_kinds.into_iter().filter(|(_, present)| *present);
            parameters.extend(
                motor_kinds.map(|(kind, _)| Parameter { kind, joint: JointIndex::new(joint) }),
            );
        }
        let names = parameters.iter().map(Parameter::to_string).collect();
        Self { parameters, names }
    }

    /// The parameters by column.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Their names by column.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The column of a parameter that the robot has.
    pub fn column(&self, kind: ParameterKind, joint: JointIndex) -> Option<usize> {
        self.parameters.iter().position(|p| *p == Parameter { kind, joint })
    }

    /// The column of a standard name (`zz1`) or of a base parameter's (`zz1r`), whose column is
    /// that of the parameter it is named after.
    pub fn find(&self, name: &str) -> Option<usize> {
        let standard = name.strip_suffix('r').unwrap_or(name);
        self.names.iter().position(|own| own == standard)
    }
}
