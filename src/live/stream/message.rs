//! The messages in shared memory: plain data with a versioned name.
//!
//! The derive of `ZeroCopySend` writes `unsafe impl` after checking every field; a layout that
//! changes must change the version in its `type_name`.

use didim_core::sample::{JointSample, MAX_JOINTS, Reading, Readings};
use iceoryx2::prelude::ZeroCopySend;

/// Samples of one batch.
pub const BATCH_SAMPLES: usize = 64;

/// One joint sample as it lies in shared memory.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("didim.StreamSample.v4")]
pub struct StreamSample {
    /// [`JointSample::sequence`].
    pub sequence: u64,
    /// [`JointSample::stamp_ns`] \[ns\].
    pub stamp_ns: u64,
    /// Frames dropped unread before this sample, since the acquisition began. A change since the
    /// sample before means that something was lost between the two.
    pub queue_drops: u64,
    /// When it was written here, at the earliest \[ns, CLOCK_MONOTONIC\]: of samples whose frames were
    /// read together, when those had been read.
    pub written_ns: u64,
    /// [`JointSample::motor_position_rad`] \[rad\].
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// [`JointSample::motor_torque_nm`] \[N·m\].
    pub motor_torque_nm: [f64; MAX_JOINTS],
    /// [`JointSample::motor_reference_rad`] \[rad\].
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// 1 when the reference counts. Not a bool: of those, not every byte is one.
    pub has_reference: u64,
    /// [`Readings::steps`].
    pub reading_steps: [[i16; MAX_JOINTS]; Reading::ALL.len()],
    /// [`Readings::joints`], and zeros, so that no byte is left out.
    pub reading_joints: [u8; 8],
}

impl StreamSample {
    /// The sample with the drops known when it was assembled, written at `written_ns`.
    pub fn new(sample: &JointSample, queue_drops: u64, written_ns: u64) -> Self {
        let mut reading_joints = [0; 8];
        reading_joints.iter_mut().zip(sample.readings.joints).for_each(|(to, of)| *to = of);
        Self {
            sequence: sample.sequence,
            stamp_ns: sample.stamp_ns,
            queue_drops,
            written_ns,
            motor_position_rad: sample.motor_position_rad,
            motor_torque_nm: sample.motor_torque_nm,
            motor_reference_rad: sample.motor_reference_rad,
            has_reference: u64::from(sample.has_reference),
            reading_steps: sample.readings.steps,
            reading_joints,
        }
    }

    /// The sample without what concerns the transport.
    pub fn joint_sample(&self) -> JointSample {
        let joints = core::array::from_fn(|reading| self.reading_joints[reading]);
        JointSample {
            sequence: self.sequence,
            stamp_ns: self.stamp_ns,
            motor_position_rad: self.motor_position_rad,
            motor_torque_nm: self.motor_torque_nm,
            motor_reference_rad: self.motor_reference_rad,
            has_reference: self.has_reference == 1,
            readings: Readings { steps: self.reading_steps, joints },
        }
    }
}

/// What a batch is for, in [`SampleBatch::kind`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchKind {
    /// Samples of a living bus: nobody waits for the reader.
    Live,
    /// Samples of a log: the reader acknowledges, so that none is lost.
    Replay,
    /// The last batch of a stream that has ended.
    End,
}

impl BatchKind {
    pub(super) fn code(self) -> u32 {
        match self {
            Self::Live => 0,
            Self::Replay => 1,
            Self::End => 2,
        }
    }

    pub(super) fn from_code(code: u32) -> Self {
        match code {
            1 => Self::Replay,
            2 => Self::End,
            _ => Self::Live,
        }
    }
}

/// A batch of samples: the unit of sending and of notification.
#[repr(C)]
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[type_name("didim.SampleBatch.v3")]
pub struct SampleBatch {
    /// Which run of the acquisition it is; changes when the acquisition is restarted.
    pub session: u64,
    /// Batches sent before this one in the session: a gap is a loss in the buffer.
    pub number: u64,
    /// When it was sent \[ns, CLOCK_MONOTONIC\].
    pub sent_ns: u64,
    /// Nominal sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Joints that the samples describe.
    pub joints: u32,
    /// Samples in use; see [`SampleBatch::samples`].
    pub count: u32,
    /// See [`BatchKind`].
    pub kind: u32,
    /// Keeps the samples aligned; zero.
    pub reserved: u32,
    /// The slots, `count` of them in use.
    pub slots: [StreamSample; BATCH_SAMPLES],
}

impl Default for SampleBatch {
    fn default() -> Self {
        Self {
            session: 0,
            number: 0,
            sent_ns: 0,
            sample_rate_hz: 0.0,
            joints: 0,
            count: 0,
            kind: 0,
            reserved: 0,
            slots: [StreamSample::default(); BATCH_SAMPLES],
        }
    }
}

impl SampleBatch {
    /// The samples in use.
    pub fn samples(&self) -> &[StreamSample] {
        let count = usize::try_from(self.count).unwrap_or(usize::MAX).min(BATCH_SAMPLES);
        self.slots.get(..count).unwrap_or_default()
    }

    /// What the batch is for.
    pub fn kind(&self) -> BatchKind {
        BatchKind::from_code(self.kind)
    }
}

/// How far a reader of a replay has got.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("didim.Acknowledgement.v1")]
pub(super) struct Acknowledgement {
    /// The session it is about.
    pub(super) session: u64,
    /// Batches of the session that the reader is done with.
    pub(super) batches: u64,
}
