//! Tests against files next to those of the command line; `DIDIM_WRITE_GOLDEN=1` rewrites them.

use std::collections::BTreeMap;
use std::path::Path;

use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::*;
use didim::archive::drift::{AlarmStatus, DriftStatus, ParameterDrift};
use didim::archive::store::{ParameterValue, Timestamp};
use didim::live::acquire::{AcquisitionStatus, BusState, FrameLatency, FrameTime};
use didim::live::latency::LatencySummary;
use didim::live::worker::{EstimateSummary, EstimationStatus, WindowState};
use didim::service::status::{Health, SCHEMA, StreamStatus};
use didim::window::Note;

const VALUES: [(&str, f64, f64); 28] = [
    ("zz1r", 1.23992, 6.4e-5),
    ("fv1", 7.999911, 3.1e-4),
    ("fc1", 7.340452, 5.4e-4),
    ("xx2r", -0.479935, 7.2e-5),
    ("xz2r", -0.159972, 2.7e-5),
    ("zz2r", 1.090006, 3.3e-5),
    ("mx2r", 2.209999, 5.1e-5),
    ("fv2", 5.50016, 3.9e-4),
    ("fc2", 8.239408, 5.7e-4),
    ("xx3r", 0.130118, 7.7e-5),
    ("zz3r", 0.109994, 2.2e-5),
    ("my3r", -0.599997, 4.6e-5),
    ("ia3", 0.0899974, 2.7e-5),
    ("fv3", 1.92983, 3.1e-4),
    ("fc3", 7.2770, 4.9e-4),
    ("mx4", -0.020012, 2.4e-5),
    ("ia4", 0.0299952, 1.6e-5),
    ("fv4", 1.08997, 2.1e-4),
    ("fc4", 2.57047, 4.6e-4),
    ("my5r", -0.0300181, 2.5e-5),
    ("ia5", 0.0400287, 2.4e-5),
    ("fv5", 1.78981, 3.2e-4),
    ("fc5", 3.06970, 4.6e-4),
    ("ia6", 0.0100071, 6.9e-6),
    ("fv6", 0.649898, 1.3e-4),
    ("fc6", 0.29957, 6.0e-4),
    ("fv_m6", 0.609922, 1.1e-4),
    ("fc_m6", 1.90038, 4.4e-4),
];

fn unit(name: &str) -> &'static str {
    match &name[..2] {
        "fv" => "N·m·s/rad",
        "fc" => "N·m",
        "mx" | "my" => "kg·m",
        _ => "kg·m²",
    }
}

fn latency(p50_ns: u64) -> LatencySummary {
    LatencySummary {
        count: 1_234_000,
        p50_ns,
        p99_ns: 60 * p50_ns,
        p999_ns: 200 * p50_ns,
        max_ns: 2_104_931,
    }
}

fn drift(alarmed: bool) -> DriftStatus {
    let changes = VALUES.iter().enumerate().map(|(k, (name, value, sigma))| {
        let relative = if k == 14 { 0.123 } else { 0.012 * (k as f64 - 13.0) / 2.0 };
        ParameterDrift {
            parameter: (*name).to_owned(),
            description: None,
            relative_change: Some(relative),
            deviation_sigma: Some(relative * value.abs() / sigma),
            band_share: Some(relative.abs() / 0.1),
        }
    });
    let alarm = AlarmStatus {
        description: None,
        parameter: "fc3".into(),
        relative_change: Some(0.123),
        deviation_sigma: Some(1140.0),
        slope_per_day: Some(0.0041),
        slope_sd: Some(0.0002),
        since: Timestamp::from_unix_s(1_797_836_400),
        text: "fc3 has grown by 12.30 % ± 0.01 % since the baseline of 2026-11-22, +0.41 ± 0.02 \
               %/day, left its band on 2026-12-21"
            .into(),
    };
    DriftStatus {
        baseline: 12,
        time: Timestamp::from_unix_s(1_795_331_849),
        compared: true,
        why_not: None,
        reconfigured: false,
        parameters: changes.collect(),
        alarms: if alarmed { vec![alarm] } else { Vec::new() },
    }
}

fn snapshot(drift: Option<DriftStatus>) -> Snapshot {
    let acquisition = AcquisitionStatus {
        bus: BusState::Ok,
        frames: 1_234_567,
        frames_per_second: 4999.7,
        samples: 1_234_000,
        samples_per_second: 4998.2,
        frame_to_buffer: Some(FrameLatency { from: FrameTime::Stamp, times: latency(991) }),
        ..AcquisitionStatus::default()
    };
    let parameters = VALUES.iter().map(|(name, value, sigma)| ParameterValue {
        description: None,
        name: (*name).to_owned(),
        unit: unit(name).to_owned(),
        value: *value,
        standard_deviation: *sigma,
        combined_standard_deviation: None,
    });
    let estimation = EstimationStatus {
        buffer_to_worker: Some(latency(21_503)),
        windows_opened: 43,
        windows_identified: 42,
        window: WindowState::Open { samples: 8120 },
        last_estimate: Some(EstimateSummary {
            window: 41,
            first_sequence: 0,
            last_sequence: 90,
            method: "idim-ls".into(),
            parameters: parameters.collect(),
            relative_error: Some(0.0564),
            condition_number: Some(174.9),
            applicable: true,
            reasons: vec![],
            monitoring_reasons: Vec::new(),
            uses: Vec::new(),
            load: None,
            readings: Default::default(),
        }),
        drift,
        ..EstimationStatus::default()
    };
    Snapshot {
        schema: SCHEMA,
        version: "1.2.3".into(),
        cell: "left".into(),
        uptime_s: 93_784.0,
        health: Health::new(Some(&acquisition), Some(&estimation)),
        process: didim::service::status::ProcessStatus::default(),
        stream: StreamStatus { sample_rate_hz: 5000.0, ..StreamStatus::default() },
        acquisition: Some(acquisition),
        estimation: Some(estimation),
    }
}

fn shown(snapshot: Snapshot) -> View {
    View { snapshot: Some(snapshot), ..View::default() }
}

/// Returns the screen of a terminal of this size, and its largest scroll offset.
fn drawn(view: &View, (width, height): (u16, u16)) -> (String, u16) {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let mut scrolls = 0;
    terminal.draw(|frame| scrolls = draw(frame, view).0).unwrap();
    let buffer = terminal.backend().buffer();
    let cells: Vec<&str> = buffer.content().iter().map(|cell| cell.symbol()).collect();
    let lines = cells.chunks(usize::from(width)).map(|line| line.concat());
    (lines.map(|line| line.trim_end().to_owned() + "\n").collect(), scrolls)
}

#[track_caller]
fn golden(name: &str, view: &View, size: (u16, u16)) {
    let (text, _) = drawn(view, size);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/command_line/golden");
    let path = folder.join(name);
    if std::env::var_os("DIDIM_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(&path).unwrap(), "{}", path.display());
}

#[test]
fn a_small_terminal_and_a_large_one() {
    let view = shown(snapshot(Some(drift(false))));
    golden("top-80x24.txt", &view, (80, 24));
    golden("top-120x40.txt", &view, (120, 40));
    golden("top-40x15.txt", &view, (40, 15));
}

/// Returns the line of a parameter, if it is on the screen.
fn place(text: &str, name: &str) -> Option<usize> {
    text.lines().position(|line| line.split_whitespace().next() == Some(name))
}

#[test]
fn the_parameters_that_use_most_of_their_bands_come_first() {
    let view = shown(snapshot(Some(drift(true))));
    let (text, _) = drawn(&view, (80, 60));
    let places = ["fc3", "fc_m6", "zz1r", "fv3"].map(|name| place(&text, name).unwrap());
    assert!(places.is_sorted(), "{text}");
    let (text, _) = drawn(&View { in_model_order: true, ..view.clone() }, (80, 60));
    assert!(place(&text, "zz1r") < place(&text, "fc3"), "{text}");
    // Where not everything fits, five of them come before all else.
    let (text, _) = drawn(&view, (80, 24));
    let most_used = ["fc3", "fc_m6", "fv_m6"].map(|name| place(&text, name));
    let losses = place(&text, "bus");
    assert!(most_used.iter().all(|place| place.is_some() && *place < losses), "{text}");
    assert_eq!(place(&text, "fv3"), None, "{text}");
}

#[test]
fn names_of_joints_stand_behind_the_rows() {
    let mut named = snapshot(Some(drift(false)));
    let estimation = named.estimation.as_mut().unwrap();
    let estimate = estimation.last_estimate.as_mut().unwrap();
    let fc3 = estimate.parameters.iter_mut().find(|own| own.name == "fc3").unwrap();
    fc3.description = Some("Coulomb friction of joint 3, `elbow_joint`".into());
    let (text, _) = drawn(&shown(named), (80, 60));
    let line = text.lines().nth(place(&text, "fc3").unwrap()).unwrap();
    assert!(line.contains("elbow_joint"), "{line}");
}

#[test]
fn help_fits_a_small_terminal_and_names_every_key() {
    let view = View { shows_help: true, ..shown(snapshot(None)) };
    let (text, scrolls) = drawn(&view, (80, 24));
    assert_eq!(scrolls, 0);
    for key in ["q, Esc", "?, h", "p  ", "s  ", "↑ ↓", "? back"] {
        assert!(text.contains(key), "{key}: {text}");
    }
    assert!(drawn(&view, (40, 15)).1 > 0, "and is reached by scrolling where it does not fit");
}

#[test]
fn an_alarm() {
    let mut snapshot = snapshot(Some(drift(true)));
    let acquisition = snapshot.acquisition.as_mut().unwrap();
    acquisition.counters.queue_drops = 3;
    acquisition.cycles_lost =
        BTreeMap::from([("missing_axis".into(), 2), ("counter_gap".into(), 1)]);
    snapshot.estimation.as_mut().unwrap().windows_rejected = BTreeMap::from([("busy".into(), 9)]);
    golden("top-alarm-80x24.txt", &shown(snapshot.clone()), (80, 24));
    golden("top-alarm-120x40.txt", &shown(snapshot), (120, 40));
}

#[test]
fn the_service_is_away() {
    let why = "no service at /run/didim/status.sock: Connection refused (os error 111); start \
               `didim run`, or give the folder of its sockets with --runtime";
    let away = Some((why.to_owned(), 17));
    let never = View { unreachable: away.clone(), ..View::default() };
    golden("top-never-there-80x24.txt", &never, (80, 24));
    golden("top-away-80x24.txt", &View { unreachable: away, ..shown(snapshot(None)) }, (80, 24));
}

#[test]
fn two_processes_of_which_one_is_away() {
    let mut without_bus = snapshot(None);
    without_bus.acquisition = None;
    without_bus.health.add("the acquisition does not answer: no service at /run/didim".into());
    let mut status = without_bus.estimation.take().unwrap();
    status.note = Some(Note { payload_kg: Some(2.5), ..Note::default() });
    without_bus.estimation = Some(status);
    golden("top-no-acquisition-80x24.txt", &shown(without_bus), (80, 24));
    let mut without_estimation = snapshot(None);
    without_estimation.estimation = None;
    without_estimation.health.add("the estimation does not answer: no service".into());
    golden("top-no-estimation-80x24.txt", &shown(without_estimation), (80, 24));
}

#[test]
fn everything_is_reached_by_scrolling_and_nothing_panics_at_any_size() {
    let view = shown(snapshot(Some(drift(true))));
    for width in [1, 2, 9, 20, 31, 43, 58, 79, 80, 109, 110, 200] {
        for height in [1, 2, 3, 5, 24] {
            let (_, scrolls) = drawn(&view, (width, height));
            for scroll in [0, scrolls, u16::MAX] {
                drawn(&View { scrolled_lines: scroll, ..view.clone() }, (width, height));
            }
        }
    }
    let view = View { in_model_order: true, ..view };
    let (top, scrolls) = drawn(&view, (80, 24));
    assert!(!top.contains("fc_m6") && scrolls > 0);
    let (bottom, _) = drawn(&View { scrolled_lines: scrolls, ..view.clone() }, (80, 24));
    assert!(bottom.contains("fc_m6"), "{bottom}");
    assert!(!drawn(&View { scrolled_lines: scrolls - 1, ..view }, (80, 24)).0.contains("fc_m6"));
}

#[test]
fn colours_only_where_they_are_wanted_and_never_alone() {
    use ratatui::style::Color;
    let view = shown(snapshot(Some(drift(true))));
    let colours = |colour: bool| {
        let mut terminal = Terminal::new(TestBackend::new(120, 40)).unwrap();
        let view = View { has_colour: colour, ..view.clone() };
        terminal.draw(|frame| _ = draw(frame, &view)).unwrap();
        let cells = terminal.backend().buffer().content().to_vec();
        cells.into_iter().filter(|cell| cell.fg != Color::Reset).count()
    };
    assert_eq!(colours(false), 0);
    assert!(colours(true) > 100);
    let (text, _) = drawn(&view, (120, 40));
    assert!(text.contains("! fc3 has grown") && text.contains("│█████▶"), "{text}");
}

#[test]
fn what_another_process_says_cannot_command_the_terminal() {
    let mut snapshot = snapshot(Some(drift(true)));
    snapshot.cell = "a\x1b[2Jb".into();
    snapshot.health.add("\x1b]0;title\x07".into());
    let status = snapshot.estimation.as_mut().unwrap();
    status.last_estimate.as_mut().unwrap().parameters[0].name = "\x1b[31m".into();
    status.note = Some(Note { text: Some("\x07\n".into()), ..Note::default() });
    let (text, _) = drawn(&shown(snapshot), (120, 60));
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'), "{text:?}");
}

#[test]
fn words_are_wrapped_and_long_ones_are_cut() {
    let texts = |text: &str, width| -> Vec<String> {
        wrap_lines("! ", text, Style::new(), width).iter().map(ToString::to_string).collect()
    };
    assert_eq!(texts("one two three", 11), ["! one two", "  three"]);
    assert_eq!(texts("abcdefghijkl mn", 10), ["! abcdefgh", "  ijkl mn"]);
    assert_eq!(texts("", 10), ["! "]);
    assert_eq!(texts("max 2.10 ms", 10), ["! max", "  2.10 ms"], "a value keeps its unit");
    assert_eq!(texts("4096 abcdefgh", 10), ["! 4096", "  abcdefgh"], "if both fit");
}
