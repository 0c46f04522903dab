//! The program, as it is called.

#[path = "../../tests/common/mod.rs"]
mod common;
mod program;

mod command_line;
mod metrics;
mod pipeline;
mod privileges;
mod real_arms;
mod recording;
mod recordings;
mod reload;
mod stored;
mod vcan;
