//! Names, paths and quality of service of the stream: all of them, here only.

use core::time::Duration;
use std::path::{Path, PathBuf};

use didim_core::sample::MAX_JOINTS;

use super::StreamError;
use super::message::{BATCH_SAMPLES, SampleBatch};

/// Folder of the library's files in a service's runtime folder.
pub const FOLDER: &str = "ipc";
/// Beginning of a service's names in /dev/shm.
pub const SERVICE_PREFIX: &str = "didim_";
/// How long a reader may do something else before samples are lost, unless the cell says otherwise
/// \[s\].
pub const DEFAULT_BUFFER_S: f64 = 20.0;
/// A batch that is not full is sent at this age.
const MAX_BATCH_AGE: Duration = Duration::from_millis(50);

/// Version of the samples' services: processes of different versions do not meet.
const SAMPLES_VERSION: &str = "v3";
/// Version of the services of the documents, estimates and status.
const DOCUMENTS_VERSION: &str = "v1";
/// Name of the samples' service.
pub(super) const SAMPLES: &str = "samples";
/// Name of the service by which a reader says what it has read.
pub(super) const ACKNOWLEDGEMENTS: &str = "acknowledgements";
/// Longest root path: the library puts names of its own behind it, and a socket's path has 108
/// bytes; 71 characters were seen to fail.
const MAX_ROOT: usize = 40;
/// Longest prefix of the files in /dev/shm.
const MAX_PREFIX: usize = 24;
/// Longest name of a cell.
const MAX_CELL: usize = 48;
/// The buffer's upper limit: it is locked up for as long as the service runs \[bytes\].
const MAX_BUFFER_BYTES: u64 = 1 << 30;
/// What the management segments of the library take beside the payload, generously \[bytes\].
pub(super) const MANAGEMENT_BYTES: u64 = 4 << 20;
/// Header and alignment of one slot, generously \[bytes\].
const SLOT_OVERHEAD_BYTES: u64 = 128;

/// The least that a buffer holds: a replay stops at half of it, and what it had read from the log
/// by then must fit into the other half.
const MIN_BUFFER_BATCHES: usize = 32;

/// Readers of the samples: the worker and one who watches.
pub const MAX_READERS: usize = 2;
/// Batches that one reader holds at a time.
pub const MAX_BORROWED: usize = 2;
/// Batches that the writer holds at a time: the one being filled.
pub const MAX_LOANED: usize = 1;
/// After this long without a batch a reader looks for dead processes and cleans up after them.
pub const DEAD_NODE_DEADLINE: Duration = Duration::from_secs(1);

/// The longest document \[bytes\]: an estimate of 100 parameters takes about 15 kB.
pub const MAX_DOCUMENT_BYTES: usize = 64 * 1024;
/// Processes that read a topic of documents.
pub(super) const MAX_DOCUMENT_READERS: usize = 4;
/// Documents that wait for a reader; older ones give way.
pub(super) const DOCUMENT_BUFFER: usize = 2;
/// Shared memory of one writer of a topic \[bytes\]: readers × (buffer + borrowed) + history + loaned.
pub(super) const DOCUMENT_WRITER_BYTES: u64 = (MAX_DOCUMENT_READERS * (DOCUMENT_BUFFER + 1) + 1 + 1)
    as u64
    * (MAX_DOCUMENT_BYTES as u64 + 128);

/// Where a cell's stream is and how much it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamOptions {
    /// Name of the cell: 1 to 48 of `a-z 0-9 - _ .`.
    pub cell: String,
    /// Folder for the library's files, absolute and at most 40 bytes.
    pub root: PathBuf,
    /// Beginning of the names in /dev/shm.
    pub prefix: String,
    /// Joints of the arm.
    pub joints: usize,
    /// Nominal sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// How long a reader may do something else before samples are lost \[s\].
    pub buffer_s: f64,
    /// A batch that is not full is sent at this age, so that a slow bus is not a late one.
    pub max_batch_age: Duration,
}

impl StreamOptions {
    /// The options of a cell, with batches no older than 50 ms.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub fn new(
        cell: &str,
        (root, prefix): (&Path, &str),
        joints: usize,
        sample_rate_hz: f64,
        buffer_s: f64,
    ) -> Result<Self, StreamError> {
        let options = Self {
            cell: cell.to_owned(),
            root: root.to_owned(),
            prefix: prefix.to_owned(),
            joints,
            sample_rate_hz,
            buffer_s,
            max_batch_age: MAX_BATCH_AGE,
        };
        options.validate()?;
        Ok(options)
    }

    /// Checks every option against its range.
    ///
    /// # Errors
    /// [`StreamError::Option`] names the first that is outside.
    pub fn validate(&self) -> Result<(), StreamError> {
        let refuse = |key, problem: String| Err(StreamError::Option { key, problem });
        let plain = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.');
        if self.cell.is_empty() || self.cell.len() > MAX_CELL || !self.cell.bytes().all(plain) {
            return refuse("cell", format!("must be 1 to {MAX_CELL} of a-z 0-9 - _ ."));
        }
        if self.prefix.is_empty()
            || self.prefix.len() > MAX_PREFIX
            || !self.prefix.bytes().all(plain)
        {
            return refuse("prefix", format!("must be 1 to {MAX_PREFIX} of a-z 0-9 - _ ."));
        }
        if !self.root.is_absolute() || self.root.as_os_str().len() > MAX_ROOT {
            return refuse(
                "root",
                format!(
                    "{} must be an absolute path of at most {MAX_ROOT} bytes",
                    self.root.display()
                ),
            );
        }
        if self.joints == 0 || self.joints > MAX_JOINTS {
            return refuse("joints", format!("{} is not in 1..={MAX_JOINTS}", self.joints));
        }
        if !(1.0..=20_000.0).contains(&self.sample_rate_hz) {
            return refuse(
                "sample_rate_hz",
                format!("{} is not in 1..=20000", self.sample_rate_hz),
            );
        }
        if !(0.1..=600.0).contains(&self.buffer_s) {
            return refuse("buffer_s", format!("{} is not in 0.1..=600", self.buffer_s));
        }
        let age = self.max_batch_age;
        if age < Duration::from_millis(1) || age > Duration::from_secs(1) {
            return refuse("max_batch_age", format!("{age:?} is not in 1 ms..=1 s"));
        }
        if self.samples_bytes() > MAX_BUFFER_BYTES {
            return refuse(
                "buffer_s",
                format!(
                    "{} s at {} Hz take {} bytes, more than the limit of {MAX_BUFFER_BYTES}",
                    self.buffer_s,
                    self.sample_rate_hz,
                    self.samples_bytes()
                ),
            );
        }
        Ok(())
    }

    /// Batches that each reader's buffer holds, so that `buffer_s` of samples fit however they are
    /// split: batches per second ≤ rate / [`BATCH_SAMPLES`] (full) + 1 / age (sent by age).
    pub fn buffer_batches(&self) -> usize {
        #[expect(clippy::cast_precision_loss, reason = "64")]
        let full = self.sample_rate_hz / BATCH_SAMPLES as f64;
        let aged = 1.0 / self.max_batch_age.as_secs_f64();
        // No more batches than samples either.
        let batches = (self.buffer_s * (full + aged).min(self.sample_rate_hz)).ceil();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and far below 2^53 by the ranges of the options"
        )]
        (batches as usize).max(MIN_BUFFER_BATCHES)
    }

    /// Shared memory of the samples \[bytes\]: readers × (buffer + borrowed) + loaned slots. At
    /// 5 kHz and 20 s that is 1,963 batches and 73 MB, at 500 Hz 557 batches and 21 MB.
    pub fn samples_bytes(&self) -> u64 {
        let slots = MAX_READERS * (self.buffer_batches() + MAX_BORROWED) + MAX_LOANED;
        let slot = size_of::<SampleBatch>() as u64 + SLOT_OVERHEAD_BYTES;
        (slots as u64).saturating_mul(slot)
    }

    /// All the shared memory that a cell takes \[bytes\]: the samples, the estimates, and the status
    /// of up to two processes.
    pub fn shared_memory_bytes(&self) -> u64 {
        self.samples_bytes() + 3 * DOCUMENT_WRITER_BYTES + MANAGEMENT_BYTES
    }

    /// Name of one of the cell's services.
    pub(super) fn service_name(&self, topic: &str) -> String {
        let version = match topic {
            SAMPLES | ACKNOWLEDGEMENTS => SAMPLES_VERSION,
            _ => DOCUMENTS_VERSION,
        };
        format!("didim/{version}/{}/{topic}", self.cell)
    }
}
