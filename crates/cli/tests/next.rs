//! The command that is printed for the user to run next: pasted into a shell, it does its work.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::program::{json, repository};
use tempfile::TempDir;

/// Runs a command line in a folder, as a shell does. Returns the next command that it prints.
fn paste(folder: &Path, line: &str) -> Option<String> {
    let program = Path::new(env!("CARGO_BIN_EXE_didim"));
    let path = std::env::var("PATH").unwrap();
    let out = Command::new("sh")
        .args(["-c", line])
        .env("PATH", format!("{}:{path}", program.parent().unwrap().display()))
        .current_dir(folder)
        .output()
        .unwrap();
    let stderr = String::from_utf8(out.stderr).unwrap();
    assert!(out.status.success(), "{line}: {stderr}");
    let next: Vec<&str> = stderr.lines().filter_map(|line| line.strip_prefix("next: ")).collect();
    assert!(next.len() <= 1, "{stderr}");
    next.first().map(|next| (*next).to_owned())
}

#[test]
fn from_a_recording_the_printed_commands_lead_to_result_report_and_advice() {
    let folder = TempDir::new().unwrap();
    let arm = repository("tests/data/kr300");
    for file in ["robot.toml", "a.csv"] {
        fs::copy(arm.join(file), folder.path().join(file)).unwrap();
    }
    let config = repository("config").display().to_string();
    let cell = fs::read_to_string(arm.join("cell.toml")).unwrap();
    let cell = cell.replace("../../../config", &config);
    fs::write(folder.path().join("it's mine.toml"), cell).unwrap();
    fs::rename(folder.path().join("a.csv"), folder.path().join("first run.csv")).unwrap();

    let first = "didim identify --cell \"it's mine.toml\" --input 'first run.csv' --from 1.8 \
        --to 8.2";
    let second = paste(folder.path(), first).expect("the result is not kept yet");
    let third = paste(folder.path(), &second).expect("the result has to be looked at");
    let result = json(&fs::read_to_string(folder.path().join("result.json")).unwrap());
    assert_eq!(result["parameters"].as_array().unwrap().len(), 58);
    assert!(fs::read_to_string(folder.path().join("report.html")).unwrap().contains("<svg"));
    assert!(third.starts_with("didim advise --cell 'it'\\''s mine.toml' result.json"), "{third}");
    let fourth = paste(folder.path(), &third).expect("the motions are not written yet");
    assert_eq!(paste(folder.path(), &fourth), None);
    assert!(folder.path().join("next-1.csv").exists());
}

#[test]
fn from_a_robot_the_printed_commands_lead_to_a_motion_and_its_preview() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("my arm.urdf"), crate::new::URDF).unwrap();
    let first = paste(folder.path(), "didim robot 'my arm.urdf'").expect("a motion is next");
    assert!(first.starts_with("didim design --robot 'my arm.urdf' --duration "), "{first}");
    let short = first.replace("--duration 20", "--duration 3 --steps 4 --no-plane");
    assert_eq!(paste(folder.path(), &short), None);
    for file in ["next.csv", "preview.html"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
    // Without accelerations and parameters no motion can be designed.
    let panda = repository("config/robots/ur5e.toml").display().to_string();
    assert_eq!(paste(folder.path(), &format!("didim robot {panda}")), None);
}

#[test]
fn from_recordings_the_printed_commands_lead_to_a_history() {
    let folder = crate::new::folder(["t", "pos_1", "pos_2", "tau_1", "tau_2"], crate::new::RAD);
    assert_eq!(
        crate::new::new(folder.path(), &["--set", "urdf.drive_inertia=false"]).code,
        Some(0)
    );
    let first = "didim identify --cell cell.toml --input log.csv --state 'my results'";
    let second = paste(folder.path(), first).expect("the result is stored");
    assert_eq!(second, "didim baseline set --state 'my results'");
    let third = paste(folder.path(), &second).expect("the history is next");
    let fourth = paste(folder.path(), &third).expect("a report is next");
    assert_eq!(paste(folder.path(), &fourth), None);
    let report = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(report.contains("viscous friction of joint 2, <code>elbow</code>"));
}
