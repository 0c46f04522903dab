//! One Rust file without the standard library.

use std::fmt::Write as _;

use super::elementary::called_by;
use super::error::CodeError;
use super::program::{CodeModel, GeneratedFunction, Program, SelfTestPoint};
use super::statements::Language;

/// Writes the model as one Rust file: a module that uses only `core` and allocates nothing.
///
/// # Errors
/// [`CodeError`].
pub fn to_rust(model: CodeModel<'_>) -> Result<String, CodeError> {
    let program = Program::new(model)?;
    let (n, b) = (program.joints(), model.identified_names.len());
    let three = "q: &[f64; JOINTS], dq: &[f64; JOINTS], ddq: &[f64; JOINTS]";
    let heads = [
        format!("rigid_body({three})"),
        "gravity(q: &[f64; JOINTS])".to_owned(),
        "friction(dq: &[f64; JOINTS])".to_owned(),
    ];
    let mut body = String::new();
    for ((part, says), head) in GeneratedFunction::TORQUES.into_iter().zip(heads) {
        let (lines, results) = program.statements(part, Language::Rust)?;
        // Writing to a String cannot fail.
        let _ = writeln!(body, "/// {says}\npub fn {head} -> [f64; JOINTS] {{");
        for line in lines {
            let _ = writeln!(body, "    {line}");
        }
        let _ = writeln!(body, "    [\n        {},\n    ]\n}}\n", results.join(",\n        "));
    }
    let _ = writeln!(
        body,
        "/// Torques of a motion, with friction and offsets.\npub fn inverse_dynamics({three}) -> \
         [f64; JOINTS] {{\n\
         \x20   let mut tau = rigid_body(q, dq, ddq);\n    for (tau, friction) in \
         tau.iter_mut().zip(friction(dq)) {{\n\
         \x20       *tau += friction;\n    }}\n    tau\n}}\n"
    );
    let numbers: Vec<String> = program.factor.iter().map(|value| format!("{value:?}")).collect();
    let rows: Vec<String> = numbers.chunks(6).map(|row| row.join(", ")).collect();
    let (lines, results) = program.statements(GeneratedFunction::Regressor, Language::Rust)?;
    let entries = program.entries.iter().zip(results);
    let entries = entries.map(|((row, column), result)| format!("y[{row}][{column}] = {result};"));
    let _ = write!(
        body,
        "/// Factor L of the covariance LLᵀ of the {b} identified parameters, the rows of its \
         lower triangle.\n\
         static FACTOR: [f64; {}] = [\n    {},\n];\n\n\
         /// Covariance of the torques by that of the parameters \\[(N m)²\\]. It holds for a \
         model that is right.\n\
         pub fn torque_covariance({three}) -> [[f64; JOINTS]; JOINTS] {{\n    let mut y = [[0.0; \
         {b}]; JOINTS];\n",
        numbers.len(),
        rows.join(",\n    ")
    );
    for line in lines.into_iter().chain(entries) {
        let _ = writeln!(body, "    {line}");
    }
    let _ = writeln!(
        body,
        "    let mut a = [[0.0; {b}]; JOINTS];\n    for (a, y) in a.iter_mut().zip(&y) {{\n        \
         for (j, y) in y.iter().enumerate() {{\n\
         \x20           for (k, a) in a.iter_mut().enumerate().take(j + 1) {{\n\
         \x20               *a += y * FACTOR[j * (j + 1) / 2 + k];\n            }}\n        \
         }}\n    }}\n\
         \x20   let mut covariance = [[0.0; JOINTS]; JOINTS];\n    for (row, left) in \
         covariance.iter_mut().zip(&a) {{\n\
         \x20       for (entry, right) in row.iter_mut().zip(&a) {{\n\
         \x20           *entry = left.iter().zip(right).map(|(left, right)| left * \
         right).sum();\n        }}\n    }}\n    covariance\n}}\n"
    );
    body.push_str(&self_test(&program));
    let origin = model.origin.iter().map(|line| format!("//! {line}\n")).collect::<String>();
    let elementary = called_by(&body, Language::Rust, "");
    Ok(format!(
        "{origin}//!\n//! Positions [rad or m], velocities, accelerations and torques [N m or N] \
         of the {n} joints, not of the motors; a\n\
         //! torque is what the drives have to give. `core` alone, no allocation. The self-test is \
         true where all is well.\n\
         #![allow(clippy::all, clippy::pedantic, unused_parens, unused_variables)]\n\n\
         /// Number of joints.\npub const JOINTS: usize = {n};\n\n{body}\n{elementary}"
    ))
}

/// Writes the self-test: results of the library at some states.
fn self_test(program: &Program<'_>) -> String {
    let rows: Vec<String> = program
        .checks
        .iter()
        .map(|check: &SelfTestPoint| {
            let [q, dq, ddq] = &check.state;
            let rows =
                [q, dq, ddq, &check.torque, &check.variance].map(|row| format!("        {row:?},"));
            format!("        [\n    {}\n        ],", rows.join("\n    "))
        })
        .collect();
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "/// Whether the functions give what the library gave.\npub fn self_test() -> bool {{\n\
         \x20   // Position, velocity, acceleration, torque, and its variance.\n\
         \x20   let expected: [[[f64; JOINTS]; 5]; {}] = [\n{}\n    ];\n\
         \x20   expected.iter().all(|[q, dq, ddq, torque, variance]| {{\n\
         \x20       let covariance = torque_covariance(q, dq, ddq);\n\
         \x20       let found = inverse_dynamics(q, dq, ddq);\n\
         \x20       let mut joints = found.iter().zip(torque).zip(variance).enumerate();\n\
         \x20       joints.all(|(joint, ((found, torque), variance))| {{\n\
         \x20           let (torque_error, error) = (found - torque, covariance[joint][joint] - \
         variance);\n\
         \x20           let largest = 1e-9 * (1.0 + torque * torque);\n\
         \x20           torque_error * torque_error <= largest * largest && error * error <= 1e-12 \
         * variance * variance\n\
         \x20       }})\n    }})\n}}\n",
        rows.len(),
        rows.join("\n"),
    );
    text
}
