//! The threads of the service and their reports.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use didim_drivers::source::Source;
use tokio::sync::mpsc::UnboundedSender;

use super::external_torque::ObserverThread;
use super::spawn::{block_signals, system};
use super::{AcquisitionPart, EstimationPart, ServiceError};
use crate::live::acquire::{AcquireEnd, Acquisition, SharedAcquisition};
use crate::live::recording::{FrameTap, Recorder, RecorderOptions};
use crate::live::worker::{Commands, SharedEstimation, Worker, WorkerEnd};

/// Report of a thread. A thread sends at most two reports, so the unbounded channel stays small.
pub(super) enum Report {
    /// The bus thread has created its ports.
    AcquisitionReady,
    /// The worker has created its ports, and accepts commands.
    EstimationReady(Commands),
    /// The bus thread has ended.
    AcquisitionEnded(Result<AcquireEnd, ServiceError>),
    /// The worker has ended.
    EstimationEnded(Result<WorkerEnd, ServiceError>),
}

pub(super) fn start_acquisition(
    part: Box<AcquisitionPart>,
    shared: &SharedAcquisition,
    stop: &Arc<AtomicBool>,
    reports: &UnboundedSender<Report>,
) -> Result<(), ServiceError> {
    let (shared, stop, reports) = (shared.clone(), Arc::clone(stop), reports.clone());
    spawn("bus", move || {
        let ended = run_guarded("bus", || {
            let AcquisitionPart { source, assembler, options, recorder, external_torque } = *part;
            let (recorder, tap) = start_recorder(recorder, &*source, &shared)?.unzip();
            let settings = (&options.stream, options.real_time);
            let start = |part| ObserverThread::start(part, settings, &shared);
            let (observer, samples) = external_torque.map(start).transpose()?.unzip();
            let acquisition = Acquisition::start(&options, source, assembler, &shared)?;
            let acquisition = acquisition.with_tap(tap).with_observer(samples);
            // The receiver exists longer than the threads, except just before the end of the
            // process.
            let _ = reports.send(Report::AcquisitionReady);
            let end = acquisition.run(&stop);
            // The tap has been dropped, so the recording can be closed.
            recorder.into_iter().for_each(Recorder::finish);
            drop(observer);
            Ok(end?)
        });
        let _ = reports.send(Report::AcquisitionEnded(ended));
    })
}

fn start_recorder(
    options: Option<RecorderOptions>,
    source: &dyn Source,
    shared: &SharedAcquisition,
) -> Result<Option<(Recorder, FrameTap)>, ServiceError> {
    let Some(options) = options else { return Ok(None) };
    let started = Recorder::start(options, source.interfaces(), source.stamp_clock());
    let (recorder, tap) = started.map_err(system("start a thread"))?;
    shared.set_recording(recorder.shared().clone());
    Ok(Some((recorder, tap)))
}

pub(super) fn start_estimation(
    part: EstimationPart,
    shared: &SharedEstimation,
    stop: &Arc<AtomicBool>,
    reports: &UnboundedSender<Report>,
) -> Result<(), ServiceError> {
    let (shared, stop, reports) = (shared.clone(), Arc::clone(stop), reports.clone());
    spawn("worker", move || {
        let ended = run_guarded("worker", || {
            let EstimationPart { identify, find_load, options } = part;
            let (worker, commands) = Worker::start(&options, (identify, find_load), &shared)?;
            let _ = reports.send(Report::EstimationReady(commands));
            Ok(worker.run(&stop)?)
        });
        let _ = reports.send(Report::EstimationEnded(ended));
    })
}

fn spawn(name: &'static str, body: impl FnOnce() + Send + 'static) -> Result<(), ServiceError> {
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(|| {
            block_signals();
            body();
        })
        .map(drop)
        .map_err(system("start a thread"))
}

/// Runs the body of a thread. A panic is reported to the supervision like any other end. The
/// closure shares only counts with other threads, and an incomplete count does no harm.
fn run_guarded<T>(
    thread: &'static str,
    body: impl FnOnce() -> Result<T, ServiceError>,
) -> Result<T, ServiceError> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or(Err(ServiceError::Panicked { thread }))
}
