use didim_core::identification::{Estimate, ParameterEstimate, Verdict};

use super::*;
use crate::archive::drift::Baseline;
use crate::live::stream::StreamOptions;
use crate::live::worker::{Trigger, WindowOptions};
use crate::window::{Window, WindowEnd};

fn open(folder: &Path) -> Records {
    let place = Path::new("/tmp/didim-records");
    let windows = WindowOptions {
        trigger: Trigger::Command {},
        margin_before_s: 0.0,
        margin_after_s: 0.0,
        min_s: 0.0,
        max_s: 1.0,
    };
    let options = WorkerOptions {
        stream: StreamOptions::new("cell", (place, "x"), 6, 500.0, 1.0).unwrap(),
        windows: windows.plan(500.0).unwrap(),
        queue: 1,
        folder: None,
        keep: 3,
        configuration: "c0ffee".into(),
        records: RecordOptions::default(),
        recorded: None,
        keeper: None,
    };
    Records::open(folder, &options).unwrap()
}

fn take(records: &mut Records, fc3: f64) {
    take_with(records, fc3, DriftOptions::default());
}

fn take_with(records: &mut Records, fc3: f64, drift: DriftOptions) {
    let estimate = Estimate {
        method: "idim-ls".into(),
        robot: "tx40".into(),
        parameters: vec![ParameterEstimate {
            name: "fc3".into(),
            regrouped: false,
            value: fc3,
            standard_deviation: 0.003,
            classical_standard_deviation: 0.003,
            relative_standard_deviation: 0.0005,
        }],
        verdict: Verdict { applicable: true, ..Verdict::default() },
        ..Estimate::default()
    };
    let samples = vec![didim_core::JointSample::zero(0, 0)];
    let window = Window {
        number: 0,
        sample_rate_hz: 500.0,
        samples,
        counted: 0..1,
        end: WindowEnd::Rest,
        note: None,
    };
    let record = ResultRecord::new("cell", "c0ffee", &window, &estimate);
    let options = RecordOptions { drift, ..RecordOptions::default() };
    records.take(&record, &Beside::default(), &options).unwrap();
}

fn set_baseline(folder: &Path, result: usize) {
    let lines = crate::archive::store::read_history(folder).unwrap().0;
    Baseline::of(lines[result].clone()).write(folder).unwrap();
}

fn alarms(records: &Records) -> Vec<String> {
    records.drift().unwrap().alarms.into_iter().map(|alarm| alarm.parameter).collect()
}

#[test]
fn a_baseline_is_followed_as_soon_as_it_is_set_and_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let mut records = open(folder.path());
    take(&mut records, 6.48);
    assert!(records.drift().is_none());
    set_baseline(folder.path(), 0);
    assert!(records.look() && !records.look());
    let drift = records.drift().unwrap();
    assert_eq!((drift.baseline, drift.compared), (0, false));
    for (fc3, expected) in [(6.5, 0), (7.5, 0), (7.5, 1)] {
        take(&mut records, fc3);
        assert_eq!(alarms(&records).len(), expected, "{fc3}");
    }
    // The baseline's own result is gone meanwhile: three are kept.
    assert!(!folder.path().join("result-00000000.json").exists());
    drop(records);
    let mut records = open(folder.path());
    assert!(records.look());
    assert_eq!(alarms(&records), ["fc3"], "the history is at hand");
    take(&mut records, 6.5);
    take(&mut records, 6.5);
    assert_eq!(alarms(&records), Vec::<String>::new());
    // Set by another process just before a result, and in the midst of what is at hand.
    set_baseline(folder.path(), 2);
    take(&mut records, 7.5);
    assert_eq!(records.drift().unwrap().baseline, 2);
    assert_eq!(alarms(&records), ["fc3"], "results 4 and 5 are outside, and 6 alone is not inside");
    Baseline::remove(folder.path()).unwrap();
    assert!(records.look());
    assert!(records.drift().is_none());
}

#[test]
fn a_restarted_service_knows_the_alarms_that_the_history_shows() {
    let folder = tempfile::tempdir().unwrap();
    let mut records = open(folder.path());
    take(&mut records, 6.48);
    set_baseline(folder.path(), 0);
    take(&mut records, 7.5);
    take(&mut records, 7.5);
    drop(records);
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
    let shown = crate::archive::drift::Chronicle::new(lines, baseline, DriftOptions::default());
    let mut records = open(folder.path());
    assert!(records.look());
    assert_eq!(alarms(&records), ["fc3"]);
    assert_eq!(records.drift(), shown.tracker.map(|tracker| tracker.status()));
}

#[test]
fn a_broken_baseline_costs_no_result() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("baseline.json"), "{").unwrap();
    let mut records = open(folder.path());
    take(&mut records, 6.48);
    assert!(records.drift().is_none());
    assert_eq!(crate::archive::store::read_history(folder.path()).unwrap().0.len(), 1);
}

#[test]
fn a_history_that_cannot_be_written_costs_no_result() {
    let folder = tempfile::tempdir().unwrap();
    let mut records = open(folder.path());
    std::fs::create_dir(folder.path().join("history.jsonl")).unwrap();
    take(&mut records, 6.48);
    assert!(folder.path().join("result-00000000.json").exists());
    assert!(folder.path().join("latest.json").exists());
}

#[test]
fn another_band_judges_what_is_at_hand_anew() {
    let folder = tempfile::tempdir().unwrap();
    let mut records = open(folder.path());
    take(&mut records, 6.48);
    set_baseline(folder.path(), 0);
    for _ in 0..3 {
        take(&mut records, 7.5);
    }
    assert_eq!(alarms(&records), ["fc3"]);
    // 7.5 is 16 % more.
    let wider = DriftOptions { relative: 0.2, ..DriftOptions::default() };
    take_with(&mut records, 7.5, wider);
    assert_eq!(alarms(&records), Vec::<String>::new());
    take(&mut records, 7.5);
    assert_eq!(alarms(&records), ["fc3"]);
}

#[test]
fn a_baseline_that_cannot_be_read_is_a_reason_until_it_can_be_or_is_cleared() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("baseline.json");
    let mut records = open(folder.path());
    take(&mut records, 6.48);
    set_baseline(folder.path(), 0);
    assert!(records.look());
    let health = |records: &Records| {
        let mut status = EstimationStatus::default();
        records.tell(&mut status);
        // As who asks gets it.
        let json = serde_json::to_string(&status).unwrap();
        let told: EstimationStatus = serde_json::from_str(&json).unwrap();
        crate::service::status::Health::of(None, Some(&told)).reasons
    };
    assert_eq!(health(&records), Vec::<String>::new());
    let whole = std::fs::read(&path).unwrap();
    // Cut; then such that reading fails, as for who has no right to.
    for unreadable in ["cut", "refused"] {
        match unreadable {
            "cut" => std::fs::write(&path, &whole[..whole.len() / 2]).unwrap(),
            _ => std::fs::create_dir(&path).unwrap(),
        }
        assert!(records.look(), "{unreadable}");
        for _ in 0..3 {
            assert!(!records.look(), "nothing new is told");
            let [reason] = &health(&records)[..] else { panic!("{:?}", health(&records)) };
            for word in
                ["no parameter is watched", "baseline.json", "`didim baseline set`", "clear"]
            {
                assert!(reason.contains(word), "{reason}");
            }
        }
        take(&mut records, 6.48);
        assert_eq!(health(&records).len(), 1);
        match unreadable {
            "cut" => std::fs::remove_file(&path).unwrap(),
            _ => std::fs::remove_dir(&path).unwrap(),
        }
        assert!(records.look() && health(&records).is_empty(), "{unreadable}: cleared");
    }
    std::fs::write(&path, "{").unwrap();
    assert!(records.look() && health(&records).len() == 1);
    std::fs::write(&path, &whole).unwrap();
    assert!(records.look() && health(&records).is_empty() && records.drift().is_some());
}
