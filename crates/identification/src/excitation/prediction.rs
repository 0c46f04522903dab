//! Predicted accuracy of the parameters from a motion.

use nalgebra::DMatrix;

use super::basis::Motion;
use super::error::ExcitationError;
use super::objective::variances;
use super::series::FourierSeries;
use super::task::{DesignObjective, Task};
use didim_dynamics::trajectory::Reference;

/// Sample rate of the samples that represent the rows of a motion \[Hz\].
pub(super) const PREDICTION_HZ: f64 = 200.0;

/// Predicted result of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicted {
    /// Standard deviation of each parameter from this motion and the prior information.
    pub deviations: Vec<f64>,
    /// Condition number of the base columns of inertia along the motion alone, unweighted and
    /// without friction.
    pub condition_number: f64,
}

/// Returns the information of a motion of the task's duration plus the prior information (b × b).
/// It is the prior information for the next motion.
pub fn information(task: &Task, series: &FourierSeries) -> DMatrix<f64> {
    predicted_at(task, series, PREDICTION_HZ)
}

/// Returns the same information of any motion, computed at `rate_hz` samples per second \[Hz\].
pub(super) fn predicted_at(task: &Task, motion: &impl Reference, rate_hz: f64) -> DMatrix<f64> {
    let task = Task { objective: DesignObjective::Deviations(Vec::new()), ..task.clone() };
    let (mut prediction, _) = task.information(task.model.clone(), rate_hz);
    prediction.weighted_regressor(&sample_motion(motion, task.duration_s, rate_hz))
}

/// Returns the value of a motion by the task's objective.
///
/// # Errors
/// [`ExcitationError::NotIdentifiable`].
pub(super) fn value(task: &Task, series: &FourierSeries) -> Result<f64, ExcitationError> {
    let (mut information, objective) = task.information(task.model.clone(), PREDICTION_HZ);
    let figure = objective.value(&information.weighted_regressor(&sample_motion(
        series,
        series.duration_s,
        PREDICTION_HZ,
    )));
    figure.ok_or(ExcitationError::NotIdentifiable { duration_s: series.duration_s })
}

/// Predicts the result of any motion of the task's duration, together with the prior information.
///
/// # Errors
/// [`ExcitationError::NotIdentifiable`].
pub fn predict_result(task: &Task, motion: &impl Reference) -> Result<Predicted, ExcitationError> {
    let motion = sample_motion(motion, task.duration_s, PREDICTION_HZ);
    let deviations = Task { objective: DesignObjective::Deviations(Vec::new()), ..task.clone() };
    let (mut information, _) = deviations.information(task.model.clone(), PREDICTION_HZ);
    let variances = variances(&information.weighted_regressor(&motion))
        .ok_or(ExcitationError::NotIdentifiable { duration_s: task.duration_s })?;
    let conditioned = Task { objective: DesignObjective::ConditionNumber, ..task.clone() };
    let (mut information, _) = conditioned.information(task.model.clone(), PREDICTION_HZ);
    let eigenvalues = information.weighted_regressor(&motion).symmetric_eigenvalues();
    Ok(Predicted {
        deviations: variances.iter().map(|variance| variance.sqrt()).collect(),
        condition_number: (eigenvalues.max() / eigenvalues.min().max(0.0)).sqrt(),
    })
}

/// Returns the regressor's rows along a motion of the task's length (r × b), each divided by the
/// noise of its joint. Rows of a joint at rest are 0.
pub fn rows(task: &Task, motion: &impl Reference) -> DMatrix<f64> {
    let task = Task { objective: DesignObjective::Deviations(Vec::new()), ..task.clone() };
    let (mut information, _) = task.information(task.model.clone(), PREDICTION_HZ);
    information.rows(&sample_motion(motion, task.duration_s, PREDICTION_HZ))
}

/// Returns a motion at the samples that represent it. The jerk contributes no information.
fn sample_motion(motion: &impl Reference, duration_s: f64, rate_hz: f64) -> Motion {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a motion has far fewer samples than 2^52"
    )]
    let samples = (duration_s * rate_hz).round().max(1.0) as usize;
    let none = || DMatrix::zeros(motion.joints(), samples);
    let [mut q, mut dq, mut ddq, jerk] = [none(), none(), none(), none()];
    for i in 0..samples {
        let [mut at_q, mut at_dq, mut at_ddq] =
            [&mut q, &mut dq, &mut ddq].map(|of| of.column_mut(i));
        let time_s = duration_s * i as f64 / samples as f64;
        let [at_q, at_dq, at_ddq] =
            [at_q.as_mut_slice(), at_dq.as_mut_slice(), at_ddq.as_mut_slice()];
        motion.evaluate(time_s, at_q, at_dq, at_ddq);
    }
    [q, dq, ddq, jerk]
}
