//! The standard parameters of an arm: which there are, in which order, and what they are called.

use core::fmt;

use super::{FrictionTerms, Joint, JointFriction, JointKind, Transmission};

/// What a standard parameter stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ParameterKind {
    /// XX, inertia of the link about the origin of its frame \[kg·m²\].
    Xx,
    /// XY \[kg·m²\], the entry of the inertia matrix (minus the integral of xy).
    Xy,
    /// XZ \[kg·m²\].
    Xz,
    /// YY \[kg·m²\].
    Yy,
    /// YZ \[kg·m²\].
    Yz,
    /// ZZ \[kg·m²\].
    Zz,
    /// MX, first moment of the link \[kg·m\].
    Mx,
    /// MY \[kg·m\].
    My,
    /// MZ \[kg·m\].
    Mz,
    /// M, mass of the link \[kg\].
    M,
    /// Ia, inertia of the drive on the joint side \[kg·m², or kg\].
    Ia,
    /// Fv, viscous friction of the joint \[N·m·s/rad, or N·s/m\].
    Fv,
    /// Fvq, friction of the joint with the square of its speed \[N·m·s²/rad², or N·s²/m²\].
    FvQuadratic,
    /// Fvc, friction of the joint with the cube of its speed \[N·m·s³/rad³, or N·s³/m³\].
    FvCubic,
    /// Fva, by how much viscous friction differs between the directions \[N·m·s/rad, or N·s/m\].
    FvAsymmetric,
    /// Fc, Coulomb friction of the joint \[N·m, or N\].
    Fc,
    /// Fs, by how much friction falls as the joint begins to move (Stribeck) \[N·m, or N\].
    Fs,
    /// Offset of the joint's torque \[N·m, or N\].
    Off,
    /// Viscous friction of a coupled motor, on the side of its own joint.
    FvMotor,
    /// Coulomb friction of a coupled motor, on the side of its own joint.
    FcMotor,
}

impl ParameterKind {
    /// The ten parameters of a link, in the order of the model's columns.
    pub const LINK: [Self; 10] = [
        Self::Xx,
        Self::Xy,
        Self::Xz,
        Self::Yy,
        Self::Yz,
        Self::Zz,
        Self::Mx,
        Self::My,
        Self::Mz,
        Self::M,
    ];

    /// The SI unit of a parameter of this kind at a joint of that one. One into which others are
    /// regrouped has the unit of the parameter that gives the name.
    pub fn unit(self, joint: JointKind) -> &'static str {
        use JointKind::{Prismatic, Revolute};

        match (self, joint) {
            (Self::Xx | Self::Xy | Self::Xz | Self::Yy | Self::Yz | Self::Zz, _)
            | (Self::Ia, Revolute) => "kg·m²",
            (Self::Mx | Self::My | Self::Mz, _) => "kg·m",
            (Self::M, _) | (Self::Ia, Prismatic) => "kg",
            (Self::Fv | Self::FvAsymmetric | Self::FvMotor, Revolute) => "N·m·s/rad",
            (Self::Fv | Self::FvAsymmetric | Self::FvMotor, Prismatic) => "N·s/m",
            (Self::FvQuadratic, Revolute) => "N·m·s²/rad²",
            (Self::FvQuadratic, Prismatic) => "N·s²/m²",
            (Self::FvCubic, Revolute) => "N·m·s³/rad³",
            (Self::FvCubic, Prismatic) => "N·s³/m³",
            (Self::Fc | Self::Fs | Self::FcMotor | Self::Off, joint) => joint.torque_unit(),
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::Xx => "xx",
            Self::Xy => "xy",
            Self::Xz => "xz",
            Self::Yy => "yy",
            Self::Yz => "yz",
            Self::Zz => "zz",
            Self::Mx => "mx",
            Self::My => "my",
            Self::Mz => "mz",
            Self::M => "m",
            Self::Ia => "ia",
            Self::Fv => "fv",
            Self::FvQuadratic => "fvq",
            Self::FvCubic => "fvc",
            Self::FvAsymmetric => "fva",
            Self::Fc => "fc",
            Self::Fs => "fs",
            Self::Off => "off",
            Self::FvMotor => "fv_m",
            Self::FcMotor => "fc_m",
        }
    }
}

/// One standard parameter: its kind and the joint, link or motor it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// What it stands for.
    pub kind: ParameterKind,
    /// Joint, link or motor, counted from 0 (names count from 1).
    pub joint: usize,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.kind.symbol(), self.joint + 1)
    }
}

/// The standard parameters in the order of the regressor's columns: per joint xx xy xz yy yz zz
/// mx my mz m ia fv fvq fvc fva fc fs off, then fv_m and fc_m of every coupled motor; only what the
/// robot has.
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
            Fc, FcMotor, Fs, Fv, FvAsymmetric, FvCubic, FvMotor, FvQuadratic, Ia, Off,
        };

        let mut parameters = Vec::new();
        for (joint, (has, beside)) in joints.iter().zip(own_friction).enumerate() {
            parameters.extend(ParameterKind::LINK.map(|kind| Parameter { kind, joint }));
            let law = |kind| (kind, beside.laws.iter().any(|law| law.kind() == kind));
            let own = [
                (Ia, has.drive_inertia),
                (Fv, friction.viscous),
                law(FvQuadratic),
                law(FvCubic),
                law(FvAsymmetric),
                (Fc, friction.coulomb),
                law(Fs),
                (Off, friction.offset),
            ];
            let own = own.into_iter().filter(|(_, present)| *present);
            parameters.extend(own.map(|(kind, _)| Parameter { kind, joint }));
        }
        for joint in (0..joints.len()).filter(|motor| transmission.is_coupled(*motor)) {
            let own = [(FvMotor, friction.viscous), (FcMotor, friction.coulomb)];
            let own = own.into_iter().filter(|(_, present)| *present);
            parameters.extend(own.map(|(kind, _)| Parameter { kind, joint }));
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
    pub fn column(&self, kind: ParameterKind, joint: usize) -> Option<usize> {
        self.parameters.iter().position(|p| *p == Parameter { kind, joint })
    }

    /// The column of a standard name (`zz1`) or of a base parameter's (`zz1r`), whose value
    /// stands at the column of the parameter it is named after.
    pub fn find(&self, name: &str) -> Option<usize> {
        let standard = name.strip_suffix('r').unwrap_or(name);
        self.names.iter().position(|own| own == standard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A column of the regressor times its parameter is a torque, N·m = kg·m²·rad/s², or on a
    /// sliding axis a force, N = kg·m/s²; a drive and its friction move that axis alone.
    #[test]
    fn units_follow_from_the_joint() {
        use JointKind::{Prismatic, Revolute};

        let own = [ParameterKind::Ia, ParameterKind::FvMotor, ParameterKind::Off];
        assert_eq!(own.map(|kind| kind.unit(Revolute)), ["kg·m²", "N·m·s/rad", "N·m"]);
        assert_eq!(own.map(|kind| kind.unit(Prismatic)), ["kg", "N·s/m", "N"]);
        let link = ParameterKind::LINK;
        assert_eq!(link.map(|kind| kind.unit(Revolute)), link.map(|kind| kind.unit(Prismatic)));
        let [inertia, moment, mass] = ["kg·m²", "kg·m", "kg"];
        let expected = [[inertia; 3], [inertia; 3], [moment; 3]].concat();
        assert_eq!(link[..9].iter().map(|kind| kind.unit(Revolute)).collect::<Vec<_>>(), expected);
        assert_eq!(ParameterKind::M.unit(Revolute), mass);
    }
}
