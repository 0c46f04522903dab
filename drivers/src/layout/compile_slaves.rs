//! Compilation of a specification and the description of its EtherCAT network to a plan.

use std::io::BufRead;
use std::path::{Path, PathBuf};

use super::compile::{check_integer, finish, key_error};
use super::compile_nodes::{RequestedSignal, check_keys, requested_signals};
use super::dbc::{MessageFormat, SignalFormat};
use super::eds::{Direction, Object};
use super::error::LayoutError;
use super::field::{ByteOrder, Encoding, Field};
use super::plan::{CompiledLayout, Extraction, MessagePlan, Quantity, Role};
use super::process_data::{
    AssembledFrame, INPUTS_ID, OUTPUTS_ID, ProcessData, ProcessDatagram, SYNC_ID,
};
use super::readings::in_own_unit;
use super::slaves::{
    Area, Entry, Network, NetworkError, Slave, encoding_of, learn_network, read_eni,
};
use super::spec::LayoutSpec;
use crate::ethercat::{Capture, LRD, LRW, LWR};
use crate::frame::{FrameId, MAX_PAYLOAD};

impl CompiledLayout {
    /// Compiles the text of an ENI file and a specification to a plan.
    ///
    /// # Errors
    /// [`LayoutError`] names the mismatch and its place.
    pub fn compile_eni(text: &str, spec: &LayoutSpec) -> Result<Self, LayoutError> {
        let file = spec.eni.clone().unwrap_or_default();
        check_spec(spec)?;
        compile_network(&read_eni(text, &file, &spec.slaves)?, spec, file)
    }

    /// Compiles a capture of the start-up and a specification to a plan, like
    /// [`Self::compile_eni`].
    ///
    /// # Errors
    /// [`LayoutError`] names the mismatch and its place.
    pub fn compile_startup<R: BufRead>(
        capture: Capture<R>,
        spec: &LayoutSpec,
    ) -> Result<Self, LayoutError> {
        let file = capture.path().to_owned();
        check_spec(spec)?;
        if let Some(slave) = spec.slaves.iter().find(|slave| slave.address.is_none()) {
            let reason = format!(
                "{}: a start-up knows no names; give `address`, the station address, in place of \
                `name`",
                slave.label()
            );
            return key_error("slaves", reason);
        }
        compile_network(&learn_network(capture, &spec.slaves)?, spec, file)
    }
}

fn check_spec(spec: &LayoutSpec) -> Result<(), LayoutError> {
    check_keys(spec)?;
    if spec.slaves.len() != spec.axes {
        let reason = format!("{} for {} axes; give one per axis", spec.slaves.len(), spec.axes);
        return key_error("slaves", reason);
    }
    if spec.eni.is_some() && spec.startup.is_some() {
        return key_error("eni", "and `startup` describe the same; give one of them".into());
    }
    match spec.slaves.iter().find(|slave| slave.name.is_none() && slave.address.is_none()) {
        Some(_) => key_error("slaves", "an entry has neither `name` nor `address`".into()),
        None => Ok(()),
    }
}

/// Position and format of an object in the process data.
struct FoundObject {
    /// Index of the datagram that carries the object.
    command: usize,
    /// First bit of the object, from the first bit of the datagram's data.
    first_bit: u64,
    bits: u64,
    encoding: Encoding,
    name: String,
}

fn compile_network(
    network: &Network,
    spec: &LayoutSpec,
    file: PathBuf,
) -> Result<CompiledLayout, LayoutError> {
    let wanted = requested_signals(spec)?;
    let sync = MessageFormat { name: "SYNC".to_owned(), id: SYNC_ID, is_fd: false, length: 0 };
    let mut messages = vec![MessagePlan {
        format: sync,
        role: Role::Sync,
        extractions: Vec::new(),
        excluded_values: Vec::new(),
        selector: None,
    }];
    let mut gathered = Vec::new();
    // Report objects that are not mapped before objects that cannot be located. A missing mapping
    // is an error in the arm's configuration; a missing location is an error in the file.
    for (wanted, (axis, slave)) in signal_slave_pairs(&wanted, network) {
        find_entry(wanted, slave_area(slave, wanted.direction), spec, axis, (&slave.name, &file))?;
    }
    for (axis, slave) in network.slaves.iter().enumerate() {
        for direction in [Direction::Transmit, Direction::Receive] {
            let of_direction = wanted.iter().filter(|wanted| wanted.direction == direction);
            let signals = of_direction
                .map(|wanted| {
                    let who = (slave.name.as_str(), file.as_path());
                    Ok((
                        wanted,
                        find(wanted, slave_area(slave, direction), network, spec, axis, who)?,
                    ))
                })
                .collect::<Result<Vec<_>, LayoutError>>()?;
            if !signals.is_empty() {
                let (message, command, frame) = message(axis, direction, &slave.name, &signals)?;
                messages.push(message);
                gathered.push((command, direction, frame));
            }
        }
    }
    let process_data = process_data(network, gathered, &file)?;
    Ok(finish(messages, spec)?.with_process_data(process_data))
}

fn signal_slave_pairs<'a>(
    wanted: &'a [RequestedSignal<'a>],
    network: &'a Network,
) -> impl Iterator<Item = (&'a RequestedSignal<'a>, (usize, &'a Slave))> {
    wanted.iter().flat_map(|wanted| network.slaves.iter().enumerate().map(move |s| (wanted, s)))
}

fn slave_area(slave: &Slave, direction: Direction) -> &Area {
    match direction {
        Direction::Transmit => &slave.inputs,
        Direction::Receive => &slave.outputs,
    }
}

fn name_of(direction: Direction) -> &'static str {
    match direction {
        Direction::Transmit => "inputs",
        Direction::Receive => "outputs",
    }
}

/// Returns the entry of an object in an area of process data.
fn find_entry(
    wanted: &RequestedSignal<'_>,
    area: &Area,
    spec: &LayoutSpec,
    axis: usize,
    (slave, file): (&str, &Path),
) -> Result<Entry, NetworkError> {
    let offset = spec.slaves.get(axis).map_or(0, |slave| slave.object_offset);
    let object = Object {
        index: wanted.object.index.wrapping_add(offset),
        sub_index: wanted.object.sub_index,
    };
    if let Some(entry) = area.entries.iter().find(|entry| entry.object == object) {
        return Ok(*entry);
    }
    if let (true, Err(why)) = (area.entries.is_empty(), &area.first_bit) {
        return Err(why.clone());
    }
    Err(NetworkError::NotMapped {
        file: file.to_owned(),
        key: wanted.key,
        whose: format!("{} of slave {slave}", name_of(wanted.direction)),
        object: object.to_string(),
        mapped: area.entries.iter().map(|entry| entry.object.to_string()).collect(),
    })
}

fn find(
    wanted: &RequestedSignal<'_>,
    area: &Area,
    network: &Network,
    spec: &LayoutSpec,
    axis: usize,
    (slave, file): (&str, &Path),
) -> Result<FoundObject, NetworkError> {
    let entry = find_entry(wanted, area, spec, axis, (slave, file))?;
    let object = entry.object;
    let wrong = |problem: &str| NetworkError::Object {
        file: file.to_owned(),
        slave: slave.to_owned(),
        object: object.to_string(),
        problem: problem.to_owned(),
    };
    let encoding = entry.encoding.or_else(|| encoding_of(object)).ok_or_else(|| {
        wrong(
            "neither the file nor CiA 402 says whether it is signed; name an ENI file with its \
            DataType",
        )
    })?;
    let first = area.first_bit.clone()? + entry.first_bit;
    let reads = wanted.direction == Direction::Transmit;
    let place = network.commands.iter().enumerate().find_map(|(command, datagram)| {
        let kinds = if reads { [LRD, LRW] } else { [LWR, LRW] };
        let start = if reads { datagram.input_bit } else { datagram.output_bit };
        let end = start + 8 * u64::from(datagram.length);
        let within =
            kinds.contains(&datagram.command) && first >= start && first + entry.bits <= end;
        within.then(|| (command, first - start))
    });
    let (command, bit) = place.ok_or_else(|| NetworkError::NotCyclic {
        file: file.to_owned(),
        direction: name_of(wanted.direction),
        slave: slave.to_owned(),
        remedy: "take a file of the running configuration, with the cyclic data of OP",
    })?;
    let name = format!("{slave}.{object}");
    Ok(FoundObject { command, first_bit: bit, bits: entry.bits, encoding, name })
}

/// Returns the frame of an axis in one direction: its message in the plan, its datagram, and the
/// ranges of bytes from which it is assembled.
fn message(
    axis: usize,
    direction: Direction,
    slave: &str,
    found: &[(&RequestedSignal<'_>, FoundObject)],
) -> Result<(MessagePlan, usize, AssembledFrame), LayoutError> {
    let reads = direction == Direction::Transmit;
    let first = if reads { INPUTS_ID } else { OUTPUTS_ID };
    let id = FrameId::Standard(first + u16::try_from(axis).unwrap_or(0));
    let mut extractions = Vec::new();
    let mut parts = Vec::new();
    let field = |at: usize, bit: u64, bits: u64, encoding| {
        let start = 8 * at as u64 + bit % 8;
        let order = ByteOrder::LittleEndian;
        Field::new(start, bits, order, encoding, (1.0, 0.0), MAX_PAYLOAD)
    };
    let mut length = 0;
    let mut command = None;
    let wrong = |name: &str, reason: &str| LayoutError::Signal {
        signal: name.to_owned(),
        line: None,
        reason: reason.to_owned(),
    };
    let mut put = |quantity, unit: &str, name: String, field: Option<Field>| {
        let field = field.ok_or_else(|| wrong(&name, "1 to 64 bits can be read"))?;
        let signal = SignalFormat { name, field, unit: unit.to_owned(), range: None };
        let signal = in_own_unit(quantity, signal)?;
        check_integer(quantity, &signal)?;
        extractions.push(Extraction { quantity, axis, signal });
        Ok::<_, LayoutError>(())
    };
    if reads {
        let name = format!("{slave}.network state");
        put(Quantity::NetworkState, "", name, field(0, 0, 8, Encoding::Unsigned))?;
        length = 1;
    }
    for (wanted, found) in found {
        if *command.get_or_insert(found.command) != found.command {
            return Err(wrong(
                &found.name,
                "lies in another datagram than the other signals of the layout",
            ));
        }
        let bytes = (found.first_bit % 8 + found.bits).div_ceil(8);
        let (first, bytes) = (found.first_bit / 8, usize::try_from(bytes).unwrap_or(MAX_PAYLOAD));
        if length + bytes > MAX_PAYLOAD {
            return Err(wrong(&found.name, "does not fit a frame of 64 bytes"));
        }
        put(
            wanted.quantity,
            wanted.unit,
            found.name.clone(),
            field(length, found.first_bit, found.bits, found.encoding),
        )?;
        parts.push((usize::try_from(first).unwrap_or(usize::MAX), length, bytes));
        length += bytes;
    }
    let name = format!("{} of {slave}", name_of(direction));
    let length = u8::try_from(length).unwrap_or(u8::MAX);
    let format = MessageFormat { name, id, is_fd: true, length };
    let gathered = AssembledFrame { id, length: format.wire_length(), byte_ranges: parts };
    let message = MessagePlan {
        format,
        role: Role::Sample,
        extractions,
        excluded_values: Vec::new(),
        selector: None,
    };
    Ok((message, command.unwrap_or(0), gathered))
}

/// Returns the datagrams that carry frames of the plan.
fn process_data(
    network: &Network,
    gathered: Vec<(usize, Direction, AssembledFrame)>,
    file: &Path,
) -> Result<ProcessData, NetworkError> {
    let (mut datagrams, mut clock) = (Vec::new(), false);
    for (number, command) in network.commands.iter().enumerate() {
        let wanted_of = |wanted: Direction| {
            let entries = gathered
                .iter()
                .filter(move |(n, direction, _)| (*n, *direction) == (number, wanted));
            entries.map(|(_, _, frame)| frame.clone()).collect::<Vec<_>>()
        };
        let (inputs, outputs) = (wanted_of(Direction::Transmit), wanted_of(Direction::Receive));
        if inputs.is_empty() && outputs.is_empty() {
            continue;
        }
        if datagrams.is_empty() {
            clock = command.carries_clock;
        }
        let (address, length) = (command.address, usize::from(command.length));
        let expected = command.expected_counter;
        let expected =
            expected.ok_or_else(|| NetworkError::NoCounter { file: file.to_owned(), address })?;
        let command = command.command;
        datagrams.push(ProcessDatagram {
            command,
            address,
            length,
            expected_counter: expected,
            inputs,
            outputs,
        });
    }
    Ok(ProcessData { datagrams, clock })
}
