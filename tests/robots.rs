//! The robots that come with the program: where each stands at q = 0, by published chains of other
//! conventions than the files' (standard Denavit–Hartenberg parameters, URDFs), and what a file has
//! to say.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use didim::analysis::screening::open_limits;
use didim::cell::{Cell, Library, RobotSource};
use didim::check::{Severity, check_cell};
use didim::report::robot::{picture, robot_description};
use didim_dynamics::dynamics::{BaseParameters, Model};

/// Of each robot: the origin of its last frame at q = 0 in that of the base \[m\], and the number
/// of its base parameters.
const PUBLISHED: [(&str, [f64; 3], usize); 13] = [
    ("fr3", [0.088, 0.0, 0.926], 64),
    ("iiwa14", [0.0, 0.0, 1.306], 64),
    ("iiwa7", [0.0, 0.0, 1.266], 64),
    ("kr300-r2500", [2.74, 0.0, 0.634], 58),
    ("kr300-r2700-2", [2.94, 0.0, 0.76], 58),
    ("openarm", [0.0, 0.0, 0.5585], 69),
    ("panda", [0.088, 0.0, 0.926], 64),
    ("piper", [0.056_128, 0.0, 0.213_266], 58),
    ("tx2-60", [0.0, 0.02, 1.045], 58),
    ("tx40", [0.0, 0.035, 0.77], 60),
    ("tx40-physical", [0.0, 0.035, 0.77], 60),
    ("ur10e", [-1.184_25, -0.2907, 0.060_85], 58),
    ("ur5e", [-0.8172, -0.2329, 0.0628], 58),
];

fn files() -> BTreeMap<String, PathBuf> {
    let entries = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/config/robots")).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    files.map(|file| (file.file_stem().unwrap().to_str().unwrap().to_owned(), file)).collect()
}

fn read(file: &Path) -> (String, RobotSource) {
    let text = fs::read_to_string(file).unwrap();
    (text.clone(), RobotSource::read(file, text, None).unwrap())
}

#[test]
fn every_robot_stands_where_its_maker_says() {
    let files = files();
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(names, PUBLISHED.map(|(name, ..)| name));
    for (name, origin_m, parameters) in PUBLISHED {
        let (_, source) = read(&files[name]);
        assert_eq!(source.robot.name(), name);
        let model = Model::new(&source.robot);
        let last = model.link_frames(&[]).pop().unwrap();
        for (found, published) in last.origin_m.iter().zip(origin_m) {
            assert!((found - published).abs() < 1e-6, "{name}: {:?}", last.origin_m);
        }
        let base = BaseParameters::compute(&model).unwrap();
        assert_eq!(base.names().len(), parameters, "{name}");
        assert!(robot_description(&source, &base).contains("reach from the second axis"));
        assert!(picture(&source.robot, &[]).starts_with("<svg"));
    }
}

#[test]
fn what_motions_are_planned_with_is_stated_where_it_is_published() {
    let limits = |name: &str| {
        let (_, source) = read(&files()[name]);
        let all_limits = source.robot.chain().iter().map(|joint| joint.limits);
        all_limits.map(|limits| (limits.acceleration_max, limits.jerk_max)).collect::<Vec<_>>()
    };
    let panda = limits("panda");
    assert_eq!((panda[0], panda[6]), ((Some(15.0), Some(7500.0)), (Some(20.0), Some(10_000.0))));
    assert!(limits("ur5e").iter().all(|limits| *limits == (None, None)));
}

/// What no source gives is left open, and said.
#[test]
fn limits_that_no_source_gives_are_open() {
    fn findings_of(name: &str) -> (Option<String>, usize) {
        let (_, source) = read(&files()[name]);
        let base = BaseParameters::compute(&Model::new(&source.robot)).unwrap();
        let shown = robot_description(&source, &base).matches("  open").count();
        (open_limits(&source.robot), shown)
    }
    let (said, shown) = findings_of("tx2-60");
    let said = said.unwrap();
    assert!(said.ends_with(": torque of joint 1, 2, 3, 4, 5, 6"), "{said}");
    assert_eq!(shown, 6);
    let (said, shown) = findings_of("kr300-r2500");
    let said = said.unwrap();
    assert!(said.contains(": speed of joint 1, 2, 3, 4, 5, 6, torque of joint 1,"), "{said}");
    assert_eq!(shown, 12);
    assert_eq!(findings_of("tx40"), (None, 0));

    let file = Path::new("config/cells/tx40-packed-fd.toml");
    let mut cell = Cell::from_library(Library::SHIPPED, file).unwrap();
    cell.robot = read(&files()["tx2-60"]).1.robot;
    let findings = check_cell(&cell);
    let finding_found =
        findings.iter().find(|finding| finding.what == findings_of("tx2-60").0.unwrap()).unwrap();
    assert_eq!((finding_found.severity, finding_found.key.as_str()), (Severity::Note, "robot"));
}

/// Arms of others are written from publications, and say which.
#[test]
fn every_robot_names_its_sources_and_what_is_open() {
    let mut others = 0;
    for (name, file) in files().into_iter().filter(|(name, _)| !name.starts_with("tx40")) {
        let (text, _) = read(&file);
        let head: String = text.lines().take_while(|line| line.starts_with('#')).collect();
        assert!(head.contains("Source") && head.contains("Open:"), "{name}:\n{head}");
        let joints = text.matches("[[joint]] # ").count();
        assert_eq!(joints, text.matches("[[joint]]").count(), "{name}: each joint says whence");
        others += 1;
    }
    assert_eq!(others, PUBLISHED.len() - 2);
}
