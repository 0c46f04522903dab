//! Whether a result may be used: what exceeds which limit.

use nalgebra::DVector;

use super::alternative::{Alternative, ModelCheck};
use super::estimate::{Estimate, ReferenceSource};
use super::reasons::{Note, Reason};
use crate::identification::given::{Context, VerdictLimits};
use crate::robot::ParameterKind;

/// A shift counts when it is this many times its own uncertainty.
pub(super) const CERTAIN: f64 = 3.0;

/// A parameter within this many standard deviations of zero could be zero.
const INSIGNIFICANT: f64 = 2.0;

impl VerdictLimits {
    /// What speaks against an estimate; `indefinite` is a posture where the mass matrix is not positive
    /// definite. A figure that is not a number fails.
    pub(super) fn reasons(
        &self,
        context: &Context<'_>,
        estimate: &Estimate,
        indefinite: Option<Vec<f64>>,
    ) -> Vec<Reason> {
        // First what others may follow from.
        let errors = estimate.controller_error_per_joint.iter().flatten();
        let mut reasons: Vec<Reason> = exceeding(errors, self.controller_error)
            .map(|(joint, error)| Reason::Controller { joint, error })
            .collect();
        self.excitation_and_error(estimate, &mut reasons);
        let independent = context.decimation.cutoff_ratio() * estimate.rows as f64;
        let per_parameter = independent / estimate.parameters.len() as f64;
        if exceeds(self.rows_per_parameter, per_parameter) {
            reasons.push(Reason::FewRows { per_parameter, limit: self.rows_per_parameter });
        }
        if context.decimation.is_none() {
            reasons.push(Reason::NotDecimated);
        }
        self.impossible_signs(estimate, context.selection.kinds(), &mut reasons);
        reasons.extend(indefinite.map(|posture| Reason::Indefinite { posture }));
        self.model_errors(&estimate.model_checks, &mut reasons);
        reasons
    }

    /// Too little excitation, too large an error.
    fn excitation_and_error(&self, estimate: &Estimate, reasons: &mut Vec<Reason>) {
        let (value, limit) = (estimate.condition_number, self.condition_number);
        if exceeds(value, limit) {
            reasons.push(Reason::ConditionNumber { value, limit });
        }
        let (deviations, limit) =
            (&estimate.relative_prediction_deviation_per_joint, self.prediction_deviation);
        reasons.extend(
            exceeding(deviations, limit).map(|(joint, deviation)| Reason::PredictionDeviation {
                joint,
                deviation,
                limit,
            }),
        );
        let (error, limit) = (estimate.relative_error, self.relative_error);
        if exceeds(error, limit) {
            reasons.push(Reason::RelativeError { error, limit });
        }
        let (errors, limit) = (&estimate.relative_error_per_joint, self.relative_error_per_joint);
        reasons.extend(exceeding(errors, limit).map(|(joint, error)| Reason::JointError {
            joint,
            error,
            limit,
        }));
    }

    /// Friction and drive inertia below zero.
    fn impossible_signs(
        &self,
        estimate: &Estimate,
        kinds: &[ParameterKind],
        reasons: &mut Vec<Reason>,
    ) {
        // A regrouped parameter may be negative: others are subtracted in it.
        let alone = estimate.parameters.iter().zip(kinds).filter(|(p, _)| !p.regrouped);
        for (parameter, &kind) in alone {
            let (value, standard_deviation) = (parameter.value, parameter.standard_deviation);
            let Some(quantity) = positive_quantity(kind) else { continue };
            if exceeds(-value, self.negative_deviations * standard_deviation) {
                let name = parameter.name.clone();
                reasons.push(Reason::Negative { quantity, name, value, standard_deviation });
            }
        }
    }

    /// Effects that the model lacks and the data support, one reason for all of a kind.
    fn model_errors(&self, checks: &[ModelCheck], reasons: &mut Vec<Reason>) {
        let mut kinds: Vec<Vec<ModelCheck>> = Vec::new();
        for check in checks.iter().filter(|check| self.fails(check)) {
            let quantity = check.alternative.quantity();
            match kinds.iter_mut().find(|kind| kind[0].alternative.quantity() == quantity) {
                Some(kind) => kind.push(check.clone()),
                None => kinds.push(vec![check.clone()]),
            }
        }
        reasons.extend(kinds.into_iter().map(|checks| Reason::Model { checks }));
    }

    /// Parameters that the torques along the motion want otherwise than the positions do: with the right
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

    /// Whether an alternative matters: the data support it, and it changes a parameter too much.
    pub fn fails(&self, check: &ModelCheck) -> bool {
        let limit = match check.alternative {
            Alternative::PositionFilter | Alternative::PositionNoise => {
                self.position_filter_deviations
            }
            _ => self.model_shift_deviations,
        };
        let by_chance = check.probability.is_some_and(|p| p >= self.model_probability);
        let shift = check.shift_deviations.abs();
        let uncertain = check.shift_uncertainty.is_some_and(|u| shift <= CERTAIN * u);
        !by_chance && !uncertain && exceeds(shift, limit)
    }

    /// What must be known with a result and does not speak against its use.
    pub(super) fn notes(&self, context: &Context<'_>, estimate: &Estimate) -> Vec<Note> {
        let mut notes = Vec::new();
        if estimate.reference == Some(ReferenceSource::MeasuredPosition) {
            notes.push(Note::NoReference);
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
        notes
    }
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

/// What the quantity is called when it cannot be negative.
fn positive_quantity(kind: ParameterKind) -> Option<&'static str> {
    match kind {
        ParameterKind::Ia => Some("drive inertia"),
        ParameterKind::Fv | ParameterKind::FvMotor => Some("viscous friction"),
        ParameterKind::Fc | ParameterKind::FcMotor => Some("Coulomb friction"),
        _ => None,
    }
}
