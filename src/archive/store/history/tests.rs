use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use super::*;
use crate::archive::store::Timestamp;
use crate::window::Note;

fn line(result: u64) -> HistoryLine {
    HistoryLine {
        schema: HISTORY_SCHEMA,
        time: Timestamp::from_unix_s(1_795_331_849 + result),
        recorded: None,
        result,
        cell: "cell".into(),
        robot: "tx40".into(),
        configuration: "c0ffee".into(),
        regrouping: String::new(),
        method: "idim-ls".into(),
        applicable: true,
        monitoring: Some(true),
        uses: [("prediction".to_owned(), false)].into(),
        relative_error: Some(0.05),
        note: Some(Note { text: Some("warm \"arm\"".into()), ..Note::default() }),
        parameters: vec![ParameterValue {
            description: None,
            name: "fc3".into(),
            unit: "N·m".into(),
            value: 6.48,
            standard_deviation: 0.003,
            combined_standard_deviation: None,
        }],
        against: None,
        load: None,
        readings: Default::default(),
    }
}

fn append(folder: &Path, keep: usize, results: core::ops::Range<u64>) {
    let (mut history, _) = HistoryFile::open(folder, keep, 5).unwrap();
    results.for_each(|result| history.append(&line(result)).unwrap());
}

fn numbers(folder: &Path) -> (Vec<u64>, usize) {
    let (lines, passed_over) = read_history(folder).unwrap();
    (lines.iter().map(|line| line.result).collect(), passed_over)
}

fn tear(folder: &Path, what: &[u8]) {
    let path = folder.join("history.jsonl");
    OpenOptions::new().append(true).open(path).unwrap().write_all(what).unwrap();
}

#[test]
fn lines_come_back_as_they_went() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(read_history(folder.path()), Err(HistoryError::None { .. })));
    append(folder.path(), 100, 0..3);
    let (lines, passed_over) = read_history(folder.path()).unwrap();
    assert_eq!((lines, passed_over), ((0..3).map(line).collect(), 0));
    let text = fs::read_to_string(folder.path().join("history.jsonl")).unwrap();
    assert!(text.starts_with("{\"schema\":1,\"time\":\"2026-11-22T07:17:29Z\",\"result\":0,"));
    // A NaN is written as null, and is read back as NaN.
    let mut odd = line(3);
    odd.parameters[0].standard_deviation = f64::NAN;
    HistoryFile::open(folder.path(), 100, 5).unwrap().0.append(&odd).unwrap();
    let back = read_history(folder.path()).unwrap().0;
    assert!(back[3].parameters[0].standard_deviation.is_nan());
}

#[test]
fn a_line_torn_at_any_byte_is_passed_over_and_never_appended_to() {
    let torn = serde_json::to_vec(&line(2)).unwrap();
    // One case is complete except for its newline: it may be the beginning of something else.
    for cut in (1..=torn.len()).step_by(7).chain([torn.len()]) {
        let folder = tempfile::tempdir().unwrap();
        append(folder.path(), 100, 0..2);
        tear(folder.path(), &torn[..cut]);
        assert_eq!(numbers(folder.path()), (vec![0, 1], 1), "cut at {cut}");
        append(folder.path(), 100, 3..4);
        assert_eq!(numbers(folder.path()), (vec![0, 1, 3], 0), "cut at {cut}");
    }
}

#[test]
fn what_is_no_line_of_ours_is_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    append(folder.path(), 100, 0..2);
    tear(folder.path(), b"what is this?\n\xff\xfe\n{\"schema\":1}\n");
    append(folder.path(), 100, 2..3);
    assert_eq!(numbers(folder.path()), (vec![0, 1, 2], 3));
}

#[test]
fn an_append_that_failed_half_way_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let (mut history, _) = HistoryFile::open(folder.path(), 100, 5).unwrap();
    history.append(&line(0)).unwrap();
    // A full disk leaves such a half line while the writer has the file open.
    tear(folder.path(), b"{\"schema\":1,\"ti");
    history.append(&line(1)).unwrap();
    assert_eq!(numbers(folder.path()), (vec![0, 1], 0));
}

#[test]
fn the_oldest_lines_go_and_nothing_is_left_next_to() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(".history.jsonl.a1B2c3.tmp"), "half").unwrap();
    append(folder.path(), 20, 0..23);
    // One more than 20 plus a tenth: back to 20.
    assert_eq!(numbers(folder.path()).0, (3..23).collect::<Vec<_>>());
    append(folder.path(), 20, 23..25);
    assert_eq!(numbers(folder.path()).0, (3..25).collect::<Vec<_>>());
    append(folder.path(), 20, 25..26);
    assert_eq!(numbers(folder.path()).0, (6..26).collect::<Vec<_>>());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn whichever_program_opens_gets_the_last_lines() {
    let folder = tempfile::tempdir().unwrap();
    append(folder.path(), 100, 0..9);
    let (_, last) = HistoryFile::open(folder.path(), 100, 4).unwrap();
    assert_eq!(last.iter().map(|line| line.result).collect::<Vec<_>>(), [5, 6, 7, 8]);
}

#[test]
fn a_history_that_was_removed_begins_anew() {
    let folder = tempfile::tempdir().unwrap();
    let (mut history, _) = HistoryFile::open(folder.path(), 100, 5).unwrap();
    history.append(&line(0)).unwrap();
    fs::remove_file(folder.path().join("history.jsonl")).unwrap();
    history.append(&line(1)).unwrap();
    assert_eq!(numbers(folder.path()), (vec![1], 0));
}

#[test]
fn what_somebody_else_put_into_the_file_stays_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.jsonl");
    append(folder.path(), 100, 0..2);
    let (mut history, _) = HistoryFile::open(folder.path(), 100, 5).unwrap();
    // Longer lines before the own ones: the previous end is now within a line.
    let mut longer = line(7);
    longer.note = Some(Note { text: Some("x".repeat(100)), ..Note::default() });
    let longer = serde_json::to_string(&longer).unwrap() + "\n";
    let lines = fs::read_to_string(&path).unwrap();
    fs::write(&path, longer.clone() + &lines).unwrap();
    history.append(&line(2)).unwrap();
    assert_eq!(numbers(folder.path()), (vec![7, 0, 1, 2], 0));
    // Half a line at the end, of another writer or of this one.
    tear(folder.path(), longer.as_bytes());
    tear(folder.path(), b"{\"schema\":1,\"ti");
    history.append(&line(3)).unwrap();
    assert_eq!(numbers(folder.path()), (vec![7, 0, 1, 2, 7, 3], 0));
    // Shorter, and cut within a line.
    fs::write(&path, &lines[..lines.len() - 9]).unwrap();
    history.append(&line(4)).unwrap();
    assert_eq!(numbers(folder.path()), (vec![0, 4], 0));
}

#[test]
fn lines_of_somebody_else_count_among_those_to_keep() {
    let folder = tempfile::tempdir().unwrap();
    let (mut history, _) = HistoryFile::open(folder.path(), 20, 5).unwrap();
    history.append(&line(0)).unwrap();
    for result in 1..30 {
        tear(folder.path(), (serde_json::to_string(&line(result)).unwrap() + "\n").as_bytes());
    }
    history.append(&line(30)).unwrap();
    assert_eq!(numbers(folder.path()), ((11..31).collect(), 0));
}

#[test]
fn lines_of_a_later_version_are_not_read_and_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.jsonl");
    append(folder.path(), 20, 0..3);
    // One line that looks like ours but has other meanings, and one that does not.
    let alike = HistoryLine { schema: HISTORY_SCHEMA + 1, ..line(1) };
    let later = [serde_json::to_string(&alike).unwrap(), "{\"schema\":3,\"when\":4}".to_owned()];
    for later in &later {
        tear(folder.path(), format!("{later}\n").as_bytes());
    }
    // A version that never existed.
    let never = serde_json::to_string(&HistoryLine { schema: 0, ..line(2) }).unwrap();
    tear(folder.path(), format!("{never}\n").as_bytes());
    assert_eq!(numbers(folder.path()), (vec![0, 1, 2], 3));
    // A key unknown to this version is kept as well.
    let more = serde_json::to_string(&line(3)).unwrap().replacen('{', "{\"more\":[1],", 1);
    tear(folder.path(), format!("{more}\n").as_bytes());
    append(folder.path(), 20, 4..20);
    assert_eq!(numbers(folder.path()), ((0..20).collect(), 3));
    append(folder.path(), 20, 20..21);
    // 23 lines with those of the later version. Three are removed, and the kept ones are unchanged
    // byte by byte.
    assert_eq!(numbers(folder.path()), ((3..21).collect(), 2));
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.starts_with(&format!("{}\n{}\n{more}\n", later[0], later[1])), "{text}");
}

/// Earlier versions did not write units.
#[test]
fn a_line_without_units_is_read_and_keeps_none() {
    let json = serde_json::to_string(&line(3)).unwrap();
    assert!(json.contains("\"unit\":\"N·m\""), "{json}");
    let old = json.replace("\"unit\":\"N·m\",", "");
    let read: HistoryLine = serde_json::from_str(&old).unwrap();
    assert_eq!((read.parameters[0].unit.as_str(), read.parameters[0].unit_or_dash()), ("", "–"));
    assert_eq!(serde_json::to_string(&read).unwrap(), old, "nothing is invented");
}

/// Returns all lines that a follower has not returned yet.
fn followed(follower: &mut HistoryFollower) -> Vec<u64> {
    core::iter::from_fn(|| follower.next_line().unwrap()).map(|line| line.result).collect()
}

#[test]
fn a_follower_gives_each_line_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut follower = HistoryFollower::new(folder.path(), None);
    assert_eq!(followed(&mut follower), Vec::<u64>::new(), "there is none yet");
    append(folder.path(), 10, 0..3);
    assert_eq!(followed(&mut follower), [0, 1, 2]);
    // A line is returned when it is complete, and an invalid one is skipped.
    let text = serde_json::to_vec(&line(3)).unwrap();
    tear(folder.path(), &text[..40]);
    assert_eq!(followed(&mut follower), Vec::<u64>::new());
    tear(folder.path(), &[&text[40..], b"\nwhat is this?\n"].concat());
    assert_eq!((followed(&mut follower), follower.passed_over()), (vec![3], 1));
    // The oldest lines are removed, into a new file.
    append(folder.path(), 10, 4..12);
    assert_eq!(numbers(folder.path()).0.len(), 10);
    assert_eq!(followed(&mut follower), (4..12).collect::<Vec<_>>());
}

#[test]
fn another_follower_goes_on_from_a_mark() {
    let folder = tempfile::tempdir().unwrap();
    append(folder.path(), 10, 0..5);
    let after = |result| Some(HistoryMark::from_line(&line(result)));
    let follow = |mark| followed(&mut HistoryFollower::new(folder.path(), mark));
    assert_eq!(follow(after(2)), [3, 4]);
    assert_eq!(follow(after(4)), Vec::<u64>::new());
    // The line of the mark was removed with the oldest ones.
    append(folder.path(), 10, 5..30);
    let numbers_kept = numbers(folder.path()).0;
    assert!(numbers_kept[0] > 5);
    assert_eq!(follow(after(5)), numbers_kept);
    // The folder was emptied and counts from 0: its lines came later.
    fs::remove_file(folder.path().join("history.jsonl")).unwrap();
    append(folder.path(), 10, 0..2);
    let old = HistoryMark { time: Timestamp::from_unix_s(1), ..HistoryMark::from_line(&line(29)) };
    assert_eq!(follow(Some(old)), [0, 1]);
}
