//! Faults of the bus, as data.

use serde::{Deserialize, Serialize};

/// Fault in one bus cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Cycle of the fault, from 0.
    pub cycle: u64,
    /// Kind of fault.
    pub action: FaultAction,
}

/// Kind of fault. The frames of a cycle count from 0 in the order in which they are sent: SYNC,
/// samples, targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FaultAction {
    /// A frame is lost.
    Drop {
        /// Number of the frame in the cycle.
        frame: usize,
    },
    /// A frame is sent twice.
    Duplicate {
        /// Number of the frame in the cycle.
        frame: usize,
    },
    /// The counter of this cycle is wrong by `add`; the counter of the next cycle is correct again.
    CorruptCounter {
        /// Value added to the counter.
        add: u64,
    },
    /// The device sends nothing for `cycles` cycles, while the arm continues to move.
    Pause {
        /// Number of silent cycles, starting with this cycle.
        cycles: u64,
    },
    /// The controller reports an error before the cycle's first frame.
    ErrorFrame {
        /// Class bits of `linux/can/error.h`, for example 0x20 for "no acknowledgement".
        class: u32,
    },
}
