//! What several tests need: the buses of the shipped cells, as the drives of the scenarios speak.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

pub(crate) mod experiment;
pub(crate) mod parallel;
pub(crate) mod table;

use didim_drivers::layout::{CompiledLayout, LayoutSpec};
use didim_drivers::units::{DriveSpec, Scales};
use didim_sim::{PlaybackConfig, Scenario};
use serde::Deserialize;

#[derive(Deserialize)]
struct Cell {
    bus: Bus,
}

#[derive(Deserialize)]
struct Bus {
    layout: LayoutSpec,
    drives: Vec<DriveSpec>,
}

pub(crate) fn bus(cell: &str, dbc: &str) -> (CompiledLayout, Scales) {
    let Cell { bus } = toml::from_str(cell).unwrap();
    let layout = CompiledLayout::compile(dbc, &bus.layout).unwrap();
    let scales = Scales::new(&bus.drives, &layout).unwrap();
    (layout, scales)
}

pub(crate) fn cia402() -> (CompiledLayout, Scales) {
    bus(
        include_str!("../../../config/cells/tx40-cia402.toml"),
        include_str!("../../../config/dbc/cia402_six_axes.dbc"),
    )
}

pub(crate) fn packed() -> (CompiledLayout, Scales) {
    bus(
        include_str!("../../../config/cells/tx40-packed-fd.toml"),
        include_str!("../../../config/dbc/packed_fd_six_axes.dbc"),
    )
}

/// The paper's arm with short rests.
pub(crate) fn scenario() -> Scenario {
    let playback = PlaybackConfig { lead_in_s: 0.02, tail_s: 0.02, cycles: Some(1) };
    didim_sim::tx40_paper().unwrap().with_playback(playback).unwrap()
}
