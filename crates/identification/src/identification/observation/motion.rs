//! Measured motion, filtered and differentiated (paper, section 3.1.1).

use nalgebra::DMatrix;

use super::filtered_positions::FilteredPositions;
use super::hysteresis::{hysteresis_along, hysteresis_from};
use crate::identification::problem::{Experiment, IdentificationError, PositionFilter};
use crate::signal::{Group, SignalError, difference_neighbours, group_of};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::numeric::{Lanes, WIDTH};
use didim_dynamics::robot::{Hysteresis, JointIndex, Robot};
use didim_dynamics::simulation::set_row;

/// Joint positions, velocities and accelerations on one time grid, each samples × joints \[rad,
/// rad/s, rad/s²; m, m/s, m/s² for a prismatic joint\].
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Positions q.
    pub position: DMatrix<f64>,
    rates: Rates,
    /// Hysteresis state of friction at each sample. Empty without hysteresis or without a history.
    hysteresis: Vec<[f64; MAX_JOINTS]>,
}

/// Velocities q̇ and accelerations q̈.
#[derive(Clone, Debug, PartialEq)]
enum Rates {
    /// Stored matrices.
    Provided([DMatrix<f64>; 2]),
    /// Central differences of the positions, separately for each recording, computed on request.
    /// Storing them would take twice the memory of the positions.
    Differences {
        rate_hz: f64,
        /// End of each recording, including the last.
        ends: Vec<usize>,
    },
}

impl Motion {
    /// Creates a motion from matrices of samples × joints. The hysteresis of friction is assumed to
    /// be saturated in every state.
    ///
    /// # Panics
    /// When the matrices differ in size.
    pub fn from_matrices(
        position: DMatrix<f64>,
        velocity: DMatrix<f64>,
        acceleration: DMatrix<f64>,
    ) -> Self {
        assert!(position.shape() == velocity.shape() && position.shape() == acceleration.shape());
        Self { position, rates: Rates::Provided([velocity, acceleration]), hysteresis: Vec::new() }
    }

    /// Returns q̇ of a joint at a sample.
    pub fn velocity(&self, sample: usize, joint: usize) -> f64 {
        match &self.rates {
            Rates::Provided([velocity, _]) => velocity[(sample, joint)],
            Rates::Differences { rate_hz, ends } => {
                let position = |k: usize| self.position[(k, joint)];
                difference_at(*rate_hz, ends, sample, position)
            }
        }
    }

    /// Returns q̈ of a joint at a sample.
    pub fn acceleration(&self, sample: usize, joint: usize) -> f64 {
        match &self.rates {
            Rates::Provided([_, acceleration]) => acceleration[(sample, joint)],
            Rates::Differences { rate_hz, ends } => {
                difference_at(*rate_hz, ends, sample, |k| self.velocity(k, joint))
            }
        }
    }

    /// Returns q, q̇ and q̈ as matrices, samples × joints each.
    pub fn matrices(&self) -> [DMatrix<f64>; 3] {
        let (samples, joints) = self.position.shape();
        let matrix_of =
            |value: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(samples, joints, value);
        let velocity = matrix_of(&|k, joint| self.velocity(k, joint));
        let acceleration = matrix_of(&|k, joint| self.acceleration(k, joint));
        [self.position.clone(), velocity, acceleration]
    }

    /// Sets the state of all joints at a sample, and the hysteresis state of friction. The rates
    /// are stored in memory from then on.
    pub(crate) fn set_sample(
        &mut self,
        sample: usize,
        quantities: [&[f64; MAX_JOINTS]; 3],
        hysteresis: Option<[f64; MAX_JOINTS]>,
    ) {
        debug_assert_eq!(hysteresis.is_some(), !self.hysteresis.is_empty(), "of one robot");
        if let (Some(shares), Some(to)) = (hysteresis, self.hysteresis.get_mut(sample)) {
            *to = shares;
        }
        if let Rates::Differences { .. } = self.rates {
            let [_, velocity, acceleration] = self.matrices();
            self.rates = Rates::Provided([velocity, acceleration]);
        }
        if let Rates::Provided([velocity, acceleration]) = &mut self.rates {
            let matrices = [&mut self.position, velocity, acceleration];
            for (matrix, values) in matrices.into_iter().zip(quantities) {
                set_row(matrix, sample, values);
            }
        }
    }

    /// Returns q of all joints at a sample.
    pub(crate) fn position_at(&self, sample: usize) -> [f64; MAX_JOINTS] {
        of_sample(&self.position, sample)
    }

    /// Returns the hysteresis state of friction at a sample, −1 to 1; `None` without hysteresis or
    /// without a history.
    pub fn hysteresis_at(&self, sample: usize) -> Option<[f64; MAX_JOINTS]> {
        self.hysteresis.get(sample).copied()
    }

    /// Returns the hysteresis state at some samples from `first` on. Beyond the last sample it is
    /// that of the last.
    pub(super) fn hysteresis(&self, first: usize) -> Option<[Group; MAX_JOINTS]> {
        hysteresis_from(&self.hysteresis, first)
    }

    /// Returns q, q̇ and q̈ of a joint at some samples from `first` on. Beyond the last sample they
    /// are those of the last.
    #[inline(always)]
    pub(super) fn joint_groups(&self, joint: usize, first: usize) -> [Group; 3] {
        let samples = self.position.nrows();
        let column = |of: &'_ DMatrix<f64>| group_of(of_joint(of, joint), first);
        let (rate_hz, ends) = match &self.rates {
            Rates::Provided([velocity, acceleration]) => {
                return [&self.position, velocity, acceleration].map(column);
            }
            Rates::Differences { rate_hz, ends } => (*rate_hz, ends),
        };
        let inside = ends.iter().all(|end| first >= end + 2 || first + WIDTH + 2 <= *end);
        let around = first
            .checked_sub(2)
            .filter(|_| inside)
            .and_then(|from| of_joint(&self.position, joint).get(from..from + WIDTH + 4));
        let Some(q) = around else {
            let nearest = |l: usize| (first + l).min(samples - 1);
            return [
                column(&self.position),
                Lanes::from_fn(|l| self.velocity(nearest(l), joint)),
                Lanes::from_fn(|l| self.acceleration(nearest(l), joint)),
            ];
        };
        let factor = 0.5 * rate_hz;
        let dq: [f64; WIDTH + 2] = core::array::from_fn(|k| (q[k + 2] - q[k]) * factor);
        [
            Lanes::from_fn(|l| q[l + 2]),
            Lanes::from_fn(|l| dq[l + 1]),
            Lanes::from_fn(|l| (dq[l + 2] - dq[l]) * factor),
        ]
    }
}

/// Returns the [`central_difference`](crate::signal::central_difference) at one sample, within its
/// recording.
fn difference_at(rate_hz: f64, ends: &[usize], sample: usize, value: impl Fn(usize) -> f64) -> f64 {
    let recording = ends.partition_point(|end| *end <= sample);
    let start = recording.checked_sub(1).map_or(0, |before| ends[before]);
    let (before, after, factor) =
        difference_neighbours(sample - start, ends[recording] - start, rate_hz);
    (value(start + after) - value(start + before)) * factor
}

fn of_sample(matrix: &DMatrix<f64>, sample: usize) -> [f64; MAX_JOINTS] {
    let mut values = [0.0; MAX_JOINTS];
    values.iter_mut().zip(matrix.row(sample).iter()).for_each(|(to, from)| *to = *from);
    values
}

fn of_joint(matrix: &DMatrix<f64>, joint: usize) -> &[f64] {
    &matrix.as_slice()[joint * matrix.nrows()..(joint + 1) * matrix.nrows()]
}

/// Returns the motion of a robot in an experiment: positions filtered with zero phase over the
/// whole record, then central differences twice.
///
/// # Errors
/// [`IdentificationError::PositionFilter`] and [`IdentificationError::Signal`].
pub fn filtered_motion(
    robot: &Robot,
    experiment: &Experiment,
    filter: &PositionFilter,
) -> Result<Motion, IdentificationError> {
    let mut positions = FilteredPositions::with_zeros(experiment);
    positions.filter(experiment, filter)?;
    motion_along(robot, experiment, positions.joint_after_joint(experiment.joints()))
}

/// Returns the motion of a robot from the positions of an experiment's samples (samples × joints).
///
/// # Errors
/// [`IdentificationError::Signal`].
pub(crate) fn motion_along(
    robot: &Robot,
    experiment: &Experiment,
    position: DMatrix<f64>,
) -> Result<Motion, IdentificationError> {
    let recordings = experiment.recordings();
    let failed = |joint: usize, cause| {
        Err(IdentificationError::Signal {
            signal: "position",
            joint: JointIndex::new(joint),
            cause,
        })
    };
    for samples in recordings.iter().map(|of| of.samples.clone()) {
        if samples.len() < 2 {
            let cause = SignalError::TooShort { samples: samples.len(), needed: 2 };
            return failed(0, cause.later_by(samples.start));
        }
    }
    let ends = experiment.ends();
    let hysteresis =
        hysteresis_along(Hysteresis::from_robot(robot), &ends, |k| of_sample(&position, k));
    let rates = Rates::Differences { rate_hz: experiment.sample_rate_hz(), ends };
    let motion = Motion { position, rates, hysteresis };
    for joint in 0..experiment.joints() {
        let signal = of_joint(&motion.position, joint);
        // An overflow occurs in the second difference.
        let finite =
            |k: &usize| signal[*k].is_finite() && motion.acceleration(*k, joint).is_finite();
        if let Some(index) = (0..signal.len()).find(|k| !finite(k)) {
            return failed(joint, SignalError::NotFinite { index });
        }
    }
    Ok(motion)
}
