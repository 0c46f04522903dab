//! Observers of new results, created by a thread of their own.

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use didim_identification::external_torque::ExternalTorqueObserver;
use rtrb::{Consumer, Producer, RingBuffer};

use super::status::SharedExternalTorque;

/// Interval at which a new result is looked for.
const POLL: Duration = Duration::from_millis(500);
/// Number of observers that may wait: the observer thread takes one at its next sample.
const WAITING: usize = 2;

/// An observer, with the result that it is of.
#[derive(Debug)]
pub struct ObserverModel {
    /// The observer.
    pub observer: Box<ExternalTorqueObserver>,
    /// Number of the result, as in [`ExternalTorqueMessage::result`].
    ///
    /// [`ExternalTorqueMessage::result`]: crate::live::stream::ExternalTorqueMessage::result
    pub result: u64,
    /// The result for people: its number or its file.
    pub name: String,
}

/// Function that returns the observer of a new result, or the problem of one. `None` if there is no
/// new result since the last call.
pub type ModelSource = Box<dyn FnMut() -> Option<Result<ObserverModel, String>> + Send>;

/// The observer thread's ends: new observers, and the way back of those that are replaced, which
/// the other thread frees.
#[derive(Debug)]
pub struct ModelQueue {
    pub(super) new: Consumer<ObserverModel>,
    pub(super) replaced: Producer<ObserverModel>,
}

/// Starts the thread that looks for new results until `stop` is set.
///
/// # Errors
/// The system cannot start a thread.
pub fn watch_models(
    mut source: ModelSource,
    shared: &SharedExternalTorque,
    stop: &Arc<AtomicBool>,
) -> io::Result<ModelQueue> {
    let (mut sender, new) = RingBuffer::new(WAITING);
    let (replaced, mut returned) = RingBuffer::new(2 * WAITING);
    let (shared, stop) = (shared.clone(), Arc::clone(stop));
    std::thread::Builder::new().name("models".into()).spawn(move || {
        while !stop.load(Ordering::Relaxed) {
            while returned.pop().is_ok() {}
            // A new result waits until the observer thread has taken the one before.
            if !sender.is_full()
                && let Some(found) = source()
            {
                let outcome = found.and_then(|model| {
                    let name = model.name.clone();
                    let sent = sender.push(model).map_err(|_| "the queue is full".to_owned());
                    sent.map(|()| name)
                });
                if let Err(problem) = &outcome {
                    tracing::warn!("no external torque with the newest result: {problem}");
                }
                shared.set_model(outcome);
            }
            std::thread::sleep(POLL);
        }
    })?;
    Ok(ModelQueue { new, replaced })
}
