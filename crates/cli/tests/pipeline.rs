//! The whole program without a bus: the simulated arm, logs, the daemon's pipeline, offline.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::program::{Installation, command, didim, difference, json, results, succeed};
use serde_json::Value;

/// Frames of one bus cycle: the packed sample; SYNC, six samples and six targets.
const CELLS: [(&str, usize); 2] = [("tx40-packed-fd", 1), ("tx40-cia402", 13)];

/// The frames of the simulated arm as a log of the cell's bus.
fn simulate(cell: &Installation, scenario: &Path) -> PathBuf {
    let log = cell.path("arm.log");
    let bus = format!("log:{}", log.display());
    let output =
        succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus, &"--scenario", &scenario]);
    assert!(output.contains(&bus), "{output}");
    log
}

/// The result files of a replay.
fn replay(cell: &Installation, log: &Path, state: &str) -> Vec<String> {
    let state = cell.path(state);
    succeed(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &state]);
    results(&state)
}

fn integer(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

/// The estimate of `didim identify` on the bus cycles of a result's window.
fn identify_window(cell: &Installation, log: &Path, frames: usize, window: &Value) -> Value {
    let [first, last] = ["first_sequence", "last_sequence"].map(|key| integer(&window[key]));
    // CiA 402's targets take effect at the next SYNC: the cycle before has those of the first
    // sample. It gives no sample with a reference itself and is left out.
    let first = if frames > 1 { first - 1 } else { first };
    let text = fs::read_to_string(log).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let part = cell.path("window.log");
    fs::write(&part, lines[first * frames..(last + 1) * frames].join("\n") + "\n").unwrap();
    let cell = cell.cell();
    let output = succeed(&[&"identify", &"--json", &"--cell", &cell, &"--input", &part]);
    let mut estimate = json(&output);
    // How long it took is no part of a result.
    assert!(estimate.as_object_mut().unwrap().remove("elapsed_ms").is_some());
    estimate
}

#[test]
fn the_demonstration_finds_the_arm_it_simulates_and_leaves_nothing_behind() {
    let cell = Installation::from_cell("tx40-packed-fd", &[]);
    let (figure, temporary) = (cell.path("demo.svg"), cell.path("tmp"));
    fs::create_dir(&temporary).unwrap();
    let start = Instant::now();
    let child = command(&[&"demo", &"--fast", &"--figure", &figure])
        .env("TMPDIR", &temporary)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());

    let text = String::from_utf8(output.stdout).unwrap();
    let table = text.lines().skip_while(|line| !line.starts_with("parameter ")).skip(1);
    let rows: Vec<Vec<&str>> = table
        .take_while(|line| !line.is_empty())
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(rows.len(), 28, "{text}");
    for row in rows {
        let deviation: f64 = row.last().unwrap().parse().unwrap();
        assert!(deviation.abs() <= 6.0, "{row:?}");
    }
    assert!(text.contains("39700 frames, 39700 samples, 0 lost; 1 window identified, 0 rejected"));

    let svg = fs::read_to_string(&figure).unwrap();
    assert_well_formed(&svg);
    for joint in 1..=6 {
        assert_eq!(svg.matches(&format!(">joint {joint} · ")).count(), 1);
    }

    let leftovers: Vec<_> = fs::read_dir(&temporary).unwrap().collect();
    assert!(leftovers.is_empty(), "{leftovers:?}");
    // The file that keeps the prefix names the folder. It is the last one that is removed.
    let shared = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    let leftovers: Vec<_> = shared
        .filter(|path| path.to_string_lossy().ends_with("lock"))
        .filter(|path| {
            let folder = fs::read_to_string(path).unwrap_or_default();
            Path::new(&folder).starts_with(&temporary)
        })
        .collect();
    assert!(leftovers.is_empty(), "{leftovers:?}");
}

/// From the start of the shipped cell, which is far away.
#[test]
fn the_demonstration_is_found_by_the_methods_that_seek_their_way() {
    let cell = Installation::from_cell("tx40-packed-fd", &[]);
    let figure = cell.path("demo.svg");
    for method in ["clie", "cloe"] {
        let text = succeed(&[&"demo", &"--fast", &"--method", &method, &"--figure", &figure]);
        assert!(text.contains("1 window identified, 0 rejected"), "{method}: {text}");
        assert!(text.contains("\nverdict: applicable\n"), "{method}: {text}");
    }
}

/// Every element is closed, in order, and there is one root.
fn assert_well_formed(xml: &str) {
    let mut open_tags: Vec<&str> = Vec::new();
    let mut roots = 0;
    for part in xml.split('<').skip(1) {
        let (tag, text) = part.split_once('>').unwrap();
        assert!(!text.contains(['&', '>']) || text.contains(';'), "{text}");
        assert!(tag.matches('"').count().is_multiple_of(2), "{tag}");
        let name = tag.split([' ', '/']).find(|name| !name.is_empty()).unwrap();
        roots += usize::from(open_tags.is_empty());
        if tag.starts_with('/') {
            assert_eq!(open_tags.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open_tags.push(name);
        }
        assert!(
            !open_tags.is_empty() || text.trim().is_empty(),
            "text outside of the root: {text}"
        );
    }
    // The root's end is a tag on which nothing but the root is open.
    assert_eq!((roots, open_tags.len()), (1, 0));
}

#[test]
fn a_replay_gives_what_offline_identification_gives_and_twice_the_same_bytes() {
    for (name, frames) in CELLS {
        let cell = Installation::from_cell(name, &[]);
        let log = simulate(&cell, Path::new("tx40-paper"));
        let first = replay(&cell, &log, "first");
        assert_eq!(first.len(), 1, "{name}");
        assert_eq!(first, replay(&cell, &log, "second"), "{name}");
        let result = json(&first[0]);
        assert_eq!(result["window"]["end"], "rest", "{name}");
        assert_eq!(result["estimate"]["verdict"]["applicable"], true, "{name}");
        let offline = identify_window(&cell, &log, frames, &result["window"]);
        assert_eq!(result["estimate"], offline, "{name}");
    }
}

#[test]
fn a_motion_that_is_repeated_gives_a_window_each_time() {
    let cell = Installation::from_cell("tx40-packed-fd", &[]);
    let log = simulate(&cell, &cell.scenario(&[("cycles = 1", "cycles = 2")]));
    let results: Vec<Value> = replay(&cell, &log, "state").iter().map(|text| json(text)).collect();
    assert_eq!(results.len(), 2);
    let [first, second] = [&results[0], &results[1]];
    assert_eq!((&first["window"]["number"], &second["window"]["number"]), (&0.into(), &1.into()));
    // The second motion begins one cycle of 7.94 s after the first.
    let after =
        integer(&second["window"]["first_counted"]) - integer(&first["window"]["first_counted"]);
    assert!(after.abs_diff(39_700) < 50, "{after}");
    // Same arm, same motion, another noise.
    assert!(difference(&first["estimate"], &second["estimate"]) > 0.0);
    for result in [first, second] {
        let offline = identify_window(&cell, &log, 1, &result["window"]);
        assert_eq!(result["estimate"], offline);
    }
}

#[test]
fn windows_by_interval_follow_each_other_with_the_same_number_of_samples() {
    let trigger = "by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5";
    let interval = "by = \"interval\", length_s = 3.2";
    let cell = Installation::from_cell("tx40-packed-fd", &[(trigger, interval)]);
    let log = simulate(&cell, Path::new("tx40-paper"));
    let results: Vec<Value> = replay(&cell, &log, "state").iter().map(|text| json(text)).collect();
    assert_eq!(results.len(), 2, "7.94 s hold two windows of 3.2 s and their margins");
    let mut free = 0;
    for result in results {
        let window = &result["window"];
        assert_eq!((&window["counted"], &window["end"]), (&16_000.into(), &"interval".into()));
        let first = integer(&window["first_counted"]);
        assert!(first >= free, "no sample counts twice");
        free = first + 16_000;
        let offline = identify_window(&cell, &log, 1, window);
        assert_eq!(result["estimate"], offline);
    }
}

/// A log whose bus is faster by `off` than the simulated arm's: the same frames, other stamps.
fn faster(cell: &Installation, log: &Path, off: f64) -> PathBuf {
    let text = fs::read_to_string(log).unwrap();
    let lines = text.lines().map(|line| {
        let (stamp, frame) = line.strip_prefix('(').unwrap().split_once(')').unwrap();
        format!("({:.6}){frame}\n", stamp.parse::<f64>().unwrap() / (1.0 + off))
    });
    let path = cell.path("faster.log");
    fs::write(&path, lines.collect::<String>()).unwrap();
    path
}

/// What a thousandth does to the parameters is far beyond their standard deviations, and fits as
/// well.
#[test]
fn a_rate_that_is_off_by_a_thousandth_is_refused_alike_by_replay_and_identify() {
    let cell = Installation::from_cell("tx40-packed-fd", &[]);
    let log = simulate(&cell, Path::new("tx40-paper"));
    for (off, found) in [(1e-3, "5005.00"), (5e-3, "5025.0"), (1e-2, "5050.0"), (-9e-3, "4955.0")] {
        let log = faster(&cell, &log, off);
        let (cell, state) = (cell.cell(), cell.path("state"));
        for ended in [
            didim(&[&"replay", &"--cell", &cell, &log, &"--state", &state]),
            didim(&[&"identify", &"--cell", &cell, &"--input", &log]),
            didim(&[&"compare", &"--cell", &cell, &"--input", &log]),
        ] {
            assert_eq!(ended.code, Some(1), "{off} {ended:?}");
            for part in [found, "5000.00", "rate_hz"] {
                assert!(ended.stderr.contains(part), "{off} {part}: {ended:?}");
            }
        }
        assert_eq!(results(&state), Vec::<String>::new(), "{off}");
    }
    // As two crystals differ.
    let log = faster(&cell, &log, 1e-4);
    let result = json(&replay(&cell, &log, "state")[0]);
    assert_eq!(result["estimate"]["verdict"]["applicable"], true);
    assert!(!result["estimate"]["verdict"]["notes"].to_string().contains("taken as stated"));
}

/// Where the frames count, nobody knows the rate, and the result says so.
#[test]
fn a_rate_that_cannot_be_checked_is_noted() {
    let frames = ("axes = 6", "axes = 6\ncycles_by = \"frames\"");
    let cell = Installation::from_cell("tx40-packed-fd", &[frames]);
    let log = simulate(&cell, Path::new("tx40-paper"));
    let log = faster(&cell, &log, 1e-2);
    let result = json(&replay(&cell, &log, "state")[0]);
    let notes = result["estimate"]["verdict"]["notes"].to_string();
    assert!(notes.contains("the sample rate is taken as stated"), "{notes}");
    assert!(
        succeed(&[&"check", &"--other-machine", &"--cell", &cell.cell()]).contains("cycles_by")
    );
}

#[test]
fn a_missing_frame_in_the_motion_costs_its_window_and_says_so() {
    // Five seconds after the start; of CiA 402, where SYNC is the first of a cycle, an axis.
    for ((name, frames), cycle) in CELLS.into_iter().zip([25_000, 2_500]) {
        let cell = Installation::from_cell(name, &[]);
        let log = simulate(&cell, Path::new("tx40-paper"));
        let text = fs::read_to_string(&log).unwrap();
        let mut lines: Vec<&str> = text.lines().collect();
        lines.remove(cycle * frames + frames / 2);
        fs::write(&log, lines.join("\n") + "\n").unwrap();
        let state = cell.path("state");
        let ended = didim(&[&"replay", &"--cell", &cell.cell(), &log, &"--state", &state]);
        assert_eq!(ended.code, Some(1), "{ended:?}");
        let cause = format!("1 samples are missing after sample {}", cycle - 1);
        assert!(ended.stderr.contains(&cause), "{ended:?}");
        // What is left of the motion is shorter than a window has to be.
        assert!(ended.stderr.contains("didim: window 1 was not identified"), "{ended:?}");
        assert_eq!(results(&state), Vec::<String>::new());
    }
}
