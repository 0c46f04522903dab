//! EtherCAT datagrams of an Ethernet frame (ETG.1000, part 4), read without copies.

/// Commands of datagrams. A command reads (RD), writes (WR) or does both (RW). It addresses one
/// slave by its station address (F), all slaves (B) or a logical address (L). With ARMW and FRMW,
/// one slave is read and the other slaves are written.
pub(crate) const FPRD: u8 = 4;
pub(crate) const FPWR: u8 = 5;
pub(crate) const FPRW: u8 = 6;
pub(crate) const BRD: u8 = 7;
pub(crate) const LRD: u8 = 10;
pub(crate) const LWR: u8 = 11;
pub(crate) const LRW: u8 = 12;
pub(crate) const ARMW: u8 = 13;
pub(crate) const FRMW: u8 = 14;

/// Register of the AL status: one byte of state and error.
pub(crate) const AL_STATUS: u16 = 0x0130;
/// Registers of the sixteen memory management units of a slave, 16 bytes each.
pub(crate) const FMMU_REGISTERS: core::ops::Range<u16> = 0x0600..0x0700;
/// Register of the system time of the distributed clock \[ns\].
pub(crate) const SYSTEM_TIME: u16 = 0x0910;
/// First address of a slave's memory; mailboxes lie in it.
pub(crate) const MAILBOX_START: u16 = 0x1000;

/// Length of the destination and source addresses of an Ethernet frame \[bytes\].
const ADDRESS_BYTES: usize = 12;
const VLAN_TYPE: u16 = 0x8100;
/// The EtherType of EtherCAT.
pub(crate) const ETHERCAT_TYPE: u16 = 0x88A4;
/// The EtherType of IPv4, its protocol number of UDP, and the port of EtherCAT in UDP.
const IPV4_TYPE: u16 = 0x0800;
const UDP_PROTOCOL: u8 = 17;
const ETHERCAT_PORT: u16 = ETHERCAT_TYPE;
/// Length of the header of UDP \[bytes\].
const UDP_HEADER_BYTES: usize = 8;
/// The type of EtherCAT frame that holds datagrams.
const DATAGRAM_TYPE: u16 = 1;
/// Length of the fields before the data of a datagram: command, index, address, length and
/// interrupt \[bytes\].
const HEADER_BYTES: usize = 10;
const COUNTER_BYTES: usize = 2;

/// One datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Datagram<'a> {
    pub(crate) command: u8,
    /// Number that the master chose; it is the same in the outgoing and the returning datagram.
    pub(crate) index: u8,
    /// Logical address, or the station address in the low half and the register in the high half.
    pub(crate) address: u32,
    pub(crate) data: &'a [u8],
    /// Counter that the slaves increase if they take part, by the rules of the command.
    pub(crate) working_counter: u16,
}

impl Datagram<'_> {
    /// Returns the station address of the slave, if the command has one.
    pub(crate) fn station_address(&self) -> u16 {
        let [low, high, ..] = self.address.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Returns the address of the register, if the command has one.
    pub(crate) fn register(&self) -> u16 {
        let [.., low, high] = self.address.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Returns true if the datagram reads or writes process data.
    pub(crate) fn is_logical(&self) -> bool {
        matches!(self.command, LRD | LWR | LRW)
    }

    /// Returns the time of the distributed clock \[ns\] and its number of bits, 32 or 64. It is the
    /// time at which the datagram passed the reference clock. Returns `None` if the datagram does
    /// not carry a time.
    pub(crate) fn system_time(&self) -> Option<(u64, u8)> {
        let is_clock = matches!(self.command, ARMW | FRMW) && self.register() == SYSTEM_TIME;
        if !is_clock || self.working_counter == 0 {
            return None;
        }
        match (<[u8; 8]>::try_from(self.data), <[u8; 4]>::try_from(self.data)) {
            (Ok(bytes), _) => Some((u64::from_le_bytes(bytes), 64)),
            (_, Ok(bytes)) => Some((u32::from_le_bytes(bytes).into(), 32)),
            _ => None,
        }
    }
}

/// A complete Ethernet frame of EtherCAT datagrams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EthercatFrame<'a> {
    /// True if the frame has passed the slaves. The first slave sets the second lowest bit of the
    /// source address. Only in a returning frame have the slaves written their inputs.
    pub(crate) is_returning: bool,
    datagrams: &'a [u8],
}

impl<'a> EthercatFrame<'a> {
    /// Parses a packet. Returns `None` if it is not a complete EtherCAT frame of datagrams.
    pub(crate) fn parse(packet: &'a [u8]) -> Option<Self> {
        let returning = packet.get(6)? & 2 != 0;
        let mut offset = ADDRESS_BYTES;
        if u16_big_endian(packet, offset)? == VLAN_TYPE {
            offset += 4;
        }
        let content = match u16_big_endian(packet, offset)? {
            ETHERCAT_TYPE => packet.get(offset + 2..)?,
            IPV4_TYPE => content_of_udp(packet.get(offset + 2..)?)?,
            _ => return None,
        };
        let header = u16_little_endian(content, 0)?;
        let length = usize::from(header & 0x7FF);
        // The bytes after this length pad the frame to 60 bytes.
        let datagrams = content.get(2..)?.get(..length)?;
        let frame = Self { is_returning: returning, datagrams };
        (header >> 12 == DATAGRAM_TYPE && frame.is_whole()).then_some(frame)
    }

    /// Returns the datagrams of the frame, in their order.
    pub(crate) fn datagrams(&self) -> impl Iterator<Item = Datagram<'a>> + use<'a> {
        let mut rest = Some(self.datagrams);
        core::iter::from_fn(move || {
            let (datagram, after) = split_first(rest?)?;
            rest = after;
            Some(datagram)
        })
    }

    fn is_whole(&self) -> bool {
        let mut rest = Some(self.datagrams);
        while let Some(bytes) = rest {
            let Some((_, after)) = split_first(bytes) else { return false };
            rest = after;
        }
        true
    }
}

/// Returns the first datagram, and the bytes after it if more datagrams follow.
fn split_first(bytes: &[u8]) -> Option<(Datagram<'_>, Option<&[u8]>)> {
    let word = u16_little_endian(bytes, 6)?;
    let end = HEADER_BYTES + usize::from(word & 0x7FF);
    let datagram = Datagram {
        command: *bytes.first()?,
        index: *bytes.get(1)?,
        address: u32::from_le_bytes(*bytes.get(2..)?.first_chunk()?),
        data: bytes.get(HEADER_BYTES..end)?,
        working_counter: u16_little_endian(bytes, end)?,
    };
    let more = word & 0x8000 != 0;
    Some((datagram, if more { Some(bytes.get(end + COUNTER_BYTES..)?) } else { None }))
}

fn u16_little_endian(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// Returns the EtherCAT frame in an IPv4 packet with UDP to the port of EtherCAT.
fn content_of_udp(packet: &[u8]) -> Option<&[u8]> {
    let header = usize::from(packet.first()? & 0x0F) * 4;
    let udp = packet.get(header..).filter(|_| packet.get(9) == Some(&UDP_PROTOCOL))?;
    let is_ethercat = u16_big_endian(udp, 2)? == ETHERCAT_PORT;
    udp.get(UDP_HEADER_BYTES..).filter(|_| is_ethercat)
}

fn u16_big_endian(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}
