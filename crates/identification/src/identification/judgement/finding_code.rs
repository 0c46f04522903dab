//! Codes and severities of findings.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Consequence of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The result is not usable for the uses that the finding names.
    Blocking,
    /// The finding may explain why the uses that it names are refused. It does not block them: the
    /// figures do.
    Explanatory,
    /// The finding is for information only; it does not block any use.
    Advisory,
}

macro_rules! finding_codes {
    ($($(#[$doc:meta])* $code:ident = $name:literal),* $(,)?) => {
        /// Code of a finding. Its name is part of the result's JSON and does not change.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum FindingCode {
            $($(#[$doc])* #[serde(rename = $name)] $code,)*
            /// A finding of another version of the program, with its message.
            #[serde(other, rename = "other")]
            Other,
        }

        impl FindingCode {
            /// Every code, in the order of the reference page.
            pub const ALL: &[Self] = &[$(Self::$code,)* Self::Other];

            /// Returns the name that is used in JSON.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$code => $name,)*
                    Self::Other => "other",
                }
            }
        }
    };
}

impl FindingCode {
    /// Returns the place of the finding in a list: 0 for what the commands of the controller say,
    /// then other causes, then the figures that exceed their limits, which follow from causes.
    pub(super) fn rank(self) -> usize {
        match self {
            Self::OppositeCommand | Self::Controller => 0,
            Self::ConditionNumber
            | Self::TorqueUncertainty
            | Self::RelativeError
            | Self::JointError
            | Self::FewRows
            | Self::NotDecimated
            | Self::NegativeParameter
            | Self::IndefiniteMassMatrix
            | Self::NoBodies
            | Self::Extrapolation
            | Self::JointExtrapolation
            | Self::JointAtRest
            | Self::CrossValidation
            | Self::TooFewMotions
            | Self::ParameterUncertainty => 2,
            _ => 1,
        }
    }
}

finding_codes! {
    /// A torque has the wrong sign, or its gain is three times too large.
    OppositeCommand = "opposite-command",
    /// The described controller did not command the recorded torques.
    Controller = "controller",
    /// The motion does not distinguish the parameters.
    ConditionNumber = "condition-number",
    /// The statistical uncertainty of the torque along the motion is too large.
    TorqueUncertainty = "torque-uncertainty",
    /// The relative error is too large: the model does not describe the torques.
    RelativeError = "relative-error",
    /// The relative error of one joint is too large.
    JointError = "joint-error",
    /// There are too few independent rows for reliable standard deviations.
    FewRows = "few-rows",
    /// The result was computed without decimation and is for comparison only.
    NotDecimated = "not-decimated",
    /// A parameter that cannot be negative is negative by more than its uncertainty.
    NegativeParameter = "negative-parameter",
    /// The mass matrix is not positive definite in some posture.
    IndefiniteMassMatrix = "indefinite-mass-matrix",
    /// No physically consistent parameters fit.
    NoBodies = "no-bodies",
    /// All torques or all positions are sign-flipped.
    WrongSigns = "wrong-signs",
    /// The torque or the position of this joint is sign-flipped.
    WrongSignsOfJoint = "wrong-signs-of-joint",
    /// A torque has a wrong unit or gain.
    OtherUnit = "other-unit",
    /// A torque or a position is sign-flipped: the other sign fits decisively better.
    OppositeSignal = "opposite-signal",
    /// Two drives are swapped.
    SwappedMotors = "swapped-motors",
    /// A torque or a position is late.
    LateSignal = "late-signal",
    /// A position has another scale, as with a wrong gear ratio.
    PositionScale = "position-scale",
    /// A motor is coupled to another joint, or with another sign or ratio.
    Coupling = "coupling",
    /// The inertia of a drive is missing in the model.
    DriveInertia = "drive-inertia",
    /// The direction of gravity differs: the arm is mounted differently.
    GravityDirection = "gravity-direction",
    /// The recorded torques do not contain gravity.
    GravityRemoved = "gravity-removed",
    /// A torque signal is constant.
    ConstantTorque = "constant-torque",
    /// The torques are absolute values.
    UnsignedTorque = "unsigned-torque",
    /// The torque is clipped, and the residual is large.
    ClippedTorque = "clipped-torque",
    /// A position signal is frozen and then jumps, because the log repeats old values.
    FrozenPosition = "frozen-position",
    /// The data contradict the configured torque gain.
    TorqueGain = "torque-gain",
    /// The data contradict the configured torque delay.
    TorqueDelay = "torque-delay",
    /// The data contradict the configured `known_torque`.
    KnownTorque = "known-torque",
    /// The data contradict a configured zero position or the geometry.
    Geometry = "geometry",
    /// The torque uncertainty outside the recorded motion is too large; the message names the
    /// largest nuisance parameters.
    Extrapolation = "extrapolation",
    /// The torque uncertainty of one joint outside the recorded motion is too large.
    JointExtrapolation = "joint-extrapolation",
    /// The friction and inertia of a joint at rest are unknown.
    JointAtRest = "joint-at-rest",
    /// The cross-validation error is too large.
    CrossValidation = "cross-validation",
    /// Cross-validation is impossible: repeats contain nothing new.
    TooFewMotions = "too-few-motions",
    /// The combined uncertainty of required parameters is too large.
    ParameterUncertainty = "parameter-uncertainty",
    /// CLOE: positions and torques disagree, so the controller or the model is wrong.
    PositionsDisagree = "positions-disagree",
    /// The iteration ended in a local minimum, or the simulated loop is not the real one.
    LocalMinimum = "local-minimum",
    /// The criterion is insensitive to the parameters.
    Insensitive = "insensitive",
    /// IDIM-IV: the simulated motion differs too much from the measured one.
    WeakInstruments = "weak-instruments",
    /// The filtered measured position replaces the reference.
    NoReference = "no-reference",
    /// The substitute loop was slowed down, because a faster one diverges at this sample rate.
    SlowerLoop = "slower-loop",
    /// The residuals are coloured; the standard deviations account for it.
    ColouredResiduals = "coloured-residuals",
    /// The position filter was not checked, because its cut-off is close to half the sample rate.
    PositionFilterUnchecked = "position-filter-unchecked",
    /// The check for position noise did not run.
    PositionNoiseUnchecked = "position-noise-unchecked",
    /// The torque delay was not checked: there are too few rows, or nothing moves.
    TorqueDelayUnchecked = "torque-delay-unchecked",
    /// The check of the controller did not run.
    ControllerUnchecked = "controller-unchecked",
    /// The position filter biases a parameter; the combined uncertainty includes this bias.
    FilterBias = "filter-bias",
    /// Position noise biases a parameter; the combined uncertainty includes this bias.
    NoiseBias = "noise-bias",
    /// A filter in the drive or the logger acted on the signals; the combined uncertainty includes
    /// its effect.
    LowPassed = "low-passed",
    /// The record contains outliers; the message lists their times.
    Outliers = "outliers",
    /// Rows are downweighted all over the record: there are too many outliers.
    DownweightedThroughout = "downweighted-throughout",
    /// Largest effect in the data that the model does not contain.
    UnmodelledEffect = "unmodelled-effect",
    /// The bodies are physically consistent, but one is far from its nominal link.
    FarFromNominal = "far-from-nominal",
    /// The sample rate was not checked, because the record has frame or row numbers instead of
    /// times.
    RateUnchecked = "rate-unchecked",
    /// The unit of the torques was not checked.
    TorqueLimitOpen = "torque-limit-open",
    /// A centre of mass is given without the name of its frame.
    LoadFrame = "load-frame",
    /// The recorded torques lack joints or terms, so some parameters are not identifiable.
    IncompleteTorque = "incomplete-torque",
}
