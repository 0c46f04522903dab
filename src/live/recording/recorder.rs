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

/// Pause after a panic of the recorder.
const RESTART_PAUSE: Duration = Duration::from_secs(1);

/// Runs the body of the thread until it returns. After a panic, the status reports it, and the body
/// runs again: no thread waits for the recorder, so nobody else would start it again.
fn run_guarded(shared: &SharedRecording, pause: Duration, mut body: impl FnMut()) {
    while catch_unwind(AssertUnwindSafe(&mut body)).is_err() {
        let mut status = shared.update();
        status.state = RecordingState::Failed;
        status.write_errors += 1;
        status.why = Some("the recorder panicked, and starts again: report its message".into());
        drop(status);
        std::thread::sleep(pause);
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
        let (tap, mut frames, unrecorded) = frame_queue();
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
        let watched = shared.clone();
        let thread = std::thread::Builder::new().name("recorder".into()).spawn(move || {
            run_guarded(&watched, RESTART_PAUSE, || {
                let (options, info) = (options.clone(), info.clone());
                let shared = watched.clone();
                RingWriter::new(options, info, clock, shared, Instant::now()).run(&mut frames);
            });
        })?;
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
    use crate::expectation::Expectation;

    #[test]
    fn a_recorder_that_panics_is_reported_and_starts_again() {
        let shared = SharedRecording::default();
        let mut runs = 0;
        run_guarded(&shared, Duration::ZERO, || {
            runs += 1;
            assert!(runs > 2, "on purpose");
        });
        assert_eq!(runs, 3);
        let status = shared.snapshot();
        let expected = Expectation::of("recorder-panics");
        assert_eq!(status.state, RecordingState::Failed);
        expected.assert_eq("write_errors", &status.write_errors);
        expected.assert_said(&status.why.unwrap(), &[]);
    }
}
