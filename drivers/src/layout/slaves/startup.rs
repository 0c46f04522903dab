//! Reads a network from the messages that a master sends to its slaves at start-up. They are the
//! PDO assignment and mapping by SDO (ETG.1000, part 6; ETG.1020), the FMMUs, and the cyclic
//! datagrams that follow.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::Path;

use super::super::eds::Object;
use super::super::spec::SlaveSpec;
use super::{Area, Command, Network, NetworkError, Slave, encoding_of};
use crate::ethercat::{
    Capture, Datagram, EthercatFrame, FMMU_REGISTERS, FPRD, FPRW, FPWR, LRD, LRW, LWR,
    MAILBOX_START,
};

/// Largest number of stored objects of all slaves, and largest number of stored cyclic datagrams.
const MAX_OBJECTS: usize = 1 << 16;
const MAX_COMMANDS: usize = 256;

/// The mailbox protocol CANopen over EtherCAT, and its services.
const COE_PROTOCOL: u8 = 3;
const SDO_REQUEST: u16 = 2;
const SDO_RESPONSE: u16 = 3;

/// Objects that assign PDOs to the outputs and to the inputs of a slave.
const OUTPUT_ASSIGNMENT: u16 = 0x1C12;
const INPUT_ASSIGNMENT: u16 = 0x1C13;

/// Setting of a memory management unit: the range of logical memory that a slave reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fmmu {
    address: u32,
    bytes: u16,
    /// True if the unit covers complete bytes.
    is_byte_aligned: bool,
    is_read: bool,
    is_written: bool,
}

/// Settings read from the capture until now.
#[derive(Default)]
struct LearntNetwork {
    /// Latest value by station, index and sub-index.
    objects: BTreeMap<(u16, u16, u8), u32>,
    /// Downloads that the slave has not confirmed, by station.
    open_downloads: BTreeMap<u16, SdoTransfer>,
    fmmus: BTreeMap<(u16, u16), Fmmu>,
    /// Cyclic datagrams in the order of their first appearance: command, address and length. The
    /// last value is true if the same frame carries the time of the distributed clock.
    commands: Vec<(u8, u32, u16, bool)>,
}

/// Values that one SDO transfers: those of one sub-index, or of all sub-indices from it on.
#[derive(Clone, Debug, PartialEq, Eq)]
struct SdoTransfer {
    index: u16,
    sub_index: u8,
    is_complete_access: bool,
    data: Vec<u8>,
}

/// Reads the slaves that a layout names, and the cyclic datagrams, from a capture.
pub(in crate::layout) fn learn_network<R: BufRead>(
    mut capture: Capture<R>,
    wanted: &[SlaveSpec],
) -> Result<Network, NetworkError> {
    let mut learnt = LearntNetwork::default();
    loop {
        match capture.next_packet() {
            Ok(Some(packet)) => {
                let frame = EthercatFrame::parse(packet.bytes).filter(|frame| frame.is_returning);
                let datagrams = || frame.iter().flat_map(EthercatFrame::datagrams);
                let with_clock = datagrams().any(|datagram| datagram.system_time().is_some());
                datagrams().for_each(|datagram| learnt.handle_datagram(&datagram, with_clock));
            }
            Ok(None) => break,
            Err(error) => return Err(error.into()),
        }
    }
    let file = capture.path();
    let slaves =
        wanted.iter().map(|spec| learnt.slave_by_spec(spec, file)).collect::<Result<_, _>>()?;
    Ok(Network { slaves, commands: learnt.commands() })
}

impl LearntNetwork {
    fn handle_datagram(&mut self, datagram: &Datagram<'_>, with_clock: bool) {
        if datagram.working_counter == 0 {
            return;
        }
        let is_write = matches!(datagram.command, FPWR | FPRW);
        if datagram.is_logical() {
            let length = u16::try_from(datagram.data.len()).unwrap_or(u16::MAX);
            let seen = (datagram.command, datagram.address, length);
            let is_seen = |(a, b, c, _): &(u8, u32, u16, bool)| (*a, *b, *c) == seen;
            if let Some(command) = self.commands.iter_mut().find(|available| is_seen(available)) {
                command.3 |= with_clock;
            } else if self.commands.len() < MAX_COMMANDS {
                self.commands.push((seen.0, seen.1, seen.2, with_clock));
            }
        } else if is_write && FMMU_REGISTERS.contains(&datagram.register()) {
            self.units(datagram);
        } else if datagram.register() >= MAILBOX_START && (is_write || datagram.command == FPRD) {
            self.handle_mailbox(datagram);
        }
    }

    /// Reads a write to one or several memory management units.
    fn units(&mut self, datagram: &Datagram<'_>) {
        let offset = datagram.register() - FMMU_REGISTERS.start;
        if !offset.is_multiple_of(16) {
            return;
        }
        for (number, unit) in (offset / 16..16).zip(datagram.data.chunks_exact(16)) {
            let place = (datagram.station_address(), number);
            let [a, b, c, d, l, m, start_bit, stop_bit, _, _, _, kind, active, ..] = *unit else {
                continue;
            };
            if active & 1 == 0 {
                self.fmmus.remove(&place);
                continue;
            }
            let unit = Fmmu {
                address: u32::from_le_bytes([a, b, c, d]),
                bytes: u16::from_le_bytes([l, m]),
                is_byte_aligned: start_bit == 0 && stop_bit == 7,
                is_read: kind & 1 != 0,
                is_written: kind & 2 != 0,
            };
            if self.fmmus.len() < MAX_OBJECTS {
                self.fmmus.insert(place, unit);
            }
        }
    }

    /// Reads a mailbox message with an SDO.
    fn handle_mailbox(&mut self, datagram: &Datagram<'_>) -> Option<()> {
        let station = datagram.station_address();
        let (header, rest) = datagram.data.split_first_chunk::<6>()?;
        let length = usize::from(u16::from_le_bytes([header[0], header[1]]));
        let message = rest.get(..length).filter(|_| header[5] & 0x0F == COE_PROTOCOL)?;
        let service = u16::from_le_bytes(*message.first_chunk()?) >> 12;
        let [command, low, high, sub] = *message.get(2..)?.first_chunk()?;
        let index = u16::from_le_bytes([low, high]);
        // The highest three bits encode the operation.
        match (service, command >> 5) {
            (SDO_REQUEST, 1) => {
                self.open_downloads.remove(&station);
                let data = data_of(command, message.get(6..)?)?;
                let complete = command & 0x10 != 0;
                let asked = SdoTransfer {
                    index,
                    sub_index: sub,
                    is_complete_access: complete,
                    data: data.to_vec(),
                };
                if is_kept(index) && self.open_downloads.len() < MAX_OBJECTS {
                    self.open_downloads.insert(station, asked);
                }
            }
            (SDO_RESPONSE, 3) => {
                let asked = self.open_downloads.remove(&station)?;
                if (asked.index, asked.sub_index) == (index, sub) {
                    self.store_transfer(station, &asked);
                }
            }
            (SDO_RESPONSE, 2) => {
                let data = data_of(command, message.get(6..)?)?.to_vec();
                let complete = command & 0x10 != 0;
                self.store_transfer(
                    station,
                    &SdoTransfer { index, sub_index: sub, is_complete_access: complete, data },
                );
            }
            (SDO_REQUEST, 4) => drop(self.open_downloads.remove(&station)),
            _ => {}
        }
        Some(())
    }

    fn store_transfer(&mut self, station: u16, transfer: &SdoTransfer) {
        let SdoTransfer { index, sub_index: sub, is_complete_access: complete, data } = transfer;
        if !is_kept(*index) {
            return;
        }
        let value = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, b| word << 8 | u32::from(*b));
        let mut put = |sub, value| {
            if self.objects.len() < MAX_OBJECTS {
                self.objects.insert((station, *index, sub), value);
            }
        };
        if !complete {
            return put(*sub, value(data.get(..4).unwrap_or(data)));
        }
        // Sub-index 0 is padded by one byte to a word.
        let entries = match (*sub, data.as_slice()) {
            (0, [count, _, entries @ ..]) => {
                put(0, (*count).into());
                entries
            }
            (1, entries) => entries,
            _ => return,
        };
        let size = if matches!(*index, INPUT_ASSIGNMENT | OUTPUT_ASSIGNMENT) { 2 } else { 4 };
        for (sub, entry) in (1..=u8::MAX).zip(entries.chunks_exact(size)) {
            put(sub, value(entry));
        }
    }

    fn slave_by_spec(&self, spec: &SlaveSpec, file: &Path) -> Result<Slave, NetworkError> {
        let is_known = |station: &u16| self.objects.keys().any(|(other, ..)| other == station);
        let Some(station) = spec.address.filter(is_known) else {
            let mut stations: Vec<u16> =
                self.objects.keys().map(|(station, ..)| *station).collect();
            stations.dedup();
            if stations.is_empty() {
                return Err(NetworkError::NoStartup { file: file.to_owned() });
            }
            return Err(NetworkError::NoSlave {
                file: file.to_owned(),
                wanted: spec.label(),
                found: stations.iter().map(ToString::to_string).collect(),
            });
        };
        let area = |assignment| {
            self.assigned_area(station, assignment).unwrap_or_else(|what| {
                let (file, slave) = (file.to_owned(), spec.label());
                Area::from_unknown(NetworkError::NotLearnt { file, slave, what })
            })
        };
        let place = |area: Area, reads: bool| {
            let first_bit = area.first_bit.and_then(|bits| {
                self.logical_address(station, bits, reads).ok_or_else(|| NetworkError::NotLearnt {
                    file: file.to_owned(),
                    slave: spec.label(),
                    what: format!(
                        "one FMMU over the {bits} bits of the {}",
                        if reads { "inputs" } else { "outputs" }
                    ),
                })
            });
            Area { first_bit, ..area }
        };
        let name = spec.label();
        let (inputs, outputs) =
            (place(area(INPUT_ASSIGNMENT), true), place(area(OUTPUT_ASSIGNMENT), false));
        Ok(Slave { name, inputs, outputs })
    }

    /// Returns the contents of the assigned PDOs. `first_bit` of the result holds their number of
    /// bits, because their position is not known here. The error names the missing data.
    fn assigned_area(&self, station: u16, assignment: u16) -> Result<Area, String> {
        let value = |index: u16, sub: u8| self.objects.get(&(station, index, sub)).copied();
        let need = |index, sub| value(index, sub).ok_or_else(|| format!("{index:04X}:{sub:02X}"));
        let low_byte = |word: u32| word.to_le_bytes()[0];
        let mut mapped = Vec::new();
        for sub in 1..=low_byte(need(assignment, 0)?) {
            let [low, high, ..] = need(assignment, sub)?.to_le_bytes();
            let pdo = u16::from_le_bytes([low, high]);
            for sub in 1..=low_byte(need(pdo, 0)?) {
                let [bits, sub, low, high] = need(pdo, sub)?.to_le_bytes();
                let object = Object { index: u16::from_le_bytes([low, high]), sub_index: sub };
                mapped.push((object, u64::from(bits), encoding_of(object)));
            }
        }
        let bits = mapped.iter().map(|(_, bits, _)| bits).sum();
        Ok(Area::from_entries(mapped, Ok(bits)))
    }

    /// Returns the first bit in logical memory of an area of `bits` bits, if one memory management
    /// unit covers exactly this area.
    fn logical_address(&self, station: u16, bits: u64, reads: bool) -> Option<u64> {
        let of_station = self.fmmus.range((station, 0)..=(station, u16::MAX)).map(|(_, unit)| unit);
        let mut fitting = of_station.filter(|unit| {
            let right = if reads { unit.is_read } else { unit.is_written };
            right && unit.is_byte_aligned && u64::from(unit.bytes) == bits.div_ceil(8)
        });
        let (Some(unit), None) = (fitting.next(), fitting.next()) else { return None };
        Some(8 * u64::from(unit.address))
    }

    fn commands(&self) -> Vec<Command> {
        self.commands
            .iter()
            .map(|(command, address, length, with_clock): &(u8, u32, u16, bool)| {
                let first_bit = 8 * u64::from(*address);
                Command {
                    command: *command,
                    address: *address,
                    length: *length,
                    input_bit: first_bit,
                    output_bit: first_bit,
                    expected_counter: Some(self.expected_counter(*command, *address, *length)),
                    carries_clock: *with_clock,
                }
            })
            .collect()
    }

    /// Returns the expected working counter of a datagram. Each slave counts once for its inputs
    /// and once for its outputs. If one datagram carries both, the outputs count twice.
    fn expected_counter(&self, command: u8, address: u32, length: u16) -> u16 {
        let end = u64::from(address) + u64::from(length);
        let mut by_station: BTreeMap<u16, (u16, u16)> = BTreeMap::new();
        for ((station, _), unit) in &self.fmmus {
            let unit_end = u64::from(unit.address) + u64::from(unit.bytes);
            if u64::from(unit.address) < end && unit_end > u64::from(address) {
                let (gives, takes) = by_station.entry(*station).or_default();
                *gives |= u16::from(unit.is_read);
                *takes |= u16::from(unit.is_written);
            }
        }
        let count = |(gives, takes): &(u16, u16)| match command {
            LRD => *gives,
            LWR => *takes,
            LRW => gives + 2 * takes,
            _ => 0,
        };
        by_station.values().map(count).fold(0, u16::saturating_add)
    }
}

/// Returns true for the indices of objects that describe PDOs.
fn is_kept(index: u16) -> bool {
    matches!(index, OUTPUT_ASSIGNMENT | INPUT_ASSIGNMENT | 0x1600..=0x17FF | 0x1A00..=0x1BFF)
}

/// Returns the data of a transfer in one message, or `None` for a segmented transfer.
fn data_of(command: u8, data: &[u8]) -> Option<&[u8]> {
    let (is_expedited, has_size) = (command & 2 != 0, command & 1 != 0);
    if is_expedited {
        let unused = if has_size { usize::from(command >> 2 & 3) } else { 0 };
        return data.get(..4 - unused);
    }
    let size = usize::try_from(u32::from_le_bytes(*data.first_chunk()?)).ok()?;
    data.get(4..)?.get(..size)
}
