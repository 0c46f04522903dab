//! The thread that follows the stream and cuts windows.

use core::time::Duration;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use didim_drivers::socket::monotonic_ns;

use super::identify::{Identification, Identify, WhenBusy};
use super::options::{WindowOptionError, WindowPlan};
use super::state::{SharedEstimation, WindowState};
use super::window::{Loss, WindowEvent};
use super::windower::{CommandError, Windower};
use crate::drift::DriftOptions;
use crate::store::{ConfigurationTexts, Note, StoreError};
use crate::stream::{
    Batch, BatchKind, SampleReader, StreamError, StreamNode, StreamOptions, StreamSample,
};

/// The longest the thread sleeps; so it is how soon it sees a stop or a command.
const NAP: Duration = Duration::from_millis(50);
/// Commands that may wait.
const COMMANDS: usize = 8;

/// What the worker needs.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerOptions {
    /// The stream.
    pub stream: StreamOptions,
    /// The windows.
    pub windows: WindowPlan,
    /// Windows that may wait while one is identified. Memory: (queue + 2) windows.
    pub queue: usize,
    /// Folder of the results; nothing: they are published only.
    pub folder: Option<PathBuf>,
    /// Results kept in the folder.
    pub keep: usize,
    /// Hash of the configuration, for the results.
    pub configuration: String,
    /// What is kept beside the results.
    pub records: RecordOptions,
}

/// What is kept beside the results, so that they can be made again and compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordOptions {
    /// The files of the configuration as they were read.
    pub texts: ConfigurationTexts,
    /// Hash of how the base parameters are made up, for the history.
    pub regrouping: String,
    /// What counts as drift from the baseline.
    pub drift: DriftOptions,
}

/// Why the worker ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The windows cannot be meant.
    #[error(transparent)]
    Windows(#[from] WindowOptionError),
    /// The stream failed.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The results' folder failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The system gives no thread.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// The identification's thread panicked; its message is in the log. Report it.
    #[error("the identification ended by itself: see the log before this")]
    IdentificationEnded,
}

/// How the worker ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerEnd {
    /// It was told to.
    Stopped,
    /// The log was read to its end, and every window is dealt with.
    StreamEnded,
}

/// What somebody wants of the windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Open one.
    Begin,
    /// Close it.
    End,
    /// Close it at once, whatever opened it, and identify it.
    Identify,
}

type Answer = Result<(), CommandError>;
type Request = (Command, SyncSender<Answer>);

/// Hands commands to the worker.
#[derive(Clone, Debug)]
pub struct Commands(SyncSender<Request>, SharedEstimation);

/// The worker did not take a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmitError {
    /// Too many wait, or it has ended: ask again later.
    #[error("the worker takes no commands now")]
    Unavailable,
    /// The command does not fit the state.
    #[error(transparent)]
    Refused(#[from] CommandError),
}

impl Commands {
    /// Notes something with the open window, or with the next one. What was noted before and no
    /// window took is amended.
    pub fn note(&self, note: Note) {
        let mut status = self.1.update();
        status.note = Some(status.note.take().unwrap_or_default().amended(note));
    }

    /// Hands over a command and waits for the answer, at most `timeout`.
    ///
    /// # Errors
    /// [`SubmitError`].
    pub fn submit(&self, command: Command, timeout: Duration) -> Result<(), SubmitError> {
        let (answer, answered) = sync_channel(1);
        self.0.try_send((command, answer)).map_err(|_| SubmitError::Unavailable)?;
        Ok(answered.recv_timeout(timeout).map_err(|_| SubmitError::Unavailable)??)
    }
}

/// The worker, joined to the stream and ready to run on the thread that made it.
#[derive(Debug)]
pub struct Worker {
    reader: SampleReader,
    windower: Windower,
    identification: Identification,
    shared: SharedEstimation,
    requests: Receiver<Request>,
    last: Option<StreamSample>,
}

impl Worker {
    /// Opens the store, joins the stream and starts the identification's thread.
    ///
    /// # Errors
    /// [`WorkerError`].
    pub fn start(
        options: &WorkerOptions,
        identify: Identify,
        shared: &SharedEstimation,
    ) -> Result<(Self, Commands), WorkerError> {
        let identification = Identification::start(options, identify, shared)?;
        let (submit, requests) = sync_channel(COMMANDS);
        let worker = Self {
            reader: StreamNode::join(&options.stream)?.sample_reader()?,
            windower: Windower::new(options.windows.clone()),
            identification,
            shared: shared.clone(),
            requests,
            last: None,
        };
        Ok((worker, Commands(submit, shared.clone())))
    }

    /// Follows the stream until it ends or `stop` is set.
    ///
    /// At the end of a stream every window is identified first. At a stop what is open or queued is
    /// rejected: an identification may take longer than a service manager waits.
    ///
    /// # Errors
    /// [`WorkerError`].
    pub fn run(mut self, stop: &AtomicBool) -> Result<WorkerEnd, WorkerError> {
        while !stop.load(Ordering::Relaxed) {
            if self.identification.has_ended() {
                self.identification.finish(stop)?;
                return Err(WorkerError::IdentificationEnded);
            }
            self.shared.turn();
            self.reader.wait(NAP)?;
            self.answer(stop)?;
            while let Some(batch) = self.reader.receive()? {
                self.shared.record_taken(&batch, monotonic_ns());
                let kind = batch.kind();
                self.take(&batch, stop)?;
                drop(batch);
                if kind == BatchKind::End {
                    self.reader.acknowledge()?;
                    return self.end(stop);
                }
                if kind == BatchKind::Replay {
                    self.reader.acknowledge()?;
                }
                if stop.load(Ordering::Relaxed) {
                    break;
                }
            }
        }
        // After the last batch, every window opened is counted as identified or rejected.
        let event = self.windower.stop();
        self.handle(event, WhenBusy::Reject, stop)?;
        self.shared.update().window = WindowState::Idle;
        self.identification.give_up();
        Ok(WorkerEnd::Stopped)
    }

    /// Nothing follows: what is open is closed, and what is queued is identified.
    fn end(mut self, stop: &AtomicBool) -> Result<WorkerEnd, WorkerError> {
        let event = self.windower.finish();
        self.handle(event, WhenBusy::Wait, stop)?;
        self.shared.update().window = WindowState::Idle;
        let all = self.identification.finish(stop)?;
        Ok(if all { WorkerEnd::StreamEnded } else { WorkerEnd::Stopped })
    }

    fn answer(&mut self, stop: &AtomicBool) -> Result<(), WorkerError> {
        while let Ok((command, answer)) = self.requests.try_recv() {
            let outcome = match command {
                Command::Begin => self.windower.handle_begin(),
                Command::End => self.windower.handle_end(),
                Command::Identify => self.identify_now(stop)?,
            };
            // Whoever asked may have gone.
            let _ = answer.try_send(outcome);
        }
        Ok(())
    }

    /// Closes the open window and queues it. Whoever asks is told why not, and nothing is closed
    /// that would not be identified.
    fn identify_now(&mut self, stop: &AtomicBool) -> Result<Answer, WorkerError> {
        if !self.identification.has_room() {
            return Ok(Err(CommandError::Busy));
        }
        let closed = match self.windower.handle_identify() {
            Ok(closed) => closed,
            Err(refused) => return Ok(Err(refused)),
        };
        self.handle(Some(closed), WhenBusy::Reject, stop)?;
        self.shared.update().window = WindowState::Idle;
        Ok(Ok(()))
    }

    fn take(&mut self, batch: &Batch, stop: &AtomicBool) -> Result<(), WorkerError> {
        let when_busy = match batch.kind() {
            BatchKind::Live => WhenBusy::Reject,
            BatchKind::Replay | BatchKind::End => WhenBusy::Wait,
        };
        if batch.restarted {
            self.last = None;
            let event = self.windower.handle_loss(Loss::Restarted);
            self.handle(event, when_busy, stop)?;
        }
        if batch.lost_batches > 0 {
            let loss = Loss::StreamOverflow { batches: batch.lost_batches };
            let event = self.windower.handle_loss(loss);
            self.handle(event, when_busy, stop)?;
        }
        let mut missing = 0;
        for sample in batch.samples() {
            if let Some(last) = self.last {
                missing += sample.sequence.saturating_sub(last.sequence.saturating_add(1));
                if sample.queue_drops > last.queue_drops {
                    let frames = sample.queue_drops - last.queue_drops;
                    let event = self.windower.handle_loss(Loss::QueueDrops { frames });
                    self.handle(event, when_busy, stop)?;
                }
            }
            self.last = Some(*sample);
            let event = self.windower.handle_sample(&sample.joint_sample());
            self.handle(event, when_busy, stop)?;
        }
        let mut status = self.shared.update();
        status.batches += 1;
        status.samples += batch.samples().len() as u64;
        status.samples_missing += missing;
        status.batches_lost += batch.lost_batches;
        status.restarts += u64::from(batch.restarted);
        status.windows_opened = self.windower.opened();
        status.window = match self.windower.open_samples() {
            Some(samples) => WindowState::Open { samples },
            None => WindowState::Idle,
        };
        Ok(())
    }

    fn handle(
        &mut self,
        event: Option<WindowEvent>,
        when_busy: WhenBusy,
        stop: &AtomicBool,
    ) -> Result<(), WorkerError> {
        match event {
            None => Ok(()),
            Some(WindowEvent::Closed(mut window)) => {
                window.note = self.shared.update().note.take();
                // A stop is seen by whoever called.
                self.identification.submit(window, when_busy, stop).map(drop)
            }
            Some(WindowEvent::Rejected(rejected)) => {
                self.shared.reject(rejected);
                Ok(())
            }
        }
    }
}
