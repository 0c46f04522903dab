//! The torque of the environment: along a recording, and from a running service.

use std::fs;
use std::os::fd::OwnedFd;
use std::process::Command;
use std::time::{Duration, Instant};

use didim::live::external_torque::ExternalTorqueStatus;
use didim::live::stream::{
    ExternalTorqueMessage, MESSAGE_BYTES, MessageState, StreamNode, StreamOptions,
};
use didim::live::worker;
use didim::service::status::Request;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType, connect, recv, socket};

use crate::common::eventually;
use crate::program::cell::Site;
use crate::program::{Installation, didim, json, repository, succeed};

/// Samples of a cycle of the motion that the arm repeats: 8 s at 5 kHz.
const CYCLE_SAMPLES: u64 = 40_000;

/// Gear ratio of the first joint of the TX40.
const RATIO: f64 = 32.0;

/// A simulated recording of the arm, its result, and a table of another one.
struct Recorded {
    cell: Installation,
    result: String,
    table: String,
}

impl Recorded {
    fn new() -> Self {
        let cell = Installation::from_cell("tx40-packed-fd", &[]);
        let log = |name: &str, seed: &str| {
            let (scenario, log) = (cell.scenario(&[("seed = 1\nd", seed)]), cell.path(name));
            let bus = format!("log:{}", log.display());
            succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus, &"--scenario", &scenario]);
            log.display().to_string()
        };
        let (first, second) = (log("first.log", "seed = 1\nd"), log("second.log", "seed = 2\nd"));
        let path = |name: &str| cell.path(name).display().to_string();
        let (result, table) = (path("result.json"), path("second.csv"));
        let own = cell.cell().display().to_string();
        succeed(&[&"identify", &"--cell", &own, &"--input", &first, &"--out", &result]);
        succeed(&[&"convert", &"--cell", &own, &second, &table]);
        Self { cell, result, table }
    }

    /// What the command prints of a table.
    fn observe(&self, table: &str, more: &[&str]) -> serde_json::Value {
        let cell = self.cell.cell();
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"external-torque", &"--json"];
        arguments.extend([&"--cell" as &dyn AsRef<std::ffi::OsStr>, &cell, &"--result"]);
        arguments.extend([&self.result as &dyn AsRef<std::ffi::OsStr>, &"--input", &table]);
        arguments.extend(more.iter().map(|of| of as &dyn AsRef<std::ffi::OsStr>));
        json(&succeed(&arguments))
    }

    /// The table with a torque of the environment on the first joint for a second.
    fn pushed(&self, torque_nm: f64) -> String {
        let text = fs::read_to_string(&self.table).unwrap();
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        let column = header.split(',').position(|name| name == "motor_torque_nm_1").unwrap();
        let mut changed = format!("{header}\n");
        for line in lines {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            let time_s: f64 = cells[0].parse().unwrap();
            if (3.0..4.0).contains(&time_s) {
                let torque: f64 = cells[column].parse().unwrap();
                cells[column] = (torque - torque_nm / RATIO).to_string();
            }
            changed += &(cells.join(",") + "\n");
        }
        let path = self.cell.path("pushed.csv");
        fs::write(&path, changed).unwrap();
        path.display().to_string()
    }
}

/// Returns a figure of a joint, counted from 1.
fn figure(summary: &serde_json::Value, joint: usize, name: &str) -> f64 {
    summary["joints"][joint - 1][name].as_f64().unwrap()
}

#[test]
fn a_push_is_seen_with_its_size_and_time_and_none_without() {
    let recorded = Recorded::new();
    let free = recorded.observe(&recorded.table, &[]);
    for joint in 1..=6 {
        let (rms, expected) =
            (figure(&free, joint, "rms"), figure(&free, joint, "standard_deviation"));
        assert!(rms < 1.5 * expected, "joint {joint}: {rms} N·m of {expected}");
        assert!(figure(&free, joint, "largest_ratio") < 6.0, "{free}");
    }

    let out = recorded.cell.path("torque.csv").display().to_string();
    let pushed = recorded.observe(&recorded.pushed(20.0), &["--out", &out]);
    assert!(figure(&pushed, 1, "largest_ratio") > 8.0, "{pushed}");
    assert!((3.0..4.1).contains(&figure(&pushed, 1, "at_s")), "{pushed}");
    // The others see the push nowhere.
    for joint in 2..=6 {
        let change = figure(&pushed, joint, "rms") - figure(&free, joint, "rms");
        assert!(change.abs() < 1e-6, "joint {joint}: {change}");
    }

    let text = fs::read_to_string(&out).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|of| *of == name).unwrap();
    let columns = ["time_s", "usable", "external_torque_nm_1", "standard_deviation_nm_1"];
    let columns = columns.map(column);
    let rows: Vec<[f64; 4]> = lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            columns.map(|of| cells[of].parse().unwrap())
        })
        .collect();
    let at = |time_s: f64| rows.iter().find(|row| row[0] >= time_s).unwrap();
    // Ten time constants after its begin the push is there; ten after its end it is gone.
    let late = 10.0 / (std::f64::consts::TAU * pushed["bandwidth_hz"].as_f64().unwrap());
    for (time_s, expected) in [(2.9, 0.0), (3.0 + late, 20.0), (3.95, 20.0), (4.0 + late, 0.0)] {
        let [_, usable, torque, deviation] = *at(time_s);
        assert!(usable.to_bits() == 1.0_f64.to_bits(), "{time_s}");
        assert!((torque - expected).abs() < 4.0 * deviation, "{time_s}: {torque} ± {deviation}");
    }
    assert!(rows.len() > 30_000, "{}", rows.len());
}

#[test]
fn what_has_no_model_or_band_is_refused() {
    let recorded = Recorded::new();
    let cell = recorded.cell.cell();
    let refused = |result: &str, more: [&str; 2]| {
        let table = recorded.table.as_str();
        let finished = didim(&[
            &"external-torque",
            &"--cell",
            &cell,
            &"--result",
            &result,
            &"--input",
            &table,
            &more[0],
            &more[1],
        ]);
        (finished.code, finished.stderr)
    };
    let (code, why) = refused(&recorded.result, ["--bandwidth", "1e5"]);
    assert_eq!(code, Some(1), "{why}");
    assert!(why.contains("bandwidth"), "{why}");
    let (code, why) = refused(&recorded.table, ["--bandwidth", "5"]);
    assert_eq!(code, Some(1), "{why}");
}

/// A client of the socket.
struct Client(OwnedFd);

impl Client {
    fn connect(path: &std::path::Path) -> Self {
        let client = socket(AddressFamily::UNIX, SocketType::SEQPACKET, None).unwrap();
        connect(&client, &SocketAddrUnix::new(path).unwrap()).unwrap();
        Self(client)
    }

    fn next(&self) -> ExternalTorqueMessage {
        let mut bytes = [0; MESSAGE_BYTES + 1];
        let (length, _) = recv(&self.0, &mut bytes, rustix::net::RecvFlags::empty()).unwrap();
        ExternalTorqueMessage::from_bytes(&bytes[..length]).unwrap()
    }
}

/// The service publishes a message for each sample: without a result, then with the first one, in
/// shared memory and on the socket.
#[test]
fn a_service_publishes_the_external_torque_of_every_sample() {
    // The only window is the command's, with a whole cycle of the motion: no second result comes.
    let motion = "by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5";
    let site = Site::new(&[
        ("[service]", "[contact]\n\n[service]"),
        (motion, "by = \"command\""),
        ("min_s = 3.0", "min_s = 8.0"),
    ]);
    let (_service, _manager) = site.start("both");
    let socket = site.paths().external_torque_socket();
    eventually("the socket is there", || socket.exists());
    let client = Client::connect(&socket);
    let first = client.next();
    assert_eq!((first.state, first.result), (MessageState::NoResult as u32, 0));
    assert!(first.joints == 6 && first.torque[5].is_nan() && first.torque[6].abs() < 1e-300);

    site.ask(&Request::Window(worker::Command::Begin)).unwrap();
    site.identify_now();
    let since = Instant::now();
    let mut last = first;
    let mut sums = [0.0; 6];
    let mut count = 0.0;
    // A whole cycle of the motion, whatever its phase when the result comes.
    let mut end = u64::MAX;
    while last.sequence < end {
        assert!(since.elapsed() < Duration::from_secs(120), "{last:?}");
        let next = client.next();
        assert!(next.number > last.number && next.sequence > last.sequence);
        last = next;
        if next.state == MessageState::Valid as u32 {
            end = end.min(next.sequence + CYCLE_SAMPLES);
            count += 1.0;
            for (sum, torque) in sums.iter_mut().zip(next.torque) {
                *sum += torque.powi(2);
            }
        }
    }
    assert_eq!(last.result, 1, "the number of the first result plus 1");
    for sum in sums {
        // Nobody touches the arm, whose torques are some 10 N·m. Its simulation has no noise, so
        // that σ is smaller than the error of the observer itself.
        assert!((sum / count).sqrt() < 0.1, "{sums:?}");
    }

    eventually("the status counts them", || torque_status(&site).valid >= 2000);
    let status = torque_status(&site);
    assert_eq!((status.result.as_deref(), status.problem.as_deref()), (Some("0"), None));
    assert_eq!((status.clients, status.unpublished), (1, 0));
    assert!(status.published > status.valid);
    assert!(status.read_to_published.unwrap().count > 2000);

    compare_with_shared_memory(&site, &client);

    // The examples of the guide, in Python and C, read the same socket.
    for mut example in examples(&site) {
        let output = example.arg(&socket).arg("2").output().unwrap();
        let (text, why) = (String::from_utf8_lossy(&output.stdout), &output.stderr);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(why));
        let line = text.lines().next().unwrap_or_default();
        let (state, rest) = line.split_once(", ").unwrap();
        let lost: u64 = rest.split_once(" lost:").unwrap().0.parse().unwrap();
        assert_ne!(state, "no result", "{text}");
        // A client on a busy machine loses messages, all of which the service counts.
        assert!(lost <= torque_status(&site).messages_lost, "{text}");
        assert_eq!(line.matches('±').count(), 6, "{text}");
    }

    // A client that goes is forgotten.
    drop(client);
    eventually("nobody is connected", || torque_status(&site).clients == 0);
}

fn torque_status(site: &Site) -> ExternalTorqueStatus {
    site.status().acquisition.unwrap().external_torque.unwrap()
}

/// Shared memory has the same messages as the socket.
fn compare_with_shared_memory(site: &Site, client: &Client) {
    let paths = site.paths();
    let root = paths.runtime.join("ipc");
    let place = (root.as_path(), site.network.prefix.as_str());
    let cell = didim::cell::Cell::read(&site.cell.cell()).unwrap();
    let options = StreamOptions::new(&cell.name, place, 6, cell.sample_rate_hz(), 20.0).unwrap();
    let mut reader = StreamNode::join(&options).unwrap().external_torque_reader().unwrap();
    let mut receive = || loop {
        reader.wait(Duration::from_secs(10)).unwrap();
        if let Some(message) = reader.receive().unwrap() {
            break message;
        }
    };
    // Either reader may have lost some.
    let (mut shared, mut sent) = (receive(), client.next());
    while shared.number != sent.number {
        if shared.number < sent.number {
            shared = receive();
        } else {
            sent = client.next();
        }
    }
    assert_eq!(sent.to_bytes(), shared.to_bytes());
}

/// The examples of the guide.
fn examples(site: &Site) -> [Command; 2] {
    let guide = repository("docs/guide");
    let program = site.cell.path("external_torque");
    let source = guide.join("external_torque.c");
    let arguments = ["-Wall", "-Werror", "-o"];
    let built = Command::new("cc").args(arguments).arg(&program).arg(source).status().unwrap();
    assert!(built.success());
    let mut python = Command::new("python3");
    python.arg(guide.join("external_torque.py"));
    [python, Command::new(program)]
}
