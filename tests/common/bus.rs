//! An arm on an in-process bus or in a log: one packed frame per sample, all six motors turning
//! alike while they turn.

use didim_drivers::assemble::Assembler;
use didim_drivers::frame::Frame;
use didim_drivers::layout::{CompiledLayout, CycleValues, Role};
use didim_drivers::source::InterfaceName;
use didim_drivers::units::{DriveSpec, Scales};

/// Samples per second of [`layout`].
pub(crate) const RATE_HZ: f64 = 1000.0;

pub(crate) fn layout() -> CompiledLayout {
    let dbc = include_str!("../../config/dbc/packed_fd_six_axes.dbc");
    let spec = toml::from_str(
        r#"
        dbc = "../dbc/packed_fd_six_axes.dbc"
        axes = 6
        period_us = 1000.0
        position = { signal = "Sample.Position_{axis}", valid = "instant" }
        torque = { signal = "Sample.Torque_{axis}", valid = "instant" }
        reference = { signal = "Sample.Reference_{axis}", valid = "instant" }
        counter = "Sample.Counter"
        "#,
    );
    CompiledLayout::compile(dbc, &spec.unwrap()).unwrap()
}

pub(crate) fn assembler() -> Assembler {
    let layout = layout();
    let drive: DriveSpec = toml::from_str(
        r#"
        position.scale = { counts_per_revolution = 65536.0 }
        position.sign = 1
        position.zero = 0.0
        position.wraps = "refuse"
        position.provenance = "test"
        torque = { scale = { nm_per_count = 0.001 }, sign = 1, provenance = "test" }
        "#,
    )
    .unwrap();
    let scales = Scales::new(&vec![drive; layout.axes()], &layout).unwrap();
    Assembler::new(layout, scales)
}

/// The frames of `length` samples; the motors turn at 64 counts per sample, 6.1 rad/s, while
/// `turns` says so.
pub(crate) fn frames(length: u64, turns: impl Fn(u64) -> bool) -> Vec<Frame> {
    let layout = layout();
    let mut values = CycleValues::default();
    let mut frames = Vec::new();
    for counter in 0..length {
        values.counter = counter;
        for axis in &mut values.axes {
            if turns(counter) {
                axis.position += 64.0;
            }
            axis.torque = (counter % 100) as f64;
            axis.reference = axis.position;
        }
        layout.encode(Role::Sample, &values, counter * 1_000_000, &mut frames).unwrap();
    }
    frames
}

pub(crate) fn interface() -> InterfaceName {
    InterfaceName::new("sim0").unwrap()
}

/// The real CAN interface to test on.
pub(crate) fn vcan() -> String {
    let names = std::env::var("DIDIM_VCAN").expect("DIDIM_VCAN names the interfaces: tests/run");
    names.split(',').next().unwrap().to_owned()
}
