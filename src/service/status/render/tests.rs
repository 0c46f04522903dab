use super::*;
use crate::archive::drift::AlarmStatus;
use crate::archive::store::{ParameterValue, Timestamp};
use crate::live::acquire::{BusState, FaultCounters, RealTimeGrants};
use crate::live::latency::LatencySummary;
use crate::live::worker::{EstimateSummary, Loss, RejectedWindow, Rejection};
use crate::service::status::{Health, SCHEMA, StreamStatus};
use crate::window::DriveReadings;
use didim_dynamics::{Reading, Readings};

/// Readings that a drive reported three times.
fn example() -> DriveReadings {
    let mut readings = [Readings::default(); 3];
    for (readings, celsius) in readings.iter_mut().zip([41.0, 42.0, 44.0]) {
        readings.set(Reading::Temperature, 1, celsius);
    }
    readings[0].set(Reading::Temperature, 0, 38.5);
    readings[0].set(Reading::Mode, 0, 8.0);
    DriveReadings::from_cycles(&readings)
}

fn snapshot() -> Snapshot {
    let acquisition = AcquisitionStatus {
        bus: BusState::Silent,
        frames: 1_234_567,
        frames_per_second: 4999.7,
        samples: 1_234_000,
        samples_per_second: 4998.2,
        frame_to_buffer: Some(FrameLatency {
            from: FrameTime::Read,
            times: LatencySummary {
                count: 1_234_000,
                p50_ns: 991,
                p99_ns: 53_247,
                p999_ns: 180_223,
                max_ns: 2_104_931,
            },
        }),
        counters: FaultCounters {
            queue_drops: 3,
            frames_stamped_late: 5,
            samples_without_reference: 7,
            stamps_in_future: 9,
            ..FaultCounters::default()
        },
        cycles_lost: BTreeMap::from([("missing_axis".into(), 2), ("restart".into(), 1)]),
        real_time: Some(RealTimeGrants {
            priority: Grant::Refused { why: "SCHED_FIFO 20: EPERM".into() },
            cpu: Grant::NotAsked,
            memory: Grant::NotAsked,
        }),
        recording: Some(RecordingStatus {
            state: RecordingState::Recording,
            ring_bytes: 812_400_000,
            ring_limit_bytes: 1_000_000_000,
            oldest_s: Some(1300.0),
            frames_unrecorded: 11,
            ..RecordingStatus::default()
        }),
        readings: example(),
        ..AcquisitionStatus::default()
    };
    let estimation = EstimationStatus {
        batch_to_worker: Some(LatencySummary {
            count: 19_281,
            p50_ns: 21_503,
            p99_ns: 999_423,
            p999_ns: 14_000_000,
            max_ns: 3_021_000_000,
        }),
        kept_recordings: Some(ArchiveStatus {
            files: 12,
            bytes: 340_120_000,
            capture: Some("bus".into()),
            failed: 1,
            last_failure: Some("result 7: not in the ring".into()),
            ..ArchiveStatus::default()
        }),
        windows_opened: 5,
        windows_identified: 3,
        windows_rejected: BTreeMap::from([("sample-gap".into(), 2)]),
        window: WindowState::Open { samples: 812 },
        last_rejection: Some(RejectedWindow {
            number: 4,
            first_sequence: 100,
            last_sequence: 900,
            rejection: Rejection::Loss(Loss::SampleGap { after: 900, missing: 2 }),
        }),
        last_estimate: Some(EstimateSummary {
            window: 3,
            first_sequence: 0,
            last_sequence: 90,
            method: "idim-ls".into(),
            parameters: vec![ParameterValue {
                description: None,
                name: "fc3".into(),
                unit: "N·m".into(),
                value: 6.48,
                standard_deviation: 0.003,
                combined_standard_deviation: None,
            }],
            relative_error: Some(0.0564),
            condition_number: Some(174.9),
            applicable: true,
            reasons: vec![],
            monitoring_reasons: vec![],
            uses: Vec::new(),
            load: None,
            readings: example(),
        }),
        ..EstimationStatus::default()
    };
    Snapshot {
        schema: SCHEMA,
        version: "1.2.3".into(),
        cell: "left".into(),
        uptime_s: 93_784.0,
        health: Health::new(Some(&acquisition), Some(&estimation)),
        process: crate::service::status::ProcessStatus::default(),
        stream: StreamStatus {
            sample_rate_hz: 5000.0,
            buffer_s: 20.0,
            shared_memory_bytes: 56_000_000,
        },
        acquisition: Some(acquisition),
        estimation: Some(estimation),
    }
}

#[test]
fn names_and_values_are_aligned() {
    let expected = "\
cell                       left (didim 1.2.3)
up for                     1 d 2 h 3 min
health                     the bus is silent
                           not granted: SCHED_FIFO 20: EPERM
                           the last window, 4, was rejected: 2 samples are missing after sample 900
buffer                     20 s at 5000 Hz, 56.0 MB of shared memory
bus                        silent
frames                     1234567 (5000/s)
samples                    1234000 (4998/s)
frame to buffer            p50 0.99 µs, p99 53.2 µs, p99.9 180 µs, max 2.10 ms, from when it was \
        read
frames dropped unread      3
frames stamped late        5
samples without reference  7
stamps in the future       9
cycles lost                2 missing axis
                           1 restart
motor temperature          joint 1 38.5, joint 2 42.3 (41 to 44) °C
drive mode                 joint 1 in 8
recording                  812 of 1000 MB, 21 min 40 s back
frames unrecorded          11
real-time priority         SCHED_FIFO 20: EPERM
batch to worker            p50 21.5 µs, p99 999 µs, p99.9 14.0 ms, max 3.02 s
window                     open, 812 samples
windows                    5 opened, 3 identified, 0 pending
recordings kept            12, 340.1 MB
capture                    bus
recordings not kept        1
last not kept              result 7: not in the ring
windows rejected           2 sample-gap
last rejection             window 4: 2 samples are missing after sample 900
last estimate              window 3, idim-ls, 1 parameters, relative error 5.64 %
last estimate at           38.5 to 42.3 °C, motors
verdict                    applicable
";
    assert_eq!(render(&snapshot(), Colour::Never), expected);
}

#[test]
fn colour_only_when_reported_and_never_from_another_place() {
    let mut snapshot = snapshot();
    snapshot.cell = "a\x1b[2Jb".into();
    let plain = render(&snapshot, Colour::Never);
    assert!(!plain.contains('\x1b'));
    let coloured = render(&snapshot, Colour::Always);
    assert!(coloured.contains("\x1b[31msilent\x1b[0m"));
    assert!(coloured.contains("\x1b[32mapplicable\x1b[0m"));
    assert!(!coloured.contains("\x1b[2J"));
}

#[test]
fn a_snapshot_survives_its_json_and_unknown_keys() {
    let snapshot = snapshot();
    let mut json = serde_json::to_value(&snapshot).unwrap();
    assert_eq!(serde_json::from_value::<Snapshot>(json.clone()).unwrap(), snapshot);
    json["acquisition"]["of_a_later_version"] = 1.into();
    assert_eq!(serde_json::from_value::<Snapshot>(json).unwrap(), snapshot);
}

#[test]
fn drift_is_reported_with_its_alarms_bounded_and_is_a_reason() {
    let mut snapshot = snapshot();
    let alarm = |k: u32| AlarmStatus {
        description: None,
        parameter: format!("fc{k}"),
        relative_change: Some(0.123),
        deviation_sigma: Some(30.0),
        slope_per_day: None,
        slope_sd: None,
        since: Timestamp::from_unix_s(1_795_331_849),
        text: format!("fc{k} has grown"),
    };
    let mut drift = DriftStatus {
        baseline: 12,
        time: Timestamp::from_unix_s(1_795_331_849),
        compared: true,
        why_not: None,
        reconfigured: true,
        parameters: Vec::new(),
        alarms: Vec::new(),
    };
    let mut rendered = |drift: &DriftStatus| {
        let estimation = snapshot.estimation.as_mut().unwrap();
        estimation.drift = Some(drift.clone());
        estimation.last_rejection = None;
        snapshot.health = Health::new(None, snapshot.estimation.as_ref());
        (render(&snapshot, Colour::Never), snapshot.health.clone())
    };
    let (text, health) = rendered(&drift);
    assert!(
        text.contains("baseline                   result 12 of 2026-11-22T07:17:29Z\n"),
        "{text}"
    );
    assert!(text.contains("drift                      every parameter in its band\n"), "{text}");
    assert!(text.contains("the configuration has changed since the baseline\n"), "{text}");
    assert!(health.ok, "{health:?}");
    drift.alarms = (1..=7).map(alarm).collect();
    let (text, health) = rendered(&drift);
    assert_eq!(health.reasons.len(), 6);
    assert_eq!(health.reasons[4..], ["fc5 has grown", "2 more parameters have left their bands"]);
    assert!(text.contains("fc5 has grown\n") && !text.contains("fc6"), "{text}");
    drift.why_not = Some("result 13 is not applicable".into());
    drift.compared = false;
    assert!(rendered(&drift).0.contains("not compared: result 13 is not applicable\n"));
}
