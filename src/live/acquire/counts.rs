//! Counts and bus state of the bus thread as plain numbers.

use didim_drivers::assemble::Losses;
use didim_drivers::clock::ClockCounters;
use didim_drivers::source::{InterfaceFaults, SourceCounters};
use didim_dynamics::Readings;
use serde::{Deserialize, Serialize};

/// State of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BusState {
    /// No frame has arrived yet.
    #[default]
    Waiting,
    /// Frames are arriving.
    Ok,
    /// No frame has arrived for longer than the allowed silence of the bus.
    Silent,
    /// The source fails: an interface is down or missing.
    Down,
    /// The log has ended.
    Ended,
}

impl BusState {
    /// Every state.
    pub const ALL: [Self; 5] = [Self::Waiting, Self::Ok, Self::Silent, Self::Down, Self::Ended];

    /// Returns the key in JSON and metrics, the label, and a sentence.
    const fn texts(self) -> [&'static str; 3] {
        match self {
            Self::Waiting => ["waiting", "no frame yet", "no frame has come yet"],
            Self::Ok => ["ok", "ok", "frames come"],
            Self::Silent => ["silent", "silent", "the bus is silent"],
            Self::Down => ["down", "down", "the bus is down"],
            Self::Ended => ["ended", "ended", "the log is at its end"],
        }
    }

    /// Returns the key in JSON and metrics.
    pub const fn key(self) -> &'static str {
        self.texts()[0]
    }

    /// Returns a label of one or two words.
    pub const fn label(self) -> &'static str {
        self.texts()[1]
    }

    /// Returns the state as a sentence.
    pub const fn sentence(self) -> &'static str {
        self.texts()[2]
    }

    /// Returns true if the bus is in a good state.
    pub const fn is_well(self) -> bool {
        matches!(self, Self::Ok | Self::Ended)
    }
}

/// Counts of the bus thread at one instant. All are plain numbers, so that they can be copied
/// together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AcquisitionCounts {
    /// State of the bus.
    pub bus: BusState,
    /// Counters of the source.
    pub source: SourceCounters,
    /// Lost frames and cycles, counted by the assembler.
    pub losses: Losses,
    /// Number of batches sent to the workers.
    pub batches: u64,
    /// Number of failures of the source.
    pub source_failures: u64,
    /// Counters of the mapping of CLOCK_REALTIME stamps.
    pub clock: ClockCounters,
    /// Interfaces that deliver no frames at present.
    pub interface_faults: InterfaceFaults,
    /// Smallest receive buffer of the open interfaces \[bytes\].
    pub receive_buffer_bytes: Option<u32>,
    /// Latest additional readings of the drives.
    pub readings: Readings,
    /// Start of the time that a frame latency measures.
    pub frame_time: FrameTime,
    /// Iterations of the thread's loop. The number grows while the thread is healthy, with or
    /// without frames.
    pub iterations: u64,
}

/// Start of the time in `FrameLatency`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameTime {
    /// Time stamp of the frame from the kernel or the controller.
    Stamp,
    /// Time at which the frame was read. The time that it waited in a queue is then unknown. This
    /// applies if the bus has its own time (a log, an in-process bus), or if frames had no stamp
    /// (`frames_stamped_late` of the status).
    #[default]
    Read,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_has_one_name() {
        for state in BusState::ALL {
            assert_eq!(serde_json::to_value(state).unwrap(), state.key());
        }
    }
}
