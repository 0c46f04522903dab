use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::days::DaysFile;
use super::*;
use crate::archive::store::{ModelDifference, Timestamp};
use crate::expectation::Expectation;
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
        day: None,
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
    let expected = Expectation::of("history-half-written");
    // One case is complete except for its newline: it may be the beginning of something else.
    for cut in (1..=torn.len()).step_by(7).chain([torn.len()]) {
        let folder = tempfile::tempdir().unwrap();
        append(folder.path(), 100, 0..2);
        tear(folder.path(), &torn[..cut]);
        let after_cut = (vec![0, 1], expected.get("torn_lines"));
        assert_eq!(numbers(folder.path()), after_cut, "cut at {cut}");
        append(folder.path(), 100, 3..4);
        let after_next = (vec![0, 1, 3], expected.get("torn_lines_after_the_next_result"));
        assert_eq!(numbers(folder.path()), after_next, "cut at {cut}");
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

const DAY_S: u64 = 86_400;

/// A line of a day, with a value that the number gives.
fn line_of_day(day: u64, second: u64, result: u64) -> HistoryLine {
    let mut line = line(result);
    line.time = Timestamp::from_unix_s(1_798_761_600 + day * DAY_S + second);
    line.parameters[0].value = 6.0 + 1e-3 * (result % 10) as f64;
    line
}

/// Appends 1,200 lines of each of these days, as a service does. Returns the next number.
fn append_days(folder: &Path, days: core::ops::Range<u64>, first: u64) -> u64 {
    let (mut history, _) = HistoryFile::open(folder, 20, 5).unwrap();
    let mut result = first;
    for day in days {
        for second in 0..1_200 {
            let line = line_of_day(day, second, result);
            history.append(&line).unwrap();
            if let Some((segment, lines)) = history.outdated_segment(line.time).unwrap() {
                history.replace_oldest_segment(&day_rows(&lines, segment)).unwrap();
            }
            result += 1;
        }
    }
    result
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn results_of_two_weeks_have_lines_and_older_ones_rows_of_days() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    append_days(folder.path(), 0..20, 0);
    let (lines, passed_over) = read_history(folder.path()).unwrap();
    let (days, results) = lines.split_at(5);
    assert_eq!((results.len(), passed_over), (15 * 1_200, 0));
    assert!(results.iter().map(|line| line.result).eq(5 * 1_200..20 * 1_200));
    for (row, number) in days.iter().zip(0..) {
        let day = row.day.as_ref().unwrap();
        assert_eq!((day.results, row.time.day()), (1_200, day.first.day()));
        assert_eq!(row.result, 1_200 * (number + 1) - 1);
        // The digits 0 to 9: a mean of 4.5, and a standard deviation of √(8.25 · n/(n − 1)).
        let [fc3] = &row.parameters[..] else { panic!("{row:?}") };
        assert!((fc3.value - 6.0045).abs() < 1e-9, "{fc3:?}");
        // That of one result, not of the mean.
        assert!((fc3.standard_deviation - 0.003).abs() < 1e-9, "{fc3:?}");
        let scatter = 1e-3 * (8.25_f64 * 1_200.0 / 1_199.0).sqrt();
        assert!((day.scatter[0].unwrap() - scatter).abs() < 1e-7, "{day:?}");
    }
    // Rows are appended, and never written again.
    let text = fs::read_to_string(folder.path().join("history-days.jsonl")).unwrap();
    append_days(folder.path(), 20..22, 20 * 1_200);
    let later = fs::read_to_string(folder.path().join("history-days.jsonl")).unwrap();
    assert!(later.starts_with(&text) && later.lines().count() == 7);
}

fn in_single_precision(parameter: &ParameterValue) -> f32 {
    parameter.value.to_string().parse().unwrap()
}

/// 28 parameters with random digits, compared with a baseline, at 3,000 results a day: two weeks of
/// lines and ten years of days take less than 60 MB.
#[test]
fn ten_years_of_a_busy_arm_are_small() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(40);
    let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX);
    let mut lines: Vec<HistoryLine> = Vec::new();
    for result in 0..3_000 {
        let mut line = line_of_day(0, 28 * result, result);
        line.configuration = "c0ffee".repeat(10);
        line.regrouping.clone_from(&line.configuration);
        line.relative_error = Some(uniform());
        let parameter = |k: usize| {
            let value = uniform();
            ParameterValue {
                name: format!("xx{k}r"),
                description: None,
                unit: "kg·m²".into(),
                value: 1.0 + 1e-3 * value,
                standard_deviation: 1e-3 * (1.0 + value.sin()),
                combined_standard_deviation: Some(1e-2 * (1.0 + value.cos())),
            }
            .rounded()
        };
        line.parameters = (0..28).map(parameter).collect();
        line.against = Some(ModelDifference {
            result: 0,
            time: line.time,
            standard_deviations: line.parameters.iter().map(in_single_precision).collect(),
        });
        lines.push(line);
    }
    let text = |lines: &[HistoryLine]| -> String {
        lines.iter().map(|line| serde_json::to_string(line).unwrap() + "\n").collect()
    };
    let day = text(&lines);
    segments::write_segment(folder.path(), 0, day.as_bytes()).unwrap();
    let path = segments::segment_path(folder.path(), 0);
    let compressed = fs::metadata(path).unwrap().len();
    let row = text(&day_rows(&lines, 0)).len() as u64;
    let total = day.len() as u64 + 14 * compressed + 3_650 * row;
    println!("day {}, compressed {compressed}, row {row}, in all {total} bytes", day.len());
    assert!(total < 60_000_000, "{} {compressed} {row}: {total}", day.len());
}

fn days_in(folder: &Path) -> Vec<u64> {
    let mut days = Vec::new();
    for_each_day(folder, |line| days.push(line.result)).unwrap();
    days
}

/// Rows eleven years after the first, and a day later: with an opened file, and with one that is
/// opened again.
#[test]
fn rows_of_more_than_ten_years_are_removed_from_time_to_time() {
    let row = |day: u64| day_rows(&[line_of_day(day, 0, day)], day);
    for is_opened_again in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let mut days = DaysFile::open(folder.path(), None).unwrap();
        for day in [0, 400, 11 * 366] {
            days.append(&row(day)).unwrap();
        }
        assert_eq!(days_in(folder.path()), [0, 400, 11 * 366]);
        if is_opened_again {
            days = DaysFile::open(folder.path(), None).unwrap();
        }
        days.append(&row(11 * 366 + 1)).unwrap();
        assert_eq!(days_in(folder.path()), [400, 11 * 366, 11 * 366 + 1]);
        // The next removal is due when the oldest row is too old again.
        days.append(&row(11 * 366 + 300)).unwrap();
        assert_eq!(days_in(folder.path()).len(), 4);
    }
}

#[test]
fn few_results_keep_their_lines_for_years() {
    let folder = tempfile::tempdir().unwrap();
    let (mut history, _) = HistoryFile::open(folder.path(), 20, 5).unwrap();
    for week in 0..200 {
        let line = line_of_day(7 * week, 0, week);
        history.append(&line).unwrap();
        assert!(history.outdated_segment(line.time).unwrap().is_none());
    }
    assert_eq!(numbers(folder.path()), ((0..200).collect(), 0));
}

#[test]
fn a_segment_that_a_killed_process_has_closed_halfway_is_completed() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let path = folder.path().join("history.jsonl");
    append_days(folder.path(), 0..1, 0);
    let lines = fs::read(&path).unwrap();
    append_days(folder.path(), 1..2, 1_200);
    let all: Vec<u64> = (0..2_400).collect();
    assert_eq!(numbers(folder.path()), (all.clone(), 0));
    // The segment was written, and the file not emptied.
    let newest = fs::read(&path).unwrap();
    fs::write(&path, [&lines[..], &newest[..]].concat()).unwrap();
    drop(HistoryFile::open(folder.path(), 20, 5).unwrap());
    assert_eq!(numbers(folder.path()), (all, 0));
    assert_eq!(fs::read(&path).unwrap(), newest);
}

#[test]
fn days_that_a_killed_process_has_written_halfway_are_written_again() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let days = folder.path().join("history-days.jsonl");
    append_days(folder.path(), 0..18, 0);
    let before = fs::read_to_string(&days).unwrap();
    let expected = numbers(folder.path());
    // The rows of the next segment were written, and half of one more.
    let rows = {
        let mut lines = Vec::new();
        let segment = segments::open_segment(folder.path(), 3).unwrap();
        scan::scan(segment, |_, line| lines.extend(line)).unwrap();
        day_rows(&lines, 3)
            .iter()
            .map(|row| serde_json::to_string(row).unwrap())
            .collect::<String>()
    };
    fs::write(&days, format!("{before}{rows}\n{}", &rows[..40])).unwrap();
    drop(HistoryFile::open(folder.path(), 20, 5).unwrap());
    assert_eq!(fs::read_to_string(&days).unwrap(), before);
    assert_eq!(numbers(folder.path()), expected);
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
    let results = Expectation::of("state-folder-moved").get("results");
    assert_eq!(numbers(folder.path()), (results, 0));
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
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(&format!("{}\n{}\n", later[0], later[1])), "{text}");
    assert!(text.contains(&format!("{more}\n")), "{text}");
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
    append(folder.path(), 10, 4..12);
    assert_eq!(followed(&mut follower), (4..12).collect::<Vec<_>>());
}

#[test]
fn a_follower_goes_on_through_segments() {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let mut follower = HistoryFollower::new(folder.path(), None);
    let mut slow = HistoryFollower::new(folder.path(), None);
    let next = append_days(folder.path(), 0..1, 0);
    assert_eq!(followed(&mut follower), (0..next).collect::<Vec<_>>());
    assert_eq!(slow.next_line().unwrap().unwrap().result, 0);
    // The file has become a segment, and another one has followed.
    let last = append_days(folder.path(), 1..3, next);
    assert_eq!(names(folder.path()).len(), 3);
    assert_eq!(followed(&mut follower), (next..last).collect::<Vec<_>>());
    assert_eq!(followed(&mut slow), (1..last).collect::<Vec<_>>());
    // A mark within a segment, and one whose line has become part of a day.
    let mark = HistoryMark::from_line(&line_of_day(0, 7, 7));
    let mut again = HistoryFollower::new(folder.path(), Some(mark.clone()));
    assert_eq!(followed(&mut again), (8..last).collect::<Vec<_>>());
    append_days(folder.path(), 3..18, last);
    let mut late = HistoryFollower::new(folder.path(), Some(mark));
    let first_kept = read_history(folder.path()).unwrap().0;
    let first_kept = first_kept.iter().find(|line| line.day.is_none()).unwrap().result;
    assert_eq!(late.next_line().unwrap().unwrap().result, first_kept);
}

#[test]
fn another_follower_goes_on_from_a_mark() {
    let folder = tempfile::tempdir().unwrap();
    append(folder.path(), 10, 0..5);
    let after = |result| Some(HistoryMark::from_line(&line(result)));
    let follow = |mark| followed(&mut HistoryFollower::new(folder.path(), mark));
    assert_eq!(follow(after(2)), [3, 4]);
    assert_eq!(follow(after(4)), Vec::<u64>::new());
    // The folder was emptied and counts from 0: its lines came later.
    fs::remove_file(folder.path().join("history.jsonl")).unwrap();
    append(folder.path(), 10, 0..2);
    let old = HistoryMark { time: Timestamp::from_unix_s(1), ..HistoryMark::from_line(&line(29)) };
    assert_eq!(follow(Some(old)), [0, 1]);
}
