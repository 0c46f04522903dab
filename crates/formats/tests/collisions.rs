//! Shapes of a URDF against coal (`golden/collisions.py`): the same distances, and no collision
//! missed.

use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::Robot;
use didim_formats::{UrdfArm, UrdfDrives};
use didim_identification::excitation::Shapes;

fn arm() -> Robot {
    let arm = UrdfArm::read(include_str!("golden/collisions.urdf"), None, None).unwrap();
    assert!(arm.unread_shapes().is_empty());
    Robot::from_toml(&arm.to_toml(&UrdfDrives::with_assumed_drives(arm.joints()))).unwrap()
}

/// How many postures of a table collide, and how many of these are missed. All gaps have to be
/// coal's.
fn missed(table: &str) -> [usize; 2] {
    let robot = arm();
    let (shapes, model) = (Shapes::new(&robot, &[]).unwrap(), Model::new(&robot));
    assert!(shapes.always_near.is_empty(), "{:?}", shapes.always_near);
    assert!(shapes.links_without_shape.is_empty());
    let mut counts = [0; 2];
    for line in table.lines() {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        let [q @ .., of_shapes, of_capsules] = &numbers[..] else { panic!("{line}") };
        let gap_m = shapes.narrowest_gap(&model, q).unwrap().gap_m;
        // Coal ends its iteration at 1 µm; of capsules that overlap it may say less than how far.
        let same =
            if *of_capsules > 0.0 { (gap_m - of_capsules).abs() < 5e-6 } else { gap_m < 5e-6 };
        assert!(same, "{gap_m} {line}");
        if *of_shapes < 0.0 {
            counts[0] += 1;
            counts[1] += usize::from(gap_m >= 0.0);
        }
    }
    counts
}

#[test]
fn distances_are_those_of_coal() {
    let [collisions, missed] = missed(include_str!("golden/collisions.csv"));
    assert!(collisions > 2 && missed == 0);
}

/// `DIDIM_COLLISIONS=FILE cargo test -p didim-formats --test tests -- --ignored --nocapture coll`,
/// with 10,000 rows of `golden/collisions.py`.
#[test]
#[ignore = "a study with a table that the golden's script writes"]
fn no_collision_is_missed() {
    let file = std::env::var("DIDIM_COLLISIONS").unwrap();
    let table = std::fs::read_to_string(file).unwrap();
    let [collisions, missed] = missed(&table);
    println!("{} postures, {collisions} collide, {missed} missed", table.lines().count());
    assert!(collisions > 100 && missed == 0);
}

/// Shapes of no size are named and not read; meshes are in other files.
#[test]
fn what_is_not_read_is_named() {
    let text = include_str!("golden/collisions.urdf");
    for (from, to, link) in [
        ("<sphere radius=\"0.04\"/>", "<mesh scale=\"1 1 1\"/>", 5),
        ("radius=\"0.04\"", "radius=\"0\"", 5),
        ("radius=\"0.04\"", "", 5),
        ("size=\"0.1 0.08 0.44\"", "", 2),
        ("size=\"0.1 0.08 0.44\"", "size=\"0.1 0.0 0.44\"", 2),
    ] {
        let arm = UrdfArm::read(&text.replacen(from, to, 1), None, None).unwrap();
        assert_eq!(arm.unread_shapes(), [(format!("l{link}"), link)], "{to}");
        let robot = Robot::from_toml(&arm.to_toml(&UrdfDrives::with_assumed_drives(6))).unwrap();
        assert_eq!(Shapes::new(&robot, &[]).unwrap().links_without_shape, [link]);
    }
}
