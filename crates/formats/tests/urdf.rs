//! URDF: the same torques as Pinocchio, and a clear error for each that is no arm.

use std::collections::BTreeMap;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};
use didim_formats::{UnreadAttribute, UrdfArm, UrdfDrives, UrdfError, UrdfNote};
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    arm: Vec<GoldenArm>,
}

#[derive(Deserialize)]
struct GoldenArm {
    joints: usize,
    urdf: String,
    tip_m: [f64; 3],
    /// q, q̇, q̈ and τ.
    states: Vec<[Vec<f64>; 4]>,
}

/// Without what a URDF's torques do not have either.
fn links_alone(joints: usize) -> UrdfDrives {
    let friction = "viscous = false\ncoulomb = false\noffset = false\n".to_owned();
    UrdfDrives {
        gravity_m_s2: None,
        drive_inertia: false,
        gear_ratios: UrdfDrives::rows_of_ratios(&vec![1.0; joints]),
        friction,
        joints: BTreeMap::new(),
    }
}

const XACRO: &str = "xmlns:xacro=\"http://www.ros.org/wiki/xacro\"";

#[test]
fn torques_are_those_of_pinocchio() {
    let golden: Golden = toml::from_str(include_str!("golden/urdf.toml")).unwrap();
    let mut worst: f64 = 0.0;
    for arm in &golden.arm {
        let read = UrdfArm::read(&arm.urdf, Some("base"), Some("tip")).unwrap();
        assert_eq!(read.joints(), arm.joints);
        for (own, expected) in read.tip_position_m().iter().zip(arm.tip_m) {
            assert!((own - expected).abs() < 1e-12, "{own} {expected}");
        }
        let text = read.to_toml(&links_alone(arm.joints));
        let robot = Robot::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let (model, mut ws) = (Model::new(&robot), Workspace::default());
        let nominal = robot.nominal().unwrap().standard_parameters();
        for [q, dq, ddq, expected] in &arm.states {
            let mut torque = vec![0.0; arm.joints];
            model.inverse_dynamics(&mut ws, nominal, q, dq, ddq, &mut torque);
            let size = expected.iter().fold(0.0, |size: f64, tau| size.max(tau.abs()));
            for (own, expected) in torque.iter().zip(expected) {
                worst = worst.max((own - expected).abs() / size);
            }
        }
    }
    println!("{worst:.1e} relative");
    assert_eq!(golden.arm.len(), 22);
    assert!(worst < 1e-12, "{worst}");
}

/// The arm with the frames of its last link.
fn robot_of(text: &str) -> Robot {
    let urdf = UrdfArm::read(text, Some("base"), Some("tip")).unwrap();
    let toml = urdf.to_toml(&links_alone(urdf.joints()));
    urdf.with_link_frames(Robot::from_toml(&toml).unwrap())
}

/// The nominal parameters of the last link.
fn last_body(robot: &Robot) -> [f64; 10] {
    let (last, table) = (JointIndex::new(robot.joints() - 1), robot.parameters());
    let standard = robot.nominal().unwrap().standard_parameters();
    ParameterKind::LINK.map(|kind| standard[table.column(kind, last).unwrap()])
}

/// A body on any link of the last axis, given in that link's frame, is the same in the frame with
/// its name: on arms with axes and origins in any direction.
#[test]
fn a_body_on_a_link_has_its_centre_in_the_frame_of_that_link() {
    let golden: Golden = toml::from_str(include_str!("golden/urdf.toml")).unwrap();
    let centre = [0.02, -0.01, 0.12];
    let (mass, [ixx, ixy, ixz, iyy, iyz, izz]) = (3.0, [0.02, 0.001, -0.002, 0.03, 0.003, 0.04]);
    let mut count = 0;
    for arm in &golden.arm {
        let empty = robot_of(&arm.urdf);
        let frames = empty.load_frame(Some("")).unwrap_err().available;
        for name in frames {
            let [x, y, z] = centre;
            let body = format!(
                "<link name=\"load\"><inertial><origin xyz=\"{x} {y} {z}\"/>\
                 <mass value=\"{mass}\"/><inertia ixx=\"{ixx}\" ixy=\"{ixy}\" ixz=\"{ixz}\" \
                 iyy=\"{iyy}\" iyz=\"{iyz}\" \
                 izz=\"{izz}\"/></inertial></link><joint name=\"hold\" type=\"fixed\"><parent \
                 link=\"{name}\"/><child link=\"load\"/></joint></robot>"
            );
            let loaded = robot_of(&arm.urdf.replace("</robot>", &body));
            let (with, without) = (last_body(&loaded), last_body(&empty));
            let frame = empty.load_frame(Some(&name)).unwrap();
            let difference = core::array::from_fn(|k| with[k] - without[k]);
            let own = frame.inverse().parameters_in_link(difference);
            // J about the origin of the link's frame.
            let expected = [
                ixx + mass * (y * y + z * z),
                ixy - mass * x * y,
                ixz - mass * x * z,
                iyy + mass * (x * x + z * z),
                iyz - mass * y * z,
                izz + mass * (x * x + y * y),
                mass * x,
                mass * y,
                mass * z,
                mass,
            ];
            for (own, expected) in own.iter().zip(expected) {
                assert!((own - expected).abs() < 1e-11, "{name}: {own} {expected}");
            }
            let back = frame.point_in_frame(frame.point_in_link(centre));
            assert!(back.iter().zip(centre).all(|(own, of)| (own - of).abs() < 1e-12), "{back:?}");
            count += 1;
        }
        let first = empty.load_frame(None).unwrap().name;
        assert_eq!(empty.link_name(JointIndex::new(arm.joints - 1)), Some(first.as_str()));
    }
    assert!(count > golden.arm.len(), "{count}: the tip is a frame of its own");
}

/// Two driven links; `more` goes into the robot, `inside` into its second joint.
fn two_links(more: &str, inside: &str) -> String {
    let body = "<inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" \
        iyz=\"0\" izz=\"1\"/></inertial>";
    let limit = "<limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"50\"/>";
    format!(
        "<robot name=\"two\">\n<link name=\"base\"/>\n<link name=\"upper\">{body}</link>\n<link \
         name=\"lower\">{body}</link>\n\
         <joint name=\"shoulder\" type=\"revolute\"><parent link=\"base\"/><child \
         link=\"upper\"/><axis xyz=\"0 0 1\"/>{limit}</joint>\n\
         <joint name=\"elbow\" type=\"revolute\"><parent link=\"upper\"/><child \
         link=\"lower\"/><origin xyz=\"0.5 0 0\"/><axis xyz=\"0 1 \
         0\"/>{limit}{inside}</joint>\n{more}</robot>"
    )
}

fn refused(text: &str) -> String {
    UrdfArm::read(text, None, None).unwrap_err().to_string()
}

#[test]
fn what_is_no_arm_is_refused_with_what_to_do() {
    assert!(UrdfArm::read(&two_links("", ""), None, None).is_ok());
    let link = |name: &str| format!("<link name=\"{name}\"/>");
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child \
            link=\"{child}\"/></joint>"
        )
    };
    let moving = |name: &str, parent: &str, child: &str| {
        joint(name, "revolute", parent, child).replace(
            "</joint>",
            "<limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"5\"/></joint>",
        )
    };
    let arm_text = two_links("", "");
    let cases = [
        ("<robot".to_owned(), "it is no XML"),
        (" \n".to_owned(), "it has no element"),
        (
            format!("<!DOCTYPE robot [<!ENTITY pi \"3.14\">]>{}", two_links("", "")),
            "it has a document type",
        ),
        ("<sdf/>".to_owned(), "give a URDF"),
        (
            two_links(&(0..1000).map(|k| link(&format!("x{k}"))).collect::<String>(), ""),
            "it has more than 1000 links or joints",
        ),
        ("<robot/>".to_owned(), "no name"),
        ("<robot name=\"a\"/>".to_owned(), "<robot> has no link"),
        (
            format!("<robot name=\"a\" {XACRO}>\n<xacro:macro name=\"m\" params=\"x\"/></robot>"),
            "line 2: this is a xacro file: it contains `<xacro:macro>`. Source the robot's \
             packages, expand the file with `xacro FILE > arm.urdf`",
        ),
        (
            format!("<robot name=\"a\" {XACRO}><xacro:property name=\"m\" value=\"2\"/></robot>"),
            "it contains `<xacro:property>`. Source",
        ),
        (
            format!(
                "<robot name=\"a\" {XACRO}><xacro:include filename=\"$(find \
                arm)/a.xacro\"/></robot>"
            ),
            "it contains `<xacro:include>`. Source",
        ),
        (
            "<robot name=\"a\">\n\n<xacro:include filename=\"a.xacro\"/></robot>".to_owned(),
            "line 3: this is a xacro file",
        ),
        (
            arm_text.replace("effort=\"50\"", "effort=\"${effort}\""),
            "this is a xacro file: it contains `${effort}`",
        ),
        (two_links(&link("upper"), ""), "the link `upper` is there twice"),
        (two_links(&moving("elbow", "upper", "lower"), ""), "the joint `elbow` is there twice"),
        (two_links("<link/>", ""), "<link> has no name"),
        (
            two_links(&joint("x", "ball", "lower", "upper"), ""),
            "the type \"ball\" of joint `x` does not exist",
        ),
        (
            two_links(&joint("x", "fixed", "lower", "hand"), ""),
            "names the link `hand`, which is not there",
        ),
        (
            two_links(&joint("x", "fixed", "lower", "upper"), ""),
            "closes a loop at the link `upper`",
        ),
        (two_links(&joint("x", "fixed", "lower", "base"), ""), "closes a loop"),
        (two_links(&link("other"), ""), "no joint leads to any of the links base other"),
        (
            two_links(&format!("{}{}", link("finger"), moving("f", "upper", "finger")), ""),
            "could end at any of the links upper (before the fork of a gripper) lower finger; name",
        ),
        (
            two_links(&format!("{}{}", link("cart"), joint("x", "floating", "lower", "cart")), ""),
            "joint `x` is floating",
        ),
        (two_links("", "<mimic joint=\"shoulder\"/>"), "joint `elbow` follows `shoulder`"),
        (
            arm_text.replace("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>"),
            "joint `elbow` has the axis `0 0 0`, which is no direction",
        ),
        (arm_text.replace("0.5 0 0", "0.5 0"), "`0.5 0` of `xyz` is not three numbers"),
        (
            arm_text.replace("0.5 0 0\"", "0.5 0 0\" rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\""),
            "line 6: the rotation of <origin> (`rpy` and `quat_xyzw`) is there twice",
        ),
        (
            arm_text.replace("0.5 0 0\"", "0.5 0 0\" quat_xyzw=\"0 0 0 0\""),
            "`0 0 0 0` of `quat_xyzw` is not a quaternion of length 1",
        ),
        (arm_text.replace("0.5 0 0", "0.5 0 inf"), "not three numbers"),
        (arm_text.replace("effort=\"50\"", "effort=\"-50\""), "effort below 0"),
        (arm_text.replace("upper=\"1\"", "upper=\"-1\""), "a range from -1 to -1"),
        (
            arm_text.replace("<limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"50\"/>", ""),
            "no limits",
        ),
        (arm_text.replace("type=\"revolute\"", "type=\"fixed\""), "0 joints move between"),
    ];
    for (text, expected) in cases {
        let said = refused(&text);
        assert!(said.contains(expected), "{said}\nis not: {expected}");
    }
    let missing = UrdfArm::read(&arm_text, None, Some("hand")).unwrap_err();
    assert!(
        missing
            .to_string()
            .contains("the tip `hand` is no link of the URDF; its links are base upper lower")
    );
    let error = UrdfArm::read(&arm_text, Some("lower"), Some("upper")).unwrap_err();
    assert!(matches!(error, UrdfError::NotConnected { .. }), "{error}");
}

#[test]
fn bodies_that_cannot_be_are_noted_and_there_are_no_nominal_values() {
    let arm_text = two_links("", "");
    fn notes_of(text: &str) -> (bool, Vec<String>) {
        let arm = UrdfArm::read(text, None, None).unwrap();
        let notes: Vec<String> = arm.notes().iter().map(ToString::to_string).collect();
        (arm.to_toml(&links_alone(2)).contains("[nominal]"), notes)
    }
    assert_eq!(notes_of(&arm_text), (true, Vec::new()));
    let upper = |from: &str, to: &str| notes_of(&arm_text.replacen(from, to, 1));
    for (from, to, problem) in [
        ("mass value=\"1\"", "mass value=\"-1\"", "a mass of -1 kg"),
        ("ixx=\"1\"", "ixx=\"3\"", "larger than the sum of the two others"),
        ("ixx=\"1\"", "ixx=\"-1\"", "not positive definite"),
        ("ixy=\"0\" ", "", "no ixy"),
        ("<mass value=\"1\"/>", "", "no mass"),
    ] {
        let (nominal, notes) = upper(from, to);
        assert!(!nominal && notes.len() == 1 && notes[0].contains(problem), "{notes:?}");
        assert!(notes[0].contains("the link `upper`"), "{notes:?}");
    }
    let (start, end) =
        (arm_text.find("<inertial>").unwrap(), arm_text.find("</inertial>").unwrap());
    let (nominal, notes) = notes_of(&format!("{}{}", &arm_text[..start], &arm_text[end + 11..]));
    assert!(!nominal && notes[0].contains("has no inertial"), "{notes:?}");
    // A joint without an end, one outside the chain, axes that are nearly parallel.
    let turning = arm_text.replacen("type=\"revolute\"", "type=\"continuous\"", 1);
    assert!(notes_of(&turning).1[0].contains("turns without end"));
    let nearly = arm_text.replace("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 3e-5 1\"/>");
    assert!(notes_of(&nearly).1[0].contains("3.0e-5 rad from parallel"));
}

/// 3.1416 is half a turn. Taken at its word, axes that should be parallel would meet kilometres
/// away.
#[test]
fn printed_quarter_turns_are_quarter_turns() {
    fn arm(angle: &str) -> UrdfArm {
        let text = two_links("", "").replace(
            "<origin xyz=\"0.5 0 0\"/>",
            &format!("<origin xyz=\"0.5 0 0.1\" rpy=\"{angle} 0 0\"/>"),
        );
        let text = text.replace("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 1\"/>");
        UrdfArm::read(&text, None, None).unwrap()
    }
    let toml = |angle: &str| arm(angle).to_toml(&links_alone(2));
    assert_eq!(toml("3.1416"), toml("3.141592653589793"));
    assert_eq!(toml("-1.5708"), toml("-1.5707963267948966"));
    assert!(toml("3.1416").contains("alpha_deg = 180.0\nd_m = 0.5\n"), "{}", toml("3.1416"));
    // What an arm was calibrated to is not that, but for axes that are all but parallel.
    assert!(toml("1.5718").contains("alpha_deg = 90.0575"), "{}", toml("1.5718"));
    let calibrated = arm("0.0005");
    assert!(calibrated.notes()[0].to_string().contains("5.0e-4 rad from parallel"));
    assert!(calibrated.to_toml(&links_alone(2)).contains("alpha_deg = 0.0\nd_m = 0.5\n"));
}

/// 3.14 is not half a turn. It is noted where axes are nearly parallel or perpendicular by it.
#[test]
fn quarter_turns_with_few_digits_are_noted() {
    fn notes(angle: &str, axis: &str) -> Vec<UrdfNote> {
        let origin = format!("<origin xyz=\"0.5 0 0.1\" rpy=\"{angle} 0 0\"/>");
        let text = two_links("", "").replace("<origin xyz=\"0.5 0 0\"/>", &origin);
        let text = text.replace("<axis xyz=\"0 1 0\"/>", &format!("<axis xyz=\"{axis}\"/>"));
        UrdfArm::read(&text, None, None).unwrap().notes().to_vec()
    }
    for (angle, axis, error) in
        [("3.14", "0 0 1", 1.59e-3), ("-1.57", "0 0 1", 7.96e-4), ("3.14", "0 1 0", 1.59e-3)]
    {
        let notes = notes(angle, axis);
        let [UrdfNote::RoughAngle { joint, text, angle_rad }] = &notes[..] else {
            panic!("{notes:?}")
        };
        assert_eq!((joint.as_str(), text.as_str()), ("elbow", angle));
        assert!((angle_rad / error - 1.0).abs() < 0.01, "{angle_rad}");
    }
    // Exact, calibrated, or without an effect on the angle between the axes.
    for (angle, axis) in
        [("3.141593", "0 0 1"), ("1.5702134", "0 0 1"), ("3.14", "1 0 0"), ("0.78", "0 0 1")]
    {
        assert_eq!(notes(angle, axis), []);
    }
}

/// Offsets of CAD exports cancel to a rest of their last digits.
#[test]
fn offsets_that_cancel_are_zero() {
    fn toml(rest: &str) -> (String, Vec<UrdfNote>) {
        let text = two_links("", "").replace("0.5 0 0", &format!("{rest} 0 0"));
        let arm = UrdfArm::read(&text, None, None).unwrap();
        (arm.to_toml(&UrdfDrives::with_assumed_drives(2)), arm.notes().to_vec())
    }
    let (exact, _) = toml("0");
    let geometry = |toml: &str| toml.split("[nominal]").next().unwrap().to_owned();
    for rest in ["1e-10", "-3e-8", "1e-7", "9e-7"] {
        let (rounded, notes) = toml(rest);
        assert_eq!(geometry(&rounded), geometry(&exact), "{rest}");
        let [UrdfNote::ZeroLength { joint, length_m }] = &notes[..] else { panic!("{notes:?}") };
        let expected: f64 = rest.parse().unwrap();
        assert_eq!(joint, "elbow");
        assert!((length_m.abs() / expected.abs() - 1.0).abs() < 1e-6, "{length_m}");
    }
    assert_eq!(toml("2e-6").1, []);
}

/// Version 1.1 of URDF has quaternions.
#[test]
fn a_quaternion_is_the_rotation_that_it_stands_for() {
    fn toml(rotation: &str) -> String {
        let text = two_links("", "").replace(
            "<origin xyz=\"0.5 0 0\"/>",
            &format!("<origin xyz=\"0.5 0.1 0.2\" {rotation}/>"),
        );
        let body = format!("<inertial><origin xyz=\"0.1 0.2 0.3\" {rotation}/>");
        let text = text.replace("<inertial>", &body).replace("ixx=\"1\"", "ixx=\"1.5\"");
        let arm = UrdfArm::read(&text, None, None).unwrap();
        assert!(arm.notes().is_empty());
        arm.to_toml(&links_alone(2))
    }
    let without_rotation = toml("");
    for (rpy, xyzw) in [
        ("1.5708 0 0", "0.7071068 0 0 0.7071068"),
        ("0 0 -1.5708", "0 0 -0.70711 0.70711"),
        ("1.5708 0 1.5708", "0.5 0.5 0.5 0.5"),
        ("0 3.1416 0", "0 1 0 6.1e-17"),
    ] {
        let rotated = Robot::from_toml(&toml(&format!("quat_xyzw=\"{xyzw}\""))).unwrap();
        let expected = Robot::from_toml(&toml(&format!("rpy=\"{rpy}\""))).unwrap();
        assert_ne!(toml(&format!("rpy=\"{rpy}\"")), without_rotation);
        let [rotated, expected] = [rotated, expected]
            .map(|robot| robot.nominal().unwrap().standard_parameters().to_vec());
        for (own, expected) in rotated.iter().zip(&expected) {
            assert!((own - expected).abs() < 1e-12, "{xyzw}: {own} {expected}");
        }
    }
}

/// An attribute that is ignored may be the one that holds the geometry.
#[test]
fn attributes_that_are_not_read_are_named() {
    let text = two_links("", "<dynamics damping=\"1\" spring=\"2\"/>");
    let text = text.replace("effort=", "acceleration=\"9\" drake:x=\"1\" effort=");
    let arm = UrdfArm::read(&text, None, None).unwrap();
    fn unread(element: &str, attribute: &str, line: usize, places: usize) -> UrdfNote {
        let (element, attribute) = (element.to_owned(), attribute.to_owned());
        UrdfNote::UnreadAttribute(UnreadAttribute { element, attribute, line, places })
    }
    let expected = [unread("limit", "acceleration", 5, 2), unread("dynamics", "spring", 6, 1)];
    assert_eq!(arm.notes(), expected);
}

/// Readers of URDF take a default namespace, prefixes without declaration, a declaration that is
/// not in the first line.
#[test]
fn a_file_that_other_readers_take_is_read() {
    let plain = two_links("", "");
    fn toml(text: &str) -> String {
        UrdfArm::read(text, None, None).unwrap().to_toml(&UrdfDrives::with_assumed_drives(2))
    }
    let declared = "xmlns:xacro=\"http://www.ros.org/wiki/xacro\" xmlns=\"http://a.org/xacro\"";
    for text in [
        plain.replace("<robot ", &format!("<robot {declared} ")),
        two_links("<gazebo><sensor:camera name=\"c\"/><body:m a:b=\"1\"/></gazebo>", ""),
        format!("\n <!-- (c) -->\n<?xml version=\"1.0\" encoding=\"latin1\"?>\n{plain}"),
    ] {
        assert_eq!(toml(&text), toml(&plain));
    }
}

/// Gravity is that of the root, wherever the arm begins.
#[test]
fn an_arm_that_begins_later_hangs_as_it_hangs() {
    let mount = "<link name=\"wall\"/><joint name=\"mount\" type=\"fixed\"><parent \
        link=\"wall\"/><child link=\"base\"/><origin xyz=\"0 0 1\" rpy=\"1.5708 0 0\"/><axis \
        xyz=\"0 0 0\"/></joint>";
    let text = two_links(mount, "");
    for base in [None, Some("base"), Some("wall")] {
        let toml = UrdfArm::read(&text, base, None).unwrap().to_toml(&links_alone(2));
        assert!(toml.contains("gravity_m_s2 = [0.0, -9.81, 0.0]"), "{base:?} {toml}");
    }
}

/// Files have 0, or nothing, for a limit that nobody knows.
#[test]
fn a_limit_of_0_is_open() {
    for nothing in [" effort=\"0\"", ""] {
        let text = two_links("", "").replace(" effort=\"50\"", nothing);
        let arm = UrdfArm::read(&text, None, None).unwrap();
        let notes: Vec<String> = arm.notes().iter().map(ToString::to_string).collect();
        assert_eq!(notes.iter().filter(|note| note.contains("has no effort in its")).count(), 2);
        let robot = Robot::from_toml(&arm.to_toml(&links_alone(2))).unwrap();
        let limits: Vec<_> = robot.limits().map(|of| (of.velocity_max, of.torque_max)).collect();
        assert_eq!(limits, [(Some(2.0), None); 2]);
    }
}

/// The fingers of a gripper are no ends of an arm if one follows the other.
#[test]
fn an_arm_can_end_before_the_fork_of_a_gripper() {
    fn finger(name: &str, inside: &str) -> String {
        format!(
            "<link name=\"{name}\"/><joint name=\"to_{name}\" type=\"prismatic\"><parent \
             link=\"flange\"/><child link=\"{name}\"/><limit lower=\"0\" upper=\"0.04\" \
             velocity=\"1\" effort=\"9\"/>{inside}</joint>"
        )
    }
    let flange = "<link name=\"flange\"/><joint name=\"bolt\" type=\"fixed\"><parent \
        link=\"lower\"/><child link=\"flange\"/></joint>";
    let follower = finger("right", "<mimic joint=\"to_left\"/>");
    let text = two_links(&format!("{flange}{}{follower}", finger("left", "")), "");
    let error = UrdfArm::read(&text, None, None).unwrap_err();
    let UrdfError::Tips { forks, tips } = error else { panic!("{error}") };
    assert_eq!((forks.as_str(), tips.as_str()), ("flange", "left"));
    let arm = UrdfArm::read(&text, None, Some(&forks)).unwrap();
    assert_eq!((arm.joints(), arm.base_and_tip()), (2, ["base", "flange"]));
}

/// Exporters write one effort for all joints. If it does not hold the arm, it is no limit.
#[test]
fn an_effort_below_the_weight_is_a_placeholder() {
    // The elbow carries 1 kg at 0.5 m, and its axis is level.
    let weight = 0.5 * 9.81;
    for (effort, is_limit) in [(weight * 1.01, true), (weight * 0.97, false)] {
        let text = two_links("", "").replace(
            "<link name=\"lower\"><inertial>",
            "<link name=\"lower\"><inertial><origin xyz=\"0.5 0 0\"/>",
        );
        let text = text.replace("effort=\"50\"", &format!("effort=\"{effort}\""));
        let arm = UrdfArm::read(&text, None, None).unwrap();
        let robot = Robot::from_toml(&arm.to_toml(&links_alone(2))).unwrap();
        let efforts: Vec<_> = robot.limits().map(|limits| limits.torque_max).collect();
        assert_eq!(efforts, [is_limit.then_some(effort); 2], "{effort}");
        let noted = arm.notes().iter().filter_map(|note| match note {
            UrdfNote::PlaceholderEffort { gravity, .. } => Some(*gravity),
            _ => None,
        });
        let noted: Vec<f64> = noted.collect();
        assert_eq!(noted.len(), usize::from(!is_limit));
        assert!(noted.iter().all(|gravity| (gravity / weight - 1.0).abs() < 0.01), "{noted:?}");
    }
}

/// What a cell configures replaces a limit of the file.
#[test]
fn a_configured_limit_replaces_that_of_the_file() {
    let configured = [("torque_max_nm", "80.0"), ("position_max_deg", "90.0")];
    let own = configured.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let joints = BTreeMap::from([("elbow".to_owned(), BTreeMap::from(own))]);
    let drives = UrdfDrives { joints, ..links_alone(2) };
    let arm = UrdfArm::read(&two_links("", ""), None, None).unwrap();
    let robot = Robot::from_toml(&arm.to_toml(&drives)).unwrap();
    let limits: Vec<_> =
        robot.limits().map(|of| (of.torque_max, of.position_max, of.velocity_max)).collect();
    let quarter = core::f64::consts::FRAC_PI_2;
    assert_eq!(limits, [(Some(50.0), 1.0, Some(2.0)), (Some(80.0), quarter, Some(2.0))]);
}

/// Names are text, and nothing of them gets into the robot file but that.
#[test]
fn names_stay_names() {
    let text = two_links("", "").replace("\"two\"", "\"a &quot;b&quot; \\ &#10;gravity_m_s2 = 1\"");
    let text = text.replace("\"elbow\"", "\"x&#10;d_m = 7.0\"");
    let robot =
        Robot::from_toml(&UrdfArm::read(&text, None, None).unwrap().to_toml(&links_alone(2)));
    assert_eq!(robot.unwrap().name(), "a \"b\" \\  gravity_m_s2 = 1");
    // A blank name is none.
    let text = two_links("", "").replace("\"elbow\"", "\" \"");
    let arm = UrdfArm::read(&text, None, None).unwrap();
    let robot = Robot::from_toml(&arm.to_toml(&links_alone(2))).unwrap();
    let labels = [0, 1].map(|joint| robot.joint_label(JointIndex::new(joint)));
    assert_eq!(labels, ["1 (shoulder)", "2"]);
}

/// What the file says of friction is nominal, where the model has the term.
#[test]
fn friction_of_a_urdf_is_nominal() {
    let text = two_links("", "<dynamics damping=\"0.7\" friction=\"1.5\"/>");
    let arm = UrdfArm::read(&text, None, None).unwrap();
    let robot = Robot::from_toml(&arm.to_toml(&UrdfDrives::with_assumed_drives(2))).unwrap();
    let nominal = robot.nominal().unwrap();
    assert_eq!((nominal.value("fv2"), nominal.value("fc2")), (Some(0.7), Some(1.5)));
    assert_eq!(nominal.value("fv1"), None);
    let robot = Robot::from_toml(&arm.to_toml(&links_alone(2))).unwrap();
    assert_eq!(robot.nominal().unwrap().value("fv2"), None);
}

/// Values that an exporter wrote and nobody meant are named with their joint or link.
#[test]
fn values_of_exporters_are_named() {
    let two = two_links("", "");
    let notes = |text: &str| UrdfArm::read(text, None, None).unwrap().notes().to_vec();
    assert_eq!(notes(&two), []);
    // A range from 0 to 0 is unknown, and the cell may give it.
    let limit = "<limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"50\"/>";
    let zero = "<limit lower=\"0\" upper=\"0\" velocity=\"2\" effort=\"50\"/>";
    let joint = || "shoulder".to_owned();
    let open = two.replacen(limit, zero, 1);
    assert_eq!(notes(&open), [UrdfNote::OpenRange { joint: joint() }]);
    let mut drives = links_alone(2);
    let keys = [("position_min_deg", "-90.0"), ("position_max_deg", "90.0")];
    let keys = keys.map(|(key, value)| (key.to_owned(), value.to_owned()));
    drives.joints.insert(joint(), keys.into());
    let arm = UrdfArm::read(&open, None, None).unwrap();
    let robot = Robot::from_toml(&arm.to_toml(&drives)).unwrap();
    let least = robot.limits().next().unwrap().position_min;
    assert!((least + core::f64::consts::FRAC_PI_2).abs() < 1e-12, "{least}");
    // A prismatic joint has no usual range.
    let slides = open.replacen("revolute", "prismatic", 1);
    assert!(matches!(UrdfArm::read(&slides, None, None), Err(UrdfError::Limit { .. })));
    // Degrees are whole numbers that no angle in radians is.
    let degrees = two.replacen(limit, &limit.replace('1', "170"), 1);
    let range = [-170.0, 170.0];
    assert_eq!(notes(&degrees), [UrdfNote::LimitsInDegrees { joint: joint(), range }]);
    assert_eq!(notes(&two.replacen(limit, &limit.replace('1', "10"), 1)), []);
    let rotated = |angle: &str| {
        let rpy = format!("xyz=\"0.5 0 0\" rpy=\"0 {angle} 0\"");
        UrdfArm::read(&two.replace("xyz=\"0.5 0 0\"", &rpy), None, None)
    };
    for angle in ["90", "-45.0", "180"] {
        match rotated(angle) {
            Err(UrdfError::Degrees { joint, text, line: 6 }) => {
                assert_eq!((joint.as_str(), text.as_str()), ("elbow", angle));
            }
            other => panic!("{angle}: {other:?}"),
        }
    }
    for angle in ["3", "-6.283185", "7.853981"] {
        assert!(rotated(angle).is_ok(), "{angle}");
    }
    let body = "<inertial><origin rpy=\"0 0 90\"/>";
    let (link, text) = ("upper".to_owned(), "90".to_owned());
    let found = notes(&two.replacen("<inertial>", body, 1));
    assert_eq!(found, [UrdfNote::BodyInDegrees { link, text }]);
}

/// Rounding in an axis is no rotation: the arm is that of the exact axis.
#[test]
fn rounding_in_an_axis_is_removed_and_noted() {
    let two = two_links("", "");
    let exact = UrdfArm::read(&two, None, None).unwrap();
    let rounded = |axis: &str| {
        let text = two.replace("<axis xyz=\"0 1 0\"/>", &format!("<axis xyz=\"{axis}\"/>"));
        UrdfArm::read(&text, None, None).unwrap()
    };
    let arm = rounded("1e-8 1.0 -3e-9");
    assert_eq!(arm.to_toml(&links_alone(2)), exact.to_toml(&links_alone(2)));
    let [UrdfNote::CleanedAxis { joint, text, largest }] = arm.notes() else {
        panic!("{:?}", arm.notes())
    };
    assert_eq!((joint.as_str(), text.as_str(), *largest), ("elbow", "1e-8 1.0 -3e-9", 1e-8));
    assert_eq!(rounded("0 1 1e-4").notes(), []);
    assert_ne!(rounded("0 1 1e-4").to_toml(&links_alone(2)), exact.to_toml(&links_alone(2)));
}
