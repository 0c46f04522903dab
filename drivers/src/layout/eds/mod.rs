//! Device files of CANopen drives: EDS and DCF (CiA 306), instead of a DBC file.
//!
//! A device file lists the objects that a drive's PDOs carry, with the identifier and the time of
//! sending. The layout selects the objects of the arm. `compile_nodes` next to this module makes
//! the same plan from both as from a DBC file. An EDS gives the values of a drive after a reset
//! (`DefaultValue`), a DCF the configured ones (`ParameterValue`).
//!
//! A PDO that is not sent or applied at the SYNC is refused: its values belong to no instant that
//! the layout could name.

mod dictionary;
mod error;
mod ini;
mod number;
mod pdo;

pub(super) use dictionary::Dictionary;
pub use error::EdsError;
pub use ini::MAX_DEVICE_FILE_BYTES;
pub(super) use pdo::{Direction, Mapped, Object, Pdo, Transmission, identifier};
