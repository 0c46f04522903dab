//! `didim metrics`: what a scrape gets, from a service that answers and from none, and what clients
//! may not take.

use crate::common::expectation::Expectation;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use didim::service::metrics::{Limits, MAX_LABELS, metrics_text, serve};
use didim::service::status::Snapshot;

const STATUS: &str = include_str!("metrics/status.json");

fn snapshot() -> Snapshot {
    serde_json::from_str(STATUS).unwrap()
}

/// The samples of an exposition by name with labels.
fn samples(text: &str) -> BTreeMap<&str, f64> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.rsplit_once(' ').unwrap())
        .map(|(name, value)| (name, value.parse().unwrap()))
        .collect()
}

#[test]
#[allow(clippy::float_cmp, reason = "written and read back exactly")]
fn a_status_is_reported_in_base_units() {
    let text = metrics_text(Some(&snapshot()));
    let samples = samples(&text);
    for (name, value) in [
        ("didim_up", 1.0),
        ("didim_service_info{version=\"1.2.3\",cell=\"left\"}", 1.0),
        ("didim_uptime_seconds", 93784.5),
        ("didim_healthy", 0.0),
        ("didim_health_reasons", 1.0),
        ("didim_bus_state{state=\"ok\"}", 1.0),
        ("didim_bus_state{state=\"down\"}", 0.0),
        ("didim_samples_total", 4711.0),
        ("didim_frames_dropped_total", 3.0),
        ("didim_frames_unused_total{cause=\"unknown_id\"}", 12.0),
        ("didim_cycles_lost_total{cause=\"missing_axis\"}", 5.0),
        ("didim_receive_buffer_bytes", 212_992.0),
        ("didim_real_time_granted{wish=\"priority\"}", 1.0),
        ("didim_real_time_granted{wish=\"cpu\"}", 0.0),
        ("didim_frame_to_buffer_seconds_count", 4711.0),
        ("didim_worker_samples_missing_total", 11.0),
        ("didim_window_samples", 812.0),
        ("didim_windows_rejected_total{cause=\"sample-gap\"}", 1.0),
        ("didim_recording", 1.0),
        ("didim_recording_ring_bytes", 800_000.0),
        ("didim_recording_oldest_seconds", 61.5),
        ("didim_recording_frames_unrecorded_total", 2.0),
        ("didim_kept_recordings", 7.0),
        ("didim_kept_recordings_failures_total", 1.0),
        ("didim_capture_running", 1.0),
        ("didim_drift_compared", 1.0),
        ("didim_drift_band_share_ratio{parameter=\"zz1r\"}", 2.5),
        ("didim_drift_relative_change_ratio{parameter=\"zz1r\"}", 0.25),
        ("didim_drift_alarm{parameter=\"zz1r\"}", 1.0),
        ("didim_estimate_applicable", 1.0),
        ("didim_estimate_relative_error_ratio", 0.0564),
        ("didim_estimate_parameter{parameter=\"zz1r\",method=\"idim-ls\"}", 1.28),
        // With the name of the joint where the arm has one.
        (
            "didim_estimate_parameter{parameter=\"fc1\",method=\"idim-ls\",\
                description=\"Coulomb friction of joint 1, `waist`\"}",
            -7.15,
        ),
    ] {
        assert_eq!(samples.get(name), Some(&value), "{name} in\n{text}");
    }
    let p99 = samples["didim_frame_to_buffer_seconds{quantile=\"0.99\"}"];
    assert!((p99 - 53e-6).abs() < 1e-12, "{p99}");
    let unknown = samples.iter().find(|(name, _)| {
        name.starts_with("didim_estimate_parameter_standard_deviation{parameter=\"fc1\"")
    });
    assert!(unknown.unwrap().1.is_nan());
    assert!(!samples.contains_key("didim_estimate_condition_number"), "it is not finite");
}

#[test]
fn every_family_is_described_once_and_named_by_the_rules() {
    let text = metrics_text(Some(&snapshot()));
    let mut kinds = BTreeMap::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some(help) = line.strip_prefix("# HELP ") {
            let (name, help) = help.split_once(' ').unwrap();
            assert!(!help.is_empty());
            let kind = lines.next().unwrap().strip_prefix(&format!("# TYPE {name} ")).unwrap();
            assert!(kinds.insert(name, kind).is_none(), "{name} twice");
            assert!(name.starts_with("didim_"), "{name}");
            assert_eq!(kind == "counter", name.ends_with("_total"), "{name}");
            for unit in ["_ns", "_ms", "_us", "_percent", "_s", "_mb"] {
                assert!(!name.ends_with(unit), "{name} is in no base unit");
            }
        }
    }
    assert!(kinds.len() > 40, "{}", kinds.len());
}

#[test]
fn labels_are_bounded() {
    let mut snapshot = snapshot();
    let unused = &mut snapshot.acquisition.as_mut().unwrap().frames_unused;
    unused.extend((0..1000u32).map(|k| (format!("cause{k}"), 1)));
    let text = metrics_text(Some(&snapshot));
    let unused_lines = text.lines().filter(|line| line.starts_with("didim_frames_unused_total{"));
    assert_eq!(unused_lines.count(), MAX_LABELS);
}

/// The checker of Prometheus itself.
#[test]
#[ignore = "needs promtool (Debian: prometheus): tests/run"]
fn promtool_finds_nothing() {
    for snapshot in [Some(snapshot()), None] {
        let checked = Command::new("promtool")
            .args(["check", "metrics"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let mut promtool = checked.unwrap();
        let text = metrics_text(snapshot.as_ref());
        promtool.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        let output = promtool.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{said}\n{text}");
    }
}

/// What is shipped for Prometheus and Grafana, read by the checker: alerts with their tests,
/// queries of dashboards.
#[test]
#[ignore = "needs promtool (Debian: prometheus): tests/run"]
fn promtool_reads_alerts_and_queries() {
    fn promtool(arguments: &[&str]) {
        let output = Command::new("promtool").args(arguments).output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&said));
    }
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config");
    promtool(&["test", "rules", config.join("prometheus/didim-alerts.test.yml").to_str().unwrap()]);
    let mut rules = "groups: [{name: didim, rules: [".to_owned();
    for name in ["cabinet", "plant"] {
        let text = std::fs::read(config.join(format!("grafana/{name}.json"))).unwrap();
        let dashboard: serde_json::Value = serde_json::from_slice(&text).unwrap();
        let panels = dashboard["panels"].as_array().unwrap();
        for target in panels.iter().flat_map(|panel| panel["targets"].as_array().unwrap()) {
            // What Grafana puts in; the rest is a name to Prometheus.
            let query = target["expr"].to_string().replace("$__rate_interval", "5m");
            rules += &format!("{{record: \"didim:{}\", expr: {query}}},\n", rules.len());
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("queries.yml");
    std::fs::write(&file, rules + "]}]\n").unwrap();
    promtool(&["check", "rules", file.to_str().unwrap()]);
}

/// A server in this process, with these limits.
fn server(limits: Limits) -> SocketAddr {
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let ready = move |address| sender.send(address).unwrap();
        let any = "127.0.0.1:0".parse().unwrap();
        runtime
            .block_on(serve(any, limits, ready, || "didim_up 1\n".to_owned()))
            .map(|never| match never {})
    });
    receiver.recv_timeout(Duration::from_secs(10)).unwrap()
}

fn ask(address: SocketAddr, request: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    // A server that has heard enough may close before all is written.
    let _ = stream.write_all(request.as_bytes());
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    answer
}

fn get(address: SocketAddr, path: &str) -> String {
    ask(address, &format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"))
}

#[test]
fn only_the_metrics_are_reported() {
    let address = server(Limits::default());
    let answer = get(address, "/metrics");
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
    assert!(answer.contains("content-type: text/plain; version=0.0.4"), "{answer}");
    assert!(answer.ends_with("\r\n\r\ndidim_up 1\n"), "{answer}");
    assert!(get(address, "/").starts_with("HTTP/1.1 404"));
    assert!(get(address, "/metrics/../etc/passwd").starts_with("HTTP/1.1 404"));
    let post =
        ask(address, "POST /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 3\r\n\r\nabc");
    assert!(post.starts_with("HTTP/1.1 405") && post.contains("allow: GET"), "{post}");
    assert!(ask(address, "nonsense\r\n\r\n").starts_with("HTTP/1.1 400"));
    let long = format!("GET /metrics HTTP/1.1\r\nX: {}\r\n\r\n", "x".repeat(100_000));
    assert!(!ask(address, &long).contains("200 OK"));
    let many = format!("GET /metrics HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(500));
    assert!(!ask(address, &many).contains("200 OK"));
    // And goes on.
    assert!(get(address, "/metrics").contains("200 OK"));
}

#[test]
fn slow_clients_lose_their_place() {
    let limits = Limits { clients: 2, time: Duration::from_secs(10) };
    let address = server(limits);
    let start = Instant::now();
    let mut slow: Vec<TcpStream> = (0..2).map(|_| TcpStream::connect(address).unwrap()).collect();
    slow.iter_mut().for_each(|client| client.write_all(b"GET /metr").unwrap());
    std::thread::sleep(Duration::from_millis(100));
    // The oldest one gives its place up, at once.
    Expectation::of("clients-of-the-metrics").assert_said(&get(address, "/metrics"), &[]);
    let mut answer = String::new();
    slow[0].set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let _ = slow[0].read_to_string(&mut answer);
    assert!(!answer.contains("200 OK"), "{answer}");
    assert!(start.elapsed() < limits.time, "{:?}", start.elapsed());
    // The other one until its time is over.
    slow[1].set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let _ = slow[1].read_to_string(&mut answer);
    assert!(start.elapsed() >= limits.time && !answer.contains("200 OK"), "{answer}");
}

fn status_by_host(address: SocketAddr, host: &str) -> String {
    let answer = ask(address, &format!("GET /metrics HTTP/1.1\r\nHost: {host}\r\n\r\n"));
    answer.split(' ').nth(1).unwrap_or_default().to_owned()
}

#[test]
fn a_local_server_answers_to_no_other_name() {
    let address = server(Limits::default());
    for own in ["127.0.0.1:9752", "localhost", "LOCALHOST:9752", "[::1]:9752", "10.0.0.7"] {
        assert_eq!(status_by_host(address, own), "200", "{own}");
    }
    for other in ["attacker.example", "localhost.attacker.example:9752", "127.0.0.1.example", "a b"]
    {
        let status: String = Expectation::of("metrics-by-another-name").get("status");
        assert_eq!(status_by_host(address, other), status, "{other}");
    }
}

/// The program, ended with the test.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

type Lines = std::io::Lines<BufReader<std::process::ChildStderr>>;

/// Starts `didim metrics` on any port; gives the address that it tells, and what it tells then.
fn program(runtime: &Path) -> (Program, SocketAddr, Lines) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["metrics", "--listen", "127.0.0.1:0", "--runtime"])
        .arg(runtime)
        .env_remove("RUST_LOG")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let program = Program(child);
    let printed_line = lines.find_map(|line| {
        let line = line.unwrap();
        println!("{line}");
        let (_, rest) = line.split_once("http://")?;
        rest.split_once("/metrics").map(|(address, _)| address.parse().unwrap())
    });
    (program, printed_line.unwrap(), lines)
}

#[test]
fn a_service_that_is_away_is_reported_and_one_that_comes_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let (mut program, address, lines) = program(folder.path());
    get(address, "/metrics");
    let away = get(address, "/metrics");
    assert!(away.starts_with("HTTP/1.1 200 OK"), "{away}");
    let (_, body) = away.split_once("\r\n\r\n").unwrap();
    assert_eq!(samples(body).get("didim_up"), Some(&0.0), "{body}");
    assert!(samples(body).keys().any(|name| name.starts_with("didim_build_info{version=")));
    assert!(!body.contains("didim_samples_total"), "{body}");

    let listener = UnixListener::bind(folder.path().join("status.sock")).unwrap();
    std::thread::spawn(move || {
        for client in listener.incoming() {
            client.unwrap().write_all(STATUS.as_bytes()).unwrap();
        }
    });
    let metrics = get(address, "/metrics");
    let (_, body) = metrics.split_once("\r\n\r\n").unwrap();
    assert_eq!(body, metrics_text(Some(&snapshot())));

    // It stops when asked to.
    let pid = i32::try_from(program.0.id()).unwrap();
    rustix::process::kill_process(
        rustix::process::Pid::from_raw(pid).unwrap(),
        rustix::process::Signal::TERM,
    )
    .unwrap();
    assert!(program.0.wait().unwrap().success());
    let messages: Vec<String> = lines.map(Result::unwrap).collect();
    assert_eq!(messages.len(), 2, "reported when it changes, not at every scrape: {messages:#?}");
    assert!(
        messages[0].contains("does not answer") && messages[1].contains("answers again"),
        "{messages:#?}"
    );
}

#[test]
fn an_address_in_use_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["metrics", "--listen", &address])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(&address) && said.contains("--listen"), "{said}");
}
