//! The shipped DBC files with a layout for each, as the drives of the scenarios speak.
#![allow(dead_code, reason = "every test takes what it needs")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use didim_drivers::layout::CompiledLayout;
use didim_sim::{PlaybackConfig, Scenario};

/// The drives' loops run at 5 kHz, so a torque demand acts for 200 µs whatever the bus cycle is.
const CIA402: &str = r#"
dbc = "cia402_six_axes.dbc"
axes = 6
rate_hz = 500.0
sync = "SYNC"
position = { signal = "TPDO1_{axis}.PositionActualValue", valid = "instant" }
torque = { signal = "TPDO1_{axis}.TorqueDemand", valid = { held = { hold_us = 200.0, delay_us = 0.0 } } }
reference = { signal = "RPDO1_{axis}.TargetPosition", valid = "next-sync" }
status_word = "TPDO1_{axis}.StatusWord"
"#;

const PACKED: &str = r#"
dbc = "packed_fd_six_axes.dbc"
axes = 6
rate_hz = 5000.0
position = { signal = "Sample.Position_{axis}", valid = "instant" }
torque = { signal = "Sample.Torque_{axis}", valid = { held = { hold_us = 200.0, delay_us = 0.0 } } }
reference = { signal = "Sample.Reference_{axis}", valid = "instant" }
counter = "Sample.Counter"
"#;

pub(crate) fn cia402() -> CompiledLayout {
    let dbc = include_str!("../../../config/dbc/cia402_six_axes.dbc");
    CompiledLayout::compile(dbc, &toml::from_str(CIA402).unwrap()).unwrap()
}

pub(crate) fn packed() -> CompiledLayout {
    let dbc = include_str!("../../../config/dbc/packed_fd_six_axes.dbc");
    CompiledLayout::compile(dbc, &toml::from_str(PACKED).unwrap()).unwrap()
}

/// The paper's arm with short rests.
pub(crate) fn scenario() -> Scenario {
    let playback = PlaybackConfig { lead_in_s: 0.02, tail_s: 0.02, cycles: Some(1) };
    didim_sim::tx40_paper().unwrap().with_playback(playback).unwrap()
}
