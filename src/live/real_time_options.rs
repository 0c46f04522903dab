//! Real-time options of the bus thread in the cell file.

use schemars::JsonSchema;
use serde::Deserialize;

/// Real-time options of the cell file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RealTimeOptions {
    /// Priority of SCHED_FIFO, 1 to 99. Keep it below the kernel's interrupt threads, which have
    /// 50.
    ///
    /// If left out: an ordinary thread.
    #[serde(default)]
    pub priority: Option<u8>,
    /// The only processor to run on, from 0.
    ///
    /// If left out: any.
    #[serde(default)]
    pub cpu: Option<usize>,
    /// True keeps the memory of the process that reads the bus from being swapped out.
    #[serde(default)]
    pub lock_memory: bool,
}
