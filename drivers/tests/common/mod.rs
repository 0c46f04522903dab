//! The shipped DBC files with a layout for each.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

pub(crate) mod bus;
pub(crate) mod ethercat;

use didim_drivers::layout::CompiledLayout;

pub(crate) const CIA402: &str = r#"
dbc = "../dbc/cia402_six_axes.dbc"
axes = 6
rate_hz = 250.0
sync = "SYNC"
position = { signal = "TPDO1_{axis}.PositionActualValue", valid = "instant" }
torque.signal = "TPDO1_{axis}.TorqueDemand"
torque.valid = { held = { hold_us = 4000.0, delay_us = 0.0 } }
reference = { signal = "RPDO1_{axis}.TargetPosition", valid = "next-sync" }
status_word = "TPDO1_{axis}.StatusWord"
"#;

pub(crate) const PACKED: &str = r#"
dbc = "../dbc/packed_fd_six_axes.dbc"
axes = 6
period_us = 200.0
position = { signal = "Sample.Position_{axis}", valid = "instant" }
torque = { signal = "Sample.Torque_{axis}", valid = "instant" }
reference = { signal = "Sample.Reference_{axis}", valid = "instant" }
counter = "Sample.Counter"
"#;

pub(crate) fn cia402_dbc() -> &'static str {
    include_str!("../../../config/dbc/cia402_six_axes.dbc")
}

pub(crate) fn packed_dbc() -> &'static str {
    include_str!("../../../config/dbc/packed_fd_six_axes.dbc")
}

pub(crate) fn compile(dbc: &str, layout: &str) -> CompiledLayout {
    CompiledLayout::compile(dbc, &toml::from_str(layout).unwrap()).unwrap()
}

pub(crate) fn cia402() -> CompiledLayout {
    compile(cia402_dbc(), CIA402)
}

pub(crate) fn packed() -> CompiledLayout {
    compile(packed_dbc(), PACKED)
}
