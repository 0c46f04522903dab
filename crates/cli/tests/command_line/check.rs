//! `didim check`: faults put in on purpose, and what it finds of them.

use serde_json::Value;

use super::support::{Configuration, Folder, cia402_cell, didim, packed_cell};

const PACKED: &str = "cells/tx40-packed-fd.toml";
const CIA402: &str = "cells/tx40-cia402.toml";
const ROBOT: &str = "robots/tx40.toml";

/// The findings of a cell as `severity key: what`, wherever it runs.
fn findings_of(cell: &str, code: i32) -> Vec<String> {
    let outcome = didim(&["check", "--cell", cell, "--other-machine", "--json"]);
    assert_eq!(outcome.code, Some(code), "{outcome:#?}");
    let answer: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(answer["schema"], 1);
    assert_eq!(answer["sound"], code == 0, "{answer:#}");
    let findings = answer["findings"].as_array().unwrap();
    findings
        .iter()
        .map(|finding| {
            let part = |key: &str| finding[key].as_str().unwrap().to_owned();
            assert!(!part("remedy").is_empty(), "{finding}");
            format!("{} {}: {}", part("severity"), part("key"), part("what"))
        })
        .collect()
}

#[track_caller]
fn finds(cell: &str, code: i32, beginning: &str, says: &[&str]) {
    let findings = findings_of(cell, code);
    let finding = findings.iter().find(|finding| finding.starts_with(beginning));
    let finding = finding.unwrap_or_else(|| panic!("no {beginning:?} in {findings:#?}"));
    for part in says {
        assert!(finding.contains(part), "should say {part:?}: {finding}");
    }
}

/// One correction after the other would take as many runs.
#[test]
fn all_that_is_wrong_is_said_at_once() {
    let several =
        Configuration::with_edit(PACKED, "\"../robots/tx40.toml\"", "\"../nowhere.toml\"");
    several.edit(PACKED, "bitrate_bps = 1000000\ndata", "bitrate_bps = 20\ndata");
    several.edit(PACKED, "[service]", "[service]\nkeep_results = 0");
    let cell = several.packed_cell();
    let said =
        ["3 errors:", "nowhere.toml", "`bus.bitrate_bps`: 20 bit/s", "`service.keep_results`"];
    didim(&["check", "--cell", &cell]).refused(78, &said);
    let findings = findings_of(&cell, 78);
    let keys: Vec<&str> = findings.iter().map(|one| one.split(": ").next().unwrap()).collect();
    let expected = ["error robot", "error bus.bitrate_bps", "error service.keep_results"];
    assert_eq!(keys, expected, "{findings:#?}");
    // Other commands say the first.
    let sim = didim(&["sim", "--cell", &cell, "--bus", "log:x.log"]).refused(78, &["nowhere.toml"]);
    assert!(!sim.contains("keep_results"), "{sim}");

    let names = Configuration::with_edit(PACKED, "\"zz1r\"", "\"zz9\", \"zz8\"");
    let said = ["2 errors", "`zz9` is not a base parameter", "`zz8` is not a base parameter"];
    didim(&["check", "--cell", &names.packed_cell()]).refused(78, &said);

    // Keys that nobody knows, and values of another type.
    let typed = Configuration::with_edit(PACKED, "[service]", "[service]\nkep_results = 3");
    typed.edit(PACKED, "min_s = 3.0", "min_s = \"3 s\"");
    typed.edit(PACKED, "factor = 125", "factor = \"many\"");
    let said = ["3 errors:", "kep_results", "`keep_results`", "window.min_s", "decimation_filter"];
    didim(&["check", "--cell", &typed.packed_cell()]).refused(78, &said);
}

#[test]
fn errors_stand_before_warnings_and_these_before_notes() {
    let cell = Configuration::with_edit(CIA402, "rate_hz = 500.0", "rate_hz = 1000.0");
    cell.edit(CIA402, "\"drive of the simulated arm: 6076h\"", "\"a guess\"");
    let outcome = didim(&["check", "--cell", &cell.path(CIA402), "--other-machine"]);
    let place_of = |part: &str| outcome.stdout.find(part).unwrap_or_else(|| panic!("{outcome:#?}"));
    let places = [
        place_of("the configuration is not suitable: 1 error, 1 warning\n"),
        place_of("\nerror\n  bus.bitrate_bps"),
        place_of("\nwarning\n  bus.drives[1].torque.provenance"),
    ];
    assert!(places.is_sorted(), "{outcome:#?}");
    // Drives of which the same is said share a line.
    assert!(outcome.stdout.contains("\ndrive 1: ") && outcome.stdout.contains("\ndrives 2 to 6: "));
}

/// That of the service of a machine, which this one hardly has.
#[test]
fn the_cell_of_the_service_is_taken_where_none_is_named() {
    let file = "/etc/didim/cell.toml";
    let outcome = didim(&["check", "--other-machine"]);
    let message = format!("didim: the cell is {file}, as --cell names none\n");
    assert!(outcome.stderr.starts_with(&message), "{outcome:#?}");
    if !std::path::Path::new(file).exists() {
        outcome.refused(78, &[file, "No such file"]);
    }
    let named = didim(&["check", "--other-machine", "--cell", &packed_cell()]);
    assert!(!named.stderr.contains(file), "{named:#?}");
}

/// Six drives with a transmit and a receive PDO each and SYNC, 8 bytes: 1.675 Mbit/s at 1 kHz with
/// the worst stuffing, and half of that at 500 Hz.
#[test]
fn six_drives_fit_one_megabit_at_500_hz_and_not_at_1_khz() {
    finds(&cia402_cell(), 0, "warning bus.bitrate_bps", &["500.0 Hz take 83.7 % of 1 Mbit/s"]);
    let fast = Configuration::with_edit(CIA402, "rate_hz = 500.0", "rate_hz = 1000.0");
    let cell = fast.path(CIA402);
    finds(&cell, 78, "error bus.bitrate_bps", &["1000 Hz take 167 % of 1 Mbit/s"]);
    didim(&["check", "--cell", &cell, "--other-machine"])
        .says(78, &["1 error; the cell will not work"]);
    // Two buses share the frames.
    fast.edit(CIA402, "\"can:vcan0\"", "[\"can:vcan0\", \"can:vcan1\"]");
    finds(&cell, 0, "warning bus.bitrate_bps", &["take 83.7 %", "over 2 buses"]);
}

#[test]
fn a_packed_frame_needs_a_fast_data_phase() {
    let findings = findings_of(&packed_cell(), 0);
    assert!(!findings.iter().any(|finding| finding.contains("bitrate")), "{findings:#?}");
    let slow = Configuration::with_edit(PACKED, "data_bitrate_bps = 8000000\n", "");
    let says = ["356 % of 1 Mbit/s without a faster data phase"];
    finds(&slow.packed_cell(), 78, "error bus.bitrate_bps", &says);
    slow.edit(PACKED, "bitrate_bps = 1000000\n", "");
    finds(&slow.packed_cell(), 0, "note bus.bitrate_bps", &["not given"]);
}

#[test]
fn gains_that_nobody_vouches_for_are_found() {
    let guess = Configuration::with_edit(PACKED, "\"drive of the simulated arm\"", "\"a guess\"");
    let key = "warning bus.drives[1].torque.provenance";
    finds(&guess.packed_cell(), 0, key, &["`a guess`"]);
}

/// A joint whose limits leave it no room has no friction of its own; its drive is turned by joint
/// 5.
#[test]
fn parameters_of_a_joint_that_cannot_move_are_found() {
    let locked = Configuration::new();
    let path = locked.path(ROBOT);
    let text = std::fs::read_to_string(&path).unwrap();
    let (others, last) = text.split_at(text.rfind("position_min_deg = -270").unwrap());
    let last = last.replacen("= -270.0", "= 269.99999", 1);
    assert!(last.contains("position_max_deg = 270"), "{last}");
    std::fs::write(&path, format!("{others}{last}")).unwrap();
    let cell = locked.packed_cell();
    let says = ["fv6 fc6", "joint 6 cannot move"];
    finds(&cell, 78, "error identification.parameters", &says);
}

#[test]
fn filters_windows_and_a_missing_reference_are_found() {
    let cell = Configuration::with_edit(PACKED, "cutoff_hz = 200.0", "cutoff_hz = 20.0");
    let key = "warning identification.position_filter";
    finds(&cell.packed_cell(), 0, key, &["20.0 Hz smooths", "16.0 Hz"]);
    cell.edit(PACKED, "cutoff_hz = 20.0", "cutoff_hz = 2000.0");
    finds(&cell.packed_cell(), 0, key, &["2000 Hz", "noise"]);
    cell.edit(PACKED, "min_s = 3.0", "min_s = 0.1");
    let says = ["24 rows for 28 parameters", "0.69 independent", "requires 8"];
    finds(&cell.packed_cell(), 0, "warning window.min_s", &says);

    let reference =
        "reference = { signal = \"RPDO1_{axis}.TargetPosition\", valid = \"next-sync\" }";
    let without = Configuration::with_edit(CIA402, reference, "");
    let says = ["didim simulates", "nearly that of idim-ls"];
    finds(&without.path(CIA402), 0, "warning bus.layout.reference", &says);
}

/// 28 parameters ask for 8 × 28 independent rows: 280 of six joints at 0.8 of the Nyquist
/// frequency, 47 of each, of which there are 40 a second.
#[test]
fn a_window_is_too_short_where_the_verdict_says_so() {
    fn warned(cell: &str) -> Vec<String> {
        let findings = findings_of(cell, 0);
        let keys =
            findings.iter().filter_map(|f| f.strip_prefix("warning window.")?.split(':').next());
        keys.map(str::to_owned).collect::<Vec<_>>()
    }
    let configuration = Configuration::with_edit(PACKED, "min_s = 3.0", "min_s = 1.16");
    let cell = configuration.packed_cell();
    assert_eq!(warned(&cell), ["min_s"]);
    configuration.edit(PACKED, "min_s = 1.16", "min_s = 1.18");
    assert_eq!(warned(&cell), [""; 0]);
    configuration.edit(PACKED, "factor = 125 }", "factor = 125, cutoff_ratio = 0.7 }");
    assert_eq!(warned(&cell), ["min_s"]);
    let limits = "[identification.limits]\nrows_per_parameter = 6.0\n\n[identification.simulation]";
    configuration.edit(PACKED, "[identification.simulation]", limits);
    assert_eq!(warned(&cell), [""; 0]);

    // Windows by interval have one length, and `min_s` decides nothing.
    let motion = "{ by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5 }";
    configuration.edit(PACKED, "min_s = 1.18", "min_s = 0.1");
    configuration.edit(PACKED, motion, "{ by = \"interval\", length_s = 1.5 }");
    assert_eq!(warned(&cell), [""; 0]);
    configuration.edit(PACKED, "length_s = 1.5", "length_s = 0.5");
    assert_eq!(warned(&cell), ["trigger.length_s"]);
}

/// At 0.4 of the Nyquist frequency after decimation, 20 Hz, the filter keeps half of what it does
/// at 0.8.
#[test]
fn the_position_filter_is_held_to_the_decimation_filter_of_the_cell() {
    let cell = Configuration::with_edit(PACKED, "cutoff_hz = 200.0", "cutoff_hz = 20.0");
    let key = "warning identification.position_filter";
    finds(&cell.packed_cell(), 0, key, &["up to 16.0 Hz"]);
    cell.edit(PACKED, "factor = 125 }", "factor = 125, cutoff_ratio = 0.4 }");
    let findings = findings_of(&cell.packed_cell(), 0);
    assert!(!findings.iter().any(|finding| finding.starts_with(key)), "{findings:#?}");
}

#[test]
fn a_file_that_cannot_be_read_is_a_finding_too() {
    let unknown = Configuration::with_edit(PACKED, "[bus]\nsource", "[bus]\nsorce");
    let cell = unknown.packed_cell();
    finds(&cell, 78, "error :", &["line 7", "`sorce`", "did you mean `source`?"]);
    didim(&["check", "--cell", &cell]).refused(78, &[&cell, "line 7", "did you mean `source`?"]);
    let signal = Configuration::with_edit(PACKED, "Sample.Torque_{axis}", "Sample.Torqe_{axis}");
    finds(&signal.packed_cell(), 78, "error bus.layout", &["Torqe_1", "similar: `Torque_1`"]);
    for (from, to, key) in [
        ("bitrate_bps = 1000000\n", "bitrate_bps = 2000000\n", "bus.bitrate_bps"),
        ("data_bitrate_bps = 8000000", "data_bitrate_bps = 500000", "bus.data_bitrate_bps"),
    ] {
        let wrong = Configuration::with_edit(PACKED, from, to);
        finds(&wrong.packed_cell(), 78, &format!("error {key}:"), &["00000"]);
    }
}

/// An interface that no machine has: an error here, and none of the cell's.
#[test]
fn what_is_missing_here_is_distinguished() {
    let folder = Folder::new();
    let cell = std::fs::read_to_string(packed_cell()).unwrap();
    let configuration = Configuration::new();
    std::fs::write(
        configuration.packed_cell(),
        cell.replace("can:vcan0", "can:nothere0").replace("/var/lib/didim", &folder.path("state")),
    )
    .unwrap();
    let cell = configuration.packed_cell();
    didim(&["check", "--cell", &cell, "--other-machine"]).done();
    let outcome = didim(&["check", "--cell", &cell]);
    let says =
        ["can:nothere0: there is no such interface", "this machine is not suitable: 1 error"];
    assert!(says.iter().all(|part| outcome.stdout.contains(part)), "{}", outcome.stdout);
    outcome.says(78, &["1 error; the cell will not work"]);
    assert_eq!(folder.names(), [""; 0], "a check writes nothing");
}

/// A fault in a device file, or in its place, is named with the file, the section and the key.
#[test]
fn a_wrong_device_file_is_named() {
    const EDS: &str = "eds/cia402_drive.eds";
    const CELL: &str = "cells/tx40-cia402-eds.toml";
    let wrong = Configuration::with_edit(EDS, "0x60640020", "0x60630020");
    let says = ["cia402_drive.eds", "`position.object`", "TPDO of node 1", "6064:00", "6063:00"];
    finds(&wrong.path(CELL), 78, "error bus.layout", &says);
    let missing = Configuration::with_edit(CELL, "eds/cia402_drive", "eds/nowhere");
    let says = ["`bus.layout.nodes`", "nowhere.eds", "No such file"];
    finds(&missing.path(CELL), 78, "error bus.layout.nodes", &says);
    // Neither the one nor the other.
    let none = Configuration::with_edit(PACKED, "dbc = \"../dbc/packed_fd_six_axes.dbc\"\n", "");
    finds(&none.packed_cell(), 78, "error bus.layout:", &["`dbc`", "`nodes`"]);
    // As older tools write: Latin-1.
    let latin = Configuration::new();
    let path = latin.path(EDS);
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.extend(b"; Antriebsverst\xe4rker\n");
    std::fs::write(&path, bytes).unwrap();
    didim(&["check", "--cell", &latin.path(CELL), "--other-machine"]).done();
}

/// A service that runs can be asked, whatever its cell file has become.
#[test]
fn a_mistake_in_the_cell_hides_no_service() {
    let folder = Folder::new();
    let cell = Configuration::with_edit(PACKED, "[bus]\nsource", "[bus]\nsorce");
    let runtime = folder.path("run");
    cell.edit(PACKED, "/run/didim", &runtime);
    let file = cell.packed_cell();
    let socket = format!("{runtime}/status.sock");
    didim(&["status", "--cell", &file]).refused(1, &[&socket, "has mistakes", "didim check"]);
    // What is no TOML names no folder.
    std::fs::write(&file, "[service").unwrap();
    didim(&["status", "--cell", &file]).refused(78, &[&file, "line 1"]);
}
