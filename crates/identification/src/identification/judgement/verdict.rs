//! Permitted uses of a result: which figure exceeds which limit.

use nalgebra::DVector;

use super::alternatives::{Alternative, better_sign, missing_coupling, other_coupling};
use super::estimate::{Estimate, ReferenceSource};
use super::nuisance_parameters::{NuisanceEstimate, NuisanceParameter};
use super::positive_parameter::{parameter, positive_quantity};
use super::quantiles::ResidualQuantiles;
use super::reasons::{Note, Reason};
use super::significance::Significance;
use super::uses::{Criteria, UseVerdict, Uses};
use super::workspace::Indefinite;
use crate::feasibility::Outcome;
use crate::identification::problem::{Context, Tolerances, VerdictLimits};
use crate::stored_value;
use didim_dynamics::robot::JointIndex;

/// Smallest number of quantities of a joint that cannot be negative. If all are negative, this is
/// no model error.
const TURNED: usize = 2;

/// Negligible share of a joint's torque, smaller than the residual of a rigid model.
const DUST: f64 = 0.01;

/// Smallest share of a joint's torque at which a model error is worth a note.
const LACKING: f64 = 0.03;

/// A parameter with at least this share of a joint's torque is checked for its value.
const CARRYING: f64 = 0.05;

/// Residual share of a joint's torque above which an unnamed effect is missing in the model.
pub(super) const UNEXPLAINED: f64 = 0.05;

/// Torques beyond this many times the limit of a joint are in another unit.
const OTHER_UNIT: f64 = 20.0;

/// Relative distance of a command from one with the opposite sign, apart from friction and noise.
const OPPOSITE: core::ops::RangeInclusive<f64> = 1.9..=2.1;

/// A joint that moves less than this share of its range does not move. The range counts as 1 rad or
/// m at most.
const UNMOVED: f64 = 0.01;

/// Information that the verdict needs in addition to the estimate.
pub(super) struct Known<'a> {
    pub(super) context: &'a Context<'a>,
    /// Root mean square of the torque of each joint along the motion \[N·m or N\].
    pub(super) torque: Vec<f64>,
    /// Largest recorded torque of each joint \[N·m or N\].
    pub(super) largest_torque: Vec<f64>,
    /// Contribution of each parameter to a joint's torque, as a share: the largest of all joints.
    pub(super) carried: Vec<f64>,
    /// Posture where the mass matrix is furthest from positive definite, if it is not positive
    /// definite everywhere.
    pub(super) indefinite: Option<Indefinite>,
    /// Nearest bodies, if the robot file has nominal ones.
    pub(super) bodies: Option<Outcome>,
    /// Reasons that are no figure and make the result useless: failures of the method, and signals
    /// that were not measured.
    pub(super) blocking: Vec<Reason>,
    /// Findings about the signals that may explain a large figure.
    pub(super) explanations: Vec<Reason>,
}

impl Known<'_> {
    /// Returns true if the torque of a joint is recorded.
    fn has_torque(&self, joint: JointIndex) -> bool {
        self.context.has_torque(joint.position())
    }

    /// Returns the torque limit of a joint, if there is one that its recorded torques do not exceed
    /// \[N·m or N\].
    fn torque_limit(&self, joint: JointIndex) -> Option<f64> {
        let limit = self.context.robot.chain()[joint].limits.torque_max;
        limit.filter(|limit| *limit >= self.largest_torque[joint])
    }

    /// Returns the smallest torque by which the error of a joint is divided \[N·m or N\]. It is a
    /// share of the joint's torque limit. Without a limit above the recorded torques, it is the
    /// same share of the largest root mean square torque of any joint of its kind.
    fn torque_floor(&self, joint: JointIndex) -> f64 {
        let chain = self.context.robot.chain();
        let largest = || {
            let of_kind =
                numbered(&self.torque).filter(|(of, _)| chain[*of].kind == chain[joint].kind);
            of_kind.map(|(_, torque)| *torque).fold(0.0, f64::max)
        };
        self.context.options.limits.torque_floor * self.torque_limit(joint).unwrap_or_else(largest)
    }

    /// Returns the torque by which the error of a joint is divided: its `torque` or its floor,
    /// whichever is larger \[N·m or N\].
    fn divisor(&self, joint: JointIndex, torque: f64) -> f64 {
        torque.max(self.torque_floor(joint))
    }

    /// Returns the error of each joint \[N·m or N\], relative to its divisor.
    fn relative_errors(&self, errors: &[f64], torque: impl Fn(JointIndex) -> f64) -> Vec<f64> {
        let relative = |(joint, error): (JointIndex, &f64)| match self.has_torque(joint) {
            true => error / self.divisor(joint, torque(joint)),
            false => 0.0,
        };
        numbered(errors).map(relative).collect()
    }
}

impl VerdictLimits {
    /// Returns the verdict for each use, and all possible explanations of large figures. The figures
    /// with their limits decide, and what is no number: a failed method, an impossible unit or
    /// sign. Other findings only explain a figure that exceeds its limit. A figure that is not a
    /// number fails.
    pub(super) fn uses(&self, known: &Known<'_>, estimate: &Estimate) -> (Uses, Vec<Reason>) {
        let blocking = self.blocking(known, estimate);
        // Parameters of the wrong sign follow from wrong signs of the signals.
        let follows = has_wrong_signs(&blocking);
        let controller = self.controller(known, estimate);
        // The simulated loop is that of the controller: there its error decides.
        let (deciding, explaining) = match estimate.simulations {
            0 => (Vec::new(), controller),
            _ => (controller, Vec::new()),
        };
        let (delays, others): (Vec<_>, Vec<_>) =
            estimate.nuisance_parameters.iter().partition(|found| found.is_delay());
        let nuisance = estimate.nuisance_parameters.iter();
        let tests = nuisance.filter(|found| can_be_contradicted(found)).count();
        let mut found = known.explanations.clone();
        found.extend(coupling_behind_gains(known.context, (&others, tests), &found));
        let others = others.into_iter().filter(|of| !follows_from(of, &found));
        let contradicted_values: Vec<Reason> = contradicted(others, tests).collect();
        let is_new =
            |of: &&Reason| !is_repeated(of, &blocking) && !is_repeated(of, &contradicted_values);
        let explanations: Vec<Reason> = (explaining.into_iter())
            .chain(found.iter().filter(is_new).cloned())
            .chain(contradicted_values.iter().cloned())
            .collect();
        // A delay belongs to the record, and does not affect predictions.
        let of_values: Vec<Reason> =
            explanations.iter().cloned().chain(contradicted(delays, tests)).collect();
        let quantiles = &estimate.held_out.quantiles_per_joint;
        let uses = Uses {
            monitoring: self.monitoring(known, estimate).decide(&blocking, &explanations),
            prediction: self.prediction(known, estimate, deciding).decide(&blocking, &explanations),
            contact_detection: UseVerdict {
                applicable: None,
                quantiles_per_joint: quantiles.clone(),
                ..contact_detection(quantiles).decide(&blocking, &explanations)
            },
            physical_values: self
                .physical_values(known, estimate, follows)
                .decide(&blocking, &of_values),
            rigid_body: self.rigid_body(known, estimate, follows).decide(&blocking, &of_values),
        };
        (uses, explanations)
    }

    /// Returns the reasons that make a result useless and are no figure: the method failed, or the
    /// data have another unit or sign.
    fn blocking(&self, known: &Known<'_>, estimate: &Estimate) -> Vec<Reason> {
        let mut reasons = known.blocking.clone();
        let limits = known.context.robot.limits().map(|limits| limits.torque_max);
        let joints = numbered(known.largest_torque.iter().zip(limits));
        reasons.extend(
            joints
                .filter(|(joint, _)| known.has_torque(*joint))
                .filter_map(|(joint, (&torque, limit))| Some((joint, torque, limit?)))
                .filter(|(_, torque, limit)| *torque > OTHER_UNIT * limit)
                .map(|(joint, torque, limit)| Reason::OtherUnit { joint, torque, limit }),
        );
        // The signs of the parameters say nothing then.
        if reasons.iter().any(|of| matches!(of, Reason::UnsignedTorque { .. })) {
            return reasons;
        }
        // Joint, and true if the quantity is negative.
        let positive: Vec<(JointIndex, bool)> = (estimate.parameters.iter().enumerate())
            .filter(|(index, p)| !p.regrouped && positive_quantity(known.context, *index).is_some())
            .filter(|(_, p)| p.value.abs() > self.negative_deviations * p.standard_deviation)
            .map(|(index, p)| (parameter(known.context, index).joint, p.value < 0.0))
            .collect();
        let negative = positive.iter().filter(|(_, negative)| *negative).count();
        if 2 * negative > positive.len() {
            reasons.push(Reason::WrongSigns { negative, of: positive.len() });
        } else {
            reasons.extend((0..known.torque.len()).map(JointIndex::new).filter_map(|joint| {
                let own = || positive.iter().filter(|(of, _)| *of == joint);
                let is_turned = own().count() >= TURNED && own().all(|(_, negative)| *negative);
                let negative = own().count();
                is_turned.then(|| Reason::WrongSignsOfJoint {
                    joint,
                    negative,
                    signal: better_sign(known.context, joint),
                    setting: None,
                })
            }));
        }
        reasons
    }

    /// True if there are enough rows.
    pub(super) fn are_rows_enough(&self, context: &Context<'_>, rows: usize) -> bool {
        !exceeds(self.rows_per_parameter, rows_per_parameter(context, rows))
    }

    /// Judges monitoring by the information of the data in this cell. Model errors do not count,
    /// because windows of the same motion have the same errors.
    fn monitoring(&self, known: &Known<'_>, estimate: &Estimate) -> Criteria {
        let mut failing = Vec::new();
        let (value, limit) = (estimate.condition_number, self.condition_number);
        if exceeds(value, limit) {
            failing.push(Reason::ConditionNumber { value, limit });
        }
        let shares = &estimate.relative_prediction_deviation_per_joint;
        let relative = |(joint, share): (JointIndex, &f64)| {
            let torque = known.torque[joint];
            match known.has_torque(joint) {
                true => share * (torque / known.divisor(joint, torque)),
                false => 0.0,
            }
        };
        let deviations: Vec<f64> = numbered(shares).map(relative).collect();
        let limit = self.prediction_deviation;
        failing.extend(
            exceeding(&deviations, limit).map(|(joint, deviation)| Reason::PredictionDeviation {
                joint,
                deviation,
                limit,
            }),
        );
        let per_parameter = rows_per_parameter(known.context, estimate.rows);
        if exceeds(self.rows_per_parameter, per_parameter) {
            failing.push(Reason::FewRows { per_parameter, limit: self.rows_per_parameter });
        }
        if known.context.decimation.is_none() {
            failing.push(Reason::NotDecimated);
        }
        Criteria { figure: largest(&deviations), unit: "1", limit: Some(limit), failing }
    }

    /// Judges prediction by the torque uncertainty outside the recorded motion, by held-out data
    /// and by the residual, in addition to the `failing` errors of the controller.
    fn prediction(
        &self,
        known: &Known<'_>,
        estimate: &Estimate,
        mut failing: Vec<Reason>,
    ) -> Criteria {
        failing.extend(self.large_residual(estimate));
        let errors = &estimate.rms_error_per_joint_nm;
        let errors = known.relative_errors(errors, |joint| known.torque[joint]);
        let limit = self.relative_error_per_joint;
        failing.extend(exceeding(&errors, limit).map(|(joint, error)| Reason::JointError {
            joint,
            error,
            limit,
        }));
        // The error outside the recorded motion covers speeds up to those of the record. A joint
        // that does not move has no speed there.
        failing.extend(unmoved(known.context));
        let (elsewhere, limit) = (&estimate.extrapolation, self.error_of_extrapolation);
        if exceeds(elsewhere.relative_error, limit) {
            let error = elsewhere.relative_error;
            let freedoms = estimate.nuisance_parameters.iter().take(3).cloned().collect();
            failing.push(Reason::Extrapolation { error, limit, freedoms });
        } else {
            let (errors, shares) =
                (&elsewhere.error_per_joint_nm, &elsewhere.relative_error_per_joint);
            let errors = known.relative_errors(errors, |joint| errors[joint] / shares[joint]);
            failing.extend(
                exceeding(&errors, limit).map(|(joint, error)| Reason::JointExtrapolation {
                    joint,
                    error,
                    limit,
                }),
            );
        }
        match estimate.held_out.relative_error {
            Some(error) if exceeds(error, self.held_out_error) => {
                failing.push(Reason::HeldOut { error, limit: self.held_out_error });
            }
            Some(_) => {}
            None => failing.push(Reason::TooFewMotions),
        }
        Criteria { figure: Some(elsewhere.relative_error), unit: "1", limit: Some(limit), failing }
    }

    /// Returns a reason if the model does not describe the torques.
    fn large_residual(&self, estimate: &Estimate) -> Option<Reason> {
        let (error, limit) = (estimate.relative_error, self.relative_error);
        exceeds(error, limit).then_some(Reason::RelativeError { error, limit })
    }

    /// Returns the joints whose described controller did not command the recorded torques.
    fn controller(&self, known: &Known<'_>, estimate: &Estimate) -> Vec<Reason> {
        let errors = estimate.controller_error_per_joint.iter().flatten();
        let probabilities = estimate.controller_probability_per_joint.as_deref().unwrap_or(&[]);
        let tests = probabilities.len();
        let probability = |joint: JointIndex| probabilities.get(joint.position()).copied();
        let is_real =
            |joint: JointIndex| probability(joint).is_some_and(|of| self.is_significant(of, tests));
        // A smaller error is within the combined uncertainty, which includes the torque gain.
        let limit = self.controller_error.max(known.context.options.tolerances.torque_gain);
        let reason = |(joint, error): (JointIndex, f64)| {
            let significance =
                probability(joint).and_then(|of| Significance::of_probability(of, tests));
            match OPPOSITE.contains(&error) {
                true => Reason::OppositeCommand { joint, error, significance },
                false => Reason::Controller { joint, error, significance },
            }
        };
        exceeding(errors, limit).filter(|(joint, _)| is_real(*joint)).map(reason).collect()
    }

    /// Returns true if noise alone is too improbable as the cause of an effect. `tests` is the
    /// number of effects that are tested, each of which may appear by chance.
    fn is_significant(&self, probability: f64, tests: usize) -> bool {
        // A probability that is not a number is no proof.
        probability * tests as f64 <= self.model_probability
    }

    /// Returns the negative friction coefficients and drive inertias.
    fn negative(&self, known: &Known<'_>, estimate: &Estimate) -> impl Iterator<Item = Reason> {
        // A regrouped parameter may be negative, because it subtracts others.
        let alone = estimate.parameters.iter().enumerate().filter(|(_, p)| !p.regrouped);
        let positive: Vec<(usize, &'static str)> = alone
            .filter_map(|(index, _)| Some((index, positive_quantity(known.context, index)?)))
            .collect();
        let tests = positive.len();
        positive.into_iter().filter_map(move |(index, quantity)| {
            let parameter = &estimate.parameters[index];
            let (value, standard_deviation) =
                (parameter.value, parameter.combined_standard_deviation);
            exceeds(-value, self.negative_deviations * standard_deviation).then(|| {
                let name = parameter.name.clone();
                Reason::Negative { quantity, name, value, standard_deviation, tests }
            })
        })
    }

    /// Judges physical values by the combined uncertainty of the parameters that contribute to the
    /// torque. Negative values are no reason if they follow from wrong signs.
    fn physical_values(&self, known: &Known<'_>, estimate: &Estimate, follows: bool) -> Criteria {
        let mut failing = Vec::new();
        failing.extend(self.negative(known, estimate).filter(|_| !follows));
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
        let mut names: Vec<(String, f64)> = (asked.iter())
            .filter(|&&index| exceeds(uncertain(index), limit))
            .map(|&index| (estimate.parameters[index].name.clone(), uncertain(index)))
            .collect();
        names.sort_by(|a, b| b.1.total_cmp(&a.1));
        if !names.is_empty() {
            failing.push(Reason::Uncertain { parameters: names, limit });
        }
        let figures: Vec<f64> = asked.into_iter().map(uncertain).collect();
        Criteria { figure: largest(&figures), unit: "1", limit: Some(limit), failing }
    }

    /// Judges the rigid body by the mass matrix, and by the existence of bodies that explain it.
    /// Some bodies explain whatever the data do not determine, or the model does not describe: the
    /// criteria of monitoring and the relative error come first.
    fn rigid_body(&self, known: &Known<'_>, estimate: &Estimate, follows: bool) -> Criteria {
        let mut failing = self.monitoring(known, estimate).failing;
        failing.extend(self.large_residual(estimate));
        let limit = self.negative_deviations;
        let figure = known.indefinite.as_ref().map_or(0.0, |found| found.deviations);
        let indefinite = known.indefinite.as_ref().filter(|_| exceeds(figure, limit));
        let indefinite = indefinite
            .map(|found| Reason::Indefinite { posture: found.posture.clone(), deviations: figure });
        let no_bodies = known.bodies.as_ref().and_then(Outcome::no_bodies);
        let all = indefinite.into_iter().chain(no_bodies.map(Reason::PhysicallyImpossible));
        let missing = known.context.model.missing_torques();
        let undecided =
            (!missing.is_empty()).then(|| Reason::MissingTorque { joints: missing.to_vec() });
        failing.extend(all.chain(undecided).filter(|_| !follows));
        Criteria {
            figure: missing.is_empty().then_some(figure),
            unit: stored_value::BELOW_ZERO,
            limit: Some(limit),
            failing,
        }
    }

    /// Returns a reason if the torques along the simulated motion give other parameters than the
    /// positions. With the correct model and controller both give those of the arm. `deviations`
    /// are those of their `difference` as if they had no common errors, which makes them too large.
    pub(super) fn other_parameters(
        &self,
        names: &[String],
        difference: &DVector<f64>,
        deviations: &DVector<f64>,
    ) -> Option<Reason> {
        let (name, deviations) = (names.iter())
            .zip(difference.component_div(deviations).abs().iter().copied())
            .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        exceeds(deviations, self.model_shift_deviations).then(|| Reason::OtherParameters {
            name: name.clone(),
            deviations,
            tests: names.len(),
        })
    }

    /// Returns the notes that the user of a result must know and that do not speak against its use.
    pub(super) fn notes(&self, known: &Known<'_>, estimate: &Estimate) -> Vec<Note> {
        let context = known.context;
        let mut notes = Vec::new();
        let far = known.bodies.as_ref().and_then(Outcome::far_body);
        notes.extend(far.map(|far| Note::FarFromNominal { far }));
        let joints: Vec<JointIndex> = (0..context.robot.joints())
            .map(JointIndex::new)
            .filter(|joint| known.has_torque(*joint) && known.torque_limit(*joint).is_none())
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
        let tests = estimate.whiteness_per_joint.len();
        let joints: Vec<JointIndex> = numbered(&estimate.whiteness_per_joint)
            .filter(|(_, probability)| self.is_significant(**probability, tests))
            .map(|(joint, _)| joint)
            .collect();
        if !joints.is_empty() {
            let decimated = !context.decimation.is_none();
            let probabilities = estimate.whiteness_per_joint.iter().copied();
            let least = probabilities.fold(1.0, f64::min);
            let significance = Significance::of_probability(least, tests);
            notes.push(Note::ColouredResiduals { joints, decimated, significance });
        }
        // A contradicted configured value already has a reason.
        let effects = &estimate.nuisance_parameters;
        let largest = effects.iter().find(|found| {
            found.relative_torque >= LACKING
                && self.is_significant(found.probability, effects.len())
        });
        let largest = largest.filter(|found| found.nuisance.is_model_error());
        notes.extend(largest.map(|found| Note::ModelError {
            nuisance: found.clone(),
            tests: effects.len(),
            coupling: match found.nuisance {
                NuisanceParameter::Coupling { joint, neighbour } => {
                    missing_coupling(context, [joint, neighbour])
                }
                _ => None,
            },
            setting: None,
        }));
        notes
    }
}

/// Judges contact detection by the held-out residuals, which serve to set thresholds.
fn contact_detection(quantiles: &[ResidualQuantiles]) -> Criteria {
    let of_999: Vec<f64> = quantiles.iter().map(|of| of.of_999).collect();
    let failing = if quantiles.is_empty() { vec![Reason::TooFewMotions] } else { Vec::new() };
    Criteria { figure: largest(&of_999), unit: "N·m", limit: None, failing }
}

/// Returns true for a configured value that the data can contradict: they determine it, and no other
/// cause leaves the same torques.
fn can_be_contradicted(found: &NuisanceEstimate) -> bool {
    found.quantity.is_some() && !found.nuisance.is_ambiguous()
}

/// Returns reasons for configured values that the data contradict, the largest torques first.
/// `tests` is the number of values that they can contradict.
fn contradicted<'a>(
    freedoms: impl IntoIterator<Item = &'a NuisanceEstimate>,
    tests: usize,
) -> impl Iterator<Item = Reason> {
    let tested = freedoms.into_iter().filter(|found| can_be_contradicted(found));
    tested.filter_map(move |found| {
        let deviations = found.quantity?.contradiction().abs();
        let is_contradicted = deviations > Tolerances::CONTRADICTION_DEVIATIONS;
        (found.relative_torque >= DUST && is_contradicted).then(|| Reason::Contradicted {
            nuisance: found.clone(),
            tests,
            setting: None,
        })
    })
}

/// Returns another coupling that explains the contradicted torque gain of a coupled joint.
fn coupling_behind_gains(
    context: &Context<'_>,
    (nuisance, tests): (&[&NuisanceEstimate], usize),
    explanations: &[Reason],
) -> Option<Reason> {
    let unexplained = nuisance.iter().copied().filter(|of| !follows_from(of, explanations));
    let mut gains = contradicted(unexplained, tests).filter_map(|reason| match reason {
        Reason::Contradicted { nuisance, .. } => match nuisance.nuisance {
            NuisanceParameter::TorqueGain(joint) => Some(joint),
            _ => None,
        },
        _ => None,
    });
    let found = gains.find_map(|joint| other_coupling(context, joint))?;
    Some(Reason::Alternative { found, evidence: None, setting: None })
}

/// Returns true for a value of a joint whose motor is coupled differently or has another position
/// scale, or whose drive inertia is missing in the model.
fn follows_from(found: &NuisanceEstimate, explanations: &[Reason]) -> bool {
    explanations.iter().any(|reason| match reason {
        Reason::Alternative { found: Alternative::Coupling { motor, joint, .. }, .. } => {
            found.joint == *joint || found.joint.position() == motor.position()
        }
        Reason::Alternative { found: Alternative::DriveInertia { joint }, .. } => {
            found.joint == *joint
        }
        Reason::Alternative { found: Alternative::PositionScale { motor, .. }, .. } => {
            let scaled = NuisanceParameter::PositionScale(JointIndex::new(motor.position()));
            found.nuisance == scaled
        }
        _ => false,
    })
}

/// Returns true if wrong signs of a joint, or its contradicted torque gain, say the same already.
fn is_repeated(reason: &Reason, others: &[Reason]) -> bool {
    let Reason::Alternative { found, .. } = reason else { return false };
    others.iter().any(|of| match (found, of) {
        (Alternative::OppositeSign { .. }, Reason::WrongSigns { .. }) => true,
        (Alternative::OppositeSign { motor, .. }, Reason::WrongSignsOfJoint { joint, .. }) => {
            joint.position() == motor.position()
        }
        (Alternative::TorqueScale { motor, .. }, Reason::Contradicted { nuisance, .. }) => {
            matches!(nuisance.nuisance, NuisanceParameter::TorqueGain(joint)
                if joint.position() == motor.position())
        }
        _ => false,
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

/// Returns each item with the index of its joint.
fn numbered<T>(items: impl IntoIterator<Item = T>) -> impl Iterator<Item = (JointIndex, T)> {
    items.into_iter().enumerate().map(|(joint, item)| (JointIndex::new(joint), item))
}

/// Returns the joints whose value exceeds the limit.
fn exceeding<'a>(
    values: impl IntoIterator<Item = &'a f64>,
    limit: f64,
) -> impl Iterator<Item = (JointIndex, f64)> {
    numbered(values).map(|(joint, &value)| (joint, value)).filter(move |of| exceeds(of.1, limit))
}

/// True if a value exceeds its limit, or is not a number.
fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// Independent rows.
fn rows_per_parameter(context: &Context<'_>, rows: usize) -> f64 {
    context.decimation.cutoff_ratio() * rows as f64 / context.selection.names().len() as f64
}

/// Returns reasons for joints that do not move in any recording.
fn unmoved(context: &Context<'_>) -> impl Iterator<Item = Reason> {
    let (positions, recordings) =
        (context.experiment.position_rad(), context.experiment.recordings());
    let moved = |joint: JointIndex| {
        let ranges = recordings.iter().map(|of| {
            let of_samples = of.counted_samples.clone().map(|k| positions[(k, joint.position())]);
            let [low, high] =
                of_samples.fold([f64::MAX, f64::MIN], |[low, high], q| [low.min(q), high.max(q)]);
            high - low
        });
        ranges.fold(0.0, f64::max)
    };
    numbered(context.robot.chain()).filter_map(move |(joint, own)| {
        let (moved, range) = (moved(joint), own.limits.position_max - own.limits.position_min);
        let unit = own.kind.position_unit();
        (moved < UNMOVED * range.min(1.0)).then_some(Reason::Unmoved { joint, span: moved, unit })
    })
}
