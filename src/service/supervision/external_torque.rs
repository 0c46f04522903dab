//! The observer thread, and the clients of its socket.

use core::cell::RefCell;
use core::convert::Infallible;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;

use super::spawn::{block_signals, system};
use super::{ExternalTorquePart, ServiceError};
use crate::live::acquire::SharedAcquisition;
use crate::live::external_torque::{
    ClientSender, Observing, ObservingParts, SampleTap, SharedExternalTorque, clients,
    sample_queue, watch_models,
};
use crate::live::real_time_options::RealTimeOptions;
use crate::live::stream::StreamOptions;
use crate::service::status::{Socket, accept};

/// Accepts clients for the observer thread until the future is dropped. Without an observer they
/// are disconnected.
///
/// # Errors
/// Only at the start, if the runtime cannot use the socket.
pub(super) async fn accept_torque_clients(
    socket: &Socket,
    clients: &RefCell<Option<ClientSender>>,
) -> io::Result<Infallible> {
    let listener = socket.to_tokio()?;
    loop {
        let client = accept(&listener).await;
        if let (Some(clients), Ok(client)) = (&mut *clients.borrow_mut(), client.into_std()) {
            clients.pass_on(client.into());
        }
    }
}

/// A running observer thread.
pub(super) struct ObserverThread {
    stop: Arc<AtomicBool>,
    /// `None` once it has ended.
    thread: Option<JoinHandle<()>>,
}

impl ObserverThread {
    /// Starts the thread and the one that reads results. Returns when its ports exist.
    pub(super) fn start(
        part: ExternalTorquePart,
        (stream, real_time): (&StreamOptions, RealTimeOptions),
        acquisition: &SharedAcquisition,
    ) -> Result<(Self, SampleTap), ServiceError> {
        let shared = SharedExternalTorque::default();
        acquisition.set_external_torque(shared.clone());
        let (tap, samples, reader) = sample_queue(&shared);
        let stop = Arc::new(AtomicBool::new(false));
        let models = watch_models(part.models, &shared, &stop).map_err(system("start a thread"))?;
        let clients = part.clients.unwrap_or_else(|| clients().1);
        let parts = ObservingParts { samples, reader, models, clients, shared: shared.clone() };
        // The memory is that of the whole process, and the processor that of the bus thread alone.
        let real_time = RealTimeOptions { cpu: None, lock_memory: false, ..real_time };
        let (stream, stop_of_thread) = (stream.clone(), Arc::clone(&stop));
        let (started, start) = sync_channel(1);
        let body = move || {
            block_signals();
            match Observing::start(&stream, parts) {
                Ok(observing) => {
                    let _ = started.send(Ok(()));
                    real_time.apply();
                    observing.run(&stop_of_thread);
                }
                Err(error) => drop(started.send(Err(error))),
            }
        };
        let guarded = move || {
            if catch_unwind(AssertUnwindSafe(body)).is_err() {
                shared.report_panic();
            }
        };
        let thread = std::thread::Builder::new().name("observer".into()).spawn(guarded);
        let thread = thread.map_err(system("start a thread"))?;
        match start.recv() {
            Ok(Ok(())) => Ok((Self { stop, thread: Some(thread) }, tap)),
            Ok(Err(error)) => Err(error.into()),
            Err(_) => Err(ServiceError::Panicked { thread: "observer" }),
        }
    }
}

/// Ends the thread, so that its ports leave shared memory.
impl Drop for ObserverThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic is in the status.
            let _ = thread.join();
        }
    }
}
