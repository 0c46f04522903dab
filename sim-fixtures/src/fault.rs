//! What goes wrong on the bus, as data.

use serde::{Deserialize, Serialize};

/// Something that goes wrong in one bus cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// In which cycle, from 0.
    pub cycle: u64,
    /// What.
    pub action: FaultAction,
}

/// What goes wrong. Frames of a cycle count from 0 in the order they are sent: SYNC, samples,
/// targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FaultAction {
    /// A frame is lost.
    Drop {
        /// Which.
        frame: usize,
    },
    /// A frame is sent twice.
    Duplicate {
        /// Which.
        frame: usize,
    },
    /// The counter of this cycle is wrong by so much; the next one is right again.
    CorruptCounter {
        /// Added to the counter.
        add: u64,
    },
    /// Silence for so many cycles, while the arm goes on moving.
    Pause {
        /// From this cycle on.
        cycles: u64,
    },
    /// The controller reports an error before the cycle's first frame.
    ErrorFrame {
        /// Class bits of `linux/can/error.h`; 0x20, "no acknowledgement", for example.
        class: u32,
    },
}
