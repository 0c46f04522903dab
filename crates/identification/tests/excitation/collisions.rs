//! Motions that keep an arm apart from itself, and inside a box.

use didim_dynamics::robot::Robot;
use didim_identification::excitation::{
    Bounds, Corners, ExcitationError, Margins, Neighbour, Shapes, Task, Wall, WallKind, design,
    predict_result,
};

use super::{TX40, designed, robot, task, task_within};

/// The arm with a ball or a rod of 6 cm about every link, and a base.
fn shaped() -> Robot {
    let links = TX40
        .replace("drive_inertia = true", "drive_inertia = true\ncapsules = [{ radius_m = 0.06 }]")
        .replacen("gravity_m_s2", "base_capsules = [{ radius_m = 0.08 }]\ngravity_m_s2", 1);
    robot(&links)
}

/// Lower than the arm is high.
const BOX: Corners = [[-0.45, -0.45, 0.0], [0.45, 0.45, 0.7]];

fn within(robot: &Robot, inside: Option<Corners>, duration_s: f64) -> Task {
    let walls = inside.map_or_else(Vec::new, |of| Wall::sides(of).to_vec());
    let nominal = robot.nominal().unwrap().standard_parameters().to_vec();
    let bounds = Bounds::new(robot, Margins::default(), None, Some(nominal)).unwrap();
    task_within(robot, duration_s, bounds.with_shapes(Shapes::new(robot, &walls)))
}

#[test]
fn a_motion_stays_separate_and_inside() {
    let robot = shaped();
    let free = designed(&task(&robot, 3.0), 1, 30);
    assert!(free.narrowest_gap.is_none());
    let bounded = within(&robot, Some(BOX), 3.0);
    let motion = designed(&bounded, 1, 30);
    let nearest = |of: &Task, motion| of.bounds.narrowest_gap(&of.model, motion, 5000.0).unwrap();
    let gap = nearest(&bounded, &motion.series).gap_m;
    assert!(gap >= 0.02, "{gap}");
    assert_eq!(motion.narrowest_gap, Some(nearest(&bounded, &motion.series)));
    // What nothing holds goes through.
    assert!(nearest(&bounded, &free.series).gap_m < 0.0);
    // It still tells something of every parameter.
    assert!(predict_result(&bounded, &motion.series).is_ok());
}

/// The wrist's axes meet: those of its links that no joint connects are near wherever the arm is,
/// and are named.
#[test]
fn what_is_near_in_every_posture_is_named() {
    let shapes = Shapes::new(&shaped(), &Wall::sides(BOX)).unwrap();
    assert!(shapes.always_near.contains(&(4, Neighbour::Link(6))), "{:?}", shapes.always_near);
    assert!(!shapes.always_near.iter().any(|(_, other)| *other == Neighbour::Wall(WallKind::Side)));
    assert!(shapes.has_wall(WallKind::Side) && shapes.links_without_shape.is_empty());
    assert!(Shapes::new(&robot(TX40), &Wall::sides(BOX)).is_none());
}

#[test]
fn a_box_that_holds_no_posture_is_refused() {
    let small = [[-0.1, -0.1, 0.0], [0.1, 0.1, 0.45]];
    let task = within(&shaped(), Some(small), 3.0);
    let error = design(&task, 1, 5, |_| ()).unwrap_err();
    let ExcitationError::Touching { nearest: Some(nearest) } = error else { panic!("{error}") };
    assert_eq!(nearest.neighbour, Neighbour::Wall(WallKind::Side));
}

#[test]
fn shapes_that_cannot_be_are_refused() {
    let robot_with = |capsules: &str| {
        Robot::from_toml(&TX40.replacen(
            "drive_inertia = true",
            &format!("drive_inertia = true\ncapsules = {capsules}"),
            1,
        ))
    };
    for (capsules, part) in [
        ("[{ radius_m = 0.0 }]", "`capsules` of joint 1: `radius_m` = 0"),
        ("[{ radius_m = 0.1, to_m = [0.0, inf, 0.0] }]", "finite"),
        ("[{ to_m = [0.0, 0.0, 0.0] }]", "radius_m"),
    ] {
        let error = robot_with(capsules).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    // Nothing says how far a link reaches that carries a sliding joint.
    let sliding = include_str!("../../../dynamics/tests/golden/sliding-arm.toml");
    let error = Robot::from_toml(&format!("base_capsules = [{{ radius_m = 0.1 }}]\n{sliding}"));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("`base_capsules`") && error.contains("state `to_m`"), "{error}");
}
