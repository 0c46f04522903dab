//! Meanings of parameter names, for reports and for the manual.

use didim_dynamics::robot::ParameterKind::{self, *};
use didim_dynamics::robot::{JointIndex, Robot};

/// Returns the meaning of a kind of parameter, as a sentence.
pub fn kind_meaning(kind: ParameterKind) -> &'static str {
    match kind {
        Xx => {
            "Moment of inertia of the link about the x axis of its frame, at the origin of the \
            frame."
        }
        Xy => "Entry xy of the link's inertia matrix, minus the integral of x·y over its mass.",
        Xz => "Entry xz of the link's inertia matrix, minus the integral of x·z over its mass.",
        Yy => "Moment of inertia of the link about the y axis of its frame.",
        Yz => "Entry yz of the link's inertia matrix, minus the integral of y·z over its mass.",
        Zz => "Moment of inertia of the link about the z axis of its frame, the axis of the joint.",
        Mx => "First moment of the link along x: its mass times the x of its centre of mass.",
        My => "First moment of the link along y: its mass times the y of its centre of mass.",
        Mz => "First moment of the link along z: its mass times the z of its centre of mass.",
        M => "Mass of the link.",
        Ia => {
            "Inertia of the drive, rotor and gear, on the side of the joint: that of the rotor \
            times the square of the gear ratio."
        }
        Fv => "Viscous friction: torque for each unit of speed.",
        FvQuadratic => "Friction that grows with speed × |speed| (`quadratic = true`).",
        FvCubic => "Friction that grows with the cube of the speed (`cubic = true`).",
        FvAsymmetric => {
            "By how much viscous friction differs by direction: `fv` + `fva` forward, `fv` − `fva` \
            backward (`asymmetric = true`)."
        }
        Fc => "Coulomb friction: of constant size, against the motion.",
        FcLoad => {
            "Coulomb friction that grows with the load: as a share of the torque that the drive \
            holds where the arm rests (`load = true`)."
        }
        Fs => {
            "By how much friction at rest is above `fc`, which falls as motion begins (Stribeck; \
            `stribeck_rad_s`)."
        }
        Fh => {
            "Friction that lags: after a reversal it turns over a way, and stays the same from \
            there on (`hysteresis_rad`)."
        }
        Off => {
            "Constant torque: unequal friction in the two directions, and the offset of the \
            drive's current."
        }
        FvMotor => {
            "Viscous friction of a coupled motor, on the side of its own joint: for the speed of \
            the motor, which other joints turn too."
        }
        FcMotor => {
            "Coulomb friction of a coupled motor, on the side of its own joint: against the motion \
            of the motor, which other joints turn too."
        }
    }
}

/// Parts of a parameter name, each with its meaning.
pub const NAME_PARTS: [[&str; 2]; 4] = [
    ["`zz3`", "A symbol, and the number of the link, joint or motor, from 1 at the base."],
    [
        "`fv_m6`, `fc_m6`",
        "`_m` and the number of a motor: friction of a motor that is coupled to more than its own \
         joint, as that of joint 6 which also turns when joint 5 does. `fv6` and `fc6` are then \
         those of the joint.",
    ],
    [
        "`zz1r`",
        "`r`: regrouped. No motion tells the parameters of an arm apart one by one; it tells sums \
         of them, the base parameters. `zz1r` is `zz1` and what is regrouped with it, in the unit \
         of `zz1`. A base parameter without `r` stands for itself alone. `didim identify \
         --regrouping` prints each sum, `didim robot FILE` the base parameters.",
    ],
    [
        "essential parameters",
        "Those base parameters that a motion can tell from zero: the cell lists them \
        (`identification.parameters`), or `didim identify --essential` finds them.",
    ],
];

/// Adds the names of joints to a message that has their numbers: `joint 3 (elbow_joint)`. A number
/// that has its name already stays.
pub fn name_joints(message: &str, robot: &Robot) -> String {
    const WORD: &str = "joint ";
    let mut parts = message.split(WORD);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += WORD;
        let digits = part.bytes().take_while(u8::is_ascii_digit).count();
        let (number, rest) = part.split_at(digits);
        let joint = number.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let name = joint.and_then(|joint| robot.joint_name(JointIndex::new(joint)));
        text += number;
        match name {
            Some(name) if !rest.starts_with(" (") => text += &format!(" ({name}){rest}"),
            _ => text += rest,
        }
    }
    text
}
