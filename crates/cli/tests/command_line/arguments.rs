//! Arguments that make no sense: exit code 2, and what would.

use super::support::{Configuration, Folder, data, didim, head, packed_cell};

#[test]
fn nonsense_is_a_usage_error() {
    let cell = packed_cell();
    let log = &data().packed_log;
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["Usage: didim"]),
        (&["identfy"], &["unrecognized subcommand 'identfy'", "identify"]),
        (&["identify", "--cell", &cell], &["--input <FILE>", "required"]),
        (&["identify", "--cell", &cell, "--input", log, "--jsno"], &["--jsno", "--json"]),
        (
            &["identify", "--cell", &cell, "--input", log, "--method", "idim-xx"],
            &[
                "--method",
                "idim-xx",
                "possible values: idim-ls, idim-iv",
                "similar value exists: 'idim-",
            ],
        ),
        (
            &["compare", "--cell", &cell, "--input", log, "--methods", "clie,cleo"],
            &["--methods", "'cleo'", "similar value", "'cloe'"],
        ),
        (&["demo", "--method", "ddim"], &["--method", "similar value", "'didim'"]),
        (
            &["identify", "--cell", &cell, "--input", log, "--json", "--regrouping"],
            &["--json", "--regrouping", "cannot be used with"],
        ),
        (
            &["identify", "--cell", &cell, "--input", log, "--sample-rate", "5000"],
            &["--sample-rate", "for tables only", "layout"],
        ),
        (
            &["convert", "--cell", &cell, log, "out.csv", "--sample-rate", "5000"],
            &["--sample-rate", "for tables only", "layout"],
        ),
        (&["identify", "--cell", &cell, "--input", log, "--from", "x"], &["--from", "'x'"]),
        (
            &["identify", "--cell", &cell, "--input", log, "--from", "60"],
            &["--from 60", "0 to 7.9398 s"],
        ),
        (
            &["identify", "--cell", &cell, "--input", log, "--to", "60"],
            &["--to 60", "0 to 7.9398 s"],
        ),
        (&["identify", "--cell", &cell, "--input", log, "--from=-1"], &["--from -1", "0 to"]),
        (&["identify", "--cell", &cell, "--input", log, "--from", "nan"], &["--from NaN", "0 to"]),
        (
            &["identify", "--cell", &cell, "--input", log, "--from", "5", "--to", "4"],
            &["--from 5 --to 4", "no sample between"],
        ),
        (&["sim", "--cell", &cell, "--bus", "vcan0"], &["--bus", "`vcan0`", "can:INTERFACE"]),
        (&["sim", "--cell", &cell, "--bus", "inproc:"], &["inproc:", "can:INTERFACE"]),
        (&["sim", "--cell", &cell, "--bus", "log:x.log", "--seed=-1"], &["--seed", "-1"]),
        (
            &["sim", "--cell", &cell, "--bus", "log:x.log", "--scenario", "tx41"],
            &["--scenario tx41", "tx40-paper", "tx40-physical"],
        ),
    ];
    for (arguments, says) in cases {
        println!("--- {arguments:?}");
        didim(arguments).refused(2, says);
    }
    for stray in ["out.csv", "x.log"] {
        assert!(!std::path::Path::new(stray).exists(), "{stray} was written");
    }
}

#[test]
fn a_sample_rate_is_a_positive_number_everywhere() {
    let folder = Folder::new();
    let input = folder.file("short.csv", &head(&data().packed_csv, 100));
    let (cell, output) = (packed_cell(), folder.path("out.csv"));
    for rate in ["0", "-5", "nan", "inf"] {
        let option = format!("--sample-rate={rate}");
        let says = ["--sample-rate", "positive"];
        didim(&["identify", "--cell", &cell, "--input", &input, &option]).refused(2, &says);
        didim(&["identify", "--cell", &cell, "--input", &input, "--sample-rate", rate])
            .refused(2, &says);
        didim(&["convert", "--cell", &cell, &input, &output, &option]).refused(2, &says);
    }
    assert_eq!(folder.names(), ["short.csv"]);
}

#[test]
fn help_and_version_go_to_stdout() {
    let help = didim(&["--help"]).done();
    for command in ["sim", "identify", "convert", "check", "design", "payload"] {
        assert!(help.contains(command), "{help}");
        // Units stand in brackets, which are escaped in documentation alone.
        let of_command = didim(&[command, "--help"]).done();
        assert!(!of_command.contains('\\'), "{of_command}");
    }
    assert_eq!(didim(&["-V"]).done(), format!("didim {}\n", env!("CARGO_PKG_VERSION")));
    let version = didim(&["--version"]).done();
    let lines: Vec<&str> = version.lines().collect();
    let [first, commit, features] = lines[..] else { panic!("{version}") };
    assert_eq!(first, format!("didim {}", env!("CARGO_PKG_VERSION")));
    let commit = commit.strip_prefix("commit: ").unwrap();
    let is_commit = commit.len() == 12 && commit.chars().all(|digit| digit.is_ascii_hexdigit());
    assert!(is_commit || commit.starts_with("unknown"), "{version}");
    assert_eq!(features.contains("parquet"), cfg!(feature = "parquet"), "{version}");
    assert_eq!(features.contains("sqlite"), cfg!(feature = "sqlite"), "{version}");
}

#[test]
fn what_is_negative_and_cannot_be_is_refused_as_that() {
    let cell = packed_cell();
    let export = ["export", "--cell", &cell, "--result", "x", "--to", "json", "--total-mass-kg"];
    didim(&[&export[..], &["-5"]].concat()).refused(2, &["--total-mass-kg", "positive"]);
    let payload = ["payload", "--cell", &cell, "--result", "x", "--input", "y"];
    didim(&[&payload[..], &["--declared-mass-kg", "-5"]].concat()).refused(2, &["positive"]);
    let identify = ["identify", "--cell", &cell, "--input", &data().packed_log, "--from", "-1"];
    didim(&identify).refused(2, &["--from -1", "0 to"]);
    didim(&["demo", "--seconds", "-1"]).refused(2, &["--seconds -1", "5 to 86400"]);
    let file = "cells/tx40-cia402.toml";
    let slow = Configuration::with_edit(file, "rate_hz = 500.0", "rate_hz = -500.0");
    let says = ["rate_hz", "-500 Hz", "1 to 100000 cycles a second"];
    didim(&["check", "--cell", &slow.path(file)]).refused(78, &says);
}

/// Before a service is asked, which may not run.
#[test]
fn a_capture_has_a_name_that_a_file_can_have() {
    for name in ["a b", "a/b", "", "ä", "x123456789012345678901234567890123"] {
        didim(&["capture", "start", name]).refused(2, &["1 to 32 letters, digits, `_` or `-`"]);
    }
}
