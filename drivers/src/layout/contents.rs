//! Contents of a device file, as read before a layout selects objects.

use std::path::Path;

use super::eds::{Dictionary, Direction, EdsError, Pdo, identifier};
use crate::frame::FrameId;

/// An object that a PDO carries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarriedObject {
    /// Name of the object in a layout, such as `6064:00`.
    pub name: String,
    /// True if the node sends the object, false if it receives it.
    pub is_sent: bool,
    /// Reason why a layout cannot use the object: its PDO is not sent at every SYNC. `None` if it
    /// can.
    pub unusable_reason: Option<String>,
}

/// Contents of the device file of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceContents {
    /// Number of the node for which a DCF was made; `None` if the file does not contain it.
    pub node_id: Option<u8>,
    /// Identifier of the SYNC, if the file contains it.
    pub sync: Option<FrameId>,
    /// Objects that the PDOs carry, in the order of the PDOs.
    pub mapped_objects: Vec<CarriedObject>,
}

impl DeviceContents {
    /// Reads an EDS, or a DCF if `is_dcf` is true. The configured values of a DCF apply.
    ///
    /// # Errors
    /// [`EdsError`] if the text is not a device file, or if a mapping does not fit its PDO.
    pub fn read(text: &str, file: &Path, is_dcf: bool) -> Result<Self, EdsError> {
        let node_id = if is_dcf { Dictionary::commissioned_node(text, file)? } else { None };
        // Any number serves if the node is unknown: the identifiers are only read when a layout
        // names the node.
        let dictionary = Dictionary::parse(text, file, node_id.unwrap_or(1), is_dcf)?;
        let sync = dictionary.value(0x1005, 0)?;
        let sync = sync.and_then(|cob_id| identifier(cob_id.number).ok());
        let mut velocity_matrix = Vec::new();
        for direction in [Direction::Transmit, Direction::Receive] {
            for pdo in Pdo::read_all(&dictionary, direction)? {
                let unusable =
                    pdo.synchronous_transmission(&dictionary).err().map(|error| error.to_string());
                velocity_matrix.extend(pdo.mapped.iter().map(|mapped| CarriedObject {
                    name: mapped.object.to_string(),
                    is_sent: direction == Direction::Transmit,
                    unusable_reason: unusable.clone(),
                }));
            }
        }
        Ok(Self { node_id, sync, mapped_objects: velocity_matrix })
    }
}
