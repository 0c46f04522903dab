//! System calls of SocketCAN, of packet sockets and of the clocks. All unsafe code of this crate is
//! here.
//!
//! Every function here is safe to call. Descriptors are owned, sizes are those of the passed types,
//! and safe code reads the output of the kernel as bytes. No call sends, except one for tests,
//! which need a sender.

mod clock;
mod control;
mod descriptor;
mod receive;
mod wait;

pub use clock::{clock_pair, monotonic_ns};
#[cfg(test)]
pub(crate) use control::ControlData;
pub(crate) use descriptor::{DeviceState, Socket, device_state};
pub(crate) use receive::{Message, PACKET_BYTES, ReceiveBuffer};
pub(crate) use wait::wait_readable;
