//! The queue from the bus thread to the recorder.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use didim_drivers::frame::{Frame, FrameId};
use rtrb::{Consumer, Producer, RingBuffer};

/// Number of frames that may wait for the disk. The queue holds 6 s at 5000 frames/s and takes 3
/// MB.
const QUEUE_FRAMES: usize = 1 << 15;

/// A frame as the assembler received it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordedFrame {
    /// Frame with its stamp in the time base of the assembler.
    pub frame: Frame,
    /// Sequence number over all frames of the bus, including lost frames.
    pub sequence: u32,
}

/// The bus thread's end of the queue.
#[derive(Debug)]
pub struct FrameTap {
    queue: Producer<RecordedFrame>,
    unrecorded: Arc<AtomicU64>,
    sequence: u32,
    queue_drops: u64,
}

/// Creates the recorder's queue with all its memory. Also creates the counter of frames that did
/// not fit into the queue.
pub fn frame_queue() -> (FrameTap, Consumer<RecordedFrame>, Arc<AtomicU64>) {
    let (mut queue, mut frames) = RingBuffer::new(QUEUE_FRAMES);
    // The memory pages are touched here, so that the bus thread does not have to wait for them.
    if let Ok(blank) = Frame::classic(FrameId::Standard(0), &[]) {
        while queue.push(RecordedFrame { frame: blank, sequence: 0 }).is_ok() {}
        while frames.pop().is_ok() {}
    }
    let unrecorded = Arc::new(AtomicU64::new(0));
    let tap = FrameTap { queue, unrecorded: Arc::clone(&unrecorded), sequence: 0, queue_drops: 0 };
    (tap, frames, unrecorded)
}

impl FrameTap {
    /// Passes on frames that were read together. `drops` is the total number of frames that were
    /// dropped unread before them. Never waits: frames that do not fit into the queue are counted.
    pub fn pass_on(&mut self, frames: &[Frame], drops: u64) {
        let dropped = drops.saturating_sub(self.queue_drops);
        self.queue_drops = drops;
        // The number wraps modulo 2³², like the sequence number.
        let dropped = u32::try_from(dropped & u64::from(u32::MAX)).unwrap_or(0);
        self.sequence = self.sequence.wrapping_add(dropped);
        for frame in frames {
            let recorded = RecordedFrame { frame: *frame, sequence: self.sequence };
            self.sequence = self.sequence.wrapping_add(1);
            if self.queue.push(recorded).is_err() {
                self.unrecorded.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}
