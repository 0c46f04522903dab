//! The service on a bus whose frames come at a given rate: the program that `benches/service`
//! starts and observes from outside.
//!
//! The bus is that of the cell: a CAN interface, or `inproc:`. The frames of `inproc:` are stamped
//! with CLOCK_REALTIME when they are sent, as a kernel stamps those of an interface, and dropped
//! when it is full. The frames are one motion of the simulated arm, made before the start and
//! repeated. A thread of this process sends them. At the end one JSON object gives what was sent
//! and the last report of the service.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a benchmark fails by panicking"
)]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Parser;
use didim::analysis::identify::LastIdentification;
use didim::cell::{BusAddress, Cell};
use didim::live::stream::{FOLDER_NAME, Pace, PrivateNetwork};
use didim::service::paths::Paths;
use didim::service::pipeline::{OpenedSource, build_acquisition, build_estimation, open_source};
use didim::service::status::{Snapshot, fetch_status};
use didim::service::supervision::{Parts, ServiceOptions, SocketOptions, run};
use didim_drivers::frame::Frame;
use didim_drivers::source::{
    InProcessSource, InterfaceName, Received, Source, SourceCounters, SourceError, StampClock,
    WhenFull, in_process_bus,
};
use didim_sim::{InProcessSink, Sink, SinkError, SocketCanSink, VirtualDevice};
use rustix::process::{Signal, getpid, kill_process};
use serde_json::json;

/// Frames that the in-process bus holds: a second at 5 kHz, about what the kernel holds in 4 MiB.
const BUS_FRAMES: usize = 5000;
/// Where a packed frame of the shipped cell counts the samples (config/dbc/packed_fd_six_axes.dbc).
const COUNTER_BYTES: std::ops::Range<usize> = 60..64;
/// How long the service may take after the last frame to read what is left.
const DRAIN: Duration = Duration::from_secs(10);

#[derive(Parser)]
struct Arguments {
    /// A cell with packed frames
    #[arg(long, value_name = "FILE")]
    cell: PathBuf,
    /// Frames per second
    #[arg(long, value_name = "HZ")]
    rate: f64,
    /// How long
    #[arg(long, value_name = "S")]
    seconds: f64,
    /// An empty folder for the sockets and the results
    #[arg(long, value_name = "FOLDER")]
    folder: PathBuf,
}

/// An in-process bus whose stamps are the computer's time.
struct Stamped(InProcessSource);

impl Source for Stamped {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        self.0.receive(batch, timeout)
    }

    fn counters(&self) -> SourceCounters {
        self.0.counters()
    }

    fn interfaces(&self) -> &[InterfaceName] {
        self.0.interfaces()
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }
}

/// Stamps what it sends.
struct StampingSink(InProcessSink);

impl Sink for StampingSink {
    fn send(&mut self, frame: &Frame) -> Result<(), SinkError> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        self.0.send(&frame.with_stamp(u64::try_from(now.as_nanos()).unwrap()))
    }
}

/// Both ends of the cell's bus.
fn bus(cell: &Cell) -> (Box<dyn Sink + Send>, OpenedSource) {
    match cell.bus().unwrap().sources.as_slice() {
        [BusAddress::Can(interface)] => {
            let sink = SocketCanSink::open(interface.as_str()).unwrap();
            (Box::new(sink), open_source(cell).unwrap())
        }
        [BusAddress::InProcess] => {
            let name = InterfaceName::new("sim").unwrap();
            let (sender, source) = in_process_bus(&[name], BUS_FRAMES, WhenFull::Drop);
            let source = OpenedSource {
                source: Box::new(Stamped(source)),
                pace: Pace::Live,
                receive_buffer: None,
            };
            (Box::new(StampingSink(InProcessSink::new(sender))), source)
        }
        other => panic!("not a bus to measure: {other:?}"),
    }
}

/// One motion of the arm.
fn motion(cell: &Cell) -> Vec<Frame> {
    let scenario = didim_sim::tx40_paper().unwrap();
    let mut device = VirtualDevice::new(
        &scenario,
        cell.bus().unwrap().layout.clone(),
        cell.bus().unwrap().scales.clone(),
        0,
    )
    .unwrap();
    let mut frames = Vec::with_capacity(usize::try_from(device.cycle_count()).unwrap());
    while device.poll_due().is_some() {
        device.poll_cycle(&mut frames).unwrap();
    }
    frames
}

/// Result of the sender.
#[derive(Debug)]
struct Sent {
    frames: u64,
    seconds: f64,
    latest: Duration,
}

/// Sends the motion again and again, each frame at its time. A sender that is too slow for the rate
/// gives up after twice the time.
fn send(sink: &mut dyn Sink, motion: &[Frame], rate_hz: f64, seconds: f64) -> Sent {
    let start = Instant::now();
    let mut sent = Sent { frames: 0, seconds: 0.0, latest: Duration::ZERO };
    let due = |count: u64| Duration::from_secs_f64(count as f64 / rate_hz);
    for frame in motion.iter().cycle() {
        let (due, now) = (due(sent.frames), start.elapsed());
        if due.as_secs_f64() >= seconds || now.as_secs_f64() >= 2.0 * seconds {
            break;
        }
        if due > now {
            std::thread::sleep(due - now);
        }
        sent.latest = sent.latest.max(start.elapsed().saturating_sub(due));
        let mut frame = *frame;
        #[expect(clippy::cast_possible_truncation, reason = "it counts modulo 2^32")]
        frame.payload[COUNTER_BYTES].copy_from_slice(&(sent.frames as u32).to_le_bytes());
        sink.send(&frame).unwrap();
        sent.frames += 1;
    }
    sent.seconds = start.elapsed().as_secs_f64();
    sent
}

/// Waits until every frame is a sample that the worker has, or is counted as lost on the way: who
/// is late has lost nothing. Not for ever: what is missing then was not read in time.
fn drain(status: &Path, frames: u64) {
    let start = Instant::now();
    while start.elapsed() < DRAIN
        && !fetch_status(status).is_ok_and(|snapshot: Snapshot| {
            let (Some(bus), Some(work)) = (snapshot.acquisition, snapshot.estimation) else {
                return false;
            };
            bus.frames + bus.counters.queue_drops >= frames
                && work.samples + work.samples_missing >= bus.samples
        })
    {
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Ends the service when the sender ends, however that happens.
struct EndsService;

impl Drop for EndsService {
    fn drop(&mut self) {
        // There is nobody else to tell when the process itself cannot be reached.
        let _ = kill_process(getpid(), Signal::TERM);
    }
}

fn main() {
    if std::env::args().skip(1).eq(["--bench"]) {
        println!("benches/service starts this program with its options");
        return;
    }
    let arguments = Arguments::parse();
    let cell = Cell::read(&arguments.cell).unwrap();
    let network = PrivateNetwork::new(&arguments.folder.join(FOLDER_NAME)).unwrap();
    let paths = Paths {
        runtime: arguments.folder.clone(),
        state: Some(arguments.folder.join("state")),
        prefix: network.prefix().to_owned(),
    };
    paths.create_folders().unwrap();
    let motion = motion(&cell);
    let (mut sink, opened) = bus(&cell);
    let parts = Parts::Both(
        build_acquisition(&cell, &paths, opened.source, opened.pace).unwrap(),
        build_estimation(&cell, &paths, &LastIdentification::default()).unwrap(),
    );
    let options = ServiceOptions {
        status: Some(SocketOptions::new(paths.status_socket(), 0o600)),
        receive_buffer: opened.receive_buffer,
        ..ServiceOptions::default()
    };
    let status = paths.status_socket();
    let sender = std::thread::Builder::new().name("sender".into()).spawn(move || {
        let _ends = EndsService;
        while fetch_status(&status).is_err() {
            std::thread::sleep(Duration::from_millis(10));
        }
        let sent = send(&mut *sink, &motion, arguments.rate, arguments.seconds);
        drain(&status, sent.frames);
        sent
    });
    let report = run(&options, parts).unwrap();
    let sent = sender.unwrap().join().unwrap();
    let summary = json!({
        "frames": sent.frames,
        "seconds": sent.seconds,
        "latest_s": sent.latest.as_secs_f64(),
        "snapshot": report.snapshot,
    });
    println!("{summary}");
}
