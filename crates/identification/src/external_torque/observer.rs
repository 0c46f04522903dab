//! The momentum observer.

use core::f64::consts::TAU;

use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointIndex, Robot, Transmission};
use didim_dynamics::{MAX_JOINTS, SignalTiming};

use super::columns::{CoulombEntry, ObserverColumns};
use super::delay::DelayLine;
use super::error::ObserverError;
use super::low_pass::LowPass;
use super::mean::MovingMean;
use super::parameters::ArmParameters;
use super::position_noise::PositionNoise;
use super::uncertainty::RowCovariance;
use crate::identification::{KnownArm, ReachedRange, SignalDelays};

/// Longest delay of a signal \[s\]. It bounds the memory.
const MAX_DELAY_S: f64 = 1.0;
/// Time over which a speed is a difference, in time constants. It delays the estimate by a quarter
/// of one, and divides the noise of a position by all samples in it.
const DIFFERENCE_TIME_CONSTANTS: f64 = 0.5;
/// Number of time constants after which the response to the first sample has decayed to 5 %.
const SETTLING_TIME_CONSTANTS: f64 = 3.0;

/// Meaning of the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserverSignals {
    /// Sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Transmission of motor-side signals. `None` for joint-side signals.
    pub transmission: Option<Transmission>,
    /// Times at which a logged torque acts.
    pub torque_timing: SignalTiming,
    /// Delays of the axes.
    pub delays: SignalDelays,
}

/// Options of an observer.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserverOptions {
    /// Bandwidth K / 2π \[Hz\]. A contact shows after a time constant 1 / K.
    pub bandwidth_hz: f64,
    /// Standard deviation of the residuals of the identification, noise and model error, by joint
    /// \[N·m or N\]. Empty if it is unknown, which is 0.
    pub noise: Vec<f64>,
    /// Motion of the identification, by joint. Empty if it is unknown. The model is not tested
    /// outside.
    pub reached: Vec<ReachedRange>,
}

/// Usability of an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObserverState {
    /// The estimate is usable.
    Settled,
    /// The observer has seen the arm for less than three time constants.
    Settling,
    /// A joint is outside the position or speed of the identification.
    OutsideMotion(JointIndex),
}

/// External torque of every joint at one instant. Entries beyond the arm's joints are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalTorque {
    /// Torque of the environment on each joint \[N·m or N\]. NaN for a joint without a recorded
    /// torque.
    pub torque: [f64; MAX_JOINTS],
    /// Its standard deviation: parameters, residuals of the identification, noise of the positions,
    /// and friction at rest and at reversals.
    pub standard_deviation: [f64; MAX_JOINTS],
    /// Usability.
    pub state: ObserverState,
}

/// Momentum observer of one arm. After its creation it does not allocate.
///
/// # Example
/// A pendulum without friction that a hand holds with 2 N·m:
/// ```
/// use didim_dynamics::dynamics::{BaseParameters, Model};
/// use didim_dynamics::robot::Robot;
/// use didim_dynamics::SignalTiming;
/// use didim_identification::external_torque::{
///     ExternalTorqueObserver, ObserverOptions, ObserverSignals,
/// };
/// use didim_identification::identification::{
///     KnownArm, KnownModel, ParameterCovariance, SignalDelays,
/// };
/// use nalgebra::DMatrix;
///
/// let robot = Robot::from_toml(
///     r#"
///     name = "pendulum"
///     gravity_m_s2 = [0.0, -9.81, 0.0]
///     [[joint]]
///     type = "revolute"
///     alpha_deg = 0.0
///     d_m = 0.0
///     theta_deg = 0.0
///     r_m = 0.0
///     drive_inertia = false
///     position_min_deg = -170.0
///     position_max_deg = 170.0
///     velocity_max_rad_s = 5.0
///     torque_max_nm = 50.0
///     [transmission]
///     rows = [[1.0]]
///     [friction]
///     viscous = false
///     coulomb = false
///     offset = false
///     "#,
/// )?;
/// let base = BaseParameters::compute(&Model::new(&robot))?;
/// let parameters = [("zz1", 0.5), ("mx1", 2.0), ("my1", 0.0)];
/// let model = KnownModel { parameters: &parameters, fixed_parameters: &[], uncertainty: None };
/// let covariance = ParameterCovariance::from_symmetric(&(DMatrix::identity(3, 3) * 1e-6));
/// let mut observer = ExternalTorqueObserver::new(
///     &robot,
///     &base,
///     &KnownArm { model, covariance: Some(&covariance) },
///     ObserverSignals {
///         sample_rate_hz: 1000.0,
///         transmission: None,
///         torque_timing: SignalTiming::INSTANTANEOUS,
///         delays: SignalDelays::default(),
///     },
///     ObserverOptions { bandwidth_hz: 10.0, noise: vec![0.05], reached: Vec::new() },
/// )?;
/// let mut last = None;
/// for sequence in 0..1000 {
///     // The drive holds the weight less the share of the hand.
///     last = observer.step(sequence, &[0.3], &[2.0 * 9.81 * f64::cos(0.3) - 2.0]).copied();
/// }
/// let last = last.expect("it has settled");
/// assert!((last.torque[0] - 2.0).abs() < 1e-6);
/// assert!((last.standard_deviation[0] - 0.05).abs() < 0.001);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ExternalTorqueObserver {
    joints: usize,
    sample_rate_hz: f64,
    transmission: Option<Transmission>,
    low_pass: LowPass,
    /// K \[1/s\].
    gain_per_s: f64,
    columns: ObserverColumns,
    /// φ.
    values: Vec<f64>,
    covariances: Vec<RowCovariance>,
    coulomb: Vec<CoulombEntry>,
    has_torque: [bool; MAX_JOINTS],
    noise_variance: [f64; MAX_JOINTS],
    reached: Vec<ReachedRange>,
    /// Squares of the entries of R⁻¹, joint by axis, in rows of n.
    squared_inverse: Vec<f64>,
    /// Number of samples between the two positions of a speed.
    difference_samples: usize,
    memory: Memory,
    estimate: ExternalTorque,
}

/// Memory of earlier samples.
#[derive(Clone, Debug)]
struct Memory {
    positions: DelayLine,
    torques: DelayLine,
    sequence: Option<u64>,
    /// Positions of the sample at the begin of a speed's difference.
    earlier_positions: DelayLine,
    mean_torque: MovingMean,
    noise: PositionNoise,
    /// Number of estimates since the beginning of a stretch without a gap.
    estimates: u64,
    /// LP\[Y_h − K Y_p\] and its previous input.
    rows: Filtered,
    /// LP\[τ\], with the known torques, and its previous input.
    torque: Filtered,
    /// Low-passed joint speeds.
    speed: Filtered,
    /// Scratch: input of a filter, and Y_r.
    inputs: Vec<f64>,
    residual_rows: Vec<f64>,
}

impl Memory {
    /// Forgets the samples before a gap.
    fn restart(&mut self) {
        self.positions.clear();
        self.earlier_positions.clear();
        self.torques.clear();
        self.mean_torque.clear();
        self.noise.restart();
        self.estimates = 0;
    }
}

/// State of a low-pass of several signals.
#[derive(Clone, Debug)]
struct Filtered {
    states: Vec<f64>,
    previous: Vec<f64>,
}

impl Filtered {
    fn new(count: usize) -> Self {
        Self { states: vec![0.0; count], previous: vec![0.0; count] }
    }

    /// Begins as if the first input had always been there.
    fn begin(&mut self, inputs: &[f64]) {
        self.states.copy_from_slice(inputs);
        self.previous.copy_from_slice(inputs);
    }
}

impl ExternalTorqueObserver {
    /// Creates an observer of an arm from a result.
    ///
    /// # Errors
    /// [`ObserverError`].
    pub fn new(
        robot: &Robot,
        base: &BaseParameters,
        arm: &KnownArm<'_>,
        signals: ObserverSignals,
        options: ObserverOptions,
    ) -> Result<Self, ObserverError> {
        let joints = robot.joints();
        let [position_delays, torque_delays] = delays_in_samples(&signals, joints)?;
        let rate = signals.sample_rate_hz;
        let bandwidth = options.bandwidth_hz;
        if !(bandwidth > 0.0 && bandwidth < 0.5 * rate) {
            return Err(ObserverError::BadValue {
                what: "bandwidth",
                value: bandwidth,
                expected: "more than 0 and less than half of the sample rate",
            });
        }
        let arm = ArmParameters::new(robot, base, arm)?;
        let mut columns = ObserverColumns::new(robot, &arm);
        let entries = columns.entries().to_vec();
        let noise_variance = per_joint("noise", &options.noise, joints)?.map(|of| of * of);
        if !options.reached.is_empty() && options.reached.len() != joints {
            let found = options.reached.len();
            return Err(ObserverError::Length { what: "reached", expected: joints, found });
        }
        let mut has_torque = [false; MAX_JOINTS];
        for (joint, has) in has_torque.iter_mut().enumerate().take(joints) {
            *has = robot.recorded_torque().has_joint(JointIndex::new(joint));
        }
        let gain_per_s = TAU * bandwidth;
        let difference_samples = whole_samples(DIFFERENCE_TIME_CONSTANTS * rate / gain_per_s);
        let earlier_delays = position_delays.map(|delay| delay + difference_samples as f64);
        Ok(Self {
            joints,
            sample_rate_hz: rate,
            low_pass: LowPass::new(gain_per_s, 1.0 / rate),
            gain_per_s,
            coulomb: columns.coulomb_entries(&arm),
            columns,
            covariances: (0..joints)
                .map(|joint| RowCovariance::new(&arm.covariance, &entries, joint))
                .collect(),
            values: arm.values,
            has_torque,
            noise_variance,
            reached: options.reached,
            squared_inverse: squared_inverse(signals.transmission.as_ref(), joints),
            difference_samples,
            transmission: signals.transmission,
            memory: Memory {
                positions: DelayLine::new(position_delays),
                torques: DelayLine::new(torque_delays),
                sequence: None,
                earlier_positions: DelayLine::new(earlier_delays),
                mean_torque: MovingMean::new(difference_samples),
                noise: PositionNoise::new(rate / gain_per_s),
                estimates: 0,
                rows: Filtered::new(entries.len()),
                torque: Filtered::new(joints),
                speed: Filtered::new(joints),
                inputs: vec![0.0; entries.len()],
                residual_rows: vec![0.0; entries.len()],
            },
            estimate: ExternalTorque {
                torque: [0.0; MAX_JOINTS],
                standard_deviation: [0.0; MAX_JOINTS],
                state: ObserverState::Settling,
            },
        })
    }

    /// Returns the time constant 1 / K \[s\].
    pub fn time_constant_s(&self) -> f64 {
        1.0 / self.gain_per_s
    }

    /// Takes over the motion that another observer of the same arm has seen, so that a new result
    /// takes effect without a gap. Returns false, and starts anew, if parameters, bandwidth or
    /// signals differ.
    pub fn continue_from(&mut self, earlier: &mut Self) -> bool {
        let is_same = self.columns.entries() == earlier.columns.entries()
            && self.low_pass == earlier.low_pass
            && self.transmission == earlier.transmission
            && self.memory.positions.has_delays_of(&earlier.memory.positions)
            && self.memory.torques.has_delays_of(&earlier.memory.torques);
        if is_same {
            core::mem::swap(&mut self.memory, &mut earlier.memory);
            self.columns.continue_from(&mut earlier.columns);
        }
        is_same
    }

    /// Takes a sample: positions \[rad or m\] and torques \[N·m or N\] of all axes. A gap in the
    /// sequence starts the observer anew. Returns the estimate. `None` until there are enough
    /// samples for one.
    ///
    /// # Panics
    /// When a slice does not have one entry per joint.
    pub fn step(
        &mut self,
        sequence: u64,
        position: &[f64],
        torque: &[f64],
    ) -> Option<&ExternalTorque> {
        assert!(position.len() == self.joints && torque.len() == self.joints, "one per joint");
        let memory = &mut self.memory;
        if memory.sequence.is_some_and(|last| sequence != last.wrapping_add(1)) {
            memory.restart();
        }
        memory.sequence = Some(sequence);
        memory.positions.push(position);
        memory.earlier_positions.push(position);
        memory.torques.push(torque);
        memory.noise.push(position);
        let n = self.joints;
        let [mut now, mut earlier, mut torques] = [[0.0; MAX_JOINTS]; 3];
        // Each line is read, so that the mean of the torques begins as early as it can.
        let has_torque =
            memory.torques.read(&mut torques[..n]) && memory.mean_torque.replace(&mut torques[..n]);
        let has_positions = memory.positions.read(&mut now[..n])
            && memory.earlier_positions.read(&mut earlier[..n]);
        if !(has_torque && has_positions) {
            return None;
        }
        let [mut q, mut before, mut tau, mut dq] = [[0.0; MAX_JOINTS]; 4];
        self.to_joints(&now, &mut q, Transmission::joint_position);
        self.to_joints(&earlier, &mut before, Transmission::joint_position);
        self.to_joints(&torques, &mut tau, Transmission::joint_torque);
        let per_s = self.sample_rate_hz / self.difference_samples as f64;
        for joint in 0..n {
            dq[joint] = (q[joint] - before[joint]) * per_s;
            q[joint] = 0.5 * (q[joint] + before[joint]);
        }
        self.advance(&q[..n], &dq[..n], &mut tau[..n]);
        self.estimate(&q);
        Some(&self.estimate)
    }

    /// Converts the values of the axes to those of the joints.
    fn to_joints(
        &self,
        axes: &[f64; MAX_JOINTS],
        joints: &mut [f64; MAX_JOINTS],
        convert: fn(&Transmission, &[f64], &mut [f64]),
    ) {
        let n = self.joints;
        match &self.transmission {
            Some(transmission) => convert(transmission, &axes[..n], &mut joints[..n]),
            None => joints[..n].copy_from_slice(&axes[..n]),
        }
    }

    /// Filters the regressor and the torque of a state between two samples.
    fn advance(&mut self, q: &[f64], dq: &[f64], tau: &mut [f64]) {
        let Self { columns, memory, low_pass, gain_per_s, .. } = self;
        let is_first = memory.estimates == 0;
        if is_first {
            columns.restart_at(q);
        }
        columns.evaluate(q, dq);
        for (joint, tau) in tau.iter_mut().enumerate() {
            *tau += columns.known_torque(joint, q[joint]);
        }
        let Memory { rows, torque, speed, inputs, residual_rows, .. } = memory;
        let terms = columns.rest.iter().zip(&columns.momentum);
        for (input, (rest, momentum)) in inputs.iter_mut().zip(terms) {
            *input = rest - *gain_per_s * momentum;
        }
        if is_first {
            rows.begin(inputs);
            torque.begin(tau);
            speed.begin(dq);
        } else {
            low_pass.advance(&mut rows.states, &mut rows.previous, inputs);
            low_pass.advance(&mut torque.states, &mut torque.previous, tau);
            low_pass.advance(&mut speed.states, &mut speed.previous, dq);
        }
        let filtered = rows.states.iter().zip(&columns.momentum);
        for (row, (state, momentum)) in residual_rows.iter_mut().zip(filtered) {
            *row = state + *gain_per_s * momentum;
        }
        memory.estimates += 1;
    }

    /// Computes the estimate from the filtered signals.
    fn estimate(&mut self, q: &[f64; MAX_JOINTS]) {
        let n = self.joints;
        let rows = &self.memory.residual_rows;
        let mut torque = [0.0; MAX_JOINTS];
        for (value, &(joint, column)) in rows.iter().zip(self.columns.entries()) {
            torque[joint] += value * self.values[column];
        }
        let mut variance = self.noise_variance;
        self.add_position_noise(&q[..n], &mut variance);
        let (memory, rows) = (&self.memory, &self.memory.residual_rows);
        for entry in &self.coulomb {
            variance[entry.joint] += entry.variance(rows[entry.entry]);
        }
        for joint in 0..n {
            let by_parameters = self.covariances[joint].variance(rows);
            let deviation = (variance[joint] + by_parameters).sqrt();
            let value = torque[joint] - memory.torque.states[joint];
            let is_known = self.has_torque[joint];
            self.estimate.torque[joint] = if is_known { value } else { f64::NAN };
            self.estimate.standard_deviation[joint] = if is_known { deviation } else { f64::NAN };
        }
        let settled = SETTLING_TIME_CONSTANTS * self.sample_rate_hz / self.gain_per_s;
        self.estimate.state = if (memory.estimates as f64) < settled {
            ObserverState::Settling
        } else {
            self.joint_outside(q).map_or(ObserverState::Settled, ObserverState::OutsideMotion)
        };
    }

    /// Adds the variance by the noise of the positions. The error of a speed is that of two
    /// positions, and the estimate contains K times the error of the momentum.
    fn add_position_noise(&mut self, q: &[f64], variance: &mut [f64; MAX_JOINTS]) {
        let n = self.joints;
        let period_s = self.difference_samples as f64 / self.sample_rate_hz;
        let scale = 2.0 * (self.gain_per_s / period_s).powi(2);
        let axes = &self.memory.noise.variances[..n];
        let mut speeds = [0.0; MAX_JOINTS];
        for (speed, row) in speeds.iter_mut().zip(self.squared_inverse.chunks_exact(n)) {
            *speed = scale * row.iter().zip(axes).map(|(square, of)| square * of).sum::<f64>();
        }
        let masses = self.columns.mass_matrix(q);
        for (variance, row) in variance.iter_mut().zip(masses.chunks_exact(n)) {
            *variance += row.iter().zip(&speeds).map(|(mass, of)| mass * mass * of).sum::<f64>();
        }
    }

    /// Returns the first joint outside the motion of the identification.
    fn joint_outside(&self, q: &[f64; MAX_JOINTS]) -> Option<JointIndex> {
        let speeds = &self.memory.speed.states;
        let is_outside = |(joint, of): (usize, &ReachedRange)| {
            let [least, most] = of.position;
            !(least..=most).contains(&q[joint]) || speeds[joint].abs() > of.highest_speed()
        };
        let mut joints = self.reached.iter().enumerate();
        joints.position(is_outside).map(JointIndex::new)
    }
}

/// Returns a number of samples, rounded, at least one.
fn whole_samples(samples: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at least 1, and at most the samples of a time constant"
    )]
    let count = samples.round().max(1.0) as usize;
    count
}

/// Returns the squares of the entries of R⁻¹ in rows of one joint. Without a transmission they are
/// those of the unit matrix.
fn squared_inverse(transmission: Option<&Transmission>, joints: usize) -> Vec<f64> {
    let mut squares = vec![0.0; joints * joints];
    for axis in 0..joints {
        let (mut unit, mut column) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        unit[axis] = 1.0;
        match transmission {
            Some(of) => of.joint_position(&unit[..joints], &mut column[..joints]),
            None => column = unit,
        }
        for joint in 0..joints {
            squares[joint * joints + axis] = column[joint].powi(2);
        }
    }
    squares
}

/// Returns the delays of positions and of torques \[samples\] that bring all signals of the middle
/// between two samples together: positions at the sample, torques half a sample before. None is
/// negative.
fn delays_in_samples(
    signals: &ObserverSignals,
    joints: usize,
) -> Result<[[f64; MAX_JOINTS]; 2], ObserverError> {
    let rate = signals.sample_rate_hz;
    if !(rate > 0.0 && rate.is_finite()) {
        let expected = "positive and finite";
        return Err(ObserverError::BadValue { what: "sample rate", value: rate, expected });
    }
    let mean_delay_s = signals.torque_timing.mean_delay_s();
    let positions = per_joint("position delays", &signals.delays.position_s, joints)?;
    let torques = per_joint("torque delays", &signals.delays.torque_s, joints)?;
    let torques = torques.map(|delay_s| delay_s + mean_delay_s);
    let delays = || positions[..joints].iter().chain(&torques[..joints]).copied();
    if let Some(value) = delays().find(|delay| delay.abs() > MAX_DELAY_S || delay.is_nan()) {
        let expected = "at most 1 s in either direction";
        return Err(ObserverError::BadValue { what: "delay of a signal", value, expected });
    }
    // A value that is logged late belongs to an earlier instant, for which all others wait.
    let latest_s = delays().fold(0.0, |latest, delay| f64::max(latest, -delay));
    let samples = |delay: f64, half: f64| ((latest_s + delay) * rate + half).max(0.0);
    Ok([positions.map(|delay| samples(delay, 0.0)), torques.map(|delay| samples(delay, 0.5))])
}

/// Returns one value per joint; zeros if the list is empty.
fn per_joint(
    what: &'static str,
    values: &[f64],
    joints: usize,
) -> Result<[f64; MAX_JOINTS], ObserverError> {
    if !values.is_empty() && values.len() != joints {
        return Err(ObserverError::Length { what, expected: joints, found: values.len() });
    }
    let mut padded = [0.0; MAX_JOINTS];
    for (to, value) in padded.iter_mut().zip(values) {
        *to = *value;
    }
    Ok(padded)
}
