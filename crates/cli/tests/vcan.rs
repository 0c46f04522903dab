//! The daemon on a real virtual CAN bus: the sender in one process, the service in others, and a
//! witness that hears everything.
//!
//! Needs an interface named by `DIDIM_VCAN` (as in `DIDIM_VCAN=vcan0,vcan1`), up, with the MTU of
//! CAN FD, and the right to take it down and to have 4 MiB of receive buffer.
//!
//! A bus in real time needs a machine that keeps up. The witness's stamps, the sender's clock or a
//! receive buffer that overflowed show whether this one did. If it did not, consequences of lost
//! time do not count against the service: the test tries again. What does not depend on time is
//! judged every time. A machine that is late every time fails, and the failure says so.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::common::Process;
use crate::common::expectation::Expectation;
use crate::program::recording::{EXPECTED, datasets, rounding, write_csv};
use crate::program::{
    AT_1_KHZ, Daemon, Finished, Installation, command, didim, difference, json, parameters,
    results, succeed,
};
use didim::live::acquire::{AcquisitionStatus, BusState, FrameTime};
use didim::live::worker::{EstimationStatus, WindowState};
use didim::service::status::Snapshot;
use didim_drivers::frame::Frame;
use didim_drivers::source::mcap::{FileEnd, McapScan};
use didim_drivers::source::{
    CandumpWriter, InterfaceName, McapSource, Received, SocketCanOptions, SocketCanSource, Source,
    StampDigits, TextLog,
};
use didim_sim::{Sink, SocketCanSink};
use serde_json::Value;

mod arms;

const PACKED: &str = "tx40-packed-fd";
/// As in the cell files.
const RECEIVE_BUFFER_BYTES: u64 = 4 << 20;

/// The machine did not keep time, in words.
struct Late(String);

/// What the service has in shared memory.
fn in_shared_memory() -> Vec<String> {
    let mut names = names(Path::new("/dev/shm"));
    names.retain(|name| name.starts_with("didim_"));
    names
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

/// What a test before left that had failed, and whose service was killed.
static LEFT_BEFORE: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Runs a test on the interface, and again while the machine was late.
fn in_time(test: impl Fn(&str) -> Result<(), Late>) {
    let interface = crate::common::bus::vcan();
    let mut late = Vec::new();
    for _ in 0..4 {
        *LEFT_BEFORE.lock().unwrap() = in_shared_memory();
        let Err(Late(what)) = test(&interface) else { return };
        println!("once more: {what}");
        late.push(what);
    }
    panic!("late: this machine does not keep the time of a bus: {}", late.join("; "));
}

/// After a second of silence the service takes the device for started anew. Delays that follow each
/// other add up, so that half of it is asked for.
fn no_pause(longest: Duration) -> Result<(), Late> {
    if longest < Duration::from_millis(500) {
        return Ok(());
    }
    Err(Late(format!("the sender paused for {longest:?}")))
}

/// What the witness's stamps say: no pause.
fn kept_time(heard: &[Frame]) -> Result<(), Late> {
    let pauses = heard.windows(2).map(|two| two[1].stamp_ns.saturating_sub(two[0].stamp_ns));
    no_pause(Duration::from_nanos(pauses.max().unwrap_or(0)))
}

/// A shipped cell on the interface, changed otherwise too. Its frames count its cycles: the guest's
/// one processor takes up to twice the bus's time for them, which is no property of a bus.
fn installation(cell: &str, interface: &str, changes: &[(&str, &str)]) -> Installation {
    let source = format!("\"can:{interface}\"");
    let usual =
        [("\"can:vcan0\"", source.as_str()), ("axes = 6", "axes = 6\ncycles_by = \"frames\"")];
    Installation::from_cell(cell, &[&usual, changes].concat())
}

/// The packed cell on the interface with 1000 samples a second, for what does not depend on the
/// rate.
fn slower(interface: &str, changes: &[(&str, &str)]) -> Installation {
    installation(PACKED, interface, &[&AT_1_KHZ, changes].concat())
}

/// A socket of its own that hears every frame, error frames too.
struct Witness {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<(Vec<Frame>, SocketCanSource)>>,
}

impl Witness {
    fn listen(interface: &str) -> Self {
        let name = [InterfaceName::new(interface).unwrap()];
        let options =
            SocketCanOptions { receive_buffer_bytes: 16 << 20, ..SocketCanOptions::default() };
        let mut source = SocketCanSource::open(&name, &options).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut heard: Vec<Frame> = Vec::with_capacity(150_000);
            let mut batch: Vec<Frame> = Vec::with_capacity(256);
            loop {
                batch.clear();
                let received = source.receive(&mut batch, Duration::from_millis(50));
                heard.extend(&batch);
                let silent = !matches!(received, Ok(Received::Frames));
                if stopped.load(Ordering::Relaxed) && silent {
                    return (heard, source);
                }
            }
        });
        Self { stop, thread: Some(thread) }
    }

    /// What it heard, if it heard everything.
    fn report(mut self) -> Result<Vec<Frame>, Late> {
        self.stop.store(true, Ordering::Relaxed);
        let (heard, source) = self.thread.take().unwrap().join().unwrap();
        match source.counters().queue_drops {
            0 => Ok(heard),
            drops => Err(Late(format!("the witness missed {drops} frames"))),
        }
    }
}

impl Drop for Witness {
    /// A test that failed must not burden the next one.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Frames as a candump log.
fn write_log(frames: &[Frame], path: &Path) {
    let file = std::io::BufWriter::new(fs::File::create(path).unwrap());
    let name = [InterfaceName::new("can0").unwrap()];
    let mut writer = CandumpWriter::new(file, &name, StampDigits::Nanoseconds);
    frames.iter().for_each(|frame| writer.write(frame).unwrap());
    writer.finish().unwrap();
}

fn read_log(path: &Path) -> Vec<Frame> {
    let mut source = TextLog::open(path, &[]).unwrap();
    let mut frames = Vec::new();
    let mut batch = Vec::with_capacity(4096);
    while source.receive(&mut batch, Duration::ZERO).unwrap() == Received::Frames {
        frames.extend(&batch);
        batch.clear();
    }
    frames
}

/// `didim sim` on the interface.
fn sender(cell: &Installation, interface: &str, more: &[&str]) -> Command {
    let bus = format!("can:{interface}");
    let mut sender = command(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus]);
    sender.args(more);
    sender
}

/// Plays a scenario to its end; the bus cycles and frames it says it sent.
fn play(cell: &Installation, interface: &str, scenario: &Path) -> (u64, u64) {
    let output = sender(cell, interface, &["--scenario", scenario.to_str().unwrap()])
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success());
    let output_text = String::from_utf8(output.stdout).unwrap();
    println!("{}", output_text.trim());
    fn number(before: &str, output_text: &str) -> u64 {
        let (text, _) = output_text.split_once(before).unwrap();
        text.split(' ').next_back().unwrap().parse().unwrap()
    }
    (number(" bus cycles", &output_text), number(" frames", &output_text))
}

/// What became of frames that were sent.
#[derive(Default)]
struct Sent {
    /// Those that the interface did not take.
    refused: Vec<usize>,
    /// By how much the longest time between two that it took was longer than theirs.
    pause: Duration,
}

/// Sends frames at the pace of their stamps; `before` runs before each.
fn send(interface: &str, frames: &[Frame], mut before: impl FnMut(usize)) -> Sent {
    let mut sink = SocketCanSink::open(interface).unwrap();
    let mut sent = Sent::default();
    let start = Instant::now();
    let mut last = Duration::ZERO;
    for (index, frame) in frames.iter().enumerate() {
        before(index);
        let due = Duration::from_nanos(frame.stamp_ns - frames[0].stamp_ns);
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        if sink.send(frame).is_err() {
            sent.refused.push(index);
            continue;
        }
        let late = start.elapsed().saturating_sub(due);
        sent.pause = sent.pause.max(late.saturating_sub(last));
        last = late;
    }
    sent
}

/// Takes the link up or down, without waiting for it.
fn set_link(interface: &str, state: &str) -> Process {
    Command::new("ip").args(["link", "set", interface, state]).spawn().map(Process).unwrap()
}

/// Frames for which the service had no room. It has room for a second of them: who drops any, was
/// away for longer.
fn dropped(status: &Snapshot) -> u64 {
    status.acquisition.as_ref().map_or(0, |bus| bus.counters.queue_drops)
}

/// Waits until the status is so, or cannot become so because the machine was late.
fn until(
    daemon: &Daemon,
    what: &str,
    condition: impl Fn(&Snapshot) -> bool,
) -> Result<Snapshot, Late> {
    let status = daemon.eventually(what, |status| condition(status) || dropped(status) > 0);
    match dropped(&status) {
        0 => Ok(status),
        frames => Err(Late(format!("the service was away while {frames} frames came"))),
    }
}

fn bus(status: &Snapshot) -> &AcquisitionStatus {
    status.acquisition.as_ref().unwrap()
}

fn work(status: &Snapshot) -> &EstimationStatus {
    status.estimation.as_ref().unwrap()
}

fn total(counts: &BTreeMap<String, u64>) -> u64 {
    counts.values().sum()
}

/// So many windows are dealt with, and nothing waits, not even a recording to be archived.
fn has_settled(status: &Snapshot, windows: u64) -> bool {
    let work = work(status);
    let archived = work.kept_recordings.as_ref().is_none_or(|archive| {
        archive.waiting == 0 && archive.fixed + archive.failed >= work.windows_identified
    });
    work.windows_identified + total(&work.windows_rejected) >= windows
        && work.windows_pending == 0
        && archived
}

/// Ends the daemon as a service manager does.
fn end(mut daemon: Daemon) -> Result<(), Late> {
    let (code, took) = daemon.terminate();
    let log = daemon.log();
    assert_eq!(code, Some(0), "{log}");
    if log.contains("is abandoned") {
        return Err(Late("a thread did not end in time".to_owned()));
    }
    if took < Duration::from_secs(1) { Ok(()) } else { Err(Late(format!("SIGTERM took {took:?}"))) }
}

/// No socket is left, and nothing in shared memory.
fn assert_nothing_left(cell: &Installation) {
    let mut leftovers = names(&cell.runtime());
    leftovers.retain(|name| name.contains(".sock"));
    assert_eq!(leftovers, Vec::<String>::new());
    let mut leftovers = in_shared_memory();
    leftovers.retain(|name| !LEFT_BEFORE.lock().unwrap().contains(name));
    assert_eq!(leftovers, Vec::<String>::new());
}

/// The results of `didim replay` on a log.
fn replay(cell: &Installation, log: &Path) -> Vec<String> {
    let state = cell.path("replayed");
    succeed(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &state]);
    results(&state)
}

/// The files of a folder in the cell's recordings, by name.
fn recordings(cell: &Installation, folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(cell.state().join("recordings").join(folder)).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Every frame of recordings that have to be whole.
fn read_recordings(files: &[PathBuf]) -> Vec<Frame> {
    let mut frames = Vec::new();
    for file in files {
        let mut source = McapSource::open(file, &[]).unwrap();
        while let Some(frame) = source.next_frame().unwrap() {
            frames.push(frame);
        }
        assert_eq!(source.file_end(), Some(FileEnd::Finished), "{}", file.display());
        assert_eq!(source.counters().queue_drops, 0);
    }
    frames
}

/// The recording of a result is replayed to its very bytes.
fn kept_is_replayed_to_the_same_bytes(cell: &Installation, number: usize) {
    let archived = cell.state().join(format!("recordings/kept/result-{number:08}.mcap"));
    assert!(archived.is_file(), "{:?}", recordings(cell, "kept"));
    let state = cell.path(&format!("replayed-{number}"));
    succeed(&[&"replay", &"--cell", &cell.cell(), &archived, &"--state", &state]);
    assert_eq!(
        results(&state),
        [results(&cell.state())[number].as_str()],
        "{}",
        archived.display()
    );
}

/// What was heard is what is in the ring: bytes, order, and the time of day.
fn the_ring_has(cell: &Installation, heard: &[Frame]) {
    let files = recordings(cell, "ring");
    let recorded = read_recordings(&files);
    let bytes = |frame: &Frame| (frame.id, frame.kind, frame.length, frame.payload);
    assert!(recorded.iter().map(bytes).eq(heard.iter().map(bytes)), "{}", recorded.len());
    let scan = McapScan::read(&files[0]).unwrap();
    let info = scan.info.unwrap();
    let day = Duration::from_nanos(info.log_time(recorded[0].stamp_ns));
    let difference = day.abs_diff(Duration::from_nanos(heard[0].stamp_ns));
    assert!(difference < Duration::from_millis(10), "{difference:?}");
}

/// One window and silence, then the end of the service, of which nothing is left: its last status,
/// and what was heard.
fn to_silence(
    daemon: Daemon,
    cell: &Installation,
    witness: Witness,
) -> Result<(Snapshot, Vec<Frame>), Late> {
    let status = until(&daemon, "one window, and silence", |status| {
        has_settled(status, 1) && bus(status).bus == BusState::Silent
    })?;
    end(daemon)?;
    assert_nothing_left(cell);
    Ok((status, witness.report()?))
}

/// The sender says what it sent; the witness has heard that and nothing else; the daemon accounts
/// for every sample; and its result is the one of a replay of what the witness heard.
fn everything_is_accounted_for(name: &str, method: &str, interface: &str) -> Result<(), Late> {
    let cell = installation(name, interface, &[]);
    let witness = Witness::listen(interface);
    let daemon = Daemon::start(&cell, None);
    // The motion of 6.8 s between rests.
    let (cycles, frames) = play(&cell, interface, &cell.scenario(&[]));
    let (status, heard) = to_silence(daemon, &cell, witness)?;

    // Whatever the time: every frame is received, and there is none but the sender's.
    let (bus, work) = (bus(&status), work(&status));
    assert_eq!(heard.len() as u64, frames, "frames that the sender did not send");
    assert!(!heard.iter().any(Frame::is_error));
    assert!(bus.receive_buffer_bytes >= Some(RECEIVE_BUFFER_BYTES), "{bus:#?}");
    assert_eq!(
        (bus.frames, bus.counters.queue_drops, bus.counters.error_frames),
        (frames, 0, 0),
        "{bus:#?}"
    );
    assert_eq!(work.samples, bus.samples);
    let (written, taken) = (bus.frame_to_buffer.unwrap(), work.buffer_to_worker.unwrap());
    assert_eq!(written.from, FrameTime::Stamp);
    let written = written.times;
    assert_eq!(taken.count, bus.samples);
    // Where the bus has SYNCs, cycles before a pause are decided by silence and not by a frame.
    let by_frames = if name == PACKED { bus.samples } else { 1 };
    assert!((by_frames..=bus.samples).contains(&written.count), "{written:?}");
    // The kernel's stamp, mapped to the clock of the service, lies before that.
    assert!(written.p50_ns > 0 && written.max_ns < 60_000_000_000, "{written:?}");

    kept_time(&heard)?;
    assert_eq!(bus.samples + total(&bus.cycles_lost), cycles, "{bus:#?}");
    assert_eq!((work.windows_opened, work.windows_identified), (1, 1), "{work:#?}");
    let log = cell.path("heard.log");
    write_log(&heard, &log);
    let live = results(&cell.state());
    let replayed = undated(&replay(&cell, &log));
    assert_eq!(undated(&live), replayed, "the daemon's results, and those of the replay");
    the_ring_has(&cell, &heard);
    kept_is_replayed_to_the_same_bytes(&cell, 0);
    let result = json(&live[0]);
    assert_eq!(result["estimate"]["verdict"]["applicable"], true, "{result}");
    assert_eq!(result["estimate"]["method"], method);
    Ok(())
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn packed_frames_at_5_khz_are_accounted_for_and_identified_as_offline() {
    in_time(|interface| everything_is_accounted_for(PACKED, "idim-ls", interface));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn cia_402_at_500_hz_is_accounted_for_and_identified_as_offline() {
    in_time(|interface| everything_is_accounted_for("tx40-cia402", "didim", interface));
}

/// `didim run` as [`Daemon::start`] calls it, to its end.
fn run_to_the_end(cell: &Installation) -> Finished {
    let (file, state, runtime) = (cell.cell(), cell.state(), cell.runtime());
    didim(&[&"run", &"--cell", &file, &"--state", &state, &"--runtime", &runtime])
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn on_a_silent_bus_the_daemon_is_silent_and_lets_no_second_one_in() {
    in_time(|interface| {
        let cell = slower(interface, &[]);
        let witness = Witness::listen(interface);
        let daemon = Daemon::start(&cell, None);
        let second = run_to_the_end(&cell);
        assert_eq!(second.code, Some(1), "{second:?}");
        let refusal = "status.sock is in use by a running service";
        assert!(second.stderr.contains(refusal), "{second:?}");
        std::thread::sleep(Duration::from_secs(2));
        let status = daemon.status().unwrap();
        assert_eq!((bus(&status).bus, bus(&status).frames), (BusState::Waiting, 0));
        assert_eq!(status.health.reasons, ["no frame has come yet"]);
        end(daemon)?;
        assert_nothing_left(&cell);
        assert_eq!(witness.report()?, []);
        Ok(())
    });
}

/// The simulated arm's frames, without a bus.
fn frames_of_the_arm(cell: &Installation) -> Vec<Frame> {
    let log = cell.path("arm.log");
    let bus = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus]);
    read_log(&log)
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_link_that_goes_down_costs_the_window_and_no_other() {
    in_time(|interface| {
        let cell = slower(interface, &[]);
        let frames = frames_of_the_arm(&cell);
        let daemon = Daemon::start(&cell, None);
        // Down for about 0.2 s, 1.2 s after the motion began. The arm does not wait for it.
        let mut changes = Vec::new();
        let sent = send(interface, &frames, |index| match index {
            1_700 => changes.push(set_link(interface, "down")),
            1_900 => changes.push(set_link(interface, "up")),
            _ => {}
        });
        let status = until(&daemon, "two windows, and silence", |status| {
            has_settled(status, 2) && bus(status).bus == BusState::Silent
        })?;
        end(daemon)?;
        assert_nothing_left(&cell);
        let (bus, work) = (bus(&status), work(&status));
        let (down, up) = (sent.refused[0], sent.refused[sent.refused.len() - 1] + 1);
        assert_eq!(sent.refused, (down..up).collect::<Vec<usize>>());
        let lost_cycles = (up - down) as u64;
        let expected = Expectation::of("interface-down");
        assert_eq!(
            (bus.counters.link_down, bus.counters.reopened, bus.counters.queue_drops),
            (expected.get("link_down"), 0, 0),
            "{bus:#?}"
        );
        assert_eq!(bus.samples, frames.len() as u64 - lost_cycles, "{bus:#?}");
        no_pause(sent.pause)?;
        assert_eq!(bus.cycles_lost, [("counter_gap".to_owned(), lost_cycles)].into(), "{bus:#?}");
        assert_eq!(work.windows_rejected, [(expected.get("windows_rejected"), 1)].into());
        let rejected = work.last_rejection.clone().unwrap();
        assert_eq!((rejected.number, rejected.last_sequence), (0, down as u64 - 1));
        let faults = recordings(&cell, "kept");
        let names: Vec<_> = faults.iter().map(|file| file.file_name().unwrap()).collect();
        assert!(names.contains(&"fault-00000000-sample-gap.mcap".as_ref()), "{names:?}");
        kept_is_replayed_to_the_same_bytes(&cell, 0);
        // What is left of the motion is a window of its own, without a sample of before.
        expected.assert_eq("windows_identified", &work.windows_identified);
        let result = json(&results(&cell.state())[0]);
        assert_eq!(result["window"]["first_sequence"], up);
        Ok(())
    });
}

/// The results as values, but for the numbers of their windows: a process that starts anew counts
/// anew.
fn without_number(results: &[String]) -> Vec<Value> {
    let mut values = undated(results);
    values.iter_mut().for_each(|value| drop(value["window"]["number"].take()));
    values
}

/// The results as values, but for when they were recorded: a log tells it by stamps of another
/// clock, or not at all.
fn undated(results: &[String]) -> Vec<Value> {
    results
        .iter()
        .map(|text: &String| {
            let mut value = json(text);
            value["window"].as_object_mut().unwrap().remove("recorded");
            value
        })
        .collect()
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn in_two_processes_the_estimation_may_die_and_come_back() {
    in_time(|interface| {
        let two = ("[service]", "[service]\nprocesses = \"two\"");
        let cell = slower(interface, &[two]);
        let witness = Witness::listen(interface);
        let acquisition = Daemon::start(&cell, Some("acquisition"));
        let estimation = Daemon::start(&cell, Some("estimation"));
        let changes = [("tail_s = 0.6", "tail_s = 10.0"), ("cycles = 1", "cycles = 2")];
        let scenario = cell.scenario(&changes);
        let mut arm = sender(&cell, interface, &["--scenario", scenario.to_str().unwrap()])
            .stdout(Stdio::null())
            .spawn()
            .map(Process)
            .unwrap();
        // The estimation's own status has no bus.
        let away = || acquisition.status().is_some_and(|status| dropped(&status) > 0);
        let one_window = |status: &Snapshot| has_settled(status, 1) || away();
        estimation.eventually("one window", one_window);
        let merged = didim(&[&"status", &"--json", &"--runtime", &cell.runtime()]).stdout;
        estimation.kill();
        let estimation = Daemon::start(&cell, Some("estimation"));
        let restarted_at = bus(&acquisition.status().unwrap()).samples;
        assert!(arm.0.wait().unwrap().success());
        let status = estimation.eventually("another window", one_window);
        until(&acquisition, "the bus", |_| true)?;
        end(estimation)?;
        let bus_status = acquisition.status().unwrap();
        end(acquisition)?;
        assert_nothing_left(&cell);
        let heard = witness.report()?;

        assert_eq!(
            (bus(&bus_status).counters.queue_drops, bus(&bus_status).counters.link_down),
            (0, 0)
        );
        kept_time(&heard)?;
        let merged = json(&merged);
        assert_eq!(merged["estimation"]["windows_identified"], 1, "{merged}");
        assert!(merged["acquisition"]["samples"].as_u64().unwrap() > 7_000, "{merged}");
        // The second motion begins 0.5 s into the second cycle of 17.34 s; its window takes 0.26 s
        // from before.
        if restarted_at > 17_500 {
            return Err(Late(format!("the estimation was away until sample {restarted_at}")));
        }
        let (expected, work) = (Expectation::of("estimator-killed"), work(&status));
        expected.assert_eq("windows_identified", &work.windows_identified);
        let live = results(&cell.state());
        expected.assert_eq("results", &live.len());
        let log = cell.path("heard.log");
        write_log(&heard, &log);
        assert_eq!(without_number(&live), without_number(&replay(&cell, &log)));
        // Recorded by one process, kept by the other.
        kept_is_replayed_to_the_same_bytes(&cell, 1);
        Ok(())
    });
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_daemon_that_is_killed_loses_less_than_a_second_of_its_recording() {
    in_time(|interface| {
        let cell = slower(interface, &[]);
        let frames = frames_of_the_arm(&cell);
        let daemon = Daemon::start(&cell, None);
        let sent = send(interface, &frames[..4_000], |_| {});
        daemon.kill();
        no_pause(sent.pause)?;
        let expected = Expectation::of("acquisition-killed");
        let parts = recordings(&cell, "ring");
        assert!(parts.iter().any(|file| file.extension().is_some_and(|end| end == "part")));
        // The next service closes it before it begins one of its own.
        let daemon = Daemon::start(&cell, None);
        let status = daemon.eventually("the file is closed", |status| {
            let recording = bus(status).recording.as_ref();
            recording
                .is_some_and(|is| is.segments_repaired == expected.get::<u64>("segments_repaired"))
        });
        assert_eq!(bus(&status).recording.as_ref().unwrap().write_errors, 0);
        end(daemon)?;
        let bytes = |frame: &Frame| (frame.id, frame.payload);
        let recorded = read_recordings(&recordings(&cell, "ring"));
        let fewest: usize = expected.get("fewest_frames_of_4000");
        assert!(recorded.len() >= fewest, "{} of 4000 frames", recorded.len());
        assert!(recorded.iter().map(bytes).eq(frames[..recorded.len()].iter().map(bytes)));
        Ok(())
    });
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_capture_begins_and_ends_by_command() {
    in_time(|interface| {
        let cell = slower(interface, &[]);
        let frames = frames_of_the_arm(&cell);
        let daemon = Daemon::start(&cell, None);
        fn capture(words: &[&str], cell: &Installation) -> Result<(), String> {
            let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> = vec![&"capture"];
            arguments.extend(words.iter().map(|word| word as &dyn AsRef<std::ffi::OsStr>));
            let runtime = cell.runtime();
            let ended = didim(&[&arguments[..], &[&"--runtime", &runtime]].concat());
            if ended.code == Some(0) { Ok(()) } else { Err(ended.stderr) }
        }
        assert!(capture(&["stop"], &cell).unwrap_err().contains("no capture is running"));
        let sent = std::thread::scope(|scope| {
            let arm = scope.spawn(|| send(interface, &frames[..5_000], |_| {}));
            until(&daemon, "a second", |status| work(status).samples > 1_000)?;
            capture(&["start", "gripper"], &cell).unwrap();
            assert!(capture(&["start"], &cell).unwrap_err().contains("`gripper` is running"));
            until(&daemon, "three seconds", |status| work(status).samples > 3_000)?;
            capture(&["stop"], &cell).unwrap();
            Ok::<_, Late>(arm.join().unwrap())
        })?;
        until(&daemon, "it is kept", |status| {
            work(status).kept_recordings.as_ref().is_some_and(|archive| archive.fixed >= 1)
        })?;
        end(daemon)?;
        no_pause(sent.pause)?;
        let mut archived = recordings(&cell, "kept");
        archived.retain(|file| file.to_string_lossy().contains("capture"));
        assert!(archived[0].ends_with("capture-00000000-gripper.mcap"), "{archived:?}");
        let captured = read_recordings(&archived);
        assert!(captured.len() >= 1_600, "{}", captured.len());
        Ok(())
    });
}

/// `didim window`, and what it says when it fails.
fn window(cell: &Installation, action: &str) -> Result<(), String> {
    let ended = didim(&[&"window", &action, &"--runtime", &cell.runtime()]);
    if ended.code == Some(0) { Ok(()) } else { Err(ended.stderr) }
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_window_is_opened_and_closed_by_command() {
    in_time(|interface| {
        let trigger = "by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5";
        let cell = slower(interface, &[(trigger, "by = \"command\"")]);
        let frames = frames_of_the_arm(&cell);
        let daemon = Daemon::start(&cell, None);
        assert!(window(&cell, "end").unwrap_err().contains("no window is open"));
        window(&cell, "begin").unwrap();
        assert!(window(&cell, "begin").unwrap_err().contains("open already"));
        let sent = std::thread::scope(|scope| {
            let arm = scope.spawn(|| send(interface, &frames, |_| {}));
            until(&daemon, "the arm moves", |status| work(status).samples > 5_000)?;
            // A gap of samples would have closed it.
            window(&cell, "end").map_err(Late)?;
            assert!(window(&cell, "end").unwrap_err().contains("no window is open"));
            Ok::<_, Late>(arm.join().unwrap())
        })?;
        let status = until(&daemon, "one window", |status| has_settled(status, 1))?;
        end(daemon)?;
        assert_nothing_left(&cell);
        no_pause(sent.pause)?;
        assert_eq!(work(&status).windows_identified, 1, "{:#?}", work(&status));
        kept_is_replayed_to_the_same_bytes(&cell, 0);
        let result = json(&results(&cell.state())[0]);
        let provenance = &result["window"];
        assert_eq!(provenance["end"], "command");
        assert_eq!(provenance["first_sequence"], 0);
        let last = usize::try_from(provenance["last_sequence"].as_u64().unwrap()).unwrap();
        let log = cell.path("window.log");
        write_log(&frames[..=last], &log);
        let offline = [&"identify" as &dyn AsRef<_>, &"--json", &"--cell", &cell.cell()];
        let offline = succeed(&[&offline[..], &[&"--input", &log]].concat());
        assert!(difference(&result["estimate"], &json(&offline)) <= 1e-12);
        Ok(())
    });
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn sigterm_ends_the_daemon_in_the_middle_of_a_motion() {
    in_time(|interface| {
        let cell = slower(interface, &[]);
        let daemon = Daemon::start(&cell, None);
        let mut arm = sender(&cell, interface, &["--repeat"])
            .stdout(Stdio::null())
            .spawn()
            .map(Process)
            .unwrap();
        until(
            &daemon,
            "a motion",
            |status| matches!(work(status).window, WindowState::Open { samples } if samples > 1000),
        )?;
        end(daemon)?;
        assert_nothing_left(&cell);
        // The arm goes on: the daemon was no part of the bus.
        assert!(arm.0.try_wait().unwrap().is_none());
        Ok(())
    });
}

#[test]
#[ignore = "needs a CAN bus and the recording in DIDIM_DATASETS: tests/run"]
fn the_real_recording_on_the_bus_gives_the_known_values() {
    in_time(|interface| {
        let datasets = datasets();
        let cell = installation("tx40-recording", interface, &[]);
        let (csv, log) = (cell.path("tx40.csv"), cell.path("tx40.log"));
        write_csv(&datasets, &csv);
        let file = cell.cell();
        succeed(&[&"convert", &"--cell", &file, &csv, &log, &"--sample-rate", &"5000"]);
        let frames = read_log(&log);
        let daemon = Daemon::start(&cell, None);
        let sent = send(interface, &frames, |_| {});
        let status = until(&daemon, "one window, and silence", |status| {
            has_settled(status, 1) && bus(status).bus == BusState::Silent
        })?;
        end(daemon)?;
        assert_nothing_left(&cell);
        let bus = bus(&status);
        assert_eq!((bus.frames, bus.counters.queue_drops), (45_000, 0), "{bus:#?}");
        no_pause(sent.pause)?;
        assert_eq!((bus.samples, total(&bus.cycles_lost)), (45_000, 0), "{bus:#?}");
        let live = results(&cell.state());
        let replayed = undated(&replay(&cell, &log));
        assert_eq!(undated(&live), replayed, "the daemon's results, and those of the replay");

        let estimate = &json(&live[0])["estimate"];
        let rms = &estimate["rms_error_per_joint_nm"];
        let bound = rounding(&serde_json::from_value::<Vec<f64>>(rms.clone()).unwrap());
        let mut largest = 0.0_f64;
        for ((name, found), (same, value, sigma, ..)) in parameters(estimate).iter().zip(EXPECTED) {
            let deviation = ((found - value) / sigma).abs();
            assert_eq!(name, same);
            assert!(deviation <= bound, "{name}: {deviation} σ, bound {bound} σ");
            largest = largest.max(deviation);
        }
        println!("largest deviation {largest:.1e} σ, bound {bound:.1e} σ");
        Ok(())
    });
}
