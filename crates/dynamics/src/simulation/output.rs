//! Output of a simulation.

use nalgebra::DMatrix;

use crate::{MAX_JOINTS, Signals};

/// All quantities at one sample; entries beyond the arm's joints are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepOutput {
    /// Number of the sample, from 0.
    pub index: u64,
    /// Its time \[s\].
    pub time_s: f64,
    /// Measured motor angles \[rad\], with noise and on the encoders' grid.
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// The joint positions that follow from them \[rad\].
    pub joint_position_rad: [f64; MAX_JOINTS],
    /// The torque command computed at this sample, motor side \[N·m\], as the log
    /// has it: with measurement noise and an unmodelled gain.
    pub motor_torque_nm: [f64; MAX_JOINTS],
    /// The same on the joint side \[N·m\].
    pub joint_torque_nm: [f64; MAX_JOINTS],
    /// Reference, motor side \[rad\].
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// Reference, joint side \[rad\].
    pub joint_reference_rad: [f64; MAX_JOINTS],
    /// True joint positions \[rad\].
    pub true_position_rad: [f64; MAX_JOINTS],
    /// True joint velocities \[rad/s\].
    pub true_velocity_rad_s: [f64; MAX_JOINTS],
    /// True joint accelerations just after the sample \[rad/s²\]; with a sampled controller they
    /// jump at the samples.
    pub true_acceleration_rad_s2: [f64; MAX_JOINTS],
    /// The torque on the joints just after the sample, including the disturbance and less the
    /// unmodelled torques: friction, ripple, flexible parts \[N·m\].
    pub true_torque_nm: [f64; MAX_JOINTS],
    /// Hysteresis of the model's friction, −1 to 1; `None` without any.
    pub hysteresis: Option<[f64; MAX_JOINTS]>,
}

/// Many samples: one row per sample, one column per joint or motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Measured motor angles \[rad\].
    pub motor_position_rad: DMatrix<f64>,
    /// Measured joint positions \[rad\].
    pub joint_position_rad: DMatrix<f64>,
    /// Logged motor torque commands \[N·m\].
    pub motor_torque_nm: DMatrix<f64>,
    /// Logged joint torque commands \[N·m\].
    pub joint_torque_nm: DMatrix<f64>,
    /// Motor references \[rad\].
    pub motor_reference_rad: DMatrix<f64>,
    /// Joint references \[rad\].
    pub joint_reference_rad: DMatrix<f64>,
    /// True joint positions \[rad\].
    pub true_position_rad: DMatrix<f64>,
    /// True joint velocities \[rad/s\].
    pub true_velocity_rad_s: DMatrix<f64>,
    /// True joint accelerations just after each sample \[rad/s²\].
    pub true_acceleration_rad_s2: DMatrix<f64>,
}

impl Record {
    pub(super) fn zeros(sample_rate_hz: f64, samples: usize, joints: usize) -> Self {
        let zeros = || DMatrix::zeros(samples, joints);
        Self {
            sample_rate_hz,
            motor_position_rad: zeros(),
            joint_position_rad: zeros(),
            motor_torque_nm: zeros(),
            joint_torque_nm: zeros(),
            motor_reference_rad: zeros(),
            joint_reference_rad: zeros(),
            true_position_rad: zeros(),
            true_velocity_rad_s: zeros(),
            true_acceleration_rad_s2: zeros(),
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.joint_position_rad.nrows()
    }

    /// Returns the motor-side signals as in a log, with the reference.
    pub fn motor_signals(&self) -> Signals {
        let columns = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
        };
        Signals {
            sample_rate_hz: self.sample_rate_hz,
            position_rad: columns(&self.motor_position_rad),
            torque_nm: columns(&self.motor_torque_nm),
            reference_rad: Some(columns(&self.motor_reference_rad)),
        }
    }

    pub(super) fn set(&mut self, row: usize, output: &StepOutput) {
        for (matrix, values) in [
            (&mut self.motor_position_rad, &output.motor_position_rad),
            (&mut self.joint_position_rad, &output.joint_position_rad),
            (&mut self.motor_torque_nm, &output.motor_torque_nm),
            (&mut self.joint_torque_nm, &output.joint_torque_nm),
            (&mut self.motor_reference_rad, &output.motor_reference_rad),
            (&mut self.joint_reference_rad, &output.joint_reference_rad),
            (&mut self.true_position_rad, &output.true_position_rad),
            (&mut self.true_velocity_rad_s, &output.true_velocity_rad_s),
            (&mut self.true_acceleration_rad_s2, &output.true_acceleration_rad_s2),
        ] {
            set_row(matrix, row, values);
        }
    }
}

/// Writes one sample of signals (samples × joints).
pub fn set_row(signals: &mut DMatrix<f64>, sample: usize, values: &[f64; MAX_JOINTS]) {
    let samples = signals.nrows();
    // Equivalent to a view of the row, at a fraction of its cost.
    let entries = signals.as_mut_slice().iter_mut().skip(sample).step_by(samples);
    for (entry, value) in entries.zip(values) {
        *entry = *value;
    }
}
