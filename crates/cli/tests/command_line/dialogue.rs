//! The questions of `didim new` on a terminal.

use std::fs;

use super::top::Watched;
use crate::new::{RAD, folder};

const PROMPT: &str = "urdf.drive_inertia (empty: later) = ";

/// Starts `new` for the arm with two links and a table of joint torques.
fn start(folder: &tempfile::TempDir) -> Watched {
    let [cell, robot, log] = ["cell.toml", "arm.urdf", "log.csv"]
        .map(|file| folder.path().join(file).to_str().unwrap().to_owned());
    let arguments = ["new", &cell, "--robot", &robot, "--log", &log];
    Watched::start_command(&arguments, &[("NO_COLOR", "1")])
}

#[test]
fn each_answer_on_a_terminal_is_checked_at_once() {
    let folder = folder(["time", "q1", "q2", "tau1_Nm", "tau2_Nm"], RAD);
    let mut dialogue = start(&folder);
    dialogue.waits_for_count(PROMPT, 1);
    dialogue.key("perhaps\n");
    // It is asked again, and nothing is written yet.
    dialogue.waits_for_count(PROMPT, 2);
    assert!(!folder.path().join("cell.toml").exists());
    dialogue.key("false\n");
    let (status, shown) = dialogue.ended(&["next: didim identify"]);
    assert_eq!(status.code(), Some(0), "{shown}");
    assert!(!shown.contains("panicked") && shown.contains("next: didim identify"), "{shown}");
    let cell = fs::read_to_string(folder.path().join("cell.toml")).unwrap();
    assert!(cell.contains("# stated\ndrive_inertia = false\n"), "{cell}");
    assert!(!cell.contains("= \"?\""), "{cell}");
}

#[test]
fn an_empty_answer_leaves_the_question_in_the_cell() {
    let folder = folder(["time", "q1", "q2", "tau1_Nm", "tau2_Nm"], RAD);
    let mut dialogue = start(&folder);
    dialogue.waits_for_count(PROMPT, 1);
    dialogue.key("\n");
    let (status, shown) = dialogue.ended(&["next: didim check"]);
    assert_eq!(status.code(), Some(0), "{shown}");
    assert!(shown.contains("1 open: ") && shown.contains("next: didim check"), "{shown}");
    assert_eq!(shown.matches(PROMPT).count(), 1, "{shown}");
    let cell = fs::read_to_string(folder.path().join("cell.toml")).unwrap();
    assert!(cell.contains("drive_inertia = \"?\"\n"), "{cell}");
}
