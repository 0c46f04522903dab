//! An arm of twelve joints on a rail, a lift and a torso, from a URDF and a table to a result.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::Robot;

use crate::program::{didim, json, succeed};

const AXES: usize = 12;
const RATE_HZ: f64 = 200.0;
const SAMPLES: u32 = 6000;

/// Prismatic or revolute, axis, origin \[m\], mass \[kg\], viscous and Coulomb friction.
type JointRow = (&'static str, [i32; 3], [f64; 3], f64, [f64; 2]);

const JOINTS: [JointRow; AXES] = [
    ("prismatic", [1, 0, 0], [0.0, 0.0, 0.1], 40.0, [60.0, 40.0]),
    ("prismatic", [0, 0, 1], [0.0, 0.1, 0.3], 25.0, [50.0, 30.0]),
    ("revolute", [0, 0, 1], [0.1, 0.0, 0.2], 15.0, [6.0, 4.0]),
    ("revolute", [0, 1, 0], [0.0, 0.0, 0.3], 10.0, [5.0, 4.0]),
    ("revolute", [1, 0, 0], [0.1, 0.2, 0.2], 6.0, [3.0, 2.0]),
    ("revolute", [0, 0, 1], [0.0, 0.1, 0.1], 5.0, [2.0, 1.5]),
    ("revolute", [0, 1, 0], [0.0, 0.1, 0.2], 4.0, [1.5, 1.5]),
    ("revolute", [0, 0, 1], [0.05, 0.0, 0.2], 3.0, [1.0, 1.0]),
    ("revolute", [0, 1, 0], [0.0, 0.05, 0.2], 2.5, [0.8, 0.8]),
    ("revolute", [0, 0, 1], [0.0, 0.0, 0.2], 2.0, [0.6, 0.6]),
    ("revolute", [0, 1, 0], [0.05, 0.0, 0.1], 1.5, [0.4, 0.5]),
    ("revolute", [1, 0, 0], [0.1, 0.0, 0.0], 1.0, [0.3, 0.3]),
];

fn urdf() -> String {
    let mut text = "<robot name=\"torso\">\n<link name=\"base\"/>\n".to_owned();
    let mut parent = "base".to_owned();
    for (number, (kind, [ax, ay, az], [x, y, z], mass, [fv, fc])) in (1..).zip(JOINTS) {
        let ball = mass * 0.004;
        writeln!(
            text,
            "<joint name=\"j{number}\" type=\"{kind}\"><parent link=\"{parent}\"/>\
             <child link=\"l{number}\"/><origin xyz=\"{x} {y} {z}\"/><axis xyz=\"{ax} {ay} {az}\"/>\
             <limit lower=\"-3\" upper=\"3\" velocity=\"20\" effort=\"5000\"/>\
             <dynamics damping=\"{fv}\" friction=\"{fc}\"/></joint>\n\
             <link name=\"l{number}\"><inertial><origin xyz=\"0.02 0.03 0.06\"/>\
             <mass value=\"{mass}\"/><inertia ixx=\"{ball}\" ixy=\"0\" ixz=\"0\" iyy=\"{ball}\" \
             iyz=\"0\" izz=\"{ball}\"/></inertial></link>"
        )
        .unwrap();
        parent = format!("l{number}");
    }
    text + "</robot>\n"
}

/// Uniform noise by a linear congruential generator.
fn noise(state: &mut u64, size: f64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    #[expect(clippy::cast_precision_loss, reason = "24 bits")]
    let unit = (*state >> 40) as f64 / f64::from(1 << 24);
    size * (2.0 * unit - 1.0)
}

/// Writes a table of 30 s with noise of 1e-6 in positions and of 0.05 N·m (N) in torques.
fn record(folder: &Path) {
    fs::write(folder.join("torso.urdf"), urdf()).unwrap();
    let robot = succeed(&[&"robot", &folder.join("torso.urdf"), &"--toml"]);
    let robot = Robot::from_toml(&robot).unwrap();
    assert_eq!(robot.joints(), AXES);
    let (model, mut workspace) = (Model::new(&robot), Workspace::new());
    let standard = robot.nominal().unwrap().standard_parameters();
    let header = |stem: &str| (1..=AXES).fold(String::new(), |to, n| to + &format!(",{stem}{n}"));
    let mut table = format!("time_s{}{}\n", header("position_j"), header("effort_j"));
    let mut state = 7_u64;
    for k in 0..SAMPLES {
        let t = f64::from(k) / RATE_HZ;
        let [mut q, mut dq, mut ddq, mut tau] = [[0.0; AXES]; 4];
        for (axis, j) in (0..AXES).zip(0_u32..) {
            let j = f64::from(j);
            for (a, w) in [(0.6, 0.8 + 0.13 * j), (0.2, 3.1 + 0.19 * j)] {
                q[axis] += a * (w * t + j).sin();
                dq[axis] += a * w * (w * t + j).cos();
                ddq[axis] -= a * w * w * (w * t + j).sin();
            }
        }
        model.inverse_dynamics(&mut workspace, standard, &q, &dq, &ddq, &mut tau);
        write!(table, "{t:.4}").unwrap();
        q.iter().for_each(|q| write!(table, ",{:.7}", q + noise(&mut state, 1e-6)).unwrap());
        tau.iter().for_each(|tau| write!(table, ",{:.5}", tau + noise(&mut state, 0.05)).unwrap());
        table.push('\n');
    }
    fs::write(folder.join("run.csv"), table).unwrap();
}

#[test]
fn an_arm_of_twelve_joints_is_identified() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path());
    let [urdf, table, cell] =
        ["torso.urdf", "run.csv", "cell.toml"].map(|name| folder.path().join(name));
    let lists = ["m", "rad", "N", "Nm"].map(|unit| format!("\"{unit}\""));
    let list = |first: &str, others: &str| {
        format!("[{first}, {first}{}]", format!(", {others}").repeat(AXES - 2))
    };
    let units = format!("data.position.unit={}", list(&lists[0], &lists[1]));
    let torques = format!("data.torque.unit={}", list(&lists[2], &lists[3]));
    let ratios = format!("urdf.gear_ratios=[1.0{}]", ", 1.0".repeat(AXES - 1));
    succeed(&[
        &"new",
        &cell,
        &"--robot",
        &urdf,
        &"--log",
        &table,
        &"--set",
        &units,
        &"--set",
        &torques,
        &"--set",
        &ratios,
        &"--set",
        &"data.side=\"joint\"",
        &"--set",
        &"urdf.drive_inertia=false",
        &"--set",
        &"data.torque.sign=1",
    ]);
    let result = succeed(&[&"identify", &"--cell", &cell, &"--input", &table, &"--json"]);
    let result = json(&result);
    let mut compared = 0;
    for parameter in result["parameters"].as_array().unwrap() {
        let name = parameter["name"].as_str().unwrap();
        let place = ["fv", "fc"].iter().position(|kind| name.starts_with(kind));
        let (Some(place), Ok(number)) = (place, name[2..].parse::<usize>()) else { continue };
        let expected = JOINTS[number - 1].4[place];
        let (value, sigma) = (
            parameter["value"].as_f64().unwrap(),
            parameter["combined_standard_deviation"].as_f64().unwrap(),
        );
        assert!((value - expected).abs() < 4.0 * sigma, "{name}: {value} ± {sigma}, {expected}");
        assert!((value / expected - 1.0).abs() < 0.1, "{name}: {value}, {expected}");
        compared += 1;
    }
    assert_eq!(compared, 2 * AXES);
}

#[test]
fn an_arm_of_seventeen_joints_is_refused_with_its_number() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("long.urdf");
    let joint = |n: usize| {
        format!(
            "<joint name=\"j{n}\" type=\"revolute\"><parent link=\"l{}\"/><child link=\"l{n}\"/>\
             <axis xyz=\"0 0 1\"/><origin xyz=\"0.1 0 0\" rpy=\"1.2 0 0\"/>\
             <limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"9\"/></joint>\
             <link name=\"l{n}\"/>",
            n - 1
        )
    };
    let urdf = |joints: usize| {
        format!(
            "<robot name=\"a\"><link name=\"l0\"/>{}</robot>",
            (1..=joints).map(joint).collect::<String>()
        )
    };
    fs::write(&file, urdf(16)).unwrap();
    let robot = Robot::from_toml(&succeed(&[&"robot", &file, &"--toml"])).unwrap();
    assert_eq!(robot.joints(), 16);
    fs::write(&file, urdf(17)).unwrap();
    let refused = didim(&[&"robot", &file]);
    assert_eq!(refused.code, Some(78), "{refused:?}");
    assert!(refused.stderr.contains("17") && refused.stderr.contains("16"), "{refused:?}");
}
