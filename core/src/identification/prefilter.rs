//! From recorded signals to the motion and the torque that enter the equation (paper, 3.1.1).

use nalgebra::{DMatrix, DVector};

use super::error::IdentificationError;
use super::experiment::Experiment;
use super::options::PositionFilter;
use crate::MAX_JOINTS;
use crate::regression::RowFilter;
use crate::signal::{ParallelDecimation, central_difference, delay_linear};

/// Joint positions, velocities and accelerations on one grid, each samples × joints \[rad, rad/s,
/// rad/s²; m for a prismatic joint\].
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// q.
    pub position: DMatrix<f64>,
    /// q̇.
    pub velocity: DMatrix<f64>,
    /// q̈.
    pub acceleration: DMatrix<f64>,
}

impl Motion {
    /// q, q̇ and q̈ of sample `k`, 0 beyond the joints.
    pub(super) fn at(&self, k: usize) -> [[f64; MAX_JOINTS]; 3] {
        [&self.position, &self.velocity, &self.acceleration].map(|signals| sample(signals, k))
    }
}

/// Row `k`, 0 beyond the joints.
fn sample(signals: &DMatrix<f64>, k: usize) -> [f64; MAX_JOINTS] {
    let mut values = [0.0; MAX_JOINTS];
    for (joint, value) in values.iter_mut().enumerate().take(signals.ncols()) {
        *value = signals[(k, joint)];
    }
    values
}

/// The motion of an experiment: positions filtered without phase over the whole record, then
/// central differences twice.
///
/// # Errors
/// [`IdentificationError::PositionFilter`] and [`IdentificationError::Signal`].
pub fn filtered_motion(
    experiment: &Experiment,
    filter: &PositionFilter,
) -> Result<Motion, IdentificationError> {
    let rate = experiment.sample_rate_hz();
    let sections = filter.design(rate).map_err(IdentificationError::PositionFilter)?;
    let recorded = experiment.position_rad();
    let (samples, joints) = recorded.shape();
    let mut lanes: Vec<_> = (0..samples).map(|k| sample(recorded, k)).collect();
    let failed =
        |joint| move |cause| IdentificationError::Signal { signal: "position", joint, cause };
    sections.filter_zero_phase_lanes(&mut lanes, sections.default_padding()).map_err(failed(1))?;
    let position = DMatrix::from_fn(samples, joints, |k, joint| lanes[k][joint]);
    let mut velocity = DMatrix::zeros(samples, joints);
    let mut acceleration = velocity.clone();
    for joint in 0..joints {
        let q = position.column(joint);
        let dq = central_difference(q.as_slice(), rate).map_err(failed(joint + 1))?;
        let ddq = central_difference(&dq, rate).map_err(failed(joint + 1))?;
        velocity.column_mut(joint).copy_from_slice(&dq);
        acceleration.column_mut(joint).copy_from_slice(&ddq);
    }
    Ok(Motion { position, velocity, acceleration })
}

/// The measurements y of equation 7: torques moved to the instants of the positions, filtered, and
/// decimated, the rows of each joint together.
///
/// A value that acts late or is held is worth at an instant what was logged its mean delay before,
/// linear between samples: for a command held over one period, the mean of the command before and
/// after the instant.
///
/// At the very ends up to one sample may be missing, as the command before the first one; then the
/// nearest is taken. More would be a torque that nobody measured.
///
/// # Errors
/// [`IdentificationError::TorqueOutside`] and [`IdentificationError::Signal`].
pub fn filtered_torque(
    experiment: &Experiment,
    decimation: &ParallelDecimation,
) -> Result<DVector<f64>, IdentificationError> {
    let delay = experiment.torque_timing().mean_delay_s() * experiment.sample_rate_hz();
    delayed_torque(experiment, delay, decimation)
}

/// [`filtered_torque`] with a delay of the caller's choice \[samples\].
pub(super) fn delayed_torque(
    experiment: &Experiment,
    delay: f64,
    decimation: &ParallelDecimation,
) -> Result<DVector<f64>, IdentificationError> {
    check_inside(experiment, delay)?;
    let mut torque = experiment.torque_nm().clone();
    for (joint, mut logged) in (1..).zip(torque.column_iter_mut()) {
        let delayed = delay_linear(logged.as_slice(), delay)
            .map_err(|cause| IdentificationError::Signal { signal: "torque", joint, cause })?;
        logged.copy_from_slice(&delayed);
    }
    let rows = decimation
        .decimate_columns(&torque, experiment.counted())
        .map_err(|cause| IdentificationError::Signal { signal: "torque", joint: 1, cause })?;
    Ok(experiment.fitted_joints(decimation, rows))
}

/// Whether the record holds the torque of every counted sample, but for one at either end.
fn check_inside(experiment: &Experiment, shift_samples: f64) -> Result<(), IdentificationError> {
    let (counted, samples) = (experiment.counted(), experiment.samples());
    let first = counted.start as f64 - shift_samples;
    let last = counted.end as f64 - 1.0 - shift_samples;
    if first >= -1.0 && last <= samples as f64 {
        return Ok(());
    }
    Err(IdentificationError::TorqueOutside { shift_samples, counted, samples })
}

/// What the rows have passed.
pub(super) fn row_filter(decimation: &ParallelDecimation, rows: usize) -> RowFilter {
    let passband = decimation.cutoff_ratio().min(1.0);
    RowFilter::new(rows, passband, |ratio| decimation.noise_power(ratio))
}
