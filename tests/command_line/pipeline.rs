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
            .refused(1, &["no service at", &runtime, "No such file"]);
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
    didim(&["demo", "--seconds", "0"]).refused(2, &["--seconds 0", "1 to 86400"]);
    didim(&["demo", "--method", "x"]).refused(2, &["--method", "known: idim-ls"]);
}
