//! A new URDF of an arm without one.

use std::fmt::Write as _;

use didim_dynamics::robot::ParameterKind;
use nalgebra::{IsometryMatrix3, Rotation3, Vector3};

use super::left_out::{ExportKind, LeftOut};
use super::model::{ExportError, ExportModel, is_prismatic, pose};
use crate::xml::{escape_attribute, within_comment};

/// Value of an unknown limit in a URDF, which requires one.
const UNKNOWN_LIMIT: f64 = 0.0;

/// Writes the arm as a URDF: links `base_link`, `link_1`, …, joints `joint_1`, … along z of their
/// frames. z of `world` is up.
///
/// # Errors
/// [`ExportError::NoBody`].
pub fn to_urdf(model: &ExportModel<'_>) -> Result<String, ExportError> {
    let robot = model.robot;
    let mut text = String::from("<?xml version=\"1.0\"?>\n<!--\n");
    let left_out = LeftOut::list(model, ExportKind::Urdf);
    let left_out = left_out.iter().map(|omitted| format!("left out: {omitted}"));
    let has_open_limits =
        robot.limits().any(|of| of.velocity_max.is_none() || of.torque_max.is_none());
    let open_note =
        has_open_limits.then(|| "limits of speed and effort that are 0 are not known".to_owned());
    for line in model.origin.iter().cloned().chain(left_out).chain(open_note) {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  {}", within_comment(&line));
    }
    let _ = writeln!(text, "-->\n<robot name=\"{}\">", escape_attribute(robot.name()));
    let [x, y, z] = robot.gravity_m_s2();
    let up = -Vector3::new(x, y, z);
    let standing = Rotation3::rotation_between(&up, &Vector3::z()).unwrap_or_else(|| {
        // The arm hangs upside down, or there is no gravity.
        let turn = if z > 0.0 { core::f64::consts::PI } else { 0.0 };
        Rotation3::from_axis_angle(&Vector3::x_axis(), turn)
    });
    let base = origin_element(&IsometryMatrix3::from_parts(Vector3::zeros().into(), standing));
    let _ = writeln!(
        text,
        "  <link name=\"world\"/>\n  <joint name=\"world_joint\" type=\"fixed\">\n    {base}\n    \
         <parent link=\"world\"/>\n\
         \x20   <child link=\"base_link\"/>\n  </joint>\n  <link name=\"base_link\"/>"
    );
    for (index, joint) in robot.chain().iter().enumerate() {
        let (number, limits) = (index + 1, &joint.limits);
        let body = model.body(index)?;
        let kind = if is_prismatic(joint) { "prismatic" } else { "revolute" };
        let parent = if index == 0 { "base_link".to_owned() } else { format!("link_{index}") };
        let dynamics = [
            ("damping", model.value(ParameterKind::Fv, index)),
            ("friction", model.sliding_friction(index)),
        ];
        let dynamics: String = (dynamics.into_iter())
            .filter_map(|(name, value)| Some(format!(" {name}=\"{:?}\"", value?)))
            .collect();
        let dynamics = match dynamics.is_empty() {
            true => String::new(),
            false => format!("    <dynamics{dynamics}/>\n"),
        };
        let _ = write!(
            text,
            "  <joint name=\"joint_{number}\" type=\"{kind}\">\n    {place}\n    <parent \
             link=\"{parent}\"/>\n\
             \x20   <child link=\"link_{number}\"/>\n    <axis xyz=\"0 0 1\"/>\n\
             \x20   <limit lower=\"{:?}\" upper=\"{:?}\" velocity=\"{:?}\" \
             effort=\"{:?}\"/>\n{dynamics}  </joint>\n\
             \x20 <link name=\"link_{number}\">\n    {}\n  </link>\n",
            limits.position_min,
            limits.position_max,
            limits.velocity_max.unwrap_or(UNKNOWN_LIMIT),
            limits.torque_max.unwrap_or(UNKNOWN_LIMIT),
            body.inertial_element("    "),
            place = origin_element(&pose(joint)),
        );
    }
    text.push_str("</robot>\n");
    Ok(text)
}

/// Formats an origin; roll, pitch and yaw are about fixed axes: R = Rz Ry Rx.
fn origin_element(pose: &IsometryMatrix3<f64>) -> String {
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let [x, y, z]: [f64; 3] = pose.translation.vector.into();
    format!("<origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>")
}
