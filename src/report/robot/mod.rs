//! Description of an arm from its robot file. It is made so that people notice a wrong sign.

mod picture;
mod postures;

use didim_dynamics::dynamics::{BaseParameters, LinkFrame, Model};
use didim_dynamics::robot::{Joint, JointKind, ParameterKind, Robot};

use crate::cell::RobotSource;
use crate::text::{align_table, significant_digits};

pub use picture::picture;
pub use postures::draw_postures;

/// Maximum length of a base parameter's sum in the output, in characters.
const MAX_SUM_LENGTH: usize = 100;

/// Describes axes, tip, reach, masses and base parameters, with notes on the arm.
pub fn robot_description(source: &RobotSource, base: &BaseParameters) -> String {
    let robot = &source.robot;
    let frames = Model::new(robot).link_frames(&[]);
    let mut text = heading(source);
    text += &axes_table(source, &frames);
    text += &format!(
        "\nAt q = 0, in the base's frame: origins and directions of the axes. {}\n",
        match &source.urdf {
            Some(_) => "The base's frame is that of the first joint.",
            None => "Gravity says where up is.",
        }
    );
    if let Some(last) = frames.last() {
        text += &format!("origin of the last link's frame   {} m\n", three_numbers(last.origin_m));
    }
    if let Some(arm) = &source.urdf {
        let [from, tip] = arm.base_and_tip();
        text +=
            &format!("{tip} in the frame of {from}   {} m\n", three_numbers(arm.tip_position_m()));
    }
    text += &format!(
        "reach from the second axis        {} m at most\n",
        significant_digits(stretched_length(robot), 3)
    );
    if let Some(nominal) = robot.nominal() {
        let mass = robot.parameters().parameters().iter().zip(nominal.standard_parameters());
        let masses = mass.filter(|(parameter, _)| parameter.kind == ParameterKind::M);
        let total: f64 = masses.map(|(_, mass)| mass).sum();
        if total > 0.0 {
            text += &format!(
                "mass that moves                   {} kg (nominal)\n",
                significant_digits(total, 4)
            );
        }
    }
    text += &format!("\n{} base parameters:\n", base.names().len());
    for name in base.names() {
        let sum = base.expression(name).unwrap_or_default();
        text += &match sum == *name {
            true => format!("  {name}\n"),
            false => format!("  {name} = {}\n", shorten(&sum)),
        };
    }
    for note in source.notes() {
        text += &format!("note: {note}\n");
    }
    text
}

fn heading(source: &RobotSource) -> String {
    let robot = &source.robot;
    let origin = match &source.urdf {
        Some(arm) => {
            let [base, tip] = arm.base_and_tip();
            format!(", a URDF from {base} to {tip}")
        }
        None => String::new(),
    };
    format!(
        "{}: {} joints{origin}; gravity {} m/s²\n\n",
        robot.name(),
        robot.joints(),
        three_numbers(robot.gravity_m_s2())
    )
}

fn axes_table(source: &RobotSource, frames: &[LinkFrame]) -> String {
    let names: Vec<&str> = source.joint_names().collect();
    let rows: Vec<Vec<String>> = source
        .robot
        .chain()
        .iter()
        .zip(frames)
        .enumerate()
        .map(|(k, (joint, frame))| {
            let Joint { alpha, theta, d_m, r_m, limits, .. } = joint;
            let (scale, unit, kind) = match joint.kind {
                JointKind::Revolute => (1.0_f64.to_degrees(), "deg", "revolute"),
                JointKind::Prismatic => (1e3, "mm", "prismatic"),
            };
            let [low, high] = [limits.position_min, limits.position_max].map(|at| at * scale);
            let degrees =
                |of: &didim_dynamics::robot::Angle| short_number(of.sin.atan2(of.cos).to_degrees());
            let speed = if joint.kind == JointKind::Revolute { "rad/s" } else { "m/s" };
            vec![
                names
                    .get(k)
                    .map_or_else(|| (k + 1).to_string(), |name| format!("{} {name}", k + 1)),
                kind.to_owned(),
                degrees(alpha),
                short_number(*d_m),
                degrees(theta),
                short_number(*r_m),
                three_numbers(frame.origin_m),
                three_numbers(frame.axes[2]),
                format!("{} to {} {unit}", short_number(low), short_number(high)),
                open_or(limits.velocity_max, speed),
                limits.acceleration_max.map_or_else(
                    || "–".to_owned(),
                    |most| format!("{} {speed}²", significant_digits(most, 3)),
                ),
                open_or(limits.torque_max, joint.kind.torque_unit()),
            ]
        })
        .collect();
    let header = [
        "joint",
        "type",
        "α [deg]",
        "d [m]",
        "θ [deg]",
        "r [m]",
        "origin [m]",
        "axis",
        "range",
        "speed",
        "acceleration",
        "torque",
    ];
    align_table(&header, &rows)
}

/// Formats a limit, unless the file leaves it open.
fn open_or(limit: Option<f64>, unit: &str) -> String {
    limit
        .map_or_else(|| "open".to_owned(), |most| format!("{} {unit}", significant_digits(most, 3)))
}

/// Returns the stretched length from the second axis to the last link's frame \[m\].
fn stretched_length(robot: &Robot) -> f64 {
    robot
        .chain()
        .iter()
        .skip(2)
        .map(|joint: &Joint| {
            let stroke = match joint.kind {
                JointKind::Revolute => joint.r_m.abs(),
                JointKind::Prismatic => {
                    let ends = [joint.limits.position_min, joint.limits.position_max];
                    ends.map(|end| (joint.r_m + end).abs()).into_iter().fold(0.0, f64::max)
                }
            };
            joint.d_m.hypot(stroke)
        })
        .sum()
}

fn three_numbers(values: [f64; 3]) -> String {
    values.map(short_number).join("  ")
}

/// Formats a number to a tenth of a millimetre or a thousandth of a degree, without trailing zeros.
fn short_number(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

fn shorten(text: &str) -> String {
    match text.char_indices().nth(MAX_SUM_LENGTH) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}
