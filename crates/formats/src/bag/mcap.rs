//! Records of an MCAP file (<https://mcap.dev/spec>), from its first byte to its last. A damaged or
//! hostile file ends in an error.

use std::io::{self, Read};

/// The first bytes of a file.
const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Largest accepted record or chunk \[bytes\].
const MAX_RECORD: u64 = 64 << 20;

/// Records of a file that are used.
pub(super) enum McapRecord<'a> {
    /// A message type.
    Schema { id: u16, name: &'a str },
    /// A topic.
    Channel { id: u16, schema: u16, topic: &'a str },
    /// A message.
    Message { channel: u16, log_ns: u64, data: &'a [u8] },
}

/// Reason why a file cannot be read to its end.
#[derive(Debug, thiserror::Error)]
pub(super) enum McapFault {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("it does not begin as one")]
    Magic,
    #[error("a record claims {0} bytes")]
    TooLong(u64),
    #[error("a record is malformed")]
    Malformed,
    #[error("a chunk is compressed by \"{0}\", which is neither zstd nor lz4")]
    Compression(String),
    #[error("a chunk cannot be decompressed: {0}")]
    Decompress(String),
    #[error("the CRC of a chunk does not match")]
    Crc,
}

/// End of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileEnd {
    /// The recorder closed the file.
    Finished,
    /// The recorder was killed, or the file is copied in part.
    Truncated,
}

/// Passes every record to `take`, in the order of the file. A truncated file is read up to its last
/// complete record.
pub(super) fn read<E: From<McapFault>>(
    mut file: impl Read,
    take: &mut impl FnMut(McapRecord<'_>) -> Result<(), E>,
) -> Result<FileEnd, E> {
    let mut magic = [0; 8];
    if read_available(&mut file, &mut magic)? < magic.len() || magic != MAGIC {
        return Err(McapFault::Magic.into());
    }
    let mut record = Vec::new();
    loop {
        let mut head = [0; 9];
        let [opcode, length @ ..] = match read_available(&mut file, &mut head)? {
            9 => head,
            _ => return Ok(FileEnd::Truncated),
        };
        let length = u64::from_le_bytes(length);
        if length > MAX_RECORD {
            return Err(McapFault::TooLong(length).into());
        }
        record.clear();
        (&mut file).take(length).read_to_end(&mut record).map_err(McapFault::Io)?;
        if (record.len() as u64) < length {
            return Ok(FileEnd::Truncated);
        }
        match opcode {
            op::FOOTER => return Ok(FileEnd::Finished),
            op::CHUNK => {
                let records = decompress_chunk(&record)?;
                let mut rest = RecordFields(&records);
                while !rest.0.is_empty() {
                    let [opcode] = rest.take_bytes()?;
                    let length = u64::from_le_bytes(rest.take_bytes()?);
                    handle_record(opcode, rest.take_block(length)?, take)?;
                }
            }
            _ => handle_record(opcode, &record, take)?,
        }
    }
}

/// Opcodes of records.
mod op {
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
}

/// Reads the available bytes, up to the length of the buffer.
fn read_available(file: &mut impl Read, buffer: &mut [u8]) -> Result<usize, McapFault> {
    let mut filled = 0;
    while filled < buffer.len() {
        match file.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(filled)
}

fn handle_record<E: From<McapFault>>(
    opcode: u8,
    record: &[u8],
    take: &mut impl FnMut(McapRecord<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut fields = RecordFields(record);
    match opcode {
        op::SCHEMA => {
            let (id, name) = (fields.take_u16()?, fields.take_text()?);
            take(McapRecord::Schema { id, name })
        }
        op::CHANNEL => {
            let (id, schema, topic) = (fields.take_u16()?, fields.take_u16()?, fields.take_text()?);
            take(McapRecord::Channel { id, schema, topic })
        }
        op::MESSAGE => {
            let channel = fields.take_u16()?;
            fields.take_bytes::<4>()?;
            let log_ns = u64::from_le_bytes(fields.take_bytes()?);
            fields.take_bytes::<8>()?;
            take(McapRecord::Message { channel, log_ns, data: fields.0 })
        }
        _ => Ok(()),
    }
}

/// Returns the records of a chunk, decompressed.
fn decompress_chunk(record: &[u8]) -> Result<Vec<u8>, McapFault> {
    let mut fields = RecordFields(record);
    fields.take_bytes::<16>()?;
    let size = u64::from_le_bytes(fields.take_bytes()?);
    let crc = u32::from_le_bytes(fields.take_bytes()?);
    let compression = fields.take_text()?;
    let length = u64::from_le_bytes(fields.take_bytes()?);
    let stored = fields.take_block(length)?;
    if size > MAX_RECORD {
        return Err(McapFault::TooLong(size));
    }
    let mut records = Vec::new();
    let wrong = |error: &dyn core::fmt::Display| McapFault::Decompress(error.to_string());
    match compression {
        "" => records.extend_from_slice(stored),
        "lz4" => {
            let reader = lz4_flex::frame::FrameDecoder::new(stored);
            reader.take(size + 1).read_to_end(&mut records).map_err(|error| wrong(&error))?;
        }
        "zstd" => {
            let reader = ruzstd::decoding::StreamingDecoder::new(stored);
            let reader = reader.map_err(|error| wrong(&error))?;
            reader.take(size + 1).read_to_end(&mut records).map_err(|error| wrong(&error))?;
        }
        other => return Err(McapFault::Compression(other.to_owned())),
    }
    if records.len() as u64 != size {
        return Err(McapFault::Malformed);
    }
    // A CRC of 0 means that there is none.
    if crc != 0 && crc32fast::hash(&records) != crc {
        return Err(McapFault::Crc);
    }
    Ok(records)
}

/// Remaining fields of a record.
struct RecordFields<'a>(&'a [u8]);

impl<'a> RecordFields<'a> {
    fn take_bytes<const N: usize>(&mut self) -> Result<[u8; N], McapFault> {
        let (taken, rest) = self.0.split_first_chunk::<N>().ok_or(McapFault::Malformed)?;
        self.0 = rest;
        Ok(*taken)
    }

    fn take_u16(&mut self) -> Result<u16, McapFault> {
        self.take_bytes().map(u16::from_le_bytes)
    }

    fn take_block(&mut self, length: u64) -> Result<&'a [u8], McapFault> {
        let length = usize::try_from(length).map_err(|_| McapFault::Malformed)?;
        let (taken, rest) = self.0.split_at_checked(length).ok_or(McapFault::Malformed)?;
        self.0 = rest;
        Ok(taken)
    }

    fn take_text(&mut self) -> Result<&'a str, McapFault> {
        let length = u32::from_le_bytes(self.take_bytes()?);
        core::str::from_utf8(self.take_block(length.into())?).map_err(|_| McapFault::Malformed)
    }
}
