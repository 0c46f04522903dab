//! The command line as scripts and people meet it: exit codes, messages, files, `--json`.
//!
//! Exit codes: 0 done; 1 refused or failed; 2 usage; 78 configuration. A refusal says what, where
//! and what to do, prints nothing on stdout, and leaves no file half written.

mod support;

mod arguments;
mod check;
mod comparison;
mod configuration;
mod conversion;
mod dialogue;
mod fleet;
mod golden;
mod history;
mod identification;
mod log_forms;
mod logs;
mod manual;
mod memory;
mod outputs;
mod pipeline;
mod report;
mod streams;
mod study;
mod tables;
mod terminal;
mod top;
