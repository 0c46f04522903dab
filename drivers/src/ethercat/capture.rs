//! Packets of a capture file, in the format pcap (libpcap, tcpdump) or pcapng (Wireshark, dumpcap).

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

/// Length of the longest block that is read, including its header \[bytes\]. Longer blocks are
/// skipped if their kind is not used.
const MAX_BLOCK: u32 = 1 << 20;
/// Largest number of interfaces of one section.
const MAX_INTERFACES: usize = 256;
/// Link type: Ethernet.
const ETHERNET_LINK_TYPE: u16 = 1;

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
    pub bytes: &'a [u8],
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
    is_ethernet: bool,
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

    /// Returns the number of skipped packets, which are not Ethernet or have no stamp.
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
        let packet = match self.format {
            Format::Pcapng => self.next_of_pcapng()?,
            _ => self.next_of_pcap()?,
        };
        Ok(packet
            .and_then(|(stamp_ns, place)| Some(Packet { stamp_ns, bytes: self.block.get(place)? })))
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
            let is_ethernet = self.u16_at(if big_endian { 22 } else { 20 })? == ETHERNET_LINK_TYPE;
            self.interfaces.push(Interface { is_ethernet, per_second, offset_s: 0 });
        }
        Ok(())
    }

    fn next_of_pcap(&mut self) -> Result<Option<PacketPosition>, CaptureError> {
        while self.take_header(16)? {
            let (seconds, fraction, length) = (self.u32_at(0)?, self.u32_at(4)?, self.u32_at(8)?);
            let Some(interface) = self.interfaces.first().copied() else { return Ok(None) };
            if length > MAX_BLOCK {
                return Err(self.damaged_error("a packet is longer than any frame"));
            }
            if !self.read_block(length)? && length > 0 {
                return Err(self.truncated_error());
            }
            if interface.is_ethernet {
                let fraction_ns = u64::from(fraction) * (1_000_000_000 / interface.per_second);
                let stamp_ns = u64::from(seconds) * 1_000_000_000 + fraction_ns;
                return Ok(Some((stamp_ns, 0..self.block.len())));
            }
            self.passed_over += 1;
        }
        Ok(None)
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
                _ => {
                    if let Some(found) = self.packet_position()? {
                        return Ok(Some(found));
                    }
                    self.passed_over += 1;
                }
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
        let is_ethernet = self.u16_at(0)? == ETHERNET_LINK_TYPE;
        let mut interface = Interface { is_ethernet, per_second: 1_000_000, offset_s: 0 };
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

    /// Returns the position of a packet in its block, or `None` if the packet is skipped.
    fn packet_position(&self) -> Result<Option<PacketPosition>, CaptureError> {
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
        Ok(interface.is_ethernet.then_some((stamp_ns, 20..end)))
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

/// Stamp of a packet \[ns\], and the position of the packet in its block.
type PacketPosition = (u64, core::ops::Range<usize>);

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
