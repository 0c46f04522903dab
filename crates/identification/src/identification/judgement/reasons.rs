//! Reasons against a result, and notes on it. Their wording is defined only here.

use core::fmt::{self, Display};
use core::ops::Range;
use didim_dynamics::robot::{JointIndex, MotorIndex, TorqueTerm};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::alternatives::{Alternative, Evidence, Signal};
use super::bias::PositionBias;
use super::clipped_signal::ClippedSignal;
use super::finding::Finding;
use super::finding_code::{FindingCode, Severity};
use super::frozen_signal::FrozenSignal;
use super::nuisance_parameters::{NuisanceEstimate, NuisanceParameter};
use super::setting::Setting;
use super::significance::Significance;
use crate::feasibility::{FarBody, PhysicallyImpossible};
use crate::identification::problem::Failure;

/// Reason against the use of a result. Errors and deviations are shares of
/// the torque unless stated otherwise.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    missing_docs,
    reason = "each fact has its figure, and the limit that it exceeds if it has one"
)]
pub enum Reason {
    /// The described controller does not reproduce the recorded command.
    Controller { joint: JointIndex, error: f64, significance: Option<Significance> },
    /// The motion does not distinguish the parameters.
    ConditionNumber { value: f64, limit: f64 },
    /// The parameters leave the torque of a joint uncertain.
    PredictionDeviation { joint: JointIndex, deviation: f64, limit: f64 },
    /// The model does not describe the torques.
    RelativeError { error: f64, limit: f64 },
    /// The model does not describe the torque of a joint.
    JointError { joint: JointIndex, error: f64, limit: f64 },
    /// Too few independent rows for each parameter.
    FewRows { per_parameter: f64, limit: f64 },
    /// Identified without the decimation filter.
    NotDecimated,
    /// A parameter that is no combination and cannot be negative is negative. `tests` is the number
    /// of such parameters.
    Negative {
        quantity: &'static str,
        name: String,
        value: f64,
        standard_deviation: f64,
        tests: usize,
    },
    /// The mass matrix is not positive definite at a posture \[rad or m\], by this number of
    /// standard deviations.
    Indefinite { posture: Vec<f64>, deviations: f64 },
    /// No physically consistent bodies have these parameters.
    PhysicallyImpossible(PhysicallyImpossible),
    /// The described controller commands the opposite of the recorded command, or three times as
    /// much.
    OppositeCommand { joint: JointIndex, error: f64, significance: Option<Significance> },
    /// Parameters that cannot be negative are negative: their number, and that of all such
    /// parameters.
    WrongSigns { negative: usize, of: usize },
    /// Another reading of the signals, or of the arm, fits decisively better.
    Alternative { found: Alternative, evidence: Option<Evidence>, setting: Option<Setting> },
    /// All identifiable quantities of a joint that cannot be negative are negative.
    /// They are two at least. The signal is the one whose inversion fits better.
    WrongSignsOfJoint {
        joint: JointIndex,
        negative: usize,
        signal: Option<Signal>,
        setting: Option<Setting>,
    },
    /// The torques of these motors are absolute values.
    UnsignedTorque { motors: Vec<MotorIndex> },
    /// The torque of a motor never changes. Or it repeatedly stands at its largest value, and the
    /// model does not explain a joint of that motor.
    ClippedTorque { found: ClippedSignal },
    /// Positions of motors freeze and then jump, and the model does not explain one of their
    /// joints.
    FrozenSignal { found: FrozenSignal },
    /// The torque of a joint is many times its limit \[N·m or N\].
    OtherUnit { joint: JointIndex, torque: f64, limit: f64 },
    /// The data contradict a configured value, one of the `tests` values that they can contradict.
    Contradicted { nuisance: NuisanceEstimate, tests: usize, setting: Option<Setting> },
    /// The torque is uncertain outside the recorded motion. `freedoms` are the nuisance parameters
    /// with the largest torques in the data.
    Extrapolation { error: f64, limit: f64, freedoms: Vec<NuisanceEstimate> },
    /// The torque of one joint is uncertain outside the recorded motion.
    JointExtrapolation { joint: JointIndex, error: f64, limit: f64 },
    /// A joint moves no further than this in any recording.
    Unmoved { joint: JointIndex, span: f64, unit: &'static str },
    /// Parameters found without a fold predict it badly.
    HeldOut { error: f64, limit: f64 },
    /// The motion cannot be split into folds for cross-validation.
    TooFewMotions,
    /// Parameters with their combined uncertainty, relative to their values.
    Uncertain { parameters: Vec<(String, f64)>, limit: f64 },
    /// Torques along the simulated motion give other parameters than the positions.
    OtherParameters { name: String, deviations: f64, tests: usize },
    /// The instruments are barely correlated with the measured motion.
    WeakInstruments { correlation: f64 },
    /// The simulated torques differ by this many times the noise of IDIM-LS.
    AboveNoise { ratio: f64 },
    /// The torque of these joints is not recorded, so their inertia is not known.
    MissingTorque { joints: Vec<JointIndex> },
    /// The criterion barely depends on the parameters.
    Insensitive { output: Output, deviation: f64, loss: f64, singular_value: f64 },
    /// Finding of a stored result.
    Stored(Box<Finding>),
}

/// Fact that the user of a result must know and that does not speak against its use.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each fact has its figures")]
pub enum Note {
    /// The filtered measured position was used as the reference.
    NoReference,
    /// The substitute loop had to be slower than configured. The bandwidth is the smallest of a
    /// joint.
    SlowerLoop { bandwidth_hz: f64 },
    /// The residuals of these joints are not white.
    ColouredResiduals {
        joints: Vec<JointIndex>,
        decimated: bool,
        significance: Option<Significance>,
    },
    /// The position filter is too close to half the sample rate to be checked.
    PositionFilterUnchecked { cutoff_hz: f64 },
    /// The method does not check the effect of position noise.
    PositionNoiseIgnored,
    /// The loop could not be simulated with position noise.
    PositionNoiseNotSimulated,
    /// The torque delays could not be checked.
    DelayUnchecked,
    /// The described controller could not be compared with the recorded torques.
    ControllerUnchecked { why: ControllerUnchecked },
    /// Position filter and position noise shift a parameter.
    PositionBias { bias: PositionBias },
    /// The torque of a motor repeatedly stands at its largest value.
    ClippedTorque { found: ClippedSignal },
    /// Positions of motors freeze and then jump.
    FrozenSignal { found: FrozenSignal },
    /// Isolated groups of rows were downweighted: the times \[s\] of the first groups, and the
    /// number of further groups.
    Outliers { rows: usize, of: usize, times_s: Vec<Range<f64>>, more: usize },
    /// Rows were downweighted throughout the motion: joints, each with its number of such
    /// rows.
    DownweightedThroughout { joints: Vec<(JointIndex, usize)>, of: usize },
    /// Largest model error, if it is more than small.
    ModelError {
        nuisance: NuisanceEstimate,
        /// Number of the effects that were tested.
        tests: usize,
        /// Coupling that explains it.
        coupling: Option<Alternative>,
        setting: Option<Setting>,
    },
    /// Bodies with these parameters are far from the nominal ones.
    FarFromNominal { far: FarBody },
    /// Possible explanation of a large figure, although the figures of the required uses do not
    /// need it.
    Explanation(Reason),
    /// The bus layout counts frames and ignores their time stamps.
    RateUnchecked,
    /// The robot file does not specify the torque limits of these joints.
    TorqueLimitOpen { joints: Vec<JointIndex> },
    /// A centre is given without its frame. The link is the last one of the URDF.
    LoadFrame { link: String },
    /// The recorded torques lack joints or terms. The parameters are those that complete torques
    /// would identify.
    IncompleteTorque { joints: Vec<JointIndex>, terms: Vec<TorqueTerm>, parameters: Vec<String> },
    /// Finding of a stored result.
    Stored(Box<Finding>),
}

/// Reason why the described controller could not be compared with the recorded torques.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerUnchecked {
    /// Its gains substitute for those of the cabinet.
    StandIn,
    /// No reference was recorded.
    NoReference,
    /// It is sampled, and the recorded torque is not its command.
    NoCommand,
    /// It computes more often than the recording samples.
    BetweenSamples,
    /// There are too few rows to distinguish it from noise.
    TooFewRows,
}

/// The output of the closed loop whose error a method minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// CLIE: the torque.
    Torque,
    /// CLOE: the position.
    Position,
}

impl Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Torque => "torque",
            Self::Position => "position",
        })
    }
}

impl Reason {
    /// True if the reason reports something unidentifiable, and nothing against the result.
    pub fn is_unidentifiable(&self) -> bool {
        [FindingCode::TooFewMotions, FindingCode::IncompleteTorque].contains(&self.code())
    }

    /// Returns the finding, if it was read from a stored result.
    pub(super) fn stored(&self) -> Option<&Finding> {
        match self {
            Self::Stored(finding) => Some(finding),
            _ => None,
        }
    }

    /// True if wrong signals or a wrong configuration may be the cause of the reason. Otherwise the
    /// record contains too little information.
    pub(super) fn may_have_cause(&self) -> bool {
        !matches!(
            self,
            Self::ConditionNumber { .. }
                | Self::PredictionDeviation { .. }
                | Self::FewRows { .. }
                | Self::NotDecimated
                | Self::Unmoved { .. }
                | Self::TooFewMotions
                | Self::MissingTorque { .. }
        )
    }

    /// Returns the failure of the method, if the reason is one.
    pub fn failure(&self) -> Option<Failure> {
        match self.code() {
            FindingCode::LocalMinimum => Some(Failure::LocalMinimum),
            FindingCode::Insensitive => Some(Failure::Insensitive),
            _ => None,
        }
    }
}

impl Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Controller { joint, error, .. } => write!(
                f,
                "the command of the described controller of joint {joint} differs from the \
                 recorded one by {:.2} %: check its gains and timing, the reference and the \
                 drive's torque gain",
                100.0 * error
            ),
            Self::OppositeCommand { joint, .. } => write!(
                f,
                "the command of the described controller of joint {joint} differs from the \
                 recorded one by twice its size: the sign of its torque or position is wrong, or \
                 its gain three times too large"
            ),
            Self::ConditionNumber { value, limit } => write!(
                f,
                "condition number {value:.0} is above {limit}: the motion does not distinguish \
                 these parameters; move along a richer trajectory or identify fewer"
            ),
            Self::PredictionDeviation { joint, deviation, limit } => write!(
                f,
                "the parameters leave the torque of joint {joint} uncertain by {:.1} %, above \
                 {:.1} %: move longer or more, or identify fewer parameters",
                100.0 * deviation,
                100.0 * limit
            ),
            Self::RelativeError { error, limit } => write!(
                f,
                "relative error {:.1} % is above {:.1} %: the model does not describe the \
                 measured torques; check drive gains, signs and timing",
                100.0 * error,
                100.0 * limit
            ),
            Self::JointError { joint, error, limit } => write!(
                f,
                "relative error {:.1} % of joint {joint} is above {:.1} %: check its gear \
                 ratio, coupling and drive gain",
                100.0 * error,
                100.0 * limit
            ),
            Self::FewRows { per_parameter, limit } => write!(
                f,
                "{:.1} independent rows for each parameter, fewer than {limit}: their \
                    uncertainty cannot be estimated; move longer or identify fewer parameters",
                // Never rounded up to the limit.
                (10.0 * per_parameter).floor() / 10.0
            ),
            Self::NotDecimated => f.write_str(
                "identified without the decimation filter, for comparison only: the response of \
                    the loop to the quantised reference stays in the regressor; use the \
                    decimation filter",
            ),
            Self::Negative { quantity, name, value, standard_deviation, .. } => write!(
                f,
                "{quantity} {name} is negative, {value:.4} with a standard deviation of \
                 {standard_deviation:.2e}: check the signs of torque and transmission"
            ),
            Self::Indefinite { posture, deviations } => write!(
                f,
                "the mass matrix is not positive definite at q = ({}), by {deviations:.1} standard \
                 deviations: no arm has these inertias; move along a richer trajectory or identify \
                 fewer parameters",
                listed(posture.iter().map(|q| format!("{q:.2}")))
            ),
            Self::PhysicallyImpossible(no_bodies) => no_bodies.fmt(f),
            Self::WrongSigns { negative, of } => write!(
                f,
                "{negative} of {of} drive inertias and friction coefficients are negative: \
                    torques or positions have the wrong sign; invert one of the two"
            ),
            Self::OtherUnit { joint, torque, limit } => write!(
                f,
                "the torque of joint {joint} reaches {torque:.4}, {:.0} times its limit of \
                 {limit:.4} in the robot file: check the unit of the torques and the drive's gain, \
                 or correct the limit",
                torque / limit
            ),
            Self::Contradicted { nuisance, setting, .. } => {
                contradicted(f, nuisance)?;
                to_follow(f, setting.as_ref())
            }
            Self::Extrapolation { error, limit, freedoms } => {
                write!(
                    f,
                    "torque uncertainty outside the recorded motion is {:.1} %, above {:.1} %: \
                        record more and other motions, all joints over their range",
                    100.0 * error,
                    100.0 * limit
                )?;
                let wanted = |found: &NuisanceEstimate| {
                    let percent = 100.0 * found.relative_torque;
                    format!(
                        "{} ({:.3} N·m, {percent:.0} % at joint {})",
                        found.nuisance, found.torque_nm, found.joint
                    )
                };
                write!(f, "; largest nuisance parameters: {}", listed(freedoms.iter().map(wanted)))
            }
            Self::JointExtrapolation { joint, error, limit } => write!(
                f,
                "torque uncertainty of joint {joint} outside the recorded motion is {:.1} %, \
                    above {:.1} %: move this joint more, together with the others",
                100.0 * error,
                100.0 * limit
            ),
            Self::Unmoved { joint, span, unit } => write!(
                f,
                "joint {joint} does not move ({span:.4} {unit}): its torque cannot be \
                    predicted; record it moving over its range, or remove `prediction` from the \
                    required uses"
            ),
            Self::HeldOut { error, limit } => write!(
                f,
                "cross-validation error of {:.1} % is above {:.1} %: parameters predict parts \
                    of the motion badly that were not used to find them; record more and other \
                    motions",
                100.0 * error,
                100.0 * limit
            ),
            Self::TooFewMotions => f.write_str(
                "cross-validation needs two distinct motions that each identify the parameters; \
                    record more and other motions",
            ),
            Self::Uncertain { parameters, limit } => write!(
                f,
                "combined uncertainty above {:.0} %, from model error and configured values: {}",
                100.0 * limit,
                few_listed(
                    parameters
                        .iter()
                        .map(|(name, share)| format!("{name} ± {:.0} %", 100.0 * share))
                )
            ),
            Self::OtherParameters { name, deviations, .. } => write!(
                f,
                "the torques along the simulated motion give other parameters than the positions: \
                 {name} differs by {deviations:.1} standard deviations; check the described \
                 controller and the model, or identify from the torques (clie, didim)"
            ),
            Self::Alternative { found, setting, .. } => {
                write!(f, "{found}")?;
                to_follow(f, setting.as_ref())
            }
            Self::WrongSignsOfJoint { joint, negative, setting, .. } => {
                write!(
                    f,
                    "all {negative} identifiable drive inertias and friction coefficients of \
                        joint {joint} are negative: its torque or its position has the wrong \
                        sign; invert one of the two"
                )?;
                to_follow(f, setting.as_ref())
            }
            Self::FrozenSignal { found } => write!(f, "{}", Jumping(found)),
            Self::UnsignedTorque { motors } => write!(
                f,
                "the torques of {} never cross zero, and turn back before it: they are absolute \
                 values; record them with their signs",
                several_motors(motors)
            ),
            Self::ClippedTorque { found } if found.is_constant() => write!(
                f,
                "the torque of motor {} is {:.4} in all samples: it was not measured; check the \
                signal, or record it",
                found.motor, found.torque
            ),
            Self::ClippedTorque { found } => write!(
                f,
                "{}, and the model does not explain it: the signal looks clipped; \
                    {CHECK_THE_RANGE}",
                Standing(found)
            ),
            Self::WeakInstruments { correlation } => write!(
                f,
                "a combination of parameters has instruments with a correlation of \
                 {correlation:.2} only: the simulated motion is not the measured one; check \
                 reference and controller"
            ),
            Self::MissingTorque { joints } => write!(
                f,
                "no torque is recorded of joint {}: the mass matrix is not known there; record it, \
                 or use the result for the other joints alone",
                listed(joints)
            ),
            Self::AboveNoise { ratio } => write!(
                f,
                "the simulated torques differ by {ratio:.1} times the noise of IDIM-LS: a local \
                    minimum, or the described loop differs from the arm's; choose another \
                    start, and check reference and controller"
            ),
            Self::Insensitive { output, deviation, loss, singular_value } => write!(
                f,
                "the simulated {output}s hardly depend on the parameters, half of which stay \
                 uncertain by more than {:.0} %, and {loss:.0} times as uncertain as with IDIM-LS \
                 (smallest singular value {singular_value:.1e}): {}",
                100.0 * deviation,
                match output {
                    Output::Position => "identify from the torques (clie)",
                    Output::Torque => "identify from the measured motion (idim-ls)",
                }
            ),
            Self::Stored(finding) => f.write_str(&finding.message),
        }
    }
}

/// Remedy for a clipped torque.
const CHECK_THE_RANGE: &str = "check the range of the signal and the limit of the drive";

/// Text: when a position is frozen and how far it jumps.
struct Jumping<'a>(&'a FrozenSignal);

impl fmt::Display for Jumping<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FrozenSignal { motors, recording, from_s, until_s, jump, share } = self.0;
        let (percent, several) = (100.0 * share, motors.len() > 1);
        let motors: Vec<String> = motors.iter().map(ToString::to_string).collect();
        let (these, stand, jump_by, go) = match several {
            true => ("positions of motors", "stand", "jump by up to", "they go"),
            false => ("position of motor", "stands", "jumps by", "it goes"),
        };
        write!(
            f,
            "the {these} {} {stand} still from {from_s:.3} to {until_s:.3} s of recording \
             {recording} and then {jump_by} {jump:.0} times what {go} in a sample at the fastest; \
             {percent:.2} % of the samples are such: the log repeats old values there; take its \
             rows out of a table, which is then read in pieces, or record again",
            motors.join(", ")
        )
    }
}

/// Text: how often a torque stands at its largest value.
struct Standing<'a>(&'a ClippedSignal);

impl fmt::Display for Standing<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ClippedSignal { motor, torque, share } = self.0;
        let percent = 100.0 * share;
        write!(
            f,
            "the torque of motor {motor} stays at its largest value, {torque:.4}, in \
                {percent:.0} % of the samples of a recording"
        )
    }
}

/// Writes the key to change, if it is known.
fn to_follow(f: &mut fmt::Formatter<'_>, setting: Option<&Setting>) -> fmt::Result {
    setting.map_or(Ok(()), |setting| write!(f, "; to follow the data, set {setting}"))
}

/// Writes the deviation of a configured quantity, and the remedy.
fn contradicted(f: &mut fmt::Formatter<'_>, found: &NuisanceEstimate) -> fmt::Result {
    let Some(quantity) = found.quantity else { return write!(f, "{}", found.nuisance) };
    let (value, sd, stated) = (quantity.value, quantity.standard_deviation, quantity.configured);
    let nuisance = found.nuisance;
    match (found.correction_factor(), quantity.unit) {
        (Some([factor, deviation]), _) => write!(
            f,
            "the {nuisance} fits the data best at {factor:.3} ± {deviation:.3} times the \
                configured value (tolerance {:.1} %): check {}",
            100.0 * stated,
            match nuisance {
                NuisanceParameter::KnownTorque(_) => "`known_torque` in the robot's file",
                NuisanceParameter::PositionScale(_) =>
                    "the gear ratio and the scale of the position",
                _ => "the drive's gain and the gear ratio",
            }
        )?,
        (None, "s") => write!(
            f,
            "the {nuisance} fits the data best {:.2} ± {:.2} ms above the configured value \
                (tolerance {:.2} ms): check hold and delay of the torques",
            1e3 * value,
            1e3 * sd,
            1e3 * stated
        )?,
        (None, unit) if matches!(nuisance, NuisanceParameter::Zero(_)) => write!(
            f,
            "the {nuisance} fits the data best with {value:+.3} ± {sd:.2} {unit} added to the \
                positions (tolerance {stated:.3} {unit}): check it"
        )?,
        (None, unit) => write!(
            f,
            "the {nuisance} fits the data best {value:.3} ± {sd:.2} {unit} above the configured \
                value (tolerance {stated:.3} {unit}): check it"
        )?,
    }
    write!(f, "; it makes {:.3} N·m at joint {}", found.torque_nm, found.joint)
}

impl Note {
    /// True if the note is about a friction law of the model.
    pub fn is_about_friction_laws(&self) -> bool {
        let Self::ModelError { nuisance, .. } = self else { return false };
        nuisance.nuisance.is_friction()
    }

    /// True if the note asks for another cut-off of the position filter.
    pub fn is_about_cutoff(&self) -> bool {
        matches!(self, Self::PositionBias { .. })
    }
}

/// Writes the content that recorded torques lack, and the parameters that are not identifiable
/// without it.
fn incomplete(
    f: &mut fmt::Formatter<'_>,
    joints: &[JointIndex],
    terms: &[TorqueTerm],
    parameters: &[String],
) -> fmt::Result {
    if !joints.is_empty() {
        write!(f, "no torque of joint {} is used", listed(joints))?;
    }
    if !terms.is_empty() {
        let and = if joints.is_empty() { "" } else { ", and " };
        write!(f, "{and}the recorded torques do not contain {}", listed(terms))?;
    }
    match parameters.len() {
        0 => Ok(()),
        count => write!(
            f,
            ": without it {count} base parameters are not identifiable: {}",
            few_listed(parameters)
        ),
    }
}

/// Writes the model error, its size, and the remedy.
fn lacking(f: &mut fmt::Formatter<'_>, found: &NuisanceEstimate) -> fmt::Result {
    let (freedom, joint) = (found.nuisance, found.joint);
    write!(
        f,
        "largest unmodelled effect: {freedom}, {:.3} N·m or {:.1} % of the torque of joint \
            {joint}",
        found.torque_nm,
        100.0 * found.relative_torque
    )?;
    f.write_str(match freedom {
        NuisanceParameter::JointFriction(_) | NuisanceParameter::MotorFriction(_) => {
            "; `friction = \"auto\"` tries other laws on a recording"
        }
        NuisanceParameter::Coupling { .. } => {
            "; check the rows of both motors in `transmission.rows`"
        }
        NuisanceParameter::LeftOutParameters => {
            "; `identify --essential` finds those that a motion needs"
        }
        _ => "",
    })
}

impl Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ModelError { nuisance, setting, .. } => {
                lacking(f, nuisance)?;
                to_follow(f, setting.as_ref())
            }
            Self::FarFromNominal { far } => far.fmt(f),
            Self::NoReference => f.write_str(
                "no reference was recorded: the filtered measured position replaces it. The \
                    simulated loop follows it with a lag, so this result is nearly that of \
                    IDIM-LS at best",
            ),
            Self::ColouredResiduals { joints, decimated, .. } => write!(
                f,
                "the residuals of joint {} are not white{}; the standard deviations include this",
                listed(joints),
                if *decimated { " behind the decimation filter" } else { "" }
            ),
            Self::PositionFilterUnchecked { cutoff_hz } => write!(
                f,
                "the effect of the position filter at {cutoff_hz} Hz could not be checked, because \
                 the cut-off is too close to half the sample rate"
            ),
            Self::SlowerLoop { bandwidth_hz } => write!(
                f,
                "the simulated loop has a bandwidth of {bandwidth_hz:.1} Hz at one joint, lower \
                    than configured: a faster one was unstable at this sample rate"
            ),
            Self::ClippedTorque { found } => write!(
                f,
                "{}: if the signal is clipped there, the parameters are wrong; {CHECK_THE_RANGE}",
                Standing(found)
            ),
            Self::FrozenSignal { found } => write!(f, "{}", Jumping(found)),
            Self::PositionNoiseIgnored => {
                f.write_str("this method does not check the effect of the noise of the positions")
            }
            Self::PositionNoiseNotSimulated => f.write_str(
                "the effect of the noise of the positions on the loop could not be simulated",
            ),
            Self::DelayUnchecked => f.write_str(
                "the delay of the torques could not be checked: too few rows are left over, or \
                 nothing moves",
            ),
            Self::ControllerUnchecked { why } => write!(
                f,
                "the described controller could not be held against the recorded torques: {}",
                match why {
                    ControllerUnchecked::StandIn => "its gains stand in for unknown ones",
                    ControllerUnchecked::NoReference => "no reference was recorded",
                    ControllerUnchecked::NoCommand =>
                        "it is sampled, and the torques are not stated to be held commands",
                    ControllerUnchecked::BetweenSamples =>
                        "it computes with another period than that of the record",
                    ControllerUnchecked::TooFewRows =>
                        "there are too few rows to tell it from noise",
                }
            ),
            Self::PositionBias { bias } => write!(
                f,
                "{} moves {} by {:.1} standard deviations, which its combined uncertainty allows \
                 for: {}",
                if bias.by_filter {
                    "the position filter distorts the motion and"
                } else {
                    "the noise of the positions distorts the friction law and"
                },
                bias.parameter,
                bias.deviations.abs(),
                if bias.by_filter {
                    "raise its cut-off"
                } else {
                    "measure positions with less noise; with idim-ls, lower the cut-off of the \
                     position filter"
                }
            ),
            Self::Outliers { rows, of, times_s, more } => {
                let times = times_s.iter().map(|t| format!("{:.2} to {:.2} s", t.start, t.end));
                write!(f, "{rows} of {of} rows were downweighted, at {}", listed(times))?;
                if *more > 0 {
                    write!(f, " and at {more} more times")?;
                }
                f.write_str(": check there, an encoder, a connector or a contact may be at fault")
            }
            Self::TorqueLimitOpen { joints } => write!(
                f,
                "joint {} has no torque limit above the recorded torques: their unit is not \
                 checked against it, and a small torque counts as a share of the largest torque of \
                 any joint; state torque_max_nm in the robot file",
                listed(joints.iter().map(ToString::to_string))
            ),
            Self::LoadFrame { link } => write!(
                f,
                "the given centre counts in the model's own frame of the last link, as in earlier \
                 versions, not in that of a link of the URDF; name its frame: `--frame {link}`, or \
                 `frame = \"{link}\"` in [payload] of the cell"
            ),
            Self::IncompleteTorque { joints, terms, parameters } => {
                incomplete(f, joints, terms, parameters)
            }
            Self::Explanation(reason) => reason.fmt(f),
            Self::Stored(finding) => f.write_str(&finding.message),
            Self::RateUnchecked => f.write_str(
                "the sample rate is taken as stated, for the frames or rows count and no time: \
                 neither it nor a lost sample can be checked",
            ),
            Self::DownweightedThroughout { joints, of } => {
                let share = |(joint, rows): &(JointIndex, usize)| {
                    let percent = 100.0 * *rows as f64 / *of as f64;
                    format!("{percent:.0} % of the rows of joint {joint}")
                };
                write!(
                    f,
                    "{} were downweighted throughout the motion, which is too much for \
                        outliers: check the residuals, the model may not describe this motion",
                    listed(joints.iter().map(share))
                )
            }
        }
    }
}

/// Largest number of names in a message. The finding has all of them.
const MAX_NAMES: usize = 3;

/// `a, b, c and 25 more`
fn few_listed(items: impl IntoIterator<Item = impl Display>) -> String {
    let mut items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    let more = items.len().saturating_sub(MAX_NAMES);
    if more < 2 {
        return items.join(", ");
    }
    items.truncate(MAX_NAMES);
    format!("{} and {more} more", items.join(", "))
}

/// Returns the names of one or several motors.
fn several_motors(motors: &[MotorIndex]) -> String {
    format!("motor{} {}", if motors.len() > 1 { "s" } else { "" }, listed(motors))
}

/// `a, b, c`
fn listed(items: impl IntoIterator<Item = impl Display>) -> String {
    let items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    items.join(", ")
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Serialize for Note {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Reason {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let message = String::deserialize(deserializer)?;
        Ok(Self::Stored(Box::new(Finding::from_sentence(message, Severity::Blocking))))
    }
}

impl<'de> Deserialize<'de> for Note {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let message = String::deserialize(deserializer)?;
        Ok(Self::Stored(Box::new(Finding::from_sentence(message, Severity::Advisory))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncertain_torque_is_stated_in_per_cent() {
        let joint = JointIndex::new(1);
        let reason = Reason::PredictionDeviation { joint, deviation: 0.123, limit: 0.1 };
        let text = reason.to_string();
        assert!(text.contains("joint 2 uncertain by 12.3 %, above 10.0 %"), "{text}");
    }
}
