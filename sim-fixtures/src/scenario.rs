//! Simulated experiment: an arm, its motion, its controller, its drives.

use std::collections::BTreeMap;

use didim_dynamics::control::ControllerConfig;
use didim_dynamics::dynamics::{BaseParameters, BaseParametersError, Model};
use didim_dynamics::robot::{JointIndex, NoSuchFrame, ParameterKind, Robot, RobotError};
use didim_dynamics::simulation::{
    ClosedLoop, InitialState, NoiseConfig, Record, SetupError, SimulationConfig, SimulationError,
    Unmodelled,
};
use didim_dynamics::trajectory::{
    JointLimits, Move, MoveSequence, Reference, SampledReference, Trajectory, TrajectoryError,
};
use didim_identification::identification::Finding;
use serde::Deserialize;

use crate::motion::Motion;
use crate::{Fault, FramedPayload, Payload, Playback, PlaybackConfig};

/// A simulated experiment whose parts are checked to match each other. Its true parameters are the
/// nominal ones of the scenario or, if it has none, those of its robot. They do not include a
/// payload.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    name: String,
    robot: Robot,
    truth: Vec<(String, f64)>,
    /// Standard parameters of the arm with its payload.
    standard_parameters: Vec<f64>,
    samples: usize,
    limits: Vec<JointLimits>,
    trajectory: Motion,
    playback: PlaybackConfig,
    controller: ControllerConfig,
    simulation: SimulationConfig,
    faults: Vec<Fault>,
    /// Findings on the payload.
    findings: Vec<Finding>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScenario {
    name: String,
    robot: String,
    samples: usize,
    motion: RawMotion,
    playback: PlaybackConfig,
    controller: ControllerConfig,
    simulation: SimulationConfig,
    payload: Option<FramedPayload>,
    nominal: Option<BTreeMap<String, f64>>,
    #[serde(default)]
    faults: Vec<Fault>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMotion {
    acceleration_max_rad_s2: Vec<f64>,
    start_rad: Vec<f64>,
    start_dwell_s: f64,
    moves: Vec<Move>,
}

/// Longest simulated motion with its rests \[s\]. Convention: ten times the longest window of the
/// shipped cells. A longer one is a mistake in a limit or a rest; repetitions do not count.
pub const MAX_MOTION_S: f64 = 600.0;

/// Reason why a scenario was refused.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The text is not TOML, a key is unknown or missing, or a value has the wrong type.
    #[error("line {line}: {message}")]
    Format {
        /// Line of the error, counted from 1.
        line: usize,
        /// Message of the TOML parser.
        message: String,
    },
    /// The robot file leaves a speed limit undetermined, but planning the moves needs it. Add it to
    /// the file.
    #[error(
        "joint {joint}: its speed limit is unknown; state velocity_max_rad_s in the robot file"
    )]
    OpenSpeed {
        /// Joint without a speed limit.
        joint: JointIndex,
    },
    /// The scenario is for another robot. Pass the robot that it names.
    #[error("the scenario is for the robot `{expected}`, not for `{found}`")]
    OtherRobot {
        /// Name of the robot in the scenario.
        expected: String,
        /// Name of the robot that was passed.
        found: String,
    },
    /// Neither the robot nor the scenario has nominal parameters, so there is no truth to simulate.
    #[error(
        "the robot `{robot}` has no [nominal] parameters: there is nothing to simulate; state them \
         in the scenario or in the robot file"
    )]
    NoTruth {
        /// Name of the robot.
        robot: String,
    },
    /// The scenario has a parameter that is not in the robot. Correct its name.
    #[error("nominal.{name}: the robot has no such parameter")]
    UnknownParameter {
        /// Name of the parameter.
        name: String,
    },
    /// A list does not have one value per joint.
    #[error("{key}: {found} values for {expected} joints")]
    Length {
        /// Key of the list.
        key: &'static str,
        /// Number of joints of the robot.
        expected: usize,
        /// Number of values in the file.
        found: usize,
    },
    /// A value is impossible for its key.
    #[error("{key} must be {expected}")]
    BadValue {
        /// Key of the value.
        key: &'static str,
        /// Requirement on the value.
        expected: &'static str,
    },
    /// The motion is too long to be simulated. Raise the limits of speed and acceleration that the
    /// moves use, or shorten the rests.
    #[error(
        "{key}: {duration_s:.4e} s are longer than the longest simulated motion of {MAX_MOTION_S} \
        s; raise the limits of speed and acceleration, or shorten rests and number of samples"
    )]
    TooLong {
        /// Key of the part that is too long.
        key: &'static str,
        /// Its duration \[s\].
        duration_s: f64,
    },
    /// The frame of the payload is not on the last link. Name one that is.
    #[error("payload.frame: {0}")]
    Frame(#[from] NoSuchFrame),
    /// The robot file was refused.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The robot has no well-defined base parameters.
    #[error(transparent)]
    Base(#[from] BaseParametersError),
    /// The motion cannot be planned.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The loop cannot be built.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The simulated arm diverged. Choose controller gains that hold the arm, or smaller simulated
    /// errors.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

impl Scenario {
    /// Reads a scenario for a robot.
    ///
    /// # Errors
    /// [`ScenarioError`] names the mismatch.
    pub fn from_toml(text: &str, robot: Robot) -> Result<Self, ScenarioError> {
        let raw: RawScenario = toml::from_str(text).map_err(|error| ScenarioError::Format {
            line: error.span().map_or(1, |span| {
                1 + text.bytes().take(span.start).filter(|byte| *byte == b'\n').count()
            }),
            message: error.message().to_owned(),
        })?;
        if raw.robot != robot.name() {
            let name = robot.name().to_owned();
            return Err(ScenarioError::OtherRobot { expected: raw.robot, found: name });
        }
        let (limits, trajectory) = plan(raw.motion, raw.playback, &robot)?;
        check_values(&raw.playback, raw.samples)?;
        let period_s = raw.controller.timing.sample_period_s();
        check_duration("samples", raw.samples as f64 * period_s)?;
        let standard = match (&raw.nominal, robot.nominal()) {
            (Some(own), _) => standard_values(own, &robot)?,
            (None, Some(nominal)) => nominal.standard_parameters().to_vec(),
            (None, None) => {
                return Err(ScenarioError::NoTruth { robot: robot.name().to_owned() });
            }
        };
        let base = BaseParameters::compute(&Model::new(&robot))?;
        let values = base.to_base(&standard);
        let truth = base.names().iter().cloned().zip(values).collect();
        let scenario = Self {
            name: raw.name,
            truth,
            standard_parameters: standard,
            samples: raw.samples,
            limits,
            trajectory,
            playback: raw.playback,
            controller: raw.controller,
            simulation: raw.simulation,
            faults: raw.faults,
            findings: Vec::new(),
            robot,
        };
        match raw.payload {
            Some(payload) => scenario.with_framed_payload(&payload),
            None => scenario.validated(),
        }
    }

    /// Returns the name of the scenario.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the robot of the scenario.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns the true values of all base parameters, in the order of [`BaseParameters::names`].
    pub fn truth(&self) -> &[(String, f64)] {
        &self.truth
    }

    /// Returns the true value of a base parameter by its name, such as `zz1r`; `None` for other
    /// names.
    pub fn truth_of(&self, name: &str) -> Option<f64> {
        self.truth.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
    }

    /// Returns the standard parameters of the moving arm, in the order of the model's columns: the
    /// nominal parameters plus the payload.
    pub fn standard_parameters(&self) -> &[f64] {
        &self.standard_parameters
    }

    /// Returns the number of samples of the experiment, counted from the start of the motion.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Returns the motion of the arm.
    pub fn trajectory(&self) -> &Motion {
        &self.trajectory
    }

    /// Returns the playback settings of the motion.
    pub fn playback(&self) -> PlaybackConfig {
        self.playback
    }

    /// Returns the scenario with other playback settings.
    ///
    /// # Errors
    /// [`ScenarioError::BadValue`] if a rest is negative, or if the motion is to be repeated but
    /// does not end at its starting point.
    pub fn with_playback(mut self, playback: PlaybackConfig) -> Result<Self, ScenarioError> {
        check_playback(&playback, &self.trajectory)?;
        self.playback = playback;
        Ok(self)
    }

    /// Returns the scenario with other faults.
    #[must_use]
    pub fn with_faults(mut self, faults: Vec<Fault>) -> Self {
        self.faults = faults;
        self
    }

    /// Returns the scenario with another seed of its noise, if it has noise.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        if let Some(noise) = &mut self.simulation.noise {
            noise.seed = seed;
        }
        self
    }

    /// Returns the scenario with other noise.
    ///
    /// # Errors
    /// [`ScenarioError::Setup`] if the noise does not fit the arm.
    pub fn with_noise(mut self, noise: NoiseConfig) -> Result<Self, ScenarioError> {
        self.simulation.noise = Some(noise);
        self.validated()
    }

    /// Returns the scenario with unmodelled effects: effects of the arm that the model does not
    /// contain.
    ///
    /// # Errors
    /// [`ScenarioError::Setup`] if the effects do not fit the arm.
    pub fn with_unmodelled(mut self, unmodelled: Unmodelled) -> Result<Self, ScenarioError> {
        self.simulation.unmodelled = Some(unmodelled);
        self.validated()
    }

    /// Returns the scenario with another controller of the arm.
    ///
    /// # Errors
    /// [`ScenarioError::Setup`] if the controller does not fit the arm.
    pub fn with_controller(mut self, controller: ControllerConfig) -> Result<Self, ScenarioError> {
        self.controller = controller;
        self.validated()
    }

    /// Returns the scenario with a controller of `factor` times the bandwidth
    /// ([`ControllerConfig::with_bandwidth`]).
    ///
    /// # Errors
    /// [`ScenarioError::Setup`] if the factor is not positive.
    pub fn with_bandwidth(self, factor: f64) -> Result<Self, ScenarioError> {
        let controller = self.controller.clone().with_bandwidth(factor);
        self.with_controller(controller.map_err(SetupError::Control)?)
    }

    /// Returns the scenario with another motion.
    ///
    /// # Errors
    /// [`ScenarioError::Trajectory`] if this arm cannot make the motion.
    pub fn with_moves(mut self, moves: &MoveSequence) -> Result<Self, ScenarioError> {
        self.trajectory = Motion::Moves(Trajectory::plan(moves, &self.limits)?);
        check_playback(&self.playback, &self.trajectory)?;
        self.validated()
    }

    /// Returns the limits of every joint, with the scenario's acceleration limits.
    pub fn limits(&self) -> &[JointLimits] {
        &self.limits
    }

    /// Returns the scenario with an additional body on the last link. [`Self::truth`] remains that
    /// of the arm without this body.
    ///
    /// # Errors
    /// [`ScenarioError::Setup`] if a value of the body is not finite.
    pub fn with_payload(mut self, payload: Payload) -> Result<Self, ScenarioError> {
        let last = self.robot.joints() - 1;
        for (kind, value) in ParameterKind::LINK.into_iter().zip(payload.link_parameters()) {
            if let Some(column) = self.robot.parameters().column(kind, JointIndex::new(last)) {
                self.standard_parameters[column] += value;
            }
        }
        self.validated()
    }

    /// Returns the scenario with the payload of a file.
    ///
    /// # Errors
    /// [`ScenarioError::Frame`] if its frame is not on the last link, and those of
    /// [`Self::with_payload`].
    pub fn with_framed_payload(mut self, payload: &FramedPayload) -> Result<Self, ScenarioError> {
        self.findings = payload.findings(&self.robot);
        let payload = payload.on_last_link(&self.robot)?;
        self.with_payload(payload)
    }

    /// Returns the findings on the payload.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Returns the scenario with a motion given point by point. The duration of the experiment
    /// becomes that of this motion.
    /// # Errors
    /// [`ScenarioError::Length`] if the number of joints differs. [`ScenarioError::BadValue`] if
    /// the motion is to be repeated but does not end at its starting point.
    pub fn with_recorded_motion(mut self, motion: SampledReference) -> Result<Self, ScenarioError> {
        check_length("the columns of the motion", self.robot.joints(), motion.joints())?;
        let period_s = self.controller.timing.sample_period_s();
        check_duration("motion", motion.duration_s())?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a motion has far fewer samples than 2^52"
        )]
        let samples = (motion.duration_s() / period_s).ceil().max(1.0) as usize;
        self.samples = samples;
        self.trajectory = Motion::Recorded(motion);
        check_playback(&self.playback, &self.trajectory)?;
        self.validated()
    }

    /// Builds the loop, so that every error in its settings is reported now.
    fn validated(self) -> Result<Self, ScenarioError> {
        self.closed_loop()?;
        Ok(self)
    }

    /// Returns the controller of the arm.
    pub fn controller(&self) -> &ControllerConfig {
        &self.controller
    }

    /// Returns the settings for the integration and measurement of the loop.
    pub fn simulation(&self) -> &SimulationConfig {
        &self.simulation
    }

    /// Returns the faults of the bus.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Returns the closed loop of the experiment without a bus, at the start of the motion and on
    /// the reference. Run it for [`Self::samples`] samples.
    ///
    /// # Errors
    /// Only errors that reading the scenario would have reported already.
    pub fn closed_loop(&self) -> Result<ClosedLoop<&Motion>, SetupError> {
        self.closed_loop_along(&self.trajectory)
    }

    /// Returns the drives' log of the experiment, with a rest of `before` samples before the motion
    /// and a rest of `after` samples after it. Filters need neighbouring samples, and the loop
    /// first settles to its steady-state error under gravity. The motion starts at sample `before`
    /// and has [`Self::samples`] samples.
    ///
    /// # Errors
    /// [`ScenarioError::Simulation`] if the arm diverges.
    pub fn record_with_rests(&self, before: usize, after: usize) -> Result<Record, ScenarioError> {
        let period_s = self.controller.timing.sample_period_s();
        let rest_s = |samples: usize| samples as f64 * period_s;
        let playback =
            PlaybackConfig { lead_in_s: rest_s(before), tail_s: rest_s(after), cycles: Some(1) };
        let reference = Playback::new(self.trajectory.clone(), playback);
        let mut played = self.closed_loop_along(reference)?;
        Ok(played.run(before + self.samples + after)?)
    }

    /// Returns the closed loop as a device plays it, with the rests before and after the motion.
    ///
    /// # Errors
    /// Only errors that reading the scenario would have reported already.
    pub fn played_loop(&self) -> Result<ClosedLoop<Playback>, SetupError> {
        self.closed_loop_along(self.played_reference())
    }

    /// Returns the reference as a device plays it, with the rests before and after the motion.
    pub fn played_reference(&self) -> Playback {
        Playback::new(self.trajectory.clone(), self.playback)
    }

    fn closed_loop_along<R: Reference>(&self, reference: R) -> Result<ClosedLoop<R>, SetupError> {
        ClosedLoop::new(
            &self.robot,
            self.standard_parameters(),
            &self.controller,
            reference,
            &self.simulation,
            InitialState::OnReference,
        )
    }
}

/// Returns the configured parameters in the order of the model's columns. Missing parameters are 0.
fn standard_values(
    configured: &BTreeMap<String, f64>,
    robot: &Robot,
) -> Result<Vec<f64>, ScenarioError> {
    let mut standard = vec![0.0; robot.parameters().names().len()];
    for (name, value) in configured {
        let column = robot.parameters().find(name);
        let Some(entry) = column.and_then(|column| standard.get_mut(column)) else {
            return Err(ScenarioError::UnknownParameter { name: name.clone() });
        };
        if !value.is_finite() {
            return Err(ScenarioError::BadValue { key: "nominal", expected: "finite" });
        }
        *entry = *value;
    }
    Ok(standard)
}

fn plan(
    motion: RawMotion,
    playback: PlaybackConfig,
    robot: &Robot,
) -> Result<(Vec<JointLimits>, Motion), ScenarioError> {
    check_length(
        "motion.acceleration_max_rad_s2",
        robot.joints(),
        motion.acceleration_max_rad_s2.len(),
    )?;
    let limits: Vec<JointLimits> = robot
        .limits()
        .zip(motion.acceleration_max_rad_s2)
        .zip(0..)
        .map(|((limit, acceleration), joint)| {
            Ok(JointLimits {
                position_min_rad: limit.position_min,
                position_max_rad: limit.position_max,
                velocity_max_rad_s: limit
                    .velocity_max
                    .ok_or(ScenarioError::OpenSpeed { joint: JointIndex::new(joint) })?,
                acceleration_max_rad_s2: acceleration,
            })
        })
        .collect::<Result<_, ScenarioError>>()?;
    let sequence = MoveSequence {
        start_rad: motion.start_rad,
        start_dwell_s: motion.start_dwell_s,
        moves: motion.moves,
    };
    let trajectory = Motion::Moves(Trajectory::plan(&sequence, &limits)?);
    check_playback(&playback, &trajectory)?;
    Ok((limits, trajectory))
}

fn check_playback(playback: &PlaybackConfig, trajectory: &Motion) -> Result<(), ScenarioError> {
    for (key, value) in
        [("playback.lead_in_s", playback.lead_in_s), ("playback.tail_s", playback.tail_s)]
    {
        if !(value.is_finite() && value >= 0.0) {
            return Err(ScenarioError::BadValue { key, expected: "finite and not negative" });
        }
    }
    let rests_s = playback.lead_in_s + playback.tail_s;
    check_duration("motion", trajectory.duration_s() + rests_s)?;
    let n = trajectory.joints();
    let [mut start, mut end, mut unused, mut rates] = [(); 4].map(|()| vec![0.0; n]);
    trajectory.evaluate(0.0, &mut start, &mut unused, &mut rates);
    trajectory.evaluate(trajectory.duration_s(), &mut end, &mut unused, &mut rates);
    if playback.cycles != Some(1) && start != end {
        return Err(ScenarioError::BadValue {
            key: "playback.cycles",
            expected: "1, for a motion that does not end where it starts",
        });
    }
    Ok(())
}

fn check_duration(key: &'static str, duration_s: f64) -> Result<(), ScenarioError> {
    match duration_s <= MAX_MOTION_S {
        true => Ok(()),
        false => Err(ScenarioError::TooLong { key, duration_s }),
    }
}

fn check_values(playback: &PlaybackConfig, samples: usize) -> Result<(), ScenarioError> {
    if samples == 0 {
        return Err(ScenarioError::BadValue { key: "samples", expected: "positive" });
    }
    if playback.cycles == Some(0) {
        return Err(ScenarioError::BadValue { key: "playback.cycles", expected: "positive" });
    }
    Ok(())
}

fn check_length(key: &'static str, expected: usize, found: usize) -> Result<(), ScenarioError> {
    if expected == found { Ok(()) } else { Err(ScenarioError::Length { key, expected, found }) }
}
