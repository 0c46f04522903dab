use didim_dynamics::JointSample;
use didim_formats::RecordingStart;
use didim_identification::identification::{Estimate, SingularValues, Verdict};

use super::*;
use crate::archive::store::read_history;
use crate::expectation::Expectation;
use crate::window::Note;
use crate::window::{Window, WindowEnd};

fn estimate(value: f64) -> Estimate {
    Estimate {
        schema: 1,
        method: "idim-ls".into(),
        robot: "pendulum".into(),
        samples: 3,
        rows: 3,
        condition_number: value,
        unweighted_condition_number: value,
        singular_values: SingularValues { max: value, min: 1.0 },
        relative_error: 0.1,
        relative_error_per_joint: vec![0.1],
        rms_error_per_joint_nm: vec![f64::NAN],
        durbin_watson_per_joint: vec![2.0],
        verdict: good(),
        ..Estimate::default()
    }
}

fn window() -> Window {
    Window {
        number: 4,
        sample_rate_hz: 1000.0,
        samples: (10..16).map(|sequence| JointSample::zero(sequence, 0)).collect(),
        counted_samples: 1..5,
        end: WindowEnd::Rest,
        recording_start: RecordingStart::of_unix_ns(1_795_331_849_250_400_000),
        note: None,
    }
}

fn write(store: &mut Store, value: f64) -> Stored {
    let (window, estimate) = (window(), estimate(value));
    store
        .write(
            &ResultRecord::new("cell", "c0ffee", &window, estimate),
            &Attachments::default(),
            Timestamp::now(),
        )
        .unwrap()
}

const CONFIGURATIONS: [&str; 2] = [
    "1111111111111111111111111111111111111111111111111111111111111111",
    "2222222222222222222222222222222222222222222222222222222222222222",
];

fn texts() -> ConfigurationTexts {
    let layout = vec![("bus.dbc".into(), "c".into())];
    ConfigurationTexts { cell: "a".into(), robot: "b".into(), layout }
}

/// Writes a result like a worker does.
fn write_with(store: &mut Store, configuration: &str) {
    let (window, estimate) = (window(), estimate(1.0));
    store.keep_configuration(configuration, &texts()).unwrap();
    let record = ResultRecord::new("cell", configuration, &window, estimate);
    store.write(&record, &Attachments::default(), Timestamp::now()).unwrap();
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_result_says_where_it_comes_from_and_is_the_latest() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(&folder.path().join("a/b"), 10).unwrap();
    let stored = write(&mut store, 7.0);
    assert_eq!(
        names(&folder.path().join("a/b")),
        ["history.jsonl", "latest.json", "result-00000000.json"]
    );
    let json: serde_json::Value = serde_json::from_slice(&stored.json).unwrap();
    assert_eq!(json["window"]["first_sequence"], 10);
    assert_eq!(json["window"]["last_sequence"], 15);
    assert_eq!(json["window"]["first_counted"], 11);
    assert_eq!(json["window"]["counted"], 4);
    assert_eq!(json["window"]["end"], "rest");
    assert_eq!(json["window"]["recorded"], "2026-11-22T07:17:29.250Z");
    assert_eq!(stored.line.recorded, window().recording_start);
    assert_eq!(json["configuration"], "c0ffee");
    assert_eq!(json["estimate"]["condition_number"], 7.0);
    assert_eq!(json["estimate"]["rms_error_per_joint_nm"][0], serde_json::Value::Null);
    assert_eq!(fs::read(&stored.path).unwrap(), stored.json);
    let latest = folder.path().join("a/b/latest.json");
    assert_eq!(fs::read(&latest).unwrap(), stored.json);
    assert!(latest.is_symlink(), "it takes no room");
}

#[test]
fn the_same_result_gives_the_same_bytes() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let first = write(&mut Store::open(one.path(), 3).unwrap(), 1.0 / 3.0);
    let second = write(&mut Store::open(two.path(), 9).unwrap(), 1.0 / 3.0);
    assert_eq!(first.json, second.json);
    assert_eq!(first.path.file_name(), second.path.file_name());
}

#[test]
fn the_oldest_give_way_and_numbers_go_on_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 3).unwrap();
    for value in 0..5 {
        write(&mut store, f64::from(value));
    }
    drop(store);
    fs::write(folder.path().join("notes.txt"), "not ours").unwrap();
    let mut store = Store::open(folder.path(), 3).unwrap();
    write(&mut store, 5.0);
    assert_eq!(
        names(folder.path()),
        [
            "history.jsonl",
            "latest.json",
            "notes.txt",
            "result-00000003.json",
            "result-00000004.json",
            "result-00000005.json"
        ]
    );
    let latest = fs::read_to_string(folder.path().join("latest.json")).unwrap();
    assert!(latest.contains("\"condition_number\":5.0"));
}

#[test]
fn what_a_dying_process_left_is_removed_and_never_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["latest.json", "result-00000007.json", "history-00000000.jsonl.zst", ".owed.jsonl"]
    {
        fs::write(folder.path().join(format!(".{name}.a1B2c3.tmp")), "{\"half").unwrap();
    }
    let mut store = Store::open(folder.path(), 3).unwrap();
    assert_eq!(names(folder.path()), Vec::<String>::new());
    write(&mut store, 1.0);
    assert_eq!(names(folder.path()), ["history.jsonl", "latest.json", "result-00000000.json"]);
}

#[test]
fn a_failed_write_leaves_the_old_result_and_the_number() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 3).unwrap();
    let before = write(&mut store, 1.0);
    // A folder with the name of the result file: the write fails, for root as well.
    let in_the_way = folder.path().join("result-00000001.json");
    fs::create_dir(&in_the_way).unwrap();
    let (window, next) = (window(), estimate(2.0));
    let record = ResultRecord::new("cell", "c0ffee", &window, next);
    let failed = store.write(&record, &Attachments::default(), Timestamp::now());
    assert!(matches!(failed, Err(StoreError::Io { action: "write", .. })), "{failed:?}");
    assert_eq!(fs::read(folder.path().join("latest.json")).unwrap(), before.json);
    assert_eq!(read_history(folder.path()).unwrap().0.len(), 1);
    fs::remove_dir(in_the_way).unwrap();
    let after = write(&mut store, 2.0);
    assert!(after.path.ends_with("result-00000001.json"));
}

#[test]
fn names_that_are_not_ours_neither_count_nor_go() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = ["result-+5.json", "result-42.json", "result-18446744073709551615.json"];
    for name in foreign {
        fs::write(folder.path().join(name), "not ours").unwrap();
    }
    let mut store = Store::open(folder.path(), 1).unwrap();
    for value in 0..3 {
        let stored = write(&mut store, f64::from(value));
        assert!(stored.path.ends_with(format!("result-0000000{value}.json")));
    }
    let mut expected = vec!["history.jsonl", "latest.json", "result-00000002.json"];
    expected.extend(foreign);
    expected.sort_unstable();
    assert_eq!(names(folder.path()), expected);
}

#[test]
fn a_result_is_stored_even_if_its_copy_and_the_oldest_are_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    // Folders with the names of files: they are neither replaced nor removed, for root as well.
    fs::create_dir(folder.path().join(LATEST_FILE)).unwrap();
    fs::create_dir(folder.path().join("result-00000000.json")).unwrap();
    let mut store = Store::open(folder.path(), 1).unwrap();
    for index in 1..3 {
        let stored = write(&mut store, 1.0);
        assert!(stored.path.ends_with(format!("result-0000000{index}.json")), "{stored:?}");
        assert_eq!(fs::read(&stored.path).unwrap(), stored.json);
    }
}

#[test]
fn a_folder_has_one_writer() {
    let folder = tempfile::tempdir().unwrap();
    let first = Store::open(folder.path(), 3).unwrap();
    let second = Store::open(folder.path(), 3).unwrap_err();
    assert!(matches!(second, StoreError::InUse { .. }), "{second}");
    assert!(second.to_string().contains("another process"), "{second}");
    drop(first);
    Store::open(folder.path(), 3).unwrap();
}

#[test]
fn a_report_of_an_earlier_version_goes_with_its_result() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 2).unwrap();
    write(&mut store, 1.0);
    fs::write(folder.path().join("result-00000000.html"), "a report").unwrap();
    write(&mut store, 2.0);
    assert!(names(folder.path()).contains(&"result-00000000.html".to_owned()));
    write(&mut store, 3.0);
    let expected = ["history.jsonl", "latest.json", "result-00000001.json", "result-00000002.json"];
    assert_eq!(names(folder.path()), expected);
}

#[test]
fn a_configuration_is_kept_once_and_goes_with_its_last_result() {
    let folder = tempfile::tempdir().unwrap();
    let folder_of_all = folder.path().join("configurations");
    // Incomplete files of a dying process.
    fs::create_dir_all(folder_of_all.join(".writing.tmp/x")).unwrap();
    let mut store = Store::open(folder.path(), 2).unwrap();
    assert_eq!(names(&folder_of_all), Vec::<String>::new());
    let [one, two] = CONFIGURATIONS;
    fs::create_dir(folder_of_all.join("not-ours")).unwrap();
    write_with(&mut store, one);
    write_with(&mut store, one);
    let file = |name: &str| fs::read_to_string(folder_of_all.join(one).join(name)).unwrap();
    assert_eq!([file("cell.toml"), file("robot.toml"), file("bus.dbc")], ["a", "b", "c"]);
    assert_eq!(names(&folder_of_all), [one, "not-ours"]);
    write_with(&mut store, two);
    assert_eq!(
        names(&folder_of_all),
        [one, two, "not-ours"],
        "a result of the first is still there"
    );
    write_with(&mut store, two);
    assert_eq!(names(&folder_of_all), [two, "not-ours"]);
}

#[test]
fn no_configuration_goes_when_a_result_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 2).unwrap();
    let [one, two] = CONFIGURATIONS;
    write_with(&mut store, one);
    write_with(&mut store, one);
    fs::write(folder.path().join("result-00000001.json"), "{").unwrap();
    write_with(&mut store, two);
    assert_eq!(names(&folder.path().join("configurations")), [one, two]);
}

#[test]
fn a_name_that_is_no_hash_is_never_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 2).unwrap();
    for name in ["c0ffee", "../../etc", ""] {
        store.keep_configuration(name, &texts()).unwrap();
    }
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

/// A line as a store writes it, with the data that the result file does not contain.
fn noted() -> Attachments {
    let note = Some(Note { payload_kg: Some(2.0), ..Note::default() });
    Attachments { note, regrouping: "feed".into(), against: None, load: None }
}

fn write_noted(folder: &Path) -> Vec<HistoryLine> {
    let mut store = Store::open(folder, 9).unwrap();
    let (window, estimate) = (window(), estimate(1.0));
    let record = ResultRecord::new("cell", "c0ffee", &window, estimate);
    (0..3).map(|_| store.write(&record, &noted(), Timestamp::now()).unwrap().line).collect()
}

/// Cuts the history after this number of bytes of its last line.
fn cut_last_line(folder: &Path, bytes: usize) {
    let path = folder.join("history.jsonl");
    let text = fs::read(&path).unwrap();
    let begin = text[..text.len() - 1].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;
    fs::write(&path, &text[..begin + bytes]).unwrap();
}

#[test]
fn a_line_that_was_put_aside_is_written_at_the_next_start() {
    // Killed before the line, within it, after it, and before its result.
    for (cut, has_result) in [(Some(0), true), (Some(40), true), (None, true), (Some(0), false)] {
        let folder = tempfile::tempdir().unwrap();
        let lines = write_noted(folder.path());
        let aside = serde_json::to_string(&lines[2]).unwrap() + "\n";
        fs::write(folder.path().join(".owed.jsonl"), aside).unwrap();
        if let Some(bytes) = cut {
            cut_last_line(folder.path(), bytes);
        }
        if !has_result {
            fs::remove_file(folder.path().join("result-00000002.json")).unwrap();
        }
        drop(Store::open(folder.path(), 9).unwrap());
        let expected = if has_result { &lines[..] } else { &lines[..2] };
        assert_eq!(read_history(folder.path()).unwrap(), (expected.to_vec(), 0), "{cut:?}");
        assert!(!folder.path().join(".owed.jsonl").exists());
    }
}

#[test]
fn a_result_without_a_line_gets_one_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let lines = write_noted(folder.path());
    cut_last_line(folder.path(), 40);
    fs::remove_file(folder.path().join("latest.json")).unwrap();
    fs::write(folder.path().join("latest.json"), "a copy of an earlier version").unwrap();
    drop(Store::open(folder.path(), 9).unwrap());
    let (found, passed_over) = read_history(folder.path()).unwrap();
    // Everything except the note; the date is that of the file.
    let expected = HistoryLine { note: None, time: found[2].time, ..lines[2].clone() };
    assert_eq!((&found[..2], &found[2], passed_over), (&lines[..2], &expected, 0));
    assert!(found[2].time.unix_s().abs_diff(lines[2].time.unix_s()) <= 2);
    let newest = fs::read(folder.path().join("result-00000002.json")).unwrap();
    assert_eq!(fs::read(folder.path().join("latest.json")).unwrap(), newest);
    // The line is appended once, and not again.
    drop(Store::open(folder.path(), 9).unwrap());
    assert_eq!(read_history(folder.path()).unwrap().0.len(), 3);
}

#[test]
fn a_line_that_cannot_be_appended_is_written_later() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 9).unwrap();
    let history = folder.path().join("history.jsonl");
    fs::create_dir(&history).unwrap();
    write(&mut store, 1.0);
    write(&mut store, 2.0);
    assert!(store.settle().is_err());
    fs::remove_dir(&history).unwrap();
    write(&mut store, 3.0);
    let results: Vec<u64> =
        read_history(folder.path()).unwrap().0.iter().map(|line| line.result).collect();
    assert_eq!(results, [0, 1, 2]);
    assert!(!folder.path().join(".owed.jsonl").exists());
}

#[test]
fn a_folder_that_was_moved_away_takes_results_when_it_is_back() {
    let place = tempfile::tempdir().unwrap();
    let (folder, away) = (place.path().join("state"), place.path().join("away"));
    let mut store = Store::open(&folder, 10).unwrap();
    write(&mut store, 1.0);
    fs::rename(&folder, &away).unwrap();
    let record = ResultRecord::new("cell", "c0ffee", &window(), estimate(2.0));
    let refused = store.write(&record, &Attachments::default(), Timestamp::now());
    let words = refused.unwrap_err().to_string();
    assert!(words.contains(folder.to_str().unwrap()), "{words}");
    assert!(!folder.exists(), "nothing is written where nobody looks for it");
    fs::rename(&away, &folder).unwrap();
    let expected = Expectation::of("state-folder-gone");
    expected.assert_eq("next_number", &write(&mut store, 2.0).number);
    let lines = read_history(&folder).unwrap().0;
    assert!(lines.iter().map(|line| line.result).eq([0, 1]));
    assert!(matches!(Store::open(&folder, 10), Err(StoreError::InUse { .. })), "locked still");
}

#[test]
fn numbers_of_removed_results_are_not_used_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path(), 5).unwrap();
    let numbers = [1.0, 2.0, 3.0].map(|value| write(&mut store, value).number);
    assert_eq!(numbers, [0, 1, 2]);
    drop(store);
    for number in numbers {
        fs::remove_file(result_file(folder.path(), number)).unwrap();
    }
    let mut store = Store::open(folder.path(), 5).unwrap();
    let expected = Expectation::of("results-removed");
    expected.assert_eq("next_number", &write(&mut store, 4.0).number);
}

/// Ten years of a result a week. The clock is unset in one month, and one hour slow in another.
#[test]
fn ten_years_of_results_are_bounded_and_every_line_has_its_date() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let began = 1_798_761_600;
    let time = |week: u64| {
        let seconds = began + week * 604_800;
        Timestamp::from_unix_s(match week {
            200..204 => seconds - began,
            300..304 => seconds - 3_600,
            _ => seconds,
        })
    };
    let (weeks, keep) = (520, 50);
    let mut store = Store::open(folder.path(), keep).unwrap();
    for week in 0..weeks {
        let record = ResultRecord::new("cell", CONFIGURATIONS[0], &window(), estimate(1.0));
        let stored = store.write(&record, &Attachments::default(), time(week)).unwrap();
        assert_eq!((stored.number, stored.line.time), (week, time(week)));
        // Once a year the cabinet is switched off and on again.
        if week % 52 == 51 {
            drop(store);
            store = Store::open(folder.path(), keep).unwrap();
        }
    }
    let results = names(folder.path()).iter().filter(|name| index(name).is_some()).count();
    assert_eq!(results, keep);
    let (lines, _) = read_history(folder.path()).unwrap();
    assert!(lines.iter().map(|line| (line.result, line.time)).eq((0..weeks).map(|n| (n, time(n)))));
    assert_eq!(lines.iter().filter(|line| !line.time.is_set()).count(), 4);
    assert_eq!(lines[519].time.to_string(), "2036-12-12T00:00:00Z");
}

/// A verdict that approves every requested use.
fn good() -> Verdict {
    let mut verdict = Verdict { applicable: true, ..Verdict::default() };
    verdict.uses.monitoring.applicable = Some(true);
    verdict.uses.prediction.applicable = Some(true);
    verdict
}
