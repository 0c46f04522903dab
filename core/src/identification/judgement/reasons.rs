//! What speaks against a result, and what must be known with it: facts, worded here and nowhere else.

use core::fmt::{self, Display};
use core::ops::Range;

use serde::{Serialize, Serializer};

use super::alternative::{Alternative, ModelCheck};
use crate::identification::given::Failure;

/// What speaks against the use of a result. Joints are numbered from 1; errors and deviations are
/// shares of the torque unless they say otherwise.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    missing_docs,
    reason = "each fact has its figure, and the limit that it exceeds if it has one"
)]
pub enum Reason {
    /// The described controller does not reproduce the recorded command.
    Controller { joint: usize, error: f64 },
    /// The motion does not distinguish the parameters.
    ConditionNumber { value: f64, limit: f64 },
    /// The parameters leave the torque of a joint uncertain.
    PredictionDeviation { joint: usize, deviation: f64, limit: f64 },
    /// The model does not describe the torques.
    RelativeError { error: f64, limit: f64 },
    /// The model does not describe the torque of a joint.
    JointError { joint: usize, error: f64, limit: f64 },
    /// Too few independent rows for each parameter.
    FewRows { per_parameter: f64, limit: f64 },
    /// Identified without the decimation filter.
    NotDecimated,
    /// A parameter that stands for itself alone is below zero and cannot be.
    Negative { quantity: &'static str, name: String, value: f64, standard_deviation: f64 },
    /// The mass matrix is not positive definite at a posture \[rad or m\].
    Indefinite { posture: Vec<f64> },
    /// Alternative models of one kind that the data support.
    Model { checks: Vec<ModelCheck> },
    /// Torques along the simulated motion give other parameters than the positions do.
    OtherParameters { name: String, deviations: f64 },
    /// The instruments are hardly correlated with the measured motion.
    WeakInstruments { correlation: f64 },
    /// The simulated torques differ by this many times the noise of IDIM-LS.
    AboveNoise { ratio: f64 },
    /// The criterion hardly depends on the parameters.
    Insensitive { output: Output, deviation: f64, loss: f64, singular_value: f64 },
}

/// What must be known with a result and does not speak against its use.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each fact has its figures")]
pub enum Note {
    /// The filtered measured position was used as the reference.
    NoReference,
    /// These parameters may be zero.
    Insignificant { names: Vec<String> },
    /// The residuals of these joints, numbered from 1, are not white.
    ColouredResiduals { joints: Vec<usize>, decimated: bool },
    /// The position filter is too close to half the sample rate to be checked.
    PositionFilterUnchecked { cutoff_hz: f64 },
    /// The method does not check the effect of the noise of the positions.
    PositionNoiseIgnored,
    /// The loop could not be simulated with the noise of the positions.
    PositionNoiseNotSimulated,
    /// The alternatives could not be checked.
    DelayUnchecked,
    /// Isolated groups of rows were weighted down: the times \[s\] of the first, and how many are more.
    Outliers { rows: usize, of: usize, times_s: Vec<Range<f64>>, more: usize },
    /// Rows were weighted down throughout the motion: joints, from 1, with how many of the rows
    /// of each.
    DownweightedThroughout { joints: Vec<(usize, usize)>, of: usize },
    /// The bus's layout lets the frames count, whatever their stamps.
    RateUnchecked,
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
    /// The failure of the method, where the reason is one.
    pub fn failure(&self) -> Option<Failure> {
        match self {
            Self::AboveNoise { .. } => Some(Failure::LocalMinimum),
            Self::Insensitive { .. } => Some(Failure::Insensitive),
            _ => None,
        }
    }
}

impl Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Controller { joint, error } => write!(
                f,
                "the command of the described controller of joint {joint} differs from the \
                 recorded one by {:.2} %: check its gains and timing, the reference and the \
                 drive's torque gain first; the other reasons may follow from it",
                100.0 * error
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
                "{per_parameter:.1} independent rows for each parameter are fewer than {limit}: too \
                 few to say how uncertain they are; move longer or identify fewer parameters"
            ),
            Self::NotDecimated => f.write_str(
                "identified without the decimation filter, which is for comparison only: the \
                 loop's response to the quantised reference stays in the regressor; decimate",
            ),
            Self::Negative { quantity, name, value, standard_deviation } => write!(
                f,
                "{quantity} {name} is negative, {value:.4} with a standard deviation of \
                 {standard_deviation:.2e}: check the signs of torque and transmission"
            ),
            Self::Indefinite { posture } => write!(
                f,
                "the mass matrix is not positive definite at q = ({}): no arm has these inertias; \
                 move along a richer trajectory or identify fewer parameters",
                listed(posture.iter().map(|q| format!("{q:.2}")))
            ),
            Self::Model { checks } => model(f, checks),
            Self::OtherParameters { name, deviations } => write!(
                f,
                "the torques along the simulated motion give other parameters than the positions: \
                 {name} differs by {deviations:.1} standard deviations; check the described \
                 controller and the model, or identify from the torques (clie, didim)"
            ),
            Self::WeakInstruments { correlation } => write!(
                f,
                "a combination of parameters has instruments with a correlation of {correlation:.2} \
                 only: the simulated motion is not the measured one; check reference and controller"
            ),
            Self::AboveNoise { ratio } => write!(
                f,
                "the simulated torques differ by {ratio:.1} times the noise of IDIM-LS: a local \
                 minimum, or a described loop that is not the arm's; choose another start, and \
                 check reference and controller"
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
        }
    }
}

/// Alternatives of one kind: where they all are, and which parameter the worst would change.
fn model(f: &mut fmt::Formatter<'_>, checks: &[ModelCheck]) -> fmt::Result {
    let by_shift = |a: &&ModelCheck, b: &&ModelCheck| {
        a.shift_deviations.abs().total_cmp(&b.shift_deviations.abs())
    };
    let Some(worst) = checks.iter().max_by(by_shift) else { return Ok(()) };
    let (problem, remedy) = match worst.alternative {
        Alternative::JointFriction(_) | Alternative::MotorFriction(_) => {
            ("is not that of the model", "choose another sign model, one that fits no worse")
        }
        Alternative::TorqueDelay => {
            ("is not as stated", "check the torque's hold and delay, with didim the controller too")
        }
        Alternative::TorqueGain(_) => {
            ("does not fit those of the others", "check drive gain and gear ratio")
        }
        Alternative::LeftOutParameters => {
            ("are not zero", "identify more parameters, and check for a payload")
        }
        Alternative::PositionFilter => ("distorts the motion", "raise its cut-off"),
        Alternative::PositionNoise => (
            "distorts the friction law",
            "measure positions with less noise; with idim-ls, lower the cut-off of the position \
             filter",
        ),
    };
    // "friction law of joint 1, joint 2": what it is of, from the second on.
    let first = checks.iter().take(1).map(|check| check.alternative.to_string());
    let others = checks.iter().skip(1).filter_map(|check| check.alternative.place());
    write!(
        f,
        "the {} {problem}: allowing for it, {} would change by {:.1} standard deviations; {remedy}",
        listed(first.chain(others)),
        worst.parameter,
        worst.shift_deviations.abs()
    )
}

impl Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReference => f.write_str(
                "no reference was recorded: the filtered measured position is used instead, which \
                 the simulated loop follows with a lag of its own; at best this result is nearly \
                 that of IDIM-LS",
            ),
            Self::Insignificant { names } => write!(
                f,
                "not significantly different from zero with this motion: {}; leave them out, or move \
                 the joints concerned more",
                names.join(", ")
            ),
            Self::ColouredResiduals { joints, decimated } => write!(
                f,
                "the residuals of joint {} are not white{}; the standard deviations allow for it",
                listed(joints),
                if *decimated { " behind the decimation filter" } else { "" }
            ),
            Self::PositionFilterUnchecked { cutoff_hz } => write!(
                f,
                "the effect of the position filter at {cutoff_hz} Hz could not be checked, because \
                 the cut-off is too close to half the sample rate"
            ),
            Self::PositionNoiseIgnored => {
                f.write_str("this method does not check the effect of the noise of the positions")
            }
            Self::PositionNoiseNotSimulated => f.write_str(
                "the effect of the noise of the positions on the loop could not be simulated",
            ),
            Self::DelayUnchecked => f.write_str(
                "the delay of the torques and some other assumptions could not be checked: too few \
                 rows are left over, or nothing moves",
            ),
            Self::Outliers { rows, of, times_s, more } => {
                let times = times_s.iter().map(|t| format!("{:.2} to {:.2} s", t.start, t.end));
                write!(f, "{rows} of {of} rows were weighted down, at {}", listed(times))?;
                if *more > 0 {
                    write!(f, " and at {more} more times")?;
                }
                f.write_str(": check there, an encoder, a connector or a contact may be at fault")
            }
            Self::RateUnchecked => f.write_str(
                "with cycles_by = \"frames\" the sample rate is taken as stated: neither it nor a \
                 SYNC lost on the wire can be checked",
            ),
            Self::DownweightedThroughout { joints, of } => {
                let share = |(joint, rows): &(usize, usize)| {
                    let percent = 100.0 * *rows as f64 / *of as f64;
                    format!("{percent:.0} % of the rows of joint {joint}")
                };
                write!(
                    f,
                    "{} were weighted down throughout the motion, which is too much for outliers: \
                     look at the residuals, the model may not describe this motion",
                    listed(joints.iter().map(share))
                )
            }
        }
    }
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
