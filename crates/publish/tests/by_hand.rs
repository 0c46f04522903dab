//! What many cabinets of one machine cost: run by hand, for the record of docs/evidence/plant.md.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::plant::broker::Broker;
use crate::plant::cabinet::Cabinet;
use crate::plant::consumer::Consumer;
use crate::plant::program::Program;

/// A broker that does not write all that it has with each message.
const IN_MEMORY: &str = "allow_anonymous true\nmax_queued_messages 0\nautosave_on_changes \
    false\nautosave_interval 1800";

fn number(variable: &str, usual: u32) -> u32 {
    std::env::var(variable).map_or(usual, |text| text.parse().unwrap())
}

/// Seconds of processor time and megabytes of memory of a process (proc_pid_stat(5),
/// proc_pid_status(5)).
fn cost(process: u32) -> (f64, f64) {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split_whitespace().collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    let kilobytes: f64 = resident.trim().trim_end_matches(" kB").trim().parse().unwrap();
    (ticks / 100.0, kilobytes / 1024.0)
}

/// `DIDIM_CABINETS=200 DIDIM_SECONDS=300 cargo test -p didim-publish -- --ignored many`:
/// each has a result every 10 s.
#[test]
#[ignore = "by hand (docs/evidence/plant.md)"]
fn many_cabinets_of_one_machine() {
    let folder = tempfile::tempdir().unwrap();
    let broker = Broker::start(IN_MEMORY);
    let consumer = Consumer::new(broker.port);
    let mut cabinets: Vec<_> =
        (1..=number("DIDIM_CABINETS", 200)).map(|k| Cabinet::new(folder.path(), k)).collect();
    let address = format!("address = \"127.0.0.1:{}\"", broker.port);
    let program = Program::start(folder.path(), &address, &cabinets);
    cabinets.iter().for_each(|cabinet| consumer.is_online(&cabinet.name, true));
    let (start, before) = (Instant::now(), [cost(program.id()), cost(broker.id())]);
    let seconds = Duration::from_secs(number("DIDIM_SECONDS", 300).into());
    let mut round = 0;
    while start.elapsed() < seconds {
        for cabinet in &mut cabinets {
            cabinet.store(1);
            cabinet.alarm(None);
        }
        round += 1;
        std::thread::sleep(
            (start + round * Duration::from_secs(10)).saturating_duration_since(Instant::now()),
        );
    }
    let (elapsed, after) = (start.elapsed().as_secs_f64(), [cost(program.id()), cost(broker.id())]);
    cabinets.iter().for_each(|cabinet| consumer.has(&cabinet.name, &cabinet.stored));
    println!("{} cabinets, {elapsed:.0} s", cabinets.len());
    for (name, before, after) in
        [("didim-publish", before[0], after[0]), ("mosquitto", before[1], after[1])]
    {
        println!(
            "{name}: {:.2} % of a processor, {:.0} MB",
            100.0 * (after.0 - before.0) / elapsed,
            after.1
        );
    }
    for kind in ["state", "drift", "alarm", "result"] {
        let heard = consumer.heard_on(&format!("/{kind}"));
        let bytes: usize = heard.iter().map(|of| of.json.to_string().len()).sum();
        println!("{kind}: {} messages, {} bytes each", heard.len(), bytes / heard.len().max(1));
    }
    let stored: usize = cabinets.iter().map(|cabinet| cabinet.stored.len()).sum();
    assert_eq!(
        consumer.heard_on("/result").len(),
        stored,
        "nothing comes twice where nothing breaks"
    );
}

/// A length of two bytes.
fn short(bytes: usize) -> [u8; 2] {
    u16::try_from(bytes).unwrap().to_be_bytes()
}

/// CONNECT of MQTT 5 with a retained last will (3.1): no user, no properties.
fn connect(client: &str, topic: &str, will: &str) -> Vec<u8> {
    let text = |text: &str| [&short(text.len())[..], text.as_bytes()].concat();
    let head = [&text("MQTT")[..], &[5, 0b0010_1110, 0, 60, 0]].concat();
    let rest = [text(client), vec![0], text(topic), text(will)].concat();
    let length = head.len() + rest.len();
    let (low, high) =
        (u8::try_from(length % 128 + 128).unwrap(), u8::try_from(length / 128).unwrap());
    [&[0x10, low, high], &head[..], &rest].concat()
}

/// `ulimit -n 30000; cargo test -p didim-publish -- --ignored --nocapture many_clients`: how many a
/// broker takes, each with a last will. `BROKER_FILES=1024` gives it no more descriptors than
/// services have by default.
#[test]
#[ignore = "by hand (docs/evidence/plant.md)"]
fn many_clients_of_one_broker() {
    let mut broker = Broker::start(IN_MEMORY);
    if let Ok(files) = std::env::var("BROKER_FILES") {
        broker.kill();
        broker.start_again_with_files(&files);
    }
    let start = Instant::now();
    let before = cost(broker.id());
    let mut clients = Vec::new();
    for k in 0..10_000 {
        let (client, will) = (format!("didim/cabinet-{k}"), "x".repeat(120));
        let connected = TcpStream::connect(("127.0.0.1", broker.port)).and_then(|mut stream| {
            stream.write_all(&connect(&client, &format!("{client}/state"), &will))?;
            let mut answer = [0; 4];
            stream.read_exact(&mut answer)?;
            // CONNACK, and Success.
            Ok((answer[0] == 0x20 && answer[3] == 0).then_some(stream))
        });
        clients.extend(connected.ok().flatten());
    }
    let (seconds, after) = (start.elapsed().as_secs_f64(), cost(broker.id()));
    println!(
        "{} clients in {seconds:.1} s, {:.2} s of its processor, {:.0} MB",
        clients.len(),
        after.0 - before.0,
        after.1
    );
    assert!(clients.len() > 900);
}
