//! Bus faults, as data.

use serde::{Deserialize, Serialize};

/// Fault in one bus cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Cycle of the fault, from 0.
    pub cycle: u64,
    /// The action.
    pub action: FaultAction,
}

/// Kind of fault. Frames of a cycle count from 0 in the order they are sent: SYNC, samples,
/// targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FaultAction {
    /// A frame is lost.
    Drop {
        /// Number of the frame.
        frame: usize,
    },
    /// A frame is sent twice.
    Duplicate {
        /// Number of the frame.
        frame: usize,
    },
    /// The counter of this cycle is wrong by `add`; the next one is correct again.
    CorruptCounter {
        /// Value added to the counter.
        add: u64,
    },
    /// The device is silent for N cycles, while the arm continues to move.
    Pause {
        /// Number of silent cycles, starting with this cycle.
        cycles: u64,
    },
    /// The controller reports an error before the cycle's first frame.
    ErrorFrame {
        /// Class bits of `linux/can/error.h`; 0x20, "no acknowledgement", for example.
        class: u32,
    },
}
