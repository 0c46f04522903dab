//! From recorded signals to the motion and the torque that enter the equation (paper, 3.1.1).

use nalgebra::{DMatrix, DVector};

use crate::MAX_JOINTS;
use crate::dispatch::vectorised;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::options::PositionFilter;
use crate::identification::observation::filtered_positions::FilteredPositions;
use crate::lanes::{self, Lanes};
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
pub(crate) const GROUP: usize = lanes::WIDTH;

/// q, q̇ and q̈ of every joint at so many consecutive samples.
pub(crate) struct MotionGroup {
    joints: usize,
    quantities: [[Lanes<GROUP>; MAX_JOINTS]; 3],
}

impl MotionGroup {
    pub(crate) fn of_joints(joints: usize) -> Self {
        Self { joints, quantities: [[Lanes([0.0; GROUP]); MAX_JOINTS]; 3] }
    }

    /// From sample `first` of a motion on; beyond the last sample they are those of the last.
    pub(crate) fn read(&mut self, motion: &Motion, first: usize) -> [&[Lanes<GROUP>]; 3] {
        let signals = [&motion.position, &motion.velocity, &motion.acceleration];
        for (quantity, signals) in self.quantities.iter_mut().zip(signals) {
            let samples = signals.nrows();
            for (lanes, signal) in quantity.iter_mut().zip(signals.as_slice().chunks(samples)) {
                *lanes = group_of(signal, first);
            }
        }
        self.of_the_joints()
    }

    /// The same of filtered positions: [`filtered_motion`] has these numbers, to the last bit.
    pub(crate) fn differentiate(
        &mut self,
        positions: &FilteredPositions,
        first: usize,
    ) -> [&[Lanes<GROUP>]; 3] {
        let last = positions.samples() - 1;
        let [q, dq, ddq] = &mut self.quantities;
        vectorised(
            #[inline(always)]
            || {
                for l in 0..GROUP {
                    let k = (first + l).min(last);
                    let sample =
                        [positions.position(k), positions.velocity(k), positions.acceleration(k)];
                    for j in 0..MAX_JOINTS {
                        q[j].0[l] = sample[0][j];
                        dq[j].0[l] = sample[1][j];
                        ddq[j].0[l] = sample[2][j];
                    }
                }
            },
        );
        self.of_the_joints()
    }

    fn of_the_joints(&self) -> [&[Lanes<GROUP>]; 3] {
        self.quantities.each_ref().map(|quantity| &quantity[..self.joints])
    }
}

/// The samples of a signal from `first` on; beyond the last sample, the last.
#[inline(always)]
pub(crate) fn group_of(signal: &[f64], first: usize) -> Lanes<GROUP> {
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
    let mut positions = FilteredPositions::of(experiment);
    positions.filter(experiment, filter)?;
    let position = positions.joint_after_joint(experiment.joints());
    let velocity = derivatives(&position, rate, "position")?;
    let acceleration = derivatives(&velocity, rate, "position")?;
    Ok(Motion { position, velocity, acceleration })
}

/// The [`central_difference`] of every joint's signal.
fn derivatives(
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
pub(crate) fn delayed_torque(
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
pub(crate) fn row_filter(decimation: &ParallelDecimation, rows: usize) -> RowFilter {
    let passband = decimation.cutoff_ratio().min(1.0);
    RowFilter::new(rows, passband, |ratio| decimation.noise_power(ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identification::Signals;

    #[test]
    fn velocities_and_accelerations_where_they_are_asked_for_are_those_of_the_motion() {
        for samples in [16, 17, 18, 31] {
            let signal = |joint: usize| -> Vec<f64> {
                (0..samples).map(|k| ((k * 37 + joint * 11) % 23) as f64 / 23.0).collect()
            };
            let signals = Signals {
                sample_rate_hz: 300.0,
                position_rad: vec![signal(0), signal(1)],
                torque_nm: vec![signal(2), signal(3)],
                reference_rad: None,
            };
            let experiment = Experiment::joint_side(&signals).unwrap();
            let filter = PositionFilter { order: 4, cutoff_hz: 60.0 };
            let motion = filtered_motion(&experiment, &filter).unwrap();
            let mut positions = FilteredPositions::of(&experiment);
            positions.filter(&experiment, &filter).unwrap();
            let (mut of_motion, mut of_positions) =
                (MotionGroup::of_joints(2), MotionGroup::of_joints(2));
            for first in (0..samples).chain([0]) {
                let found = of_positions.differentiate(&positions, first);
                assert_eq!(found, of_motion.read(&motion, first), "{first} of {samples}");
            }
        }
    }
}
