//! The commands around the service: `replay`, `status`, `window`, `run`, `demo`.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use didim::service::status::Health;
use didim_identification::identification::{Finding, FindingCode, Severity, Use};

use super::support::{Folder, Outcome, data, didim, head, packed_cell};
use super::top::{first_snapshot, serve};
use crate::common::eventually;
use crate::common::expectation::Expectation;
use crate::program::Installation;

#[test]
fn a_replay_refuses_what_identify_refuses_and_writes_no_figure() {
    let folder = Folder::new();
    let lines = head(&data().packed_log, 2_000);
    let zero = folder.file("zero.log", &format!("{lines}\n"));
    let malformed = folder.file("malformed.log", &format!("{lines}hello\n"));
    let empty = folder.file("empty.log", "");
    let missing = folder.path("missing.log");
    let (cell, figure) = (packed_cell(), folder.path("out.svg"));
    let cases: [(&str, &[&str]); 4] = [
        (&zero, &["zero.log:2001:", "empty", "delete it"]),
        (&malformed, &["malformed.log:2001:", "no time stamp"]),
        (&empty, &["empty.log", "an empty file, not a recording"]),
        (&missing, &["missing.log", "No such file", "check the path"]),
    ];
    for (log, says) in cases {
        didim(&["replay", "--cell", &cell, log, "--json", "--figure", &figure]).refused(1, says);
    }
    assert_eq!(folder.names(), ["empty.log", "malformed.log", "zero.log"]);
}

/// Torques in a unit of a fifth: no window and no file gets past the limits of the arm.
#[test]
fn live_and_offline_refuse_the_same_excess_of_a_limit() {
    let torque_gains =
        [("= 1.5e-4", "= 7.5e-4"), ("= 8.0e-5", "= 4e-4"), ("= 3.5e-5", "= 1.75e-4")];
    let installation = Installation::from_cell("tx40-packed-fd", &torque_gains);
    let cell = installation.cell().display().to_string();
    let log = data().packed_log.as_str();
    let excess = "the torque of joint 2 is";
    let says = [excess, "2.37 times its limit", "the gain, or the limit?"];
    didim(&["identify", "--cell", &cell, "--input", log]).refused(1, &says);
    didim(&["replay", "--cell", &cell, log]).refused(1, &says);
}

#[test]
fn a_use_that_a_script_requires_has_its_own_exit_code() {
    let (cell, log, folder) = (packed_cell(), data().packed_log.as_str(), Folder::new());
    let identify = ["identify", "--cell", &cell, "--input", log, "--json"];
    let required = ["--require", "monitoring", "--require", "prediction"];
    let usable = didim(&[&identify[..], &required].concat()).done();
    didim(&[&["replay", "--cell", &cell, log][..], &required].concat()).done();

    // A limit below what any motion reaches: the result is computed, printed and refused.
    let limits = "[identification.limits]\ncondition_number = 1.0\n\n[identification.simulation]";
    let strict = [("[identification.simulation]", limits)];
    let installation = Installation::from_cell("tx40-packed-fd", &strict);
    let strict = installation.cell().display().to_string();
    for command in
        [&["identify", "--cell", &strict, "--input", log][..], &["replay", "--cell", &strict, log]]
    {
        let outcome = didim(&[command, &["--json", "--require", "monitoring"]].concat());
        let printed: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert_eq!(printed["verdict"]["uses"]["monitoring"]["applicable"], false);
        let findings = printed["verdict"]["findings"].clone();
        let findings: Vec<Finding> = serde_json::from_value(findings).unwrap();
        let finding = findings.iter().find(|of| of.code == FindingCode::ConditionNumber).unwrap();
        assert_eq!((finding.severity, finding.limit), (Severity::Blocking, Some(1.0)));
        assert_eq!(finding.uses, [Use::Monitoring, Use::RigidBody]);
        assert_eq!(finding.figure, printed["condition_number"].as_f64());
        outcome.says(3, &["not usable for monitoring", "condition number"]);
    }
    let value: serde_json::Value = serde_json::from_str(&usable).unwrap();
    let mut refused = value.clone();
    let verdict = &mut refused["verdict"]["uses"]["prediction"];
    verdict["applicable"] = false.into();
    verdict["reasons"] = serde_json::json!(["a reason of the test"]);
    let [good, bad] = [("good.json", &value), ("bad.json", &refused)]
        .map(|(name, result)| folder.file(name, &result.to_string()));
    let predict = |result: &str, required: &[&str]| {
        let command = ["predict", "--cell", &cell, "--result", result, "--input", log];
        didim(&[&command[..], required].concat())
    };
    predict(&good, &["--require", "prediction"]).done();
    predict(&bad, &["--require", "monitoring"]).done();
    let refusal = "the result is not usable for prediction: a reason of the test";
    let outcome = predict(&bad, &["--require", "prediction"]);
    assert!(outcome.stdout.contains(&format!("note: {refusal}")), "{outcome:#?}");
    outcome.says(3, &[refusal]);
    predict(&bad, &["--require", "contact-detection"]).refused(2, &["possible values: monitoring"]);
}

/// Asks for the status of the service in a folder.
fn status(folder: &Folder, required: &[&str]) -> Outcome {
    let runtime = folder.path("");
    let mut status = vec!["status", "--json", "--runtime", &runtime];
    status.extend(required.iter().flat_map(|of| ["--require", of]));
    didim(&status)
}

/// A service whose last result is usable for monitoring and not for prediction, and one that is
/// not healthy: exit code 3 says so, and the status is printed all the same.
#[test]
fn a_use_of_the_service_s_last_result_is_required() {
    let mut snapshot = first_snapshot();
    snapshot.health = Health { ok: true, ..Health::default() };
    let uses = serde_json::json!([
        { "use": "monitoring", "applicable": true },
        { "use": "prediction", "applicable": false, "reasons": ["a reason of the test"] },
    ]);
    let estimate = serde_json::json!({
        "window": 0, "first_sequence": 0, "last_sequence": 1, "method": "idim-ls",
        "parameters": [], "relative_error": 0.1, "condition_number": 10.0,
        "applicable": false, "reasons": [], "uses": uses,
    });
    let estimation = snapshot.estimation.as_mut().unwrap();
    estimation.last_estimate = Some(serde_json::from_value(estimate).unwrap());
    let (good, ill) = (Folder::new(), Folder::new());
    serve(Path::new(&good.path("status.sock")), &snapshot);
    snapshot.health.add("no sample has come".to_owned());
    serve(Path::new(&ill.path("status.sock")), &snapshot);
    for required in [&[][..], &["healthy"], &["monitoring"], &["monitoring", "healthy"]] {
        status(&good, required).done();
    }
    let refused = status(&good, &["monitoring", "prediction"]);
    let printed: serde_json::Value = serde_json::from_str(&refused.stdout).unwrap();
    assert_eq!(printed["estimation"]["last_estimate"]["uses"][1]["applicable"], false);
    refused.says(3, &["not usable for prediction: a reason of the test"]);
    status(&good, &["rigid-body"]).says(3, &["rigid-body"]);
    // Its health is required in any case.
    for required in [&[][..], &["monitoring"]] {
        status(&ill, required).says(3, &["not healthy: no sample has come"]);
    }
    status(&good, &["contact-detection"]).refused(2, &["possible values", "healthy"]);
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
    didim(&["demo", "--method", "x"]).refused(2, &["--method", "possible values: idim-ls"]);
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
    didim(&command).refused(1, &["1 of 1 result not stored", "window 0", "Is a directory"]);
}

#[test]
fn rejected_windows_are_reported_next_to_the_result() {
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

/// A demonstration that would take ten minutes, when its stream is in shared memory.
fn long_demonstration(folder: &Folder) -> (Child, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["demo", "--seconds", "600", "--figure", &folder.path("out.svg")])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    // Lock, management, and the samples' segment, which is the last and by far the largest.
    loop {
        let prefix = mapped_prefix(&child);
        if prefix.as_ref().is_some_and(|prefix| shared_bytes(prefix) >= 10_000_000) {
            return (child, prefix.unwrap());
        }
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        assert!(begin.elapsed() < Duration::from_secs(60), "no stream within a minute");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Prefix of the files in shared memory that a process has mapped.
fn mapped_prefix(child: &Child) -> Option<String> {
    let maps = std::fs::read_to_string(format!("/proc/{}/maps", child.id())).ok()?;
    let (_, name) = maps.split_once("/dev/shm/didim-run-")?;
    Some(format!("didim-run-{}_", name.split_once('_')?.0))
}

/// Bytes in shared memory of the files with a prefix.
fn shared_bytes(prefix: &str) -> u64 {
    let files = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let files = files.filter(|file| file.file_name().to_str().unwrap().starts_with(prefix));
    files.filter_map(|file| file.metadata().ok()).map(|data| data.len()).sum()
}

fn kill(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

#[test]
fn an_interrupted_demonstration_leaves_nothing() {
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let folder = Folder::new();
        let (child, prefix) = long_demonstration(&folder);
        kill(&child, signal);
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{signal:?}: {stderr}");
        assert!(stderr.contains("interrupted"), "{stderr}");
        assert_eq!(folder.names(), [""; 0]);
        assert_eq!(shared_bytes(&prefix), 0, "{signal:?}");
    }
}

#[test]
fn what_a_killed_run_left_in_shared_memory_goes_with_the_next_and_no_living_one_does() {
    let folder = Folder::new();
    let (mut living, of_living) = long_demonstration(&folder);
    let (mut killed, of_killed) = long_demonstration(&folder);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let bytes = shared_bytes(&of_living);
    didim(&["replay", "--cell", &packed_cell(), &data().packed_log, "--json"]).done();
    // A start of another test may be the one that removes the files, and be at it still.
    eventually("the files are removed", || shared_bytes(&of_killed) == 0);
    let expected = Expectation::of("shared-memory-left");
    expected.assert_eq("bytes_left", &shared_bytes(&of_killed));
    assert_eq!(shared_bytes(&of_living), bytes);
    kill(&living, Signal::INT);
    living.wait().unwrap();
    assert_eq!(shared_bytes(&of_living), 0);
}

#[test]
fn an_interrupted_offline_command_says_so_and_leaves_no_file() {
    let folder = Folder::new();
    // A log that does not end: the command waits for more of it.
    let pipe = folder.path("endless.log");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_didim"))
            .args(["identify", "--cell", &packed_cell(), "--input", &pipe])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // It is opened for reading: the command is at work.
        let writer = std::fs::File::options().write(true).open(&pipe).unwrap();
        kill(&child, signal);
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal:?}");
        drop(writer);
    }
    assert_eq!(folder.names(), ["endless.log"]);
}
