//! Packets of a capture file, in the format pcap (libpcap, tcpdump) or pcapng (Wireshark, dumpcap).

use core::ops::Range;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

/// Length of the longest block that is read, including its header \[bytes\]. Longer blocks are
/// skipped if their kind is not used.
const MAX_BLOCK: u32 = 1 << 20;
/// Largest number of interfaces of one section.
const MAX_INTERFACES: usize = 256;
/// Header of the packets of an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LinkType {
    Ethernet,
    /// Linux "cooked" capture of `tcpdump -i any`.
    CookedV1,
    /// Linux "cooked" capture, version 2.
    CookedV2,
    Other,
}

impl LinkType {
    /// Returns the link type with this number in a capture.
    fn from_number(number: u16) -> Self {
        match number {
            1 => Self::Ethernet,
            113 => Self::CookedV1,
            276 => Self::CookedV2,
            _ => Self::Other,
        }
    }

    /// Changes the packet in `bytes` to an Ethernet frame, and returns its place. A cooked packet
    /// has the sender's address and the EtherType, which become those of the frame.
    fn make_ethernet(self, bytes: &mut [u8], place: Range<usize>) -> Option<Range<usize>> {
        let packet = bytes.get_mut(place.clone())?;
        let start = match self {
            Self::Ethernet => 0,
            // 14 bytes before the address are fields of the cooked header.
            Self::CookedV1 if packet.len() >= 16 => {
                packet.copy_within(6..12, 8);
                2
            }
            Self::CookedV2 if packet.len() >= 20 => {
                packet.copy_within(0..2, 18);
                6
            }
            Self::CookedV1 | Self::CookedV2 | Self::Other => return None,
        };
        Some(place.start + start..place.end)
    }
}

/// Types of the blocks of pcapng.
const SECTION_BLOCK: u32 = 0x0A0D_0D0A;
const INTERFACE_BLOCK: u32 = 1;
const SIMPLE_PACKET_BLOCK: u32 = 3;
const PACKET_BLOCK: u32 = 6;
/// Bytes by which a section shows its byte order.
const BYTE_ORDER_MAGIC: [u8; 4] = [0x4D, 0x3C, 0x2B, 0x1A];
/// Options of an interface: the resolution of its stamps, and the offset to add to its stamps
/// \[s\].
const RESOLUTION_OPTION: u16 = 9;
const OFFSET_OPTION: u16 = 14;

/// First bytes of a pcap file with stamps in µs and with stamps in ns, in little-endian order.
const MICROSECOND_MAGIC: [u8; 4] = [0xD4, 0xC3, 0xB2, 0xA1];
const NANOSECOND_MAGIC: [u8; 4] = [0x4D, 0x3C, 0xB2, 0xA1];

/// Reason why a capture cannot be read. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file cannot be opened: check the path and its permissions.
    #[error(
        "cannot open the capture {path}: {source}; check the path and the permissions",
        path = path.display()
    )]
    Open {
        /// Path of the capture.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Reading the file failed.
    #[error("{path}, byte {offset}: cannot read further: {source}", path = path.display())]
    Read {
        /// Path of the capture.
        path: PathBuf,
        /// Offset of the block's first byte in the file.
        offset: u64,
        /// Error of the system.
        source: io::Error,
    },
    /// The file begins neither as pcap nor as pcapng. Record with tcpdump, dumpcap or Wireshark.
    #[error(
        "{path} is no capture: it begins neither like pcap nor like pcapng; record with tcpdump, \
         dumpcap or Wireshark, and unpack it where it is compressed",
        path = path.display()
    )]
    NotCapture {
        /// Path of the capture.
        path: PathBuf,
    },
    /// The capture is truncated in the middle of a packet.
    #[error(
        "{path}, byte {offset}: the capture is cut off in the middle of a packet; write the whole \
         packets to another file: `editcap {path} WHOLE.pcapng`",
        path = path.display()
    )]
    Truncated {
        /// Path of the capture.
        path: PathBuf,
        /// Offset of the block's first byte in the file.
        offset: u64,
    },
    /// The fields of a block contradict each other.
    #[error(
        "{path}, byte {offset}: {what}; the file is damaged from there on: record it anew",
        path = path.display()
    )]
    Damaged {
        /// Path of the capture.
        path: PathBuf,
        /// Offset of the block's first byte in the file.
        offset: u64,
        /// Description of the contradiction.
        what: &'static str,
    },
}

/// One packet of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Time of capture \[ns since 1970\].
    pub stamp_ns: u64,
    /// Bytes of the Ethernet frame from its destination address on, as far as they were captured.
    /// The destination of a Linux "cooked" packet is unknown.
    pub bytes: &'a [u8],
    /// True if the recorder kept only the first bytes of the frame.
    pub is_cut: bool,
}

/// Reader of the packets of a capture, in the order of the file and in bounded memory.
#[derive(Debug)]
pub struct Capture<R = BufReader<File>> {
    reader: R,
    path: PathBuf,
    /// Number of bytes read until now.
    bytes_read: u64,
    /// Offset in the file of the block that is being read.
    offset: u64,
    block: Vec<u8>,
    format: Format,
    big_endian: bool,
    interfaces: Vec<Interface>,
    passed_over: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Unknown,
    Pcap,
    Pcapng,
}

#[derive(Clone, Copy, Debug)]
struct Interface {
    link: LinkType,
    /// Number of ticks of the stamps per second.
    per_second: u64,
    offset_s: i64,
}

impl Capture {
    /// Opens a capture.
    ///
    /// # Errors
    /// [`CaptureError::Open`].
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        match File::open(path) {
            Ok(file) => Ok(Self::new(BufReader::new(file), path)),
            Err(source) => Err(CaptureError::Open { path: path.into(), source }),
        }
    }

    /// Returns true if a file begins as a capture.
    pub fn is_one(path: &Path) -> bool {
        let mut first = [0; 4];
        let read = File::open(path).and_then(|mut file| file.read_exact(&mut first));
        read.is_ok() && first_bytes(first).is_some()
    }
}

impl<R: BufRead> Capture<R> {
    /// Creates a reader of a capture from any input. Errors name the capture `path`.
    pub fn new(reader: R, path: &Path) -> Self {
        Self {
            reader,
            path: path.into(),
            bytes_read: 0,
            offset: 0,
            block: Vec::new(),
            format: Format::Unknown,
            big_endian: false,
            interfaces: Vec::new(),
            passed_over: 0,
        }
    }

    /// Returns the path that errors name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of skipped packets, which are of another link type or have no stamp.
    pub fn passed_over(&self) -> u64 {
        self.passed_over
    }

    /// Returns the next packet, or `None` at the end.
    ///
    /// # Errors
    /// [`CaptureError`]. Reading cannot continue after an error.
    pub fn next_packet(&mut self) -> Result<Option<Packet<'_>>, CaptureError> {
        if self.format == Format::Unknown {
            self.begin()?;
        }
        let (stamp_ns, is_cut, place) = loop {
            let found = match self.format {
                Format::Pcapng => self.next_of_pcapng()?,
                _ => self.next_of_pcap()?,
            };
            let Some(PacketPosition { stamp_ns, is_cut, link, place }) = found else {
                return Ok(None);
            };
            match link.make_ethernet(&mut self.block, place) {
                Some(place) => break (stamp_ns, is_cut, place),
                None => self.passed_over += 1,
            }
        };
        Ok(self.block.get(place).map(|bytes| Packet { stamp_ns, bytes, is_cut }))
    }

    /// Reads the first bytes and detects the format.
    fn begin(&mut self) -> Result<(), CaptureError> {
        let first = self.reader.fill_buf().map(|bytes| bytes.first_chunk().copied());
        let first = first.map_err(|source| self.read_error(source))?;
        let Some((format, big_endian, per_second)) = first.and_then(first_bytes) else {
            return Err(CaptureError::NotCapture { path: self.path.clone() });
        };
        (self.format, self.big_endian) = (format, big_endian);
        if format == Format::Pcap {
            if !self.read_block(24)? {
                return Err(self.truncated_error());
            }
            let link = LinkType::from_number(self.u16_at(if big_endian { 22 } else { 20 })?);
            self.interfaces.push(Interface { link, per_second, offset_s: 0 });
        }
        Ok(())
    }

    fn next_of_pcap(&mut self) -> Result<Option<PacketPosition>, CaptureError> {
        if !self.take_header(16)? {
            return Ok(None);
        }
        let (seconds, fraction, length) = (self.u32_at(0)?, self.u32_at(4)?, self.u32_at(8)?);
        let is_cut = length < self.u32_at(12)?;
        let Some(interface) = self.interfaces.first().copied() else { return Ok(None) };
        if length > MAX_BLOCK {
            return Err(self.damaged_error("a packet is longer than any frame"));
        }
        if !self.read_block(length)? && length > 0 {
            return Err(self.truncated_error());
        }
        let fraction_ns = u64::from(fraction) * (1_000_000_000 / interface.per_second);
        let stamp_ns = u64::from(seconds) * 1_000_000_000 + fraction_ns;
        let (link, place) = (interface.link, 0..self.block.len());
        Ok(Some(PacketPosition { stamp_ns, is_cut, link, place }))
    }

    fn next_of_pcapng(&mut self) -> Result<Option<PacketPosition>, CaptureError> {
        while self.take_header(8)? {
            let header = self.block.clone();
            if header.starts_with(&SECTION_BLOCK.to_le_bytes()) {
                self.begin_section(&header)?;
                continue;
            }
            let (kind, length) = (self.u32_at(0)?, self.u32_at(4)?);
            if length < 12 || !length.is_multiple_of(4) {
                return Err(self.damaged_error("a block has an impossible length"));
            }
            if !matches!(kind, INTERFACE_BLOCK | SIMPLE_PACKET_BLOCK | PACKET_BLOCK) {
                self.skip_bytes(length - 8)?;
                continue;
            }
            self.read_body(length)?;
            match kind {
                INTERFACE_BLOCK => self.interface()?,
                SIMPLE_PACKET_BLOCK => self.passed_over += 1,
                _ => return Ok(Some(self.packet_position()?)),
            }
        }
        Ok(None)
    }

    /// Reads the body of a block after its header, and checks the length against the length at the
    /// end of the block.
    fn read_body(&mut self, length: u32) -> Result<(), CaptureError> {
        if length > MAX_BLOCK {
            return Err(self.damaged_error("a packet is longer than any frame"));
        }
        if !self.read_block(length - 8)? {
            return Err(self.truncated_error());
        }
        let end = self.block.len() - 4;
        if self.u32_at(end)? != length {
            return Err(self.damaged_error("a block ends with another length than it begins with"));
        }
        self.block.truncate(end);
        Ok(())
    }

    /// Begins a section, which has its own byte order and its own interfaces.
    fn begin_section(&mut self, header: &[u8]) -> Result<(), CaptureError> {
        if !self.read_block(4)? {
            return Err(self.truncated_error());
        }
        self.big_endian = match &self.block {
            order if order[..] == BYTE_ORDER_MAGIC => false,
            order if order.iter().rev().eq(&BYTE_ORDER_MAGIC) => true,
            _ => return Err(self.damaged_error("a section has no order of bytes")),
        };
        self.interfaces.clear();
        self.block = header.to_vec();
        let length = self.u32_at(4)?;
        if length < 28 || !length.is_multiple_of(4) {
            return Err(self.damaged_error("a section begins with an impossible length"));
        }
        self.skip_bytes(length - 12)
    }

    fn interface(&mut self) -> Result<(), CaptureError> {
        if self.interfaces.len() == MAX_INTERFACES {
            return Err(self.damaged_error("a section has more interfaces than any capture"));
        }
        let link = LinkType::from_number(self.u16_at(0)?);
        let mut interface = Interface { link, per_second: 1_000_000, offset_s: 0 };
        let mut offset = 8;
        while offset + 4 <= self.block.len() {
            let (code, length) = (self.u16_at(offset)?, usize::from(self.u16_at(offset + 2)?));
            let value = self.block.get(offset + 4..offset + 4 + length).unwrap_or_default();
            match (code, value) {
                (0, _) => break,
                (RESOLUTION_OPTION, &[power]) => {
                    let base: u64 = if power & 0x80 == 0 { 10 } else { 2 };
                    let per_second = base.checked_pow(u32::from(power & 0x7F));
                    let Some(per_second) = per_second else {
                        return Err(self.damaged_error("an interface has an impossible resolution"));
                    };
                    interface.per_second = per_second;
                }
                (OFFSET_OPTION, _) if length == 8 => {
                    let (low, high) = (self.u32_at(offset + 4)?, self.u32_at(offset + 8)?);
                    let (low, high) = if self.big_endian { (high, low) } else { (low, high) };
                    interface.offset_s = (u64::from(high) << 32 | u64::from(low)).cast_signed();
                }
                _ => {}
            }
            offset += 4 + length.next_multiple_of(4);
        }
        self.interfaces.push(interface);
        Ok(())
    }

    /// Returns the position of a packet in its block.
    fn packet_position(&self) -> Result<PacketPosition, CaptureError> {
        let number = usize::try_from(self.u32_at(0)?).unwrap_or(usize::MAX);
        let Some(interface) = self.interfaces.get(number) else {
            return Err(self.damaged_error("a packet is of an interface that was not described"));
        };
        let count = u64::from(self.u32_at(4)?) << 32 | u64::from(self.u32_at(8)?);
        let length = usize::try_from(self.u32_at(12)?).unwrap_or(usize::MAX);
        let end = length.saturating_add(20);
        if end > self.block.len() {
            return Err(self.damaged_error("a packet is longer than its block"));
        }
        let ns = u128::from(count) * 1_000_000_000 / u128::from(interface.per_second);
        let ns = u64::try_from(ns).unwrap_or(u64::MAX);
        let stamp_ns = ns.saturating_add_signed(interface.offset_s.saturating_mul(1_000_000_000));
        let is_cut = self.u32_at(12)? < self.u32_at(16)?;
        Ok(PacketPosition { stamp_ns, is_cut, link: interface.link, place: 20..end })
    }

    /// Reads `length` bytes as [`Self::read_block`] does, and stores their offset as that of the
    /// block.
    fn take_header(&mut self, length: u32) -> Result<bool, CaptureError> {
        self.offset = self.bytes_read;
        self.read_block(length)
    }

    /// Reads `length` bytes into `block`. Returns false if the file ends before the first of these
    /// bytes.
    fn read_block(&mut self, length: u32) -> Result<bool, CaptureError> {
        self.block.clear();
        let mut part = self.reader.by_ref().take(length.into());
        let read = part.read_to_end(&mut self.block);
        let read = read.map_err(|source| self.read_error(source))? as u64;
        if read > 0 && read < u64::from(length) {
            return Err(self.truncated_error());
        }
        self.bytes_read += read;
        Ok(read > 0)
    }

    fn skip_bytes(&mut self, length: u32) -> Result<(), CaptureError> {
        let mut part = self.reader.by_ref().take(length.into());
        let skipped = io::copy(&mut part, &mut io::sink());
        let skipped = skipped.map_err(|source| self.read_error(source))?;
        self.bytes_read += skipped;
        if skipped < u64::from(length) { Err(self.truncated_error()) } else { Ok(()) }
    }

    fn u16_at(&self, at: usize) -> Result<u16, CaptureError> {
        let bytes = self.block.get(at..).and_then(|rest| rest.first_chunk().copied());
        let bytes = bytes.ok_or_else(|| self.damaged_error("a block is shorter than its kind"))?;
        Ok(if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    fn u32_at(&self, at: usize) -> Result<u32, CaptureError> {
        let bytes = self.block.get(at..).and_then(|rest| rest.first_chunk().copied());
        let bytes = bytes.ok_or_else(|| self.damaged_error("a block is shorter than its kind"))?;
        Ok(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn read_error(&self, source: io::Error) -> CaptureError {
        CaptureError::Read { path: self.path.clone(), offset: self.offset, source }
    }

    fn truncated_error(&self) -> CaptureError {
        CaptureError::Truncated { path: self.path.clone(), offset: self.offset }
    }

    fn damaged_error(&self, what: &'static str) -> CaptureError {
        CaptureError::Damaged { path: self.path.clone(), offset: self.offset, what }
    }
}

/// A packet in its block.
struct PacketPosition {
    /// Time of capture \[ns since 1970\].
    stamp_ns: u64,
    /// True if the recorder kept only the first bytes.
    is_cut: bool,
    link: LinkType,
    place: Range<usize>,
}

/// Returns the format, the byte order (true for big endian) and the number of stamp ticks per
/// second. Returns `None` if the file is not a capture.
fn first_bytes(first: [u8; 4]) -> Option<(Format, bool, u64)> {
    let mut little = first;
    little.reverse();
    match (first, little) {
        (first, _) if first == SECTION_BLOCK.to_le_bytes() => Some((Format::Pcapng, false, 0)),
        (MICROSECOND_MAGIC, _) => Some((Format::Pcap, false, 1_000_000)),
        (NANOSECOND_MAGIC, _) => Some((Format::Pcap, false, 1_000_000_000)),
        (_, MICROSECOND_MAGIC) => Some((Format::Pcap, true, 1_000_000)),
        (_, NANOSECOND_MAGIC) => Some((Format::Pcap, true, 1_000_000_000)),
        _ => None,
    }
}
