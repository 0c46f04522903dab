//! Comparison of the described controller with the recorded one.
//!
//! A controller computes its command from the reference and the measured position, and all three
//! are recorded. The command of the described law equals the recorded command, except for noise of
//! the recording and within the tolerances of the torque's gain and delay. Noise is independent of
//! the motion, but the error of a wrong law is not. So the part of the difference that the motion
//! explains has a size, and a probability that noise alone explains as much.

use core::ops::Range;
use didim_dynamics::robot::JointIndex;

use nalgebra::{DMatrix, DVector};

use super::super::reasons::ControllerUnchecked;
use super::{ControllerError, Difference, FittedModel};
use crate::identification::observation::{
    InverseDynamics, MotionGroup, delay_samples, find_reference, motion_along,
};
use crate::identification::problem::{Context, IdentificationError, Tolerances};
use crate::regression::{Observations, RegressionError, ResidualAnalysis, RowFilter};
use crate::signal::{Group, central_difference, group_of};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::control::{
    ContinuousController, ControlLaw, ControlTiming, ControllerConfig, SampledController, Setpoint,
    SimulatedController,
};
use didim_dynamics::simulation::{SetupError, set_row};
use didim_dynamics::trajectory::Reference;

/// Two periods this close, relative to each other, are the same: rates are written with few digits.
const SAME_PERIOD: f64 = 1e-6;

/// Gain and delay explain an error where they leave this share of the limit at most: other gains of
/// a controller look much like another torque gain.
const LEFT: f64 = 0.1;

/// A signal of which others leave no more than this share says nothing more.
const SAME_SIGNAL: f64 = 1e-6;

impl FittedModel<'_> {
    /// Returns for each joint the part of `F(τ_law − τ)` that the motion explains, relative to
    /// `‖F τ‖`, both filtered and decimated. A gain and a delay of the recorded torque within their
    /// tolerances are no error of the law. Samples with outliers do not count.
    ///
    /// The motion is that of the reference, which has no noise. Its signals are the inputs of a
    /// linear law: positions and speeds of all joints, whose shares a wrong scale, zero or order of
    /// the axes changes; the torques that the estimate predicts for them and the rate of the
    /// joint's own torque, which wrong gains multiply; the joint's acceleration, and the integral
    /// of its tracking error, in which noise averages out. With an integrating law, also the
    /// integral of the joint's position and the time.
    pub(super) fn controller_error(&self) -> Result<ControllerError, IdentificationError> {
        let (context, n) = (self.context, self.context.robot.joints());
        let Some(controller) = &context.options.controller else {
            return Ok(ControllerError::NotDescribed);
        };
        // Gains that follow an estimate are the cabinet's own where the estimate is the truth.
        let SimulatedController::Cabinet { timing, joints, .. } = controller else {
            return Ok(ControllerError::Unknown(ControllerUnchecked::StandIn));
        };
        let config = ControllerConfig { timing: *timing, joints: joints.clone() };
        if config.joints.len() != n || config.validate().is_err() {
            return Ok(ControllerError::NotDescribed);
        }
        let Some(references) = context.experiment.reference_rad() else {
            return Ok(ControllerError::Unknown(ControllerUnchecked::NoReference));
        };
        let [mut described, mut recorded, lag] = match commands(context, references, &config)? {
            Ok(commands) => commands,
            Err(why) => return Ok(ControllerError::Unknown(why)),
        };
        described -= &recorded;
        for range in self.outliers {
            described.rows_range_mut(range.clone()).fill(0.0);
            recorded.rows_range_mut(range.clone()).fill(0.0);
        }
        let error = context.rows_of(&described, "command")?;
        let torque = context.rows_of(&recorded, "torque")?;
        let lag = context.rows_of(&lag, "reference")?;
        // Most controllers are right, and need none.
        let mut parts = None;
        let [along, rates] = self.along(references)?;
        let (filter, rows) = (context.row_filter(), error.len() / n);
        let of = |signal: &DVector<f64>, joint: usize| signal.rows(joint * rows, rows).into_owned();
        let mut errors = Vec::with_capacity(n);
        for (joint, controller) in config.joints.iter().enumerate() {
            if !context.has_torque(joint) {
                errors.push(Difference { size: f64::NAN, probability: f64::NAN });
                continue;
            }
            let of_all = along.column_iter().take(3 * n);
            let own = [rates.column(joint), along.column(3 * n + joint)];
            let mut motion: Vec<DVector<f64>> =
                of_all.chain(own).map(|signal| signal.into_owned()).collect();
            motion.push(of(&lag, joint));
            let integrates = integrates(&controller.law);
            if integrates {
                motion.extend(self.integrals(&along.column(n + joint).into_owned()));
                motion.iter_mut().for_each(|signal| self.without_means(signal));
            } else {
                motion.push(DVector::from_element(rows, 1.0));
            }
            let basis = orthonormal(motion);
            let size_of = |error: DVector<f64>| {
                let size = error.norm();
                match explained(error, &basis, &filter) {
                    Err(RegressionError::TooFewRows { .. }) => None,
                    // Too small for a covariance, or too large.
                    found => Some(found.unwrap_or(Difference { size, probability: 0.0 })),
                }
            };
            let few = ControllerError::Unknown(ControllerUnchecked::TooFewRows);
            let torque = of(&torque, joint).norm();
            let mut error = of(&error, joint);
            if integrates {
                // What the integral was before the first sample is not known.
                self.without_means(&mut error);
            }
            let Some(mut found) = size_of(error.clone()) else { return Ok(few) };
            let limit = context.options.limits.controller_error * torque;
            if found.size > limit {
                let parts = match &mut parts {
                    Some(parts) => parts,
                    none => none.insert(MotorParts::new(context, &recorded)?),
                };
                let mut signals = parts.of(context, joint);
                if integrates {
                    signals.iter_mut().for_each(|signal| self.without_means(signal));
                }
                let signals = DMatrix::from_columns(&signals);
                if let Some(left) = beyond_tolerances(&error, &signals, &context.options.tolerances)
                {
                    let Some(left) = size_of(left) else { return Ok(few) };
                    if left.size <= LEFT * limit {
                        found = left;
                    }
                }
            }
            let size = if torque > 0.0 { found.size / torque } else { 0.0 };
            errors.push(Difference { size, ..found });
        }
        Ok(ControllerError::PerJoint(errors))
    }

    /// Returns the torques that are predicted along references, their positions, speeds and
    /// accelerations, in the rows (rows × 4n), and the change of each there.
    fn along(&self, references: &DMatrix<f64>) -> Result<[DMatrix<f64>; 2], IdentificationError> {
        let Self { context, parameters, .. } = self;
        let n = context.robot.joints();
        let motion = motion_along(context.robot, context.experiment, references.clone())?;
        let mut group = MotionGroup::of_joints(n);
        let mut dynamics = InverseDynamics::of_the_estimate(context, parameters);
        let mut read = |first: usize, signals: &mut [Group]| {
            let states = group.read(&motion, first);
            signals[..n].copy_from_slice(&dynamics.torque(&context.model, states)[..n]);
            signals[n..2 * n].copy_from_slice(states.q);
            signals[2 * n..3 * n].copy_from_slice(states.dq);
            signals[3 * n..].copy_from_slice(states.ddq);
        };
        let rows = context.decimate_with_differences(4 * n, &mut read);
        rows.map_err(IdentificationError::RegressorFilter)
    }

    /// Returns the rows of each recording.
    fn rows_of_recordings(&self) -> impl Iterator<Item = Range<usize>> {
        let row = |sample: usize| self.context.samples.partition_point(|at| *at < sample);
        let recordings = self.context.experiment.recordings().iter();
        recordings.map(move |of| row(of.samples.start)..row(of.samples.end))
    }

    /// Returns the integral of a joint's rows over time, and the time, both in rows since the start
    /// of each recording.
    fn integrals(&self, rows: &DVector<f64>) -> [DVector<f64>; 2] {
        let mut integrals = [DVector::zeros(rows.len()), DVector::zeros(rows.len())];
        for own in self.rows_of_recordings() {
            let mut sum = 0.0;
            for (count, row) in own.enumerate() {
                sum += rows[row];
                integrals[0][row] = sum;
                integrals[1][row] = count as f64;
            }
        }
        integrals
    }

    /// Takes the mean of each recording from the rows of a joint.
    fn without_means(&self, rows: &mut DVector<f64>) {
        for own in self.rows_of_recordings() {
            let mut own = rows.rows_range_mut(own);
            let mean = own.sum() / own.len().max(1) as f64;
            own.add_scalar_mut(-mean);
        }
    }
}

/// The logged torque of every motor, and its rate, behind the filter: gains and delays belong to
/// drives.
struct MotorParts {
    torque: DMatrix<f64>,
    rate: DMatrix<f64>,
}

impl MotorParts {
    fn new(
        context: &Context<'_>,
        joint_torque: &DMatrix<f64>,
    ) -> Result<Self, IdentificationError> {
        let n = joint_torque.ncols();
        let mut torque = joint_torque.clone();
        let [mut joint, mut motor] = [[0.0; MAX_JOINTS]; 2];
        for (k, row) in joint_torque.row_iter().enumerate() {
            for (to, from) in joint.iter_mut().zip(row.iter()) {
                *to = *from;
            }
            context.robot.transmission().motor_torque(&joint[..n], &mut motor[..n]);
            set_row(&mut torque, k, &motor);
        }
        let samples = torque.nrows();
        let mut read = |first: usize, group: &mut [Group]| {
            for (group, signal) in group.iter_mut().zip(torque.as_slice().chunks(samples)) {
                *group = group_of(signal, first);
            }
        };
        let filtered = context.decimate_with_differences(n, &mut read);
        let [torque, differences] = filtered.map_err(IdentificationError::RegressorFilter)?;
        let rate = differences * (0.5 * context.experiment.sample_rate_hz());
        Ok(Self { torque, rate })
    }

    /// What the motors make of a joint's torque: of each that acts on it the torque, then the rate.
    fn of(&self, context: &Context<'_>, joint: usize) -> Vec<DVector<f64>> {
        let transmission = context.robot.transmission();
        let ratios = (0..self.torque.ncols()).map(|motor| transmission.row(motor)[joint]);
        let acting = || ratios.clone().enumerate().filter(|(_, ratio)| *ratio != 0.0);
        (acting().map(|(motor, ratio)| self.torque.column(motor) * ratio))
            .chain(acting().map(|(motor, ratio)| self.rate.column(motor) * ratio))
            .collect()
    }
}

/// A command's error without what gains and delays of the logged torques make of it, where all of
/// them are within their tolerances; none where not. `parts` has the torques, then as many rates.
fn beyond_tolerances(
    error: &DVector<f64>,
    parts: &DMatrix<f64>,
    tolerances: &Tolerances,
) -> Option<DVector<f64>> {
    let found = parts.tr_mul(parts).cholesky()?.solve(&parts.tr_mul(error));
    // The gain of the motor and the one common to all.
    let gain =
        Tolerances::CONTRADICTION_DEVIATIONS * core::f64::consts::SQRT_2 * tolerances.torque_gain;
    let delay_s = Tolerances::CONTRADICTION_DEVIATIONS * tolerances.torque_delay_s;
    let (gains, delays) = found.as_slice().split_at(found.len() / 2);
    let within =
        gains.iter().all(|of| of.abs() <= gain) && delays.iter().all(|of| of.abs() <= delay_s);
    within.then(|| error - parts * found)
}

/// Returns the part of an error that these orthonormal signals explain, without the part that they
/// would explain of its noise. The noise has the spectrum of the rest.
fn explained(
    error: DVector<f64>,
    columns: &[DVector<f64>],
    filter: &RowFilter,
) -> Result<Difference, RegressionError> {
    if columns.is_empty() || error.norm_squared() <= 0.0 {
        return Ok(Difference { size: 0.0, probability: 1.0 });
    }
    let equation = Observations::new(DMatrix::from_columns(columns), error, 1)?;
    let left = equation.solve_ordinary()?.residuals;
    let levels = equation.noise_levels(&left);
    let solution = equation.solve_weighted(&levels)?;
    let analysis = ResidualAnalysis::new(&equation, &solution, filter);
    let covariance = analysis.covariance();
    let all: Vec<usize> = (0..columns.len()).collect();
    let probability = analysis.test_exclusion(&all, &covariance)?.probability;
    let size = solution.parameters.norm_squared() - covariance.trace();
    Ok(Difference { size: size.max(0.0).sqrt(), probability })
}

/// Orthonormal signals that span what these do.
fn orthonormal(signals: Vec<DVector<f64>>) -> Vec<DVector<f64>> {
    let mut basis: Vec<DVector<f64>> = Vec::with_capacity(signals.len());
    for mut signal in signals {
        let size = signal.norm();
        // Twice is enough for any signals (Parlett, The Symmetric Eigenvalue Problem, section 6.9).
        for _ in 0..2 {
            for of in &basis {
                let share = of.dot(&signal);
                signal.axpy(-share, of, 1.0);
            }
        }
        let left = signal.norm();
        if left > SAME_SIGNAL * size {
            basis.push(signal / left);
        }
    }
    basis
}

/// Whether a law has an integral.
fn integrates(law: &ControlLaw) -> bool {
    matches!(law, ControlLaw::Pid { .. } | ControlLaw::CascadedPPi { .. })
}

/// What the described law makes of the recorded references and positions, what was recorded at the
/// same instants \[N·m\], and the integral of the lag ∫(q_r − q) dt, samples × joints each; inside,
/// why they cannot be compared.
fn commands(
    context: &Context<'_>,
    references: &DMatrix<f64>,
    config: &ControllerConfig,
) -> Result<Result<[DMatrix<f64>; 3], ControllerUnchecked>, IdentificationError> {
    let experiment = context.experiment;
    let (rate_hz, torque) = (experiment.sample_rate_hz(), experiment.torque_timing());
    let setup = |error| IdentificationError::Setup(SetupError::Control(error));
    let recorded = match config.timing {
        ControlTiming::Sampled { .. } if torque.hold_s <= 0.0 => {
            return Ok(Err(ControllerUnchecked::NoCommand));
        }
        ControlTiming::Sampled { sample_period_s, .. }
            if (rate_hz * sample_period_s - 1.0).abs() > SAME_PERIOD =>
        {
            return Ok(Err(ControllerUnchecked::BetweenSamples));
        }
        ControlTiming::Sampled { .. } => experiment.torque_nm().clone(),
        ControlTiming::Continuous { .. } => {
            delay_samples(experiment, torque.mean_delay_s() * rate_hz)?
        }
    };
    let (samples, n) = recorded.shape();
    let mut described = DMatrix::zeros(samples, n);
    let mut lag = described.clone();
    for of in experiment.recordings() {
        let delay_s = experiment.reference_timing().delay_s;
        let reference = find_reference(context, references, &of.samples, delay_s)?;
        let mut law = match config.timing {
            ControlTiming::Sampled { .. } => {
                Law::Sampled(SampledController::new(config).map_err(setup)?)
            }
            ControlTiming::Continuous { .. } => Law::Continuous {
                controller: ContinuousController::new(config).map_err(setup)?,
                velocity: velocity(context, &of.samples)?,
                period_s: 1.0 / rate_hz,
                integral: Box::new([0.0; MAX_JOINTS]),
                rate: Box::new([0.0; MAX_JOINTS]),
            },
        };
        let [mut position, mut speed, mut acceleration, mut measured, mut torque, mut behind] =
            [[0.0; MAX_JOINTS]; 6];
        for k in of.samples.clone() {
            let time_s = (k - of.samples.start) as f64 / rate_hz;
            reference.evaluate(time_s, &mut position[..n], &mut speed[..n], &mut acceleration[..n]);
            for (to, from) in measured.iter_mut().zip(experiment.position_rad().row(k).iter()) {
                *to = *from;
            }
            let setpoint = Setpoint {
                position: &position[..n],
                velocity: &speed[..n],
                acceleration: &acceleration[..n],
            };
            law.command(k - of.samples.start, setpoint, &measured[..n], &mut torque[..n]);
            set_row(&mut described, k, &torque);
            for (behind, (q_r, q)) in behind.iter_mut().zip(position.iter().zip(&measured)) {
                *behind += (q_r - q) / rate_hz;
            }
            set_row(&mut lag, k, &behind);
        }
    }
    Ok(Ok([described, recorded, lag]))
}

/// Velocities of the recorded positions of one recording. The decimation filter, which the commands
/// pass, takes care of what differences make of noise.
fn velocity(
    context: &Context<'_>,
    samples: &Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let (positions, rate_hz) =
        (context.experiment.position_rad(), context.experiment.sample_rate_hz());
    let mut velocity = DMatrix::zeros(samples.len(), positions.ncols());
    for (joint, mut to) in velocity.column_iter_mut().enumerate() {
        let from = &positions.column(joint);
        central_difference(&from.as_slice()[samples.clone()], rate_hz, to.as_mut_slice()).map_err(
            |cause| IdentificationError::Signal {
                signal: "position",
                joint: JointIndex::new(joint),
                cause,
            },
        )?;
    }
    Ok(velocity)
}

/// A described law with its state.
enum Law {
    Sampled(SampledController),
    Continuous {
        controller: ContinuousController,
        velocity: DMatrix<f64>,
        period_s: f64,
        integral: Box<[f64; MAX_JOINTS]>,
        /// Of the integrals, at the sample before.
        rate: Box<[f64; MAX_JOINTS]>,
    },
}

impl Law {
    /// The command of a sample, all samples in turn.
    fn command(&mut self, k: usize, setpoint: Setpoint<'_>, measured: &[f64], torque: &mut [f64]) {
        match self {
            Self::Sampled(controller) => controller.update(setpoint, measured, torque),
            Self::Continuous { controller, velocity, period_s, integral, rate } => {
                let (n, before) = (measured.len(), **rate);
                let mut speed = [0.0; MAX_JOINTS];
                for (to, from) in speed.iter_mut().zip(velocity.row(k).iter()) {
                    *to = *from;
                }
                let mut evaluate = |integral: &[f64], rate: &mut [f64]| {
                    controller.evaluate(setpoint, measured, &speed[..n], integral, torque, rate);
                };
                evaluate(&integral[..n], &mut rate[..n]);
                if k > 0 {
                    // By the trapezoidal rule.
                    for (integral, (before, after)) in
                        integral.iter_mut().zip(before.iter().zip(rate.iter()))
                    {
                        *integral += 0.5 * *period_s * (before + after);
                    }
                    evaluate(&integral[..n], &mut rate[..n]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_and_a_delay_within_their_tolerances_are_no_error_of_the_law() {
        let logged = DVector::from_fn(200, |k, _| (0.1 * k as f64).sin());
        let rate = DVector::from_fn(200, |k, _| 40.0 * (0.1 * k as f64).cos());
        let other = DVector::from_fn(200, |k, _| (0.37 * k as f64).sin());
        let parts = DMatrix::from_columns(&[logged.clone(), rate.clone()]);
        let left = |gain: f64, delay_s: f64, law: f64| {
            let error = gain * &logged + delay_s * &rate + law * &other;
            let left = beyond_tolerances(&error, &parts, &Tolerances::default())?;
            Some(left.norm() / other.norm())
        };
        assert!(left(0.02, 4e-4, 0.0).unwrap() < 1e-9);
        assert!((left(0.02, -4e-4, 0.01).unwrap() / 0.01 - 1.0).abs() < 0.05);
        // Beyond what is stated all of it counts.
        assert_eq!(left(-0.05, 0.0, 0.0), None);
        assert_eq!(left(0.0, 8e-4, 0.0), None);
    }
}
