//! The message with the external torque of one sample. It is plain data with a versioned type name.

use didim_dynamics::MAX_JOINTS;
use didim_identification::external_torque::{ExternalTorque, ObserverState};
#[cfg(target_os = "linux")]
use iceoryx2::prelude::ZeroCopySend;

/// Usability of a message, as its number in [`ExternalTorqueMessage::state`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum MessageState {
    /// The torque is usable.
    Valid = 0,
    /// Samples were lost, or the service has just started: the observer settles.
    Settling = 1,
    /// A joint is outside the positions or speeds of the identification.
    OutsideMotion = 2,
    /// There is no usable result. The torques are NaN.
    NoResult = 3,
}

/// External torque of one sample, in shared memory and, with the same bytes on a little-endian
/// machine, on the socket. Entries beyond the arm's joints are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "linux", derive(ZeroCopySend), type_name("didim.ExternalTorque.v1"))]
pub struct ExternalTorqueMessage {
    /// Number of messages before this one since the start of the service. A gap at a reader shows
    /// that it lost messages.
    pub number: u64,
    /// Sequence number of the newest sample that the estimate uses.
    pub sequence: u64,
    /// Time stamp of that sample \[ns\] on the monotonic clock (live) or the log's clock (replay).
    pub stamp_ns: u64,
    /// Time of publication \[ns, CLOCK_BOOTTIME\].
    pub published_ns: u64,
    /// Number of the result of the model plus 1; 0 for a result file that the cell names, and
    /// without a result.
    pub result: u64,
    /// Number of joints.
    pub joints: u32,
    /// See [`MessageState`].
    pub state: u32,
    /// The joint outside the motion of the identification, counted from 1; otherwise 0.
    pub joint_outside: u32,
    /// Padding that keeps the torques aligned; zero.
    pub reserved: u32,
    /// Torque of the environment on each joint \[N·m or N\]; NaN if it is unknown.
    pub torque: [f64; MAX_JOINTS],
    /// Its standard deviation; NaN if it is unknown.
    pub standard_deviation: [f64; MAX_JOINTS],
}

/// Length of a message \[bytes\].
pub const MESSAGE_BYTES: usize = size_of::<ExternalTorqueMessage>();

impl Default for ExternalTorqueMessage {
    fn default() -> Self {
        Self {
            number: 0,
            sequence: 0,
            stamp_ns: 0,
            published_ns: 0,
            result: 0,
            joints: 0,
            state: MessageState::NoResult as u32,
            joint_outside: 0,
            reserved: 0,
            torque: [0.0; MAX_JOINTS],
            standard_deviation: [0.0; MAX_JOINTS],
        }
    }
}

impl ExternalTorqueMessage {
    /// Takes an estimate. Without one the torques of this number of joints are unknown.
    #[must_use]
    pub fn with_estimate(mut self, estimate: Option<&ExternalTorque>, joints: usize) -> Self {
        self.joints = u32::try_from(joints).unwrap_or(0);
        let Some(estimate) = estimate else {
            self.torque[..joints].fill(f64::NAN);
            self.standard_deviation[..joints].fill(f64::NAN);
            return self;
        };
        (self.torque, self.standard_deviation) = (estimate.torque, estimate.standard_deviation);
        let (state, outside) = match estimate.state {
            ObserverState::Settled => (MessageState::Valid, 0),
            ObserverState::Settling => (MessageState::Settling, 0),
            ObserverState::OutsideMotion(joint) => (MessageState::OutsideMotion, joint.number()),
        };
        self.state = state as u32;
        self.joint_outside = u32::try_from(outside).unwrap_or(0);
        self
    }

    /// Returns the message as the socket sends it, with the fields in their order, little-endian.
    pub fn to_bytes(&self) -> [u8; MESSAGE_BYTES] {
        let mut bytes = [0; MESSAGE_BYTES];
        let words = [self.number, self.sequence, self.stamp_ns, self.published_ns, self.result];
        let halves = [self.joints, self.state, self.joint_outside, self.reserved];
        let pairs = halves.chunks_exact(2).map(|of| u64::from(of[0]) | (u64::from(of[1]) << 32));
        let values = self.torque.iter().chain(&self.standard_deviation).map(|of| of.to_bits());
        let all_words = words.into_iter().chain(pairs).chain(values);
        for (place, word) in bytes.chunks_exact_mut(8).zip(all_words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// Reads a message of the socket. Returns `None` if it has another length.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != MESSAGE_BYTES {
            return None;
        }
        let mut words = bytes.chunks_exact(8).filter_map(|word| word.try_into().ok());
        let mut next = || words.next().map_or(0, u64::from_le_bytes);
        let [number, sequence, stamp_ns, published_ns, result] = core::array::from_fn(|_| next());
        let [first, second] = core::array::from_fn(|_| next());
        #[expect(clippy::cast_possible_truncation, reason = "the halves of a word")]
        let [joints, state, joint_outside, reserved] =
            [first, first >> 32, second, second >> 32].map(|half| half as u32);
        let torque = core::array::from_fn(|_| f64::from_bits(next()));
        let standard_deviation = core::array::from_fn(|_| f64::from_bits(next()));
        Some(Self {
            number,
            sequence,
            stamp_ns,
            published_ns,
            result,
            joints,
            state,
            joint_outside,
            reserved,
            torque,
            standard_deviation,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_comes_back_from_its_bytes() {
        let mut message = ExternalTorqueMessage {
            number: 1,
            sequence: 2,
            stamp_ns: 3,
            published_ns: u64::MAX,
            result: 5,
            joints: 6,
            state: MessageState::OutsideMotion as u32,
            joint_outside: 4,
            reserved: 0,
            ..ExternalTorqueMessage::default()
        };
        message.torque[15] = -0.5;
        message.standard_deviation[0] = 0.25;
        let bytes = message.to_bytes();
        assert_eq!(ExternalTorqueMessage::from_bytes(&bytes), Some(message));
        assert_eq!(ExternalTorqueMessage::from_bytes(&bytes[1..]), None);
        // The places that a reader in C or Python uses.
        assert_eq!(MESSAGE_BYTES, 312);
        assert_eq!(bytes[44..48], 2_u32.to_le_bytes());
        assert_eq!(bytes[56 + 15 * 8..][..8], (-0.5_f64).to_le_bytes());
        assert_eq!(bytes[56 + 128..][..8], 0.25_f64.to_le_bytes());
    }
}
