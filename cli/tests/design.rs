//! `didim design`: files for people to run, from a robot file alone, or for what a result lacks.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use crate::program::{didim, identify_arm, repository, succeed};

const FORMATS: [&str; 5] = ["csv", "yaml", "script", "src", "mod"];

fn design(arm: &[&dyn AsRef<OsStr>], outs: &[&Path]) -> Vec<String> {
    let mut arguments: Vec<&dyn AsRef<OsStr>> = vec![&"design", &"--steps", &"4"];
    arguments.extend(arm);
    for out in outs {
        arguments.extend([&"--out" as &dyn AsRef<OsStr>, out]);
    }
    let mut texts = vec![succeed(&arguments)];
    texts.extend(outs.iter().map(|out| fs::read_to_string(out).unwrap()));
    texts
}

#[test]
fn a_robot_file_is_enough_and_the_simulated_arm_plays_the_motion() {
    let folder = tempfile::tempdir().unwrap();
    let robot = repository("config/robots/tx40.toml");
    let outs: Vec<_> = FORMATS.map(|of| folder.path().join(format!("next.{of}"))).into();
    let outs: Vec<&Path> = outs.iter().map(|out| out.as_path()).collect();
    let arm: [&dyn AsRef<OsStr>; 4] = [&"--robot", &robot, &"--duration", &"3"];
    let texts = design(&arm, &outs);
    assert!(texts[0].contains("ASSUMED") && texts[0].contains("zz1r"), "{}", texts[0]);
    for text in &texts[1..] {
        for part in
            ["tx40, 3 s", "10 % SPEED", "Collision NOT checked", "motor 6 speed", "joint 1 torque"]
        {
            assert!(text.contains(part), "{part}: {text:.2000}");
        }
        // The file has neither an acceleration nor a jerk.
        assert!(text.contains("known: acceleration, jerk"), "{text:.2000}");
    }
    assert_eq!(texts, design(&arm, &outs), "the same every time");

    let (cell, log) = (repository("config/cells/tx40-packed-fd.toml"), folder.path().join("a.log"));
    let bus = format!("log:{}", log.display());
    let played = succeed(&[&"sim", &"--cell", &cell, &"--bus", &bus, &"--motion", &outs[0]]);
    assert!(played.contains("bus cycles") && log.exists(), "{played}");
}

/// A limit that the robot file leaves open is asked for, by its key.
#[test]
fn no_motion_is_designed_with_limits_that_are_open() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("next.csv");
    for (robot, remedy) in [
        (
            "tx2-60",
            "its torque limit is unknown, and without a result noise is assumed by it; state torque_max_nm",
        ),
        ("kr300-r2500", "state torque_max_nm"),
    ] {
        let robot = repository(&format!("config/robots/{robot}.toml"));
        let refused = didim(&[&"design", &"--robot", &robot, &"--duration", &"3", &"--out", &out]);
        assert!(refused.code != Some(0) && refused.stderr.contains(remedy), "{refused:?}");
    }
}

#[test]
fn collisions_are_checked_where_shapes_are_stated_and_the_motion_can_be_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let [robot, out, page] = ["arm.toml", "next.csv", "next.html"].map(|of| folder.path().join(of));
    let text = fs::read_to_string(repository("config/robots/tx40.toml")).unwrap();
    let shaped = "drive_inertia = true\ncapsules = [{ radius_m = 0.06 }]";
    fs::write(&robot, text.replace("drive_inertia = true", shaped)).unwrap();
    let arm: [&dyn AsRef<OsStr>; 7] = [
        &"--robot",
        &robot,
        &"--duration",
        &"3",
        &"--box=-0.5,-0.5,0,0.5,0.5,0.7",
        &"--preview",
        &page,
    ];
    let texts = design(&arm, &[&out]);
    assert!(texts[0].contains("by the stated shapes alone"), "{}", texts[0]);
    for part in [
        "inside the box. Nearest: link ",
        "they have no shape: the base",
        "near in every posture: ",
    ] {
        assert!(texts[1].contains(part), "{part}: {:.2000}", texts[1]);
    }
    let html = fs::read_to_string(&page).unwrap();
    for part in ["joint 6", "class=\"tip\"", "Collision checked at 5000 points"] {
        assert!(html.contains(part), "{part}");
    }
    assert!(!html.contains("<script"));
}

#[test]
fn what_a_result_lacks_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let result = folder.path().join("result.json");
    fs::write(&result, identify_arm("kr300", &["a.csv", "b.csv"], "1.8", "8.196")).unwrap();
    let cell = repository("tests/data/kr300/cell.toml");
    let out = folder.path().join("next.csv");
    let arm: [&dyn AsRef<OsStr>; 6] = [&"--cell", &cell, &"--result", &result, &"--duration", &"3"];
    let text = &design(&arm, &[&out])[0];
    assert!(text.contains("the residuals of the result"), "{text}");
    // σ now and then of every parameter: a motion more can only tell more.
    let mut rows = 0;
    for line in text.lines().skip(1).take_while(|line| !line.is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [now, then]: [f64; 2] = [2, 3].map(|word: usize| words[word].parse().unwrap());
        assert!(then <= now, "{line}");
        rows += 1;
    }
    assert!(rows > 40, "{text}");
}

#[test]
fn what_a_result_lacks_is_said_in_motions_that_a_person_can_program() {
    let folder = tempfile::tempdir().unwrap();
    let result = folder.path().join("result.json");
    fs::write(&result, identify_arm("kr300", &["a.csv"], "1.8", "8.196")).unwrap();
    let cell = repository("tests/data/kr300/cell.toml");
    let out = folder.path().join("next.csv");
    let fixed: [&dyn AsRef<OsStr>; 4] = [&"advise", &result, &"--cell", &cell];
    let text = succeed(&[&fixed[..], &[&"--out", &out]].concat());
    for part in [
        "prediction: ",
        "uncertain by more than 10 %",
        "never moved faster than",
        "\n1. ",
        " and back, ",
        "would bring σ of ",
        "the residuals of the result",
        "collision NOT checked",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let pieces = text.lines().filter(|line| line.contains(" and back, ")).count();
    for number in 1..=pieces {
        let written = fs::read_to_string(folder.path().join(format!("next-{number}.csv"))).unwrap();
        assert!(written.contains("FIRST RUN IT AT 10 % SPEED"), "{written:.500}");
    }
    assert!(pieces > 0 && !out.exists());
    assert_eq!(text, succeed(&fixed), "the same every time, written or not");

    let silent = fs::read_to_string(&result).unwrap().replacen("\"covariance\"", "\"other\"", 1);
    fs::write(&result, silent).unwrap();
    let refused = didim(&fixed);
    assert_eq!(refused.code, Some(78), "{refused:?}");
    assert!(refused.stderr.contains("identify again"), "{refused:?}");
}

/// The design adds to what is known, and the recording of it is identified together with that.
#[test]
fn what_was_foretold_of_a_motion_is_held_against_what_came_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let [result, out, first, next, page] =
        ["result.json", "next.csv", "first.log", "next.log", "report.html"]
            .map(|of| folder.path().join(of));
    let cell = repository("config/cells/tx40-packed-fd.toml");
    let arm: [&dyn AsRef<OsStr>; 2] = [&"--cell", &cell];
    let [first_bus, next_bus] = [&first, &next].map(|log| format!("log:{}", log.display()));
    succeed(&[&[&"sim" as &dyn AsRef<OsStr>][..], &arm, &[&"--bus", &first_bus]].concat());
    let identify: [&dyn AsRef<OsStr>; 3] = [&"identify", &"--cell", &cell];
    let before = succeed(&[&identify[..], &[&"--input", &first, &"--json"]].concat());
    fs::write(&result, before).unwrap();
    design(&[&arm[..], &[&"--result", &result, &"--duration", &"4"]].concat(), &[&out]);
    let motion: [&dyn AsRef<OsStr>; 4] = [&"--bus", &next_bus, &"--motion", &out];
    succeed(&[&[&"sim" as &dyn AsRef<OsStr>][..], &arm, &motion].concat());

    let both: [&dyn AsRef<OsStr>; 4] = [&"--input", &first, &"--input", &next];
    let both = [&identify[..], &both].concat();
    let held: [&dyn AsRef<OsStr>; 3] = [&"--designed", &out, &"--json"];
    let json: serde_json::Value =
        serde_json::from_str(&succeed(&[&both[..], &held].concat())).unwrap();
    let foretold = json["foretold"].as_array().unwrap();
    assert_eq!(foretold.len(), json["parameters"].as_array().unwrap().len());
    let times = |of: &serde_json::Value| {
        of["achieved"].as_f64().unwrap() / of["foretold"].as_f64().unwrap()
    };
    let rms = foretold.iter().map(|of| times(of).powi(2)).sum::<f64>() / foretold.len() as f64;
    println!("{:.3}: {:.2?}", rms.sqrt(), foretold.iter().map(times).collect::<Vec<_>>());
    assert!((rms.sqrt() - 1.0).abs() < 0.2, "{rms}");
    for of in foretold {
        let of_result = json["parameters"].as_array().unwrap().iter();
        let own = of_result.clone().find(|own| own["name"] == of["name"]).unwrap();
        assert_eq!(own["standard_deviation"], of["achieved"], "{of}");
    }

    let shown: [&dyn AsRef<OsStr>; 4] = [&"--designed", &out, &"--report", &page];
    let text = succeed(&[&both[..], &shown].concat());
    assert!(text.contains("times what was foretold"), "{text}");
    assert!(fs::read_to_string(&page).unwrap().contains("What the motion was foretold to tell"));
    let other: [&dyn AsRef<OsStr>; 2] = [&"--designed", &first];
    let refused = didim(&[&both[..], &other].concat());
    assert!(
        refused.code == Some(1) && refused.stderr.contains("its head foretells no"),
        "{refused:?}"
    );
}

#[test]
fn what_cannot_be_designed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [tx40, ur5e, panda] =
        ["tx40", "ur5e", "panda"].map(|of| repository(&format!("config/robots/{of}.toml")));
    let [table, text, script] = ["a.csv", "a.txt", "a.script"].map(|of| folder.path().join(of));
    // With more steps than any test could wait for: it is refused before the search.
    let refused = |robot: &Path, out: &Path, more: &[&dyn AsRef<OsStr>]| {
        let fixed: [&dyn AsRef<OsStr>; 9] = [
            &"design",
            &"--robot",
            &robot,
            &"--duration",
            &"60",
            &"--steps",
            &"100000",
            &"--out",
            &out,
        ];
        let finished = didim(&[&fixed[..], more].concat());
        assert!(!out.exists());
        (finished.code, finished.stderr)
    };
    for ((code, why), expected, part) in [
        (refused(&tx40, &text, &[]), 2, ".script (Universal Robots)"),
        (refused(&ur5e, &table, &[]), 78, "give --acceleration"),
        (refused(&panda, &script, &[]), 1, "this arm has 7 joints"),
        (refused(&tx40, &table, &[&"--parameters", &"zz9"]), 78, "no parameter `zz9`"),
        (refused(&tx40, &table, &[&"--box=-1,-1,0,1,1,1"]), 78, "state `capsules`"),
        (refused(&tx40, &table, &[&"--box=-1,-1,0"]), 2, "give six numbers"),
        (refused(&tx40, &table, &[&"--speed", &"200"]), 78, "the share of the speed"),
        (refused(&tx40, &table, &[&"--acceleration", &"1,2"]), 78, "2 values for 6 joints"),
        (refused(&tx40, &table, &[&"--result", &"a.json"]), 2, "--cell"),
    ] {
        assert_eq!(code, Some(expected), "{why}");
        assert!(why.contains(part), "{why}");
    }
}
