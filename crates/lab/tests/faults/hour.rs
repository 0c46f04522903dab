//! A bus for an hour, in virtual time: source, assembler, samples, windows, results on disk. The
//! clock of the wall is set by an hour, either way and in the middle of a motion, and the interface
//! is away for a while.
#![allow(clippy::cast_possible_truncation, reason = "cycles of an hour fit")]

use core::time::Duration;
use std::sync::{Arc, Mutex};

use didim::analysis::identify::identify_window;
use didim::archive::store::{Attachments, ResultRecord, Store, Timestamp, read_history};
use didim::live::worker::{WindowEvent, Windower};
use didim_drivers::clock::ClockPair;
use didim_drivers::frame::Frame;
use didim_drivers::samples::{Assembled, Samples};
use didim_drivers::source::{
    InterfaceName, Received, SocketCanError, Source, SourceCounters, SourceError, StampClock,
};
use didim_identification::identification::Estimate;

use super::bench::{BASE, cell};
use super::file::BusOf;

/// Of both cells [ns].
const PERIOD_NS: u64 = 2_000_000;
/// When the bus begins, and what the clocks are apart then [ns].
const START_NS: u64 = 5_000_000_000;
const MIN_SEPARATION_NS: u64 = 1_790_000_000_000_000_000;
const HOUR_NS: i64 = 3_600_000_000_000;
/// How long the interface is away [cycles].
const AWAY: u64 = 5_000;

/// The clocks of a machine, which the bus turns.
#[derive(Clone)]
struct Machine(Arc<Mutex<ClockPair>>);

impl Machine {
    fn read(&self) -> ClockPair {
        *self.0.lock().unwrap()
    }

    fn turn(&self, monotonic_ns: u64) {
        let mut clocks = self.0.lock().unwrap();
        let step_ns = monotonic_ns - clocks.monotonic_ns;
        clocks.monotonic_ns = monotonic_ns;
        clocks.realtime_ns += step_ns;
    }

    fn set_wall(&self, by_ns: i64) {
        let mut clocks = self.0.lock().unwrap();
        clocks.realtime_ns = clocks.realtime_ns.strict_add_signed(by_ns);
    }
}

/// One motion after the other, with the stamps of a kernel.
struct Wire {
    machine: Machine,
    /// The cycles of one motion, rests included, each with its first stamp at its instant.
    motion: Vec<Vec<Frame>>,
    /// The next cycle, and how many there are.
    next: u64,
    cycles: u64,
    /// Cycles before which the wall clock is set, with by how much; the last of them first.
    sets: Vec<(u64, i64)>,
    /// The first cycle for which the interface is away.
    away: u64,
    reported: bool,
    counters: SourceCounters,
}

impl Source for Wire {
    fn receive(&mut self, batch: &mut Vec<Frame>, wait: Duration) -> Result<Received, SourceError> {
        if self.next == self.cycles {
            return Ok(Received::End);
        }
        if (self.away..self.away + AWAY).contains(&self.next) {
            if !std::mem::replace(&mut self.reported, true) {
                let interface = self.interfaces()[0];
                return Err(SocketCanError::Gone { interface }.into());
            }
            let cycles = (wait.as_nanos() as u64 / PERIOD_NS).max(1);
            self.next = (self.next + cycles).min(self.away + AWAY);
            self.machine.turn(START_NS + self.next * PERIOD_NS);
            return Ok(Received::Silence);
        }
        if self.sets.last().is_some_and(|(at, _)| *at == self.next) {
            self.machine.set_wall(self.sets.pop().unwrap().1);
        }
        let wall = self.machine.read();
        let frames = &self.motion[(self.next % self.motion.len() as u64) as usize];
        let begin = START_NS + self.next * PERIOD_NS;
        let first = frames[0].stamp_ns;
        for frame in frames {
            let monotonic_ns = begin + (frame.stamp_ns - first);
            batch.push(frame.with_stamp(wall.realtime_ns + (monotonic_ns - wall.monotonic_ns)));
        }
        // It is read shortly before the next one.
        self.machine.turn(begin + PERIOD_NS - 1_000);
        self.next += 1;
        self.counters.frames += frames.len() as u64;
        Ok(Received::Frames)
    }

    fn counters(&self) -> SourceCounters {
        self.counters
    }

    fn interfaces(&self) -> &[InterfaceName] {
        static NAMES: std::sync::LazyLock<[InterfaceName; 1]> =
            std::sync::LazyLock::new(|| [InterfaceName::new("can0").unwrap()]);
        &*NAMES
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }
}

/// Runs so many motions; each whole one gives the result of the first, bit by bit.
fn run(motions: u64) -> String {
    let began = std::time::Instant::now();
    let cell = cell(BusOf::Sync);
    let motion = BASE.frames(BusOf::Sync, &[]).unwrap();
    let length = motion.len() as u64;
    let (cycles, middle) = (motions * length, length / 2);
    let clocks = ClockPair {
        realtime_ns: MIN_SEPARATION_NS + START_NS,
        monotonic_ns: START_NS,
        uncertainty_ns: 100,
    };
    let machine = Machine(Arc::new(Mutex::new(clocks)));
    let time_of = |share: u64| motions * share / 5 * length + middle;
    let wire = Wire {
        machine: machine.clone(),
        motion,
        next: 0,
        cycles,
        sets: vec![
            (time_of(3), HOUR_NS),
            (time_of(2), -HOUR_NS),
            (time_of(1), -HOUR_NS),
            (middle, HOUR_NS),
        ],
        away: time_of(4),
        reported: false,
        counters: SourceCounters::default(),
    };
    let assembler = cell.bus().unwrap().assembler();
    let read = machine.clone();
    let mut samples =
        Samples::with_clocks(Box::new(move || read.read()), Box::new(wire), assembler, 256);
    let mut windower = Windower::new(cell.window.plan(cell.sample_rate_hz()).unwrap());
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let mut store = Store::open(folder.path(), 1_000).unwrap();
    let mut first: Option<Estimate> = None;
    let (mut failures, mut rejected, mut stamp_ns) = (0, Vec::new(), 0);
    let mut ended = false;
    while !ended {
        match samples.read(Duration::from_millis(20)) {
            Ok(received) => ended = received == Received::End,
            Err(error) => {
                assert!(error.is_recoverable(), "{error}");
                failures += 1;
            }
        }
        while let Some(Assembled { sample, .. }) = samples.poll() {
            // On the clock that nobody sets, and on its grid.
            assert_eq!(sample.stamp_ns, START_NS + sample.sequence * PERIOD_NS);
            assert!(sample.stamp_ns > stamp_ns);
            stamp_ns = sample.stamp_ns;
            match windower.handle_sample(&sample) {
                None => {}
                Some(WindowEvent::Rejected(window)) => rejected.push(window.rejection.cause()),
                Some(WindowEvent::Closed(window)) => {
                    let mut estimate = identify_window(cell, &window).unwrap().estimate;
                    assert!(estimate.verdict.applicable);
                    let now = Timestamp::from_unix_s(machine.read().realtime_ns / 1_000_000_000);
                    let record = ResultRecord::new(&cell.name, "c0ffee", &window, estimate.clone());
                    store.write(&record, &Attachments::default(), now).unwrap();
                    let first = first.get_or_insert_with(|| estimate.clone());
                    estimate.robot.clone_from(&first.robot);
                    assert_eq!(format!("{estimate:?}"), format!("{first:?}"));
                }
            }
        }
    }
    assert!(windower.finish().is_none());
    check_losses(cycles, &samples, failures, rejected);
    let lines = read_history(folder.path()).unwrap().0;
    assert_eq!(lines.len() as u64, motions - 2);
    let seconds = began.elapsed().as_secs_f64();
    format!(
        "{cycles} cycles, {} frames, {} results in {seconds:.1} s",
        samples.counters().frames,
        lines.len()
    )
}

fn check_losses(cycles: u64, samples: &Samples<'_>, failures: i32, rejected: Vec<&str>) {
    let (losses, clock) = (samples.losses(), samples.clock_counters().unwrap());
    assert_eq!(losses.samples, cycles - AWAY, "{losses:?}");
    assert_eq!(losses.cycles.total(), AWAY, "{losses:?}");
    assert_eq!((clock.steps, clock.held_back, clock.future_stamps), (4, 0, 0), "{clock:?}");
    // Away from the middle of one motion to the middle of another.
    assert_eq!((failures, rejected.as_slice()), (1, ["sample-gap", "too-short"].as_slice()));
}

#[test]
fn a_minute_of_a_bus_with_the_wall_clock_set_by_an_hour_loses_nothing() {
    println!("{}", run(7));
}

#[test]
#[ignore = "an hour of a bus, by hand: docs/evidence/reliability.md"]
fn an_hour_of_a_bus_with_the_wall_clock_set_by_an_hour_loses_nothing() {
    println!("{}", run(450));
}
