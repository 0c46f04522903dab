//! One C99 file.

use std::fmt::Write as _;

use super::elementary::called_by;
use super::error::CodeError;
use super::program::{CodeModel, GeneratedFunction, Program, SelfTestPoint};
use super::statements::Language;

/// Writes the model as one C99 file that includes `stdint.h` and `string.h`, allocates nothing and
/// calls no mathematics library.
///
/// # Errors
/// [`CodeError`].
pub fn to_c(model: CodeModel<'_>) -> Result<String, CodeError> {
    let program = Program::new(model)?;
    let (n, name) = (program.joints(), &program.prefix);
    let three = format!("const double q[{n}], const double dq[{n}], const double ddq[{n}]");
    let heads = [
        format!("void {name}_rigid_body({three}, double tau[{n}])"),
        format!("void {name}_gravity(const double q[{n}], double tau[{n}])"),
        format!("void {name}_friction(const double dq[{n}], double tau[{n}])"),
        format!("void {name}_inverse_dynamics({three}, double tau[{n}])"),
        format!("void {name}_torque_covariance({three}, double covariance[{}])", n * n),
        format!("int {name}_self_test(void)"),
    ];
    let mut body = String::new();
    for ((part, says), head) in GeneratedFunction::TORQUES.into_iter().zip(&heads) {
        let (lines, results) = program.statements(part, Language::C)?;
        let results = results.iter().enumerate();
        let results = results.map(|(joint, result)| format!("tau[{joint}] = {result};"));
        // Writing to a String cannot fail.
        let _ = writeln!(body, "/* {says} */\n{head} {{");
        for line in perhaps_unread(head).into_iter().chain(lines).chain(results) {
            let _ = writeln!(body, "    {line}");
        }
        body.push_str("}\n\n");
    }
    let _ = writeln!(
        body,
        "/* Torques of a motion, with friction and offsets. */\n{} {{\n    double \
         friction[{n}];\n    {name}_friction(dq, friction);\n\
         \x20   {name}_rigid_body(q, dq, ddq, tau);\n    for (int i = 0; i < {n}; i++) tau[i] += \
         friction[i];\n}}\n",
        heads[3]
    );
    body.push_str(&covariance(&program, &heads[4])?);
    body.push_str(&self_test(&program, &heads[5]));

    let origin = model
        .origin
        .iter()
        .map(|line| format!(" * {}\n", line.replace("*/", "* /").replace("/*", "/ *")));
    Ok(format!(
        "/*\n{origin} *\n * Positions [rad or m], velocities, accelerations and torques [N m or N] \
         of the {n} joints, not of the motors; a torque\n * is what the drives have to give. C99; \
         no allocation, no library but memcpy. The self-test returns 0 where all is well.\n * Not \
         for -ffast-math or -Ofast, with which it fails.\n */\n#include <stdint.h>\n#include \
         <string.h>\n\n{prototypes};\n\n{elementary}\n{body}",
        origin = origin.collect::<String>(),
        prototypes = heads.join(";\n"),
        elementary = called_by(&body, Language::C, name),
    ))
}

/// Marks arguments that may be unused. The torque of an arm need not depend on all arguments of a
/// function, and compilers warn about unused ones.
fn perhaps_unread(head: &str) -> Vec<String> {
    let is_taken = |name: &&str| head.contains(&format!(" {name}["));
    ["q", "dq", "ddq"].into_iter().filter(is_taken).map(|name| format!("(void){name};")).collect()
}

/// Writes the covariance of the torques, Y C Yᵀ with C = LLᵀ.
fn covariance(program: &Program<'_>, head: &str) -> Result<String, CodeError> {
    let (n, b) = (program.joints(), program.model.identified_names.len());
    let name = &program.prefix;
    let mut text = String::new();
    let numbers: Vec<String> = program.factor.iter().map(|value| format!("{value:?}")).collect();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "/* Factor L of the covariance L L' of the {b} identified parameters, the rows of its \
         lower triangle. */\n\
         static const double {name}_factor[{}] = {{\n    {}\n}};\n",
        numbers.len(),
        numbers.chunks(6).map(|row| row.join(", ")).collect::<Vec<_>>().join(",\n    ")
    );
    let (lines, results) = program.statements(GeneratedFunction::Regressor, Language::C)?;
    let _ = writeln!(
        text,
        "/* Covariance of the torques by that of the parameters, row by row [(N m)^2]. It holds \
         for a model that is right. */\n\
         {head} {{\n    double y[{n}][{b}] = {{{{0.0}}}}, a[{n}][{b}];"
    );
    for statement in perhaps_unread(head).into_iter().chain(lines) {
        let _ = writeln!(text, "    {statement}");
    }
    for ((row, column), result) in program.entries.iter().zip(results) {
        let _ = writeln!(text, "    y[{row}][{column}] = {result};");
    }
    let _ = write!(
        text,
        "    for (int i = 0; i < {n}; i++)\n        for (int k = 0; k < {b}; k++) {{\n            \
         a[i][k] = 0.0;\n\
         \x20           for (int j = k; j < {b}; j++) a[i][k] += y[i][j] * {name}_factor[j * (j + \
         1) / 2 + k];\n        }}\n\
         \x20   for (int i = 0; i < {n}; i++)\n        for (int j = 0; j < {n}; j++) {{\n\
         \x20           covariance[i * {n} + j] = 0.0;\n\
         \x20           for (int k = 0; k < {b}; k++) covariance[i * {n} + j] += a[i][k] * \
         a[j][k];\n        }}\n}}\n"
    );
    Ok(text)
}

/// Writes the self-test: results of the library at some states.
fn self_test(program: &Program<'_>, head: &str) -> String {
    let n = program.joints();
    let name = &program.prefix;
    let numbers = |of: &[f64]| {
        let terms: Vec<String> = of.iter().map(|value| format!("{value:?}")).collect();
        format!("{{{}}}", terms.join(", "))
    };
    let rows: Vec<String> = program
        .checks
        .iter()
        .map(|check: &SelfTestPoint| {
            let [q, dq, ddq] = &check.state;
            let rows = [q, dq, ddq, &check.torque, &check.variance].map(|row| numbers(row));
            format!("        {{{}}}", rows.join(",\n         "))
        })
        .collect();
    format!(
        "/* Whether the functions give what the library gave: position, velocity, acceleration, \
         torque, and its variance. */\n\
         {head} {{\n    static const double expected[{count}][5][{n}] = {{\n{rows}\n    }};\n\
         \x20   for (int k = 0; k < {count}; k++) {{\n        double tau[{n}], \
         covariance[{square}];\n\
         \x20       {name}_inverse_dynamics(expected[k][0], expected[k][1], expected[k][2], tau);\n\
         \x20       {name}_torque_covariance(expected[k][0], expected[k][1], expected[k][2], \
         covariance);\n\
         \x20       for (int i = 0; i < {n}; i++) {{\n\
         \x20           const double torque = tau[i] - expected[k][3][i], variance = covariance[i \
         * {n} + i] - expected[k][4][i];\n\
         \x20           const double largest = 1e-9 * (1.0 + expected[k][3][i] * \
         expected[k][3][i]);\n\
         \x20           if (!(torque * torque <= largest * largest)) return 1;\n\
         \x20           if (!(variance * variance <= 1e-12 * expected[k][4][i] * \
         expected[k][4][i])) return 2;\n\
         \x20       }}\n    }}\n    return 0;\n}}\n",
        count = rows.len(),
        rows = rows.join(",\n"),
        square = n * n,
    )
}
