//! An MJCF of an arm: MuJoCo's own format.

use std::fmt::Write as _;

use didim_dynamics::robot::{JointIndex, MotorIndex, ParameterKind, Robot};
use nalgebra::UnitQuaternion;

use super::left_out::{ExportKind, LeftOut};
use super::model::{ExportError, ExportModel, is_prismatic, pose};
use crate::urdf::Body;
use crate::xml::{escape_attribute, within_comment};

/// Writes the arm as MJCF: joints with `armature`, `damping` and `frictionloss`. A motor that is
/// coupled to several joints becomes a fixed tendon over them, with these attributes. Bodies and
/// joints have the names of the robot's links and joints. Each drive is an actuator, whose control
/// is the torque on the side of the joint \[N·m or N\].
///
/// # Errors
/// [`ExportError`].
pub fn to_mjcf(model: &ExportModel<'_>) -> Result<String, ExportError> {
    let robot = model.robot;
    let mut text = String::from("<!--\n");
    let left_out = LeftOut::list(model, ExportKind::Mjcf);
    let left_out = left_out.iter().map(|omitted| format!("left out: {omitted}"));
    for line in model.origin.iter().cloned().chain(left_out) {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  {}", within_comment(&line));
    }
    let [x, y, z] = robot.gravity_m_s2();
    let _ = writeln!(
        text,
        "-->\n<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"true\" \
         balanceinertia=\"false\"/>\n\
         \x20 <option gravity=\"{x:?} {y:?} {z:?}\"/>\n  <worldbody>",
        escape_attribute(robot.name())
    );
    for (index, joint) in robot.chain().iter().enumerate() {
        let (tab, name) = ("  ".repeat(index + 2), joint_name(robot, index));
        let link = robot.link_name(JointIndex::new(index));
        let link = link.map_or_else(|| format!("link_{}", index + 1), escape_attribute);
        let Body { mass_kg, centre_m, inertia_kg_m2 } = model.body(index)?;
        let pose = pose(joint);
        let [x, y, z]: [f64; 3] = pose.translation.vector.into();
        let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let kind = if is_prismatic(joint) { "slide" } else { "hinge" };
        let [low, high] = [joint.limits.position_min, joint.limits.position_max];
        let drive: String = own_drive(model, index)?
            .into_iter()
            .map(|(name, value)| format!(" {name}=\"{value:?}\""))
            .collect();
        let force = joint.limits.torque_max;
        let force = force
            .map_or_else(String::new, |most| format!(" actuatorfrcrange=\"{:?} {most:?}\"", -most));
        let j = |row, column| inertia_kg_m2[(row, column)];
        let _ = writeln!(
            text,
            "{tab}<body name=\"{link}\" pos=\"{x:?} {y:?} {z:?}\" quat=\"{:?} {:?} {:?} \
             {:?}\">\n\
             {tab}  <inertial pos=\"{:?} {:?} {:?}\" mass=\"{:?}\" fullinertia=\"{:?} {:?} {:?} \
             {:?} {:?} {:?}\"/>\n\
             {tab}  <joint name=\"{name}\" type=\"{kind}\" axis=\"0 0 1\" range=\"{low:?} \
             {high:?}\"{force}{drive}/>",
            q.w,
            q.i,
            q.j,
            q.k,
            centre_m.x,
            centre_m.y,
            centre_m.z,
            mass_kg,
            j(0, 0),
            j(1, 1),
            j(2, 2),
            j(0, 1),
            j(0, 2),
            j(1, 2),
        );
    }
    for index in (0..robot.joints()).rev() {
        let _ = writeln!(text, "{}</body>", "  ".repeat(index + 2));
    }
    text.push_str("  </worldbody>\n");
    text.push_str(&tendon_section(model));
    text.push_str(&actuator_section(robot));
    text.push_str("</mujoco>\n");
    Ok(text)
}

/// Returns inertia and friction of a joint's own drive, without the share of coupled motors: the
/// model counts the squares of their couplings with the joint (see the drives of
/// `didim_dynamics::dynamics`).
fn own_drive(
    model: &ExportModel<'_>,
    joint: usize,
) -> Result<Vec<(&'static str, f64)>, ExportError> {
    let robot = model.robot;
    let transmission = robot.transmission();
    let of_motors = |kind, with_own: bool| -> f64 {
        let coupled = (0..robot.joints()).filter(|motor| transmission.is_coupled(*motor));
        let coupled = coupled.filter(|motor| with_own || *motor != joint);
        let share = |motor: usize| transmission.direction(motor)[joint].powi(2);
        coupled.map(|motor| share(motor) * model.value(kind, motor).unwrap_or(0.0)).sum()
    };
    let mut attributes = Vec::new();
    // The inertia of a coupled motor is completely in its tendon.
    if !transmission.is_coupled(joint)
        && let Some(inertia) = model.value(ParameterKind::Ia, joint)
    {
        let remainder = inertia - of_motors(ParameterKind::Ia, false);
        attributes.push(("armature", "the drive inertia", remainder));
    }
    if let Some(viscous) = model.value(ParameterKind::Fv, joint) {
        let remainder = viscous - of_motors(ParameterKind::FvMotor, true);
        attributes.push(("damping", "the viscous friction", remainder));
    }
    if let Some(coulomb) = model.sliding_friction(joint) {
        attributes.push(("frictionloss", "the Coulomb friction", coulomb));
    }
    attributes
        .into_iter()
        .map(|(name, quantity, value)| match value < 0.0 {
            true => Err(ExportError::Negative { quantity, joint: JointIndex::new(joint), value }),
            false => Ok((name, value)),
        })
        .collect()
}

/// Writes the tendons: a coupled motor moves with a combination of joints.
fn tendon_section(model: &ExportModel<'_>) -> String {
    let robot = model.robot;
    let mut text = String::new();
    for motor in (0..robot.joints()).filter(|motor| robot.transmission().is_coupled(*motor)) {
        let motor_terms = [
            ("armature", ParameterKind::Ia),
            ("damping", ParameterKind::FvMotor),
            ("frictionloss", ParameterKind::FcMotor),
        ];
        let attributes = motor_terms.iter().filter_map(|(name, kind)| {
            model.value(*kind, motor).map(|value| format!(" {name}=\"{value:?}\""))
        });
        let number = MotorIndex::new(motor);
        // Writing to a String cannot fail.
        let _ =
            writeln!(text, "    <fixed name=\"motor_{number}\"{}>", attributes.collect::<String>());
        let direction = robot.transmission().direction(motor);
        for (joint, share) in direction.iter().enumerate().filter(|(_, share)| **share != 0.0) {
            let joint = joint_name(robot, joint);
            let _ = writeln!(text, "      <joint joint=\"{joint}\" coef=\"{share:?}\"/>");
        }
        text.push_str("    </fixed>\n");
    }
    if text.is_empty() { text } else { format!("  <tendon>\n{text}  </tendon>\n") }
}

/// Writes the drives: a motor on its joint, or on the tendon of a coupled motor.
fn actuator_section(robot: &Robot) -> String {
    let mut text = String::from("  <actuator>\n");
    for (index, joint) in robot.chain().iter().enumerate() {
        let name = joint_name(robot, index);
        let transmission = match robot.transmission().is_coupled(index) {
            true => format!("tendon=\"motor_{}\"", MotorIndex::new(index)),
            false => format!("joint=\"{name}\""),
        };
        let range =
            joint.limits.torque_max.map(|most| format!(" ctrlrange=\"{:?} {most:?}\"", -most));
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "    <motor name=\"{name}\" {transmission}{}/>",
            range.unwrap_or_default()
        );
    }
    text + "  </actuator>\n"
}

/// Returns the name of a joint, as an attribute.
fn joint_name(robot: &Robot, joint: usize) -> String {
    let name = robot.joint_name(JointIndex::new(joint));
    name.map_or_else(|| format!("joint_{}", joint + 1), escape_attribute)
}
