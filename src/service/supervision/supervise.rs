//! The supervision. It starts the parts, reports their state, and stops them.

use core::cell::RefCell;
use core::convert::Infallible;
use core::future::pending;
use core::time::Duration;
use std::io;
use std::time::Instant;

use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::external_torque::accept_torque_clients;
use super::manager::Manager;
use super::reload::{Event, Reload, Reloader};
use super::running::{PAUSE_POLL, Running};
use super::sockets::{MissingSockets, keep_serving_optional};
use super::{Parts, ServiceEnd, ServiceError, ServiceOptions, ServiceReport, SocketOptions};
use crate::live::stream::{StreamNode, Topic};
use crate::service::status::{Dispatcher, ReloadSender, Socket, serve_commands, serve_status};
use crate::signals::{SignalAction, Signals};

/// Interval at which the status is collected.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Interval at which the supervision checks whether the start is complete.
const READY_POLL: Duration = Duration::from_millis(20);

/// Runs the parts until a signal arrives, a log ends, or a part fails. See [`run_with_reload`].
///
/// # Errors
/// [`ServiceError`].
pub fn run(options: &ServiceOptions, parts: Parts) -> Result<ServiceReport, ServiceError> {
    run_with_reload(options, parts, None)
}

/// Runs the parts like [`run`], and also reloads the configuration on SIGHUP and by command.
///
/// The function notifies the service manager as follows. `READY=1` is sent when samples arrive or
/// the bus is known to be silent. A status line is sent every second. `WATCHDOG=1` is sent at half
/// of the watchdog time, but only while the threads make progress. `RELOADING=1` and `STOPPING=1`
/// are sent at a reload and at the stop.
///
/// # Errors
/// [`ServiceError`].
pub fn run_with_reload(
    options: &ServiceOptions,
    parts: Parts,
    reload: Option<Reload>,
) -> Result<ServiceReport, ServiceError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|cause| ServiceError::System { action: "start the runtime", cause })?;
    let report = runtime.block_on(supervise(options, parts, reload));
    // A command that waits for its answer must not delay the end of the process.
    runtime.shutdown_background();
    report
}

async fn supervise(
    options: &ServiceOptions,
    mut parts: Parts,
    reload: Option<Reload>,
) -> Result<ServiceReport, ServiceError> {
    if options.control.is_some() && matches!(parts, Parts::Acquisition(_)) {
        return Err(ServiceError::NothingToControl);
    }
    let mut signals = Signals::register(reload.is_some())
        .map_err(|cause| ServiceError::System { action: "register for signals", cause })?;
    let mut manager = Manager::from_environment();
    // The sockets are created first, because a second service of the same cell fails there.
    let status_socket = listen(options.status.as_ref())?;
    let control_socket = listen(options.control.as_ref())?;
    let torque_socket = listen(options.external_torque.as_ref())?;
    let torque_clients = parts.connect_clients();
    let node = StreamNode::join(parts.stream())?;
    let publisher = node.document_writer(Topic::Status)?;
    // An estimation in a separate process reads the status of the acquisition. Otherwise it could
    // not distinguish disabled drives from a silent bus.
    let alone = matches!(parts, Parts::Estimation(_));
    let statuses = alone.then(|| node.document_reader(Topic::Status).ok()).flatten();
    let mut running = Running::new(options, &parts, publisher, statuses);
    let started = tokio::select! {
        started = running.start(parts, &manager) => started.map(|()| None),
        () = signals.end() => Ok(Some(ServiceEnd::Signal)),
    };
    let end = match started {
        Ok(None) => {
            let (sender, asked) = ReloadSender::channel();
            let sender = reload.is_some().then_some(sender);
            let windows = running.commands();
            let reloader = Reloader::new(reload, windows.clone(), asked);
            let dispatcher = Dispatcher { windows, reload: sender };
            let (latest, documents) = watch::channel(running.publish_snapshot().1);
            let missing = MissingSockets::default();
            let status = keep_serving_optional(
                options.status.as_ref().zip(status_socket),
                &missing,
                async |socket: &Socket| serve_status(socket, documents.clone()).await,
            );
            let control = keep_serving_optional(
                options.control.as_ref().zip(control_socket),
                &missing,
                async |socket: &Socket| serve_commands(socket, dispatcher.clone()).await,
            );
            let torque_clients = RefCell::new(torque_clients);
            let torques = keep_serving_optional(
                options.external_torque.as_ref().zip(torque_socket),
                &missing,
                async |socket: &Socket| accept_torque_clients(socket, &torque_clients).await,
            );
            let attended = (&mut running, &mut manager, reloader, signals);
            let threads = async { handle_events(attended, &missing, latest).await };
            tokio::select! {
                failed = status => Err(server_failed(failed)),
                failed = control => Err(server_failed(failed)),
                failed = torques => Err(server_failed(failed)),
                end = threads => end,
            }
        }
        Ok(Some(end)) => Ok(end),
        Err(error) => Err(error),
    };
    if end.is_ok() {
        manager.notify_stopping();
    }
    running.stop().await;
    let (snapshot, _) = running.publish_snapshot();
    Ok(ServiceReport { end: end?, snapshot })
}

/// Handles events while the parts run. Returns the reason for their end.
async fn handle_events(
    (running, manager, mut reloader, mut signals): (&mut Running, &mut Manager, Reloader, Signals),
    missing: &MissingSockets,
    latest: watch::Sender<std::sync::Arc<[u8]>>,
) -> Result<ServiceEnd, ServiceError> {
    let mut period = interval_of(STATUS_PERIOD);
    let mut ready_poll = interval_of(READY_POLL);
    let mut pause_poll = interval_of(PAUSE_POLL);
    running.restart_pauses();
    let mut feeding = manager.watchdog_period().map(interval_of);
    loop {
        tokio::select! {
            reported = signals.next() => match reported {
                SignalAction::End => return Ok(ServiceEnd::Signal),
                SignalAction::Reload => {
                    if reloader.begin(None) {
                        manager.notify_reloading();
                    }
                }
            },
            event = reloader.next() => match event {
                Event::Asked(answer) => {
                    if reloader.begin(Some(answer)) {
                        manager.notify_reloading();
                    }
                }
                Event::Finished(outcome) => {
                    running.store_reload_outcome(&outcome);
                    latest.send_replace(running.publish_snapshot().1);
                    manager.notify_reloaded(&running.line());
                    if reloader.finish(&outcome) && reloader.begin(None) {
                        manager.notify_reloading();
                    }
                }
            },
            report = running.report() => if let Some(end) = running.handle_report(report)? {
                return Ok(end);
            },
            _ = ready_poll.tick(), if !manager.is_ready() => if running.is_ready(Instant::now()) {
                latest.send_replace(running.publish_snapshot().1);
                manager.notify_ready(&running.line());
            },
            _ = period.tick() => {
                running.look_at_files(missing.reasons());
                let (snapshot, document) = running.publish_snapshot();
                running.record_changes(&snapshot, manager.is_ready());
                latest.send_replace(document);
                manager.notify_status(&running.line());
            }
            _ = pause_poll.tick() => running.look_for_pause(),
            () = next_tick(&mut feeding) => if running.has_progressed() {
                manager.feed_watchdog();
            },
        }
    }
}

fn interval_of(period: Duration) -> Interval {
    let mut interval = interval(period);
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    interval
}

async fn next_tick(interval: &mut Option<Interval>) {
    match interval {
        Some(interval) => drop(interval.tick().await),
        None => pending().await,
    }
}

fn listen(options: Option<&SocketOptions>) -> Result<Option<Socket>, ServiceError> {
    Ok(options.map(SocketOptions::listen).transpose()?)
}

fn server_failed(failed: io::Result<Infallible>) -> ServiceError {
    let Err(cause) = failed;
    ServiceError::System { action: "serve a socket", cause }
}
