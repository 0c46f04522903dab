//! Where frames come from: one trait that can only receive.

use core::time::Duration;

use crate::frame::Frame;

/// What a call to [`Source::receive`] brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// At least one frame was appended to the batch.
    Frames,
    /// The time ran out with nothing on the bus.
    Silence,
    /// The source is exhausted: the end of a log, or a bus whose every sender is gone.
    End,
}

/// A receive-only source of frames.
pub trait Source: Send {
    /// Waits at most `timeout` for frames and appends them to `batch`, never beyond its capacity
    /// (no allocation). `batch` must have room for at least one frame.
    ///
    /// # Errors
    /// See [`SourceError`]. After a recoverable error the next call tries again.
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError>;

    /// What was counted since the source was opened.
    fn counters(&self) -> SourceCounters;
}

/// What a source counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceCounters {
    /// Frames handed out, error frames included.
    pub frames: u64,
    /// Frames that the kernel dropped because nobody read in time.
    pub kernel_drops: u64,
    /// Error frames of the controller.
    pub error_frames: u64,
    /// Times an interface was found down.
    pub link_down: u64,
}

/// Why a source could not deliver.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {}
