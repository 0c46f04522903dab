//! docs/guide/arms/urdf.md: its commands as they stand there, on a simulated arm of seven axes.

use std::fs;
use std::path::Path;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{ParameterKind, Robot};
use didim_formats::{ExportModel, to_urdf};

use crate::bag_writer::{Bag, State};
use crate::program::{command, repository, succeed};

const AXES: usize = 7;
/// Of each link \[kg\], and of each joint: viscous \[N·m·s/rad\] and Coulomb friction \[N·m\].
const MASSES: [f64; AXES] = [4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.3];
const VISCOUS: [f64; AXES] = [2.0, 2.0, 1.5, 1.5, 0.8, 0.8, 0.4];
const COULOMB: [f64; AXES] = [1.5, 1.5, 1.0, 1.0, 0.6, 0.5, 0.3];
const RATE_HZ: f64 = 200.0;

/// The geometry of the iiwa 7 with these masses: balls of 8 cm, next to their joints.
fn urdf() -> String {
    let text = fs::read_to_string(repository("config/robots/iiwa7.toml")).unwrap();
    let robot = Robot::from_toml(&text).unwrap();
    let value = |kind: ParameterKind, joint: usize| {
        let (mass, [x, y, z]) = (MASSES[joint], [0.01, 0.03, 0.05]);
        let ball = 0.4 * mass * 0.08 * 0.08;
        match kind {
            ParameterKind::Xx => ball + mass * (y * y + z * z),
            ParameterKind::Yy => ball + mass * (x * x + z * z),
            ParameterKind::Zz => ball + mass * (x * x + y * y),
            ParameterKind::Xy => -mass * x * y,
            ParameterKind::Xz => -mass * x * z,
            ParameterKind::Yz => -mass * y * z,
            ParameterKind::Mx => mass * x,
            ParameterKind::My => mass * y,
            ParameterKind::Mz => mass * z,
            ParameterKind::M => mass,
            ParameterKind::Fv => VISCOUS[joint],
            ParameterKind::Fc => COULOMB[joint],
            _ => 0.0,
        }
    };
    let parameters = robot.parameters().parameters().iter();
    let standard: Vec<f64> = parameters.map(|one| value(one.kind, one.joint.position())).collect();
    let origin = ["A simulated arm.".to_owned()];
    to_urdf(&ExportModel { robot: &robot, standard_parameters: &standard, origin: &origin })
        .unwrap()
}

/// 40 s of all joints: stamps that jitter by 0.3 ms, noise of 1e-6 rad and 0.2 N·m.
fn record(folder: &Path) {
    let urdf = urdf();
    let file = folder.join("simulated.urdf");
    fs::write(&file, &urdf).unwrap();
    let robot = Robot::from_toml(&succeed(&[&"robot", &file, &"--toml"])).unwrap();
    fs::remove_file(file).unwrap();
    let names: Vec<String> = urdf
        .split("<joint name=\"")
        .skip(1)
        .map(|rest| rest[..rest.find('"').unwrap()].into())
        .collect();
    let joints: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| name.starts_with("joint_")).collect();
    let (model, mut workspace) = (Model::new(&robot), Workspace::new());
    let standard = robot.nominal().unwrap().standard_parameters();
    // Uniform noise by a linear congruential generator.
    let mut state = 7_u64;
    let mut noise = |size: f64| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        #[expect(clippy::cast_precision_loss, reason = "24 bits")]
        let unit = (state >> 40) as f64 / f64::from(1 << 24);
        size * (2.0 * unit - 1.0)
    };
    let mut bag = Bag::create(&folder.join("motion.mcap"));
    bag.description(&urdf);
    for k in 0..8000_u32 {
        let late_s = 3e-4 + noise(3e-4);
        let t = f64::from(k) / RATE_HZ + late_s;
        let (mut q, mut dq, mut ddq, mut tau) =
            ([0.0; AXES], [0.0; AXES], [0.0; AXES], [0.0; AXES]);
        for (axis, j) in (0..AXES).zip(0_u32..) {
            let j = f64::from(j);
            for (a, w) in [(0.7, 0.9 + 0.11 * j), (0.3, 2.3 + 0.17 * j)] {
                q[axis] += a * (w * t).sin();
                dq[axis] += a * w * (w * t).cos();
                ddq[axis] -= a * w * w * (w * t).sin();
            }
        }
        model.inverse_dynamics(&mut workspace, standard, &q, &dq, &ddq, &mut tau);
        q.iter_mut().for_each(|q| *q += noise(1e-6));
        tau.iter_mut().for_each(|tau| *tau += noise(0.2));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 41 s")]
        let after_ns = (t * 1e9) as u64;
        let stamp_ns = 1_700_000_000_000_000_000 + after_ns;
        bag.state(
            "/joint_states",
            &State { stamp_ns, joints: &joints, positions: &q, efforts: &tau },
        );
    }
    bag.finish();
}

#[test]
fn the_walk_of_docs_seven_axes_leads_to_the_report() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path());
    let page = fs::read_to_string(repository("docs/guide/arms/urdf.md")).unwrap();
    let block = page.split("```sh\n").nth(1).unwrap().split("```").next().unwrap();
    fn run(arguments: &str, further: &[&str], folder: &tempfile::TempDir) -> (String, String) {
        let arguments = arguments.split_whitespace().chain(further.iter().copied());
        let output = command(&[]).args(arguments).current_dir(folder.path()).output().unwrap();
        let [out, err] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(output.status.success(), "{out}{err}");
        (out, err)
    }
    let commands: Vec<&str> =
        block.lines().map(|line| line.strip_prefix("didim ").unwrap()).collect();
    let [new, check, identify] = commands.as_slice() else { panic!("three commands: {block}") };
    let (made, _) = run(new, &[], &folder);
    for line in [
        "found    data.rate_hz = 200.0",
        "found    data.side = \"joint\"",
        "data.bag.effort.unit = \"Nm\"",
        "data.bag.effort.sign = 1",
        "next: didim identify --cell arm.toml --input motion.mcap --out result.json --report \
         report.html",
    ] {
        assert!(made.contains(line), "{line}: {made}");
    }
    let (_, found) = run(check, &[], &folder);
    assert!(!found.contains("warning"), "{found}");
    let (_, said) = run(identify, &[], &folder);
    assert!(said.contains("ms off a uniform grid"), "{said}");
    assert!(fs::read_to_string(folder.path().join("report.html")).unwrap().contains("<html"));
    // As was stated.
    let (result, _) = run(identify, &["--json"], &folder);
    let result = crate::program::json(&result);
    for (name, value) in crate::program::parameters(&result) {
        let Ok(axis) = name.trim_start_matches(['f', 'v', 'c']).parse::<usize>() else { continue };
        let expected = if name.starts_with("fv") { VISCOUS } else { COULOMB }[axis - 1];
        assert!((value / expected - 1.0).abs() < 0.03, "{name}: {value}, stated {expected}");
    }
}
