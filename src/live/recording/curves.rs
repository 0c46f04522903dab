//! Joint curves of recorded frames, for viewers of robot data.

use std::io;

use didim_drivers::assemble::Assembler;
use didim_drivers::frame::Frame;
use didim_drivers::source::McapWriter;
use didim_drivers::source::mcap::{JointState, McapWriteError};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::Transmission;

/// Converter of frames into joint states. It makes samples from the frames like a replay does, and
/// writes the frames and the joint states.
#[derive(Clone, Debug)]
pub struct JointCurves {
    assembler: Assembler,
    transmission: Transmission,
    names: Vec<String>,
}

impl JointCurves {
    /// Creates the curves from an assembler that has not processed frames yet, and one name per
    /// joint.
    pub fn new(assembler: Assembler, transmission: Transmission, names: Vec<String>) -> Self {
        Self { assembler, transmission, names }
    }

    /// Returns the names of the joints in the file.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Writes a frame and the joint state that it completes.
    ///
    /// # Errors
    /// [`McapWriteError`].
    pub fn write<W: io::Write>(
        &mut self,
        frame: &Frame,
        sequence: u32,
        writer: &mut McapWriter<W>,
    ) -> Result<(), McapWriteError> {
        writer.write(frame, sequence)?;
        self.assembler.handle_frame(frame);
        self.write_state(writer)
    }

    /// Writes the joint state of the last cycle.
    ///
    /// # Errors
    /// The same as [`Self::write`].
    pub fn finish<W: io::Write>(
        &mut self,
        writer: &mut McapWriter<W>,
    ) -> Result<(), McapWriteError> {
        self.assembler.handle_timeout(u64::MAX);
        self.write_state(writer)
    }

    fn write_state<W: io::Write>(
        &mut self,
        writer: &mut McapWriter<W>,
    ) -> Result<(), McapWriteError> {
        let Some(sample) = self.assembler.poll_sample() else { return Ok(()) };
        let joints = self.names.len();
        let [mut position, mut effort] = [[0.0; MAX_JOINTS]; 2];
        let (position, effort) = (&mut position[..joints], &mut effort[..joints]);
        self.transmission.joint_position(&sample.motor_position_rad[..joints], position);
        self.transmission.joint_torque(&sample.motor_torque_nm[..joints], effort);
        writer.write_joints(&JointState {
            stamp_ns: sample.stamp_ns,
            sequence: sample.sequence,
            position,
            effort,
        })
    }

    /// Returns the maximum file size of the joint states over this duration \[bytes\].
    pub(super) fn bytes(&self, duration_ns: u64) -> u64 {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a cast saturates, and the bound is no less for it"
        )]
        let cycles = (duration_ns as f64 / self.assembler.layout().period_ns()) as u64;
        // Cycles may be shorter than their nominal period.
        let cycles = cycles.saturating_add(cycles / 8).saturating_add(2);
        cycles.saturating_mul(McapWriter::<Vec<u8>>::joints_bytes(&self.names))
    }
}
