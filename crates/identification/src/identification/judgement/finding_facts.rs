//! Code, subject and figure of each reason and note, and the list of the findings of a verdict.

use didim_dynamics::robot::JointIndex;

use super::alternatives::{Alternative, Evidence, Lag};
use super::clipped_signal::ClippedSignal;
use super::finding::{Finding, Subject};
use super::finding_code::{FindingCode, Severity};
use super::nuisance_parameters::{NuisanceEstimate, NuisanceParameter};
use super::reasons::{Note, Reason};
use super::significance::Significance;
use crate::identification::problem::Use;

/// Subject of a finding, and its figure with the limit.
#[derive(Default)]
struct Facts {
    subject: Option<Subject>,
    figure: Option<f64>,
    limit: Option<f64>,
    unit: Option<&'static str>,
    significance: Option<Significance>,
}

impl Facts {
    fn new(subject: Option<Subject>, figure: f64, unit: &'static str) -> Self {
        let (figure, unit) = (Some(figure), Some(unit));
        Self { subject, figure, unit, ..Self::default() }
    }

    fn of_joint(joint: JointIndex, figure: f64, unit: &'static str) -> Self {
        Self::new(Some(Subject::Joints(vec![joint])), figure, unit)
    }

    fn about(subject: Subject) -> Self {
        Self { subject: Some(subject), ..Self::default() }
    }

    fn with_limit(self, limit: f64) -> Self {
        Self { limit: Some(limit), ..self }
    }

    fn by_test(self, significance: Option<Significance>) -> Self {
        Self { significance, ..self }
    }

    fn finding(
        self,
        code: FindingCode,
        severity: Severity,
        uses: Vec<Use>,
        message: String,
    ) -> Finding {
        let Self { subject, figure, limit, unit, significance } = self;
        // JSON cannot represent numbers that are not finite.
        let [figure, limit] = [figure, limit].map(|of| of.filter(|value| value.is_finite()));
        let unit = unit.map(str::to_owned);
        let set = None;
        Finding { code, severity, uses, subject, figure, limit, unit, significance, set, message }
    }
}

impl Finding {
    /// Returns the findings of notes outside a verdict.
    pub fn from_notes(notes: &[Note]) -> Vec<Self> {
        Self::list(&[], notes)
    }

    /// Returns the findings of a verdict: each reason once, with the uses that it blocks or
    /// explains, then the notes. Each use comes with its reasons, and with those of them that only
    /// explain others.
    pub(super) fn list(uses: &[(Use, &[Reason], &[Reason])], notes: &[Note]) -> Vec<Self> {
        let mut reasons: Vec<&Reason> = Vec::new();
        for reason in uses.iter().flat_map(|(_, reasons, _)| *reasons) {
            if !reasons.contains(&reason) {
                reasons.push(reason);
            }
        }
        // Causes before the figures that follow from them.
        reasons.sort_by_key(|reason| reason.code().rank());
        let finding = |reason: &Reason| {
            if let Some(finding) = reason.stored() {
                return finding.clone();
            }
            let of = uses.iter().filter(|(_, reasons, _)| reasons.contains(reason));
            let (explained, blocked): (Vec<_>, Vec<_>) =
                of.partition(|(_, _, explanations)| explanations.contains(reason));
            let named = |uses: Vec<&(Use, &[Reason], &[Reason])>| {
                uses.into_iter().map(|(usage, ..)| *usage).collect::<Vec<Use>>()
            };
            let (severity, affected) = match blocked.is_empty() {
                true => (Severity::Explanatory, explained),
                false => (Severity::Blocking, blocked),
            };
            let message = reason.to_string();
            let found = reason.facts().finding(reason.code(), severity, named(affected), message);
            Self { set: reason.setting().cloned(), ..found }
        };
        let is_listed = |note: &&Note| match note {
            Note::Explanation(reason) => reasons.contains(&reason),
            Note::Stored(found) => reasons.iter().any(|of| of.stored() == Some(found)),
            _ => false,
        };
        let advisory = notes.iter().filter(|note| !is_listed(note)).map(|note| {
            if let Note::Stored(finding) = note {
                return Finding::clone(finding);
            }
            let (uses, message) = (Vec::new(), note.to_string());
            let found = note.facts().finding(note.code(), Severity::Advisory, uses, message);
            Self { set: note.setting().cloned(), ..found }
        });
        reasons.iter().copied().map(finding).chain(advisory).collect()
    }
}

impl Reason {
    /// Returns the code of the finding.
    pub fn code(&self) -> FindingCode {
        use FindingCode as Code;

        match self {
            Self::Controller { .. } => Code::Controller,
            Self::ConditionNumber { .. } => Code::ConditionNumber,
            Self::PredictionDeviation { .. } => Code::TorqueUncertainty,
            Self::RelativeError { .. } => Code::RelativeError,
            Self::JointError { .. } => Code::JointError,
            Self::FewRows { .. } => Code::FewRows,
            Self::NotDecimated => Code::NotDecimated,
            Self::Negative { .. } => Code::NegativeParameter,
            Self::Indefinite { .. } => Code::IndefiniteMassMatrix,
            Self::PhysicallyImpossible(_) => Code::NoBodies,
            Self::OppositeCommand { .. } => Code::OppositeCommand,
            Self::WrongSigns { .. } => Code::WrongSigns,
            Self::Alternative { found, .. } => match found {
                Alternative::OppositeSign { .. } => Code::OppositeSignal,
                Alternative::Swapped { .. } => Code::SwappedMotors,
                Alternative::Late { lag: Lag::LowPass, .. } => Code::LowPassed,
                Alternative::Late { lag: Lag::Delay, .. } => Code::LateSignal,
                Alternative::PositionScale { .. } => Code::PositionScale,
                Alternative::TorqueScale { .. } => Code::TorqueGain,
                Alternative::Coupling { .. } => Code::Coupling,
                Alternative::DriveInertia { .. } => Code::DriveInertia,
                Alternative::NoGravity => Code::GravityRemoved,
                Alternative::Gravity { .. } | Alternative::Leaning(_) => Code::GravityDirection,
            },
            Self::WrongSignsOfJoint { .. } => Code::WrongSignsOfJoint,
            Self::UnsignedTorque { .. } => Code::UnsignedTorque,
            Self::ClippedTorque { found } if found.is_constant() => Code::ConstantTorque,
            Self::ClippedTorque { .. } => Code::ClippedTorque,
            Self::FrozenSignal { .. } => Code::FrozenPosition,
            Self::OtherUnit { .. } => Code::OtherUnit,
            Self::Contradicted { nuisance, .. } => match nuisance.nuisance {
                NuisanceParameter::TorqueGain(_) | NuisanceParameter::CommonGain => {
                    Code::TorqueGain
                }
                NuisanceParameter::TorqueDelay(_) => Code::TorqueDelay,
                NuisanceParameter::KnownTorque(_) => Code::KnownTorque,
                NuisanceParameter::PositionScale(_) => Code::PositionScale,
                _ => Code::Geometry,
            },
            Self::Extrapolation { .. } => Code::Extrapolation,
            Self::JointExtrapolation { .. } => Code::JointExtrapolation,
            Self::Unmoved { .. } => Code::JointAtRest,
            Self::HeldOut { .. } => Code::CrossValidation,
            Self::TooFewMotions => Code::TooFewMotions,
            Self::Uncertain { .. } => Code::ParameterUncertainty,
            Self::OtherParameters { .. } => Code::PositionsDisagree,
            Self::WeakInstruments { .. } => Code::WeakInstruments,
            Self::AboveNoise { .. } => Code::LocalMinimum,
            Self::Insensitive { .. } => Code::Insensitive,
            Self::MissingTorque { .. } => Code::IncompleteTorque,
            Self::Stored(finding) => finding.code,
        }
    }

    fn facts(&self) -> Facts {
        match self {
            Self::Controller { joint, error, significance }
            | Self::OppositeCommand { joint, error, significance } => {
                Facts::of_joint(*joint, *error, "1").by_test(*significance)
            }
            Self::ConditionNumber { value, limit } => {
                Facts::new(None, *value, "1").with_limit(*limit)
            }
            Self::PredictionDeviation { joint, deviation: figure, limit }
            | Self::JointError { joint, error: figure, limit }
            | Self::JointExtrapolation { joint, error: figure, limit } => {
                Facts::of_joint(*joint, *figure, "1").with_limit(*limit)
            }
            Self::RelativeError { error: figure, limit }
            | Self::Extrapolation { error: figure, limit, .. }
            | Self::HeldOut { error: figure, limit }
            | Self::FewRows { per_parameter: figure, limit } => {
                Facts::new(None, *figure, "1").with_limit(*limit)
            }
            Self::NotDecimated | Self::TooFewMotions => Facts::default(),
            Self::Negative { name, value, standard_deviation, tests, .. } => {
                let subject = Subject::Parameters(vec![name.clone()]);
                let deviations = value / standard_deviation;
                let significance = Significance::of_deficit(deviations, *tests);
                Facts::new(Some(subject), deviations, "σ").by_test(significance)
            }
            Self::Indefinite { deviations, .. } => Facts::new(None, *deviations, "σ"),
            Self::PhysicallyImpossible(found) => {
                let names = found.impossible_values.iter().map(|shift| shift.name.clone());
                let subject = Subject::Parameters(names.collect());
                Facts::new(Some(subject), found.cost, "1").with_limit(found.threshold)
            }
            Self::WrongSigns { negative, of } => Facts::new(None, share(*negative, *of), "1"),
            Self::WrongSignsOfJoint { joint, negative, .. } => {
                Facts::of_joint(*joint, count(*negative), "1")
            }
            Self::Alternative { found, evidence, .. } => of_alternative(found, *evidence),
            Self::UnsignedTorque { motors } => Facts::about(Subject::Motors(motors.clone())),
            Self::ClippedTorque { found } => clipped(found),
            Self::FrozenSignal { found } => {
                Facts::new(Some(Subject::Motors(found.motors.clone())), found.share, "1")
            }
            Self::OtherUnit { joint, torque, limit } => {
                Facts::of_joint(*joint, torque / limit, "1").with_limit(1.0)
            }
            Self::Contradicted { nuisance, tests, .. } => {
                let quantity = nuisance.quantity;
                let significance =
                    quantity.and_then(|of| Significance::of_deviation(of.contradiction(), *tests));
                correction(nuisance).by_test(significance)
            }
            Self::MissingTorque { joints } => Facts::about(Subject::Joints(joints.clone())),
            Self::Unmoved { joint, span, unit } => Facts::of_joint(*joint, *span, unit),
            Self::Uncertain { parameters, limit } => {
                let worst = parameters.iter().map(|(_, share)| *share).fold(0.0, f64::max);
                let names = parameters.iter().map(|(name, _)| name.clone()).collect();
                Facts::new(Some(Subject::Parameters(names)), worst, "1").with_limit(*limit)
            }
            Self::OtherParameters { name, deviations, tests } => {
                let significance = Significance::of_deviation(*deviations, *tests);
                Facts::new(Some(Subject::Parameters(vec![name.clone()])), *deviations, "σ")
                    .by_test(significance)
            }
            Self::WeakInstruments { correlation: figure }
            | Self::AboveNoise { ratio: figure }
            | Self::Insensitive { deviation: figure, .. } => Facts::new(None, *figure, "1"),
            Self::Stored(_) => Facts::default(),
        }
    }
}

impl Note {
    /// Returns the code of the finding.
    pub fn code(&self) -> FindingCode {
        use FindingCode as Code;

        match self {
            Self::NoReference => Code::NoReference,
            Self::SlowerLoop { .. } => Code::SlowerLoop,
            Self::ColouredResiduals { .. } => Code::ColouredResiduals,
            Self::PositionFilterUnchecked { .. } => Code::PositionFilterUnchecked,
            Self::PositionNoiseIgnored | Self::PositionNoiseNotSimulated => {
                Code::PositionNoiseUnchecked
            }
            Self::DelayUnchecked => Code::TorqueDelayUnchecked,
            Self::ControllerUnchecked { .. } => Code::ControllerUnchecked,
            Self::PositionBias { bias } if bias.by_filter => Code::FilterBias,
            Self::PositionBias { .. } => Code::NoiseBias,
            Self::ClippedTorque { .. } => Code::ClippedTorque,
            Self::FrozenSignal { .. } => Code::FrozenPosition,
            Self::Outliers { .. } => Code::Outliers,
            Self::DownweightedThroughout { .. } => Code::DownweightedThroughout,
            Self::ModelError { .. } => Code::UnmodelledEffect,
            Self::FarFromNominal { .. } => Code::FarFromNominal,
            Self::Explanation(reason) => reason.code(),
            Self::RateUnchecked => Code::RateUnchecked,
            Self::TorqueLimitOpen { .. } => Code::TorqueLimitOpen,
            Self::LoadFrame { .. } => Code::LoadFrame,
            Self::IncompleteTorque { .. } => Code::IncompleteTorque,
            Self::Stored(finding) => finding.code,
        }
    }

    fn facts(&self) -> Facts {
        match self {
            Self::NoReference
            | Self::PositionNoiseIgnored
            | Self::PositionNoiseNotSimulated
            | Self::DelayUnchecked
            | Self::ControllerUnchecked { .. }
            | Self::RateUnchecked
            | Self::LoadFrame { .. }
            | Self::Stored(_) => Facts::default(),
            Self::Explanation(reason) => reason.facts(),
            Self::SlowerLoop { bandwidth_hz: figure }
            | Self::PositionFilterUnchecked { cutoff_hz: figure } => {
                Facts::new(None, *figure, "Hz")
            }
            Self::IncompleteTorque { parameters, .. } => {
                Facts::about(Subject::Parameters(parameters.clone()))
            }
            Self::ColouredResiduals { joints, significance, .. } => {
                Facts::about(Subject::Joints(joints.clone())).by_test(*significance)
            }
            Self::TorqueLimitOpen { joints } => Facts::about(Subject::Joints(joints.clone())),
            Self::PositionBias { bias } => {
                let subject = Subject::Parameters(vec![bias.parameter.clone()]);
                Facts::new(Some(subject), bias.deviations, "σ")
            }
            Self::ClippedTorque { found } => clipped(found),
            Self::FrozenSignal { found } => {
                Facts::new(Some(Subject::Motors(found.motors.clone())), found.share, "1")
            }
            Self::Outliers { rows, of, .. } => Facts::new(None, share(*rows, *of), "1"),
            Self::DownweightedThroughout { joints, of } => {
                let subject = Subject::Joints(joints.iter().map(|(joint, _)| *joint).collect());
                let most = joints.iter().map(|(_, rows)| *rows).max().unwrap_or(0);
                Facts::new(Some(subject), share(most, *of), "1")
            }
            Self::ModelError { nuisance, tests, .. } => {
                let joint = || Subject::Joints(vec![nuisance.joint]);
                let subject = subject_of(nuisance.nuisance).unwrap_or_else(joint);
                let significance = Significance::of_probability(nuisance.probability, *tests);
                Facts::new(Some(subject), nuisance.relative_torque, "1").by_test(significance)
            }
            Self::FarFromNominal { far } => {
                Facts::new(Some(Subject::Links(vec![far.link])), far.distance_nats, "1")
            }
        }
    }
}

/// Returns the number of an alternative, or how much it explains.
fn of_alternative(found: &Alternative, evidence: Option<Evidence>) -> Facts {
    let motors = found.motors();
    let subject = (!motors.is_empty()).then_some(Subject::Motors(motors));
    let facts = match found {
        Alternative::Late { time_s, .. } => Facts::new(subject, time_s.value, "s"),
        Alternative::PositionScale { factor, .. } | Alternative::TorqueScale { factor, .. } => {
            Facts::new(subject, factor.value, "1")
        }
        Alternative::Coupling { .. } => {
            let entry = found.coupling().map(|entry| entry.value);
            Facts { subject, figure: entry, unit: Some("1"), ..Facts::default() }
        }
        _ => Facts {
            subject,
            figure: evidence.map(|of| of.explained),
            unit: evidence.map(|_| "1"),
            ..Facts::default()
        },
    };
    facts.by_test(evidence.and_then(|of| of.significance))
}

fn share(some: usize, of: usize) -> f64 {
    count(some) / count(of)
}

#[expect(clippy::cast_precision_loss, reason = "rows and parameters are far fewer than 2^52")]
fn count(number: usize) -> f64 {
    number as f64
}

fn clipped(found: &ClippedSignal) -> Facts {
    Facts::new(Some(Subject::Motors(vec![found.motor])), found.share, "1")
}

/// Returns the joints or the motor of a nuisance parameter. `None` if it belongs to the whole arm.
fn subject_of(nuisance: NuisanceParameter) -> Option<Subject> {
    use NuisanceParameter as Of;
    match nuisance {
        Of::JointFriction(joint)
        | Of::TorqueGain(joint)
        | Of::TorqueDelay(joint)
        | Of::Zero(joint)
        | Of::Twist(joint)
        | Of::Distance(joint)
        | Of::Offset(joint)
        | Of::PositionScale(joint)
        | Of::PositionTorque(joint)
        | Of::KnownTorque(joint) => Some(Subject::Joints(vec![joint])),
        Of::Coupling { joint, neighbour } => Some(Subject::Joints(vec![joint, neighbour])),
        Of::MotorFriction(motor) => Some(Subject::Motors(vec![motor])),
        Of::CommonGain | Of::Mounting(_) | Of::LeftOutParameters => None,
    }
}

/// Returns the correction of a configured value: a factor, or an offset in the unit of the
/// quantity.
fn correction(found: &NuisanceEstimate) -> Facts {
    let subject = subject_of(found.nuisance);
    match (found.correction_factor(), found.quantity) {
        (Some([factor, _]), _) => Facts::new(subject, factor, "1"),
        (None, Some(of)) => Facts::new(subject, of.value, of.unit),
        (None, None) => Facts { subject, ..Facts::default() },
    }
}

#[cfg(test)]
mod tests {
    use didim_dynamics::robot::MotorIndex;

    use super::super::nuisance_parameters::BaseAxis;
    use super::*;

    #[test]
    fn a_finding_is_about_the_joint_of_its_value() {
        let joint = JointIndex::new(1);
        let scale = subject_of(NuisanceParameter::PositionScale(joint));
        assert_eq!(scale, Some(Subject::Joints(vec![joint])));
        let motor = MotorIndex::new(5);
        let friction = subject_of(NuisanceParameter::MotorFriction(motor));
        assert_eq!(friction, Some(Subject::Motors(vec![motor])));
        assert_eq!(subject_of(NuisanceParameter::Mounting(BaseAxis::X)), None);
    }
}
