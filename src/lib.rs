//! The service: from frames on a drive bus to identified parameters.
//!
//! The table lists the modules and the dependencies that `tests/arrows` permits. Without Linux,
//! there is no service: `check`, `service` and most of [`live`] are left out.
//!
//! | module | content | uses |
//! |---|---|---|
//! | [`proposal`] | a cell file from an arm and its data | `cell`, `live`, `text` |
//! | `check` | problems before the start: of a cell by itself, and of this machine | all below |
//! | `service` | the running service: its parts, supervision, status, metrics | all below |
//! | [`report`] | results for people: terminal, HTML, figures | all below |
//! | [`analysis`] | screening, identification, prediction, payload, gains, export | all below |
//! | [`cell`] | a cell file, validated | all below |
//! | [`live`] | bus thread, shared memory, worker, recordings | all below |
//! | [`archive`] | results on disk, and their drift from the baseline | all below |
//! | [`signals`] | SIGINT, SIGTERM and SIGHUP, for everything that waits | `files` |
//! | [`files`] | files replaced completely or not at all, configuration read within bounds | – |
//! | [`window`] | the samples that one result comes from | – |
//! | [`text`] | numbers and tables in plain text | – |
//! | [`threads`] | independent pieces of work on all processors | – |

#![cfg_attr(
    not(target_os = "linux"),
    allow(dead_code, unused_imports, reason = "the service alone uses it")
)]

// For code that tests share with other packages.
#[cfg(test)]
extern crate self as didim;

pub mod analysis;
pub mod archive;
pub mod cell;
#[cfg(target_os = "linux")]
pub mod check;
#[cfg(test)]
#[path = "../tests/common/expectation.rs"]
mod expectation;
pub mod files;
pub mod live;
pub mod proposal;
pub mod report;
#[cfg(test)]
mod seeds;
#[cfg(target_os = "linux")]
pub mod service;
pub mod signals;
pub mod text;
pub mod threads;
pub mod window;
