//! From recorded signals to the motion and the torque that enter the equation (paper, 3.1.1).

use nalgebra::{DMatrix, DVector};

use super::error::IdentificationError;
use super::experiment::Experiment;
use super::options::PositionFilter;
use crate::MAX_JOINTS;
use crate::lanes::Lanes;
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

/// Samples of a motion that go through the dynamics at once.
pub(super) const GROUP: usize = 4;

/// q, q̇ and q̈ of every joint at so many consecutive samples.
pub(super) struct MotionGroup {
    joints: usize,
    quantities: [[Lanes<GROUP>; MAX_JOINTS]; 3],
}

impl MotionGroup {
    pub(super) fn of_joints(joints: usize) -> Self {
        Self { joints, quantities: [[Lanes([0.0; GROUP]); MAX_JOINTS]; 3] }
    }

    /// From sample `first` of a motion on; beyond the last sample they are those of the last.
    pub(super) fn read(&mut self, motion: &Motion, first: usize) -> [&[Lanes<GROUP>]; 3] {
        let signals = [&motion.position, &motion.velocity, &motion.acceleration];
        for (quantity, signals) in self.quantities.iter_mut().zip(signals) {
            let samples = signals.nrows();
            for (lanes, signal) in quantity.iter_mut().zip(signals.as_slice().chunks(samples)) {
                *lanes = group_of(signal, first);
            }
        }
        let [q, dq, ddq] = &self.quantities;
        [&q[..self.joints], &dq[..self.joints], &ddq[..self.joints]]
    }
}

/// The samples of a signal from `first` on; beyond the last sample, the last.
#[inline(always)]
pub(super) fn group_of(signal: &[f64], first: usize) -> Lanes<GROUP> {
    match signal[first..].first_chunk() {
        Some(samples) => Lanes(*samples),
        None => Lanes::from_fn(|l| signal[(first + l).min(signal.len() - 1)]),
    }
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
    let joints = recorded.ncols();
    let mut lanes = side_by_side(recorded);
    let failed =
        |joint| move |cause| IdentificationError::Signal { signal: "position", joint, cause };
    sections.filter_zero_phase_lanes(&mut lanes, sections.default_padding()).map_err(failed(1))?;
    let position = one_after_the_other(&lanes, joints);
    let velocity = derivatives(&position, rate, "position")?;
    let acceleration = derivatives(&velocity, rate, "position")?;
    Ok(Motion { position, velocity, acceleration })
}

/// Samples that are turned from joint after joint to side by side while they are in the nearest cache.
const CACHED: usize = 64;

/// The joints' signals sample by sample, 0 beyond the joints.
fn side_by_side(signals: &DMatrix<f64>) -> Vec<[f64; MAX_JOINTS]> {
    let mut lanes = vec![[0.0; MAX_JOINTS]; signals.nrows()];
    for (block, lanes) in lanes.chunks_mut(CACHED).enumerate() {
        for (joint, signal) in signals.column_iter().enumerate() {
            for (lanes, value) in lanes.iter_mut().zip(&signal.as_slice()[block * CACHED..]) {
                lanes[joint] = *value;
            }
        }
    }
    lanes
}

/// The signals of so many joints, samples × joints.
fn one_after_the_other(lanes: &[[f64; MAX_JOINTS]], joints: usize) -> DMatrix<f64> {
    let mut signals = DMatrix::zeros(lanes.len(), joints);
    for (block, lanes) in lanes.chunks(CACHED).enumerate() {
        for (joint, mut signal) in signals.column_iter_mut().enumerate() {
            let signal = &mut signal.as_mut_slice()[block * CACHED..];
            for (value, lanes) in signal.iter_mut().zip(lanes) {
                *value = lanes[joint];
            }
        }
    }
    signals
}

/// The [`central_difference`] of every joint's signal.
pub(super) fn derivatives(
    signals: &DMatrix<f64>,
    rate_hz: f64,
    signal: &'static str,
) -> Result<DMatrix<f64>, IdentificationError> {
    let mut derivatives = DMatrix::zeros(signals.nrows(), signals.ncols());
    for (joint, (from, mut to)) in
        signals.column_iter().zip(derivatives.column_iter_mut()).enumerate()
    {
        central_difference(from.as_slice(), rate_hz, to.as_mut_slice())
            .map_err(|cause| IdentificationError::Signal { signal, joint: joint + 1, cause })?;
    }
    Ok(derivatives)
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
    let logged = experiment.torque_nm();
    let mut torque = Vec::with_capacity(logged.len());
    for (joint, logged) in (1..).zip(logged.column_iter()) {
        let delayed = delay_linear(logged.as_slice(), delay)
            .map_err(|cause| IdentificationError::Signal { signal: "torque", joint, cause })?;
        torque.extend(delayed);
    }
    let torque = DMatrix::from_vec(logged.nrows(), logged.ncols(), torque);
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
