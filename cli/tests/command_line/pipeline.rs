//! The commands around the service: `replay`, `status`, `window`, `run`, `demo`.

use crate::support::{Folder, data, didim, head, packed_cell};

#[test]
fn a_replay_refuses_what_identify_refuses_and_writes_no_figure() {
    let folder = Folder::new();
    let lines = head(&data().packed_log, 2_000);
    let cut = folder.file("cut.log", &lines[..lines.len() - 1]);
    let malformed = folder.file("malformed.log", &format!("{lines}hello\n"));
    let empty = folder.file("empty.log", "");
    let missing = folder.path("missing.log");
    let (cell, figure) = (packed_cell(), folder.path("out.svg"));
    let cases: [(&str, &[&str]); 4] = [
        (&cut, &["cut.log:2000:", "no newline", "delete that line"]),
        (&malformed, &["malformed.log:2001:", "no time stamp"]),
        (&empty, &["no complete sample", "layout"]),
        (&missing, &["missing.log", "No such file", "check the path"]),
    ];
    for (log, says) in cases {
        didim(&["replay", "--cell", &cell, log, "--json", "--figure", &figure]).refused(1, says);
    }
    assert_eq!(folder.names(), ["cut.log", "empty.log", "malformed.log"]);
}

#[test]
fn a_replay_gives_the_same_bytes_every_time() {
    let command = ["replay", "--cell", &packed_cell(), &data().packed_log, "--json"];
    let outputs = [(), ()].map(|()| didim(&command).done());
    assert_eq!(outputs[0], outputs[1]);
    let output: serde_json::Value = serde_json::from_str(&outputs[0]).unwrap();
    assert_eq!(output["verdict"]["applicable"], true, "{output}");
    assert_eq!(output["parameters"].as_array().unwrap().len(), 28);
}

#[test]
fn without_a_service_nothing_is_known() {
    let folder = Folder::new();
    let runtime = folder.path("runtime");
    for command in [&["status", "--json"][..], &["status"], &["window", "begin"]] {
        didim(&[command, &["--runtime", &runtime]].concat())
            .refused(1, &["no service at", &runtime, "No such file", "didim run", "--runtime"]);
    }
    didim(&["window", "open", "--runtime", &runtime]).refused(2, &["'open'", "begin", "end"]);
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn arguments_of_the_service_are_checked() {
    let missing = Folder::new().path("missing.toml");
    for command in ["run", "status", "replay"] {
        let log: &[&str] = if command == "replay" { &["x.log"] } else { &[] };
        didim(&[&[command, "--cell", &missing][..], log].concat())
            .refused(78, &[&missing, "No such file"]);
    }
    didim(&["demo", "--seconds", "0"]).refused(2, &["--seconds 0", "5 to 86400"]);
    didim(&["demo", "--method", "x"]).refused(2, &["--method", "known: idim-ls"]);
}

#[test]
fn a_result_that_is_not_stored_is_a_failure() {
    let folder = Folder::new();
    let state = folder.path("state");
    std::fs::create_dir(&state).unwrap();
    // The last number but one is taken, and the last one's name by a folder, which no result
    // replaces, not even for root.
    std::fs::write(format!("{state}/result-18446744073709551614.json"), "{}").unwrap();
    std::fs::create_dir(format!("{state}/result-18446744073709551615.json")).unwrap();
    let command = ["replay", "--cell", &packed_cell(), &data().packed_log, "--state", &state];
    didim(&command).refused(1, &["1 of 1 results were not stored", "window 0", "rename"]);
}

#[test]
fn rejected_windows_are_told_beside_the_result() {
    let log = std::fs::read_to_string(&data().packed_log).unwrap();
    let mut lines: Vec<&str> = log.split_inclusive('\n').collect();
    lines.drain(8_000..8_003);
    let folder = Folder::new();
    let log = folder.file("gap.log", &lines.concat());
    let outcome = didim(&["replay", "--cell", &packed_cell(), &log, "--json"]);
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
    serde_json::from_str::<serde_json::Value>(&outcome.stdout).unwrap();
    for part in ["1 of 2 windows rejected", "window 0", "3 samples are missing"] {
        assert!(outcome.stderr.contains(part), "{}", outcome.stderr);
    }
}

#[test]
fn an_interrupted_demonstration_is_a_failure() {
    let folder = Folder::new();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["demo", "--seconds", "600", "--figure", &folder.path("out.svg")])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(3));
    assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    assert_eq!(folder.names(), [""; 0]);
}
