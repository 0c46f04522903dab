//! Compilation of a specification and the device files of its nodes to a plan.

use std::path::Path;

use didim_dynamics::Reading;

use super::compile::{at_arrival, check_integer, finish, key_error};
use super::dbc::{MessageFormat, SignalFormat};
use super::eds::{Dictionary, Direction, EdsError, Mapped, Object, Pdo, Transmission, identifier};
use super::error::LayoutError;
use super::field::{ByteOrder, Field};
use super::plan::{CompiledLayout, Extraction, MessagePlan, Quantity, Role};
use super::readings::{in_own_unit, reading_specs};
use super::spec::{LayoutSpec, NodeSpec, ReferenceValidity};
use crate::frame::FrameId;

/// Object of the drive that the layout requires of every node.
pub(super) struct RequestedSignal<'a> {
    pub(super) key: &'static str,
    pub(super) quantity: Quantity,
    pub(super) object: Object,
    pub(super) unit: &'a str,
    pub(super) direction: Direction,
}

/// A parsed device file with its PDOs.
struct Node<'a> {
    dictionary: Dictionary<'a>,
    offset: u16,
    transmit_pdos: Vec<Pdo>,
    receive_pdos: Vec<Pdo>,
}

impl CompiledLayout {
    /// Compiles the device files (EDS, DCF) of a specification's nodes to a plan. `texts` contains
    /// the texts of the files, in the order of the nodes.
    ///
    /// # Errors
    /// [`LayoutError`] names the mismatch and its place.
    pub fn compile_nodes(texts: &[&str], spec: &LayoutSpec) -> Result<Self, LayoutError> {
        check_keys(spec)?;
        if spec.nodes.len() != spec.axes {
            let reason = format!("{} for {} axes; give one per axis", spec.nodes.len(), spec.axes);
            return key_error("nodes", reason);
        }
        let files = files(spec)?;
        let wanted = requested_signals(spec)?;
        let nodes = read_node(texts, spec, &files)?;
        let mut messages = vec![sync_message(&nodes)?];
        for wanted in &wanted {
            for (axis, node) in nodes.iter().enumerate() {
                add(&mut messages, wanted, axis, node)?;
            }
        }
        finish(messages, spec)
    }
}

/// Checks that the specification has no key that only a layout from a DBC file can have.
pub(super) fn check_keys(spec: &LayoutSpec) -> Result<(), LayoutError> {
    if spec.sync.is_some() {
        let reason = "is object 1005h of the device files, and the cycle of EtherCAT; leave it out";
        return key_error("sync", reason.into());
    }
    if spec.counter.is_some() {
        return key_error("counter", "is for packed frames; PDOs go by the cycle".into());
    }
    let signals = [
        ("position.signal", spec.position.signal.is_some()),
        ("torque.signal", spec.torque.signal.is_some()),
        ("reference.signal", spec.reference.as_ref().is_some_and(|r| r.signal.is_some())),
        ("enabled", spec.enabled.is_some()),
        ("except", !spec.except.is_empty()),
        ("law", spec.law.is_some()),
    ];
    let of_readings =
        reading_specs(spec).map(|(_, [signal, ..], of)| (signal, of.signal.is_some()));
    match signals.into_iter().chain(of_readings).find(|(_, is_present)| *is_present) {
        Some((key, _)) => key_error(
            key,
            "names a signal of a DBC file; with `nodes` and `slaves` use `object`".into(),
        ),
        None if at_arrival(spec) => key_error(
            "position.valid",
            "\"arrival\" is for a bus without SYNC; PDOs go by it".into(),
        ),
        None => Ok(()),
    }
}

pub(super) fn requested_signals(
    spec: &LayoutSpec,
) -> Result<Vec<RequestedSignal<'_>>, LayoutError> {
    let single = |key, unit_key, quantity, object: Option<&str>, unit, direction| {
        let Some(object) = object else {
            return key_error(key, "missing: name the object, as \"6064:00\"".into());
        };
        let Some(object) = Object::parse(object) else {
            let reason = format!("`{object}`: index and sub-index in hexadecimal, as \"6064:00\"");
            return key_error(key, reason);
        };
        let Some(unit) = unit else {
            let reason = "missing: a device file has no units; \"count\", \"per mille\"… as the \
                          drive's manual says";
            return key_error(unit_key, reason.into());
        };
        Ok(RequestedSignal { key, quantity, object, unit, direction })
    };
    let (position, torque) = (&spec.position, &spec.torque);
    let mut wanted = vec![
        single(
            "position.object",
            "position.unit",
            Quantity::Position,
            position.object.as_deref(),
            position.unit.as_deref(),
            Direction::Transmit,
        )?,
        single(
            "torque.object",
            "torque.unit",
            Quantity::Torque,
            torque.object.as_deref(),
            torque.unit.as_deref(),
            Direction::Transmit,
        )?,
    ];
    if let Some(reference) = &spec.reference {
        // A value that the drive reports is valid at the SYNC. A value that it receives takes
        // effect at the next SYNC.
        let direction = match reference.valid {
            ReferenceValidity::Instant => Direction::Transmit,
            ReferenceValidity::NextSync | ReferenceValidity::Arrival => Direction::Receive,
        };
        wanted.push(single(
            "reference.object",
            "reference.unit",
            Quantity::Reference,
            reference.object.as_deref(),
            reference.unit.as_deref(),
            direction,
        )?);
    }
    if let Some(word) = &spec.status_word {
        let (key, word) = ("status_word", Some(word.as_str()));
        wanted.push(single(key, key, Quantity::StatusWord, word, Some(""), Direction::Transmit)?);
    }
    for (reading, [_, key, unit_key], of) in reading_specs(spec) {
        let unit = match (reading, of.unit.as_deref()) {
            (Reading::Mode, Some(_)) => return key_error(unit_key, "a mode has none".into()),
            (Reading::Mode, None) => Some(""),
            (_, unit) => unit,
        };
        let (quantity, object) = (Quantity::Reading(reading), of.object.as_deref());
        wanted.push(single(key, unit_key, quantity, object, unit, Direction::Transmit)?);
    }
    Ok(wanted)
}

/// Returns the device file of each node; the second value is true for a DCF.
fn files(spec: &LayoutSpec) -> Result<Vec<(&Path, bool)>, LayoutError> {
    let file = |node: &'_ NodeSpec| -> Result<bool, LayoutError> {
        if !(1..=127).contains(&node.node_id) {
            return key_error("nodes", format!("node_id {}; a node has 1 to 127", node.node_id));
        }
        match (&node.eds, &node.dcf) {
            (Some(_), None) => Ok(false),
            (None, Some(_)) => Ok(true),
            _ => key_error("nodes", format!("node {}: give either `eds` or `dcf`", node.node_id)),
        }
    };
    spec.nodes.iter().map(|node| Ok((node.file().unwrap_or(Path::new("")), file(node)?))).collect()
}

fn read_node<'a>(
    texts: &[&'a str],
    spec: &LayoutSpec,
    files: &[(&'a Path, bool)],
) -> Result<Vec<Node<'a>>, LayoutError> {
    if texts.len() != files.len() {
        return key_error(
            "nodes",
            format!("{} device files for {} nodes", texts.len(), files.len()),
        );
    }
    let mut nodes = Vec::new();
    for ((text, node), (file, configured)) in texts.iter().zip(&spec.nodes).zip(files) {
        let dictionary = Dictionary::parse(text, file, node.node_id, *configured)?;
        let transmit = Pdo::read_all(&dictionary, Direction::Transmit)?;
        let receive = Pdo::read_all(&dictionary, Direction::Receive)?;
        nodes.push(Node {
            dictionary,
            offset: node.object_offset,
            transmit_pdos: transmit,
            receive_pdos: receive,
        });
    }
    Ok(nodes)
}

/// Returns the SYNC message, which has to be the same for all nodes. Its identifier is in object
/// 1005h, and object 1019h says if it contains a counter.
fn sync_message(nodes: &[Node<'_>]) -> Result<MessagePlan, LayoutError> {
    let remedy = "the SYNC's COB-ID marks the instant of the samples; it is usually 0x80";
    let mut agreed: Option<(FrameId, bool)> = None;
    for Node { dictionary, .. } in nodes {
        let cob_id = dictionary.required_value(0x1005, 0, remedy)?;
        let id =
            identifier(cob_id.number).map_err(|reason| dictionary.value_error(&cob_id, reason))?;
        let counter = dictionary.value(0x1019, 0)?.is_some_and(|value| value.number > 1);
        match agreed {
            Some(other) if other != (id, counter) => {
                let reason = format!(
                    "SYNC {id}{}, but the nodes before have {}; configure all of them alike \
                     (1005h, 1019h)",
                    if counter { " with a counter" } else { "" },
                    other.0
                );
                return Err(dictionary.value_error(&cob_id, reason).into());
            }
            _ => agreed = Some((id, counter)),
        }
    }
    let Some((id, counter)) = agreed else {
        return key_error("nodes", "is empty; give one per axis".into());
    };
    let format =
        MessageFormat { name: "SYNC".to_owned(), id, is_fd: false, length: u8::from(counter) };
    Ok(MessagePlan {
        format,
        role: Role::Sync,
        extractions: Vec::new(),
        excluded_values: Vec::new(),
        selector: None,
    })
}

/// Adds an object of a node to the plan of the PDO that carries it.
fn add(
    messages: &mut Vec<MessagePlan>,
    wanted: &RequestedSignal<'_>,
    axis: usize,
    node: &Node<'_>,
) -> Result<(), LayoutError> {
    let object = Object {
        // The objects of the axes of one node are 800h apart (CiA 402).
        index: wanted.object.index.wrapping_add(node.offset),
        sub_index: wanted.object.sub_index,
    };
    let (pdo, mapped, sent) = find(wanted, object, node)?;
    let dictionary = &node.dictionary;
    let name = format!("{} of node {}", pdo.name(), dictionary.node);
    let signal = signal(&name, dictionary, pdo, mapped, wanted.unit)?;
    let signal = in_own_unit(wanted.quantity, signal)?;
    check_integer(wanted.quantity, &signal)?;
    let extraction = Extraction { quantity: wanted.quantity, axis, signal };
    match messages.iter_mut().find(|plan| plan.format.id == sent.id) {
        Some(plan) if plan.format.name == name => plan.extractions.push(extraction),
        Some(plan) => {
            let reason = format!(
                "its identifier {} is that of {} too; COB-IDs of nodes differ, as $NODEID+0x180",
                sent.id, plan.format.name
            );
            let (file, node) = (dictionary.file.to_owned(), dictionary.node);
            let section = "COB-ID".to_owned();
            return Err(EdsError::Pdo { file, section, pdo: pdo.name(), node, reason }.into());
        }
        None => {
            let format = MessageFormat { name, id: sent.id, is_fd: false, length: pdo.bytes() };
            messages.push(MessagePlan {
                format,
                role: Role::Sample,
                extractions: vec![extraction],
                excluded_values: Vec::new(),
                selector: None,
            });
        }
    }
    Ok(())
}

/// Returns the first usable PDO that carries an object. If no PDO is usable, returns the error of
/// the first one that carries the object.
fn find<'n>(
    wanted: &RequestedSignal<'_>,
    object: Object,
    node: &'n Node<'_>,
) -> Result<(&'n Pdo, Mapped, Transmission), EdsError> {
    let pdos = match wanted.direction {
        Direction::Transmit => &node.transmit_pdos,
        Direction::Receive => &node.receive_pdos,
    };
    let mut unusable = None;
    for pdo in pdos {
        let Some(mapped) = pdo.find(object) else { continue };
        let sent = match wanted.quantity {
            // A reading is not valid at an instant, so the drive may choose the time at which it
            // sends the PDO.
            Quantity::Reading(_) => pdo.transmission(&node.dictionary),
            _ => pdo.synchronous_transmission(&node.dictionary),
        };
        match sent {
            Ok(sent) => return Ok((pdo, mapped, sent)),
            Err(error) => unusable = unusable.or(Some(error)),
        }
    }
    Err(unusable.unwrap_or_else(|| EdsError::NotMapped {
        file: node.dictionary.file.to_owned(),
        key: wanted.key,
        direction: wanted.direction.name(),
        node: node.dictionary.node,
        object: object.to_string(),
        mapped: pdos
            .iter()
            .flat_map(|pdo| &pdo.mapped)
            .map(|mapped| mapped.object.to_string())
            .collect(),
    }))
}

fn signal(
    message: &str,
    dictionary: &Dictionary<'_>,
    pdo: &Pdo,
    mapped: Mapped,
    unit: &str,
) -> Result<SignalFormat, LayoutError> {
    let object = mapped.object;
    let name = format!("{message}.{object}");
    let (encoding, bits) = dictionary.data_type(object.index, object.sub_index)?;
    let wrong = |reason| LayoutError::Signal { signal: name.clone(), line: None, reason };
    if bits != mapped.bits {
        return Err(wrong(format!(
            "{} bits are mapped and the object's data type has {bits}; correct the mapping",
            mapped.bits
        )));
    }
    let scale = (1.0, 0.0);
    let length = usize::from(pdo.bytes());
    let order = ByteOrder::LittleEndian;
    let field = Field::new(mapped.first_bit, bits, order, encoding, scale, length)
        .ok_or_else(|| wrong("does not fit its PDO".to_owned()))?;
    // The limits of an object apply to values written to it, not to values read from it.
    Ok(SignalFormat { name, field, unit: unit.to_owned(), range: None })
}
