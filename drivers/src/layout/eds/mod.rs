//! The device files of CANopen drives: EDS and DCF (CiA 306), instead of a DBC file.
//!
//! A device file says which objects a drive's PDOs carry, under which identifier and when they are
//! sent; the layout says which objects are the arm's, and `compile_nodes` beside this room makes the
//! same plan of both as of a DBC file. An EDS gives what a drive has after a reset (`DefaultValue`), a DCF how it was configured
//! (`ParameterValue`).
//!
//! A PDO that is not sent or applied at the SYNC is refused: its values belong to no instant that the
//! layout could name.

mod dictionary;
mod error;
mod ini;
mod number;
mod pdo;

pub(super) use dictionary::Dictionary;
pub use error::EdsError;
pub use ini::MAX_DEVICE_FILE_BYTES;
pub(super) use pdo::{Direction, Mapped, Object, Pdo, Sent, identifier};
