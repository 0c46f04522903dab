//! What many cabinets of one machine cost: run by hand, for the record of docs/plant.md.

use std::fs;
use std::time::{Duration, Instant};

use crate::plant::broker::Broker;
use crate::plant::cabinet::Cabinet;
use crate::plant::consumer::Consumer;
use crate::plant::program::Program;

fn number(variable: &str, usual: u32) -> u32 {
    std::env::var(variable).map_or(usual, |text| text.parse().unwrap())
}

/// Seconds of processor time and megabytes of memory of a process (proc_pid_stat(5), proc_pid_status(5)).
fn cost(process: u32) -> (f64, f64) {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split_whitespace().collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    let kilobytes: f64 = resident.trim().trim_end_matches(" kB").trim().parse().unwrap();
    (ticks / 100.0, kilobytes / 1024.0)
}

/// `DIDIM_CABINETS=200 DIDIM_SECONDS=300 cargo test -p didim-publish -- --ignored --nocapture many_cabinets`: each has a
/// result every 10 s.
#[test]
#[ignore = "by hand (docs/plant.md)"]
fn many_cabinets_of_one_machine() {
    let folder = tempfile::tempdir().unwrap();
    let broker = Broker::start(
        "allow_anonymous true\nmax_queued_messages 0\nautosave_on_changes false\nautosave_interval 1800",
    );
    let consumer = Consumer::new(broker.port);
    let mut cabinets: Vec<_> =
        (1..=number("DIDIM_CABINETS", 200)).map(|k| Cabinet::new(folder.path(), k)).collect();
    let at = format!("address = \"127.0.0.1:{}\"", broker.port);
    let program = Program::start(folder.path(), &at, &cabinets);
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
        let heard = consumer.on(&format!("/{kind}"));
        let bytes: usize = heard.iter().map(|of| of.json.to_string().len()).sum();
        println!("{kind}: {} messages, {} bytes each", heard.len(), bytes / heard.len().max(1));
    }
    let stored: usize = cabinets.iter().map(|cabinet| cabinet.stored.len()).sum();
    assert_eq!(consumer.on("/result").len(), stored, "nothing comes twice where nothing breaks");
}
