//! Wrong cell, robot and DBC files: exit code 78 from every command that reads them.

use super::support::{Configuration, Folder, data, didim, packed_cell, shipped};

const CELL: &str = "cells/tx40-packed-fd.toml";
const ROBOT: &str = "robots/tx40.toml";
const DBC: &str = "dbc/packed_fd_six_axes.dbc";

/// An edit of a shipped file, and what has to be said of it.
struct Corruption {
    file: &'static str,
    from: &'static str,
    to: &'static str,
    /// Whether the line of the edit has to be named.
    names_line: bool,
    says: &'static [&'static str],
}

const CORRUPTIONS: &[Corruption] = &[
    // What controls the arm.
    Corruption {
        file: CELL,
        from: "kind = \"cabinet\"",
        to: "kind = \"cabinett\"",
        names_line: true,
        says: &["unknown variant `cabinett`", "bandwidth"],
    },
    Corruption {
        file: CELL,
        from: "timing = { kind = \"sampled\", sample_period_s = 2e-4 }",
        to: "timing = { kind = \"sampled\", sample_period_s = 3e-4 }",
        names_line: false,
        says: &["controller", "300.000 µs"],
    },
    Corruption {
        file: CELL,
        from: "timing = { kind = \"sampled\", sample_period_s = 2e-4 }",
        to: "timing = { kind = \"sampled\", sample_period_s = 2e-4, computation_delay_s = 1e-4 }",
        names_line: false,
        says: &["controller", "100.000 µs", "delay"],
    },
    Corruption {
        file: CELL,
        from: "  { law = { kind = \"pd\", kp_per_rad = 358.86, kd_s_per_rad = 0.1954, k_tau_nm = \
            6.56 } },\n",
        to: "",
        names_line: false,
        says: &["controller", "joints", "5", "6"],
    },
    Corruption {
        file: CELL,
        from: "start = \"unit-drive-inertias\"",
        to: "start = \"zero\"",
        names_line: true,
        says: &["unknown variant `zero`", "idim-ls"],
    },
    // Keys of the cell.
    Corruption {
        file: CELL,
        from: "name = \"tx40-packed-fd\"\n",
        to: "",
        names_line: false,
        says: &["tx40-packed-fd.toml", "missing field `name`"],
    },
    Corruption {
        file: CELL,
        from: "rate_hz = 5000.0\n",
        to: "",
        names_line: false,
        says: &["tx40-packed-fd.toml", "rate_hz", "period_us"],
    },
    Corruption {
        file: CELL,
        from: "position_filter = { cutoff_hz = 200.0 }",
        to: "",
        names_line: false,
        says: &["tx40-packed-fd.toml", "missing field `position_filter`"],
    },
    Corruption {
        file: CELL,
        from: "margin_before_s = 0.25",
        to: "margin_before_ms = 250.0",
        names_line: true,
        says: &["tx40-packed-fd.toml", "unknown field `margin_before_ms`", "margin_before_s"],
    },
    Corruption {
        file: CELL,
        from: "position_filter = { cutoff_hz = 200.0 }",
        to: "position_filter = { cut_off_hz = 50.0 }",
        names_line: true,
        says: &["unknown field `cut_off_hz`", "`cutoff_hz`"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = \"vcan0\"",
        names_line: true,
        says: &["`vcan0` is not a bus", "can:INTERFACE"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = [\"can:vcan0\", \"can:a/b\"]",
        names_line: true,
        says: &["`can:a/b` is not a bus"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = []",
        names_line: false,
        says: &["bus.source", "can:INTERFACE"],
    },
    Corruption {
        file: CELL,
        from: "method = \"idim-ls\"",
        to: "method = \"idim-lsq\"",
        names_line: true,
        says: &["unknown variant `idim-lsq`", "idim-ls"],
    },
    // Values that cannot be meant.
    Corruption {
        file: CELL,
        from: "cutoff_hz = 200.0",
        to: "cutoff_hz = 2500.0",
        names_line: false,
        says: &["identification.position_filter", "Nyquist", "2500"],
    },
    Corruption {
        file: CELL,
        from: "factor = 125",
        to: "factor = 0",
        names_line: false,
        says: &["identification.decimation_filter"],
    },
    Corruption {
        file: CELL,
        from: "\"zz1r\"",
        to: "\"zz1\"",
        names_line: false,
        says: &["identification.parameters", "`zz1` is not a base parameter", "known: zz1r"],
    },
    Corruption {
        file: CELL,
        from: "\"fv1\", \"fc1\"",
        to: "\"fv1\", \"fv1\"",
        names_line: false,
        says: &["identification.parameters", "`fv1`", "once"],
    },
    Corruption {
        file: CELL,
        from: "zero = 0.0",
        to: "zero = nan",
        names_line: false,
        says: &["[[bus.drives]]", "drive 1", "zero", "NaN", "finite"],
    },
    Corruption {
        file: CELL,
        from: "sign = 1",
        to: "sign = 0",
        names_line: true,
        says: &["a sign is 1 or -1"],
    },
    Corruption {
        file: CELL,
        from: "provenance = \"encoder of the simulated arm\"",
        to: "provenance = \"\"",
        names_line: true,
        says: &["say where the number comes from"],
    },
    Corruption {
        file: CELL,
        from: "axes = 6",
        to: "axes = 5",
        names_line: false,
        says: &["tx40-packed-fd.toml", "5 axes", "6 joints"],
    },
    // Units: of the gain against those of the DBC file, and of the robot file's keys.
    Corruption {
        file: CELL,
        from: "scale = { nm_per_count = 1.5e-4 }",
        to: "scale = { per_mille_of_rated_torque = { rated_torque_nm = 1.4 } }",
        names_line: false,
        says: &["drive 1", "per mille", "Sample.Torque_1", "\"count\"", "correct"],
    },
    Corruption {
        file: DBC,
        from: "[-32768|32767] \"count\"",
        to: "[-32768|32767] \"A\"",
        names_line: false,
        says: &["drive 1", "count", "Sample.Torque_1", "\"A\"", "correct"],
    },
    Corruption {
        file: ROBOT,
        from: "alpha_deg = 0.0",
        to: "alpha_rad = 0.0",
        names_line: true,
        says: &["tx40.toml", "unknown field `alpha_rad`", "`alpha_deg`"],
    },
    Corruption {
        file: ROBOT,
        from: "velocity_max_rad_s = 5.009",
        to: "",
        names_line: false,
        says: &["tx40.toml", "joint 1", "velocity_max_rad_s", "add it"],
    },
    // Values with which the service could not run.
    Corruption {
        file: CELL,
        from: "name = \"tx40-packed-fd\"",
        to: "name = \"TX 40\"",
        names_line: false,
        says: &["tx40-packed-fd.toml", "`name`", "a-z 0-9"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "buffer_s = 0.0",
        names_line: false,
        says: &["tx40-packed-fd.toml", "`service.buffer_s`", "0.1..=600"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "buffer_s = 600.0",
        names_line: false,
        says: &["`service.buffer_s`", "bytes, more than the limit"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "runtime_directory = \"run/didim\"",
        names_line: false,
        says: &["`service.runtime_directory`", "absolute"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "runtime_directory = \"/run/a-folder-whose-name-is-too-long-for-it\"",
        names_line: false,
        says: &["`service.runtime_directory`", "40 bytes", "shorter"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "keep_results = 0",
        names_line: false,
        says: &["`service.keep_results`", "at least 1"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "status_mode = 660",
        names_line: false,
        says: &["`service.status_mode`", "octal numbers begin with 0o"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "status_mode = 0o060",
        names_line: false,
        says: &["`service.status_mode`", "0o600 plus"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "command_mode = 0o666",
        names_line: false,
        says: &["`service.command_mode`", "lets anyone send commands"],
    },
    Corruption {
        file: CELL,
        from: "runtime_directory = \"/run/didim\"",
        to: "command_group = \"engineers\"\ncommand_mode = 0o600",
        names_line: false,
        says: &["`service.command_group`", "`engineers` cannot connect"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = [\"can:vcan0\", \"inproc:\"]",
        names_line: false,
        says: &["`bus.source`", "`inproc:` must be the only bus"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = [\"log:x.log\", \"log:y.log\"]",
        names_line: false,
        says: &["`bus.source`", "x.log", "the only bus"],
    },
    Corruption {
        file: CELL,
        from: "source = \"can:vcan0\"",
        to: "source = [\"can:vcan0\", \"can:vcan0\"]",
        names_line: false,
        says: &["`bus.source`", "more than once"],
    },
    Corruption {
        file: CELL,
        from: "[service]",
        to: "[identification.limits]\nrelative_error = nan\n\n[service]",
        names_line: false,
        says: &["`identification.limits`", "relative_error = NaN must be finite"],
    },
    // The DBC file.
    Corruption {
        file: DBC,
        from: "SG_ Torque_3",
        to: "SG_ Moment_3",
        names_line: false,
        says: &["packed_fd_six_axes.dbc", "message `Sample` has no signal `Torque_3`", "Torque_1"],
    },
    Corruption {
        file: DBC,
        from: "BO_ 256 Sample:",
        to: "BO_ 256 Samples:",
        names_line: false,
        says: &["packed_fd_six_axes.dbc", "no message `Sample`", "`Samples`"],
    },
    Corruption {
        file: DBC,
        from: "SG_ Torque_1 : 192|16@1-",
        to: "SG_ Torque_1 : 192|@1-",
        names_line: true,
        says: &["packed_fd_six_axes.dbc", "does not parse"],
    },
    Corruption {
        file: DBC,
        from: "SG_ Torque_6 : 272|16@1-",
        to: "SG_ Torque_6 : 504|16@1-",
        names_line: true,
        says: &["Sample.Torque_6", "beyond the 64 bytes"],
    },
    Corruption {
        file: ROBOT,
        from: "[[joint]]",
        to: "[[joint]]\nfriction = { stribeck_rad_s = -0.1 }",
        names_line: false,
        says: &["`friction` of joint 1", "stribeck_rad_s"],
    },
    Corruption {
        file: DBC,
        from: "SG_ Torque_2 : 208|16@1-",
        to: "SG_ Torque_2 : 192|16@1-",
        names_line: false,
        says: &["torque", "the same bits"],
    },
];

#[test]
fn corruption_is_named_with_its_place() {
    let mut failures = Vec::new();
    for corrupt in CORRUPTIONS {
        println!("--- {} -> {}", corrupt.from, corrupt.to);
        let configuration = Configuration::new();
        let line = configuration.edit(corrupt.file, corrupt.from, corrupt.to);
        let outcome = didim(&["check", "--cell", &configuration.packed_cell()]);
        let text = &outcome.stderr;
        let named = format!("line {line}");
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_ascii_digit());
        let line_named = text.match_indices(&named).any(|(at, _)| ends(&text[at + named.len()..]));
        let says_all = corrupt.says.iter().all(|part| text.contains(part));
        if outcome.code != Some(78)
            || !outcome.stdout.is_empty()
            || !says_all
            || (corrupt.names_line && !line_named)
        {
            failures.push(format!("{:?} to {:?}: {outcome:#?}", corrupt.from, corrupt.to));
        }
        println!("{}", outcome.stderr);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_scenario_of_another_robot_is_refused() {
    let folder = Folder::new();
    let bus = format!("log:{}", folder.path("out.log"));
    let cell = shipped("cells/tx40-packed-fd.toml");
    didim(&["sim", "--cell", &cell, "--bus", &bus, "--scenario", "tx40-physical"])
        .refused(78, &["tx40-physical", "`tx40`", "same robot"]);
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn the_sign_model_of_the_identification_does_not_change_what_is_simulated() {
    let scenario = include_str!("../../../../sim-fixtures/scenarios/tx40-paper.toml");
    let folder = Folder::new();
    let scenario = folder.file("scenario.toml", scenario);
    let other = Configuration::with_edit(
        CELL,
        "[identification]",
        "[identification]\nsign = { model = \"tanh\", width_rad_s = 0.5 }",
    );
    let logs = [shipped(CELL), other.packed_cell()].map(|cell| {
        let log = folder.path("out.log");
        didim(&["sim", "--cell", &cell, "--scenario", &scenario, "--bus", &format!("log:{log}")])
            .done();
        std::fs::read(log).unwrap()
    });
    assert!(logs[0] == logs[1], "the simulated friction follows from the cell's sign model");
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = Folder::new();
    let missing = folder.path("nowhere.toml");
    didim(&["check", "--cell", &missing]).refused(78, &[&missing, "No such file"]);
    didim(&["check", "--cell", &folder.path("")]).refused(78, &[&folder.path("")]);

    for (key, from) in
        [("`robot`", "../robots/tx40.toml"), ("`bus.layout.dbc`", "../dbc/packed_fd_six_axes.dbc")]
    {
        let configuration = Configuration::with_edit(CELL, from, "../no-such-file");
        let says = ["tx40-packed-fd.toml", key, "no-such-file", "No such file", "relative"];
        didim(&["check", "--cell", &configuration.packed_cell()]).refused(78, &says);
    }
}

#[test]
fn every_command_refuses_a_wrong_cell_alike_and_writes_nothing() {
    let configuration = Configuration::with_edit(CELL, "\"zz1r\"", "\"zz9\"");
    let cell = configuration.packed_cell();
    let folder = Folder::new();
    let (log, figure) = (folder.path("out.log"), folder.path("out.svg"));
    let (input, bus) = (&data().packed_log, format!("log:{log}"));
    let commands: [&[&str]; 4] = [
        &["check", "--cell", &cell],
        &["sim", "--cell", &cell, "--bus", &bus],
        &["convert", "--cell", &cell, input, &log],
        &["identify", "--cell", &cell, "--input", input, "--json", "--figure", &figure],
    ];
    let messages: Vec<String> =
        commands.iter().map(|command| didim(command).refused(78, &["`zz9`", &cell])).collect();
    assert!(messages.windows(2).all(|pair| pair[0] == pair[1]), "{messages:#?}");
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn configuration_is_read_from_regular_files_only_and_up_to_a_limit() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.toml");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let large = folder.path("large.toml");
    std::fs::File::create(&large).unwrap().set_len(1 << 30).unwrap();
    let log = folder.path("out.log");
    for (odd, says) in
        [(&pipe[..], "regular file"), ("/dev/zero", "regular file"), (&large, "16 MB")]
    {
        didim(&["check", "--cell", odd]).refused(78, &[odd, says]);
        let cell = packed_cell();
        let sim = ["sim", "--cell", &cell, "--scenario", odd, "--bus", &format!("log:{log}")];
        didim(&sim).refused(2, &[odd, says]);
        let study = ["study", "--plan", odd, "--out", &folder.path("study")];
        didim(&study).refused(78, &[odd, says]);
        let robot = format!("robot = \"{odd}\"");
        let named = Configuration::with_edit(CELL, "robot = \"../robots/tx40.toml\"", &robot);
        didim(&["check", "--cell", &named.packed_cell()]).refused(78, &[odd, says]);
    }
}
