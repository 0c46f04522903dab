//! Content of a file, from the records that were read until now.

use super::bytes::ByteReader;
use super::error::Corruption;
use super::info::McapInfo;
use super::ros_frame::{self, RosFrame};
use super::{TOPIC_PREFIX, joint_states, message, op};
use crate::frame::Frame;
use crate::source::{InterfaceName, MAX_INTERFACES, SourceCounters, TooManyInterfaces, index_of};

/// Format of a message with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// That of this program.
    Own,
    /// One of ROS 2.
    Ros(RosFrame),
}

/// Channel of frames.
#[derive(Clone, Copy, Debug)]
struct FrameChannel {
    id: u16,
    format: Format,
    /// Its interface, or `None` if the frames of this interface are skipped.
    interface: Option<u8>,
}

/// Content of a file, from the records that were read until now.
#[derive(Debug)]
pub(super) struct FileContent {
    info: Option<McapInfo>,
    /// Identifiers that the file gives to schemas of frames.
    schemas: Vec<(u16, Format)>,
    /// Channels of frames.
    channels: Vec<FrameChannel>,
    /// Channels with data that this program derived from the frames.
    derived_channels: Vec<u16>,
    interfaces: Vec<InterfaceName>,
    /// True if the caller chose `interfaces`. Otherwise every interface of the file is added to
    /// them.
    has_fixed_interfaces: bool,
    /// Sequence number of the last frame.
    pub(super) sequence: Option<u32>,
    /// Number of frames that are missing before the last frame and not counted yet.
    pub(super) missing_frames: u64,
    pub(super) counters: SourceCounters,
}

impl FileContent {
    pub(super) fn new(interfaces: &[InterfaceName]) -> Self {
        let mut interfaces_seen = Vec::with_capacity(MAX_INTERFACES.max(interfaces.len()));
        interfaces_seen.extend_from_slice(interfaces);
        Self {
            info: None,
            schemas: Vec::new(),
            channels: Vec::new(),
            derived_channels: Vec::new(),
            interfaces: interfaces_seen,
            has_fixed_interfaces: !interfaces.is_empty(),
            sequence: None,
            missing_frames: 0,
            counters: SourceCounters::default(),
        }
    }

    pub(super) fn info(&self) -> Option<&McapInfo> {
        self.info.as_ref()
    }

    pub(super) fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    /// Takes a record of the file or of a chunk. Returns a frame if the record contains one.
    pub(super) fn handle_record(
        &mut self,
        opcode: u8,
        body: &[u8],
    ) -> Result<Option<Frame>, Corruption> {
        let mut bytes = ByteReader(body);
        match opcode {
            op::MESSAGE => return self.handle_message(&mut bytes),
            op::METADATA if self.info.is_none() => {
                self.info = McapInfo::read(body);
                if let (Some(info), false) = (&self.info, self.has_fixed_interfaces) {
                    // Interfaces of earlier channels keep their numbers.
                    for name in &info.interfaces {
                        index_of(&mut self.interfaces, *name, false)?;
                    }
                }
            }
            op::SCHEMA => {
                let (id, name, encoding) =
                    parse_schema(&mut bytes).ok_or(Corruption::Malformed("schema"))?;
                let ours = name == message::SCHEMA_NAME && encoding == message::SCHEMA_ENCODING;
                let ros = RosFrame::from_schema(name).map(Format::Ros);
                let format = if ours { Some(Format::Own) } else { ros };
                if let Some(format) = format.filter(|format| !self.schemas.contains(&(id, *format)))
                {
                    self.schemas.push((id, format));
                }
            }
            op::CHANNEL => self.handle_channel(&mut bytes)?,
            _ => {}
        }
        Ok(None)
    }

    fn handle_channel(&mut self, bytes: &mut ByteReader<'_>) -> Result<(), Corruption> {
        let malformed = Corruption::Malformed("channel");
        let (Some(id), Some(schema), Some(topic), Some(encoding)) =
            (bytes.take_u16(), bytes.take_u16(), bytes.take_text(), bytes.take_text())
        else {
            return Err(malformed);
        };
        if self.info.is_some() && topic == joint_states::TOPIC {
            self.derived_channels.push(id);
            return Ok(());
        }
        let format = self.schemas.iter().find(|(available, _)| *available == schema);
        let format = format.filter(|_| encoding == message::MESSAGE_ENCODING);
        // A file may declare the same channel again.
        let is_declared = self.channels.iter().any(|channel| channel.id == id);
        let Some((_, format)) = format.copied().filter(|_| !is_declared) else { return Ok(()) };
        let name = match format {
            Format::Own => {
                topic.strip_prefix(TOPIC_PREFIX).and_then(|name| InterfaceName::new(name).ok())
            }
            Format::Ros(_) => ros_frame::interface_of(topic),
        };
        let name = name.ok_or_else(|| Corruption::Topic(topic.chars().take(64).collect()))?;
        let interface = index_of(&mut self.interfaces, name, self.has_fixed_interfaces)?;
        self.channels.push(FrameChannel { id, format, interface });
        Ok(())
    }

    fn handle_message(&mut self, bytes: &mut ByteReader<'_>) -> Result<Option<Frame>, Corruption> {
        let (Some(channel), Some(sequence), Some(log_time), Some(_)) =
            (bytes.take_u16(), bytes.take_u32(), bytes.take_u64(), bytes.take_u64())
        else {
            return Err(Corruption::Malformed("message"));
        };
        let channel_found = self.channels.iter().find(|available| available.id == channel);
        let Some(FrameChannel { format, interface, .. }) = channel_found.copied() else {
            self.counters.passed_over += u64::from(!self.derived_channels.contains(&channel));
            return Ok(None);
        };
        if let Format::Ros(kind) = format {
            return Ok(self.select_frame(kind.decode(bytes.0, log_time)?, interface));
        }
        let frame = message::decode(bytes.0)?;
        // Other programs leave sequences at 0.
        if let Some(info) = &self.info {
            if let Some(before) = self.sequence.replace(sequence) {
                let missing = sequence.wrapping_sub(before).wrapping_sub(1);
                self.missing_frames += u64::from(missing);
            }
            let stamp_ns = info.stamp_ns(log_time);
            return Ok(self.select_frame(frame.with_stamp(stamp_ns), interface));
        }
        Ok(self.select_frame(frame.with_stamp(log_time), interface))
    }

    fn select_frame(&mut self, frame: Frame, interface: Option<u8>) -> Option<Frame> {
        self.counters.passed_over += u64::from(interface.is_none());
        interface.map(|interface| frame.on_interface(interface))
    }
}

fn parse_schema<'a>(bytes: &mut ByteReader<'a>) -> Option<(u16, &'a str, &'a str)> {
    Some((bytes.take_u16()?, bytes.take_text()?, bytes.take_text()?))
}

impl From<TooManyInterfaces> for Corruption {
    fn from(_: TooManyInterfaces) -> Self {
        Self::TooManyInterfaces
    }
}
