//! Whether a result may be used: one place, thresholds as data, reasons in words.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::identification::judgement::checks::{CERTAIN, Freedom, ModelCheck};
use crate::identification::judgement::estimate::{Estimate, ReferenceSource, Verdict};
use crate::robot::ParameterKind;
use crate::signal::ParallelDecimation;

/// What a result must satisfy to be called applicable.
///
/// The verdict finds what the data can show: a motion that does not excite, a model of another arm,
/// a torque with the wrong sign, a friction law that is not the arm's. It cannot find what no data
/// show, a factor common to all torques above all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VerdictLimits {
    /// Fewest independent rows (rows times the passband of the decimation filter) for each
    /// parameter. 8: with fewer, the residuals tell too little of their own spectrum.
    pub rows_per_parameter: f64,
    /// Largest condition number of the weighted, decimated observation matrix. 5000: the paper's
    /// useful results have up to 1178 (its tables 2 and 5), its poor one 7622.
    pub condition_number: f64,
    /// How uncertain the parameters may make the torque of a joint along the window's own motion,
    /// relative to that torque. 0.10: a short or quiet window then has too little to tell.
    pub prediction_deviation: f64,
    /// Largest relative error ‖y − Xθ‖/‖y‖ over all joints. 0.10: a good model of an industrial arm
    /// reaches 0.04 to 0.07.
    pub relative_error: f64,
    /// Largest relative error of a single joint. 0.25: wrists with little load reach 0.12, a joint
    /// with a wrong coupling 0.15 to 0.33.
    pub relative_error_per_joint: f64,
    /// A friction coefficient or drive inertia below zero by more than this many standard
    /// deviations is impossible. 3.
    pub negative_deviations: f64,
    /// Furthest that a parameter may move, in its standard deviations, if the model is free where
    /// the data want it to be ([`ModelCheck`]). 4: the standard deviation is then no longer the
    /// uncertainty.
    pub model_shift_deviations: f64,
    /// A model check counts when a right model gives it by chance with less than this probability.
    /// 1e-4: some twenty checks then cry wolf in one result of five hundred.
    pub model_probability: f64,
    /// How far the command that the described controller makes of the recorded reference and
    /// position may be from the recorded one, relative to it. 0.001: counts of reference and torque
    /// leave a few 1e-5, a gain that is wrong by 2 % twice this limit.
    pub controller_error: f64,
    /// Furthest that position filter and position noise may move a parameter, in its standard
    /// deviations. 0.5: half of what the noise of the torques does.
    pub position_filter_deviations: f64,
}

impl Default for VerdictLimits {
    fn default() -> Self {
        Self {
            rows_per_parameter: 8.0,
            condition_number: 5000.0,
            prediction_deviation: 0.10,
            relative_error: 0.10,
            relative_error_per_joint: 0.25,
            negative_deviations: 3.0,
            model_shift_deviations: 4.0,
            model_probability: 1e-4,
            controller_error: 0.001,
            position_filter_deviations: 0.5,
        }
    }
}

/// A limit that no result can be held against.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("limit {name} = {value} must be finite and greater than 0, and a share at most 1")]
pub struct LimitError {
    /// Its key.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
}

impl VerdictLimits {
    /// Whether every limit is finite and greater than 0: against NaN everything passes.
    ///
    /// # Errors
    /// [`LimitError`] names the first that is not.
    pub fn validate(&self) -> Result<(), LimitError> {
        for (name, value) in [
            ("rows_per_parameter", self.rows_per_parameter),
            ("condition_number", self.condition_number),
            ("prediction_deviation", self.prediction_deviation),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("negative_deviations", self.negative_deviations),
            ("model_shift_deviations", self.model_shift_deviations),
            ("model_probability", self.model_probability),
            ("controller_error", self.controller_error),
            ("position_filter_deviations", self.position_filter_deviations),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(LimitError { name, value });
            }
        }
        // Shares of the whole; 5 % is 0.05.
        for (name, value) in [
            ("model_probability", self.model_probability),
            ("relative_error", self.relative_error),
            ("relative_error_per_joint", self.relative_error_per_joint),
            ("prediction_deviation", self.prediction_deviation),
            ("controller_error", self.controller_error),
        ] {
            if value > 1.0 {
                return Err(LimitError { name, value });
            }
        }
        Ok(())
    }

    /// Judges an estimate; `kinds` are those of its parameters, in their order, and `indefinite` is
    /// a posture where the mass matrix is not positive definite. A figure that is not a number
    /// fails.
    pub(crate) fn judge(
        &self,
        estimate: &Estimate,
        kinds: &[ParameterKind],
        indefinite: Option<&[f64]>,
        decimation: &ParallelDecimation,
    ) -> Verdict {
        // First what others may follow from.
        let mut reasons = self.controller(estimate);
        reasons.extend(self.excitation_and_error(estimate));
        let independent = decimation.cutoff_ratio() * estimate.rows as f64;
        let per_parameter = independent / estimate.parameters.len() as f64;
        if exceeds(self.rows_per_parameter, per_parameter) {
            reasons.push(format!(
                "{per_parameter:.1} independent rows for each parameter are fewer than {}: too few \
                 to say how uncertain they are; move longer or identify fewer parameters",
                self.rows_per_parameter
            ));
        }
        if decimation.is_none() {
            reasons.push(
                "identified without the decimation filter, which is for comparison only: what the \
                 loop makes of the reference's counts stays in the regressor; decimate"
                    .to_owned(),
            );
        }
        reasons.extend(self.impossible_signs(estimate, kinds));
        reasons.extend(indefinite.map(|posture| {
            let posture: Vec<String> = posture.iter().map(|q| format!("{q:.2}")).collect();
            format!(
                "the mass matrix is not positive definite at q = ({}): no arm has these inertias; \
                 move along a richer trajectory or identify fewer parameters",
                posture.join(", ")
            )
        }));
        reasons.extend(self.model_errors(&estimate.model_checks));
        let notes = self.notes(estimate, decimation);
        Verdict { applicable: reasons.is_empty(), reasons, notes, failure: None }
    }

    /// A controller that is not the recorded one.
    fn controller(&self, estimate: &Estimate) -> Vec<String> {
        let errors = (1..).zip(estimate.controller_error_per_joint.iter().flatten());
        let wrong = errors.filter(|(_, error)| exceeds(**error, self.controller_error));
        wrong
            .map(|(joint, error): (usize, _)| {
                format!(
                    "the described controller of joint {joint} makes a command that is {:.2} % off \
                     the recorded one: check its gains and timing, the reference and the torque gain \
                     of the drive first, what else is named may follow from it",
                    100.0 * error
                )
            })
            .collect()
    }

    /// Too little excitation, too large an error.
    fn excitation_and_error(&self, estimate: &Estimate) -> Vec<String> {
        let mut reasons = Vec::new();
        if exceeds(estimate.condition_number, self.condition_number) {
            reasons.push(format!(
                "condition number {:.0} is above {}: the motion does not tell these parameters \
                 apart; move along a richer trajectory or identify fewer",
                estimate.condition_number, self.condition_number
            ));
        }
        for (joint, &deviation) in (1..).zip(&estimate.relative_prediction_deviation_per_joint) {
            if exceeds(deviation, self.prediction_deviation) {
                reasons.push(format!(
                    "the parameters leave the torque of joint {joint} uncertain by {:.1} %, above \
                     {:.1} %: move longer or more, or identify fewer parameters",
                    100.0 * deviation,
                    100.0 * self.prediction_deviation
                ));
            }
        }
        if exceeds(estimate.relative_error, self.relative_error) {
            reasons.push(format!(
                "relative error {:.1} % is above {:.1} %: the model does not describe the \
                 measured torques; check drive gains, signs and timing",
                100.0 * estimate.relative_error,
                100.0 * self.relative_error
            ));
        }
        for (joint, &error) in (1..).zip(&estimate.relative_error_per_joint) {
            if exceeds(error, self.relative_error_per_joint) {
                reasons.push(format!(
                    "relative error {:.1} % of joint {joint} is above {:.1} %: check its gear \
                     ratio, coupling and drive gain",
                    100.0 * error,
                    100.0 * self.relative_error_per_joint
                ));
            }
        }
        reasons
    }

    /// Friction and drive inertia below zero.
    fn impossible_signs(&self, estimate: &Estimate, kinds: &[ParameterKind]) -> Vec<String> {
        let mut reasons = Vec::new();
        for (parameter, &kind) in estimate.parameters.iter().zip(kinds) {
            // A regrouped parameter may be negative: others are subtracted in it.
            let Some(what) = positive_quantity(kind).filter(|_| !parameter.name.ends_with('r'))
            else {
                continue;
            };
            let allowed = self.negative_deviations * parameter.standard_deviation;
            if exceeds(-parameter.value, allowed) {
                reasons.push(format!(
                    "{what} {} is negative, {:.4} with a standard deviation of {:.2e}: check the \
                     signs of torque and transmission",
                    parameter.name, parameter.value, parameter.standard_deviation
                ));
            }
        }
        reasons
    }

    /// What the model does not have and the data want, one reason for all of a kind.
    fn model_errors(&self, checks: &[ModelCheck]) -> Vec<String> {
        let mut kinds: Vec<Vec<&ModelCheck>> = Vec::new();
        for check in checks.iter().filter(|check| self.fails(check)) {
            let (problem, _) = problem_and_remedy(check.freedom);
            match kinds.iter_mut().find(|of| problem_and_remedy(of[0].freedom).0 == problem) {
                Some(kind) => kind.push(check),
                None => kinds.push(vec![check]),
            }
        }
        let reason = |kind: &Vec<&ModelCheck>| {
            let by_shift = |a: &&&ModelCheck, b: &&&ModelCheck| {
                a.shift_deviations.abs().total_cmp(&b.shift_deviations.abs())
            };
            let worst = kind.iter().max_by(by_shift)?;
            let (problem, remedy) = problem_and_remedy(worst.freedom);
            // "friction law of joint 1, joint 2": what it is of, from the second on.
            let names = kind.iter().enumerate().map(|(k, check)| {
                let name = check.freedom.to_string();
                let of = name.split(" of ").last().filter(|_| k > 0);
                of.map_or(name.clone(), str::to_owned)
            });
            let names: Vec<String> = names.collect();
            Some(format!(
                "the {} {problem}: allowing for it, {} would move by {:.1} standard deviations; \
                 {remedy}",
                names.join(", "),
                worst.parameter,
                worst.shift_deviations.abs()
            ))
        };
        kinds.iter().filter_map(reason).collect()
    }

    /// Parameters that the torques along the motion want otherwise than the positions do: with the right
    /// model and controller both are the arm's. `apart` is their difference, and `deviations` its
    /// standard deviations as if they had no errors in common, which makes them too large.
    pub(crate) fn other_parameters(
        &self,
        names: &[String],
        apart: &DVector<f64>,
        deviations: &DVector<f64>,
    ) -> Option<String> {
        let (name, apart) = (names.iter())
            .zip(apart.component_div(deviations).abs().iter().copied())
            .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        exceeds(apart, self.model_shift_deviations).then(|| {
            format!(
                "the torques along the simulated motion want other parameters than the positions: \
                 {name} is {apart:.1} standard deviations off; check the described controller and the \
                 model, or identify from the torques (clie, didim)"
            )
        })
    }

    /// Whether a freedom matters: the data want it, and it moves a parameter too far.
    pub fn fails(&self, check: &ModelCheck) -> bool {
        let limit = match check.freedom {
            Freedom::PositionFilter | Freedom::PositionNoise => self.position_filter_deviations,
            _ => self.model_shift_deviations,
        };
        let by_chance = check.probability.is_some_and(|p| p >= self.model_probability);
        let shift = check.shift_deviations.abs();
        let uncertain = check.shift_uncertainty.is_some_and(|u| shift <= CERTAIN * u);
        !by_chance && !uncertain && exceeds(shift, limit)
    }

    /// What must be known with a result and does not speak against its use.
    fn notes(&self, estimate: &Estimate, decimation: &ParallelDecimation) -> Vec<String> {
        let mut notes = Vec::new();
        if estimate.reference == Some(ReferenceSource::MeasuredPosition) {
            notes.push(
                "no reference was recorded: the filtered measured position stood in for it, which \
                 the simulated loop follows with a lag of its own; at best this result is nearly \
                 that of IDIM-LS"
                    .to_owned(),
            );
        }
        let unknown: Vec<&str> = (estimate.parameters.iter())
            .filter(|p| exceeds(INDISTINGUISHABLE * p.standard_deviation, p.value.abs()))
            .map(|p| p.name.as_str())
            .collect();
        if !unknown.is_empty() {
            notes.push(format!(
                "not to be told from zero by this motion: {}; leave them out, or move the joints \
                 concerned more",
                unknown.join(", ")
            ));
        }
        let joints = (1..).zip(&estimate.whiteness_per_joint);
        let coloured: Vec<String> = joints
            .filter(|(_, probability)| exceeds(self.model_probability, **probability))
            .map(|(joint, _): (usize, _)| joint.to_string())
            .collect();
        if !coloured.is_empty() {
            notes.push(format!(
                "the residuals of joint {} are not white{}; the standard deviations allow for it",
                coloured.join(", "),
                if decimation.is_none() { "" } else { " behind the decimation filter" }
            ));
        }
        notes
    }
}

/// What is wrong where a freedom matters, and what to do.
fn problem_and_remedy(freedom: Freedom) -> (&'static str, &'static str) {
    match freedom {
        Freedom::JointFriction(_) | Freedom::MotorFriction(_) => {
            ("is not the model's", "choose another sign model, one that fits no worse")
        }
        Freedom::TorqueDelay => {
            ("is not as stated", "check the torque's hold and delay, with didim the controller too")
        }
        Freedom::TorqueGain(_) => ("does not fit the others'", "check drive gain and gear ratio"),
        Freedom::LeftOutParameters => {
            ("are not zero", "identify more parameters, and check for a payload")
        }
        Freedom::PositionFilter => ("distorts the motion", "raise its cut-off"),
        Freedom::PositionNoise => (
            "bends the friction law",
            "measure positions with less noise; with idim-ls, lower the cut-off of the position \
             filter",
        ),
    }
}

/// A parameter within so many standard deviations of zero could be zero.
const INDISTINGUISHABLE: f64 = 2.0;

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
