//! The thread that writes frames into the ring.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use didim_drivers::socket::clock_pair;
use didim_drivers::source::mcap::McapInfo;
use didim_drivers::source::{InterfaceName, StampClock};

use super::options::RecorderOptions;
use super::status::{RecordingState, SharedRecording};
use super::tap::{FrameTap, frame_queue};
use super::writer::RingWriter;

/// Maximum time that the service waits for the last file to be closed.
const FINISH_TIMEOUT: Duration = Duration::from_secs(3);

/// A running recorder.
#[derive(Debug)]
pub struct Recorder {
    thread: JoinHandle<()>,
    shared: SharedRecording,
}

/// Runs the body of the thread. If it panics, nothing more is recorded and no thread waits for it,
/// so the status has to report the panic.
fn run_guarded(shared: &SharedRecording, body: impl FnOnce()) {
    if catch_unwind(AssertUnwindSafe(body)).is_err() {
        let mut status = shared.update();
        status.state = RecordingState::Failed;
        status.why =
            Some("the recorder ended by itself: see the log, and restart the service".into());
    }
}

impl Recorder {
    /// Starts the thread. The bus thread gets the tap. The recorder ends when the tap is dropped.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(
        options: RecorderOptions,
        interfaces: &[InterfaceName],
        clock: StampClock,
    ) -> std::io::Result<(Self, FrameTap)> {
        let (tap, frames, unrecorded) = frame_queue();
        let shared = SharedRecording { unrecorded, ..SharedRecording::default() };
        shared.update().ring_limit_bytes = options.ring_bytes;
        let now = clock_pair();
        let info = McapInfo {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: options.cell.clone(),
            configuration: options.configuration.clone(),
            recorder_run: format!("{:x}-{}", now.realtime_ns, std::process::id()),
            interfaces: interfaces.to_vec(),
            ..McapInfo::default()
        };
        let mut writer = RingWriter::new(options, info, clock, shared.clone(), Instant::now());
        let watched = shared.clone();
        let body = move || run_guarded(&watched, || writer.run(frames));
        let thread = std::thread::Builder::new().name("recorder".into()).spawn(body)?;
        Ok((Self { thread, shared }, tap))
    }

    /// Returns the shared counts.
    pub fn shared(&self) -> &SharedRecording {
        &self.shared
    }

    /// Waits for a limited time until the last file is closed. The tap must be dropped before.
    pub fn finish(self) {
        let since = Instant::now();
        while !self.thread.is_finished() {
            if since.elapsed() > FINISH_TIMEOUT {
                tracing::warn!("the recording is not closed within {FINISH_TIMEOUT:?}");
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_reported() {
        let shared = SharedRecording::default();
        run_guarded(&shared, || panic!("on purpose"));
        let status = shared.snapshot();
        assert_eq!(status.state, RecordingState::Failed);
        assert!(status.why.unwrap().contains("restart the service"));
    }
}
