//! A URDF in place of a robot file, on a real arm: the KR 300 (tests/data/README.md), whose
//! geometry is written as a URDF here.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::program::{didim, json, repository, succeed};
use didim_dynamics::robot::Robot;
use serde_json::Value;
use tempfile::TempDir;

pub(crate) const SECTION: &str = "\n[urdf]\ndrive_inertia = true\n\
    gear_ratios = [256.85714285714283, 267.42857142857144, 252.33333333333334, 221.0, \
    239.61904761904762, 154.3231343283582]\n\
    friction = { viscous = true, coulomb = true, offset = true, sign = { model = \"tanh\", \
    width_rad_s = 0.02 } }\n";

/// The joints of the robot file as those of a URDF, with a camera on the way and a flange at the
/// end.
fn urdf() -> String {
    let text = fs::read_to_string(repository("tests/data/kr300/robot.toml")).unwrap();
    let robot = Robot::from_toml(&text).unwrap();
    let mut urdf = "<robot name=\"kr300\">\n<link name=\"link_0\"/>\n".to_owned();
    for (k, joint) in (1..).zip(robot.chain()) {
        // RotX(α) TransX(d) TransZ(r) is roll α at (d, −r sin α, r cos α); θ turns about the axis
        // at last.
        let (alpha, theta, r) = (joint.alpha, joint.theta, joint.r_m);
        let limits = joint.limits;
        writeln!(
            urdf,
            "<link name=\"frame_{k}\"/><link name=\"link_{k}\"/>\n<joint name=\"turn_{k}\" \
             type=\"fixed\"><parent link=\"link_{}\"/><child link=\"frame_{k}\"/><origin \
             xyz=\"{:?} {:?} {:?}\" rpy=\"{:?} 0 0\"/></joint>\n<joint name=\"a{k}\" \
             type=\"revolute\"><parent link=\"frame_{k}\"/><child link=\"link_{k}\"/><origin \
             rpy=\"0 0 {:?}\"/><axis xyz=\"0 0 1\"/><limit lower=\"{:?}\" upper=\"{:?}\" \
             velocity=\"3\" effort=\"10000\"/></joint>",
            k - 1,
            joint.d_m,
            -r * alpha.sin,
            r * alpha.cos,
            alpha.sin.atan2(alpha.cos),
            theta.sin.atan2(theta.cos),
            limits.position_min,
            limits.position_max,
        )
        .unwrap();
    }
    urdf += "<link name=\"flange\"/><link name=\"camera\"/>\n\
        <joint name=\"f\" type=\"fixed\"><parent link=\"link_6\"/><child link=\"flange\"/><origin \
        xyz=\"0 0 0.1\"/></joint>\n\
        <joint name=\"c\" type=\"fixed\"><parent link=\"link_3\"/><child \
        link=\"camera\"/></joint>\n</robot>\n";
    urdf
}

/// A folder with the arm's cell, on a URDF, with what the cell says of it.
pub(crate) fn cell(section: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("arm.urdf"), urdf()).unwrap();
    let text = fs::read_to_string(repository("tests/data/kr300/cell.toml")).unwrap();
    let text = text.replace("../../../config", repository("config").to_str().unwrap());
    let text = text.replace("robot = \"robot.toml\"", "robot = \"arm.urdf\"");
    fs::write(folder.path().join("cell.toml"), text + section).unwrap();
    folder
}

pub(crate) fn identify(cell: &Path) -> Value {
    let [a, b] = ["a.csv", "b.csv"].map(|file| repository("tests/data/kr300").join(file));
    let arguments: [&dyn AsRef<OsStr>; 12] = [
        &"identify",
        &"--json",
        &"--cell",
        &cell,
        &"--input",
        &a,
        &"--input",
        &b,
        &"--from",
        &"1.8",
        &"--to",
        &"8.196",
    ];
    json(&succeed(&arguments))
}

#[test]
fn a_urdf_identifies_as_the_robot_file_of_the_same_arm() {
    let folder = cell(SECTION);
    let of_urdf = identify(&folder.path().join("cell.toml"));
    let of_file = identify(&repository("tests/data/kr300/cell.toml"));
    let figure = |of: &Value, key: &str| of[key].as_f64().unwrap();
    for key in ["relative_error", "samples", "rows"] {
        let [one, other] = [&of_urdf, &of_file].map(|of| figure(of, key));
        assert!((one / other - 1.0).abs() < 1e-9, "{key}: {one} {other}");
    }
    // The offsets along axes 2 and 3, which cancel, are left out: link 2 has another origin, the
    // others the same.
    let value = |of: &Value, name: &str| {
        let parameters = of["parameters"].as_array().unwrap();
        figure(parameters.iter().find(|p| p["name"] == name).unwrap(), "value")
    };
    assert_eq!(of_urdf["parameters"].as_array().unwrap().len(), 58);
    for name in ["zz1r", "ia3", "fv1", "fc2", "zz3r", "mx3r", "my4r", "xx5r", "off6"] {
        let [one, other] = [&of_urdf, &of_file].map(|of| value(of, name));
        assert!((one - other).abs() < 1e-6 * other.abs().max(1.0), "{name}: {one} {other}");
    }
    let checked =
        didim(&[&"check", &"--cell", &folder.path().join("cell.toml"), &"--other-machine"]);
    let said = checked.stdout;
    assert!(
        said.contains("the link `link_1` has no inertial: there are no nominal parameters"),
        "{said}"
    );
}

#[test]
fn what_a_urdf_does_not_say_is_asked_for_with_the_lines_to_paste() {
    fn refused(section: &str) -> String {
        let folder = cell(section);
        let out =
            didim(&[&"check", &"--cell", &folder.path().join("cell.toml"), &"--other-machine"]);
        assert_eq!(out.code, Some(78));
        out.stderr
    }
    let said = refused("");
    assert!(said.contains("a URDF does not describe the drives of a1 a2 a3 a4 a5 a6"), "{said}");
    let (_, pasted) = said.split_once("\n\n").unwrap();
    assert!(pasted.contains("gear_ratios = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"), "{said}");
    let folder = cell(&format!("\n{pasted}"));
    succeed(&[&"check", &"--cell", &folder.path().join("cell.toml"), &"--other-machine"]);
    assert!(refused("\n[urdf]\ndrive_inertia = true\n").contains("gear_ratios = ["));
    let few = SECTION.replace("256.85714285714283, ", "");
    assert!(refused(&few).contains("has 5 entries for 6 driven joints"), "{}", refused(&few));
    let none = SECTION.replace("256.85714285714283", "0.0");
    assert!(
        refused(&none).contains("`urdf.gear_ratios`: has an entry that is 0"),
        "{}",
        refused(&none)
    );
    let unknown = SECTION.replace("offset = true", "offsets = true");
    let said = refused(&unknown);
    // With the line of the cell, not one of the robot file that comes of it.
    fn line(text: &str, key: &str) -> i32 {
        let folder = cell(text);
        let text = fs::read_to_string(folder.path().join("cell.toml")).unwrap();
        let begins = text.lines().zip(1..).filter(|(line, _)| line.trim_start().starts_with(key));
        begins.last().unwrap().1
    }
    let place = format!("cell.toml: line {}: `urdf.friction`: ", line(&unknown, "friction"));
    assert!(said.contains(&place) && said.contains("did you mean `offset`?"), "{said}");
    let joint = |name: &str, own: &str| format!("{SECTION}\n[urdf.joints.{name}]\n{own}\n");
    for (name, own, expected) in [
        (
            "a7",
            "friction = {}",
            "`urdf.joints.a7`: is no driven joint of the arm; these are: a1 a2",
        ),
        (
            "a2",
            "friction = { kwadratic = true }",
            "`urdf.joints.a2.friction`: unknown field `kwadratic`",
        ),
        ("a2", "drive_inertia = 3", "`urdf.joints.a2.drive_inertia`: invalid type"),
        (
            "a2",
            "known_torque = { position_deg = [0, 1], torque_nm = [1] }",
            "`urdf.joints.a2.known_torque`: ",
        ),
        ("a2", "acceleration_max_rad_s2 = -1.0", "`urdf.joints.a2.acceleration_max_rad_s2`: "),
        ("a2", "jerk_max_m_s3 = 1.0", "use `jerk_max_rad_s3`"),
        ("a2", "d_m = 1.0", "`urdf.joints.a2.d_m`: is not for a joint of a URDF"),
    ] {
        let text = joint(name, own);
        let said = refused(&text);
        let key = if name == "a7" { "[urdf.joints" } else { own.split(' ').next().unwrap() };
        let place = format!("cell.toml: line {}: `urdf.joints.{name}", line(&text, key));
        assert!(said.contains(expected) && said.contains(&place), "{said}\n{place}");
    }
    let other = SECTION.replace("[urdf]", "[urdf]\ntip = \"hand\"");
    assert!(refused(&other).contains("the tip `hand` is no link of the URDF"));
}

/// What a cell states of single joints is what a robot file states of them.
#[test]
fn joints_of_a_urdf_have_of_their_own_what_those_of_a_robot_file_have() {
    let own_joints = "a2 = { friction = { quadratic = true }, known_torque = { position_deg = \
        [-90, 90], torque_nm = [-3, 3] } }\n\
        a4 = { drive_inertia = false, acceleration_max_rad_s2 = 5.0 }\n";
    let (section, _) = SECTION.split_once("gear_ratios").unwrap();
    let (_, friction) = SECTION.split_once("friction").unwrap();
    let ones = "gear_ratios = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]";
    let folder = cell(&format!("{section}{ones}\nfriction{friction}\n[urdf.joints]\n{own_joints}"));
    let described = didim::cell::Cell::read(&folder.path().join("cell.toml")).unwrap();
    // As earlier versions had it.
    let earlier = own_joints.replace("a2 = { friction = { quadratic = true }, ", "a2 = { ")
        + "[urdf.joint_friction]\na2 = { quadratic = true }\n";
    let earlier = cell(&format!("{section}{ones}\nfriction{friction}\n[urdf.joints]\n{earlier}"));
    let earlier = didim::cell::Cell::read(&earlier.path().join("cell.toml")).unwrap();
    assert_eq!(described.robot_as_described, earlier.robot_as_described);
    let text = succeed(&[&"robot", &folder.path().join("arm.urdf"), &"--toml"]);
    let mut joints: Vec<String> = text.split("[[joint]]").map(str::to_owned).collect();
    joints[2] += "friction = { quadratic = true }\nknown_torque = { position_deg = [-90, 90], \
        torque_nm = [-3, 3] }\n";
    joints[4] = joints[4].replace("drive_inertia = true", "drive_inertia = false")
        + "acceleration_max_rad_s2 = 5.0\n";
    let expected = Robot::from_toml(&joints.join("[[joint]]")).unwrap();
    // A robot file has no names of links.
    let without_frames = described.robot_as_described.with_frames(Vec::new());
    assert_eq!(without_frames.with_link_names(Vec::new()), expected);
    // One more for the quadratic friction, one less for the inertia of the fourth drive.
    assert_eq!(described.base.names().len(), 58);
    assert!(!described.base.names().contains(&"ia4".to_owned()));
}

#[test]
fn an_arm_is_shown_drawn_and_written_as_a_robot_file() {
    let folder = cell("");
    let path_of = |name: &str| folder.path().join(name);
    let said = succeed(&[&"robot", &path_of("arm.urdf"), &"--picture", &path_of("arm.svg")]);
    for expected in [
        "kr300: 6 joints, a URDF from link_0 to flange; gravity 0  0  9.81 m/s²",
        "3 a3",
        "1.35  0  −1.109",
        "flange in the frame of link_0   1.49  0  1.784 m",
        "58 base parameters:",
        "note: the link `link_1` has no inertial",
    ] {
        assert!(said.contains(expected), "{expected}\n{said}");
    }
    let svg = fs::read_to_string(path_of("arm.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("joint 3 a3 turns about this axis"));
    assert_eq!(svg.matches("polyline").count(), 3);
    let toml = succeed(&[&"robot", &path_of("arm.urdf"), &"--toml"]);
    fs::write(path_of("arm.toml"), &toml).unwrap();
    let again = succeed(&[&"robot", &path_of("arm.toml")]);
    assert!(again.contains("58 base parameters:"));
    let out = didim(&[&"robot", &path_of("arm.toml"), &"--tip", &"flange"]);
    assert_eq!(out.code, Some(2));
    let other = didim(&[&"robot", &path_of("arm.urdf"), &"--tip", &"hand"]);
    assert_eq!(other.code, Some(78));
}
