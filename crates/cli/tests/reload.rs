//! A cell's service in real processes: its file read again while it runs, and halves that are
//! killed. The bus is in the process, and the simulated arm on it moves all the time.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::eventually;
use crate::common::expectation::Expectation;
use crate::common::manager::{Manager, send, terminate};
use crate::program::cell::Site;
use crate::program::{didim, json, results, succeed};
use didim::live::recording::RecordedWindow;
use didim::live::worker::{Command, WindowState};
use didim::service::status::{Request, Snapshot, fetch_status};
use didim_drivers::source::mcap::McapScan;
use rustix::process::Signal;

/// What a reload tells the manager: both words in their order, the first with its time.
fn reloaded(manager: &mut Manager, after: usize) -> String {
    let (number, begins) = manager.expect(after, "RELOADING=1");
    let time = begins.lines().find_map(|line| line.strip_prefix("MONOTONIC_USEC="));
    let now = didim_drivers::socket::monotonic_ns() / 1000;
    let reported_us: u64 = time.unwrap().parse().unwrap();
    assert!(reported_us <= now && now - reported_us < 60_000_000, "{reported_us} µs of {now} µs");
    manager.expect(number, "READY=1").1
}

/// Recordings that are kept of what a name begins with.
fn archived_files(site: &Site, begins: &str) -> Vec<PathBuf> {
    let folder = site.cell.state().join("recordings/kept");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let name = |file: &PathBuf| file.file_name().unwrap().to_str().unwrap().starts_with(begins);
    let mut files: Vec<_> = files.filter(name).collect();
    files.sort();
    files
}

fn refused(status: &Snapshot) -> Option<&String> {
    status.health.reasons.iter().find(|reason| reason.starts_with("reload refused"))
}

const SHORT: (&str, &str) = ("min_s = 3.0", "min_s = 1.0");

#[test]
fn another_configuration_is_valid_from_the_next_window_on_and_costs_no_sample() {
    let site = Site::new(&[SHORT]);
    let (mut child, mut manager) = site.start("both");
    manager.expect(0, "READY=1");
    let first = site.hash();
    eventually("a window is open", || {
        let window = site.status().estimation.unwrap().window;
        matches!(window, WindowState::Open { samples } if samples > 2000)
    });

    // By signal, in the middle of a window.
    site.change(&[("cutoff_hz = 200.0", "cutoff_hz = 150.0")]);
    let second = site.hash();
    assert_ne!(first, second);
    let so_far = manager.count();
    send(&child, Signal::HUP);
    reloaded(&mut manager, so_far);
    let work = site.status().estimation.unwrap();
    assert_eq!((work.configuration.as_str(), work.configuration_waits), (first.as_str(), true));
    site.identify_now();
    eventually("the next window has the next configuration", || {
        let work = site.status().estimation.unwrap();
        work.configuration == second && !work.configuration_waits
    });
    site.identify_now();

    // By command, and a broken file: it is reported, and the old configuration stays.
    site.change(&[("[identification]\n", "[identification]\nwindow = 3\n")]);
    let so_far = manager.count();
    let why = site.ask(&Request::Reload).unwrap_err();
    assert!(why.contains("cell.toml") && why.contains("unknown field `window`"), "{why}");
    let line = reloaded(&mut manager, so_far);
    Expectation::of("nonsense-reloaded").assert_said(&line, &[]);
    assert!(refused(&site.status()).is_some());
    assert_eq!(site.status().estimation.unwrap().configuration, second);

    // The bus cannot change, and is named.
    other_buses_are_refused(&site);

    // Good again, with other windows; `didim reload` as people use it.
    let motion = "by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5";
    site.change(&[(motion, "by = \"command\"")]);
    succeed(&[&"reload", &"--runtime", &site.cell.runtime()]);
    assert_eq!(refused(&site.status()), None);
    site.identify_now();
    eventually("windows are by command", || site.ask(&Request::Window(Command::Begin)).is_ok());

    let third = site.hash();
    eventually("three windows are identified, and their recordings kept", || {
        let work = site.status().estimation.unwrap();
        let waiting = work.kept_recordings.unwrap().waiting;
        work.windows_identified == 3 && waiting == 0 && work.configuration == third
    });
    let work = site.status().estimation.unwrap();
    assert_eq!((work.samples_missing, work.batches_lost, work.restarts), (0, 0, 0));
    let (status, _) = terminate(&mut child);
    assert!(status.success(), "{status}");
    let results = results(&site.cell.state());
    let configurations: Vec<String> = results
        .iter()
        .map(|result| json(result)["configuration"].as_str().unwrap().to_owned())
        .collect();
    // A recording names the configuration that its result was made with, not that of the start.
    let of_window = |file: &PathBuf| RecordedWindow::of_file(file).unwrap().unwrap().configuration;
    let recorded: Vec<_> = archived_files(&site, "result-").iter().filter_map(of_window).collect();
    assert_eq!(recorded, configurations);
    assert_eq!(configurations, [first, second.clone(), second]);
}

/// A reload refuses a change of the bus and names the key.
fn other_buses_are_refused(site: &Site) {
    site.change(&[("window = 3\n", "")]);
    for (from, to, key) in [
        ("\"can:vcan0\"", "\"can:vcan1\"", "bus.source"),
        ("zero = 0.0", "zero = 1.0", "bus.drives"),
        ("keep_results = 7", "keep_results = 8", "service.keep_results"),
        ("name = \"tx40-packed-fd\"", "name = \"another\"", "name"),
    ] {
        if key == "service.keep_results" {
            site.change(&[("[service]", "[service]\nkeep_results = 7")]);
        }
        site.change(&[(from, to)]);
        let why = site.ask(&Request::Reload).unwrap_err();
        assert!(why.contains(&format!("`{key}`")) && why.contains("restart"), "{why}");
        assert!(refused(&site.status()).unwrap().contains(key));
        site.change(&[(to, from)]);
        if key == "service.keep_results" {
            site.change(&[("[service]\nkeep_results = 7", "[service]")]);
        }
    }
}

/// The status as `didim status` shows it, of both halves.
fn merged(site: &Site) -> serde_json::Value {
    // A service that is not healthy gives exit code 3.
    let status = didim(&[&"status", &"--json", &"--runtime", &site.cell.runtime()]);
    let expected = if json(&status.stdout)["health"]["ok"] == true { 0 } else { 3 };
    assert_eq!(status.code, Some(expected), "{}", status.stderr);
    json(&status.stdout)
}

fn has_reason(status: &serde_json::Value, words: &str) -> bool {
    let reasons = status["health"]["reasons"].as_array().unwrap();
    reasons.iter().any(|reason| reason.as_str().unwrap().contains(words))
}

#[test]
fn either_half_may_be_killed_and_the_other_goes_on() {
    let site = Site::new(&[SHORT, ("[service]", "[service]\nprocesses = \"two\"")]);
    let acquisition_status = || fetch_status(&site.paths().acquisition_socket()).unwrap();
    // The estimation comes first, and is ready although nobody sends.
    let (mut work, mut of_work) = site.start("estimation");
    of_work.expect(0, "READY=1");
    eventually("it says that nothing comes", || {
        site.status().health.reasons.iter().any(|why| why.contains("no sample has come"))
    });
    let (mut bus, mut of_bus) = site.start("acquisition");
    of_bus.expect(0, "READY=1");
    eventually("samples", || site.status().estimation.unwrap().samples > 1000);
    assert!(!has_reason(&merged(&site), "no sample has come"));

    // The acquisition looks at what concerns it.
    site.change(&[("\"can:vcan0\"", "\"can:vcan1\"")]);
    let so_far = of_bus.count();
    send(&bus, Signal::HUP);
    reloaded(&mut of_bus, so_far);
    assert!(has_reason(&merged(&site), "acquisition: reload refused"));
    site.change(&[("\"can:vcan1\"", "\"can:vcan0\"")]);
    let so_far = of_bus.count();
    send(&bus, Signal::HUP);
    reloaded(&mut of_bus, so_far);
    assert!(!has_reason(&merged(&site), "reload refused"));

    // Without the acquisition, in the middle of a window.
    eventually("a window is open", || {
        let window = site.status().estimation.unwrap().window;
        matches!(window, WindowState::Open { samples } if samples > 2000)
    });
    send(&bus, Signal::KILL);
    bus.0.wait().unwrap();
    eventually("it says that nothing comes any more", || {
        let status = merged(&site);
        has_reason(&status, "no sample has come")
            && has_reason(&status, "the acquisition does not answer")
    });
    let before = site.status().estimation.unwrap();
    (bus, of_bus) = site.start("acquisition");
    of_bus.expect(0, "READY=1");
    eventually("samples again", || {
        let after = site.status().estimation.unwrap();
        after.samples > before.samples + 1000 && after.restarts == before.restarts + 1
    });
    site.identify_now();
    eventually("a window of the new acquisition", || {
        site.status().estimation.unwrap().windows_identified == 1
    });
    // Whichever is seen first: that nothing comes, or the next acquisition.
    eventually("what was on the bus before it was killed is kept", || {
        let is_complete = |file: &PathBuf| McapScan::read(file).unwrap().stamps_ns().is_some();
        archived_files(&site, "fault-00000000-").iter().any(is_complete)
    });

    // Without the estimation.
    send(&work, Signal::KILL);
    work.0.wait().unwrap();
    let before = acquisition_status().acquisition.unwrap().samples;
    eventually("the acquisition goes on", || {
        acquisition_status().acquisition.unwrap().samples > before + 1000
    });
    assert!(has_reason(&merged(&site), "the estimation does not answer"));
    (work, of_work) = site.start("estimation");
    of_work.expect(0, "READY=1");
    eventually("samples again", || site.status().estimation.unwrap().samples > 1000);
    for child in [&mut work, &mut bus] {
        let (status, _) = terminate(child);
        assert!(status.success(), "{status}");
    }
    assert!(!Path::new(&site.paths().status_socket()).exists());
    // What was killed was cleaned up after; the library's 16 bytes of its own stay.
    let leftovers = site.network.files().map(|file| file.file_name().into_string().unwrap());
    let leftovers: Vec<String> = leftovers.filter(|name| !name.ends_with(".global_mgmt")).collect();
    assert_eq!(leftovers, Vec::<String>::new());
}
