//! Writer of frames to a recording.

use std::io::Write;

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::write::{NoSeek, WriteOptions, Writer};

use super::info::{METADATA_NAME, McapInfo};
use super::{JointState, TOPIC_PREFIX, joint_states, message};
use crate::frame::{Frame, MAX_PAYLOAD};

/// Size at which a chunk is closed \[bytes\]. A caller that needs the data on disk closes it
/// earlier.
const CHUNK_SIZE: u64 = 128 << 10;

/// Size that a message adds to the file without its payload \[bytes\]: the head of the record, the
/// head of the message and its entry in the index.
const MESSAGE_BYTES: u64 = 9 + 22 + message::HEAD_BYTES as u64 + 16;

/// Size that a chunk adds to the file for each interface, without its messages and with its entries
/// in both indexes \[bytes\].
const CHUNK_BYTES: u64 = 256;
const CHANNEL_BYTES: u64 = 64;

/// Largest size of the end of a file, without the index entries of the chunks \[bytes\].
const END_BYTES: u64 = 4096;

/// Reason why a frame is not in the recording.
#[derive(Debug, thiserror::Error)]
pub enum McapWriteError {
    /// The interface index of the frame has no name. Create the writer with the interface names of
    /// the source.
    #[error("a frame of interface {index} cannot be recorded: no name was given for it")]
    NoInterface {
        /// Interface index of the frame.
        index: u8,
    },
    /// The file system refused the data. The recording ends with its last complete chunk. Free disk
    /// space.
    #[error("cannot write the recording: {0}")]
    Output(std::io::Error),
    /// The file format cannot represent the data.
    #[error("cannot write the recording: {0}")]
    Format(::mcap::McapError),
}

impl McapWriteError {
    /// Returns true if the disk is full.
    pub fn is_full(&self) -> bool {
        use std::io::ErrorKind::{QuotaExceeded, StorageFull};
        matches!(self, Self::Output(error) if matches!(error.kind(), StorageFull | QuotaExceeded))
    }
}

impl From<::mcap::McapError> for McapWriteError {
    fn from(error: ::mcap::McapError) -> Self {
        match error {
            ::mcap::McapError::Io(error) => Self::Output(error),
            other => Self::Format(other),
        }
    }
}

/// Writer of a recording. It writes complete chunks one after the other, so that every chunk but
/// the last remains if the process is killed. If the writer is dropped without [`Self::finish`], it
/// tries to finish the file.
pub struct McapWriter<W: Write> {
    writer: Writer<NoSeek<W>>,
    info: McapInfo,
    channels: Vec<u16>,
    joints: Option<Joints>,
    message: Vec<u8>,
    /// Upper bound of the size that the file would have with its end \[bytes\].
    bytes: u64,
    in_chunk: u64,
    frames: u64,
}

/// Channel of the joint states.
struct Joints {
    channel_id: u16,
    names: Vec<String>,
}

/// Returns options without compression.
fn uncompressed() -> WriteOptions {
    WriteOptions::new().compression(None)
}

/// Returns the options of kept recordings: compressed in this thread, if the build can.
#[cfg(feature = "zstd")]
fn compressed(options: WriteOptions) -> WriteOptions {
    options.compression(Some(::mcap::Compression::Zstd)).compression_threads(0)
}
#[cfg(not(feature = "zstd"))]
fn compressed(options: WriteOptions) -> WriteOptions {
    options
}

impl<W: Write> McapWriter<W> {
    /// Creates a writer and writes the beginning of the file. The interface index of a frame
    /// selects a name in `info.interfaces`.
    ///
    /// # Errors
    /// [`McapWriteError`].
    pub fn new(out: W, info: &McapInfo) -> Result<Self, McapWriteError> {
        Self::create(out, info, uncompressed())
    }

    /// Creates a writer like [`Self::new`], whose chunks are compressed if this build has the
    /// feature `zstd`. This takes a quarter of the space, and more time.
    ///
    /// # Errors
    /// [`McapWriteError`].
    pub fn compressed(out: W, info: &McapInfo) -> Result<Self, McapWriteError> {
        Self::create(out, info, compressed(uncompressed()))
    }

    fn create(out: W, info: &McapInfo, options: WriteOptions) -> Result<Self, McapWriteError> {
        let library = format!("didim {}", env!("CARGO_PKG_VERSION"));
        let options = options
            .profile("ros2")
            .library(library)
            .chunk_size(Some(CHUNK_SIZE))
            // Each chunk is collected in memory and written as one unit.
            .disable_seeking(true);
        let mut writer = options.create(NoSeek::new(out))?;
        let metadata = info.to_map();
        let described: usize =
            metadata.iter().map(|(key, value)| key.len() + value.len() + 8).sum();
        writer.write_metadata(&Metadata { name: METADATA_NAME.to_owned(), metadata })?;
        let schema = message::SCHEMA.as_bytes();
        let schema = writer.add_schema(message::SCHEMA_NAME, message::SCHEMA_ENCODING, schema)?;
        let mut channels = Vec::with_capacity(info.interfaces.len());
        for name in &info.interfaces {
            let (topic, none) = (format!("{TOPIC_PREFIX}{name}"), Default::default());
            channels.push(writer.add_channel(schema, &topic, message::MESSAGE_ENCODING, &none)?);
        }
        let message = Vec::with_capacity(message::HEAD_BYTES + MAX_PAYLOAD);
        let ends = END_BYTES + 3 * message::SCHEMA.len() as u64 + described as u64;
        let bytes = ends + CHUNK_BYTES + 3 * CHANNEL_BYTES * channels.len() as u64;
        let info = info.clone();
        Ok(Self { writer, info, channels, joints: None, message, bytes, in_chunk: 0, frames: 0 })
    }

    /// Returns the writer with an additional channel for the states of these joints.
    ///
    /// # Errors
    /// [`McapWriteError`].
    pub fn with_joints(mut self, names: &[String]) -> Result<Self, McapWriteError> {
        let schema = joint_states::SCHEMA.as_bytes();
        let (name, encoding) = (joint_states::SCHEMA_NAME, message::SCHEMA_ENCODING);
        let schema = self.writer.add_schema(name, encoding, schema)?;
        let (topic, encoding) = (joint_states::TOPIC, message::MESSAGE_ENCODING);
        let channel_id = self.writer.add_channel(schema, topic, encoding, &Default::default())?;
        self.bytes += 3 * (joint_states::SCHEMA.len() as u64 + CHANNEL_BYTES);
        self.joints = Some(Joints { channel_id, names: names.to_vec() });
        Ok(self)
    }

    /// Writes one frame. `sequence` is the number of the frame on the bus.
    ///
    /// # Errors
    /// [`McapWriteError`]. After an output error the writer cannot write any more.
    pub fn write(&mut self, frame: &Frame, sequence: u32) -> Result<(), McapWriteError> {
        let index = frame.interface;
        let channel = self.channels.get(usize::from(index)).copied();
        let channel_id = channel.ok_or(McapWriteError::NoInterface { index })?;
        self.message.clear();
        message::encode(frame, &mut self.message);
        let log_time = self.info.log_time(frame.stamp_ns);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.frames += 1;
        self.append(&header, Self::frame_bytes(frame))
    }

    /// Writes a state of the joints. It writes nothing if [`Self::with_joints`] was not called.
    ///
    /// # Errors
    /// The same as [`Self::write`].
    pub fn write_joints(&mut self, state: &JointState<'_>) -> Result<(), McapWriteError> {
        let Some(Joints { channel_id, names }) = &self.joints else { return Ok(()) };
        let log_time = self.info.log_time(state.stamp_ns);
        self.message.clear();
        joint_states::encode(names, log_time, state, &mut self.message);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a sequence of the file begins again at 2³²"
        )]
        let sequence = state.sequence as u32;
        let header =
            MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time: log_time };
        let bytes = Self::joints_bytes(names);
        self.append(&header, bytes)
    }

    fn append(&mut self, header: &MessageHeader, most_bytes: u64) -> Result<(), McapWriteError> {
        self.writer.write_to_known_channel(header, &self.message)?;
        self.in_chunk += most_bytes;
        self.bytes += most_bytes;
        if self.in_chunk > CHUNK_SIZE {
            self.flush()?;
        }
        Ok(())
    }

    /// Returns an upper bound of the size that a frame adds to a file, without that of its chunk
    /// \[bytes\].
    pub fn frame_bytes(frame: &Frame) -> u64 {
        MESSAGE_BYTES + frame.data().len() as u64
    }

    /// Returns an upper bound of the size that a state of these joints adds to a file \[bytes\].
    pub fn joints_bytes(names: &[String]) -> u64 {
        MESSAGE_BYTES - message::HEAD_BYTES as u64 + joint_states::most_bytes(names)
    }

    /// Closes the chunk and passes it to the output.
    ///
    /// # Errors
    /// [`McapWriteError::Output`].
    pub fn flush(&mut self) -> Result<(), McapWriteError> {
        if self.in_chunk > 0 {
            self.in_chunk = 0;
            self.bytes += CHUNK_BYTES + CHANNEL_BYTES * self.channels.len() as u64;
            self.writer.flush()?;
        }
        Ok(())
    }

    /// Returns an upper bound of the size that the file would have if it were finished now
    /// \[bytes\].
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns the number of frames that were written.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the description that the file contains.
    pub fn info(&self) -> &McapInfo {
        &self.info
    }

    /// Writes the end of the file and returns the output.
    ///
    /// # Errors
    /// [`McapWriteError::Output`]; the file then has no end.
    pub fn finish(mut self) -> Result<W, McapWriteError> {
        self.flush()?;
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}

impl<W: Write> core::fmt::Debug for McapWriter<W> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut written = f.debug_struct("McapWriter");
        written.field("info", &self.info).field("bytes", &self.bytes).finish_non_exhaustive()
    }
}
