//! The standard parameters of an arm: which there are, in which order, and what they are called.

use core::fmt;

use super::{FrictionTerms, Joint, Transmission};

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
    /// Fc, Coulomb friction of the joint \[N·m, or N\].
    Fc,
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
            Self::Fc => "fc",
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
/// mx my mz m ia fv fc off, then fv_m and fc_m of every coupled motor; only what the robot has.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterTable {
    parameters: Vec<Parameter>,
    names: Vec<String>,
}

impl ParameterTable {
    pub(super) fn new(
        joints: &[Joint],
        friction: FrictionTerms,
        transmission: &Transmission,
    ) -> Self {
        use ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia, Off};

        let mut parameters = Vec::new();
        for (joint, has) in joints.iter().enumerate() {
            parameters.extend(ParameterKind::LINK.map(|kind| Parameter { kind, joint }));
            let own = [
                (Ia, has.drive_inertia),
                (Fv, friction.viscous),
                (Fc, friction.coulomb),
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
