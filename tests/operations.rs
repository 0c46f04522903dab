//! Everything that a running service may report is in its manual, docs/reference: the lines of the
//! status, the reasons of its health, the causes of losses, the findings of a verdict, the metrics.
//!
//! The program itself is asked: a status with every field set is rendered, judged and exposed, and
//! the output is looked up. Where a type lists its values, the compiler asks here for new ones.

use std::collections::BTreeSet;
use std::io::Write;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::time::{Duration, Instant};

use didim::analysis::identify::identify_measurement;
use didim::archive::drift::{
    Baseline, Change, DriftOptions, NotComparable, Tracker, change_sentence,
};
use didim::archive::store::Timestamp;
use didim::cell::Cell;
use didim::live::acquire::{
    AcquisitionStatus, BusState, FaultCounters, InterfaceProblem, RecentCounts, SampleFlow,
    SharedAcquisition,
};
use didim::live::external_torque::{ExternalTorqueStatus, JointTorque};
use didim::live::recording::{ArchiveStatus, RecordingState, RecordingStatus};
use didim::live::stream::StreamOptions;
use didim::live::worker::{Loss, Rejection, SharedEstimation};
use didim::service::metrics::metrics_text;
use didim::service::paths::Paths;
use didim::service::status::{
    Collector, Colour, Health, IDLE_TEXT, ProcessStatus, SCHEMA, Snapshot, StreamStatus,
    fetch_snapshot, render,
};
use didim::window::DriveReadings;
use didim_drivers::assemble::{Losses, label};
use didim_dynamics::{Reading, Readings};
use didim_formats::read_csv;
use didim_identification::identification::Use;
use serde_json::{Value, json};

const MANUAL: &str = concat!(
    include_str!("../docs/reference/status.md"),
    include_str!("../docs/reference/findings.md"),
    include_str!("../docs/reference/metrics.md"),
);

/// What the manual has as code within a line, outside of blocks.
fn quoted(text: &'static str) -> Vec<&'static str> {
    let blocks = text.split("```").step_by(2);
    let lines = blocks.flat_map(str::lines);
    lines.flat_map(|line| line.split('`').skip(1).step_by(2)).collect()
}

/// The fixed parts of a text of the manual, in which `…` and a lone N, M or P stand for anything.
fn fixed_parts(pattern: &str) -> Vec<String> {
    let is_name = |each: Option<char>| each.is_some_and(char::is_alphanumeric);
    let mut parts = vec![String::new()];
    let mut before = None;
    let mut rest = pattern.chars().peekable();
    while let Some(each) = rest.next() {
        let lone =
            matches!(each, 'N' | 'M' | 'P') && !is_name(before) && !is_name(rest.peek().copied());
        if each == '…' || lone {
            parts.push(String::new());
        } else {
            parts.last_mut().unwrap().push(each);
        }
        before = Some(each);
    }
    parts
}

/// Whether a text of the manual is the one that the program said.
fn is_of(pattern: &str, said: &str) -> bool {
    let parts = fixed_parts(pattern);
    if parts.iter().map(String::len).sum::<usize>() < 6 {
        return pattern == said;
    }
    let (first, last) = (parts.first().unwrap(), parts.last().unwrap());
    let Some(mut rest) = said.strip_prefix(first.as_str()) else { return false };
    for part in &parts[1..] {
        let Some((_, after)) = rest.split_once(part.as_str()) else { return false };
        rest = after;
    }
    rest.is_empty() || (parts.len() > 1 && last.is_empty())
}

/// Each is in the manual, with values in it where the manual has `…`.
#[track_caller]
fn are_in_the_manual(said: &BTreeSet<String>, at_least: usize) {
    assert!(said.len() >= at_least, "too few: {said:#?}");
    let messages = quoted(MANUAL);
    let missing: Vec<_> =
        said.iter().filter(|said| !messages.iter().any(|pattern| is_of(pattern, said))).collect();
    assert!(missing.is_empty(), "docs/reference has nothing on {missing:#?}");
}

/// What stands as code in the first column of a section's tables is said by the program: nothing is
/// left of what it once said.
#[track_caller]
fn is_still_said(heading: &str, said: &BTreeSet<String>) {
    let section = MANUAL.split(heading).nth(1).unwrap().split("\n#").next().unwrap();
    let firsts = section.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    let patterns: Vec<&str> = firsts.flat_map(quoted).collect();
    assert!(!patterns.is_empty(), "{heading}");
    let outdated: Vec<_> =
        patterns.iter().filter(|pattern| !said.iter().any(|said| is_of(pattern, said))).collect();
    assert!(outdated.is_empty(), "the program does not say {outdated:#?}");
}

#[test]
fn a_pattern_stands_for_what_differs_and_nothing_else() {
    assert!(is_of("the last window, N, was rejected: …", "the last window, 7, was rejected: busy"));
    assert!(!is_of("the last window, N, was rejected: …", "the last window, 7, was lost: busy"));
    assert!(!is_of("the bus is silent", "the bus is silent and down"));
    assert!(is_of("P has grown by …", "fc3 has grown by 2 %"));
    assert!(!is_of("P has grown by …", "fc3 has shrunk by 2 %"));
    assert!(!is_of("…", "anything"));
}

/// What may be missing in a status, as it is when it is there.
fn optional(key: &str) -> Value {
    let times = json!({ "count": 1, "p50_ns": 1, "p99_ns": 1, "p999_ns": 1, "max_ns": 1 });
    let refused = json!({ "grant": "refused", "why": "in words" });
    match key {
        "frame_to_buffer" => {
            let mut times = times;
            times["from"] = "stamp".into();
            times
        }
        "buffer_to_worker" | "batch_to_worker" => times,
        "real_time" => json!({ "priority": refused, "cpu": refused, "memory": refused }),
        "receive_buffer_bytes" | "budget_bytes" => 1.into(),
        "receive_buffer_asked_bytes" => 2.into(),
        "recording" => {
            let state = RecordingState::Failed;
            let status = RecordingStatus { state, gives_way: true, ..Default::default() };
            serde_json::to_value(status).unwrap()
        }
        "kept_recordings" => serde_json::to_value(ArchiveStatus::default()).unwrap(),
        "oldest_s" | "without_samples_s" => 1.into(),
        "first_rejection" | "last_rejection" => json!({
            "number": 2, "first_sequence": 1, "last_sequence": 2, "rejection": { "reason": "busy" }
        }),
        "last_estimate" => json!({
            "window": 1, "first_sequence": 1, "last_sequence": 2, "method": "idim-ls",
            "parameters": [{ "name": "fc3", "value": 1.0, "standard_deviation": 0.1 }],
            "relative_error": 1.0, "condition_number": 1.0,
            "applicable": false, "reasons": ["in words"], "monitoring_reasons": ["in words"]
        }),
        "note" => json!({ "text": "in words" }),
        "load" => json!({
            "state": "load", "since": "2026-11-22T00:00:00Z",
            "mass_kg": { "value": 2.0, "standard_deviation": 0.1 },
            "changes": 1, "why_not": "in words", "last_look": last_look()
        }),
        "drift" => json!({
            "baseline": 1, "time": "2026-11-22T00:00:00Z", "compared": true, "reconfigured": true,
            "why_not": "in words",
            "parameters": [{
                "parameter": "fc3", "relative_change": 1.0, "deviation_sigma": 1.0,
                "band_share": 1.0
            }],
            "alarms": []
        }),
        "baseline_unreadable"
        | "results_wait_for"
        | "history_waits_for"
        | "reload_refused"
        | "stream_folder_gone"
        | "why"
        | "last_failure"
        | "capture" => "in words".into(),
        other => panic!("a status may have `{other}` now: say here what it is like"),
    }
}

/// A load with its centre in the frame of a link.
fn last_look() -> serde_json::Value {
    let value = json!({ "value": 0.1, "standard_deviation": 0.01 });
    let values = |count: usize| vec![value.clone(); count];
    let test = json!({ "chi_squared": 9.0, "degrees_of_freedom": 4, "probability": 0.1 });
    json!({
        "baseline": 1,
        "presence": {
            "seen": true, "mass_deviations": 20.0, "mass_limit_kg": 1.0, "from_none": test
        },
        "mass_kg": value, "centre_m": values(3), "inertia_kg_m2": values(6),
        "centre_of_mass": {
            "frame": "tool0", "centre_m": values(3), "inertia_kg_m2": values(6)
        }
    })
}

/// Every count 1, every list of causes one long, everything there.
fn fill(value: &mut Value, key: &str) {
    match value {
        Value::Null => {
            *value = optional(key);
            fill(value, key);
        }
        Value::Number(number) if number.as_f64() == Some(0.0) => *value = 1.into(),
        Value::Object(kinds) if kinds.is_empty() && ["day_bytes", "given_way"].contains(&key) => {
            *value = json!({ "ring": 1 });
        }
        Value::Object(causes) if causes.is_empty() => *value = json!({ "missing_axis": 1 }),
        Value::Object(fields) => fields.iter_mut().for_each(|(key, value)| fill(value, key)),
        _ => {}
    }
}

/// A status in which nothing is left out.
fn everything() -> Snapshot {
    let snapshot = Snapshot {
        schema: SCHEMA,
        version: "0".into(),
        cell: "cell".into(),
        uptime_s: 1.0,
        health: Health::default(),
        process: ProcessStatus::default(),
        stream: StreamStatus::default(),
        acquisition: Some(Default::default()),
        estimation: Some(Default::default()),
    };
    let mut value = serde_json::to_value(snapshot).unwrap();
    // Left out by JSON while they are not there.
    for key in [
        "baseline_unreadable",
        "results_wait_for",
        "history_waits_for",
        "without_samples_s",
        "load",
    ] {
        value["estimation"][key] = Value::Null;
    }
    fill(&mut value, "");
    let mut snapshot: Snapshot = serde_json::from_value(value).unwrap();
    let mut all_readings = Readings::default();
    Reading::ALL.into_iter().for_each(|reading| all_readings.set(reading, 0, 8.0));
    let readings = DriveReadings::from_cycles([&all_readings]);
    let estimation = snapshot.estimation.as_mut().unwrap();
    estimation.last_estimate.as_mut().unwrap().readings = readings.clone();
    let acquisition = snapshot.acquisition.as_mut().unwrap();
    acquisition.readings = readings;
    acquisition.external_torque = Some(ExternalTorqueStatus {
        result: Some("7".to_owned()),
        problem: Some("in words".to_owned()),
        published: 5,
        valid: 4,
        skipped: 3,
        unpublished: 2,
        clients: 1,
        messages_lost: 6,
        read_to_published: acquisition.frame_to_buffer.map(|of| of.times),
        joints: vec![Some(JointTorque { value: 1.0, standard_deviation: 0.5 }), None],
    });
    snapshot.health = Health::new(snapshot.acquisition.as_ref(), snapshot.estimation.as_ref());
    snapshot
}

/// What the last five seconds may have brought: each flow, and each way to word its causes.
fn recent() -> Vec<RecentCounts> {
    let counts_of = |samples, cycles_idle, cycle: Option<&str>, frame: Option<&str>| RecentCounts {
        seconds: 5.0,
        frames: 2_600,
        samples,
        cycles_idle,
        frames_unused: frame.map(|cause| (cause.to_owned(), 100)).into_iter().collect(),
        cycles_lost: cycle.map(|cause| (cause.to_owned(), 100)).into_iter().collect(),
        ..RecentCounts::default()
    };
    let all_flows = vec![
        counts_of(2_500, 0, None, None),
        counts_of(0, 100, Some("not_enabled"), None),
        counts_of(0, 0, Some("missing_axis"), Some("unknown_id")),
        counts_of(0, 0, None, None),
        counts_of(2_400, 0, Some("missing_sync"), None),
    ];
    let mut flows: Vec<&str> = Vec::new();
    for recent in &all_flows {
        // What is new belongs into the list above.
        flows.push(match recent.flow() {
            SampleFlow::Well => "well",
            SampleFlow::Idle => "idle",
            SampleFlow::Stopped { .. } => "stopped",
            SampleFlow::Lossy { .. } => "lossy",
        });
    }
    assert_eq!(flows, ["well", "idle", "stopped", "stopped", "lossy"]);
    all_flows
}

fn rejections() -> Vec<Rejection> {
    let why = || "in words".to_owned();
    let rejections = vec![
        Rejection::Loss(Loss::SampleGap { after: 1, missing: 2 }),
        Rejection::Loss(Loss::OutOfOrder { after: 1, sequence: 1 }),
        Rejection::Loss(Loss::QueueDrops { frames: 1 }),
        Rejection::Loss(Loss::StreamOverflow { batches: 1 }),
        Rejection::Loss(Loss::Restarted),
        Rejection::Loss(Loss::ProcessStopped { stopped_ms: 3_200 }),
        Rejection::Loss(Loss::MachineSuspended { suspended_ms: 3_200 }),
        Rejection::TooShort { counted: 1, minimum: 2 },
        Rejection::Remainder { counted: 1, minimum: 2 },
        Rejection::Busy,
        Rejection::Stopped,
        Rejection::Refused { why: why() },
        Rejection::NotStored { why: why() },
    ];
    // What is new belongs into the list above.
    for rejection in &rejections {
        match rejection {
            Rejection::Loss(
                Loss::SampleGap { .. }
                | Loss::OutOfOrder { .. }
                | Loss::QueueDrops { .. }
                | Loss::StreamOverflow { .. }
                | Loss::Restarted
                | Loss::ProcessStopped { .. }
                | Loss::MachineSuspended { .. },
            )
            | Rejection::TooShort { .. }
            | Rejection::Remainder { .. }
            | Rejection::Busy
            | Rejection::Stopped
            | Rejection::Refused { .. }
            | Rejection::NotStored { .. } => {}
        }
    }
    rejections
}

#[test]
fn lines_of_the_status() {
    let mut names = BTreeSet::new();
    let mut snapshot = everything();
    // Once more with what excludes the other: a good estimate, parameters in their bands.
    for good in [false, true] {
        let estimation = snapshot.estimation.as_mut().unwrap();
        estimation.last_estimate.as_mut().unwrap().applicable = good;
        if good {
            estimation.drift.as_mut().unwrap().why_not = None;
        }
        for line in render(&snapshot, Colour::Never).lines() {
            names.insert(line.split("  ").next().unwrap().to_owned());
        }
    }
    // The name of a line is written once for its values.
    names.remove("");
    are_in_the_manual(&names, 40);
    is_still_said("\n## Lines of the status\n", &names);
}

#[test]
fn states_of_the_bus() {
    let mut snapshot = everything();
    let said = BusState::ALL.into_iter().map(|state| {
        snapshot.acquisition.as_mut().unwrap().bus = state;
        let status = render(&snapshot, Colour::Never);
        let line = status.lines().find(|line| line.starts_with("bus ")).unwrap().to_owned();
        line.trim_start_matches("bus").trim().to_owned()
    });
    are_in_the_manual(&said.collect(), 5);
}

#[test]
fn health_without_a_reason() {
    let mut said = BTreeSet::new();
    for recent in recent() {
        let mut acquisition = SharedAcquisition::default().counts();
        acquisition.bus = BusState::Ok;
        let acquisition =
            AcquisitionStatus { recent, ..AcquisitionStatus::new(&acquisition, None) };
        let health = Health::new(Some(&acquisition), None);
        if health.ok {
            said.insert(health.label().to_owned());
        }
    }
    assert!(said.contains(IDLE_TEXT), "{said:?}");
    are_in_the_manual(&said, 2);
}

/// Everything that may be a reason of `health`.
fn reasons() -> BTreeSet<String> {
    let mut reasons = BTreeSet::new();
    let mut snapshot = everything();
    for state in BusState::ALL {
        for recent in recent() {
            let acquisition = snapshot.acquisition.as_mut().unwrap();
            (acquisition.bus, acquisition.recent) = (state, recent);
            reasons.extend(Health::new(snapshot.acquisition.as_ref(), None).reasons);
        }
    }
    for problem in [InterfaceProblem::Down, InterfaceProblem::Missing] {
        let acquisition = snapshot.acquisition.as_mut().unwrap();
        acquisition.interfaces_down = [("can0".to_owned(), problem)].into();
        reasons.extend(Health::new(snapshot.acquisition.as_ref(), None).reasons);
    }
    let estimation = snapshot.estimation.as_mut().unwrap();
    for rejection in rejections() {
        estimation.last_rejection.as_mut().unwrap().rejection = rejection;
        reasons.extend(Health::new(None, Some(estimation)).reasons);
    }
    let texts = alarms();
    for alarms in [4, 6, 7] {
        let alarm = |k: usize| {
            json!({
                "parameter": "fc3", "relative_change": 1.0, "deviation_sigma": 1.0,
                "slope_per_day": 1.0, "slope_sd": 1.0, "since": "2026-11-22T00:00:00Z",
                "text": texts[k % texts.len()]
            })
        };
        let all_alarms: Vec<Value> = (0..alarms).map(alarm).collect();
        estimation.drift.as_mut().unwrap().alarms =
            serde_json::from_value(all_alarms.into()).unwrap();
        reasons.extend(Health::new(None, Some(estimation)).reasons);
    }
    reasons.extend(everything().health.reasons);
    reasons.extend(everything().process.reasons());
    reasons.extend(reasons_of_halves());
    reasons
}

/// The sentence of an alarm in each of its forms.
fn alarms() -> Vec<String> {
    let baseline = Timestamp::from_unix_s(1_800_000_000);
    let forms = [(1.0, 0.5), (1.0, -0.5), (0.0, 0.5), (0.0, -0.5)];
    forms
        .map(|(baseline_value, difference)| {
            let change = Change {
                parameter: "fc3".into(),
                baseline: baseline_value,
                difference,
                standard_deviation: 0.01,
                half_band: 0.1,
            };
            change_sentence(&change, baseline, None, Some(baseline))
        })
        .into()
}

/// What a service of two processes says while one is away, or has refused to reload.
fn reasons_of_halves() -> Vec<String> {
    let folder = tempfile::tempdir_in("/tmp").unwrap();
    let paths = Paths::with_sockets_in(folder.path());
    let options = StreamOptions::new("cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 1.0).unwrap();
    let now = Instant::now();
    let mut acquisition =
        Collector::new(&options, Some(SharedAcquisition::default()), None, None, now);
    acquisition.process.reload_refused = Some("in words".into());
    acquisition.process.stream_folder_gone = Some("/run/didim/ipc".into());
    acquisition.process.sockets_missing =
        vec!["/run/didim/status.sock is gone and cannot be made again: in words".into()];
    let acquisition = acquisition.snapshot(now);
    let estimation = Some(SharedEstimation::default());
    let estimation = Collector::new(&options, None, estimation, None, now)
        .snapshot(now + Duration::from_secs(5));
    fn answer(socket: &Path, snapshot: &Snapshot) {
        let _ = std::fs::remove_file(socket);
        let (listener, text) =
            (UnixListener::bind(socket).unwrap(), serde_json::to_vec(snapshot).unwrap());
        std::thread::spawn(move || listener.accept().unwrap().0.write_all(&text).unwrap());
    }
    let mut reasons = estimation.health.reasons.clone();
    answer(&paths.acquisition_socket(), &acquisition);
    reasons.extend(fetch_snapshot(&paths).unwrap().health.reasons);
    answer(&paths.status_socket(), &estimation);
    reasons.extend(fetch_snapshot(&paths).unwrap().health.reasons);
    answer(&paths.status_socket(), &estimation);
    answer(&paths.acquisition_socket(), &acquisition);
    let both = fetch_snapshot(&paths).unwrap().health.reasons;
    // Said with the half that says it, as the manual has it.
    let of_acquisition = both.iter().filter_map(|reason| reason.strip_prefix("acquisition: "));
    assert_eq!(of_acquisition.count(), 3, "{both:?}");
    assert!(quoted(MANUAL).contains(&"acquisition: "));
    reasons
}

#[test]
fn reasons_of_health() {
    let said = reasons();
    are_in_the_manual(&said, 30);
    let mut said = said;
    said.insert("acquisition: ".into());
    is_still_said("\n## Reasons of health\n", &said);
}

#[test]
fn why_a_result_is_not_compared() {
    let (result, other, words) = (2, 1, || "in words".to_owned());
    let differences = [
        NotComparable::NotGood { result },
        NotComparable::OtherRobot { result, robot: words(), other, other_robot: words() },
        NotComparable::OtherMethod { result, method: words(), other, other_method: words() },
        NotComparable::OtherRegrouping { result, other },
        NotComparable::OtherParameters { result, other, names: words() },
        NotComparable::OtherPayload { result, payload_kg: 1.0, other, other_kg: None },
        NotComparable::OtherPayload { result, payload_kg: 1.0, other, other_kg: Some(2.0) },
    ];
    // What is new belongs into the list above.
    for why in &differences {
        match why {
            NotComparable::NotGood { .. }
            | NotComparable::OtherRobot { .. }
            | NotComparable::OtherMethod { .. }
            | NotComparable::OtherRegrouping { .. }
            | NotComparable::OtherParameters { .. }
            | NotComparable::OtherPayload { .. } => {}
        }
    }
    let mut said: BTreeSet<String> = differences.iter().map(ToString::to_string).collect();
    let line = json!({
        "schema": 1, "time": "2026-11-22T00:00:00Z", "result": 1, "robot": "arm",
        "configuration": "",
        "method": "idim-ls", "applicable": true, "relative_error": 0.1, "parameters": []
    });
    let result = serde_json::from_value(line).unwrap();
    let baseline = Baseline::from_result(result);
    said.extend(Tracker::new(baseline, DriftOptions::default()).status().why_not);
    are_in_the_manual(&said, 8);
    is_still_said("\n### Results that are not compared\n", &said);
}

/// Reasons of verdicts: those on measurements of two real arms, which have too little excitation,
/// dead torques and no free friction law.
#[test]
fn reasons_of_verdicts() {
    let mut said = BTreeSet::new();
    for (arm, file, counted) in [("kr300", "a.csv", 450..2050), ("tiago", "motion.csv", 920..6790)]
    {
        let folder = Path::new("tests/data").join(arm);
        let cell = Cell::read(&folder.join("cell.toml")).unwrap();
        let measurement = read_csv(&folder.join(file), None).unwrap();
        let identified = identify_measurement(&cell, cell.method, &measurement, counted);
        let uses = identified.unwrap().estimate.verdict.uses;
        let reasons = Use::ALL.into_iter().flat_map(|of| &uses.get(of).reasons);
        said.extend(reasons.map(ToString::to_string));
    }
    are_in_the_manual(&said, 6);
}

#[test]
fn causes_of_losses() {
    let losses = serde_json::to_value(Losses::default()).unwrap();
    for (kind, at_least) in [("frames", 11), ("cycles", 11)] {
        let causes = losses[kind].as_object().unwrap().keys();
        are_in_the_manual(&causes.map(|cause| label(cause)).collect(), at_least);
    }
    let causes = rejections().iter().map(|rejection| rejection.cause().to_owned()).collect();
    are_in_the_manual(&causes, 10);
}

/// Counters are declared once: what is declared is a line of the status and a metric.
#[test]
fn counters_of_the_bus() {
    let counters: Vec<_> = FaultCounters::default().each().collect();
    are_in_the_manual(&counters.iter().map(|each| each.label.to_owned()).collect(), 11);
    are_in_the_manual(&counters.iter().map(|each| each.metric.to_owned()).collect(), 11);
    let (snapshot, text) = (everything(), metrics_text(Some(&everything())));
    let lines = render(&snapshot, Colour::Never);
    for counter in counters {
        assert!(lines.lines().any(|line| line.starts_with(counter.label)), "{}", counter.label);
        assert!(text.contains(&format!("# TYPE {} counter\n", counter.metric)), "{text}");
    }
}

/// The names of all metrics.
fn families() -> BTreeSet<String> {
    let text = metrics_text(Some(&everything()));
    let families = text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next());
    families.map(str::to_owned).collect()
}

#[test]
fn metrics() {
    let families = families();
    are_in_the_manual(&families, 55);
    is_still_said("\n## Metrics\n", &families);
}

/// Every metric that a text names is served; gives how many it names.
#[track_caller]
fn names_what_is_served(text: &str) -> usize {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    let named: Vec<&str> = words.filter(|word| word.starts_with("didim_")).collect();
    let families = families();
    let unknown: Vec<_> = named.iter().filter(|name| !families.contains(**name)).collect();
    assert!(unknown.is_empty(), "{unknown:?} in {text}");
    named.len()
}

#[test]
fn alerts_are_of_metrics_that_there_are_and_tested_and_in_the_manual() {
    let rules = include_str!("../config/prometheus/didim-alerts.yml");
    let tests = include_str!("../config/prometheus/didim-alerts.test.yml");
    assert!(names_what_is_served(rules) >= 9 && names_what_is_served(tests) >= 9);
    let alerts: Vec<&str> =
        rules.lines().filter_map(|line| line.trim().strip_prefix("- alert: ")).collect();
    assert!(alerts.len() >= 9, "{alerts:?}");
    for alert in &alerts {
        assert!(tests.contains(&format!("alertname: {alert}\n")), "{alert} is never raised");
    }
    let said = alerts.into_iter().map(str::to_owned).collect();
    are_in_the_manual(&said, 9);
    is_still_said("\n## Alerts\n", &said);
}

#[test]
fn dashboards_show_metrics_that_there_are() {
    let [cabinet, plant] = [
        include_str!("../config/grafana/cabinet.json"),
        include_str!("../config/grafana/plant.json"),
    ]
    .map(|text| serde_json::from_str::<Value>(text).unwrap());
    for (dashboard, other) in [(&cabinet, &plant), (&plant, &cabinet)] {
        // Read by Grafana from 9 to 13.
        assert_eq!(dashboard["schemaVersion"], 39);
        assert!(dashboard.to_string().contains(&format!("/d/{}", other["uid"].as_str().unwrap())));
        let panels = dashboard["panels"].as_array().unwrap();
        let ids: BTreeSet<_> = panels.iter().map(|panel| panel["id"].as_u64()).collect();
        assert_eq!(ids.len(), panels.len());
        for target in panels.iter().flat_map(|panel| panel["targets"].as_array().unwrap()) {
            assert_eq!(target["datasource"]["uid"], "${datasource}");
            let expr = target["expr"].as_str().unwrap();
            assert!(names_what_is_served(expr) > 0 || expr.starts_with("count(up{"), "{expr}");
        }
        names_what_is_served(&dashboard["templating"].to_string());
    }
}
