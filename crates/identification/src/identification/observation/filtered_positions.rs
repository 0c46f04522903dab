//! Filtered positions, with velocities and accelerations on request.

use nalgebra::DMatrix;

use super::hysteresis::{hysteresis_along, hysteresis_from};
use crate::identification::problem::{Experiment, IdentificationError, PositionFilter};
use crate::signal::{Group, difference_neighbours};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::numeric::from_lanes;
use didim_dynamics::robot::{Hysteresis, JointIndex, Robot};

/// Filtered positions of every joint, sample by sample. Velocities and accelerations are computed
/// on request, because allocating memory for all of them takes longer than computing them.
pub(crate) struct FilteredPositions {
    rate_hz: f64,
    /// End of each recording, including the last.
    recording_ends: Vec<usize>,
    /// Position of each joint at every sample \[rad or m\]; 0 beyond the number of joints.
    samples: Vec<[f64; MAX_JOINTS]>,
    /// Hysteresis state of friction along the positions. Empty if not requested, or without
    /// hysteresis.
    hysteresis: Vec<[f64; MAX_JOINTS]>,
}

impl FilteredPositions {
    /// Allocates the positions of an experiment, all 0.
    pub(crate) fn with_zeros(experiment: &Experiment) -> Self {
        let samples = vec![[0.0; MAX_JOINTS]; experiment.samples()];
        let (rate_hz, ends) = (experiment.sample_rate_hz(), experiment.ends());
        Self { rate_hz, recording_ends: ends, samples, hysteresis: Vec::new() }
    }

    /// Filters the positions of the experiment with zero phase, each recording over its whole
    /// length.
    ///
    /// # Errors
    /// [`IdentificationError::PositionFilter`] and [`IdentificationError::Signal`].
    pub(crate) fn filter(
        &mut self,
        experiment: &Experiment,
        filter: &PositionFilter,
    ) -> Result<(), IdentificationError> {
        self.hysteresis.clear();
        let sections = filter.design(self.rate_hz).map_err(IdentificationError::PositionFilter)?;
        side_by_side(experiment.position_rad(), &mut self.samples);
        let mut start = 0;
        for &end in &self.recording_ends {
            sections
                .filter_zero_phase_lanes(&mut self.samples[start..end], sections.default_padding())
                .map_err(|cause| IdentificationError::Signal {
                    signal: "position",
                    joint: JointIndex::new(0),
                    cause: cause.later_by(start),
                })?;
            start = end;
        }
        Ok(())
    }

    /// Tracks the hysteresis of a robot's friction along the filtered positions.
    pub(crate) fn track_hysteresis(&mut self, robot: &Robot) {
        self.hysteresis =
            hysteresis_along(Hysteresis::from_robot(robot), &self.recording_ends, |k| {
                self.samples[k]
            });
    }

    /// Returns the hysteresis state at some samples from `first` on.
    pub(super) fn hysteresis(&self, first: usize) -> Option<[Group; MAX_JOINTS]> {
        hysteresis_from(&self.hysteresis, first)
    }

    /// Returns the number of samples.
    pub(crate) fn samples(&self) -> usize {
        self.samples.len()
    }

    /// Returns the positions of this number of joints, samples × joints.
    pub(crate) fn joint_after_joint(&self, joints: usize) -> DMatrix<f64> {
        one_after_the_other(&self.samples, joints)
    }

    /// Returns q of a sample.
    #[inline(always)]
    pub(crate) fn position(&self, sample: usize) -> [f64; MAX_JOINTS] {
        self.samples[sample]
    }

    /// Returns q̇ of a sample.
    #[inline(always)]
    pub(crate) fn velocity(&self, sample: usize) -> [f64; MAX_JOINTS] {
        self.derivative(sample, Self::position)
    }

    /// Returns q̈ of a sample.
    #[inline(always)]
    pub(crate) fn acceleration(&self, sample: usize) -> [f64; MAX_JOINTS] {
        self.derivative(sample, Self::velocity)
    }

    /// Returns the [`central_difference`](crate::signal::central_difference) of all joints at one
    /// sample.
    #[inline(always)]
    fn derivative(
        &self,
        sample: usize,
        value: impl Fn(&Self, usize) -> [f64; MAX_JOINTS],
    ) -> [f64; MAX_JOINTS] {
        // Most experiments have one recording.
        let (start, end) = match self.recording_ends.as_slice() {
            [end] => (0, *end),
            ends => {
                let recording = ends.partition_point(|end| *end <= sample);
                let start = recording.checked_sub(1).map_or(0, |before| ends[before]);
                (start, ends[recording])
            }
        };
        let (before, after, factor) =
            difference_neighbours(sample - start, end - start, self.rate_hz);
        let (before, after) = (value(self, start + before), value(self, start + after));
        from_lanes(
            #[inline(always)]
            |joint| (after[joint] - before[joint]) * factor,
        )
    }
}

/// Number of samples that are transposed at once between the layouts joint by joint and sample by
/// sample. They fit in the nearest cache.
const CACHED_SAMPLES: usize = 64;

/// Writes the joints' signals sample by sample.
fn side_by_side(signals: &DMatrix<f64>, lanes: &mut [[f64; MAX_JOINTS]]) {
    for (block, lanes) in lanes.chunks_mut(CACHED_SAMPLES).enumerate() {
        for (joint, signal) in signals.column_iter().enumerate() {
            for (lanes, value) in lanes.iter_mut().zip(&signal.as_slice()[block * CACHED_SAMPLES..])
            {
                lanes[joint] = *value;
            }
        }
    }
}

/// Returns the signals of this number of joints, samples × joints.
fn one_after_the_other(lanes: &[[f64; MAX_JOINTS]], joints: usize) -> DMatrix<f64> {
    let mut signals = DMatrix::zeros(lanes.len(), joints);
    for (block, lanes) in lanes.chunks(CACHED_SAMPLES).enumerate() {
        for (joint, mut signal) in signals.column_iter_mut().enumerate() {
            let signal = &mut signal.as_mut_slice()[block * CACHED_SAMPLES..];
            for (value, lanes) in signal.iter_mut().zip(lanes) {
                *value = lanes[joint];
            }
        }
    }
    signals
}
