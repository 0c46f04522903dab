//! Arms without a SYNC that send by themselves, at their own rates.

use std::fs;
use std::ops::RangeInclusive;
use std::process::{Command, Stdio};

use didim_drivers::frame::Frame;
use serde_json::Value;

use super::{
    Late, Witness, bus, in_time, kept_is_replayed_to_the_same_bytes, read_log, sender, to_silence,
    total, work, write_log,
};
use crate::program::{Daemon, Installation, didim, json, repository, results, succeed};

/// The arm of a shipped cell without a SYNC, and how its frames are distinguished.
struct Streaming {
    arm: &'static str,
    /// Identifiers that each sample takes a frame of.
    of_sample: RangeInclusive<u32>,
    more_of_sample: RangeInclusive<u32>,
    period_ns: u64,
}

const PIPER: Streaming = Streaming {
    arm: "piper",
    of_sample: 0x251..=0x256,
    more_of_sample: 0x2A5..=0x2A7,
    period_ns: 5_000_000,
};
const OPENARM: Streaming = Streaming {
    arm: "openarm",
    of_sample: 0x01..=0x07,
    more_of_sample: 0x11..=0x17,
    period_ns: 2_000_000,
};

/// Before all other processes, where that is allowed: an arm does not wait for the computer that
/// listens to it.
fn at_once(command: Command) -> Command {
    let may = Command::new("chrt").args(["--fifo", "50", "true"]).status();
    if !may.is_ok_and(|ended| ended.success()) {
        return command;
    }
    let mut first = Command::new("chrt");
    first.args(["--fifo", "50"]).arg(command.get_program()).args(command.get_args());
    first
}

/// Of which cycles frames were stamped more than a quarter of a period late: the machine had
/// stopped.
fn late_cycles(heard: &[Frame], scheduled: &[Frame], period_ns: u64) -> Vec<bool> {
    let begin = |frame: &Frame| frame.stamp_ns / period_ns * period_ns;
    let start_ns = heard.iter().zip(scheduled).map(|(is, due)| is.stamp_ns - begin(due)).min();
    let mut late =
        vec![false; 1 + usize::try_from(scheduled.last().unwrap().stamp_ns / period_ns).unwrap()];
    for (is, due) in heard.iter().zip(scheduled) {
        let by_ns = is.stamp_ns - begin(due) - start_ns.unwrap();
        let cycle = usize::try_from(due.stamp_ns / period_ns).unwrap();
        late[cycle] |= by_ns > period_ns / 4;
    }
    late
}

/// An arm that sends by itself, at its own rate, to stored results: what was sent is heard, and
/// nothing else; the service counts each frame once, by cause; a cycle is lost only around one
/// whose frames the machine had stamped late; results are replayed to their bytes. What the bus
/// said, and each result, is true within its combined uncertainty.
fn streams(of: &Streaming, cycles: u32, moves: usize, interface: &str) -> Result<(), Late> {
    let source = format!("\"can:{interface}\"");
    let changes = [
        ("\"can:can0\"", source.as_str()),
        // A gap ends a window, and so does a machine that stops. What is left of the motion is
        // enough.
        ("min_s = ", "min_s = 3.0 #"),
        // What is simulated has the gains of the cell.
        ("tolerances = ", "# tolerances = "),
    ];
    let cell = Installation::from_cell(of.arm, &changes);
    let shipped =
        fs::read_to_string(repository(&format!("sim-fixtures/scenarios/{}.toml", of.arm)));
    let mut remaining_moves = moves;
    let mut text = shipped.unwrap().replace("cycles = 1", &format!("cycles = {cycles}"));
    // The last one ends where the first began.
    let last = text.rfind("{ target_rad").unwrap();
    let tail = text.split_off(last);
    let lines_of_moves = text.lines().filter(|line| {
        let is_move = line.contains("target_rad");
        remaining_moves = remaining_moves.saturating_sub(usize::from(is_move));
        !is_move || remaining_moves > 0
    });
    let scenario = cell.path("scenario.toml");
    fs::write(&scenario, lines_of_moves.collect::<Vec<_>>().join("\n") + "\n" + &tail).unwrap();
    let log = cell.path("scheduled.log");
    let to_log = format!("log:{}", log.display());
    succeed(&[&"sim", &"--cell", &cell.cell(), &"--scenario", &scenario, &"--bus", &to_log]);
    let scheduled = read_log(&log);

    let witness = Witness::listen(interface);
    let daemon = Daemon::start(&cell, None);
    let arm = sender(&cell, interface, &["--scenario", scenario.to_str().unwrap()]);
    let arm = at_once(arm).stderr(Stdio::inherit()).output().unwrap();
    assert!(arm.status.success());
    println!("{}", String::from_utf8(arm.stdout).unwrap().trim());
    let (status, heard) = to_silence(daemon, &cell, witness)?;

    // Whatever the time: the frames of the arm are heard and no other, and the service has taken
    // each.
    let bytes = |frame: &Frame| (frame.id, frame.kind, frame.length, frame.payload);
    assert!(heard.iter().map(bytes).eq(scheduled.iter().map(bytes)), "{}", heard.len());
    let (bus, work) = (bus(&status), work(&status));
    let frames = heard.len() as u64;
    assert_eq!((bus.frames, bus.counters.queue_drops, bus.counters.error_frames), (frames, 0, 0));
    let seldom = frames
        - scheduled
            .iter()
            .filter(|frame: &&Frame| {
                let id = frame.id.number();
                of.of_sample.contains(&id) || of.more_of_sample.contains(&id)
            })
            .count() as u64;
    let of_sample = (of.of_sample.clone().count() + of.more_of_sample.clone().count()) as u64;
    // Frames that samples take, and those of nothing but readings; the others have their causes.
    let used_seldom = frames - total(&bus.frames_unused) - of_sample * bus.samples;
    let lost_with_cycle = bus.frames_unused.get("cycle_lost").copied().unwrap_or(0);
    assert!((seldom - lost_with_cycle.min(seldom)..=seldom).contains(&used_seldom), "{bus:#?}");
    assert_eq!(work.samples, bus.samples);

    // The first cycle has no predecessor. A stop costs the cycles that came late and their
    // neighbours.
    let late = late_cycles(&heard, &scheduled, of.period_ns);
    let is_near_late = |k: usize| late[k.saturating_sub(2)..late.len().min(k + 3)].contains(&true);
    let explained = (1..late.len()).filter(|k| is_near_late(*k)).count() as u64;
    let lost_cycles = late.len() as u64 - bus.samples;
    let stopped = late.iter().filter(|late| **late).count();
    println!(
        "{}: {frames} frames, {} cycles, {stopped} late, {lost_cycles} without a sample; unused \
        {:?}, lost {:?}; {} results",
        of.arm,
        late.len(),
        bus.frames_unused,
        bus.cycles_lost,
        work.windows_identified
    );
    assert!(
        (1..=1 + explained).contains(&lost_cycles),
        "{lost_cycles} lost, {explained} explained: {bus:#?}"
    );

    // A gap ends a window; read again, what lies between gaps goes together.
    let log = cell.path("heard.log");
    write_log(&heard, &log);
    let offline: [&dyn AsRef<_>; 6] =
        [&"identify", &"--json", &"--cell", &cell.cell(), &"--input", &log];
    let outcome = didim(&offline);
    match outcome.code {
        Some(0) => is_true(&json(&outcome.stdout), of.arm),
        // Stamps of a machine that stops are not those of the cycles: of another rate, or too
        // uneven to tell one.
        _ => {
            let refusals = ["the time stamps give", "the time stamps are too uneven"];
            let is_of_stamps = refusals.iter().any(|said| outcome.stderr.contains(said));
            assert!(stopped > 0 && is_of_stamps, "{outcome:?}");
        }
    }
    let live = results(&cell.state());
    assert_eq!(live.len() as u64, work.windows_identified);
    assert!(lost_cycles > 1 || !live.is_empty(), "nothing was in the way: {work:#?}");
    for (number, result) in live.iter().enumerate() {
        kept_is_replayed_to_the_same_bytes(&cell, number);
        is_true(&json(result)["estimate"], of.arm);
    }
    Ok(())
}

/// Each parameter of a simulated arm, within five combined standard deviations.
fn is_true(estimate: &Value, arm: &str) {
    let truth = crate::can_arms::truth(arm);
    let (mut sum, mut count) = (0.0, 0.0);
    for one in estimate["parameters"].as_array().unwrap() {
        let number = |key: &str| one[key].as_f64().unwrap();
        let off = number("value") - truth[one["name"].as_str().unwrap()];
        let deviation = off / number("combined_standard_deviation");
        assert!(deviation.abs() < 5.0, "{one}: {off}");
        (sum, count) = (sum + deviation * deviation, count + 1.0);
    }
    let (rms, error) = (f64::sqrt(sum / count), &estimate["relative_error"]);
    println!(
        "{} samples, {count} parameters, rms of their deviations {rms:.2} combined σ, relative \
        error {error}",
        estimate["samples"]
    );
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_piper_at_its_own_rate_is_accounted_for_and_identified() {
    in_time(|interface| streams(&PIPER, 1, 8, interface));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_openarm_at_its_own_rate_is_accounted_for_and_identified() {
    in_time(|interface| streams(&OPENARM, 1, 12, interface));
}

#[test]
#[ignore = "needs a CAN bus and minutes: tests/run full"]
fn a_minute_of_a_piper_at_its_own_rate() {
    in_time(|interface| streams(&PIPER, 4, usize::MAX, interface));
}

#[test]
#[ignore = "needs a CAN bus and minutes: tests/run full"]
fn a_minute_of_an_openarm_at_its_own_rate() {
    in_time(|interface| streams(&OPENARM, 5, usize::MAX, interface));
}
