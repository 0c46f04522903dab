//! `didim export`: a stored result of a real arm as a model that other tools read.

use std::ffi::OsStr;
use std::fs;
use std::path::PathBuf;

use crate::program::{didim, json, repository, succeed};
use didim_dynamics::robot::Robot;
use didim_formats::UrdfArm;
use serde_json::Value;
use tempfile::TempDir;

/// The KR 300 from two of its recordings; c is left.
fn result() -> (TempDir, PathBuf, [PathBuf; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let arm = repository("tests/data/kr300");
    let [cell, a, b, c] = ["cell.toml", "a.csv", "b.csv", "c.csv"].map(|file| arm.join(file));
    let identified = succeed(&[
        &"identify",
        &"--json",
        &"--cell",
        &cell,
        &"--from",
        &"1.8",
        &"--to",
        &"8.2",
        &"--input",
        &a,
        &"--input",
        &b,
    ]);
    let result = folder.path().join("result.json");
    fs::write(&result, identified).unwrap();
    (folder, result, [cell, c])
}

/// A use that the cell requires and the verdict refuses: the terminal and the file say so.
#[test]
fn a_refused_result_says_so_where_it_is_exported() {
    let (folder, result, [cell, _]) = result();
    let mass: [&dyn AsRef<OsStr>; 2] = [&"--total-mass-kg", &"1000"];
    let mut refused = json(&fs::read_to_string(&result).unwrap());
    let prediction = &mut refused["verdict"]["uses"]["prediction"];
    prediction["applicable"] = false.into();
    prediction["reasons"] = serde_json::json!(["a reason of the test"]);
    let file = folder.path().join("refused.json");
    fs::write(&file, refused.to_string()).unwrap();
    let arguments: [&dyn AsRef<OsStr>; 7] =
        [&"export", &"--cell", &cell, &"--result", &file, &"--to", &"matlab"];
    let done = didim(&[&arguments[..], &mass].concat());
    let refusal = "the result is not usable for prediction: a reason of the test";
    assert!(done.stderr.contains(refusal) && done.stdout.contains(refusal), "{done:?}");
}

#[test]
fn a_real_arm_leaves_in_every_format() {
    let (folder, result, [cell, other]) = result();
    let export = |to: &str, more: &[&dyn AsRef<OsStr>]| {
        let fixed: [&dyn AsRef<OsStr>; 7] =
            [&"export", &"--cell", &cell, &"--result", &result, &"--to", &to];
        didim(&[&fixed[..], more].concat())
    };
    let mass: [&dyn AsRef<OsStr>; 2] = [&"--total-mass-kg", &"1000"];
    // Which mass it has is nobody's guess.
    let refused = export("urdf", &[]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("total mass of its moving links"), "{}", refused.stderr);

    let urdf = export("urdf", &mass).stdout;
    let arm = UrdfArm::read(&urdf, None, None).unwrap();
    assert_eq!(arm.joints(), 6);
    assert!(urdf.contains("left out: drive inertia, joint 1") && urdf.contains("Mass of link 6"));
    assert!(export("mjcf", &mass).stdout.contains("armature="));
    assert!(export("matlab", &mass).stdout.starts_with("function arm = arm()"));
    assert!(export("c", &mass).stdout.contains("int kr300_self_test(void)"));
    assert!(export("rust", &mass).stdout.contains("pub fn self_test() -> bool"));

    // What it costs on a motion that it was not identified from.
    let recording: [&dyn AsRef<OsStr>; 2] = [&"--input", &other];
    let done = export("json", &[&mass[..], &recording].concat());
    let model = json(&done.stdout);
    let text = |key: &str| model[key].as_str().unwrap().to_owned();
    assert_eq!(text("robot"), "kr300");
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&model["least_cost"]) < number(&model["cost_limit"]));
    assert!(number(&model["least_cost"]) <= number(&model["cost"]));
    assert_eq!(model["left_out"].as_array().unwrap().len(), 0);
    let parameters = model["parameters"].as_array().unwrap();
    let masses: f64 = parameters
        .iter()
        .filter(|of| of["name"].as_str().unwrap().trim_end_matches(char::is_numeric) == "m")
        .map(|of| number(&of["value"]))
        .sum();
    // This part follows the prior where no torque depends on it, and the data otherwise.
    assert!((300.0..1500.0).contains(&masses), "{masses}");
    for of in parameters {
        assert!(
            number(&of["standard_deviation"]) >= 0.0 && !of["unit"].as_str().unwrap().is_empty()
        );
    }
    let said = done.stderr.lines().find(|line| line.starts_with("error on")).unwrap();
    let percent: Vec<f64> = said.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(percent.len() == 2 && percent.iter().all(|of| (2.0..20.0).contains(of)), "{said}");
    assert!((percent[0] - percent[1]).abs() < 0.5, "{said}");

    // A robot file of it is read, and is then the prior by itself.
    let toml = export("toml", &mass).stdout;
    let robot = Robot::from_toml(&toml).unwrap();
    assert!(robot.nominal().is_some());
    fs::write(folder.path().join("robot.toml"), toml).unwrap();
    let root = repository("config");
    let cell = fs::read_to_string(&cell).unwrap();
    let cell = cell.replace("../../../config", root.to_str().unwrap());
    fs::write(folder.path().join("cell.toml"), cell).unwrap();
    let own_cell = folder.path().join("cell.toml");
    let again = succeed(&[&"export", &"--cell", &own_cell, &"--result", &result, &"--to", &"json"]);
    assert_eq!(json(&again)["prior"], "the robot's nominal parameters");
    // Its own robot file is read, too.
    let file = folder.path().join("robot.toml");
    let before = fs::read(&file).unwrap();
    let fixed: [&dyn AsRef<OsStr>; 7] =
        [&"export", &"--cell", &own_cell, &"--result", &result, &"--to", &"toml"];
    let said = didim(&[&fixed[..], &[&"--out", &file]].concat());
    assert!(said.stderr.contains("is read by this command"), "{}", said.stderr);
    assert_eq!(fs::read(&file).unwrap(), before);
}

#[test]
fn what_is_no_model_is_refused() {
    let (folder, result, [cell, _]) = result();
    let export = |result: &PathBuf, out: &PathBuf| {
        didim(&[
            &"export",
            &"--cell",
            &cell,
            &"--result",
            result,
            &"--to",
            &"urdf",
            &"--out",
            out,
            &"--total-mass-kg",
            &"1000",
        ])
    };
    let path_of = |name: &str| folder.path().join(name);
    let changed = |name: &str, change: &dyn Fn(&mut Value)| {
        let mut content = json(&fs::read_to_string(&result).unwrap());
        change(&mut content);
        fs::write(path_of(name), content.to_string()).unwrap();
        path_of(name)
    };
    // Its own input.
    let before = fs::read(&result).unwrap();
    let said = export(&result, &result);
    assert!(
        said.code == Some(1) && said.stderr.contains("is read by this command"),
        "{}",
        said.stderr
    );
    assert_eq!(fs::read(&result).unwrap(), before);
    // Whose method would be code.
    let other = changed("other.json", &|content| content["method"] = "idim-ls\nfn evil".into());
    let said = export(&other, &path_of("other.urdf"));
    assert!(said.code == Some(1) && said.stderr.contains("unknown method"), "{}", said.stderr);
    // Of an earlier version.
    let old = changed("old.json", &|content| {
        content.as_object_mut().unwrap().remove("covariance").unwrap();
    });
    let said = export(&old, &path_of("arm.urdf"));
    assert!(said.code == Some(1) && said.stderr.contains("identify again"), "{}", said.stderr);
    // Torques of joint 2 with the other sign: no body falls upwards.
    let signs = changed("signs.json", &|content| {
        for of in content["parameters"].as_array_mut().unwrap() {
            let name = of["name"].as_str().unwrap().to_owned();
            if name.contains('2') || name.contains('3') {
                of["value"] = Value::from(-of["value"].as_f64().unwrap());
            }
        }
    });
    let said = export(&signs, &path_of("arm.urdf"));
    assert!(
        said.code == Some(1) && said.stderr.contains("no physically consistent parameters explain"),
        "{}",
        said.stderr
    );
    // A part of the model.
    let part = changed("part.json", &|content| {
        let parameters = content["parameters"].as_array_mut().unwrap();
        parameters.retain(|of| of["name"] != "mx2r");
        let remaining = parameters.len();
        let rows = content["covariance"].as_array_mut().unwrap();
        rows.truncate(remaining);
    });
    let said = export(&part, &path_of("arm.urdf"));
    assert!(said.code == Some(1) && said.stderr.contains("mx2r"), "{}", said.stderr);
    assert!(!path_of("arm.urdf").exists());
    let said = didim(&[&"export", &"--cell", &cell, &"--result", &result, &"--to", &"xml"]);
    assert!(said.code == Some(2) && said.stderr.contains("urdf"), "{}", said.stderr);
}
