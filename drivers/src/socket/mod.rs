//! System calls of SocketCAN, of packet sockets and of the clocks. All unsafe code of this crate is
//! here.
//!
//! Everything here is safe to call: descriptors are owned, sizes are those of the passed type, and
//! safe code reads the kernel's output as bytes. No call sends, except one for tests, which need a
//! sender.

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
