//! Candump logs that are damaged, incomplete or of another bus: exit code 1.

use super::support::{Folder, cia402_cell, data, didim, packed_cell};

/// Lines of the recording, and the refusal of the log that `damage` makes of them.
#[track_caller]
fn refused(corrupt: impl FnOnce(&mut Vec<String>), says: &[&str]) {
    let text = std::fs::read_to_string(&data().packed_log).unwrap();
    let mut lines: Vec<String> = text.split_inclusive('\n').map(str::to_owned).collect();
    corrupt(&mut lines);
    let folder = Folder::new();
    let log = folder.file("damaged.log", &lines.concat());
    let (csv, figure) = (folder.path("out.csv"), folder.path("out.svg"));
    let cell = packed_cell();
    let says = [&["damaged.log"], says].concat();
    let identify = ["identify", "--cell", &cell, "--input", &log, "--json", "--figure", &figure];
    didim(&identify).refused(1, &says);
    didim(&["convert", "--cell", &cell, &log, &csv]).refused(1, &says);
    assert_eq!(folder.names(), ["damaged.log"]);
}

/// A recorder that was killed, and a disk that is full, leave half a line. A line that looks whole
/// may lack its last bytes.
#[test]
fn a_log_cut_off_in_a_line() {
    let text = std::fs::read_to_string(&data().packed_log).unwrap();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let (folder, cell) = (Folder::new(), packed_cell());
    for (whole_lines, rest) in [(29_999, 100), (39_699, lines[39_699].len() - 1)] {
        let cut = lines[..whole_lines].concat() + &lines[whole_lines][..rest];
        let log = folder.file("cut.log", &cut);
        let identified = didim(&["identify", "--cell", &cell, "--input", &log, "--json"]);
        let warnings = identified.stderr.matches("cut off in its last line").count();
        let json: serde_json::Value = serde_json::from_str(&identified.done()).unwrap();
        assert_eq!((json["samples"].as_u64(), warnings), (Some(whole_lines as u64), 1));
    }
}

#[test]
fn a_malformed_line() {
    let corrupt = |to: &'static str| move |lines: &mut Vec<String>| lines[1233] = to.to_owned();
    refused(corrupt("hello\n"), &[":1234:", "no time stamp", "candump -l"]);
    refused(corrupt("\n"), &[":1234:", "empty", "delete it"]);
    refused(corrupt("(0.2466) can0 1000##1\n"), &[":1234:", "identifier", "three hexadecimal"]);
    refused(corrupt("(0.2466) can0 100##10\n"), &[":1234:", "pairs of hexadecimal digits"]);
    refused(corrupt("(0.2466) can0 100 [8] 00 11\n"), &[":1234:", "bytes of data"]);
    refused(corrupt("(0.2466) can0 100 0011\n"), &[":1234:", "123#1122"]);
}

#[test]
fn a_log_with_a_gap() {
    let text = std::fs::read_to_string(&data().packed_log).unwrap();
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    drop(lines.drain(10_000..10_005));
    let folder = Folder::new();
    let (log, csv) = (folder.file("cut.log", &lines.concat()), folder.path("out.csv"));
    let cell = packed_cell();
    let cut = [
        "bus cycles are missing; not used, by cause: ",
        "counter gap 5",
        "2 whole pieces: 0.000 to 2.000 s",
    ];
    didim(&["identify", "--cell", &cell, "--input", &log]).says(0, &cut);
    didim(&["convert", "--cell", &cell, &log, &csv]).refused(1, &["convert whole pieces"]);
    assert_eq!(folder.names(), ["cut.log"]);
}

/// A target takes effect at the next SYNC, so that the first cycle behind each gap has none: it is
/// left out, and a piece too short to tell a rate costs nothing.
#[test]
fn gaps_cost_neither_the_reference_nor_the_rate() {
    let text = std::fs::read_to_string(&data().cia402_log).unwrap();
    let cycles: Vec<usize> = text
        .split_inclusive('\n')
        .enumerate()
        .filter(|(_, line)| line.contains(" 080#"))
        .map(|(index, _)| index)
        .collect();
    let is_lost = |line: usize| {
        let cycle = cycles.partition_point(|begin| *begin <= line);
        (2001..=2005).contains(&cycle) || (2056..=2060).contains(&cycle)
    };
    let lines = text.split_inclusive('\n').enumerate();
    let remaining: String =
        lines.filter(|(index, _)| !is_lost(*index)).map(|(_, line)| line).collect();
    let folder = Folder::new();
    let log = folder.file("cut.log", &remaining);
    let outcome = didim(&["identify", "--cell", &cia402_cell(), "--input", &log]);
    assert!(
        outcome.stderr.contains("3 samples before the first reference are left out"),
        "{}",
        outcome.stderr
    );
    assert!(outcome.stderr.contains("3 whole pieces: 0.000 to "), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("the reference is not used"), "{}", outcome.stderr);
    outcome.done();
}

/// The frames of the recording as Vector's tools log them.
#[test]
fn a_log_of_vector_identifies_as_that_of_candump_does() {
    let text = std::fs::read_to_string(&data().packed_log).unwrap();
    let asc: String = text
        .lines()
        .map(|line: &str| {
            let (stamp, frame) = line[1..].split_once(") can0 100##1").unwrap();
            let bytes: Vec<&str> = (0..frame.len() / 2).map(|k| &frame[2 * k..2 * k + 2]).collect();
            format!("{stamp} CANFD 1 Rx 100 1 0 f {} {}\n", bytes.len(), bytes.join(" "))
        })
        .collect();
    let folder = Folder::new();
    let asc = format!("date Mon Nov 23 10:00:00 2026\nbase hex  timestamps absolute\n{asc}");
    let log = folder.file("drive.asc", &asc);
    fn parameters(log: &str) -> serde_json::Value {
        let cell = packed_cell();
        let json = didim(&["identify", "--json", "--cell", &cell, "--input", log]).done();
        let result: serde_json::Value = serde_json::from_str(&json).unwrap();
        result["parameters"].clone()
    }
    assert_eq!(parameters(&log), parameters(&data().packed_log));
}

#[test]
fn a_log_of_another_bus() {
    let cell = cia402_cell();
    let log = &data().packed_log;
    let says = [
        log,
        "no complete sample in 39700 frames",
        "layout",
        "080 181 182",
        "the log 100",
        "unknown id 39700",
    ];
    didim(&["identify", "--cell", &cell, "--input", log, "--json"]).refused(1, &says);
    // The same identifier, but shorter frames than the layout says.
    refused(
        |lines: &mut Vec<String>| {
            for line in lines {
                line.truncate(line.find("##").unwrap() + 3 + 64);
                line.push('\n');
            }
        },
        &["no complete sample", "wrong length 39700"],
    );
}

#[test]
fn logs_without_frames() {
    refused(Vec::clear, &["this is an empty file, not a recording"]);
}

#[test]
fn a_log_too_short_to_identify() {
    let folder = Folder::new();
    let text = super::support::head(&data().packed_log, 2_500);
    let log = folder.file("short.log", &text);
    let cell = packed_cell();
    didim(&["identify", "--cell", &cell, "--input", &log])
        .refused(1, &["short.log", "2500 samples", "margin", "record longer", "--from"]);
    // Not all margin, but too few rows.
    let log = folder.file("few.log", &super::support::head(&data().packed_log, 2_600));
    didim(&["identify", "--cell", &cell, "--input", &log])
        .refused(1, &["few.log", "rows", "28 parameters", "record longer"]);
    // Shorter than the filters.
    let log = folder.file("tiny.log", &super::support::head(&data().packed_log, 20));
    didim(&["identify", "--cell", &cell, "--input", &log, "--from", "0", "--to", "0.0038"])
        .refused(1, &["tiny.log", "rows", "record longer"]);
}
