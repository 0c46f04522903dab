//! Exported arms, read back.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{FrictionLaw, JointIndex, ParameterKind, Robot};
use didim_formats::{
    ExportError, ExportKind, ExportModel, LeftOut, UrdfArm, UrdfDrives, UrdfError, UrdfNote,
    UrdfValues, WRITTEN_BY, to_matlab, to_mjcf, to_robot_file, to_urdf,
};
use didim_identification::feasibility::Body;
use nalgebra::Matrix4;
use serde::Deserialize;

/// Numbers of a sequence without pattern, between −1 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// One that can be, of some kilogrammes.
    fn body(&mut self) -> Body {
        let root = Matrix4::from_fn(|row, _| self.next() * if row == 3 { 1.5 } else { 0.3 });
        Body::from_pseudo_inertia(&(root * root.transpose() + Matrix4::identity() * 1e-3))
    }
}

fn robot_text(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots").join(file);
    fs::read_to_string(path).unwrap()
}

/// Possible bodies, and drives with inertia and friction.
fn standard(robot: &Robot, random: &mut Random) -> Vec<f64> {
    let mut values = Vec::new();
    for parameter in robot.parameters().parameters() {
        match parameter.kind {
            ParameterKind::Xx => values.extend(random.body().parameters()),
            kind if ParameterKind::LINK.contains(&kind) => {}
            // Less than the joint's own, as the motor is one of those that move it.
            ParameterKind::FvMotor | ParameterKind::FcMotor => {
                values.push(0.1 + 0.05 * random.next())
            }
            _ => values.push(1.0 + 0.5 * random.next()),
        }
    }
    values
}

/// A robot file whose drives have neither inertia nor friction.
fn bodies_alone(arm: &UrdfArm) -> Robot {
    let joints = arm.joints();
    let friction =
        "viscous = true\ncoulomb = true\noffset = false\nsign = { model = \"sign\" }\n".to_owned();
    let drives = UrdfDrives {
        gravity_m_s2: None,
        drive_inertia: false,
        gear_ratios: UrdfDrives::rows_of_ratios(&vec![1.0; joints]),
        friction,
        joints: BTreeMap::new(),
    };
    let text = arm.to_toml(&drives);
    Robot::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The largest difference of torques over random states, relative to the largest torque.
fn difference(a: (&Robot, &[f64]), b: (&Robot, &[f64]), random: &mut Random) -> f64 {
    let n = a.0.joints();
    let [a, b] = [a, b].map(|(robot, standard)| (Model::new(robot), standard));
    let (mut ws, mut worst, mut largest) = (Workspace::new(), 0.0_f64, 0.0_f64);
    for _ in 0..50 {
        let [q, dq, ddq] =
            [3.0, 5.0, 30.0].map(|size| (0..n).map(|_| size * random.next()).collect::<Vec<_>>());
        let [remaining, right] = [&a, &b].map(|(model, standard)| {
            let mut tau = vec![0.0; n];
            model.inverse_dynamics(&mut ws, standard, &q, &dq, &ddq, &mut tau);
            tau
        });
        for (rest, right) in remaining.iter().zip(&right) {
            (worst, largest) = (worst.max((rest - right).abs()), largest.max(rest.abs()));
        }
    }
    worst / largest
}

/// Without what a URDF cannot hold.
fn as_urdf_holds(robot: &Robot, standard: &[f64]) -> Vec<f64> {
    let parameters = robot.parameters().parameters().iter().zip(standard);
    let is_held = |kind| {
        ParameterKind::LINK.contains(&kind)
            || [ParameterKind::Fv, ParameterKind::Fc].contains(&kind)
    };
    parameters
        .map(|(parameter, value)| if is_held(parameter.kind) { *value } else { 0.0 })
        .collect()
}

#[test]
fn a_new_urdf_has_the_torques_of_the_robot() {
    let mut random = Random(11);
    let mut files = 0;
    for file in
        fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots")).unwrap()
    {
        let text = fs::read_to_string(file.unwrap().path()).unwrap();
        // A URDF has no place for a spring.
        let lines = text.lines().filter(|line| !line.starts_with("known_torque"));
        let robot = Robot::from_toml(&lines.collect::<Vec<_>>().join("\n")).unwrap();
        // Only the law that a URDF means.
        let robot = robot.with_sign_model(didim_dynamics::robot::SignModel::Sign);
        let standard = standard(&robot, &mut random);
        let origin = ["An arm -- of a test.".to_owned()];
        let model = ExportModel { robot: &robot, standard_parameters: &standard, origin: &origin };
        let urdf = to_urdf(&model).unwrap();
        assert!(urdf.contains("An arm - - of a test."));
        let arm =
            UrdfArm::read(&urdf, None, None).unwrap_or_else(|error| panic!("{error}\n{urdf}"));
        let read = bodies_alone(&arm);
        let held_kinds = as_urdf_holds(&robot, &standard);
        let nominal = read.nominal().unwrap().standard_parameters();
        let worst = difference((&robot, &held_kinds), (&read, nominal), &mut random);
        assert!(worst < 1e-12, "{}: {worst}", robot.name());
        for (own, other) in robot.limits().zip(read.limits()) {
            // Degrees in a robot file.
            assert!((own.position_max - other.position_max).abs() < 1e-12, "{}", robot.name());
            assert_eq!(own.velocity_max, other.velocity_max, "{}", robot.name());
            // With these random masses an effort can be less than the weight.
            let is_placeholder =
                |note: &UrdfNote| matches!(note, UrdfNote::PlaceholderEffort { .. });
            if other.torque_max.is_some() || !arm.notes().iter().any(is_placeholder) {
                assert_eq!(own.torque_max, other.torque_max, "{}", robot.name());
            }
        }
        files += 1;
    }
    assert!(files >= 11, "{files}");
}

/// The values of the text are those that were given, in every robot of the library.
#[test]
fn every_robot_file_takes_new_nominal_values() {
    let (mut random, mut files) = (Random(29), 0);
    for file in
        fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/robots")).unwrap()
    {
        let text = fs::read_to_string(file.unwrap().path()).unwrap();
        let robot = Robot::from_toml(&text).unwrap();
        let standard = standard(&robot, &mut random);
        let model = ExportModel { robot: &robot, standard_parameters: &standard, origin: &[] };
        let written = to_robot_file(&model, &text).unwrap();
        let again = Robot::from_toml(&written).unwrap_or_else(|error| panic!("{error}\n{written}"));
        assert_eq!(again.nominal().unwrap().standard_parameters(), standard, "{}", robot.name());
        let worst = difference((&robot, &standard), (&again, &standard), &mut random);
        assert!(worst < 1e-15, "{}: {worst}", robot.name());
        files += 1;
    }
    assert!(files >= 11, "{files}");
}

#[derive(Deserialize)]
struct Golden {
    arm: Vec<GoldenArm>,
}

#[derive(Deserialize)]
struct GoldenArm {
    urdf: String,
}

/// Odd frames, fixed links between, sliding axes, a gripper that is held still.
#[test]
fn a_file_of_ones_own_has_the_new_bodies() {
    let golden: Golden = toml::from_str(include_str!("golden/urdf.toml")).unwrap();
    let (mut random, mut fixed) = (Random(5), 0);
    for arm in &golden.arm {
        let read = UrdfArm::read(&arm.urdf, Some("base"), Some("tip")).unwrap();
        fixed +=
            usize::from(read.notes().iter().any(|note| matches!(note, UrdfNote::HeldStill { .. })));
        let n = read.joints();
        let drive = bodies_alone(&read);
        let nominal = drive.nominal().unwrap().standard_parameters().to_vec();
        let parameters = drive.parameters().parameters();
        let width = parameters.len() / n;
        // Heavier than all that is held still.
        let link_bodies: Vec<Body> = (0..n)
            .map(|link| {
                let ten: [f64; 10] = nominal[link * width..link * width + 10].try_into().unwrap();
                let (old, more) = (Body::from_parameters(ten), random.body());
                Body {
                    mass_kg: old.mass_kg + more.mass_kg,
                    first_moment: old.first_moment + more.first_moment,
                    inertia: old.inertia + more.inertia,
                }
            })
            .collect();
        let mut friction = || (0..n).map(|_| Some(1.0 + random.next())).collect::<Vec<_>>();
        let values = UrdfValues { damping: friction(), friction: friction(), link_bodies };
        let text = read.with_values(&values, &["A remark.".to_owned()]).unwrap();
        let again = UrdfArm::read(&text, Some("base"), Some("tip"))
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let again = bodies_alone(&again);
        let wanted: Vec<f64> = (0..n)
            .flat_map(|joint| {
                let drive = [values.damping[joint].unwrap(), values.friction[joint].unwrap()];
                values.link_bodies[joint].parameters().into_iter().chain(drive)
            })
            .collect();
        let nominal = again.nominal().unwrap().standard_parameters();
        assert_eq!(nominal.len(), wanted.len());
        for (found, wanted) in nominal.iter().zip(&wanted) {
            assert!((found - wanted).abs() < 1e-11 * (1.0 + wanted.abs()), "{found} {wanted}");
        }
    }
    assert!(golden.arm.len() == 22 && fixed > 0, "{fixed}");
}

const OWN: &str = r#"<?xml version="1.0"?>
<robot name="two">
  <!-- mine -->
  <link name="base"/>
  <link name="upper" ><visual/>
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <link name="flange">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision/>
  </link>
  <link name="lower"/>
  <joint name="weld" type="fixed"><parent link="upper"/><child link="flange"/></joint>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="2" effort="50"/>
    <dynamics friction='3'/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="2" effort="50"/>
  </joint>
</robot>
"#;

const WRITTEN: &str = r#"<?xml version="1.0"?>
<robot name="two">
  <!--
    A remark.
  -->
  <!-- mine -->
  <link name="base"/>
  <link name="upper" ><visual/>
    <inertial>
      <origin xyz="0.0 0.0 0.5" rpy="0 0 0"/>
      <mass value="4.0"/>
      <inertia ixx="2.0" ixy="0.0" ixz="0.0" iyy="2.0" iyz="0.0" izz="3.0"/>
    </inertial>
  </link>
  <link name="flange">
    <collision/>
  </link>
  <link name="lower">
    <inertial>
      <origin xyz="0.0 0.0 0.5" rpy="0 0 0"/>
      <mass value="4.0"/>
      <inertia ixx="2.0" ixy="0.0" ixz="0.0" iyy="2.0" iyz="0.0" izz="3.0"/>
    </inertial>
  </link>
  <joint name="weld" type="fixed"><parent link="upper"/><child link="flange"/></joint>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="2" effort="50"/>
    <dynamics damping="0.25" friction='0.5'/></joint>
  <joint name="elbow" type="revolute">
    <dynamics friction="1.5"/><parent link="upper"/><child link="lower"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="2" effort="50"/>
  </joint>
</robot>
"#;

#[test]
fn all_else_in_a_file_of_ones_own_stays_as_it_was() {
    let arm = UrdfArm::read(OWN, None, None).unwrap();
    // Of 4 kg, half a metre along z of its frame.
    let body = Body::from_parameters([3.0, 0.0, 0.0, 3.0, 0.0, 3.0, 0.0, 0.0, 2.0, 4.0]);
    let values = UrdfValues {
        link_bodies: vec![body, body],
        damping: vec![Some(0.25), None],
        friction: vec![Some(0.5), Some(1.5)],
    };
    let written = arm.with_values(&values, &["A remark.".to_owned()]).unwrap();
    assert_eq!(written, WRITTEN, "{written}");

    let dos = |text: &str| text.replace('\n', "\r\n");
    let arm = UrdfArm::read(&dos(OWN), None, None).unwrap();
    let written = arm.with_values(&values, &["A remark.".to_owned()]).unwrap();
    assert_eq!(written, dos(WRITTEN), "{written}");
}

#[test]
fn an_export_takes_the_place_of_an_earlier_one() {
    let body = Body::from_parameters([3.0, 0.0, 0.0, 3.0, 0.0, 3.0, 0.0, 0.0, 2.0, 4.0]);
    let both = vec![Some(0.25); 2];
    let values =
        |damping| UrdfValues { link_bodies: vec![body, body], damping, friction: both.clone() };
    let remarks = |text: &str| vec![WRITTEN_BY.to_owned(), text.to_owned()];
    let arm = UrdfArm::read(OWN, None, None).unwrap();
    let first = arm.with_values(&values(both.clone()), &remarks("a -- b")).unwrap();
    assert!(first.contains("a - - b"), "{first}");
    let arm = UrdfArm::read(&first, None, None).unwrap();
    let second = arm.with_values(&values(both.clone()), &remarks("c---d")).unwrap();
    assert_eq!(second, first.replace("a - - b", "c- - -d"));
    // What a model lacks is in its other parameters.
    let without = arm.with_values(&values(vec![None; 2]), &remarks("a -- b")).unwrap();
    assert_eq!(without, first.replace("damping=\"0.25\"", "damping=\"0.0\""));
}

#[test]
fn what_hangs_on_other_joints_keeps_its_body() {
    let finger = "<link name=\"finger\"><inertial><mass value=\"9\"/><inertia ixx=\"1\" ixy=\"0\" \
        ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n  <joint name=\"grip\" \
        type=\"prismatic\"><parent link=\"lower\"/><child link=\"finger\"/><limit lower=\"0\" \
        upper=\"1\" velocity=\"1\" effort=\"1\"/></joint>\n</robot>";
    let text = OWN.replace("</robot>", finger);
    let arm = UrdfArm::read(&text, None, Some("lower")).unwrap();
    let body =
        |mass: f64| Body::from_parameters([9.0, 0.0, 0.0, 9.0, 0.0, 9.0, 0.0, 0.0, 0.0, mass]);
    let values = |mass| UrdfValues {
        link_bodies: vec![body(4.0), body(mass)],
        damping: vec![None; 2],
        friction: vec![None; 2],
    };
    let written = arm.with_values(&values(10.0), &[]).unwrap();
    assert!(
        written.contains("<mass value=\"9\"/>") && written.contains("<mass value=\"1.0\"/>"),
        "{written}"
    );
    let refused = arm.with_values(&values(8.0), &[]).unwrap_err();
    assert_eq!(refused, UrdfError::NothingLeft { link: "lower".to_owned() });
    // Nobody knows what to take off.
    let text = text.replace(
        "ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" \
        izz=\"1\"/></inertial></link>\n  <joint name=\"grip",
        "ixx=\"9\" ixy=\"0\" ixz=\"0\" \
            iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>\n  <joint name=\"grip",
    );
    let arm = UrdfArm::read(&text, None, Some("lower")).unwrap();
    let refused = arm.with_values(&values(10.0), &[]).unwrap_err();
    assert_eq!(refused, UrdfError::ImpossibleHeld { link: "finger".to_owned() });
}

#[test]
fn a_robot_file_has_the_new_values_and_all_else() {
    let text = robot_text("tx40.toml");
    let robot = Robot::from_toml(&text).unwrap();
    let standard = standard(&robot, &mut Random(3));
    let origin = ["From a test.".to_owned()];
    let model = ExportModel { robot: &robot, standard_parameters: &standard, origin: &origin };
    let written = to_robot_file(&model, &text).unwrap();
    let read = Robot::from_toml(&written).unwrap();
    assert_eq!(read.nominal().unwrap().standard_parameters(), standard);
    assert_eq!(read.chain(), robot.chain());
    assert!(written.starts_with("# From a test.\n"));
    let dos = to_robot_file(&model, &text.replace('\n', "\r\n")).unwrap();
    assert_eq!(dos, written.replace('\n', "\r\n"));
    let spaced = to_robot_file(&model, &text.replace("[nominal]", "[ nominal ] # of [1]")).unwrap();
    assert_eq!(spaced, written);
    let comments = |of: &str| of.lines().filter(|line| line.starts_with('#')).count();
    assert!(comments(&written) > comments(&text) / 2);

    // With friction that the data chose.
    let laws = vec![robot.own_friction()[0].with_law(FrictionLaw::Quadratic); 6];
    let other = robot.clone().with_friction(laws);
    let values = self::standard(&other, &mut Random(4));
    let model = ExportModel { robot: &other, standard_parameters: &values, origin: &[] };
    let remarks = [WRITTEN_BY.to_owned(), "And more.".to_owned()];
    let model = ExportModel { origin: &remarks, ..model };
    let first = to_robot_file(&model, &text).unwrap();
    let again = to_robot_file(&model, &first).unwrap();
    assert_eq!(Robot::from_toml(&again).unwrap().own_friction(), other.own_friction());
    assert_eq!(again, first);
}

#[test]
fn what_cannot_be_exported_is_refused_or_listed() {
    let robot = Robot::from_toml(&robot_text("tx40.toml")).unwrap();
    let mut values = standard(&robot, &mut Random(3));
    let model = ExportModel { robot: &robot, standard_parameters: &values, origin: &[] };
    let omitted = LeftOut::list(&model, ExportKind::Urdf);
    let names = |remaining: &[LeftOut]| {
        remaining.iter().filter_map(|of| of.name.clone()).collect::<Vec<_>>().join(" ")
    };
    let omitted_names = names(&omitted);
    assert!(
        omitted_names.contains("ia1")
            && omitted_names.contains("fv_m6")
            && omitted_names.contains("off3"),
        "{omitted_names}"
    );
    let by_mjcf = names(&LeftOut::list(&model, ExportKind::Mjcf));
    assert!(!by_mjcf.contains("ia1") && !by_mjcf.contains("fv_m6") && by_mjcf.contains("off3"));
    assert!(to_mjcf(&model).unwrap().contains("<fixed name=\"motor_6\""));
    assert!(to_matlab(&model, "arm").unwrap().contains("arm.drive.fv_m6"));
    let text = robot_text("tx40.toml");
    let spring =
        "[[joint]]\nknown_torque = { position_deg = [-180.0, 180.0], torque_nm = [30.0, -30.0] }";
    let sprung = Robot::from_toml(&text.replacen("[[joint]]", spring, 1)).unwrap();
    let sprung = ExportModel { robot: &sprung, standard_parameters: &values, origin: &[] };
    let omitted = LeftOut::list(&sprung, ExportKind::Parameters);
    let loaded = vec![robot.own_friction()[0].with_law(FrictionLaw::Load); 6];
    let loaded = robot.clone().with_friction(loaded);
    let with_loads = standard(&loaded, &mut Random(5));
    let loaded = ExportModel { robot: &loaded, standard_parameters: &with_loads, origin: &[] };
    for (holder, listed) in
        [(ExportKind::Urdf, 6), (ExportKind::Mjcf, 6), (ExportKind::Parameters, 0)]
    {
        let omitted = LeftOut::list(&loaded, holder);
        let by_load =
            omitted.iter().filter(|of| of.name.as_ref().is_some_and(|n| n.starts_with("fcl")));
        assert_eq!(by_load.filter(|of| of.unit == "1").count(), listed, "{holder:?}");
    }
    assert!(to_matlab(&loaded, "arm").unwrap().contains("arm.drive.fcl6"));
    assert!(
        matches!(omitted.as_slice(), [LeftOut { joint, name: None, .. }] if joint.position() == 0),
        "{omitted:?}"
    );
    assert!(to_matlab(&sprung, "arm").unwrap().contains("% left out: additional torque"));
    for name in ["kr-300", "1st", "end", "a b", "", &"a".repeat(64)] {
        let refused = to_matlab(&model, name).unwrap_err();
        assert_eq!(refused, ExportError::FunctionName { name: name.to_owned() });
    }

    let column = |kind, joint| robot.parameters().column(kind, joint).unwrap();
    values[column(ParameterKind::FvMotor, JointIndex::new(5))] = 3.0;
    let model = ExportModel { robot: &robot, standard_parameters: &values, origin: &[] };
    let refused = to_mjcf(&model).unwrap_err();
    assert!(
        matches!(refused, ExportError::Negative { joint, .. } if joint.position() == 4),
        "{refused}"
    );
    values[column(ParameterKind::M, JointIndex::new(2))] = -1.0;
    let model = ExportModel { robot: &robot, standard_parameters: &values, origin: &[] };
    assert_eq!(to_urdf(&model), Err(ExportError::NoBody { link: 3 }));
    assert_eq!(to_matlab(&model, "arm"), Err(ExportError::NoBody { link: 3 }));
}

/// The exported files of every robot, as they were read by Pinocchio and MuJoCo
/// (`golden/export.py`): two of them stand in `golden/export`. With `DIDIM_WRITE_EXPORTS` all are
/// written into the folder that it names.
#[test]
fn exported_files_are_those_that_other_programs_have_read() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/export");
    let folder = std::env::var_os("DIDIM_WRITE_EXPORTS").map(std::path::PathBuf::from);
    let mut compared = 0;
    for name in [
        "tx40",
        "panda",
        "ur5e",
        "ur10e",
        "fr3",
        "iiwa7",
        "iiwa14",
        "kr300-r2700-2",
        "piper",
        "openarm",
    ] {
        let robot = Robot::from_toml(&robot_text(&format!("{name}.toml"))).unwrap();
        let mut random = Random(29);
        let standard = standard(&robot, &mut random);
        let origin = ["Bodies of chance.".to_owned()];
        let model = ExportModel { robot: &robot, standard_parameters: &standard, origin: &origin };
        let files = [
            ("urdf", to_urdf(&model).unwrap()),
            ("mjcf", to_mjcf(&model).unwrap()),
            ("m", to_matlab(&model, &name.replace('-', "_")).unwrap()),
            ("txt", states(&robot, &standard, &mut random)),
        ];
        for (ending, text) in files {
            let file = format!("{name}.{ending}");
            if let Some(folder) = &folder {
                fs::write(folder.join(file), text).unwrap();
            } else if let Ok(expected) = fs::read_to_string(golden.join(&file)) {
                assert_eq!(
                    text, expected,
                    "{file}: write all with DIDIM_WRITE_EXPORTS, and run golden/export.py"
                );
                compared += 1;
            }
        }
    }
    assert!(folder.is_some() || compared == 8, "{compared}");
}

/// q, q̇, q̈, the torques of the bodies, and those of bodies, drive inertias and viscous friction:
/// a line each.
fn states(robot: &Robot, standard: &[f64], random: &mut Random) -> String {
    use didim_dynamics::robot::ParameterKind::{Fv, FvMotor, Ia};

    let (model, n) = (Model::new(robot), robot.joints());
    fn only(kinds: &[ParameterKind], standard: &&[f64], robot: &Robot) -> Vec<f64> {
        let masked = robot.parameters().parameters().iter().zip(*standard);
        masked.map(|(p, value)| if kinds.contains(&p.kind) { *value } else { 0.0 }).collect()
    }
    let link_bodies = only(&ParameterKind::LINK, &standard, robot);
    let drives = only(&[&ParameterKind::LINK[..], &[Ia, Fv, FvMotor]].concat(), &standard, robot);
    let (mut text, mut ws) = (String::new(), Workspace::new());
    for _ in 0..10 {
        let [q, dq, ddq] =
            [2.0, 3.0, 10.0].map(|size| (0..n).map(|_| size * random.next()).collect::<Vec<_>>());
        let torques = [&link_bodies, &drives].map(|parameters| {
            let mut tau = vec![0.0; n];
            model.inverse_dynamics(&mut ws, parameters, &q, &dq, &ddq, &mut tau);
            tau
        });
        for row in [&q, &dq, &ddq, &torques[0], &torques[1]] {
            let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
            text += &(row.join(" ") + "\n");
        }
    }
    text
}
