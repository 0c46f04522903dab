//! The queue from the bus thread to the observer thread.

use std::sync::{Arc, OnceLock};
use std::thread::Thread;

use didim_dynamics::{JointSample, MAX_JOINTS};
use rtrb::{Consumer, Producer, RingBuffer};

use super::status::SharedExternalTorque;

/// Number of samples that may wait: 0.8 s at 5 kHz. The queue takes 1.2 MB.
const QUEUE_SAMPLES: usize = 4096;

/// The part of a sample that the observer uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedSample {
    /// [`JointSample::sequence`].
    pub sequence: u64,
    /// [`JointSample::stamp_ns`] \[ns\].
    pub stamp_ns: u64,
    /// Time after the frames of the sample were read \[ns, CLOCK_BOOTTIME\].
    pub read_ns: u64,
    /// [`JointSample::motor_position_rad`] \[rad\].
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// [`JointSample::motor_torque_nm`] \[N·m\].
    pub motor_torque_nm: [f64; MAX_JOINTS],
}

impl ObservedSample {
    /// Takes a sample that was read at `read_ns`.
    pub fn new(sample: &JointSample, read_ns: u64) -> Self {
        Self {
            sequence: sample.sequence,
            stamp_ns: sample.stamp_ns,
            read_ns,
            motor_position_rad: sample.motor_position_rad,
            motor_torque_nm: sample.motor_torque_nm,
        }
    }
}

/// The bus thread's end of the queue.
#[derive(Debug)]
pub struct SampleTap {
    queue: Producer<ObservedSample>,
    reader: Arc<OnceLock<Thread>>,
    shared: SharedExternalTorque,
    has_new: bool,
}

/// Creates the queue with all its memory. The reader stores its thread in the last value.
pub fn sample_queue(
    shared: &SharedExternalTorque,
) -> (SampleTap, Consumer<ObservedSample>, Arc<OnceLock<Thread>>) {
    let (mut queue, mut samples) = RingBuffer::new(QUEUE_SAMPLES);
    // The memory pages are touched here, so that the bus thread does not have to wait for them.
    let blank = ObservedSample::new(&JointSample::zero(0, 0), 0);
    while queue.push(blank).is_ok() {}
    while samples.pop().is_ok() {}
    let reader = Arc::new(OnceLock::new());
    let shared = shared.clone();
    let tap = SampleTap { queue, reader: Arc::clone(&reader), shared, has_new: false };
    (tap, samples, reader)
}

impl SampleTap {
    /// Passes on a sample. Never waits: a sample that does not fit into the queue is counted, and
    /// the observer finds a gap.
    pub fn pass_on(&mut self, sample: &JointSample, read_ns: u64) {
        match self.queue.push(ObservedSample::new(sample, read_ns)) {
            Ok(()) => self.has_new = true,
            Err(_) => self.shared.count_skipped(),
        }
    }

    /// Wakes the observer thread if there are new samples.
    pub fn wake(&mut self) {
        if core::mem::take(&mut self.has_new)
            && let Some(reader) = self.reader.get()
        {
            reader.unpark();
        }
    }
}
