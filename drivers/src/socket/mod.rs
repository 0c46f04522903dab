//! The system calls of SocketCAN, of packet sockets and of the clocks, and with them all unsafe code of this crate.
//!
//! Everything here is safe to call: descriptors are owned, sizes are those of the type handed
//! over, and what the kernel wrote is read back as bytes in safe code. There is no call that sends, but one
//! for tests, which need somebody to listen to.

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
