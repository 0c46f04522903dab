//! Reasons for which an identification is refused or fails.

use core::ops::Range;
use didim_dynamics::robot::JointIndex;

use thiserror::Error;

use super::experiment_error::ExperimentError;
use super::failure::Failure;
use super::iteration_error::IterationError;
use super::limits::LimitError;
use super::method::Method;
use super::tolerances::ToleranceError;
use crate::feasibility::FeasibilityError;
use crate::regression::RegressionError;
use crate::signal::SignalError;
use didim_dynamics::simulation::SetupError;
use didim_dynamics::trajectory::TrajectoryError;

/// Reason for which an identification is refused or fails; each message ends with the remedy.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IdentificationError {
    /// Experiment and robot have different numbers of joints. Remedy: check the robot named in the
    /// cell file.
    #[error(
        "the experiment has {experiment} joints, robot {robot:?} has {joints}; \
         choose the robot that was recorded"
    )]
    JointCount {
        /// The robot.
        robot: String,
        /// Its joints.
        joints: usize,
        /// Joints of the experiment.
        experiment: usize,
    },
    /// The base parameters belong to another robot. Remedy: compute them from the model of this
    /// robot.
    #[error("the base parameters are not those of robot {robot:?}; compute them from its model")]
    OtherBaseParameters {
        /// The robot.
        robot: String,
    },
    /// No base parameter has this name. Remedy: use one of the available names.
    #[error("{name:?} is no base parameter of this robot; known are: {}", available.join(" "))]
    UnknownParameter {
        /// The name given.
        name: String,
        /// Every base parameter.
        available: Vec<String>,
    },
    /// Parameters shall keep their nominal values, but the robot file has none. Remedy: add
    /// `[nominal]` to the robot file.
    #[error(
        "identification.keep_nominal keeps nominal values, and the file of robot {robot:?} has no \
         [nominal]; add it, or leave keep_nominal out"
    )]
    NothingNominal {
        /// The robot.
        robot: String,
    },
    /// A parameter shall keep its nominal value but has none. Remedy: add the value to the robot
    /// file.
    #[error(
        "{name:?} shall keep its nominal value, and the robot's file has none or 0; add it to \
         [nominal], or take it out of identification.keep_nominal"
    )]
    NoNominalValue {
        /// The name.
        name: String,
    },
    /// A parameter shall keep its nominal value and is also identified. Remedy: remove it from one
    /// of the two lists.
    #[error(
        "{name:?} is identified and shall keep its nominal value as well; take it out of \
         identification.keep_nominal or of identification.parameters"
    )]
    KeptAndIdentified {
        /// The name.
        name: String,
    },
    /// A parameter is listed more than once. Remedy: list it once.
    #[error("parameter {name:?} is listed more than once; list it once")]
    RepeatedParameter {
        /// The name.
        name: String,
    },
    /// `"auto"` chooses by the prediction error on held-out folds, but no fold can be held out.
    /// Remedy: record a longer or a richer motion, or configure the value.
    #[error(
        "\"auto\" needs held-out parts of the motion to choose by, and none can be left out of \
        this one. Record longer, with all joints moving, or set the cut-off in the cell file and \
        the friction laws in the robot file"
    )]
    NothingHeldOut,
    /// The list of parameters is empty. Remedy: leave it out to identify all base parameters.
    #[error("the list of parameters is empty; leave it out to identify every base parameter")]
    NoParameter,
    /// The filter of the positions cannot be designed. Remedy: the cut-off must lie below half the
    /// sample rate.
    #[error("position filter: {0}")]
    PositionFilter(SignalError),
    /// The decimation filter cannot be designed. Remedy: see the cause.
    #[error("decimation filter: {0}")]
    DecimationFilter(SignalError),
    /// A joint's signal cannot be filtered or differentiated. Remedy: see the cause; usually a
    /// longer record.
    #[error("{signal} of joint {joint}: {cause}")]
    Signal {
        /// Name of the signal.
        signal: &'static str,
        /// Joint.
        joint: JointIndex,
        /// The problem.
        cause: SignalError,
    },
    /// The columns of the regressor cannot be filtered. Remedy: see the cause; usually a longer
    /// record.
    #[error("regressor: {0}")]
    RegressorFilter(SignalError),
    /// Counted samples need torques from before or after the record, because the torque acts later
    /// or earlier than it was logged. Remedy: count only samples whose shifted time lies inside the
    /// record.
    #[error(
        "the torque acts {shift_samples} samples after it was logged, so samples {} to {} need \
            torques outside the record's {samples} samples; count fewer samples at its ends",
        counted.start, counted.end
    )]
    TorqueOutside {
        /// The shift \[samples\]; negative if the torque acted before it was logged.
        shift_samples: f64,
        /// The counted samples.
        counted: Range<usize>,
        /// Samples of the record.
        samples: usize,
    },
    /// A limit of the verdict has an impossible value. Remedy: correct the named limit.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// A tolerance has an impossible value. Remedy: correct the named tolerance.
    #[error(transparent)]
    Tolerance(#[from] ToleranceError),
    /// The observation matrix has a value that is not finite. Remedy: look for impossible positions
    /// near that sample.
    #[error("the regressor at sample {sample} is not finite; look for absurd positions there")]
    Regressor {
        /// Sample, from 0.
        sample: usize,
    },
    /// Too few rows remain after decimation. Remedy: record longer, count more samples, or decimate
    /// less.
    #[error(
        "{rows} rows after decimation are too few for {parameters} parameters; record longer, \
         count more samples or decimate less"
    )]
    TooFewRows {
        /// Rows of the observation matrix, all joints.
        rows: usize,
        /// Parameters.
        parameters: usize,
    },
    /// The motion does not excite some parameters at all. Remedy: move the joints concerned, or
    /// leave the parameters out.
    #[error(
        "the motion does not excite {}; move the joints concerned or leave these parameters out",
        parameters.join(", ")
    )]
    NotExcited {
        /// Their names.
        parameters: Vec<String>,
    },
    /// Only combinations of some parameters can be identified from this motion. Remedy: a richer
    /// trajectory, or leave some of them out.
    #[error(
        "the motion does not distinguish {}; move along a richer trajectory or leave some out",
        parameters.join(", ")
    )]
    RankDeficient {
        /// Names of all parameters of the dependent combinations.
        parameters: Vec<String>,
    },
    /// A joint's torque is zero in every row. Remedy: check that it is recorded.
    #[error("the torque of joint {joint} is zero throughout; check that it is recorded")]
    NoTorque {
        /// Joint.
        joint: JointIndex,
    },
    /// A limit of the iteration has an impossible value. Remedy: correct the named key.
    #[error("convergence.{key} = {value} must be {expected}")]
    Convergence {
        /// The key in the file.
        key: &'static str,
        /// The value given.
        value: f64,
        /// Allowed range.
        expected: &'static str,
    },
    /// The DIDIM iterations before CLIE or CLOE use up all permitted simulations. Remedy: fewer
    /// DIDIM iterations (one or two are useful), or more simulations.
    #[error(
        "didim_steps = {steps} must be less than convergence.max_simulations = {max_simulations}, \
         which counts them too; one or two are of use"
    )]
    DidimSteps {
        /// Configured number of DIDIM iterations.
        steps: u32,
        /// The simulations allowed.
        max_simulations: u32,
    },
    /// The samples of the simulated controller do not coincide with those of the record. Remedy:
    /// configure the period of the real controller; the record's sample period must be a whole
    /// multiple of it.
    #[error(
        "a controller period of {:.3} µs does not divide the record's sample period of {:.3} µs \
         into 1 to 200 whole parts; state the controller's own period (timing.sample_period_s)",
        1e6 * controller_period_s, 1e6 * sample_period_s
    )]
    ControllerPeriod {
        /// Period of the simulated controller \[s\].
        controller_period_s: f64,
        /// Sample period of the record \[s\].
        sample_period_s: f64,
    },
    /// Without the decimation filter every sample is a row, and the observation matrix would have
    /// too many entries. Remedy: decimate.
    #[error(
        "{rows} rows of {parameters} parameters without the decimation filter take too much \
         memory; decimate, or take a shorter part"
    )]
    TooManyRows {
        /// Rows of the observation matrix, all joints.
        rows: usize,
        /// Parameters.
        parameters: usize,
    },
    /// A held torque command acts from the instant that the controller timing sets, but the layout
    /// and the controller configure different delays. Remedy: make them agree.
    #[error(
        "the logged torque is held from {:.3} µs after its sample on (delay_us in the layout), the \
         simulated controller's from {:.3} µs on (computation_delay_s); make the two agree",
        1e6 * logged_s, 1e6 * simulated_s
    )]
    TorqueDelay {
        /// Delay of the logged torque \[s\].
        logged_s: f64,
        /// Computation delay of the simulated controller \[s\].
        simulated_s: f64,
    },
    /// The simulated loop cannot be built. Remedy: see the cause.
    #[error("simulated loop: {0}")]
    Setup(SetupError),
    /// The recorded reference cannot be followed. Remedy: see the cause.
    #[error(transparent)]
    Reference(TrajectoryError),
    /// The robot file has no nominal parameters to start from. Remedy: choose another start, or add
    /// `[nominal]`.
    #[error("robot {robot:?} states no [nominal] parameters to start from; choose another start")]
    NoNominalParameters {
        /// The robot.
        robot: String,
    },
    /// The steps cannot be restricted to physically consistent parameters. Remedy: see the cause,
    /// or leave `simulation.bodies` out.
    #[error("simulation.bodies: {0}")]
    Consistency(FeasibilityError),
    /// The iteration with simulated loops failed. Remedy: see the cause.
    #[error(transparent)]
    Iteration(#[from] IterationError),
    /// The method simulates the closed loop, but the cell file describes no controller. Remedy:
    /// describe it, or choose IDIM-LS.
    #[error(
        "{method} simulates the closed loop, and the cell has no controller; describe \
            [controller], or choose idim-ls"
    )]
    NoController {
        /// The method.
        method: Method,
    },
    /// The method does not support the configured robust loss. Remedy: choose another method, or
    /// leave `robust` out.
    #[error("{method} has no robust weights; leave robust out, or choose idim-ls or didim")]
    NotRobust {
        /// The method.
        method: Method,
    },
    /// No joint has a recorded torque. Remedy: name the joints whose torque is recorded.
    #[error("no torque is recorded of any joint; name the joints with a torque in `joints`")]
    NoRecordedTorque,
    /// The method simulates every joint, but the torque of some joints is not recorded, so their
    /// friction and inertia are unknown. Remedy: choose IDIM-LS, or use all joints.
    #[error(
        "{method} simulates every joint, and no torque is recorded of joint {}, so friction and \
         inertia there are unknown; choose idim-ls, or leave `joints` out",
        listed(joints)
    )]
    MissingTorques {
        /// The method.
        method: Method,
        /// Joints without a recorded torque.
        joints: Vec<JointIndex>,
    },
    /// The list of required uses is empty. Remedy: name a use, or leave `required_uses` out.
    #[error("required_uses is empty; name a use, or leave it out for monitoring and prediction")]
    NoUse,
    /// A required parameter is not identified. Remedy: name an identified parameter, or leave
    /// `required_parameters` out.
    #[error(
        "required_parameters: `{name}` is not identified; available are {}; leave the key out \
            for those that contribute to the torque", available.join(", ")
    )]
    NotIdentified {
        /// Its name; empty if the list is empty.
        name: String,
        /// Names of the identified parameters.
        available: Vec<String>,
    },
    /// A significance level is not between 0 and 1. Remedy: use 0.05, the usual level.
    #[error("level of significance {level}: must lie between 0 and 1; 0.05 is usual")]
    Level {
        /// The level given.
        level: f64,
    },
    /// Too few counted samples for the blocks. Remedy: use at least two blocks, each longer than
    /// the filters' reach at its ends.
    #[error(
        "{samples} counted samples are too few for {blocks} held-out blocks; at least 2 are \
         needed, each of more than {guard} samples"
    )]
    Blocks {
        /// Requested number of blocks.
        blocks: usize,
        /// Counted samples.
        samples: usize,
        /// Reach of the filters \[samples\].
        guard: usize,
    },
    /// Samples cannot be held out. Remedy: see the cause.
    #[error("held-out samples: {0}")]
    HeldOut(ExperimentError),
    /// Any other failure of the least squares. Remedy: see the cause.
    #[error("least squares: {0}")]
    Regression(RegressionError),
}

impl IdentificationError {
    /// Converts the failure of a filter that was applied to the model's signals along a motion.
    pub(crate) fn of_regressor(cause: SignalError) -> Self {
        match cause {
            SignalError::NotFinite { index } => Self::Regressor { sample: index },
            cause => Self::RegressorFilter(cause),
        }
    }

    /// Returns the kind of failure; `None` if no identification was attempted because options,
    /// robot and experiment do not match.
    pub fn failure(&self) -> Option<Failure> {
        match self {
            Self::Iteration(error) => Some(error.failure()),
            Self::TooFewRows { .. }
            | Self::NotExcited { .. }
            | Self::RankDeficient { .. }
            | Self::NoTorque { .. }
            | Self::Regression(_) => Some(Failure::Refused),
            _ => None,
        }
    }
}

/// Returns the numbers of joints, with commas between them.
fn listed(joints: &[JointIndex]) -> String {
    joints.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
