//! The parts put together: a bus goes in, results come out, in one process and in two.

use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::common::bus::{assembler, frames, interface};
use crate::common::expectation::Expectation;
use crate::common::{Network, Process, eventually};
use didim::archive::ResultOptions;
use didim::archive::store::{HistoryLine, Timestamp, read_history};
use didim::live::acquire::{AcquireOptions, BusState};
use didim::live::latency::LatencySummary;
use didim::live::real_time_options::RealTimeOptions;
use didim::live::recording::WriteBudget;
use didim::live::stream::{Pace, StreamNode, Topic};
use didim::live::window_options::{Trigger, WindowOptions};
use didim::live::worker::{
    Command, IdentifiedWindow, Identify, Rejection, TimeOfDay, WorkerOptions,
};
use didim::service::status::{
    BaselineRequest, ClientError, Request, Snapshot, fetch_status, send_request,
};
use didim::service::supervision::{
    AcquisitionPart, EstimationPart, Parts, ServiceEnd, ServiceError, ServiceOptions,
    ServiceReport, SocketOptions, run,
};
use didim::window::Note;
use didim::window::Window;
use didim_drivers::frame::Frame;
use didim_drivers::source::{InProcessSender, WhenFull, in_process_bus};
use didim_identification::identification::{Estimate, SingularValues, Verdict};
use rustix::process::{Pid, Signal, kill_process};

fn windows(trigger: Trigger) -> WindowOptions {
    WindowOptions { trigger, margin_before_s: 0.05, margin_after_s: 0.05, min_s: 0.2, max_s: 5.0 }
}

fn by_motion() -> Trigger {
    Trigger::Motion { velocity_threshold_rad_s: 0.5, idle_s: 0.1, difference_s: 0.01 }
}

fn estimation(
    network: &Network,
    trigger: Trigger,
    folder: &Path,
    identify: Identify,
) -> EstimationPart {
    EstimationPart {
        identify,
        find_load: None,
        options: WorkerOptions {
            stream: network.options(),
            time_of_day: TimeOfDay::Log { since_1970_ns: 0 },
            windows: windows(trigger).plan(crate::common::bus::RATE_HZ).unwrap(),
            queue: 1,
            folder: Some(folder.to_owned()),
            time_limit: Duration::from_secs(60),
            max_results: 100,
            configuration: "c0ffee".into(),
            recorded: None,
            archiver: None,
            results: ResultOptions::default(),
            budget: WriteBudget::default(),
        },
    }
}

fn acquisition(network: &Network, pace: Pace) -> (InProcessSender, Box<AcquisitionPart>) {
    let (sender, source) = in_process_bus(&[interface()], 4096, WhenFull::Wait);
    let part = AcquisitionPart {
        source: Box::new(source),
        assembler: assembler(),
        options: AcquireOptions {
            stream: network.options(),
            pace,
            real_time: RealTimeOptions::default(),
            silence_after: Duration::from_secs(1),
        },
        recorder: None,
        external_torque: None,
    };
    (sender, Box::new(part))
}

/// Says of a window what can only be said of its very samples.
fn digest(window: &Window) -> Estimate {
    let sum = |value: fn(&didim_dynamics::JointSample) -> f64| -> f64 {
        window.samples[window.counted_samples.clone()].iter().map(value).sum()
    };
    Estimate {
        schema: 1,
        method: "idim-ls".into(),
        robot: "test".into(),
        samples: window.samples.len(),
        rows: window.counted_samples.len(),
        condition_number: sum(|sample| sample.motor_position_rad[0]),
        singular_values: SingularValues { max: sum(|sample| sample.motor_torque_nm[5]), min: 0.0 },
        verdict: good(),
        ..Estimate::default()
    }
}

fn identify() -> Identify {
    Box::new(|window| Ok(IdentifiedWindow { estimate: digest(window) }))
}

/// Three motions and rest between them.
fn three_motions() -> Vec<Frame> {
    frames(12_000, |sample| sample % 4000 > 1000 && sample % 4000 < 2500)
}

fn send(sender: InProcessSender, frames: Vec<Frame>) {
    std::thread::spawn(move || frames.iter().all(|frame| sender.send(*frame).is_ok()));
}

/// Replays frames through the whole service.
fn replay(frames: Vec<Frame>, folder: &Path, identify: Identify) -> ServiceReport {
    let network = Network::new();
    let (sender, acquisition) = acquisition(&network, Pace::Replay);
    send(sender, frames);
    let estimation = estimation(&network, by_motion(), folder, identify);
    run(&ServiceOptions::default(), Parts::Both(acquisition, estimation)).unwrap()
}

/// Files other than the history, which has dates.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut results: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            (entry.file_name().into(), std::fs::read(entry.path()).unwrap())
        })
        .collect();
    results.retain(|(name, _): &(PathBuf, _)| name.as_os_str() != "history.jsonl");
    results.sort();
    results
}

#[test]
fn a_replay_gives_the_same_bytes_however_slow_the_identification() {
    let (fast, slow) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let report = replay(three_motions(), fast.path(), identify());
    assert_eq!(report.end, ServiceEnd::SourceEnded);
    let estimation = report.snapshot.estimation.unwrap();
    assert_eq!((estimation.windows_opened, estimation.windows_identified), (3, 3));
    assert_eq!((estimation.samples, estimation.samples_missing), (12_000, 0));
    assert_eq!(estimation.buffer_to_worker.unwrap().count, 12_000);
    assert_eq!(report.snapshot.acquisition.unwrap().bus, BusState::Ended);
    // The queue takes one window, so a live bus would have lost some.
    let slowly: Identify = Box::new(|window| {
        std::thread::sleep(Duration::from_millis(300));
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    replay(three_motions(), slow.path(), slowly);
    let results = results(fast.path());
    assert_eq!(results.len(), 4, "three results and the latest");
    assert_eq!(results, self::results(slow.path()));
    let history = |folder: &Path| read_history(folder).unwrap().0;
    fn undated(folder: &Path, history: &impl Fn(&Path) -> Vec<HistoryLine>) -> Vec<HistoryLine> {
        let lines = history(folder).into_iter();
        lines.map(|line| HistoryLine { time: Timestamp::from_unix_s(0), ..line }).collect()
    }
    let numbers: Vec<_> = history(fast.path()).iter().map(|line| line.result).collect();
    assert_eq!(numbers, [0, 1, 2]);
    assert_eq!(undated(fast.path(), &history), undated(slow.path(), &history));
}

#[test]
fn a_window_with_a_gap_is_rejected_and_the_others_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut frames = three_motions();
    frames.drain(5500..5503);
    let report = replay(frames, folder.path(), identify());
    let estimation = report.snapshot.estimation.unwrap();
    assert_eq!(estimation.samples_missing, 3);
    assert_eq!(estimation.windows_rejected.get("sample-gap"), Some(&1));
    // What is left of the motion after the gap is a window of its own.
    assert_eq!(estimation.windows_identified, 3);
    assert_eq!(report.snapshot.acquisition.unwrap().cycles_lost.get("counter_gap"), Some(&3));
}

#[test]
fn a_refusal_is_counted_with_its_words() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = true;
    let identify: Identify = Box::new(move |window| {
        if std::mem::take(&mut first) {
            Err("too little excitation".into())
        } else {
            Ok(IdentifiedWindow { estimate: digest(window) })
        }
    });
    let report = replay(three_motions(), folder.path(), identify);
    let estimation = report.snapshot.estimation.unwrap();
    assert_eq!(estimation.windows_identified, 2);
    assert_eq!(estimation.windows_rejected.get("refused"), Some(&1));
    let why = Rejection::Refused { why: "too little excitation".into() };
    assert_eq!(estimation.last_rejection.unwrap().rejection, why);
}

#[test]
fn a_result_that_the_disk_refuses_is_stored_later_and_in_order() {
    let folder = tempfile::tempdir().unwrap();
    // A folder in the place of the first result, until the second window: not even root replaces
    // it.
    let (in_the_way, mut windows) = (folder.path().join("result-00000000.json"), 0);
    let identify: Identify = Box::new(move |window| {
        windows += 1;
        match windows {
            1 => std::fs::create_dir(&in_the_way)?,
            2 => std::fs::remove_dir(&in_the_way)?,
            _ => {}
        }
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    let report = replay(three_motions(), folder.path(), identify);
    let estimation = report.snapshot.estimation.unwrap();
    assert_eq!(estimation.windows_identified, 3);
    let expected = Expectation::of("state-folder-read-only");
    let rejected = estimation.windows_rejected.values().sum::<u64>();
    expected.assert_eq("windows_rejected", &rejected);
    expected.assert_eq("results_waiting", &estimation.results_waiting);
    assert_eq!(estimation.results_wait_for, None);
    let undisturbed = tempfile::tempdir().unwrap();
    replay(three_motions(), undisturbed.path(), self::identify());
    assert_eq!(results(folder.path()), results(undisturbed.path()));
    let lines = didim::archive::store::read_history(folder.path()).unwrap().0;
    let numbers: Vec<u64> = expected.get("results");
    assert!(lines.iter().map(|line| line.result).eq(numbers));
}

#[test]
fn a_result_that_the_disk_refuses_to_the_end_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let in_the_way = folder.path().join("result-00000000.json");
    let identify: Identify = Box::new(move |window| {
        std::fs::create_dir_all(&in_the_way)?;
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    let report = replay(three_motions(), folder.path(), identify);
    let estimation = report.snapshot.estimation.unwrap();
    assert_eq!(estimation.windows_identified, 0);
    assert_eq!(estimation.windows_rejected.get("not-stored"), Some(&3));
}

#[test]
fn a_living_bus_does_not_wait_for_the_identification() {
    let folder = tempfile::tempdir().unwrap();
    let network = Network::new();
    let (sender, acquisition) = acquisition(&network, Pace::Live);
    std::thread::spawn(move || {
        for some in frames(6400, |_| true).chunks(64) {
            some.iter().for_each(|frame| sender.send(*frame).unwrap());
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let slowly: Identify = Box::new(|window| {
        std::thread::sleep(Duration::from_millis(400));
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    let trigger = Trigger::Interval { length_s: 0.3 };
    let estimation = estimation(&network, trigger, folder.path(), slowly);
    let report = run(&ServiceOptions::default(), Parts::Both(acquisition, estimation)).unwrap();
    let status = report.snapshot.estimation.unwrap();
    let cause: String = Expectation::of("estimator-busy").get("windows_rejected");
    assert!(status.windows_rejected.contains_key(&cause), "{status:?}");
    assert!(status.windows_identified >= 2, "{status:?}");
    assert_eq!(status.windows_pending, 0);
    let rejected: u64 = status.windows_rejected.values().sum();
    assert_eq!(status.windows_opened, status.windows_identified + rejected, "{status:?}");
}

#[test]
fn a_panic_in_the_identification_ends_the_service_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let network = Network::new();
    let (sender, acquisition) = acquisition(&network, Pace::Replay);
    send(sender, three_motions());
    let identify: Identify = Box::new(|_| panic!("on purpose"));
    let estimation = estimation(&network, by_motion(), folder.path(), identify);
    let end = run(&ServiceOptions::default(), Parts::Both(acquisition, estimation));
    assert!(matches!(end, Err(ServiceError::Estimation(_))), "{end:?}");
}

#[test]
fn an_identification_that_does_not_end_ends_the_service_with_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let network = Network::new();
    let (sender, acquisition) = acquisition(&network, Pace::Replay);
    send(sender, three_motions());
    let (end, ends) = std::sync::mpsc::channel::<()>();
    let identify: Identify = Box::new(move |window| {
        let _ = ends.recv();
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    let mut estimation = estimation(&network, by_motion(), folder.path(), identify);
    estimation.options.time_limit = Duration::from_millis(200);
    let ended = run(&ServiceOptions::default(), Parts::Both(acquisition, estimation));
    let Err(ServiceError::Estimation(why)) = ended else { panic!("{ended:?}") };
    let expected = Expectation::of("identification-endless");
    expected.assert_said(&why.to_string(), &[("limit_s", &0.2)]);
    assert_eq!(results(folder.path()).len(), expected.get::<usize>("results"));
    drop(end);
}

#[test]
fn a_second_service_of_the_cell_is_refused_and_stops_what_it_had_started() {
    let folder = tempfile::tempdir().unwrap();
    let network = Network::new();
    let first = StreamNode::join(&network.options()).unwrap();
    let _writer = first.sample_writer(Pace::Live).unwrap();
    let (_sender, acquisition) = acquisition(&network, Pace::Live);
    let estimation = estimation(&network, by_motion(), folder.path(), identify());
    let refused = run(&ServiceOptions::default(), Parts::Both(acquisition, estimation));
    let Err(ServiceError::Acquisition(why)) = refused else { panic!("{refused:?}") };
    Expectation::of("second-service").assert_said(&why.to_string(), &[]);
}

#[test]
#[ignore = "the other process of a test"]
fn child_is_stopped_while_it_identifies() {
    let Some(network) = Network::inherited() else { return };
    let folder = PathBuf::from(std::env::var_os("DIDIM_TEST_FOLDER").unwrap());
    let (sender, acquisition) = acquisition(&network, Pace::Live);
    std::thread::spawn(move || {
        for some in frames(60_000, |_| true).chunks(64) {
            if !some.iter().all(|frame| sender.send(*frame).is_ok()) {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    // Longer than a stop may take.
    let identify: Identify = Box::new(|window| {
        // Not exactly: on a busy machine that one may be rejected.
        if window.number >= 2 {
            let pid = rustix::process::getpid();
            kill_process(pid, Signal::TERM).unwrap();
            std::thread::sleep(Duration::from_secs(20));
        }
        Ok(IdentifiedWindow { estimate: digest(window) })
    });
    let estimation = estimation(&network, Trigger::Interval { length_s: 0.3 }, &folder, identify);
    let report = run(&ServiceOptions::default(), Parts::Both(acquisition, estimation)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
    let status = report.snapshot.estimation.unwrap();
    assert!(status.windows_rejected.get("stopped") >= Some(&1), "{status:?}");
    let rejected: u64 = status.windows_rejected.values().sum();
    assert_eq!(status.windows_pending, 0, "{status:?}");
    assert_eq!(status.windows_opened, status.windows_identified + rejected, "{status:?}");
    assert_eq!(results(&folder).len() as u64, status.windows_identified + 1, "{status:?}");
}

#[test]
fn windows_of_a_stopped_service_are_counted() {
    let (network, folder) = (Network::new(), tempfile::tempdir().unwrap());
    let mut child = network
        .child("service::child_is_stopped_while_it_identifies")
        .env("DIDIM_TEST_FOLDER", folder.path())
        .spawn()
        .map(Process)
        .unwrap();
    let start = Instant::now();
    assert!(child.0.wait().unwrap().success());
    assert!(start.elapsed() < Duration::from_secs(15), "{:?}", start.elapsed());
    // Its ports are taken down although a computation was left behind. 16 bytes are the library's.
    let leftovers: Vec<_> = network.files().map(|file| file.file_name()).collect();
    let ports = leftovers.iter().filter(|name| !name.to_string_lossy().ends_with(".global_mgmt"));
    assert_eq!(ports.count(), 0, "{leftovers:?}");
}

#[test]
#[ignore = "the other process of a test"]
fn child_estimates() {
    let Some(network) = Network::inherited() else { return };
    let folder = PathBuf::from(std::env::var_os("DIDIM_TEST_FOLDER").unwrap());
    let estimation = estimation(&network, by_motion(), &folder, identify());
    let report = run(&ServiceOptions::default(), Parts::Estimation(estimation)).unwrap();
    assert_eq!(report.snapshot.estimation.unwrap().windows_identified, 3);
}

#[test]
fn two_processes_give_the_same_bytes_as_one() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    replay(three_motions(), one.path(), identify());
    let network = Network::new();
    let (sender, acquisition) = acquisition(&network, Pace::Replay);
    send(sender, three_motions());
    let mut child = network
        .child("service::child_estimates")
        .env("DIDIM_TEST_FOLDER", two.path())
        .spawn()
        .map(Process)
        .unwrap();
    let report = run(&ServiceOptions::default(), Parts::Acquisition(acquisition)).unwrap();
    assert_eq!(report.end, ServiceEnd::SourceEnded);
    assert!(report.snapshot.estimation.is_none());
    assert!(child.0.wait().unwrap().success());
    assert_eq!(results(one.path()), results(two.path()));
}

fn live_options(folder: &Path) -> ServiceOptions {
    ServiceOptions {
        status: Some(SocketOptions::new(folder.join("status"), 0o660)),
        control: Some(SocketOptions::new(folder.join("control"), 0o600)),
        ..ServiceOptions::default()
    }
}

/// As latencies of a running service are.
fn plausible(latency: Option<LatencySummary>) {
    let LatencySummary { count, p50_ns, p99_ns, p999_ns, max_ns } = latency.unwrap();
    let rising = [1, p50_ns, p99_ns, p999_ns, max_ns, 60_000_000_000];
    assert!(count > 0 && rising.is_sorted(), "{latency:?}");
}

/// A live service on a bus at 1 kHz, until it is stopped.
#[test]
#[ignore = "the other process of a test"]
fn child_serves() {
    let Some(network) = Network::inherited() else { return };
    let folder = PathBuf::from(std::env::var_os("DIDIM_TEST_FOLDER").unwrap());
    let (sender, acquisition) = acquisition(&network, Pace::Live);
    send_every(Duration::from_millis(1), sender, frames(60_000, |_| true));
    let estimation = estimation(&network, Trigger::Command {}, &folder.join("results"), identify());
    let report = run(&live_options(&folder), Parts::Both(acquisition, estimation)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
}

fn send_every(period: Duration, sender: InProcessSender, frames: Vec<Frame>) {
    std::thread::spawn(move || {
        let mut due = Instant::now();
        for frame in frames {
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            if sender.send(frame).is_err() {
                break;
            }
            due += period;
        }
    });
}

/// A live service on a bus at 5 kHz that identifies a window every 60 ms, until it is stopped.
#[test]
#[ignore = "the other process of a test"]
fn child_serves_at_5_khz() {
    let Some(network) = Network::inherited() else { return };
    let folder = PathBuf::from(std::env::var_os("DIDIM_TEST_FOLDER").unwrap());
    let (sender, acquisition) = acquisition(&network, Pace::Live);
    send_every(Duration::from_micros(200), sender, frames(5_000 * 60, |_| true));
    let trigger = Trigger::Interval { length_s: 0.3 };
    let estimation = estimation(&network, trigger, &folder.join("results"), identify());
    let report = run(&live_options(&folder), Parts::Both(acquisition, estimation)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
}

/// The least memory of its own that the process has within half a second \[bytes\].
fn anonymous_memory(process: &Process) -> u64 {
    let resident = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", process.0.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:")).unwrap();
        let kib: u64 = line.trim().strip_suffix(" kB").unwrap().parse().unwrap();
        std::thread::sleep(Duration::from_millis(50));
        1024 * kib
    };
    (0..10).map(|_| resident()).min().unwrap()
}

#[test]
fn the_memory_of_a_service_at_5_khz_is_flat() {
    let folder = tempfile::tempdir_in("/tmp").unwrap();
    let network = Network::new();
    let mut child = network
        .child("service::child_serves_at_5_khz")
        .env("DIDIM_TEST_FOLDER", folder.path())
        .spawn()
        .map(Process)
        .unwrap();
    let status_seen = || fetch_status(&folder.path().join("status")).ok();
    eventually("the first windows", || {
        status_seen().is_some_and(|status| status.estimation.unwrap().windows_identified > 10)
    });
    let before = anonymous_memory(&child);
    std::thread::sleep(Duration::from_secs(10));
    let after = anonymous_memory(&child);
    let status = status_seen().unwrap();
    stop(&mut child);
    let samples = status.acquisition.unwrap().samples;
    assert!(samples > 30_000, "{samples} samples");
    assert!(after < before + (1 << 20), "{before} bytes, ten seconds later {after}");
}

fn stop(child: &mut Process) -> Duration {
    let start = Instant::now();
    let pid = Pid::from_raw(i32::try_from(child.0.id()).unwrap()).unwrap();
    kill_process(pid, Signal::TERM).unwrap();
    assert!(child.0.wait().unwrap().success());
    start.elapsed()
}

/// What a service says of itself; a busy machine may keep it from an answer in time.
fn answered(status: &Path) -> Snapshot {
    let mut answer = None;
    eventually("an answer", || match fetch_status(status) {
        Err(ClientError::Io { cause, .. }) if cause.kind() == std::io::ErrorKind::WouldBlock => {
            false
        }
        other => {
            answer = Some(other.unwrap());
            true
        }
    });
    answer.unwrap()
}

#[test]
fn a_living_service_is_asked_commanded_and_stopped() {
    let folder = tempfile::tempdir_in("/tmp").unwrap();
    let network = Network::new();
    let manager = UnixDatagram::bind(folder.path().join("notify")).unwrap();
    manager.set_nonblocking(true).unwrap();
    let mut child = network
        .child("service::child_serves")
        .env("DIDIM_TEST_FOLDER", folder.path())
        .env("NOTIFY_SOCKET", folder.path().join("notify"))
        .env("WATCHDOG_USEC", "2000000")
        .spawn()
        .map(Process)
        .unwrap();
    let mut text = String::new();
    let mut heard = |word: &str| {
        let mut buffer = [0; 4096];
        while let Ok(length) = manager.recv(&mut buffer) {
            text.push_str(&String::from_utf8_lossy(&buffer[..length]));
            text.push('\n');
        }
        text.contains(word)
    };
    eventually("READY", || heard("READY=1"));
    let (status, control) = (folder.path().join("status"), folder.path().join("control"));
    assert_eq!(fetch_status(&status).unwrap().cell, "cell");

    // A window by command, from another process.
    eventually("the bus", || answered(&status).health.ok);
    // Noted before the window and in it.
    let note = |note| send_request(&control, &Request::Note(note));
    note(Note { payload_kg: Some(2.5), ..Note::default() }).unwrap();
    let implausible = note(Note { temperature_c: Some(-300.0), ..Note::default() });
    assert!(matches!(&implausible, Err(ClientError::Refused { why }) if why.contains("-300 °C")));
    send_request(&control, &Request::Window(Command::Begin)).unwrap();
    note(Note { text: Some("warm".into()), ..Note::default() }).unwrap();
    let again = send_request(&control, &Request::Window(Command::Begin));
    assert!(matches!(&again, Err(ClientError::Refused { why }) if why.contains("open already")));
    std::thread::sleep(Duration::from_millis(600));
    send_request(&control, &Request::Window(Command::End)).unwrap();
    let identified = |wanted| answered(&status).estimation.unwrap().windows_identified == wanted;
    eventually("the window is identified", || identified(1));
    let now = Request::Window(Command::Identify);
    let none = send_request(&control, &now);
    assert!(matches!(&none, Err(ClientError::Refused { why }) if why.contains("no window")));
    send_request(&control, &Request::Window(Command::Begin)).unwrap();
    eventually("enough counts", || match send_request(&control, &now) {
        Ok(_) => true,
        Err(ClientError::Refused { why }) => {
            assert!(why.contains("no window is open") || why.contains("too little"), "{why}");
            false
        }
        Err(other) => panic!("{other}"),
    });
    eventually("the second window is identified", || identified(2));
    let snapshot = answered(&status);
    let acquisition = snapshot.acquisition.unwrap();
    assert!((800.0..1200.0).contains(&acquisition.samples_per_second), "{acquisition:?}");
    assert!(folder.path().join("results/latest.json").exists());
    let noted = |line: &HistoryLine| line.note.as_ref().map(Note::line);
    let (history, _) = read_history(&folder.path().join("results")).unwrap();
    let notes: Vec<_> = history.iter().map(noted).collect();
    assert_eq!(notes, [Some("2.5 kg, warm".to_owned()), None], "noted with one window only");
    let latest = std::fs::read_to_string(folder.path().join("results/latest.json")).unwrap();
    let first = std::fs::read_to_string(folder.path().join("results/result-00000000.json"));
    assert!(!latest.contains("note") && !first.unwrap().contains("warm"), "results hold no notes");

    // A baseline, by command too: the worker notices.
    let drift = || answered(&status).estimation.unwrap().drift;
    let baseline = |request| send_request(&control, &Request::Baseline(request));
    assert_eq!(drift(), None);
    let unknown = baseline(BaselineRequest::Set(Some(9)));
    assert!(
        matches!(&unknown, Err(ClientError::Refused { why }) if why.contains("results 0 to 1"))
    );
    let words = baseline(BaselineRequest::Set(Some(0))).unwrap();
    assert!(words.starts_with("result 0 of 2") && words.ends_with("is the baseline"), "{words}");
    eventually("a baseline", || drift().is_some_and(|drift| drift.baseline == 0));
    baseline(BaselineRequest::Clear).unwrap();
    eventually("no baseline", || drift().is_none());
    let cleared = baseline(BaselineRequest::Clear);
    assert!(matches!(&cleared, Err(ClientError::Refused { why }) if why == "there is no baseline"));

    plausible(acquisition.frame_to_buffer.map(|latency| latency.times));
    let estimation = snapshot.estimation.unwrap();
    plausible(estimation.buffer_to_worker);
    plausible(estimation.batch_to_worker);

    // The same snapshot, and the estimate, for processes of this user.
    let node = StreamNode::join(&network.options()).unwrap();
    let mut documents = node.document_reader(Topic::Status).unwrap();
    eventually("a status by the stream", || {
        documents.receive().unwrap().is_some_and(|json| {
            serde_json::from_slice::<didim::service::status::Snapshot>(&json).unwrap().cell
                == "cell"
        })
    });
    let mut estimates = node.document_reader(Topic::Estimates).unwrap();
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    let latest = json(&std::fs::read(folder.path().join("results/latest.json")).unwrap());
    eventually("the last estimate", || {
        estimates.receive().unwrap().is_some_and(|estimate| json(&estimate) == latest)
    });

    eventually("the watchdog is fed", || heard("WATCHDOG=1"));
    let took = stop(&mut child);
    assert!(took < Duration::from_secs(2), "{took:?}");
    assert!(heard("STOPPING=1"));
    assert!(!status.exists() && !control.exists());
    drop((documents, estimates, node));
}

#[test]
fn a_runtime_folder_that_is_removed_is_made_again_and_reported() {
    let (network, folder) = (Network::new(), tempfile::tempdir_in("/tmp").unwrap());
    let runtime = folder.path().join("run");
    std::fs::create_dir(&runtime).unwrap();
    let (sender, acquisition) = acquisition(&network, Pace::Live);
    let estimation =
        estimation(&network, Trigger::Command {}, &folder.path().join("state"), identify());
    let options = live_options(&runtime);
    let service =
        std::thread::spawn(move || run(&options, Parts::Both(acquisition, estimation)).unwrap());
    let (status, control) = (runtime.join("status"), runtime.join("control"));
    eventually("an answer", || fetch_status(&status).is_ok());

    let expected = Expectation::of("runtime-folder-removed");
    std::fs::remove_dir_all(&runtime).unwrap();
    std::fs::remove_dir_all(&network.root).unwrap();
    eventually("an answer again", || fetch_status(&status).is_ok());
    eventually("health tells it", || {
        let [said]: [String; 1] = expected.get("says");
        answered(&status).health.reasons.iter().any(|reason| reason.contains(&said))
    });

    // Nothing is lost: a window by command is identified and stored.
    let command = |command| send_request(&control, &Request::Window(command));
    eventually("a command is taken", || command(Command::Begin).is_ok());
    frames(600, |_| true).into_iter().for_each(|frame| sender.send(frame).unwrap());
    eventually("all samples", || answered(&status).estimation.unwrap().samples == 600);
    command(Command::End).unwrap();
    drop(sender);
    let report = service.join().unwrap();
    assert_eq!(report.end, ServiceEnd::SourceEnded);
    let status = report.snapshot.estimation.unwrap();
    expected.assert_eq("windows_identified", &status.windows_identified);
    expected.assert_eq("samples_missing", &status.samples_missing);
    assert_eq!(read_history(&folder.path().join("state")).unwrap().0.len(), 1);
}

/// A verdict that speaks for every use that is asked for.
fn good() -> Verdict {
    let mut verdict = Verdict { applicable: true, ..Verdict::default() };
    verdict.uses.monitoring.applicable = Some(true);
    verdict.uses.prediction.applicable = Some(true);
    verdict
}
