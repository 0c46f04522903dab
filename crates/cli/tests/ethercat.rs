//! A cell on EtherCAT: a capture of the wire gives what a log of the same frames does.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::program::{Installation, didim, json, repository, succeed};
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::source::{Received, Source as _, TextLog};

#[path = "../../../drivers/tests/common/ethercat.rs"]
#[allow(dead_code, reason = "not all is used here")]
mod wire;

use wire::{Datagram, Pcapng, START_NS};

/// Bytes of the outputs and of the inputs of a drive in config/eni/cia402_six_drives.xml.
const OUTPUTS: usize = 6;
const INPUTS: usize = 10;
const AXES: usize = 6;

/// The frames of the simulated arm, in a log.
fn simulate(cell: &Installation) -> PathBuf {
    let log = cell.path("arm.log");
    let bus = format!("log:{}", log.display());
    let scenario = cell.scenario(&[("tail_s = 0.6", "tail_s = 1.5")]);
    succeed(&[&"sim", &"--cell", &cell.cell(), &"--bus", &bus, &"--scenario", &scenario]);
    log
}

fn frames(log: &Path) -> Vec<Frame> {
    let mut source = TextLog::open(log, &[]).unwrap();
    let (mut frames, mut batch) = (Vec::new(), Vec::with_capacity(4096));
    while source.receive(&mut batch, Duration::ZERO).unwrap() == Received::Frames {
        frames.append(&mut batch);
    }
    frames
}

/// The same on the wire: the distributed clock, process data and AL status of each cycle.
fn capture(frames: &[Frame]) -> Pcapng {
    let sync = FrameId::Standard(0x080);
    let mut capture = Pcapng::new();
    for (index, cycle) in (0..=u8::MAX).cycle().zip(frames.chunk_by(|_, next| next.id != sync)) {
        let mut image = vec![0; AXES * (OUTPUTS + INPUTS)];
        for frame in &cycle[1..] {
            let (id, data) = (frame.id.number() as usize, frame.data());
            if id < 0x200 {
                // Network state, position, torque, status word; on the wire the last comes first.
                let inputs = &mut image[AXES * OUTPUTS + INPUTS * (id - 0x181)..];
                inputs[2..8].copy_from_slice(&data[1..7]);
                inputs[..2].copy_from_slice(&data[7..9]);
            } else {
                let outputs = &mut image[OUTPUTS * (id - 0x201)..];
                outputs[2..6].copy_from_slice(&data[..4]);
            }
        }
        let stamp_ns = START_NS + cycle[0].stamp_ns;
        let datagram = |command, address, data: &[u8], working_counter| Datagram {
            command,
            index,
            address,
            data: data.to_vec(),
            working_counter,
        };
        let clock = datagram(14, 0x0910_03E9, &stamp_ns.to_le_bytes(), 6);
        let process_data = datagram(12, 0x0100_0000, &image, 18);
        let status = datagram(7, 0x0130_0000, &[8, 0], 6);
        capture.exchange(stamp_ns, &[clock, process_data, status]);
    }
    capture
}

#[test]
fn a_capture_gives_what_a_log_of_the_same_frames_does() {
    let cell = Installation::from_cell("tx40-ethercat", &[("\"didim\"", "\"idim-ls\"")]);
    let log = simulate(&cell);
    let tapped = cell.path("tx40.pcapng");
    fs::write(&tapped, capture(&frames(&log)).0).unwrap();

    let checked = succeed(&[&"check", &"--cell", &cell.cell(), &"--other-machine"]);
    assert!(checked.contains("the configuration is valid"), "{checked}");
    fn run(command: &str, file: &Path, cell: &Installation) -> serde_json::Value {
        let input: &[&dyn AsRef<std::ffi::OsStr>] =
            if command == "identify" { &[&"--input", &file] } else { &[&file] };
        let all_arguments =
            [&[&command as &dyn AsRef<std::ffi::OsStr>, &"--json", &"--cell"], input];
        let cell = cell.cell();
        let arguments = [all_arguments[0], &[&cell], all_arguments[1]].concat();
        json(&succeed(&arguments))
    }
    let result = run("identify", &tapped, &cell);
    assert!(result["parameters"].as_array().unwrap().len() > 20, "{result}");
    assert_eq!(result["parameters"], run("identify", &log, &cell)["parameters"]);
    assert_eq!(
        run("replay", &tapped, &cell)["parameters"],
        run("replay", &log, &cell)["parameters"]
    );

    fn table(file: &Path, name: &str, cell: &Installation) -> Vec<u8> {
        let out = cell.path(name);
        succeed(&[&"convert", &"--cell", &cell.cell(), &file, &out]);
        fs::read(out).unwrap()
    }
    let recording = cell.path("arm.mcap");
    assert!(!table(&tapped, "arm.mcap", &cell).is_empty());
    let expected = table(&log, "log.csv", &cell);
    assert!(
        table(&tapped, "tap.csv", &cell) == expected
            && table(&recording, "mcap.csv", &cell) == expected
    );
}

#[test]
fn a_capture_and_a_layout_of_another_bus_are_refused_with_a_remedy() {
    let cell = Installation::from_cell("tx40-ethercat", &[]);
    let missing = didim(&[&"check", &"--cell", &cell.cell()]);
    assert!(missing.stdout.contains("tx40.pcapng: there is no such file"), "{missing:?}");
    let cell = Installation::from_cell("tx40-ethercat", &[("pcap:tx40.pcapng", "can:can0")]);
    let refused = didim(&[&"check", &"--cell", &cell.cell()]);
    assert!(refused.code == Some(78) && refused.stderr.contains("pcap:FILE"), "{refused:?}");

    let cell = Installation::from_cell("tx40-cia402", &[]);
    let tapped = repository("drivers/tests/golden/ethercat/traps.pcapng");
    let refused = didim(&[&"identify", &"--cell", &cell.cell(), &"--input", &tapped]);
    assert!(refused.code == Some(1) && refused.stderr.contains("`eni`"), "{refused:?}");
    // Of another configuration: nothing of it is what the ENI file says.
    let cell = Installation::from_cell("tx40-ethercat", &[]);
    let refused = didim(&[&"identify", &"--cell", &cell.cell(), &"--input", &tapped]);
    assert!(refused.stderr.contains("no cyclic process data in this capture"), "{refused:?}");
}

/// From the start-up in a capture to samples, without any other file.
#[test]
fn a_start_up_stands_in_for_the_eni_file() {
    let addresses: Vec<String> =
        (1001..1007).map(|address| format!("{{ address = {address} }}")).collect();
    let names: Vec<String> =
        (1..7).map(|axis| format!("  {{ name = \"Axis_{axis}\" }},\n")).collect();
    let cell = Installation::from_cell(
        "tx40-ethercat",
        &[(&names.concat(), &addresses.join(",\n")), ("eni = \"", "startup = \"start.pcapng\" #")],
    );
    let mut start = Pcapng::new();
    for (axis, station) in (0..).zip(1001..1007) {
        start.pdos(station, 0x1C12, &[(0x1600, &[0x6040_0010, 0x607A_0020])]);
        let inputs = [0x6041_0010, 0x6064_0020, 0x6074_0010, 0x6077_0010];
        start.pdos(station, 0x1C13, &[(0x1A00, &inputs)]);
        start.unit(station, 0, (0x0100_0000 + 6 * axis, 6), 2);
        start.unit(station, 1, (0x0100_0024 + 10 * axis, 10), 1);
    }
    let process_data = Datagram {
        command: 12,
        index: 0,
        address: 0x0100_0000,
        data: vec![0; 96],
        working_counter: 18,
    };
    start.exchange(START_NS, &[process_data]);
    fs::write(cell.path("start.pcapng"), &start.0).unwrap();
    let checked = succeed(&[&"check", &"--cell", &cell.cell(), &"--other-machine"]);
    assert!(checked.contains("the configuration is valid"), "{checked}");
    fs::remove_file(cell.path("start.pcapng")).unwrap();
    let refused = didim(&[&"check", &"--cell", &cell.cell(), &"--other-machine"]);
    assert!(refused.code == Some(78) && refused.stderr.contains("start.pcapng"), "{refused:?}");
}
