//! The thread that follows the stream and cuts it into windows.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Instant;

use didim_drivers::socket::monotonic_ns;

use super::command::{Answer, Command, Commands, Request, WorkerRequest};
use super::configuration::{Configuration, FindLoad, Identifier, Identify};
use super::identify::Identification;
use super::load::LoadWatch;
use super::setup::{WhenBusy, WorkerError, WorkerOptions};
use super::silence::SilenceWatch;
use super::state::{SharedEstimation, WindowState};
use super::time_of_day::{Arrival, TimeOfDay};
use super::window::{Loss, Rejection, WindowEvent};
use super::windower::{CommandError, Windower};
use crate::live::limits::LiveLimits;
use crate::live::pause::{Pause, PauseWatch};
use crate::live::recording::{Archiver, ArchiverThread};
use crate::live::stream::{Batch, BatchKind, SampleReader, StreamNode, StreamSample};

/// Longest sleep of the thread. It limits the time until the thread notices a stop or a command.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);
/// Maximum number of waiting commands.
const MAX_WAITING_COMMANDS: usize = 8;

/// Reason for the end of the worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerEnd {
    /// A stop was requested.
    Stopped,
    /// The log was read to its end, and every window is processed.
    StreamEnded,
}

/// The worker. It has joined the stream, and must run on the thread that created it.
#[derive(Debug)]
pub struct Worker {
    reader: SampleReader,
    windower: Windower,
    time_of_day: TimeOfDay,
    /// Identifier of the open window, or of the next one.
    identifier: Identifier,
    /// Configuration that applies once no window is open.
    next_configuration: Option<Box<Configuration>>,
    identification: Identification,
    load: Option<LoadWatch>,
    shared: SharedEstimation,
    requests: Receiver<Request>,
    last_sample: Option<StreamSample>,
    /// Arrival of the newest live sample.
    arrival: Option<Arrival>,
    archiver: Option<(Archiver, ArchiverThread)>,
    silence: SilenceWatch,
    pause_watch: PauseWatch,
    /// Last pause, and its end.
    last_pause: Option<(Pause, Instant)>,
}

impl Worker {
    /// Opens the store, joins the stream and starts the identification thread.
    ///
    /// # Errors
    /// [`WorkerError`].
    pub fn start(
        options: &WorkerOptions,
        (identify, find_load): (Identify, Option<FindLoad>),
        shared: &SharedEstimation,
    ) -> Result<(Self, Commands), WorkerError> {
        let start = |archiver| Archiver::start(archiver, &options.budget);
        let archiver = options.archiver.as_ref().map(start).transpose();
        let archiver = archiver.map_err(WorkerError::Thread)?;
        let handle = archiver.as_ref().map(|(archiver, _)| archiver.clone());
        if let Some(archiver) = &handle {
            shared.set_archive(archiver.shared().clone());
        }
        let identification = Identification::start(options, shared, handle.clone())?;
        let (submit, requests) = sync_channel(MAX_WAITING_COMMANDS);
        let results = options.results.clone();
        let identifier =
            Identifier::new(identify, find_load, options.configuration.clone(), results);
        let load = options.folder.as_ref().filter(|_| identifier.looks_for_loads());
        let load = load.map(|folder| LoadWatch::start(folder, shared)).transpose()?;
        shared.update().configuration.clone_from(&options.configuration);
        let worker = Self {
            reader: StreamNode::join(&options.stream)?.sample_reader()?,
            windower: match &options.recorded {
                Some(window) => Windower::of_recorded(options.windows.clone(), window.clone()),
                None => Windower::new(options.windows.clone()),
            },
            time_of_day: options.time_of_day,
            identifier,
            next_configuration: None,
            identification,
            load,
            shared: shared.clone(),
            requests,
            last_sample: None,
            arrival: None,
            archiver,
            silence: SilenceWatch::default(),
            pause_watch: PauseWatch::new(LONGEST_SLEEP),
            last_pause: None,
        };
        let folder = options.folder.clone();
        Ok((worker, Commands::new(submit, shared.clone(), handle, folder)))
    }

    /// Follows the stream until it ends or `stop` is set.
    ///
    /// At the end of a stream, every window is identified before the return. At a stop, open and
    /// queued windows are rejected, because an identification may take longer than a service
    /// manager waits.
    ///
    /// # Errors
    /// [`WorkerError`].
    pub fn run(mut self, stop: &AtomicBool) -> Result<WorkerEnd, WorkerError> {
        match self.follow(stop) {
            Ok(WorkerEnd::StreamEnded) => self.end(stop),
            Ok(WorkerEnd::Stopped) => {
                // The ports are closed first. A wait for the disk may be interrupted by the end of
                // the process, which would leave the ports in shared memory.
                drop(self.reader);
                self.identification.give_up();
                self.archiver.into_iter().for_each(|(_, thread)| thread.finish());
                Ok(WorkerEnd::Stopped)
            }
            Err(error) => {
                // The thread may know why it has ended.
                let cause = match error {
                    WorkerError::IdentificationEnded => self.identification.finish(stop).err(),
                    _ => None,
                };
                // Waiting windows are counted, and their recordings kept.
                self.shared.give_up();
                self.archiver.into_iter().for_each(|(_, thread)| thread.finish());
                Err(cause.unwrap_or(error))
            }
        }
    }

    /// Follows the stream, until every opened window is queued, identified or rejected.
    fn follow(&mut self, stop: &AtomicBool) -> Result<WorkerEnd, WorkerError> {
        while !stop.load(Ordering::Relaxed) {
            if self.identification.has_ended() {
                return Err(WorkerError::IdentificationEnded);
            }
            self.shared.count_iteration();
            // A replay may wait for an identification, which is not a pause.
            self.pause_watch.restart();
            self.reader.wait_for_batch(LONGEST_SLEEP)?;
            if let Some(pause) = self.pause_watch.check() {
                self.last_pause = Some((pause, Instant::now()));
            }
            self.answer_requests(stop)?;
            if self.silence.is_new(Instant::now()) {
                self.keep_fault("silence");
            }
            if self.silence.is_silent() {
                let event = self.windower.handle_silence();
                self.handle(event, WhenBusy::Reject, stop)?;
            }
            while let Some(batch) = self.reader.receive()? {
                self.shared.record_taken(&batch, monotonic_ns());
                let kind = batch.kind();
                self.take_batch(&batch, stop)?;
                drop(batch);
                if kind == BatchKind::End {
                    self.reader.acknowledge()?;
                    let event = self.windower.finish();
                    self.handle(event, WhenBusy::Wait, stop)?;
                    self.shared.update().window = WindowState::Idle;
                    return Ok(WorkerEnd::StreamEnded);
                }
                if kind == BatchKind::Replay {
                    self.reader.acknowledge()?;
                }
                if stop.load(Ordering::Relaxed) {
                    break;
                }
            }
        }
        let event = self.windower.stop();
        self.handle(event, WhenBusy::Reject, stop)?;
        self.shared.update().window = WindowState::Idle;
        Ok(WorkerEnd::Stopped)
    }

    /// Identifies the queued windows after the end of the stream.
    fn end(self, stop: &AtomicBool) -> Result<WorkerEnd, WorkerError> {
        if let Some(load) = self.load {
            load.finish(stop);
        }
        let is_finished = self.identification.finish(stop);
        drop(self.reader);
        self.archiver.into_iter().for_each(|(_, thread)| thread.finish());
        let is_finished = is_finished?;
        Ok(if is_finished { WorkerEnd::StreamEnded } else { WorkerEnd::Stopped })
    }

    fn answer_requests(&mut self, stop: &AtomicBool) -> Result<(), WorkerError> {
        while let Ok((asked, answer)) = self.requests.try_recv() {
            let outcome = match asked {
                WorkerRequest::Command(Command::Begin) => self.windower.handle_begin(),
                WorkerRequest::Command(Command::End) => self.windower.handle_end(),
                WorkerRequest::Command(Command::Identify) => self.identify_now(stop)?,
                WorkerRequest::Configure(configuration) => {
                    self.shared.update().configuration_waits = true;
                    self.next_configuration = Some(configuration);
                    self.change_between_windows();
                    Ok(())
                }
            };
            // The requester may have disconnected.
            let _ = answer.try_send(outcome);
        }
        Ok(())
    }

    /// Applies the next configuration, if there is one and no window is open.
    fn change_between_windows(&mut self) {
        if self.windower.open_samples().is_some() {
            return;
        }
        let Some(next) = self.next_configuration.take() else { return };
        let Configuration { windows, identify, find_load, sha256, results } = *next;
        tracing::info!(configuration = sha256, "the new configuration is in effect from here on");
        let mut status = self.shared.update();
        status.configuration.clone_from(&sha256);
        status.configuration_waits = false;
        drop(status);
        self.windower.change_plan(windows);
        self.identifier = Identifier::new(identify, find_load, sha256, results);
    }

    /// Closes the open window and queues it. If this is refused, the requester gets the reason. The
    /// window is closed only if it will be identified.
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

    fn take_batch(&mut self, batch: &Batch, stop: &AtomicBool) -> Result<(), WorkerError> {
        let when_busy = match batch.kind() {
            BatchKind::Live => WhenBusy::Reject,
            BatchKind::Replay | BatchKind::End => WhenBusy::Wait,
        };
        if batch.restarted {
            let event = self.windower.handle_loss(Loss::Restarted);
            self.handle(event, when_busy, stop)?;
            // The last sample is reset only now, because the recording of the fault is around it.
            self.last_sample = None;
        }
        if batch.lost_batches > 0 {
            let loss = Loss::StreamOverflow { batches: batch.lost_batches };
            let event = self.windower.handle_loss(loss);
            self.handle(event, when_busy, stop)?;
        }
        if batch.kind() == BatchKind::Live
            && let Some(newest) = batch.samples().last()
        {
            self.silence.handle_samples(Instant::now());
            self.arrival = Some(Arrival::now(newest.joint_sample().stamp_ns));
        }
        let mut missing = 0;
        for sample in batch.samples() {
            if self.next_configuration.is_some() {
                self.change_between_windows();
            }
            if let Some(last) = self.last_sample {
                missing += sample.sequence.saturating_sub(last.sequence.saturating_add(1));
                if sample.queue_drops > last.queue_drops {
                    let frames = sample.queue_drops - last.queue_drops;
                    let event = self.windower.handle_loss(Loss::QueueDrops { frames });
                    // If the loss rejects a window, the rejection already keeps the fault.
                    if event.is_none() {
                        self.keep_fault("queue-drops");
                    }
                    self.handle(event, when_busy, stop)?;
                }
            }
            self.last_sample = Some(*sample);
            let event = self.windower.handle_sample(&sample.joint_sample());
            self.handle(event, when_busy, stop)?;
            if let Some(load) = &self.load
                && let Some(survey) = self.windower.next_look()
            {
                load.submit(survey, self.identifier.clone(), when_busy, stop)?;
            }
        }
        let mut status = self.shared.update();
        status.batches += 1;
        status.samples += batch.samples().len() as u64;
        status.samples_missing += missing;
        status.batches_lost += batch.lost_batches;
        status.restarts += u64::from(batch.restarted);
        status.windows_opened = self.windower.opened_count();
        status.window = match self.windower.open_samples() {
            Some(samples) => WindowState::Open { samples },
            None => WindowState::Idle,
        };
        Ok(())
    }

    /// Keeps the bus frames around the last sample.
    fn keep_fault(&self, cause: &'static str) {
        if let (Some((archiver, _)), Some(last)) = (&self.archiver, &self.last_sample) {
            archiver.keep_fault(cause, last.joint_sample().stamp_ns, Instant::now());
        }
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
                // A recorded window has its own start time.
                window.recording_start = window
                    .recording_start
                    .or_else(|| self.time_of_day.start(&window, self.arrival));
                window.note = self.shared.update().note.take();
                let identifier = self.identifier.clone();
                // The caller checks for a stop.
                self.identification.submit(window, identifier, when_busy, stop).map(drop)
            }
            Some(WindowEvent::Rejected(mut rejected)) => {
                if let (Rejection::Loss(loss), Some((pause, end))) =
                    (&mut rejected.rejection, &self.last_pause)
                    && end.elapsed() < LiveLimits::DEFAULT.recent_period
                {
                    *loss = loss.explained_by(pause);
                }
                if matches!(rejected.rejection, Rejection::Loss(_)) {
                    self.keep_fault(rejected.rejection.cause());
                }
                self.shared.reject(rejected);
                Ok(())
            }
        }
    }
}
