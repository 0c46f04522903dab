//! The messages in shared memory. They are plain data with a versioned type name.
//!
//! The derive macro of `ZeroCopySend` writes `unsafe impl` after checking every field. A changed
//! layout needs a new version in its `type_name`.

use didim_dynamics::sample::{JointSample, MAX_JOINTS, Reading, Readings};
#[cfg(target_os = "linux")]
use iceoryx2::prelude::ZeroCopySend;

/// Number of samples of one batch.
pub const BATCH_SAMPLES: usize = 64;

/// One joint sample in its shared-memory layout.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(target_os = "linux", derive(ZeroCopySend), type_name("didim.StreamSample.v5"))]
pub struct StreamSample {
    /// [`JointSample::sequence`].
    pub sequence: u64,
    /// [`JointSample::stamp_ns`] \[ns\].
    pub stamp_ns: u64,
    /// Total number of frames that were dropped unread before this sample, since the start of the
    /// acquisition. If it differs from that of the previous sample, frames were lost between the
    /// two.
    pub queue_drops: u64,
    /// Earliest time at which the sample was written to the buffer \[ns, CLOCK_BOOTTIME\]. If
    /// frames were read together, it is the time after that read.
    pub written_ns: u64,
    /// [`JointSample::motor_position_rad`] \[rad\].
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// [`JointSample::motor_torque_nm`] \[N·m\].
    pub motor_torque_nm: [f64; MAX_JOINTS],
    /// [`JointSample::motor_reference_rad`] \[rad\].
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// 1 if the sample has references, otherwise 0. The type is not bool, because not every byte is
    /// a valid bool.
    pub has_reference: u64,
    /// [`Readings::steps`].
    pub reading_steps: [[i16; MAX_JOINTS]; Reading::ALL.len()],
    /// [`Readings::joints`], padded with zeros so that no byte is uninitialised.
    pub reading_joints: [u16; 8],
}

impl StreamSample {
    /// Creates a sample that is written at `written_ns`. `queue_drops` is the number of drops when
    /// the sample was assembled.
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

    /// Returns the sample without the transport fields.
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

/// Kind of a batch, in [`SampleBatch::kind`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchKind {
    /// Samples of a live bus. The bus does not wait for the reader.
    Live,
    /// Samples of a log. The reader acknowledges them, so that none is lost.
    Replay,
    /// Last batch of an ended stream.
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

/// A batch of samples: the unit of transmission and notification.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(target_os = "linux", derive(ZeroCopySend), type_name("didim.SampleBatch.v4"))]
pub struct SampleBatch {
    /// Identifier of the acquisition run. It differs after a restart of the acquisition.
    pub session: u64,
    /// Number of batches that were sent before this one in the session. A gap shows that batches
    /// were lost in the buffer.
    pub number: u64,
    /// Time of sending \[ns, CLOCK_BOOTTIME\].
    pub sent_ns: u64,
    /// Nominal sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Number of joints of the samples.
    pub joints: u32,
    /// Number of samples in use; see [`SampleBatch::samples`].
    pub count: u32,
    /// See [`BatchKind`].
    pub kind: u32,
    /// Padding that keeps the samples aligned; zero.
    pub reserved: u32,
    /// Sample slots, `count` of them in use.
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
    /// Returns the samples in use.
    pub fn samples(&self) -> &[StreamSample] {
        let count = usize::try_from(self.count).unwrap_or(usize::MAX).min(BATCH_SAMPLES);
        self.slots.get(..count).unwrap_or_default()
    }

    /// Returns the kind of the batch.
    pub fn kind(&self) -> BatchKind {
        BatchKind::from_code(self.kind)
    }
}

/// Progress of a replay reader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "linux", derive(ZeroCopySend), type_name("didim.Acknowledgement.v1"))]
pub(super) struct Acknowledgement {
    /// Session whose batches are acknowledged.
    pub(super) session: u64,
    /// Number of batches of the session that the reader has finished.
    pub(super) batches: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_of_the_largest_arm_comes_back() {
        let mut sample = JointSample::zero(3, 4);
        let last = MAX_JOINTS - 1;
        sample.motor_position_rad[last] = 0.5;
        sample.motor_torque_nm[last] = -2.0;
        sample.motor_reference_rad[last] = 0.25;
        sample.has_reference = true;
        sample.readings.set(Reading::Temperature, last, 40.0);
        sample.readings.set(Reading::TorqueTarget, 0, 1.0);
        let back = StreamSample::new(&sample, 7, 8).joint_sample();
        assert_eq!(back, sample);
        assert_eq!(back.readings.get(Reading::Temperature, last), Some(400));
    }
}
