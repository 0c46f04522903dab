//! Faults of the machine below a running service: a process that is stopped, an interface that is
//! not there, limits that are too low.

mod limits;

use std::process::Command;
use std::time::Duration;

use crate::common::eventually;
use crate::common::expectation::Expectation;
use crate::common::manager::{send, terminate};
use crate::program::cell::Site;
use crate::program::{Daemon, Installation, didim, json, succeed};
use didim::archive::events::{EventKind, read_events};
use didim::live::acquire::{BusState, InterfaceProblem};
use rustix::process::Signal;

const STOP: Duration = Duration::from_millis(1_500);

/// Stops a part of the service three times, as `kill -STOP`, a debugger and the freezer of a
/// container do.
fn stop_three_times(part: &str, changes: &[(&str, &str)]) {
    let expected = Expectation::of("process-stopped");
    let site = Site::new(changes);
    let (mut child, mut manager) = site.start(part);
    manager.expect(0, "READY=1");
    for _ in 0..3 {
        std::thread::sleep(Duration::from_millis(500));
        send(&child, Signal::STOP);
        std::thread::sleep(STOP);
        send(&child, Signal::CONT);
    }
    eventually("the stops are counted", || {
        let events = site.status().process.events;
        let stops = events.get(EventKind::ProcessStopped.key());
        stops.is_some_and(|stops| stops.count >= expected.get::<u64>("stops"))
    });
    eventually("the stops are stored", || {
        let events = read_events(&site.cell.state()).unwrap();
        let stops = events.iter().filter(|event| event.event == EventKind::ProcessStopped);
        let stops: Vec<f64> = stops.map(|event| event.duration_s.unwrap()).collect();
        let shortest = (STOP - Duration::from_millis(200)).as_secs_f64();
        stops.iter().filter(|seconds| **seconds >= shortest && **seconds < 10.0).count() >= 3
    });
    let events = succeed(&[&"history", &"--events", &"--state", &site.cell.state()]);
    expected.assert_said(&events, &[]);
    let (status, _) = terminate(&mut child);
    assert!(status.success(), "{status}");
}

#[test]
fn a_stopped_service_continues_and_reports_the_stop() {
    stop_three_times("both", &[]);
}

#[test]
fn a_stopped_estimation_continues_and_reports_the_stop() {
    stop_three_times("estimation", &[("[service]", "[service]\nprocesses = \"two\"")]);
}

/// No second start mends it, and the manager does not try.
#[test]
fn a_bus_that_cannot_be_is_an_error_of_the_cell() {
    for source in ["log:missing.log", "inproc:"] {
        let cell = Installation::from_cell("tx40-packed-fd", &[("can:vcan0", source)]);
        let (file, state) = (cell.path("cell.toml"), cell.state());
        let runtime = cell.runtime();
        let output = didim(&[&"run", &"--cell", &file, &"--state", &state, &"--runtime", &runtime]);
        assert_eq!(output.code, Some(78), "{source}: {}", output.stderr);
    }
}

const INSIDE: &str = "DIDIM_TEST_INSIDE_A_NETWORK_OF_ITS_OWN";

#[test]
#[ignore = "needs a network of its own: tests/run"]
fn a_service_without_its_interface_starts_and_waits() {
    let test = "machine::a_service_without_its_interface_starts_and_waits";
    in_own_network(test, without_interface);
}

/// Runs the body of a test in a network of its own, in which this program runs the test again.
fn in_own_network(test: &str, body: fn()) {
    if std::env::var_os(INSIDE).is_some() {
        return body();
    }
    let mut command = Command::new("unshare");
    command.arg("-rn").arg(std::env::current_exe().unwrap());
    command.args(["--ignored", "--exact", test, "--nocapture"]).env(INSIDE, "1");
    let finished = command.output().unwrap();
    let output = String::from_utf8_lossy(&finished.stdout);
    assert!(finished.status.success() && output.contains("1 passed"), "{finished:#?}");
}

fn ip(arguments: &str) {
    let done = Command::new("ip").args(arguments.split(' ')).status().unwrap();
    assert!(done.success(), "{arguments}");
}

/// Events of the interface in this phase.
fn phases(events: &serde_json::Value, phase: &str) -> usize {
    let all = events["events"].as_array().unwrap().iter();
    all.filter(|event| event["interface"] == "tap0" && event["phase"] == phase).count()
}

fn without_interface() {
    let bus = ("pcap:tx40.pcapng", "ethercat:tap0");
    let cell = Installation::from_cell("tx40-ethercat", &[bus]);
    let mut daemon = Daemon::start(&cell, None);
    let status = daemon.eventually("the interface is missing", |status| {
        let acquisition = status.acquisition.as_ref().unwrap();
        acquisition.interfaces_down.get("tap0") == Some(&InterfaceProblem::Missing)
            && status.process.events.contains_key(EventKind::InterfaceMissing.key())
    });
    let expected = Expectation::of("interface-missing");
    assert_eq!(status.health.reasons, expected.get::<[String; 1]>("says"));
    ip("link add name tap0 type veth peer name tap1");
    ip("link set tap0 up");
    ip("link set tap1 up");
    daemon.eventually("the interface is there", |status| {
        let acquisition = status.acquisition.as_ref().unwrap();
        acquisition.interfaces_down.is_empty()
            && acquisition.bus == BusState::Waiting
            && acquisition.counters.reopened == expected.get::<u64>("reopened")
            && status.process.events["interface-missing"].lasted_ms > 0
    });
    assert_eq!(daemon.terminate().0, Some(0));
    let events = succeed(&[&"history", &"--events", &"--json", &"--state", &cell.state()]);
    let events = json(&events);
    assert_eq!((phases(&events, "begins"), phases(&events, "ends")), (1, 1), "{events}");
    let log = daemon.log();
    assert_eq!(log.matches("tap0: the interface does not exist").count(), 1, "{log}");
    assert_eq!(log.matches("tap0: the interface is there again after").count(), 1, "{log}");
}
