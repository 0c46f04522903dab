//! What a result may be used for: what exceeds which limit.

use nalgebra::DVector;

use super::estimate::{Estimate, ReferenceSource};
use super::freedoms::{Freedom, FreedomEstimate};
use super::reasons::{Note, Reason};
use super::uses::{UseVerdict, Uses};
use super::workspace::Indefinite;
use crate::feasibility::Outcome;
use crate::identification::given::{Context, Tolerances, VerdictLimits};
use crate::robot::{FrictionLaw, Parameter, ParameterKind};

/// So many quantities of a joint that cannot be negative, all of which are, are no errors of the model.
const TURNED: usize = 2;

/// A parameter within this many standard deviations of zero could be zero.
const INSIGNIFICANT: f64 = 2.0;

/// A smaller share of a joint's torque is less than what a rigid model leaves.
const DUST: f64 = 0.01;

/// What the model lacks is worth a note from this share of a joint's torque on.
const LACKING: f64 = 0.03;

/// A parameter that carries this share of a joint's torque is asked for its value.
const CARRYING: f64 = 0.05;

/// A torque may be as small as this share of what a joint can do, and need not be known better.
const SMALL: f64 = 0.05;

/// Robot files state limits that nobody has ever reached: what a joint can do is at most this many times
/// the largest torque recorded.
const REACHED: f64 = 3.0;

/// A joint that leaves more of its torque lacks something that has no name yet.
pub(super) const UNEXPLAINED: f64 = 0.05;

/// Torques beyond this many times the limit of a joint are in another unit.
const OTHER_UNIT: f64 = 20.0;

/// How far a command is from one of the other sign, relative to it, but for what friction and noise add.
const OPPOSITE: core::ops::RangeInclusive<f64> = 1.9..=2.1;

/// A joint that goes less than this share of its range does not move; of a range of 1 rad or m, where it is larger.
const UNMOVED: f64 = 0.01;

/// What the verdict needs to know beside the estimate.
pub(super) struct Known<'a> {
    pub(super) context: &'a Context<'a>,
    /// Root mean square of the torque of each joint along the motion \[N·m or N\].
    pub(super) torque: Vec<f64>,
    /// The largest torque that was recorded on each joint \[N·m or N\].
    pub(super) largest_torque: Vec<f64>,
    /// The share of a joint's torque that each parameter carries, the largest of all joints.
    pub(super) carried: Vec<f64>,
    /// The posture where the mass matrix is furthest from positive definite, if it is not everywhere.
    pub(super) indefinite: Option<Indefinite>,
    /// The nearest bodies, where the robot's file has nominal ones.
    pub(super) bodies: Option<Outcome>,
    /// What only some methods find.
    pub(super) further: Vec<Reason>,
}

impl Known<'_> {
    /// Whether a torque of a joint, numbered from 1, is little beside what the joint can do.
    fn is_small(&self, joint: usize, torque_nm: f64) -> bool {
        let reached = self.largest_torque[joint - 1];
        // What was recorded it can do, and where no limit is stated nothing says that it can do more.
        let can = match self.context.robot.chain()[joint - 1].limits.torque_max {
            Some(limit) => limit.min(REACHED * reached),
            None => reached,
        };
        torque_nm <= SMALL * can
    }
}

impl VerdictLimits {
    /// The verdict for each use. A figure that is not a number fails.
    pub(super) fn uses(&self, known: &Known<'_>, estimate: &Estimate) -> Uses {
        let wrong = self.wrong(known, estimate);
        Uses {
            monitoring: self.monitoring(known, estimate, &wrong),
            prediction: self.prediction(known, estimate, &wrong),
            contact_detection: contact_detection(estimate, &wrong),
            physical_values: self.physical_values(known, estimate, &wrong),
            rigid_body: self.rigid_body(known, &wrong),
        }
    }

    /// What makes a result useless: the method failed, or the data are in another unit or of another sign.
    fn wrong(&self, known: &Known<'_>, estimate: &Estimate) -> Vec<Reason> {
        let mut reasons = known.further.clone();
        let limits = known.context.robot.limits().map(|limits| limits.torque_max);
        let joints = (1..).zip(known.largest_torque.iter().zip(limits));
        reasons.extend(
            joints
                .filter_map(|(joint, (&torque, limit))| Some((joint, torque, limit?)))
                .filter(|(_, torque, limit)| *torque > OTHER_UNIT * limit)
                .map(|(joint, torque, limit)| Reason::OtherUnit { joint, torque, limit }),
        );
        // Joint, and whether it is negative.
        let positive: Vec<(usize, bool)> = (estimate.parameters.iter().enumerate())
            .filter(|(index, p)| !p.regrouped && positive_quantity(known.context, *index).is_some())
            .filter(|(_, p)| p.value.abs() > self.negative_deviations * p.standard_deviation)
            .map(|(index, p)| (parameter(known.context, index).joint, p.value < 0.0))
            .collect();
        let negative = positive.iter().filter(|(_, negative)| *negative).count();
        if 2 * negative > positive.len() {
            reasons.push(Reason::WrongSigns { negative, of: positive.len() });
        } else {
            reasons.extend((0..known.torque.len()).filter_map(|joint| {
                let own = || positive.iter().filter(|(of, _)| *of == joint);
                let is_turned = own().count() >= TURNED && own().all(|(_, negative)| *negative);
                let (joint, negative) = (joint + 1, own().count());
                is_turned.then_some(Reason::WrongSignsOfJoint { joint, negative })
            }));
        }
        reasons
    }

    /// Whether there are rows enough.
    pub(super) fn are_rows_enough(&self, context: &Context<'_>, estimate: &Estimate) -> bool {
        !exceeds(self.rows_per_parameter, rows_per_parameter(context, estimate))
    }

    /// By what the data tell with this cell, whatever the model lacks: windows of the same motion lack
    /// the same.
    fn monitoring(&self, known: &Known<'_>, estimate: &Estimate, wrong: &[Reason]) -> UseVerdict {
        let mut reasons = wrong.to_vec();
        let (value, limit) = (estimate.condition_number, self.condition_number);
        if exceeds(value, limit) {
            reasons.push(Reason::ConditionNumber { value, limit });
        }
        let deviations = &estimate.relative_prediction_deviation_per_joint;
        let limit = self.prediction_deviation;
        let in_nm = |joint: usize, share: f64| share * known.torque[joint - 1];
        reasons.extend(
            exceeding(deviations, limit)
                .filter(|&(joint, share)| !known.is_small(joint, in_nm(joint, share)))
                .map(|(joint, deviation)| Reason::PredictionDeviation { joint, deviation, limit }),
        );
        let decimation = &known.context.decimation;
        let per_parameter = rows_per_parameter(known.context, estimate);
        if exceeds(self.rows_per_parameter, per_parameter) {
            reasons.push(Reason::FewRows { per_parameter, limit: self.rows_per_parameter });
        }
        if decimation.is_none() {
            reasons.push(Reason::NotDecimated);
        }
        // Without the joints that are let off.
        let judged: Vec<f64> = (1..)
            .zip(deviations)
            .filter(|&(joint, &share)| {
                !exceeds(share, limit) || !known.is_small(joint, in_nm(joint, share))
            })
            .map(|(_, share)| *share)
            .collect();
        let figure = largest(if judged.is_empty() { deviations } else { &judged });
        UseVerdict::new(figure, "1", Some(limit), reasons)
    }

    /// By the uncertainty of the torque elsewhere, and by what was held out.
    fn prediction(&self, known: &Known<'_>, estimate: &Estimate, wrong: &[Reason]) -> UseVerdict {
        let mut reasons = wrong.to_vec();
        // First what the others may follow from.
        let errors = estimate.controller_error_per_joint.iter().flatten();
        // Who does not simulate the loop knows by it of the torques, as well as their gain is stated.
        let limit = match estimate.simulations {
            0 => self.controller_error.max(known.context.options.tolerances.torque_gain),
            _ => self.controller_error,
        };
        reasons.extend(exceeding(errors, limit).map(
            |(joint, error)| match OPPOSITE.contains(&error) {
                true => Reason::OppositeCommand { joint },
                false => Reason::Controller { joint, error },
            },
        ));
        // Friction that follows a reversal late looks like a delay, and a delay stays with the record.
        let of_the_arm =
            |found: &&FreedomEstimate| !matches!(found.freedom, Freedom::TorqueDelay(_));
        reasons.extend(contradicted(estimate.freedoms.iter().filter(of_the_arm)));
        reasons.extend(self.negative(known, estimate, wrong));
        let (error, limit) = (estimate.relative_error, self.relative_error);
        if exceeds(error, limit) {
            reasons.push(Reason::RelativeError { error, limit });
        }
        let (errors, limit) = (&estimate.relative_error_per_joint, self.relative_error_per_joint);
        reasons.extend(
            exceeding(errors, limit)
                .filter(|(joint, _)| {
                    !known.is_small(*joint, estimate.rms_error_per_joint_nm[joint - 1])
                })
                .map(|(joint, error)| Reason::JointError { joint, error, limit }),
        );
        // Elsewhere is at speeds up to those of the record, where a joint that does not move has none.
        reasons.extend(unmoved(known.context));
        let (elsewhere, limit) = (&estimate.elsewhere, self.error_elsewhere);
        if exceeds(elsewhere.relative_error, limit) {
            let error = elsewhere.relative_error;
            let freedoms = estimate.freedoms.iter().take(3).cloned().collect();
            reasons.push(Reason::Elsewhere { error, limit, freedoms });
        } else {
            let joints =
                exceeding(&elsewhere.relative_error_per_joint, limit).filter(|(joint, _)| {
                    !known.is_small(*joint, elsewhere.error_per_joint_nm[joint - 1])
                });
            reasons.extend(joints.map(|(joint, error)| Reason::JointElsewhere {
                joint,
                error,
                limit,
            }));
        }
        match estimate.held_out.relative_error {
            Some(error) if exceeds(error, self.held_out_error) => {
                reasons.push(Reason::HeldOut { error, limit: self.held_out_error });
            }
            Some(_) => {}
            None => reasons.push(Reason::TooFewMotions),
        }
        UseVerdict::new(Some(elsewhere.relative_error), "1", Some(limit), reasons)
    }

    /// Friction and drive inertia below zero, whatever the model lacks.
    fn negative(
        &self,
        known: &Known<'_>,
        estimate: &Estimate,
        wrong: &[Reason],
    ) -> impl Iterator<Item = Reason> {
        // A regrouped parameter may be negative: others are subtracted in it.
        let alone = estimate.parameters.iter().enumerate().filter(|(_, p)| !p.regrouped);
        let follows = has_wrong_signs(wrong);
        alone.filter(move |_| !follows).filter_map(|(index, parameter)| {
            let quantity = positive_quantity(known.context, index)?;
            let (value, standard_deviation) =
                (parameter.value, parameter.combined_standard_deviation);
            exceeds(-value, self.negative_deviations * standard_deviation).then(|| {
                let name = parameter.name.clone();
                Reason::Negative { quantity, name, value, standard_deviation }
            })
        })
    }

    /// By the combined uncertainty of what carries torque.
    fn physical_values(
        &self,
        known: &Known<'_>,
        estimate: &Estimate,
        wrong: &[Reason],
    ) -> UseVerdict {
        let mut reasons = wrong.to_vec();
        reasons.extend(contradicted(estimate.freedoms.iter()));
        reasons.extend(self.negative(known, estimate, wrong));
        let options = known.context.options;
        let asked = |index: usize| match &options.required_parameters {
            Some(names) => names.contains(&estimate.parameters[index].name),
            None => known.carried[index] >= CARRYING,
        };
        let uncertain = |index: usize| {
            let parameter = &estimate.parameters[index];
            parameter.combined_standard_deviation / parameter.value.abs()
        };
        let asked: Vec<usize> = (0..estimate.parameters.len()).filter(|&k| asked(k)).collect();
        let limit = self.parameter_uncertainty;
        let names: Vec<(String, f64)> = (asked.iter())
            .filter(|&&index| exceeds(uncertain(index), limit))
            .map(|&index| (estimate.parameters[index].name.clone(), uncertain(index)))
            .collect();
        if !names.is_empty() {
            reasons.push(Reason::Uncertain { parameters: names, limit });
        }
        let figures: Vec<f64> = asked.into_iter().map(uncertain).collect();
        UseVerdict::new(largest(&figures), "1", Some(limit), reasons)
    }

    /// By the mass matrix, and by whether bodies explain it.
    fn rigid_body(&self, known: &Known<'_>, wrong: &[Reason]) -> UseVerdict {
        let mut reasons = wrong.to_vec();
        let limit = self.negative_deviations;
        let figure = known.indefinite.as_ref().map_or(0.0, |found| found.deviations);
        let follows = has_wrong_signs(wrong);
        if let Some(found) =
            known.indefinite.as_ref().filter(|_| !follows && exceeds(figure, limit))
        {
            let posture = found.posture.clone();
            reasons.push(Reason::Indefinite { posture, deviations: figure });
        }
        let no_bodies = known.bodies.as_ref().and_then(Outcome::no_bodies);
        reasons.extend(no_bodies.filter(|_| !follows).map(Reason::NoBodies));
        UseVerdict::new(Some(figure), "standard deviations below zero", Some(limit), reasons)
    }

    /// Parameters that the torques along the simulated motion want otherwise than the positions do: with the right
    /// model and controller both are the arm's. `deviations` are those of their `difference` as if they
    /// had no errors in common, which makes them too large.
    pub(super) fn other_parameters(
        &self,
        names: &[String],
        difference: &DVector<f64>,
        deviations: &DVector<f64>,
    ) -> Option<Reason> {
        let (name, deviations) = (names.iter())
            .zip(difference.component_div(deviations).abs().iter().copied())
            .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        exceeds(deviations, self.model_shift_deviations)
            .then(|| Reason::OtherParameters { name: name.clone(), deviations })
    }

    /// What must be known with a result and does not speak against its use.
    pub(super) fn notes(
        &self,
        context: &Context<'_>,
        estimate: &Estimate,
        bodies: Option<&Outcome>,
    ) -> Vec<Note> {
        let mut notes = Vec::new();
        let far = bodies.and_then(Outcome::far_body);
        notes.extend(far.map(|far| Note::FarFromNominal { far }));
        let joints: Vec<usize> = (1..)
            .zip(context.robot.limits())
            .filter(|(_, limits)| limits.torque_max.is_none())
            .map(|(joint, _)| joint)
            .collect();
        if !joints.is_empty() {
            notes.push(Note::TorqueLimitOpen { joints });
        }
        if estimate.reference == Some(ReferenceSource::MeasuredPosition) {
            notes.push(Note::NoReference);
        }
        if let Some(bandwidth_hz) = estimate.slower_bandwidth_hz {
            notes.push(Note::SlowerLoop { bandwidth_hz });
        }
        if let Some(bias) = &estimate.position_bias
            && exceeds(bias.deviations.abs(), self.position_filter_deviations)
        {
            notes.push(Note::PositionBias { bias: bias.clone() });
        }
        let names: Vec<String> = (estimate.parameters.iter())
            .filter(|p| exceeds(INSIGNIFICANT * p.standard_deviation, p.value.abs()))
            .map(|p| p.name.clone())
            .collect();
        if !names.is_empty() {
            notes.push(Note::Insignificant { names });
        }
        let joints = (1..).zip(&estimate.whiteness_per_joint);
        let joints: Vec<usize> = joints
            .filter(|(_, probability)| exceeds(self.model_probability, **probability))
            .map(|(joint, _)| joint)
            .collect();
        if !joints.is_empty() {
            let decimated = !context.decimation.is_none();
            notes.push(Note::ColouredResiduals { joints, decimated });
        }
        // What is stated has its reason where it is contradicted.
        let most = estimate.freedoms.first().filter(|found| found.quantity.is_none());
        notes.extend(
            most.filter(|found| found.relative_torque >= LACKING)
                .map(|freedom| Note::Lacking { freedom: freedom.clone() }),
        );
        notes
    }
}

/// By the residuals that were held out, which are for whoever sets thresholds.
fn contact_detection(estimate: &Estimate, wrong: &[Reason]) -> UseVerdict {
    let quantiles = &estimate.held_out.quantiles_per_joint;
    let of_999: Vec<f64> = quantiles.iter().map(|of| of.of_999).collect();
    let mut reasons = wrong.to_vec();
    reasons.extend(quantiles.is_empty().then_some(Reason::TooFewMotions));
    UseVerdict {
        applicable: None,
        quantiles_per_joint: quantiles.clone(),
        ..UseVerdict::new(largest(&of_999), "N·m", None, reasons)
    }
}

/// What is stated and the data contradict, the largest torques first.
fn contradicted<'a>(
    freedoms: impl Iterator<Item = &'a FreedomEstimate>,
) -> impl Iterator<Item = Reason> {
    freedoms.filter_map(|found| {
        let quantity = found.quantity?;
        let least = Tolerances::CONTRADICTED * quantity.stated.hypot(quantity.standard_deviation);
        (found.relative_torque >= DUST && quantity.value.abs() > least)
            .then(|| Reason::Contradicted { freedom: found.clone() })
    })
}

fn has_wrong_signs(reasons: &[Reason]) -> bool {
    reasons.iter().any(|reason| {
        matches!(reason, Reason::WrongSigns { .. } | Reason::WrongSignsOfJoint { .. })
    })
}

fn largest(values: &[f64]) -> Option<f64> {
    values.iter().copied().reduce(f64::max)
}

/// Joints, numbered from 1, whose value exceeds the limit.
fn exceeding<'a>(
    values: impl IntoIterator<Item = &'a f64>,
    limit: f64,
) -> impl Iterator<Item = (usize, f64)> {
    (1..).zip(values).map(|(joint, &value)| (joint, value)).filter(move |of| exceeds(of.1, limit))
}

/// Whether a value exceeds its limit; what is not a number does.
fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// A selected parameter, by its number.
fn parameter(context: &Context<'_>, index: usize) -> Parameter {
    context.robot.parameters().parameters()[context.selection.columns()[index]]
}

/// What a selected parameter is called, by its number, when it cannot be negative.
fn positive_quantity(context: &Context<'_>, index: usize) -> Option<&'static str> {
    use ParameterKind::{FvAsymmetric, FvCubic, FvQuadratic};

    let Parameter { kind, joint } = parameter(context, index);
    // Of viscous friction that bends, the part that does not may have either sign.
    let bends = |law: &FrictionLaw| matches!(law.kind(), FvQuadratic | FvCubic | FvAsymmetric);
    if kind == ParameterKind::Fv && context.robot.own_friction()[joint].laws.iter().any(bends) {
        return None;
    }
    match kind {
        ParameterKind::Ia => Some("drive inertia"),
        ParameterKind::Fv | ParameterKind::FvMotor => Some("viscous friction"),
        ParameterKind::Fc | ParameterKind::FcMotor => Some("Coulomb friction"),
        ParameterKind::FcLoad => Some("friction that grows with the load"),
        ParameterKind::Fs => Some("Stribeck friction"),
        ParameterKind::Fh => Some("friction that lags at reversals"),
        _ => None,
    }
}

/// Independent rows.
fn rows_per_parameter(context: &Context<'_>, estimate: &Estimate) -> f64 {
    context.decimation.cutoff_ratio() * estimate.rows as f64 / estimate.parameters.len() as f64
}

/// Joints that do not move in any recording.
fn unmoved(context: &Context<'_>) -> impl Iterator<Item = Reason> {
    let (positions, recordings) =
        (context.experiment.position_rad(), context.experiment.recordings());
    let moved = |joint: usize| {
        let ranges = recordings.iter().map(|of| {
            let of_samples = of.counted.clone().map(|k| positions[(k, joint)]);
            let [low, high] =
                of_samples.fold([f64::MAX, f64::MIN], |[low, high], q| [low.min(q), high.max(q)]);
            high - low
        });
        ranges.fold(0.0, f64::max)
    };
    (0..).zip(context.robot.chain()).filter_map(move |(joint, own)| {
        let (moved, range) = (moved(joint), own.limits.position_max - own.limits.position_min);
        let (number, unit) = (joint + 1, own.kind.position_unit());
        (moved < UNMOVED * range.min(1.0)).then_some(Reason::Unmoved { joint: number, moved, unit })
    })
}
