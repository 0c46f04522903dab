//! What a motion tells.

use nalgebra::DMatrix;

use super::basis::Motion;
use super::error::ExcitationError;
use super::objective::covariance;
use super::series::FourierSeries;
use super::task::{Aim, Task};
use crate::trajectory::Reference;

/// Samples per second of a motion that stand for its rows \[Hz\].
pub(super) const TOLD_HZ: f64 = 200.0;

/// What a motion tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicted {
    /// Standard deviation of each parameter with this motion and what is known already.
    pub deviations: Vec<f64>,
    /// Condition number of the base columns of inertia along the motion alone, unweighted and without friction.
    pub condition_number: f64,
}

/// The information of a motion of the task's length, with what is known already (b × b): what is known before the next one.
pub fn information(task: &Task, series: &FourierSeries) -> DMatrix<f64> {
    told_at(task, series, TOLD_HZ)
}

/// The same by so many samples per second \[Hz\].
pub(super) fn told_at(task: &Task, series: &FourierSeries, rate_hz: f64) -> DMatrix<f64> {
    let task = Task { aim: Aim::Deviations(Vec::new()), ..task.clone() };
    let (mut told, _) = task.information(task.model.clone(), rate_hz);
    told.along(&sampled(series, task.duration_s, rate_hz))
}

/// What the aim of a task makes of a motion.
///
/// # Errors
/// [`ExcitationError::NotTold`].
pub(super) fn value(task: &Task, series: &FourierSeries) -> Result<f64, ExcitationError> {
    let (mut information, objective) = task.information(task.model.clone(), TOLD_HZ);
    let told = objective.of(&information.along(&sampled(series, series.duration_s, TOLD_HZ)));
    told.map(|(value, _)| value).ok_or(ExcitationError::NotTold { duration_s: series.duration_s })
}

/// What a motion of the task's length, designed or not, tells with what is known already.
///
/// # Errors
/// [`ExcitationError::NotTold`].
pub fn predicted(task: &Task, motion: &impl Reference) -> Result<Predicted, ExcitationError> {
    let motion = sampled(motion, task.duration_s, TOLD_HZ);
    let deviations = Task { aim: Aim::Deviations(Vec::new()), ..task.clone() };
    let (mut information, _) = deviations.information(task.model.clone(), TOLD_HZ);
    let covariance = covariance(&information.along(&motion))
        .ok_or(ExcitationError::NotTold { duration_s: task.duration_s })?;
    let conditioned = Task { aim: Aim::ConditionNumber, ..task.clone() };
    let (mut information, _) = conditioned.information(task.model.clone(), TOLD_HZ);
    let eigenvalues = information.along(&motion).symmetric_eigenvalues();
    Ok(Predicted {
        deviations: covariance.diagonal().iter().map(|square| square.sqrt()).collect(),
        condition_number: (eigenvalues.max() / eigenvalues.min().max(0.0)).sqrt(),
    })
}

/// The regressor's rows along a motion of the task's length (r × b), each over the noise of its joint; 0 of a joint that stands.
pub fn rows(task: &Task, motion: &impl Reference) -> DMatrix<f64> {
    let task = Task { aim: Aim::Deviations(Vec::new()), ..task.clone() };
    let (mut information, _) = task.information(task.model.clone(), TOLD_HZ);
    information.rows(&sampled(motion, task.duration_s, TOLD_HZ))
}

/// A motion at the samples that stand for it; its jerk tells nothing.
fn sampled(motion: &impl Reference, duration_s: f64, rate_hz: f64) -> Motion {
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
        motion.at(time_s, at_q, at_dq, at_ddq);
    }
    [q, dq, ddq, jerk]
}
