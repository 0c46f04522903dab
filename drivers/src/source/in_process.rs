//! Bus inside one process. It carries the frames of a simulated arm and needs no kernel with CAN.

use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError};

use super::{InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, capacity};
use crate::frame::Frame;

/// Behaviour of the sender when the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhenFull {
    /// The sender waits for free capacity. Nothing is lost, and a simulation runs at the speed of
    /// the reader.
    Wait,
    /// The frame is dropped and counted, as in a kernel with a full receive buffer.
    Drop,
}

/// Creates a bus with a queue of `capacity` frames (at least one) and its two ends.
///
/// The queue is allocated here, once. The receiving end takes no lock while frames are available.
/// It allocates nothing after its first wait, in which the standard library prepares the thread for
/// waiting. The receiving end reports the end of the bus when every sender is dropped.
pub fn in_process_bus(
    interfaces: &[InterfaceName],
    capacity: usize,
    when_full: WhenFull,
) -> (InProcessSender, InProcessSource) {
    let (queue, frames) = std::sync::mpsc::sync_channel(capacity.max(1));
    let drops = Arc::new(AtomicU64::new(0));
    let source = InProcessSource {
        frames,
        drops: Arc::clone(&drops),
        interfaces: interfaces.to_vec(),
        counters: SourceCounters::default(),
    };
    (InProcessSender { queue, drops, when_full }, source)
}

/// Sending end of an in-process bus. A clone is a second device on the same bus.
#[derive(Clone, Debug)]
pub struct InProcessSender {
    queue: SyncSender<Frame>,
    drops: Arc<AtomicU64>,
    when_full: WhenFull,
}

impl InProcessSender {
    /// Sends one frame. The caller sets its stamp and its interface.
    ///
    /// # Errors
    /// [`BusClosed`] if the receiving end was dropped.
    pub fn send(&self, frame: Frame) -> Result<(), BusClosed> {
        match self.when_full {
            WhenFull::Wait => self.queue.send(frame).map_err(|_| BusClosed),
            WhenFull::Drop => match self.queue.try_send(frame) {
                Ok(()) => Ok(()),
                Err(TrySendError::Full(_)) => {
                    self.drops.fetch_add(1, Ordering::Relaxed);
                    Ok(())
                }
                Err(TrySendError::Disconnected(_)) => Err(BusClosed),
            },
        }
    }
}

/// Error for a bus whose receiving end was dropped: stop sending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the receiving end of the in-process bus is closed")]
pub struct BusClosed;

/// Receiving end of an in-process bus.
#[derive(Debug)]
pub struct InProcessSource {
    frames: Receiver<Frame>,
    drops: Arc<AtomicU64>,
    interfaces: Vec<InterfaceName>,
    counters: SourceCounters,
}

impl Source for InProcessSource {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        if capacity(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        let mut next = match self.frames.recv_timeout(timeout) {
            Ok(frame) => Some(frame),
            Err(RecvTimeoutError::Timeout) => return Ok(Received::Silence),
            Err(RecvTimeoutError::Disconnected) => return Ok(Received::End),
        };
        while let Some(frame) = next {
            self.counters.frames += 1;
            self.counters.error_frames += u64::from(frame.is_error());
            batch.push(frame);
            // If all senders are gone, the next call reports the end, after these frames.
            next = if capacity(batch) == 0 { None } else { self.frames.try_recv().ok() };
        }
        Ok(Received::Frames)
    }

    fn counters(&self) -> SourceCounters {
        SourceCounters { queue_drops: self.drops.load(Ordering::Relaxed), ..self.counters }
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }
}
