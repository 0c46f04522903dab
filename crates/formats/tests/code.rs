//! Generated code, compiled, against the library.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::{FrictionLaw, JointIndex, Robot};
use didim_formats::{CodeError, CodeModel, to_c, to_rust};
use nalgebra::DMatrix;

const STATES: usize = 50;

/// Reads q, q̇ and q̈ of each state and writes torque, that without friction, gravity, friction and
/// the covariance of the torque.
fn c_main(name: &str, n: usize) -> String {
    let call = |function: &str, arguments: &str| {
        format!(
            "        {name}_{function}({arguments}, tau);\n        for (int i = 0; i < {n}; i++) \
            printf(\"%.17g \", tau[i]);\n"
        )
    };
    let torques = [
        call("inverse_dynamics", "x[0], x[1], x[2]"),
        call("rigid_body", "x[0], x[1], x[2]"),
        call("gravity", "x[0]"),
        call("friction", "x[1]"),
    ];
    format!(
        "#include <stdio.h>\n#include \"arm.c\"\nint main(void) {{\n    double x[3][{n}], \
         tau[{n}], covariance[{n} * {n}];\n\
         \x20   if ({name}_self_test() != 0) return 3;\n    for (;;) {{\n\
         \x20       for (int i = 0; i < 3 * {n}; i++) if (scanf(\"%lf\", &x[0][0] + i) != 1) \
         return 0;\n\
         {}        {name}_torque_covariance(x[0], x[1], x[2], covariance);\n\
         \x20       for (int i = 0; i < {n} * {n}; i++) printf(\"%.17g \", \
         covariance[i]);\n        printf(\"\\n\");\n    }}\n}}\n",
        torques.concat()
    )
}

const RUST_MAIN: &str = r#"
#[path = "arm.rs"]
mod arm;

fn main() {
    assert!(arm::self_test());
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let numbers: Vec<f64> = line.split_whitespace().map(|x| x.parse().unwrap()).collect();
        let part = |k: usize| numbers[k * arm::JOINTS..(k + 1) * arm::JOINTS].try_into().unwrap();
        let (q, dq, ddq) = (part(0), part(1), part(2));
        let rigid = arm::rigid_body(&q, &dq, &ddq);
        let all = arm::inverse_dynamics(&q, &dq, &ddq);
        let torques = [all, rigid, arm::gravity(&q), arm::friction(&dq)];
        let covariance = arm::torque_covariance(&q, &dq, &ddq);
        for number in torques.iter().flatten().chain(covariance.iter().flatten()) {
            print!("{number:?} ");
        }
        println!();
    }
}
"#;

/// A number of a sequence without pattern, between −1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn run(program: &mut Command, input: &str) -> Vec<Vec<f64>> {
    let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let writer = std::thread::spawn(move || {
        std::io::Write::write_all(&mut stdin, input.as_bytes()).unwrap();
    });
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success(), "{:?}", output.status);
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|l| l.split_whitespace().map(|x| x.parse().unwrap()).collect()).collect()
}

fn compiled(compiler: &str, arguments: &[&str], folder: &Path) {
    let output = Command::new(compiler).args(arguments).current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{compiler} {arguments:?}: {said}");
}

/// All functions of both languages at random states, to 1e-12 of the largest torque. With
/// `DIDIM_WRITE_EXPORTS` the C goes into the folder that it names (`benches/generated`).
fn check(robot: &Robot, standard: &[f64]) {
    let (dynamics, n) = (Model::new(robot), robot.joints());
    let base = BaseParameters::compute(&dynamics).unwrap();
    let b = base.names().len();
    let mut seed = 7;
    let root = DMatrix::from_fn(b, b, |_, _| 0.01 * random(&mut seed));
    let covariance = &root * root.transpose() + DMatrix::identity(b, b) * 1e-6;
    let identified: Vec<&str> = base.names().iter().map(String::as_str).collect();
    let origin = ["An arm of a test.".to_owned()];
    let model = CodeModel {
        robot,
        base: &base,
        standard_parameters: standard,
        identified_names: &identified,
        covariance: &covariance,
        origin: &origin,
    };
    let folder = tempfile::tempdir().unwrap();
    let path_of = |name: &str| folder.path().join(name);
    fs::write(path_of("arm.c"), to_c(model).unwrap()).unwrap();
    fs::write(path_of("arm.rs"), to_rust(model).unwrap()).unwrap();
    let name: String = robot.name().to_lowercase().replace(|of: char| !of.is_alphanumeric(), "_");
    if let Some(folder) = std::env::var_os("DIDIM_WRITE_EXPORTS") {
        fs::copy(path_of("arm.c"), Path::new(&folder).join(format!("{name}.c"))).unwrap();
    }
    compile_programs(n, &folder, path_of, name);

    let (mut input, mut expected) = (String::new(), Vec::new());
    let mut ws = Workspace::new();
    for _ in 0..STATES {
        let [q, dq, ddq] = [3.0, 5.0, 30.0]
            .map(|size| (0..n).map(|_| size * random(&mut seed)).collect::<Vec<f64>>());
        for number in q.iter().chain(&dq).chain(&ddq) {
            write!(input, "{number:?} ").unwrap();
        }
        input.push('\n');
        let torques = |dq: &[f64], ddq: &[f64], ws: &mut Workspace<f64>| {
            let mut tau = vec![0.0; n];
            dynamics.inverse_dynamics(ws, standard, &q, dq, ddq, &mut tau);
            tau
        };
        let rest = vec![0.0; n];
        let friction_of = |dq: &[f64]| {
            let mut tau = vec![0.0; n];
            dynamics.friction(&mut Workspace::new(), standard, &q, dq, &mut tau);
            tau
        };
        let at_rest = torques(&rest, &rest, &mut ws);
        let without = |all: &[f64], friction: Vec<f64>| -> Vec<f64> {
            all.iter().zip(friction).map(|(all, own)| all - own).collect()
        };
        let (all, friction) = (torques(&dq, &ddq, &mut ws), friction_of(&dq));
        let mut y = vec![0.0; n * b];
        let columns = dynamics.regressor_columns(base.columns());
        dynamics.selected_regressor(&mut ws, &columns, &q, &dq, &ddq, &mut y);
        let y = DMatrix::from_row_slice(n, b, &y);
        let of_torque = &y * &covariance * y.transpose();
        expected.push(
            [
                all.clone(),
                without(&all, friction.clone()),
                without(&at_rest, friction_of(&rest)),
                friction,
                of_torque.as_slice().to_vec(),
            ]
            .concat(),
        );
    }
    compare_programs(folder.path(), &input, &expected);
}

fn compile_programs(
    n: usize,
    folder: &tempfile::TempDir,
    path_of: impl Fn(&str) -> std::path::PathBuf,
    name: String,
) {
    fs::write(path_of("main.c"), c_main(&name, n)).unwrap();
    fs::write(path_of("main.rs"), RUST_MAIN).unwrap();
    let flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-O1", "main.c", "-o", "in_c"];
    compiled("cc", &flags, folder.path());
    // By itself it needs no standard library.
    let alone =
        ["--edition=2015", "--crate-type=lib", "--emit=metadata", "-o", "alone.rmeta", "lib.rs"];
    fs::write(path_of("lib.rs"), "#![no_std]\n#[path = \"arm.rs\"]\npub mod arm;\n").unwrap();
    compiled("rustc", &alone, folder.path());
    compiled(
        "rustc",
        &["--edition=2024", "-Copt-level=1", "-o", "in_rust", "main.rs"],
        folder.path(),
    );
}

fn compare_programs(folder: &Path, input: &str, expected: &[Vec<f64>]) {
    let largest = expected.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    for program in ["./in_c", "./in_rust"] {
        let output = run(Command::new(folder.join(program)).current_dir(folder), input);
        assert_eq!(output.len(), STATES, "{program}");
        for (found, expected) in output.iter().zip(expected) {
            assert_eq!(found.len(), expected.len(), "{program}");
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-12 * largest,
                    "{program}: {found} {expected}"
                );
            }
        }
    }
}

fn robot(file: &str) -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots").join(file);
    Robot::from_toml(&fs::read_to_string(path).unwrap()).unwrap()
}

/// With a coupled wrist, and tanh for the sign.
#[test]
fn generated_code_of_the_tx40_is_the_library() {
    let robot = robot("tx40.toml");
    let standard = robot.nominal().unwrap().standard_parameters().to_vec();
    check(&robot, &standard);
}

/// By hand, see docs/evidence/models.md: two compilers for each robot of the library.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn generated_code_of_every_robot_is_the_library() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots");
    let (mut seed, mut files) = (7, 0);
    for file in fs::read_dir(folder).unwrap() {
        let robot = robot(&file.unwrap().file_name().into_string().unwrap());
        let parameters = robot.parameters().names().len();
        check(&robot, &(0..parameters).map(|_| random(&mut seed)).collect::<Vec<_>>());
        println!("{}: as the library", robot.name());
        files += 1;
    }
    assert!(files >= 11, "{files}");
}

/// Every friction law, and angles that are no quarter turns.
#[test]
fn generated_code_of_an_arm_with_every_friction_law_is_the_library() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots/ur5e.toml");
    let text = fs::read_to_string(path).unwrap();
    let laws = "quadratic = true\ncubic = true\nasymmetric = true\nstribeck_rad_s = 0.2\n";
    let text = text.replacen("[friction]\n", &format!("[friction]\n{laws}"), 1);
    let text = text.replacen("alpha_deg = 90.0", "alpha_deg = 77.0", 1);
    let robot = Robot::from_toml(&text).unwrap();
    let mut seed = 3;
    let parameters = robot.parameters().names().len();
    check(&robot, &(0..parameters).map(|_| random(&mut seed)).collect::<Vec<_>>());
}

#[test]
fn generated_code_of_an_arm_without_gravity_and_friction_has_no_warnings() {
    let text = r#"name = "one"
gravity_m_s2 = [0.0, 0.0, -9.81]
[[joint]]
type = "revolute"
alpha_deg = 0.0
d_m = 0.0
theta_deg = 0.0
r_m = 0.0
drive_inertia = true
position_min_deg = -90.0
position_max_deg = 90.0
velocity_max_rad_s = 2.0
torque_max_nm = 50.0
[transmission]
rows = [[1.0]]
[friction]
viscous = false
coulomb = false
offset = false
"#;
    let robot = Robot::from_toml(text).unwrap();
    check(&robot, &vec![1.0; robot.parameters().names().len()]);
}

#[test]
fn what_cannot_be_code_is_refused() {
    let robot = robot("tx40.toml");
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let standard = robot.nominal().unwrap().standard_parameters().to_vec();
    let name = base.names()[0].as_str();
    let full_covariance = DMatrix::from_element(1, 1, 1.0);
    let names = [name];
    let model = CodeModel {
        robot: &robot,
        base: &base,
        standard_parameters: &standard,
        identified_names: &names,
        covariance: &full_covariance,
        origin: &[],
    };
    assert!(to_c(model).is_ok());
    for law in [FrictionLaw::Load, FrictionLaw::Hysteresis { way_rad: 0.01 }] {
        let changed = robot.own_friction().iter().map(|own| own.with_law(law)).collect();
        let changed = robot.clone().with_friction(changed);
        let refused = to_c(CodeModel { robot: &changed, ..model });
        assert_eq!(refused, Err(CodeError::Friction { joint: JointIndex::new(0), law }));
    }
    let negative = DMatrix::from_element(1, 1, -1.0);
    assert_eq!(to_c(CodeModel { covariance: &negative, ..model }), Err(CodeError::Covariance));
    let unknown = ["zz9"];
    assert_eq!(
        to_rust(CodeModel { identified_names: &unknown, ..model }),
        Err(CodeError::Identified)
    );
}
