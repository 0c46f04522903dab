//! What the bus thread counts, and how the bus is: plain numbers.

use didim_core::Readings;
use didim_drivers::assemble::Losses;
use didim_drivers::clock::ClockCounters;
use didim_drivers::source::SourceCounters;
use serde::{Deserialize, Serialize};

/// The state of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BusState {
    /// No frame has come yet.
    #[default]
    Waiting,
    /// Frames come.
    Ok,
    /// No frame for longer than the bus may be silent.
    Silent,
    /// The source fails: an interface is down or away.
    Down,
    /// The log is at its end.
    Ended,
}

impl BusState {
    /// Every state.
    pub const ALL: [Self; 5] = [Self::Waiting, Self::Ok, Self::Silent, Self::Down, Self::Ended];

    /// Its name in JSON and metrics, its label, and a sentence.
    const fn wording(self) -> [&'static str; 3] {
        match self {
            Self::Waiting => ["waiting", "no frame yet", "no frame has come yet"],
            Self::Ok => ["ok", "ok", "frames come"],
            Self::Silent => ["silent", "silent", "the bus is silent"],
            Self::Down => ["down", "down", "the bus is down"],
            Self::Ended => ["ended", "ended", "the log is at its end"],
        }
    }

    /// Its name in JSON and metrics.
    pub const fn key(self) -> &'static str {
        self.wording()[0]
    }

    /// A word or two.
    pub const fn label(self) -> &'static str {
        self.wording()[1]
    }

    /// A sentence.
    pub const fn sentence(self) -> &'static str {
        self.wording()[2]
    }

    /// Whether it is as it should be.
    pub const fn is_well(self) -> bool {
        matches!(self, Self::Ok | Self::Ended)
    }
}

/// What the bus thread counted, as of one instant: plain numbers, copied as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AcquisitionCounts {
    /// The state of the bus.
    pub bus: BusState,
    /// The source's own counts.
    pub source: SourceCounters,
    /// The assembler's.
    pub losses: Losses,
    /// Batches sent to the workers.
    pub batches: u64,
    /// Times the source failed.
    pub source_failures: u64,
    /// What mapping the stamps of CLOCK_REALTIME counted.
    pub clock: ClockCounters,
    /// What the drives told last besides.
    pub readings: Readings,
    /// Where the latencies of frames begin.
    pub frame_time: FrameTime,
    /// Iterations of the thread's loop: they continue while the thread is healthy, frames or not.
    pub iterations: u64,
}

/// Where the way of a frame begins in [`FrameLatency`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameTime {
    /// The stamp that the kernel or the controller gave the frame.
    Stamp,
    /// When the frame was read: how long it had lain in a queue before is not known. The bus has a
    /// time of its own (a log, an in-process bus), or frames came without a stamp
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
