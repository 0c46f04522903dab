use didim_identification::identification::{
    Estimate, ModelUncertainty, ParameterCovariance, ParameterEstimate, Verdict,
};
use nalgebra::DMatrix;

use super::*;
use crate::archive::drift::Baseline;
use crate::live::worker::EstimationStatus;
use crate::window::{Window, WindowEnd};

fn open(folder: &Path) -> Results {
    Results::open(folder, 3, DriftOptions::default()).unwrap()
}

fn take(results: &mut Results, fc3: f64) {
    take_with(results, fc3, DriftOptions::default());
}

fn take_with(results: &mut Results, fc3: f64, drift: DriftOptions) {
    let options = ResultOptions { drift, ..ResultOptions::default() };
    let attachments = Attachments::default();
    let record = record(fc3, "c0ffee");
    results.store_result(&record, &attachments, &options, Timestamp::now()).unwrap();
}

/// A result of a configuration, with one parameter.
pub(super) fn record(fc3: f64, configuration: &str) -> ResultRecord {
    let estimate = Estimate {
        method: "idim-ls".into(),
        robot: "tx40".into(),
        parameters: vec![ParameterEstimate {
            joint_name: None,
            description: None,
            name: "fc3".into(),
            regrouped: false,
            value: fc3,
            standard_deviation: 0.003,
            unit: "N·m",
            combined_standard_deviation: 2.0,
            classical_standard_deviation: 0.003,
            relative_standard_deviation: 0.0005,
        }],
        verdict: good(),
        ..Estimate::default()
    };
    let samples = vec![didim_dynamics::JointSample::zero(0, 0)];
    let window = Window {
        number: 0,
        sample_rate_hz: 500.0,
        samples,
        counted_samples: 0..1,
        end: WindowEnd::Rest,
        recording_start: None,
        note: None,
    };
    ResultRecord::new("cell", configuration, &window, estimate)
}

#[test]
fn a_result_is_compared_with_what_was_known_at_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    set_baseline(folder.path(), 0);
    [7.5, 7.5, 7.5].into_iter().for_each(|fc3| take(&mut results, fc3));
    let lines = crate::archive::store::read_history(folder.path()).unwrap().0;
    let drift = |line| drift_of_result(folder.path(), line, DriftOptions::default()).unwrap();
    let alarms: Vec<Option<usize>> =
        lines.iter().map(|line| Some(drift(line)?.alarms.len())).collect();
    assert_eq!(alarms, [None, Some(0), Some(1), Some(1)]);
}

fn set_baseline(folder: &Path, result: usize) {
    let lines = crate::archive::store::read_history(folder).unwrap().0;
    Baseline::from_result(lines[result].clone()).write(folder).unwrap();
}

fn alarms(results: &Results) -> Vec<String> {
    results.drift().unwrap().alarms.into_iter().map(|alarm| alarm.parameter).collect()
}

#[test]
fn a_baseline_is_followed_as_soon_as_it_is_set_and_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    assert!(results.drift().is_none());
    set_baseline(folder.path(), 0);
    assert!(results.poll_baseline() && !results.poll_baseline());
    let drift = results.drift().unwrap();
    assert_eq!((drift.baseline, drift.compared), (0, false));
    for (fc3, expected) in [(6.5, 0), (7.5, 0), (7.5, 1)] {
        take(&mut results, fc3);
        assert_eq!(alarms(&results).len(), expected, "{fc3}");
    }
    // The baseline's own result has been removed: three are kept.
    assert!(!folder.path().join("result-00000000.json").exists());
    drop(results);
    let mut results = open(folder.path());
    assert!(results.poll_baseline());
    assert_eq!(alarms(&results), ["fc3"], "the history is at hand");
    take(&mut results, 6.5);
    take(&mut results, 6.5);
    assert_eq!(alarms(&results), Vec::<String>::new());
    // Another process sets it just before a result, to a line in the middle of the history.
    set_baseline(folder.path(), 2);
    take(&mut results, 7.5);
    assert_eq!(results.drift().unwrap().baseline, 2);
    assert_eq!(alarms(&results), ["fc3"], "results 4 and 5 are outside, and 6 alone is not inside");
    Baseline::remove(folder.path()).unwrap();
    assert!(results.poll_baseline());
    assert!(results.drift().is_none());
}

#[test]
fn a_restarted_service_knows_the_alarms_that_the_history_shows() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    set_baseline(folder.path(), 0);
    take(&mut results, 7.5);
    take(&mut results, 7.5);
    drop(results);
    let mut lines = crate::archive::store::read_history(folder.path()).unwrap().0;
    // Back in the band since then, but never well inside: 0.6 of 0.648.
    for result in 3..1500 {
        let mut line = HistoryLine { result, ..lines[2].clone() };
        line.parameters[0].value = 7.08;
        lines.push(line);
    }
    let text: Vec<String> = lines.iter().map(|line| serde_json::to_string(line).unwrap()).collect();
    std::fs::write(folder.path().join("history.jsonl"), text.join("\n") + "\n").unwrap();
    let baseline = Baseline::read(folder.path()).unwrap();
    let shown = crate::archive::drift::JudgedHistory::new(lines, baseline, DriftOptions::default());
    let mut results = open(folder.path());
    assert!(results.poll_baseline());
    assert_eq!(alarms(&results), ["fc3"]);
    assert_eq!(results.drift(), shown.tracker.map(|tracker| tracker.status()));
}

/// The day on which the parameter left its band has a mean within the band: the date is known from
/// the single results, which are gone.
#[test]
fn the_date_of_a_drift_outlives_its_results_and_a_restart() {
    const DAY_S: u64 = 86_400;
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    drop(results);
    let first = crate::archive::store::read_history(folder.path()).unwrap().0.remove(0);
    let start = (first.time.unix_s() / DAY_S - 20) * DAY_S;
    let line = |result: u64, day: u64, of_day: u64| {
        let is_outside = day > 1 || (day == 1 && of_day >= 500);
        let time = Timestamp::from_unix_s(start + day * DAY_S + 100 * of_day);
        let mut line = HistoryLine { result, time, ..first.clone() };
        line.parameters[0].value = if is_outside { 7.5 } else { 6.48 };
        line
    };
    let lines: Vec<HistoryLine> = (0..6)
        .flat_map(|day| {
            (0..700).map(move |k| (700 * day + k, if day < 3 { day } else { 15 + day }, k))
        })
        .map(|(result, day, of_day)| line(result, day, of_day))
        .collect();
    let text = |lines: &[HistoryLine]| -> String {
        lines.iter().map(|line| serde_json::to_string(line).unwrap() + "\n").collect()
    };
    for segment in 0..3 {
        let lines = text(&lines[700 * segment..700 * (segment + 1)]);
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        let compressed = ruzstd::encoding::compress_to_vec(lines.as_bytes(), level);
        let name = format!("history-{segment:08}.jsonl.zst");
        std::fs::write(folder.path().join(name), compressed).unwrap();
    }
    std::fs::write(folder.path().join("history.jsonl"), text(&lines[2_100..])).unwrap();
    Baseline::from_result(lines[0].clone()).write(folder.path()).unwrap();
    let mut results = open(folder.path());
    assert!(results.poll_baseline());
    let since = |results: &Results| results.drift().unwrap().alarms[0].since;
    assert_eq!(since(&results), lines[1_200].time);
    // Each result makes a segment a row.
    for _ in 0..3 {
        take(&mut results, 7.5);
    }
    let before = results.drift().unwrap();
    let (history, _) = crate::archive::store::read_history(folder.path()).unwrap();
    let days = history.iter().filter(|line| line.day.is_some());
    assert_eq!(
        days.map(|line| line.parameters[0].value < 7.1).collect::<Vec<_>>(),
        [true, true, false]
    );
    drop(results);
    let mut results = open(folder.path());
    assert!(results.poll_baseline());
    assert_eq!(since(&results), lines[1_200].time);
    let again = results.drift().unwrap();
    let slope = |of: &DriftStatus| of.alarms[0].slope_per_day.unwrap();
    // The time of a row is in whole seconds, and the row of its day has the baseline once more.
    assert!((slope(&again) / slope(&before) - 1.0).abs() < 1e-3);
    let without_slopes = |of: &DriftStatus| (of.parameters.clone(), of.alarms[0].text.clone());
    assert_eq!(without_slopes(&again), without_slopes(&before));
}

#[test]
fn a_broken_baseline_costs_no_result() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("baseline.json"), "{").unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    assert!(results.drift().is_none());
    assert_eq!(crate::archive::store::read_history(folder.path()).unwrap().0.len(), 1);
}

#[test]
fn a_history_that_cannot_be_written_costs_no_result() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    std::fs::create_dir(folder.path().join("history.jsonl")).unwrap();
    take(&mut results, 6.48);
    assert!(folder.path().join("result-00000000.json").exists());
    assert!(folder.path().join("latest.json").exists());
    let health = |results: &Results| {
        let mut status = EstimationStatus::default();
        status.set_results(results);
        crate::service::status::Health::new(None, Some(&status)).reasons
    };
    assert_eq!(results.find_equal(&record(6.48, "c0ffee")), Some(0), "its line waits");
    assert_eq!(results.find_equal(&record(6.5, "c0ffee")), None);
    results.settle();
    let [reason] = &health(&results)[..] else { panic!("{:?}", health(&results)) };
    assert!(reason.starts_with("1 lines of the history wait") && reason.contains("history.jsonl"));
    std::fs::remove_dir(folder.path().join("history.jsonl")).unwrap();
    results.settle();
    assert_eq!(health(&results), Vec::<String>::new());
    assert_eq!(crate::archive::store::read_history(folder.path()).unwrap().0.len(), 1);
}

#[test]
fn subscribers_get_a_result_without_the_data_for_models() {
    let mut record = record(6.48, "c0ffee");
    record.estimate.covariance =
        Some(ParameterCovariance::from_symmetric(&DMatrix::identity(1, 1)));
    record.estimate.model_uncertainty = Some(ModelUncertainty::default());
    let sent = record.for_subscribers();
    assert_eq!((&sent.estimate.covariance, &sent.estimate.model_uncertainty), (&None, &None));
    record.estimate.covariance = None;
    record.estimate.model_uncertainty = None;
    assert_eq!(sent, record);
}

#[test]
fn another_band_judges_what_is_at_hand_anew() {
    let folder = tempfile::tempdir().unwrap();
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    set_baseline(folder.path(), 0);
    for _ in 0..3 {
        take(&mut results, 7.5);
    }
    assert_eq!(alarms(&results), ["fc3"]);
    // 7.5 is 16 % more.
    let wider = DriftOptions { relative: 0.2, ..DriftOptions::default() };
    take_with(&mut results, 7.5, wider);
    assert_eq!(alarms(&results), Vec::<String>::new());
    take(&mut results, 7.5);
    assert_eq!(alarms(&results), ["fc3"]);
}

#[test]
fn a_baseline_that_cannot_be_read_is_a_reason_until_it_can_be_or_is_cleared() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("baseline.json");
    let mut results = open(folder.path());
    take(&mut results, 6.48);
    set_baseline(folder.path(), 0);
    assert!(results.poll_baseline());
    let health = |results: &Results| {
        let mut status = EstimationStatus::default();
        status.set_results(results);
        // In the form that a client receives.
        let json = serde_json::to_string(&status).unwrap();
        let status_read: EstimationStatus = serde_json::from_str(&json).unwrap();
        crate::service::status::Health::new(None, Some(&status_read)).reasons
    };
    assert_eq!(health(&results), Vec::<String>::new());
    let contents = std::fs::read(&path).unwrap();
    // First truncated, then unreadable as if permission were missing.
    for unreadable in ["cut", "refused"] {
        match unreadable {
            "cut" => std::fs::write(&path, &contents[..contents.len() / 2]).unwrap(),
            _ => std::fs::create_dir(&path).unwrap(),
        }
        assert!(results.poll_baseline(), "{unreadable}");
        for _ in 0..3 {
            assert!(!results.poll_baseline(), "nothing new is reported");
            let [reason] = &health(&results)[..] else { panic!("{:?}", health(&results)) };
            for word in ["no result is compared", "baseline.json", "`didim baseline set`", "clear"]
            {
                assert!(reason.contains(word), "{reason}");
            }
        }
        take(&mut results, 6.48);
        assert_eq!(health(&results).len(), 1);
        match unreadable {
            "cut" => std::fs::remove_file(&path).unwrap(),
            _ => std::fs::remove_dir(&path).unwrap(),
        }
        assert!(results.poll_baseline() && health(&results).is_empty(), "{unreadable}: cleared");
    }
    std::fs::write(&path, "{").unwrap();
    assert!(results.poll_baseline() && health(&results).len() == 1);
    std::fs::write(&path, &contents).unwrap();
    assert!(results.poll_baseline() && health(&results).is_empty() && results.drift().is_some());
}

/// A verdict that approves every requested use.
fn good() -> Verdict {
    let mut verdict = Verdict { applicable: true, ..Verdict::default() };
    verdict.uses.monitoring.applicable = Some(true);
    verdict.uses.prediction.applicable = Some(true);
    verdict
}
