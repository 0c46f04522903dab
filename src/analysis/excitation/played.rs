//! Simulated recording of a motion that the arm of a cell follows exactly.

use didim_dynamics::dynamics::{BaseParameters, BaseParametersError, Model};
use didim_dynamics::trajectory::{Reference, SampledReference, TrajectoryError};
use didim_dynamics::{MAX_JOINTS, Signals};
use didim_formats::{Measurement, MotionPoints, Side};
use didim_identification::excitation::{Course, State, TorqueNoise, simulate_motion};

use super::assignment::{AssignmentError, assumed_noise};
use crate::cell::Cell;

/// Error when a motion cannot be played. The inner errors state the remedy.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The robot has no nominal parameters, so that there is nothing to simulate.
    #[error(
        "the robot `{robot}` has no nominal parameters: there is nothing to simulate; state masses \
         and inertias in its file"
    )]
    NoNominal {
        /// Name of the robot.
        robot: String,
    },
    /// The motion is of another number of joints.
    #[error("the motion has {found} joints, the robot `{robot}` has {expected}")]
    Joints {
        /// Name of the robot.
        robot: String,
        /// Number of its joints.
        expected: usize,
        /// Number of joints in the motion.
        found: usize,
    },
    /// The motion is too long.
    #[error("{duration_s:.4e} s are longer than the longest simulated motion of {MAX_MOTION_S} s")]
    TooLong {
        /// Its duration \[s\].
        duration_s: f64,
    },
    /// The points are no motion.
    #[error(transparent)]
    Motion(#[from] TrajectoryError),
    /// The base parameters of the robot cannot be computed.
    #[error(transparent)]
    Base(#[from] BaseParametersError),
    /// The noise is a share of the torque limits, and one of them is unknown.
    #[error(transparent)]
    Noise(#[from] AssignmentError),
}

/// Longest motion \[s\]. Convention, as for scenarios: ten times the longest window of the shipped
/// cells.
const MAX_MOTION_S: f64 = 600.0;
/// Rest before and after the motion \[s\]. Convention: the filters need a margin.
const REST_S: f64 = 1.0;

/// A simulated recording with the true parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayedMotion {
    /// Joint-side signals, at the cell's rate, with a second of rest at both ends.
    pub measurement: Measurement,
    /// True base parameters: name and value in SI units.
    pub truth: Vec<(String, f64)>,
}

impl PlayedMotion {
    /// Plays a motion on the robot of a cell. The torques are those of its nominal parameters, with
    /// the white noise that `didim design` assumes without a result.
    ///
    /// # Errors
    /// [`PlayError`].
    pub fn new(cell: &Cell, points: &MotionPoints, seed: u64) -> Result<Self, PlayError> {
        let robot = &cell.robot_as_described;
        let name = || robot.name().to_owned();
        let reference = SampledReference::new(points.rate_hz, &points.positions)?;
        let motion = PointCourse { reference, step_s: points.rate_hz.recip() };
        let (expected, found, duration_s) = (robot.joints(), motion.joints(), motion.duration_s());
        if found != expected {
            return Err(PlayError::Joints { robot: name(), expected, found });
        }
        if duration_s > MAX_MOTION_S {
            return Err(PlayError::TooLong { duration_s });
        }
        let no_nominal = || PlayError::NoNominal { robot: name() };
        let nominal = robot.nominal().ok_or_else(no_nominal)?;
        let base = BaseParameters::compute(&Model::new(robot))?;
        let true_values = base.to_base(nominal.standard_parameters());
        let truth = base.names().iter().cloned().zip(true_values).collect();
        // The torques lack what the cell excludes.
        let excluded_terms = cell.robot.recorded_torque().excluded_terms();
        let reported = robot.clone().without_torque_terms(excluded_terms);
        let reported_nominal = reported.nominal().ok_or_else(no_nominal)?;
        let (model, parameters) = (Model::new(&reported), reported_nominal.standard_parameters());
        let sample_rate_hz = cell.sample_rate_hz();
        let noise = TorqueNoise { deviations: sample_noise(cell)?, seed };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a second")]
        let rest = (REST_S * sample_rate_hz) as usize;
        let times = (sample_rate_hz, rest);
        let [position_rad, torque_nm] =
            simulate_motion((&model, parameters), &motion, times, &noise);
        let signals = Signals { sample_rate_hz, position_rad, torque_nm, reference_rad: None };
        let measurement = Measurement { side: Side::Joint, signals, rate_unchecked: false };
        Ok(Self { measurement, truth })
    }
}

/// Returns the noise of a sample's torque, by joint \[N·m or N\]. A row is the mean of as many
/// independent samples as the decimation filter joins.
fn sample_noise(cell: &Cell) -> Result<Vec<f64>, AssignmentError> {
    #[expect(clippy::cast_precision_loss, reason = "samples of a row")]
    let samples_per_row = cell.options.decimation_filter.factor as f64;
    let noise = assumed_noise(&cell.robot_as_described)?.into_iter();
    Ok(noise.map(|of_row| of_row * samples_per_row.sqrt()).collect())
}

/// Motion through points. Velocities and accelerations are central differences over the points.
struct PointCourse {
    reference: SampledReference,
    /// Distance of the points \[s\].
    step_s: f64,
}

impl PointCourse {
    fn position(&self, time_s: f64) -> [f64; MAX_JOINTS] {
        let n = self.reference.joints();
        let [mut position, mut velocity, mut acceleration] = [[0.0; MAX_JOINTS]; 3];
        let (q, dq, ddq) = (&mut position[..n], &mut velocity[..n], &mut acceleration[..n]);
        self.reference.evaluate(time_s, q, dq, ddq);
        position
    }
}

impl Reference for PointCourse {
    fn joints(&self) -> usize {
        self.reference.joints()
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        self.state(time_s).copy_to(self.joints(), position, velocity, acceleration);
    }
}

impl Course for PointCourse {
    fn duration_s(&self) -> f64 {
        self.reference.duration_s()
    }

    fn state(&self, time_s: f64) -> State {
        let step_s = self.step_s;
        let [before, position, after] =
            [time_s - step_s, time_s, time_s + step_s].map(|time_s| self.position(time_s));
        let mut state = State { position, ..State::default() };
        for joint in 0..self.joints() {
            let [a, b, c] = [before[joint], position[joint], after[joint]];
            state.velocity[joint] = (c - a) / (2.0 * step_s);
            state.acceleration[joint] = (c - 2.0 * b + a) / step_s.powi(2);
        }
        state
    }
}
