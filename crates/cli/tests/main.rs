//! The program, as it is called.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and says what it found"
)]

#[path = "../../../tests/common/mod.rs"]
mod common;
mod program;

mod alternatives;
#[path = "../../formats/tests/bag_writer.rs"]
mod bag_writer;
mod bundle;
mod can_arms;
mod command_line;
mod data;
mod design;
mod ethercat;
mod export;
mod external_torque;
mod free_memory;
mod known_torques;
mod load;
mod machine;
mod many_axes;
mod metrics;
mod new;
mod next;
mod payload;
mod pipeline;
mod privileges;
mod real_arms;
mod recording;
mod recordings;
mod reload;
mod repeated;
mod result_schema;
mod results;
mod settings;
mod seven_axes;
mod sqlite_bag;
mod state;
mod stored;
mod strangers;
mod table_layouts;
mod urdf;
mod vcan;
