//! Playback of the device against a clock.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use didim_drivers::frame::Frame;

use crate::{CYCLE_FRAMES, DeviceError, Sink, SinkError, VirtualDevice};

/// Pace of the playback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Each cycle is sent at its time on CLOCK_MONOTONIC, counted from the start. A late cycle does
    /// not delay later ones.
    RealTime,
    /// Cycles are sent as fast as the sink accepts frames.
    Unpaced,
}

/// Result of a playback.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlaybackResult {
    /// Number of cycles that were sent.
    pub cycles: u64,
    /// Number of frames that were sent.
    pub frames: u64,
    /// Largest delay of a cycle after its time, in real time.
    pub largest_delay: Duration,
}

/// Reason why the playback ended early.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The sink failed.
    #[error(transparent)]
    Sink(#[from] SinkError),
}

/// Sends the cycles of a device until it has no more cycles or `stop` is set. `stop` is checked
/// once per cycle. No memory is allocated per cycle.
///
/// # Errors
/// [`PlayError`]. All cycles before the failed one were sent, and possibly a part of the failed
/// one.
pub fn play(
    device: &mut VirtualDevice,
    sink: &mut dyn Sink,
    pace: Pace,
    stop: &AtomicBool,
) -> Result<PlaybackResult, PlayError> {
    let mut frames: Vec<Frame> = Vec::with_capacity(CYCLE_FRAMES);
    let mut played = PlaybackResult::default();
    let Some(first_ns) = device.poll_due() else { return Ok(played) };
    let start = Instant::now();
    while let Some(due_ns) = device.poll_due() {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        // Create the frames before they are due, so that creating them does not delay them.
        frames.clear();
        device.poll_cycle(&mut frames)?;
        if pace == Pace::RealTime {
            let due = start + Duration::from_nanos(due_ns - first_ns);
            let wait = due.saturating_duration_since(Instant::now());
            if !wait.is_zero() {
                std::thread::sleep(wait);
            }
            played.largest_delay = played.largest_delay.max(due.elapsed());
        }
        for frame in &frames {
            sink.send(frame)?;
            played.frames += 1;
        }
        played.cycles += 1;
    }
    Ok(played)
}
