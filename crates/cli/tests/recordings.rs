//! Recordings of a bus: what was live is replayed to the same bytes, from a kept recording and from
//! the ring.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::program::{Installation, didim, json, repository, results, succeed};
use didim::analysis::identify::LastIdentification;
use didim::cell::Cell;
use didim::live::stream::Pace;
use didim::live::worker::TimeOfDay;
use didim::service::pipeline::{OneRun, archiver_options, build_acquisition, build_estimation};
use didim::service::supervision::{Parts, ServiceOptions, ServiceReport, run};
use didim_drivers::frame::Frame;
use didim_drivers::samples::Samples;
use didim_drivers::source::mcap::{FileEnd, McapScan};
use didim_drivers::source::{
    CandumpWriter, InterfaceName, McapSource, Received, Source, StampDigits, TextLog, WhenFull,
    in_process_bus,
};
use didim_formats::{BagSpec, BagTime, Side, read_bag};
use tempfile::TempDir;

/// The frames of the simulated arm, twice its motion.
fn simulate(cell: &Installation) -> (PathBuf, Vec<Frame>) {
    let log = cell.path("arm.log");
    let bus = format!("log:{}", log.display());
    let scenario = cell.scenario(&[("tail_s = 0.6", "tail_s = 1.5")]);
    succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus, &"--scenario", &scenario]);
    let frames = read(&mut TextLog::open(&log, &[]).unwrap());
    let last = frames.last().unwrap().stamp_ns;
    // Another motion follows: the second window has another number and another start.
    let period_ns = 200_000 * u64::from(frames[1].id == frames[0].id);
    let period_ns = if period_ns > 0 { period_ns } else { 2_000_000 };
    let shift = (last / period_ns + 1) * period_ns;
    let again = frames.iter().map(|frame| frame.with_stamp(frame.stamp_ns + shift));
    let twice: Vec<Frame> = frames.iter().copied().chain(again).collect();
    (log, twice)
}

fn read(source: &mut dyn Source) -> Vec<Frame> {
    let mut frames = Vec::new();
    let mut batch = Vec::with_capacity(4096);
    while source.receive(&mut batch, Duration::ZERO).unwrap() == Received::Frames {
        frames.append(&mut batch);
    }
    frames
}

/// A living bus in this process, `speed` times as fast as its stamps.
fn live(installation: &Installation, frames: Vec<Frame>, speed: f64) -> ServiceReport {
    let cell = Cell::read(&installation.cell()).unwrap();
    let run_once = OneRun::new(Some(installation.state())).unwrap();
    let paths = &run_once.paths;
    let name = [InterfaceName::new("vcan0").unwrap()];
    let (sender, source) = in_process_bus(&name, 4096, WhenFull::Wait);
    let bus = build_acquisition(&cell, paths, Box::new(source), Pace::Live).unwrap();
    assert!(bus.recorder.is_some());
    let mut work = build_estimation(&cell, paths, &LastIdentification::default()).unwrap();
    work.options.archiver = archiver_options(&cell, paths);
    // Its stamps begin at 0.
    work.options.time_of_day = TimeOfDay::Log { since_1970_ns: 0 };
    assert!(work.options.archiver.is_some());
    std::thread::spawn(move || {
        // After the service has its ports; it reads a bus that is there already.
        let start = Instant::now();
        for frame in frames {
            let due = Duration::from_secs_f64(1e-9 * frame.stamp_ns as f64 / speed);
            std::thread::sleep(due.saturating_sub(start.elapsed()));
            if sender.send(frame).is_err() {
                return;
            }
        }
    });
    run(&ServiceOptions::default(), Parts::Both(bus, work)).unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

/// The joint states in a recording are its samples, on the joints' side.
#[track_caller]
fn assert_curves_are_of_the_frames(cell: &Path, recording: &Path) {
    let cell = Cell::read(cell).unwrap();
    let (bus, transmission) = (cell.bus().unwrap(), cell.robot.transmission());
    let samples: Vec<_> =
        Samples::new(Box::new(McapSource::open(recording, &[]).unwrap()), bus.assembler(), 64)
            .collect::<Result<_, _>>()
            .unwrap();
    let spec = BagSpec {
        joints: (1..=6).map(|joint| format!("joint_{joint}")).collect(),
        topic: None,
        rate_hz: 1e9 / bus.layout.period_ns(),
        side: Side::Joint,
        torque_scales: vec![1.0; 6],
        wraps: Vec::new(),
        time: BagTime::Rows,
    };
    let curves = read_bag(recording, &spec).unwrap().into_whole().unwrap().signals;
    assert!(samples.len() > 1000 && curves.position_rad[0].len() == samples.len());
    for (k, sample) in samples.iter().enumerate() {
        let [mut position, mut torque] = [[0.0; 6]; 2];
        transmission.joint_position(&sample.motor_position_rad[..6], &mut position);
        transmission.joint_torque(&sample.motor_torque_nm[..6], &mut torque);
        let values_at =
            |columns: &[Vec<f64>]| [0, 1, 2, 3, 4, 5].map(|joint: usize| columns[joint][k]);
        assert_eq!(
            (values_at(&curves.position_rad), values_at(&curves.torque_nm)),
            (position, torque),
            "{k}"
        );
    }
}

fn replay(cell: &Installation, log: &Path, state: &str) -> Vec<String> {
    let state = cell.path(state);
    succeed(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &state]);
    results(&state)
}

/// Returns the results.
fn a_replay_gives_the_bytes_of_the_live_run(name: &str, changes: &[(&str, &str)]) -> Vec<String> {
    let cell = Installation::from_cell(name, changes);
    let (_, frames) = simulate(&cell);
    let report = live(&cell, frames.clone(), 2.0);
    let (bus, work) = (report.snapshot.acquisition.unwrap(), report.snapshot.estimation.unwrap());
    assert_eq!(work.windows_identified, 2, "{work:#?}");
    let recording = bus.recording.unwrap();
    assert_eq!(recording.frames_recorded, frames.len() as u64, "{recording:?}");
    assert_eq!((recording.frames_unrecorded, recording.write_errors), (0, 0), "{recording:?}");
    let archive = work.kept_recordings.unwrap();
    assert_eq!((archive.fixed, archive.failed), (2, 0), "{archive:?}");

    // The ring has every frame, as it was.
    let recordings = cell.state().join("recordings");
    let ring = files(&recordings.join("ring"));
    let recorded: Vec<Frame> =
        ring.iter().flat_map(|file| read(&mut McapSource::open(file, &[]).unwrap())).collect();
    assert!(recorded == frames, "{} frames of {}", recorded.len(), frames.len());

    let live = results(&cell.state());
    assert_eq!(live.len(), 2);
    let archived = files(&recordings.join("kept"));
    let names: Vec<_> =
        archived.iter().map(|file| file.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["result-00000000.mcap", "result-00000001.mcap"]);
    for (n, (file, live)) in archived.iter().zip(&live).enumerate() {
        assert_eq!(McapScan::read(file).unwrap().file_end, FileEnd::Finished);
        // Chunks name their compression.
        let is_compressed = fs::read(file).unwrap().windows(4).any(|word| word == b"zstd");
        assert_eq!(is_compressed, cfg!(feature = "parquet"), "{}", file.display());
        let replayed = replay(&cell, file, &format!("replayed-{n}"));
        assert_eq!(replayed, [live.as_str()], "{}", file.display());
        assert_curves_are_of_the_frames(&cell.cell(), file);
    }
    // By its content, not by its name.
    let disguised = cell.path("disguised.log");
    fs::copy(&archived[1], &disguised).unwrap();
    assert_eq!(replay(&cell, &disguised, "disguised"), [live[1].as_str()]);
    // And the ring as a whole.
    assert_eq!(replay(&cell, &recordings.join("ring"), "from-the-ring"), live);

    // A recording of which frames are missing gives no result in its place.
    let bytes = fs::read(&archived[1]).unwrap();
    let cut = cell.path("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let outcome = didim(&[&"replay", &"--cell", &cell.cell(), &cut]);
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains("is not finished"), "{outcome:?}");

    // Offline, and in other formats.
    let (log, csv) = (cell.path("kept.log"), cell.path("kept.csv"));
    succeed(&[&"convert", &"--cell", &cell.cell(), &archived[0], &log]);
    let of_log = read(&mut TextLog::open(&log, &[]).unwrap());
    let of_mcap = read(&mut McapSource::open(&archived[0], &[]).unwrap());
    assert!(of_log == of_mcap, "no offset: the bus had a time of its own");
    let back = cell.path("back.mcap");
    succeed(&[&"convert", &"--cell", &cell.cell(), &log, &back]);
    assert!(read(&mut McapSource::open(&back, &[]).unwrap()) == of_mcap);
    succeed(&[&"convert", &"--cell", &cell.cell(), &archived[0], &csv]);
    fn identify(input: &Path, cell: &Installation) -> String {
        let text = succeed(&[&"identify", &"--cell", &cell.cell(), &"--input", &input]);
        assert!(text.contains("applicable"), "{text}");
        // The two files can be written in different minutes.
        let same = text.lines().filter(|line| !line.starts_with("recorded: "));
        same.collect::<Vec<_>>().join("\n")
    }
    assert_eq!(identify(&archived[0], &cell), identify(&log, &cell));
    live
}

/// What an independent reader is given: see `tests/independent/recordings.py`.
#[test]
#[ignore = "the other process of a test: tests/independent"]
fn child_writes_files_for_an_independent_reader() {
    let folder = PathBuf::from(std::env::var_os("DIDIM_RECORDINGS").unwrap());
    let cell = Installation::from_cell("tx40-packed-fd", &[]);
    let (log, _) = simulate(&cell);
    let frames = read(&mut TextLog::open(&log, &[]).unwrap());
    live(&cell, frames, 2.0);
    let recordings = cell.state().join("recordings");
    fs::copy(&files(&recordings.join("ring"))[0], folder.join("ring.mcap")).unwrap();
    fs::copy(&files(&recordings.join("kept"))[0], folder.join("kept.mcap")).unwrap();
    fs::copy(&log, folder.join("ring.log")).unwrap();
}

#[test]
fn packed_frames_are_replayed_to_the_same_bytes() {
    a_replay_gives_the_bytes_of_the_live_run("tx40-packed-fd", &[]);
}

#[test]
fn cia_402_is_replayed_to_the_same_bytes() {
    a_replay_gives_the_bytes_of_the_live_run(
        "tx40-cia402",
        &[("method = \"didim\"", "method = \"idim-ls\"")],
    );
}

/// Drives that tell besides, seldom: temperature, voltage and mode, in a PDO of each that goes by
/// time.
struct Telling {
    _folder: TempDir,
    shipped: String,
    dbc: String,
}

const STATUS: &str = "status_word = \"TPDO1_{axis}.StatusWord\"";
const MODE_SIGNALS: &str = "status_word = \"TPDO1_{axis}.StatusWord\"
temperature = { signal = \"TPDO3_{axis}.MotorTemperature\" }
supply_voltage = { signal = \"TPDO3_{axis}.DcLinkVoltage\" }
mode = { signal = \"TPDO3_{axis}.ModeDisplay\" }";

impl Telling {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let shipped = repository("config/dbc/cia402_six_axes.dbc");
        let plain = fs::read_to_string(&shipped).unwrap();
        let (head, tail) = plain.split_once("CM_ BO_ 128").unwrap();
        let mut text = head.to_owned();
        for axis in 1..=6 {
            text += &format!(
                "BO_ {} TPDO3_{axis}: 8 Drive_{axis}\n \
                 SG_ MotorTemperature : 0|16@1- (0.1,0) [-40|200] \"degC\" Controller\n \
                 SG_ DcLinkVoltage : 16|32@1+ (0.001,0) [0|1000] \"V\" Controller\n \
                 SG_ ModeDisplay : 48|8@1- (1,0) [-128|127] \"\" Controller\n\n",
                0x380 + axis
            );
        }
        let dbc = folder.path().join("telling.dbc");
        fs::write(&dbc, text + "CM_ BO_ 128" + tail).unwrap();
        let [shipped, dbc] = [shipped, dbc].map(|path| path.display().to_string());
        Self { _folder: folder, shipped, dbc }
    }

    fn changes(&self) -> [(&str, &str); 3] {
        let method = ("method = \"didim\"", "method = \"idim-ls\"");
        [method, (&self.shipped, &self.dbc), (STATUS, MODE_SIGNALS)]
    }
}

/// Reports before a window are no part of it: a recording that begins with the window has none of
/// them.
#[test]
fn what_drives_show_besides_is_replayed_to_the_same_bytes() {
    let telling = Telling::new();
    let results = a_replay_gives_the_bytes_of_the_live_run("tx40-cia402", &telling.changes());
    for result in results {
        let window = json(&result)["window"].clone();
        for key in ["temperature", "supply_voltage", "drive_mode"] {
            assert_eq!(window[key].as_array().unwrap().len(), 6, "{key} in {window}");
        }
        assert_eq!(window["drive_mode"][5]["mode"], 8);
        let first = &window["temperature"][0];
        // Every 12th cycle of 2 ms.
        let (reported, counted) =
            (first["readings"].as_u64().unwrap(), window["counted"].as_u64().unwrap());
        assert!(reported.abs_diff(counted / 12) <= 1, "{reported} of {counted}");
    }
}

#[test]
fn a_mode_that_changes_ends_a_window_and_cuts_a_log() {
    let telling = Telling::new();
    let cell = Installation::from_cell("tx40-cia402", &telling.changes());
    let (log, frames) = simulate(&cell);
    // The first half of the motion and all before it are of another mode.
    let once = read(&mut TextLog::open(&log, &[]).unwrap());
    let middle_ns = once.last().unwrap().stamp_ns / 100 * 45;
    let changed = cell.path("changed.log");
    let mut out = Vec::new();
    let name = [InterfaceName::new("can0").unwrap()];
    let mut writer = CandumpWriter::new(&mut out, &name, StampDigits::Nanoseconds);
    for mut frame in frames.into_iter().take(once.len()) {
        if (0x381..=0x386).contains(&frame.id.number()) && frame.stamp_ns < middle_ns {
            frame.payload[6] = 1;
        }
        writer.write(&frame).unwrap();
    }
    writer.finish().unwrap();
    fs::write(&changed, out).unwrap();
    let state = cell.path("changed");
    succeed(&[&"replay", &"--cell", &cell.cell(), &changed, &"--state", &state]);
    let windows: Vec<_> =
        results(&state).iter().map(|result| json(result)["window"].clone()).collect();
    let values_of =
        |key: &str| windows.iter().map(|window| window[key].clone()).collect::<Vec<_>>();
    assert_eq!(values_of("end"), ["mode-change", "rest"]);
    let modes: Vec<_> =
        windows.iter().map(|window| window["drive_mode"][0]["mode"].clone()).collect();
    assert_eq!(modes, [1, 8]);
    let outcome = didim(&[&"identify", &"--cell", &cell.cell(), &"--input", &changed, &"--json"]);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    assert!(outcome.stderr.contains("or a drive's mode changes"), "{outcome:?}");
    let folds = json(&outcome.stdout)["recordings"].clone();
    assert_eq!(folds[0]["drive_mode"][0]["mode"], 1);
    assert_eq!(folds[1]["drive_mode"][0]["mode"], 8);
}

/// Where no target is on the bus, a following error tells it.
#[test]
fn a_following_error_gives_the_reference_that_a_target_would() {
    let target = "reference = { signal = \"RPDO1_{axis}.TargetPosition\", valid = \"next-sync\" }";
    let following = "reference = { signal = \"RPDO1_{axis}.TargetPosition\", valid = \"instant\", \
                     following_error = \"actual-minus-target\" }";
    fn table(changes: &[(&str, &str)]) -> Vec<Vec<f64>> {
        let cell = Installation::from_cell("tx40-cia402", changes);
        let (log, _) = simulate(&cell);
        let csv = cell.path("arm.csv");
        succeed(&[&"convert", &"--cell", &cell.cell(), &log, &csv]);
        let text = fs::read_to_string(&csv).unwrap();
        let header = text.lines().next().unwrap().split(',');
        let columns: Vec<usize> = header
            .enumerate()
            .filter_map(|(k, name)| name.contains("reference").then_some(k))
            .collect();
        assert_eq!(columns.len(), 6);
        text.lines()
            .skip(1)
            .map(|line: &str| -> Vec<f64> {
                let cells: Vec<&str> = line.split(',').collect();
                columns.iter().map(|k| cells[*k].parse().unwrap()).collect()
            })
            .collect::<Vec<_>>()
    }
    // No target exists for the first cycle if targets take effect at the next SYNC. The last value
    // of the last cycle may belong to a next one.
    let (reported, found) = (table(&[]), table(&[(target, following)]));
    assert_eq!(reported.len(), found.len());
    let moves = found.iter().any(|row| (row[0] - found[0][0]).abs() > 1.0);
    assert!(moves, "{:?}", found[0]);
    for (term_line, found) in reported.iter().zip(&found[1..]) {
        // A count of 196608 in a revolution.
        assert!(term_line.iter().zip(found).all(|(one, other)| (one - other).abs() < 3.3e-5));
    }
}

/// More than the arm rests between its motions.
const MARGIN: &str = "margin_before_s = 4.0";

/// The margins reach into the motion before: what opened the window is not what a fresh start sees.
#[test]
fn a_window_whose_margin_reaches_into_the_one_before_is_replayed_to_the_same_bytes() {
    let changes =
        [("method = \"didim\"", "method = \"idim-ls\""), ("margin_before_s = 0.25", MARGIN)];
    a_replay_gives_the_bytes_of_the_live_run("tx40-cia402", &changes);
}
