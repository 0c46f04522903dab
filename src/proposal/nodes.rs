//! `[bus]` of device files (EDS, DCF): the objects and their nodes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use didim_drivers::layout::DeviceContents;

use super::bus::{
    VALIDITY_QUESTION, drives, propose_bus_and_windows, rate, rate_hz, sending_nodes,
};
use super::draft::Draft;
use super::evidence::{Evidence, ProposalError, is_dcf, relative_to_cell};
use super::value::{Guess, quote_text};

const LAYOUT_SECTION: &str = "bus.layout";
/// Objects of CiA 402.
const POSITION_OBJECT: &str = "6064:00";
const MEASURED_TORQUE_OBJECT: &str = "6077:00";
const DEMANDED_TORQUE_OBJECT: &str = "6074:00";
const TARGET_POSITION_OBJECT: &str = "607A:00";
const STATUS_WORD_OBJECT: &str = "6041:00";

pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    out: &Path,
) -> Result<(), ProposalError> {
    let (files, axes) = (&evidence.eds, evidence.robot.robot.joints());
    let for_all = matches!(files.as_slice(), [(file, _)] if !is_dcf(file));
    if files.len() != axes && !for_all {
        return Err(ProposalError::Devices { files: files.len(), axes });
    }
    propose_bus_and_windows(draft);
    draft.add_entry(
        LAYOUT_SECTION,
        "axes",
        Guess::from_file(axes.to_string(), "joints of the robot"),
    );
    let sync = files.iter().find_map(|(_, contents)| contents.sync);
    let rate_hz = match (sync, evidence.log.as_deref()) {
        (Some(id), Some(log)) => rate_hz(log, id)?,
        _ => None,
    };
    draft.add_entry(LAYOUT_SECTION, "rate_hz", rate(rate_hz));
    let nodes = evidence.log.as_deref().map_or(Ok(Vec::new()), sending_nodes)?;
    // Their order is that of the axes only as a rule.
    let nodes = Some(nodes).filter(|nodes| nodes.len() == axes);
    let mut of_axis = BTreeMap::new();
    for (axis, (file, contents)) in (1..=axes).zip(files.iter().cycle()) {
        let number = match contents.node_id {
            Some(node_id) => match of_axis.insert(node_id, axis) {
                None => Guess::from_file(node_id.to_string(), "the DCF was made for this node"),
                Some(other) => Guess::without_value(&format!(
                    "the number of axis {axis}'s drive on the bus; its DCF was made for node \
                    {node_id}, as that of axis {other}"
                )),
            },
            None => match nodes.as_ref().and_then(|nodes| nodes.get(axis - 1)) {
                Some(node) => Guess::assumed(
                    node.to_string(),
                    "the log has as many nodes as the arm has joints; in their order",
                ),
                None => Guess::without_value(&format!(
                    "the number of axis {axis}'s drive on the bus, 1 to 127"
                )),
            },
        };
        propose_node(draft, axis, file, number, out);
    }
    propose_objects(draft, files);
    // A device file contains no units from which a gain could be proposed.
    drives(draft, axes, |_, _, _| None);
    Ok(())
}

fn propose_node(draft: &mut Draft<'_>, axis: usize, file: &Path, number: Guess, out: &Path) {
    let section = format!("bus.layout.nodes.{axis}");
    draft.add_entry(&section, "node_id", number);
    let path = quote_text(&relative_to_cell(file, out).display().to_string());
    let key = if is_dcf(file) { "dcf" } else { "eds" };
    draft.add_entry(&section, key, Guess::from_file(path, "as named"));
}

fn propose_objects(draft: &mut Draft<'_>, files: &[(PathBuf, DeviceContents)]) {
    let usable = |object, is_sent| check_usable(files, object, is_sent);
    let named = |draft: &mut Draft<'_>, what: &str, object, found: Result<(), String>| {
        let guess = match found {
            Ok(()) => Guess::from_file(quote_text(object), "by CiA 402; it goes by every SYNC"),
            Err(why) => Guess::without_value(&format!(
                "the object of the {what} in a PDO that goes by every SYNC, as {object:?}; {why}"
            )),
        };
        draft.add_entry(LAYOUT_SECTION, &format!("{what}.object"), guess);
    };
    named(draft, "position", POSITION_OBJECT, usable(POSITION_OBJECT, true));
    let count = "CiA 402 leaves it to the drive: its position unit, which the gain is for";
    draft.add_entry(LAYOUT_SECTION, "position.unit", Guess::assumed(quote_text("count"), count));
    let instant = "the instant of the sample";
    draft.add_entry(
        LAYOUT_SECTION,
        "position.valid",
        Guess::assumed(quote_text("instant"), instant),
    );
    let measured = usable(MEASURED_TORQUE_OBJECT, true);
    let demanded = usable(DEMANDED_TORQUE_OBJECT, true);
    let (object, found) = match (&measured, &demanded) {
        (Err(_), Ok(())) => (DEMANDED_TORQUE_OBJECT, demanded),
        _ => (MEASURED_TORQUE_OBJECT, measured),
    };
    let valid = match object == MEASURED_TORQUE_OBJECT && found.is_ok() {
        true => Guess::assumed(quote_text("instant"), "measured, at the instant of the sample"),
        false => Guess::without_value(VALIDITY_QUESTION),
    };
    named(draft, "torque", object, found);
    let rated = "both torques of CiA 402 are in thousandths of the rated one (6076h)";
    draft.add_entry(
        LAYOUT_SECTION,
        "torque.unit",
        Guess::from_file(quote_text("per mille"), rated),
    );
    draft.add_entry(LAYOUT_SECTION, "torque.valid", valid);
    if usable(TARGET_POSITION_OBJECT, false).is_ok() {
        named(draft, "reference", TARGET_POSITION_OBJECT, Ok(()));
        draft.add_entry(
            LAYOUT_SECTION,
            "reference.unit",
            Guess::assumed(quote_text("count"), "as of the positions"),
        );
        let why = "a target takes effect at the next SYNC (CiA 301)";
        draft.add_entry(
            LAYOUT_SECTION,
            "reference.valid",
            Guess::assumed(quote_text("next-sync"), why),
        );
    }
    if usable(STATUS_WORD_OBJECT, true).is_ok() {
        let why = "the status word of CiA 402";
        draft.add_entry(
            LAYOUT_SECTION,
            "status_word",
            Guess::from_file(quote_text(STATUS_WORD_OBJECT), why),
        );
    }
}

/// Checks that every device file maps the object in a PDO that is transmitted at every SYNC: by the
/// drive if `is_sent` is true, else to the drive. Otherwise returns the first problem.
fn check_usable(
    files: &[(PathBuf, DeviceContents)],
    object: &str,
    is_sent: bool,
) -> Result<(), String> {
    for (file, DeviceContents { mapped_objects: mapped, .. }) in files {
        let carried_objects = || mapped.iter().filter(|own| own.is_sent == is_sent);
        let mut matching =
            carried_objects().filter(|own| own.name == object).map(|own| &own.unusable_reason);
        let Some(first) = matching.next() else {
            let others: Vec<&str> = carried_objects().map(|own| own.name.as_str()).collect();
            let others = if others.is_empty() { "nothing".to_owned() } else { others.join(" ") };
            return Err(format!("the PDOs of {} carry {others}", file.display()));
        };
        if let Some(why) = first.as_ref().filter(|_| matching.all(Option::is_some)) {
            return Err(why.clone());
        }
    }
    Ok(())
}
