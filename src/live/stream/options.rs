//! All names, paths and quality-of-service settings of the stream.

use core::time::Duration;
use std::path::{Path, PathBuf};

use didim_dynamics::sample::MAX_JOINTS;

use super::StreamError;
#[cfg(target_os = "linux")]
use super::external_torque::MESSAGE_BYTES;
use super::message::{BATCH_SAMPLES, SampleBatch};

/// Subfolder of a service's runtime folder that contains the library's files.
pub const FOLDER_NAME: &str = "ipc";
/// Prefix of a service's file names in /dev/shm.
pub const SERVICE_PREFIX: &str = "didim_";
/// Default time that a reader may be inactive before samples are lost \[s\].
pub const DEFAULT_BUFFER_S: f64 = 20.0;
/// Age at which a batch is sent even if it is not full.
const MAX_BATCH_AGE: Duration = Duration::from_millis(50);

/// Version of the sample services. Processes with different versions cannot connect.
const SAMPLES_VERSION: &str = "v3";
/// Version of the document services (estimates and status).
const DOCUMENTS_VERSION: &str = "v1";
/// Name of the sample service.
pub(super) const SAMPLES_SERVICE: &str = "samples";
/// Name of the service of external torques.
#[cfg(target_os = "linux")]
pub(super) const EXTERNAL_TORQUE_SERVICE: &str = "external_torque";
/// Name of the service through which a reader acknowledges batches.
pub(super) const ACKNOWLEDGEMENTS_SERVICE: &str = "acknowledgements";
/// Maximum length of the root path \[bytes\]. The library appends its own names to it, and a socket
/// path has at most 108 bytes. A path of 71 characters failed in a test.
const MAX_ROOT: usize = 40;
/// Maximum length of the prefix of the files in /dev/shm.
const MAX_PREFIX: usize = 24;
/// Maximum length of a cell name.
const MAX_CELL: usize = 48;
/// Maximum size of the buffer \[bytes\]. Its memory is reserved while the service runs.
const MAX_BUFFER_BYTES: u64 = 1 << 30;
/// Generous estimate of the library's management segments, in addition to the payload \[bytes\].
pub(super) const MANAGEMENT_BYTES: u64 = 4 << 20;
/// Generous estimate of header and alignment of one slot \[bytes\].
const SLOT_OVERHEAD_BYTES: u64 = 128;

/// Minimum capacity of a buffer. A replay stops at half of it. The frames that were already read
/// from the log must fit into the other half.
const MIN_BUFFER_BATCHES: usize = 32;

/// Maximum number of sample readers: the worker and an observer.
pub const MAX_READERS: usize = 2;
/// Maximum number of batches that one reader holds at a time.
pub const MAX_BORROWED: usize = 2;
/// Maximum number of batches that the writer holds at a time. It only holds the batch being filled.
pub const MAX_LOANED: usize = 1;
/// Time without a batch after which a reader searches for dead processes and cleans up after them.
pub const DEAD_NODE_DEADLINE: Duration = Duration::from_secs(1);

/// Maximum length of a document \[bytes\]. An estimate of 100 parameters takes about 15 kB.
pub const MAX_DOCUMENT_BYTES: usize = 64 * 1024;
/// Maximum number of processes that read a document topic.
pub(super) const MAX_DOCUMENT_READERS: usize = 4;
/// Maximum number of documents that wait for a reader. Older ones are dropped.
pub(super) const DOCUMENT_BUFFER: usize = 2;
/// Shared memory of one writer of a topic \[bytes\]: readers × (buffer + borrowed) + history +
/// loaned.
pub(super) const DOCUMENT_WRITER_BYTES: u64 = (MAX_DOCUMENT_READERS * (DOCUMENT_BUFFER + 1) + 1 + 1)
    as u64
    * (MAX_DOCUMENT_BYTES as u64 + 128);

/// Maximum number of processes that read external torques.
#[cfg(target_os = "linux")]
pub(super) const MAX_EXTERNAL_TORQUE_READERS: usize = 8;
/// Maximum number of external torques that wait for a reader: 51 ms at 5 kHz.
#[cfg(target_os = "linux")]
pub(super) const EXTERNAL_TORQUE_BUFFER: usize = 256;
/// Shared memory of the writer of external torques \[bytes\]: readers × (buffer + borrowed) +
/// loaned.
#[cfg(target_os = "linux")]
pub(super) const EXTERNAL_TORQUE_WRITER_BYTES: u64 =
    (MAX_EXTERNAL_TORQUE_READERS * (EXTERNAL_TORQUE_BUFFER + 1) + 1) as u64
        * (MESSAGE_BYTES as u64 + SLOT_OVERHEAD_BYTES);

/// Location and capacity of a cell's stream.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamOptions {
    /// Name of the cell: 1 to 48 characters of `a-z 0-9 - _ .`.
    pub cell: String,
    /// Folder for the library's files, absolute and at most 40 bytes.
    pub root: PathBuf,
    /// Prefix of the names in /dev/shm.
    pub prefix: String,
    /// Number of joints of the arm.
    pub joints: usize,
    /// Nominal sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Time that a reader may be inactive before samples are lost \[s\].
    pub buffer_s: f64,
    /// Age at which a batch is sent even if it is not full. A slow bus therefore causes no delay.
    pub max_batch_age: Duration,
}

impl StreamOptions {
    /// Creates the options of a cell, with batches no older than 50 ms.
    ///
    /// # Errors
    /// The same as [`Self::validate`].
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
    /// [`StreamError::Option`] names the first option that is outside.
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
                "runtime_directory",
                format!(
                    "{} must be an absolute path of at most {MAX_ROOT} bytes; name a shorter \
                     folder in the cell or with --runtime",
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

    /// Returns the number of batches that each reader's buffer holds. Samples of `buffer_s` fit,
    /// whether their batches are sent full or by age: batches per second ≤ rate / [`BATCH_SAMPLES`]
    /// (full) + 1 / age (sent by age).
    pub fn buffer_batches(&self) -> usize {
        #[expect(clippy::cast_precision_loss, reason = "64")]
        let full = self.sample_rate_hz / BATCH_SAMPLES as f64;
        let aged = 1.0 / self.max_batch_age.as_secs_f64();
        // The number of batches cannot exceed the number of samples.
        let batches = (self.buffer_s * (full + aged).min(self.sample_rate_hz)).ceil();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and far below 2^53 by the ranges of the options"
        )]
        (batches as usize).max(MIN_BUFFER_BATCHES)
    }

    /// Returns the shared memory of the samples \[bytes\]: readers × (buffer + borrowed) + loaned
    /// slots. A buffer of 20 s takes 1,963 batches and 73 MB at 5 kHz, or 557 batches and 21 MB at
    /// 500 Hz.
    pub fn samples_bytes(&self) -> u64 {
        let slots = MAX_READERS * (self.buffer_batches() + MAX_BORROWED) + MAX_LOANED;
        let slot = size_of::<SampleBatch>() as u64 + SLOT_OVERHEAD_BYTES;
        (slots as u64).saturating_mul(slot)
    }

    /// Returns the total shared memory of a cell \[bytes\]: the samples, the estimates, and the
    /// status of up to two processes.
    pub fn shared_memory_bytes(&self) -> u64 {
        self.samples_bytes() + 3 * DOCUMENT_WRITER_BYTES + MANAGEMENT_BYTES
    }

    /// Returns the name of one of the cell's services.
    pub(super) fn service_name(&self, topic: &str) -> String {
        let version = match topic {
            SAMPLES_SERVICE | ACKNOWLEDGEMENTS_SERVICE => SAMPLES_VERSION,
            _ => DOCUMENTS_VERSION,
        };
        format!("didim/{version}/{}/{topic}", self.cell)
    }
}
