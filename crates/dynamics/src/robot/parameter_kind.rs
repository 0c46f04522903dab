//! Meaning of a standard parameter: its symbol and its unit.

use super::JointKind;

/// Meaning of a standard parameter.
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
    /// Fva, difference of viscous friction between the directions \[N·m·s/rad, or N·s/m\].
    FvAsymmetric,
    /// Fc, Coulomb friction of the joint \[N·m, or N\].
    Fc,
    /// Fcl, Coulomb friction per unit of the joint's static load \[1\].
    FcLoad,
    /// Fs, decrease of friction as the joint begins to move (Stribeck) \[N·m, or N\].
    Fs,
    /// Fh, friction of the joint that changes over the presliding distance after a reversal
    /// (hysteresis) \[N·m, or N\].
    Fh,
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

    /// Returns the SI unit of a parameter of this kind at a joint of the given kind. A regrouped
    /// parameter has the unit of the parameter that it is named after.
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
            (Self::FcLoad, _) => "1",
            (Self::Fc | Self::Fs | Self::Fh | Self::FcMotor | Self::Off, joint) => {
                joint.torque_unit()
            }
        }
    }

    /// Returns true for the coefficient of a [`FrictionLaw`](super::FrictionLaw).
    pub fn is_friction_law(self) -> bool {
        matches!(
            self,
            Self::FvQuadratic
                | Self::FvCubic
                | Self::FvAsymmetric
                | Self::FcLoad
                | Self::Fs
                | Self::Fh
        )
    }

    /// Returns true for the mass of a link and its first moments, on which gravity acts.
    pub fn is_heavy(self) -> bool {
        matches!(self, Self::Mx | Self::My | Self::Mz | Self::M)
    }

    /// Returns the name of the quantity: `Coulomb friction`.
    pub fn quantity(self) -> &'static str {
        match self {
            Self::Xx | Self::Xy | Self::Xz | Self::Yy | Self::Yz | Self::Zz => "inertia",
            Self::Mx | Self::My | Self::Mz => "first moment",
            Self::M => "mass",
            Self::Ia => "drive inertia",
            Self::Fv | Self::FvMotor => "viscous friction",
            Self::FvQuadratic => "quadratic friction",
            Self::FvCubic => "cubic friction",
            Self::FvAsymmetric => "difference of viscous friction by direction",
            Self::Fc | Self::FcMotor => "Coulomb friction",
            Self::FcLoad => "load-dependent Coulomb friction",
            Self::Fs => "Stribeck friction",
            Self::Fh => "hysteresis friction",
            Self::Off => "torque offset",
        }
    }

    /// Its symbol in lower case, as names of parameters have it.
    pub fn symbol(self) -> &'static str {
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
            Self::FcLoad => "fcl",
            Self::Fs => "fs",
            Self::Fh => "fh",
            Self::Off => "off",
            Self::FvMotor => "fv_m",
            Self::FcMotor => "fc_m",
        }
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

        let kinds = [ParameterKind::Ia, ParameterKind::FvMotor, ParameterKind::Off];
        assert_eq!(kinds.map(|kind| kind.unit(Revolute)), ["kg·m²", "N·m·s/rad", "N·m"]);
        assert_eq!(kinds.map(|kind| kind.unit(Prismatic)), ["kg", "N·s/m", "N"]);
        let link = ParameterKind::LINK;
        assert_eq!(link.map(|kind| kind.unit(Revolute)), link.map(|kind| kind.unit(Prismatic)));
        let [inertia, moment, mass] = ["kg·m²", "kg·m", "kg"];
        let expected = [[inertia; 3], [inertia; 3], [moment; 3]].concat();
        assert_eq!(link[..9].iter().map(|kind| kind.unit(Revolute)).collect::<Vec<_>>(), expected);
        assert_eq!(ParameterKind::M.unit(Revolute), mass);
    }
}
