//! A bus inside one process: what a simulated arm sends, without a kernel that knows CAN.

use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError};

use super::{InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, room};
use crate::frame::Frame;

/// What happens to a frame that finds the queue full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhenFull {
    /// The sender waits until there is room: nothing is lost, a simulation goes as fast as it is
    /// read.
    Wait,
    /// The frame is dropped and counted, as a kernel does whose receive buffer is full.
    Drop,
}

/// Makes a bus with a queue of `capacity` frames (at least one) and its two ends.
///
/// The queue is made here, once. The receiving end takes no lock while frames are there and
/// allocates nothing after its first wait, in which the standard library sets up the thread's
/// parking place. It ends when every sender is dropped.
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

/// The sending end. A clone is a second device on the same bus.
#[derive(Clone, Debug)]
pub struct InProcessSender {
    queue: SyncSender<Frame>,
    drops: Arc<AtomicU64>,
    when_full: WhenFull,
}

impl InProcessSender {
    /// Sends one frame, stamped and marked with its interface by the caller.
    ///
    /// # Errors
    /// [`BusClosed`] when nobody will ever receive it.
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

/// The receiving end of an in-process bus is gone: stop sending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the receiving end of the in-process bus is closed")]
pub struct BusClosed;

/// The receiving end.
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
        if room(batch) == 0 {
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
            // An end is told by the next call, after these frames.
            next = if room(batch) == 0 { None } else { self.frames.try_recv().ok() };
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
