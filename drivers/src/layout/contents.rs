//! What a device file says before a layout names objects of it.

use std::path::Path;

use super::eds::{Dictionary, Direction, EdsError, Pdo, identifier};
use crate::frame::FrameId;

/// An object that a PDO carries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarriedObject {
    /// As a layout names it: `6064:00`.
    pub name: String,
    /// Whether the node sends it; else it is told it.
    pub is_sent: bool,
    /// Why a layout could not use it, where its PDO does not go by every SYNC.
    pub unusable: Option<String>,
}

/// What a device file says of its drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceContents {
    /// The node that a DCF was made for.
    pub node_id: Option<u8>,
    /// The identifier of the SYNC, if the file has one.
    pub sync: Option<FrameId>,
    /// What its PDOs carry, in their order.
    pub carried: Vec<CarriedObject>,
}

impl DeviceContents {
    /// Reads an EDS, or a DCF (`is_dcf`), whose configured values count.
    ///
    /// # Errors
    /// [`EdsError`], where the text is no device file, or what it maps fits no PDO.
    pub fn read(text: &str, file: &Path, is_dcf: bool) -> Result<Self, EdsError> {
        let node_id = if is_dcf { Dictionary::commissioned(text, file)? } else { None };
        // Any node: identifiers are looked at where a layout says which.
        let dictionary = Dictionary::parse(text, file, node_id.unwrap_or(1), is_dcf)?;
        let sync = dictionary.value(0x1005, 0)?;
        let sync = sync.and_then(|cob_id| identifier(cob_id.number).ok());
        let mut carried = Vec::new();
        for direction in [Direction::Transmit, Direction::Receive] {
            for pdo in Pdo::all(&dictionary, direction)? {
                let unusable = pdo.sent(&dictionary).err().map(|error| error.to_string());
                carried.extend(pdo.mapped.iter().map(|mapped| CarriedObject {
                    name: mapped.object.to_string(),
                    is_sent: direction == Direction::Transmit,
                    unusable: unusable.clone(),
                }));
            }
        }
        Ok(Self { node_id, sync, carried })
    }
}
