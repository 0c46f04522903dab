//! The service: from frames on a drive bus to identified parameters.
//!
//! The rooms, and what each may use; `tests/arrows` holds them to it.
//!
//! | room | what it is | uses |
//! |---|---|---|
//! | [`proposal`] | a cell file from an arm and a table, a bag or a DBC file of it | `cell`, `live`, `text` |
//! | [`check`] | what would not work: a cell by itself, and this machine | all below |
//! | [`service`] | the running service: its parts put together, supervision, status, metrics | all below |
//! | [`report`] | results for people: terminal, HTML, figures | all below |
//! | [`offline`] | a whole measurement at once: logs as measurements, identification, comparison of methods | all below |
//! | [`cell`] | a cell file, validated | all below |
//! | [`live`] | bus thread, shared memory, worker, recordings | all below |
//! | [`archive`] | results on disk, and their drift from the baseline | all below |
//! | [`signals`] | SIGINT, SIGTERM and SIGHUP, for everything that waits | `files` |
//! | [`files`] | files replaced whole or not at all, configuration read within bounds | – |
//! | [`window`] | the samples that one result comes from | – |
//! | [`text`] | numbers and tables in plain text | – |

pub mod archive;
pub mod cell;
pub mod check;
pub mod files;
pub mod live;
pub mod offline;
pub mod proposal;
pub mod report;
pub mod service;
pub mod signals;
pub mod text;
pub mod window;
