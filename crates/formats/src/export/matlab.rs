//! A MATLAB function that returns an arm as a structure.

use std::fmt::Write as _;

use didim_dynamics::robot::ParameterKind;

use super::left_out::{ExportKind, LeftOut};
use super::model::{ExportError, ExportModel, is_prismatic};

/// Number of significant characters of a name.
const LONGEST_NAME: usize = 63;

/// Words that `iskeyword` lists in MATLAB and in Octave.
const KEYWORDS: [&str; 36] = [
    "break",
    "case",
    "catch",
    "classdef",
    "continue",
    "do",
    "else",
    "elseif",
    "end",
    "end_try_catch",
    "end_unwind_protect",
    "endfor",
    "endfunction",
    "endif",
    "endmethods",
    "endparfor",
    "endproperties",
    "endswitch",
    "endwhile",
    "events",
    "for",
    "function",
    "global",
    "if",
    "otherwise",
    "parfor",
    "persistent",
    "return",
    "spmd",
    "switch",
    "try",
    "until",
    "unwind_protect",
    "unwind_protect_cleanup",
    "while",
    "arguments",
];

/// Writes the arm as a function file of MATLAB, which Octave reads too: modified Denavit–Hartenberg
/// parameters; mass, centre of mass and inertia about it of each link in its own frame; drive
/// inertias and friction.
///
/// # Errors
/// [`ExportError::NoBody`], [`ExportError::FunctionName`].
pub fn to_matlab(model: &ExportModel<'_>, function: &str) -> Result<String, ExportError> {
    if !is_function_name(function) {
        return Err(ExportError::FunctionName { name: function.to_owned() });
    }
    let robot = model.robot;
    let mut text = format!("function arm = {function}()\n");
    let left_out = LeftOut::list(model, ExportKind::Parameters).into_iter();
    // Writing to a String cannot fail.
    for line in
        model.origin.iter().cloned().chain(left_out.map(|omitted| format!("left out: {omitted}")))
    {
        let _ = writeln!(text, "% {line}");
    }
    text.push_str(
        "% SI units. Modified Denavit-Hartenberg: RotX(alpha) TransX(d) RotZ(theta) TransZ(r), q \
         added to theta, or to r of a\n\
         % prismatic joint. Bodies in the frames of their links: centre of mass, inertia about it. \
         tau = R' tau_motor.\n",
    );
    let _ = writeln!(text, "arm.name = '{}';", robot.name().replace('\'', "''"));
    let numbers = |of: &[f64]| of.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
    let _ = writeln!(text, "arm.gravity = [{}]';", numbers(&robot.gravity_m_s2()));
    let rows: Vec<String> =
        (0..robot.joints()).map(|motor| numbers(robot.transmission().row(motor))).collect();
    let _ = writeln!(text, "arm.transmission = [{}];", rows.join("; "));
    for (index, joint) in robot.chain().iter().enumerate() {
        let body = model.body(index)?;
        let number = index + 1;
        let limits = &joint.limits;
        let geometry = [
            ("alpha", joint.alpha.sin.atan2(joint.alpha.cos)),
            ("d", joint.d_m),
            ("theta", joint.theta.sin.atan2(joint.theta.cos)),
            ("r", joint.r_m),
            ("position_min", limits.position_min),
            ("position_max", limits.position_max),
            ("velocity_max", limits.velocity_max.unwrap_or(f64::NAN)),
            ("torque_max", limits.torque_max.unwrap_or(f64::NAN)),
            ("mass", body.mass_kg),
        ];
        let prismatic = is_prismatic(joint);
        let _ = writeln!(text, "arm.joint({number}).is_prismatic = {prismatic};");
        for (name, value) in geometry {
            // A limit that the robot file leaves open.
            let note = if value.is_nan() { " % not known" } else { "" };
            let _ = writeln!(text, "arm.joint({number}).{name} = {value:?};{note}");
        }
        let _ = writeln!(
            text,
            "arm.joint({number}).centre_of_mass = [{}]';",
            numbers(body.centre_m.as_slice())
        );
        let rows: Vec<String> = body
            .inertia_kg_m2
            .row_iter()
            .map(|row| numbers(&row.iter().copied().collect::<Vec<_>>()))
            .collect();
        let _ = writeln!(text, "arm.joint({number}).inertia = [{}];", rows.join("; "));
    }
    let table = robot.parameters();
    let parameters = table.parameters().iter().zip(table.names()).zip(model.standard_parameters);
    for ((parameter, name), value) in parameters {
        if !ParameterKind::LINK.contains(&parameter.kind) {
            let unit = parameter.kind.unit(robot.chain()[parameter.joint].kind);
            let _ = writeln!(text, "arm.drive.{name} = {value:?}; % {unit}");
        }
    }
    for (joint, friction) in (1..).zip(robot.own_friction()) {
        let laws: Vec<String> = friction.laws.iter().map(ToString::to_string).collect();
        let _ = writeln!(
            text,
            "arm.joint({joint}).friction = 'sign = {}{}{}';",
            friction.sign,
            if laws.is_empty() { "" } else { ", " },
            laws.join(", ")
        );
    }
    text.push_str("end\n");
    Ok(text)
}

/// Returns true for a valid MATLAB function name, so that a file of this name can hold it.
fn is_function_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|first| first.is_ascii_alphabetic())
        && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        && name.len() <= LONGEST_NAME
        && !KEYWORDS.contains(&name)
}
