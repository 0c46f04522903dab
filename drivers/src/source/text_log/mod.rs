//! Text logs of candump, of Vector's tools (ASC) and of PEAK's (TRC), distinguished by their first
//! line.
//!
//! Logs of `candump -l` and `candump -L`, which `canplayer` reads, can also be written:
//!
//! ```text
//! (1436509052.249713) can0 123#1122AABB           classic data
//! (1436509052.249713) can0 123##1112233 T         CAN FD with its flags; sent by the logging host
//! (1436509052.249713) can0 123#R4                 a remote request for four bytes
//! (1436509052.249713) can0 20000004#000C000000000000   an error frame of the controller
//! ```
//!
//! The `socketcan` crate also reads such logs, but only to microseconds and with an allocation for
//! each line. This module keeps every digit of the stamp. It needs the same memory for a log of any
//! length.

mod asc;
mod candump;
mod error;
mod field;
mod format;
mod reader;
mod stamps;
mod trc;
mod write;

pub use error::{LineFault, TextLogError};
pub use reader::TextLog;
pub use write::{CandumpWriter, StampDigits, WriteError};

/// Longest accepted line \[bytes\]. A 64-byte frame needs about 180.
const MAX_LINE: usize = 512;

/// Flag in the identifier of an error frame (`linux/can.h`).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Flag for the second bit rate in the flags digit of an FD frame (`linux/can.h`).
const FLAG_BRS: u8 = 0x1;

/// Flag for an error passive sender in the flags digit of an FD frame (`linux/can.h`).
const FLAG_ESI: u8 = 0x2;

/// Flag for an FD frame in the flags digit. Newer kernels set it, older kernels do not.
const FLAG_FDF: u8 = 0x4;
