//! Device files of CANopen drives: EDS and DCF (CiA 306), instead of a DBC file.
//!
//! A device file lists the objects that a drive's PDOs carry, with their identifiers and their
//! times of sending. The layout selects the objects of the arm. The neighbouring module
//! `compile_nodes` makes a plan from both, of the same form as a plan from a DBC file. An EDS
//! contains the values of a drive after a reset (`DefaultValue`), and a DCF contains the configured
//! values (`ParameterValue`).
//!
//! A PDO that is not sent or applied at the SYNC is refused, because its values do not belong to an
//! instant that the layout could name.

mod dictionary;
mod error;
mod ini;
mod number;
mod pdo;

pub(super) use dictionary::Dictionary;
pub use error::EdsError;
pub use ini::MAX_DEVICE_FILE_BYTES;
pub(super) use pdo::{Direction, Mapped, Object, Pdo, Transmission, identifier};
