//! What the service manager hears of the service, from real processes, with faults on purpose.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::common::bus::{assembler, frames, interface};
use crate::common::expectation::Expectation;
use crate::common::manager::{Manager, terminate};
use crate::common::{Network, Process, eventually};
use didim::archive::ResultOptions;
use didim::live::acquire::AcquireOptions;
use didim::live::real_time_options::RealTimeOptions;
use didim::live::recording::WriteBudget;
use didim::live::stream::Pace;
use didim::live::window_options::{Trigger, WindowOptions};
use didim::live::worker::{IdentifiedWindow, Identify, TimeOfDay, WorkerOptions};
use didim::service::supervision::{
    AcquisitionPart, EstimationPart, Parts, ServiceEnd, ServiceOptions, SocketOptions, run,
};
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::source::{
    InProcessSource, InterfaceName, Received, Source, SourceCounters, SourceError, StampClock,
    WhenFull, in_process_bus,
};
use didim_identification::identification::Estimate;

/// What is wrong with a child, by the word that its parent gives it.
fn fault() -> String {
    std::env::var("DIDIM_TEST_FAULT").unwrap()
}

/// The in-process bus, with its faults.
struct Faulty {
    bus: InProcessSource,
    began: Instant,
}

impl Source for Faulty {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        if fault() == "stuck-bus" && self.began.elapsed() > Duration::from_secs(3) {
            std::thread::sleep(Duration::from_secs(600));
        }
        self.bus.receive(batch, timeout)
    }

    fn counters(&self) -> SourceCounters {
        self.bus.counters()
    }

    fn interfaces(&self) -> &[InterfaceName] {
        self.bus.interfaces()
    }

    fn stamp_clock(&self) -> StampClock {
        // It is asked while the bus thread starts.
        if fault() == "slow-start" {
            std::thread::sleep(Duration::from_secs(5));
        }
        self.bus.stamp_clock()
    }
}

/// Blocks the worker's thread when that logs, which it does when it rejects a window.
struct Blocking;

impl Write for Blocking {
    fn write(&mut self, text: &[u8]) -> std::io::Result<usize> {
        if std::thread::current().name() == Some("worker") {
            std::thread::sleep(Duration::from_secs(600));
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn identify() -> Identify {
    let long = ["long-identification", "replay", "short-replay"];
    let takes = if long.contains(&fault().as_str()) { 600 } else { 0 };
    Box::new(move |_| {
        std::thread::sleep(Duration::from_secs(takes));
        Ok(IdentifiedWindow { estimate: Estimate::default() })
    })
}

/// A service on a bus at 1 kHz, live or replayed, until it is stopped.
#[test]
#[ignore = "the other process of a test"]
fn child_serves() {
    let Some(network) = Network::inherited() else { return };
    let folder = PathBuf::from(std::env::var_os("DIDIM_TEST_FOLDER").unwrap());
    let fault = fault();
    if fault == "stuck-worker" {
        tracing_subscriber::fmt().with_writer(|| Blocking).init();
    }
    let (sender, bus) = in_process_bus(&[interface()], 4096, WhenFull::Wait);
    let replays = fault.ends_with("replay");
    // One window, or many.
    let cycles = if fault == "short-replay" { 450 } else { 120_000 };
    std::thread::spawn(move || {
        let mut due = Instant::now();
        for (number, mut frame) in frames(cycles, |_| true).into_iter().enumerate() {
            if fault == "unknown" {
                frame.id = FrameId::Standard(0x7ff);
            }
            if fault == "silent" {
                std::thread::sleep(Duration::from_secs(600));
            }
            if !replays {
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
                due += Duration::from_millis(1);
            }
            // A gap has the open window rejected, which is logged.
            if fault == "stuck-worker" && number == 3000 {
                continue;
            }
            if sender.send(frame).is_err() {
                break;
            }
        }
    });
    let acquisition = AcquisitionPart {
        source: Box::new(Faulty { bus, began: Instant::now() }),
        assembler: assembler(),
        options: AcquireOptions {
            stream: network.options(),
            pace: if replays { Pace::Replay } else { Pace::Live },
            real_time: RealTimeOptions::default(),
            silence_after: Duration::from_millis(1500),
        },
        recorder: None,
        external_torque: None,
    };
    let windows = WindowOptions {
        trigger: Trigger::Interval { length_s: 0.3 },
        margin_before_s: 0.05,
        margin_after_s: 0.05,
        min_s: 0.2,
        max_s: 5.0,
    };
    let estimation = EstimationPart {
        identify: identify(),
        find_load: None,
        options: WorkerOptions {
            stream: network.options(),
            time_of_day: TimeOfDay::Log { since_1970_ns: 0 },
            windows: windows.plan(crate::common::bus::RATE_HZ).unwrap(),
            queue: 1,
            folder: Some(folder.join("results")),
            time_limit: Duration::from_secs(60),
            max_results: 10,
            configuration: "c0ffee".into(),
            recorded: None,
            archiver: None,
            results: ResultOptions::default(),
            budget: WriteBudget::default(),
        },
    };
    let socket = |name, mode| Some(SocketOptions::new(folder.join(name), mode));
    let options = ServiceOptions {
        status: socket("status", 0o660),
        control: socket("command", 0o600),
        ..ServiceOptions::default()
    };
    let report = run(&options, Parts::Both(Box::new(acquisition), estimation)).unwrap();
    assert_eq!(report.end, ServiceEnd::Signal);
}

/// A child with its manager.
struct Managed {
    folder: tempfile::TempDir,
    _network: Network,
    child: Process,
    manager: Manager,
}

impl Managed {
    fn start(fault: &str, watchdog: Option<Duration>) -> Self {
        let (network, folder) = (Network::new(), tempfile::tempdir_in("/tmp").unwrap());
        let manager = Manager::listen(folder.path(), "notify");
        let mut command = network.child("manager::child_serves");
        command.env("DIDIM_TEST_FOLDER", folder.path()).env("DIDIM_TEST_FAULT", fault);
        manager.manages(&mut command, watchdog);
        let child = Process(command.spawn().unwrap());
        Self { folder, _network: network, child, manager }
    }

    fn socket(&self, name: &str) -> UnixStream {
        UnixStream::connect(Path::new(self.folder.path()).join(name)).unwrap()
    }

    /// It ends well, and nothing that is stuck holds it up. A manager kills it after 90 s; a busy
    /// machine may take seconds.
    fn stops(mut self) {
        let (status, took) = terminate(&mut self.child);
        println!("stopped within {took:?}");
        assert!(status.success(), "{status}");
        assert!(took < Duration::from_secs(30), "{took:?}");
        self.manager.expect(0, "STOPPING=1");
        assert!(!self.folder.path().join("status").exists());
    }
}

#[test]
fn it_is_ready_when_samples_flow_and_says_what_flows() {
    let mut managed = Managed::start("none", None);
    let (number, ready) = managed.manager.expect(0, "READY=1");
    assert!(ready.contains("window open"), "{ready}");
    // Samples flow: the status of that moment has some.
    let status =
        didim::service::status::fetch_status(&managed.folder.path().join("status")).unwrap();
    assert!(status.acquisition.unwrap().samples > 0);
    let (_, line) = managed.manager.expect(number, " samples/s");
    assert!(line.starts_with("STATUS="), "{line}");
    managed.manager.expect(number, "last estimate not applicable, ");
    assert_eq!(managed.manager.times("WATCHDOG=1").len(), 0, "nobody asked for it");
    managed.stops();
}

#[test]
fn it_is_ready_when_the_bus_is_known_to_be_silent_and_not_before() {
    let started = Instant::now();
    let mut managed = Managed::start("silent", Some(Duration::from_secs(2)));
    let (number, waiting) = managed.manager.expect(0, "no frame has come yet");
    assert!(!waiting.contains("READY=1"), "{waiting}");
    let (ready, _) = managed.manager.expect(0, "READY=1");
    assert!(ready > number);
    assert!(started.elapsed() >= Duration::from_millis(1500), "that is when it is silent");
    // Silence is no reason to restart.
    is_fed(&mut managed, Duration::from_secs(2));
    managed.stops();
}

#[test]
fn frames_without_samples_hold_the_start_up_but_not_for_ever() {
    let started = Instant::now();
    let mut managed = Managed::start("unknown", None);
    managed.manager.expect(0, "READY=1");
    assert!(started.elapsed() >= Duration::from_secs(10), "{:?}", started.elapsed());
    managed.manager.expect(0, "frames come, but no sample is complete");
    managed.stops();
}

#[test]
fn a_long_start_asks_for_more_time() {
    let mut managed = Managed::start("slow-start", None);
    let (extended, _) = managed.manager.expect(0, "EXTEND_TIMEOUT_USEC=");
    let (ready, _) = managed.manager.expect(0, "READY=1");
    assert!(extended < ready);
    // The 5 s of the start are no stop of the process. Pauses are looked for ten times a second, so
    // that the second status knows of one.
    let mut process = serde_json::Value::Null;
    for _ in 0..2 {
        std::thread::sleep(Duration::from_secs(2));
        eventually("a status of the process", || {
            let status = std::io::read_to_string(managed.socket("status")).unwrap();
            let status: serde_json::Value = serde_json::from_str(&status).unwrap();
            process = status["process"].clone();
            process.is_object()
        });
    }
    let stopped_ms = process["events"]["process-stopped"]["lasted_ms"].as_u64();
    assert!(stopped_ms.is_none_or(|stopped_ms| stopped_ms < 2_500), "{process}");
    managed.stops();
}

#[test]
fn a_start_can_be_stopped() {
    let mut managed = Managed::start("slow-start", None);
    managed.manager.expect(0, "EXTEND_TIMEOUT_USEC=");
    managed.stops();
}

/// Whether the watchdog is fed within each of its periods, for three of them.
fn is_fed(managed: &mut Managed, watchdog: Duration) {
    managed.manager.expect(0, "WATCHDOG=1");
    managed.manager.hear(3 * watchdog);
    let fed = managed.manager.times("WATCHDOG=1");
    let longest = fed.windows(2).map(|two| two[1] - two[0]).max().unwrap();
    assert!(fed.len() >= 4 && longest < watchdog, "{} times, {longest:?}", fed.len());
}

#[test]
fn an_identification_of_minutes_does_not_starve_the_watchdog_nor_hold_up_a_stop() {
    let mut managed = Managed::start("long-identification", Some(Duration::from_secs(2)));
    managed.manager.expect(0, "READY=1");
    is_fed(&mut managed, Duration::from_secs(2));
    // Clients that say nothing, at both sockets, hold nobody up either.
    let _silent = [managed.socket("command"), managed.socket("status")];
    managed.stops();
}

#[test]
fn a_log_that_has_ended_does_not_starve_the_watchdog_while_its_windows_are_identified() {
    let mut managed = Managed::start("short-replay", Some(Duration::from_secs(2)));
    managed.manager.expect(0, "READY=1");
    // The log ends at once.
    managed.manager.hear(Duration::from_secs(2));
    is_fed(&mut managed, Duration::from_secs(2));
    managed.stops();
}

/// Whether the watchdog, fed at first, is fed no more.
fn starves(mut managed: Managed, fault: &str) {
    let unfed_s: f64 = Expectation::of(fault).get("unfed_s");
    managed.manager.expect(0, "WATCHDOG=1");
    managed.manager.hear(Duration::from_secs(5));
    let so_far = managed.manager.count();
    assert!(managed.manager.times("WATCHDOG=1").len() >= 2);
    managed.manager.hear(Duration::from_secs_f64(unfed_s));
    assert!(managed.manager.count() > so_far, "the rest of the service goes on");
    let fed = managed.manager.times("WATCHDOG=1");
    let last = fed.last().unwrap().elapsed();
    assert!(last.as_secs_f64() > unfed_s, "fed {last:?} ago");
    // A thread that is stuck does not hold up the end.
    managed.stops();
}

#[test]
fn a_bus_thread_that_is_stuck_starves_the_watchdog() {
    starves(Managed::start("stuck-bus", Some(Duration::from_secs(1))), "acquisition-stuck");
}

#[test]
fn a_worker_that_is_stuck_starves_the_watchdog() {
    starves(Managed::start("stuck-worker", Some(Duration::from_secs(1))), "estimator-stuck");
}

#[test]
fn a_replay_can_be_stopped() {
    let mut managed = Managed::start("replay", Some(Duration::from_secs(2)));
    managed.manager.expect(0, "READY=1");
    managed.stops();
}
