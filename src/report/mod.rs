//! Results for people: tables, plots in the terminal, and figures.

mod advice;
mod consistent;
pub mod convergence;
pub mod cutoff;
mod date;
mod design;
pub mod estimate;
mod external_torque;
pub mod figure;
pub mod friction;
mod gains;
pub mod history;
pub mod html;
pub mod names;
mod panel;
mod payload;
pub mod reduction;
pub mod robot;
mod short_finding;
mod sweep;
pub mod terminal;
mod uses;

use didim_dynamics::robot::{JointIndex, Robot};
use didim_identification::identification::{Identification, Prediction};

use crate::text::significant_digits;

pub use advice::{MissingAdvice, MotionAdvice, advice_text};
pub use consistent::consistent_summary;
pub use date::date_text;
pub use design::{
    CheckedMotion, collision_statement, conditions_text, design_header, design_text,
    expectation_text, load_lines, load_sentence, prediction_lines,
};
pub use external_torque::ExternalTorqueFigure;
pub use gains::gains_text;
pub use payload::payload_text;
pub use sweep::{sweep_lines, sweep_text};

/// Measured and predicted torque of one joint, for a plot.
#[derive(Clone, Debug)]
pub struct TorquePanel<'a> {
    /// Number of the joint, with its name if it has one.
    pub joint: String,
    /// Unit of the torque: N·m, or N of a prismatic joint.
    pub unit: &'static str,
    /// Time of each row \[s\].
    pub time_s: &'a [f64],
    /// Measured torque after the filter of the identification.
    pub measured_nm: &'a [f64],
    /// Torque that the identified model predicts.
    pub predicted_nm: &'a [f64],
    /// Rows whose weights the robust estimation reduced.
    pub downweighted: &'a [usize],
    /// Relative error ‖measured − predicted‖ / ‖measured‖.
    pub relative_error: f64,
}

/// Measured and predicted torques of all joints, after the same filter.
#[derive(Clone, Copy, Debug)]
pub struct TorqueCurves<'a> {
    time_s: &'a [f64],
    measured: &'a [Vec<f64>],
    predicted: &'a [Vec<f64>],
    relative_error_per_joint: &'a [f64],
    downweighted: &'a [Vec<usize>],
}

impl<'a> From<&'a Identification> for TorqueCurves<'a> {
    fn from(Identification { estimate, fit }: &'a Identification) -> Self {
        Self {
            time_s: &fit.time_s,
            measured: &fit.measured,
            predicted: &fit.predicted,
            relative_error_per_joint: &estimate.relative_error_per_joint,
            downweighted: &fit.downweighted,
        }
    }
}

impl<'a> From<&'a Prediction> for TorqueCurves<'a> {
    fn from(prediction: &'a Prediction) -> Self {
        Self {
            time_s: &prediction.time_s,
            measured: &prediction.measured,
            predicted: &prediction.predicted,
            relative_error_per_joint: &prediction.error.relative_error_per_joint,
            downweighted: &[],
        }
    }
}

/// Creates one panel per joint.
pub fn joint_panels<'a>(
    curves: impl Into<TorqueCurves<'a>>,
    robot: &Robot,
) -> Vec<TorquePanel<'a>> {
    let curves = curves.into();
    let joints = curves.measured.iter().zip(curves.predicted).zip(curves.relative_error_per_joint);
    joints
        .zip(robot.chain())
        .enumerate()
        .map(|(index, (((measured_nm, predicted_nm), relative_error), described))| TorquePanel {
            joint: robot.joint_label(JointIndex::new(index)),
            unit: described.kind.torque_unit(),
            time_s: curves.time_s,
            measured_nm,
            predicted_nm,
            downweighted: curves.downweighted.get(index).map_or(&[], Vec::as_slice),
            relative_error: *relative_error,
        })
        .collect()
}

/// Returns the common extremes of several series, extended to include zero. `None` without finite
/// values.
fn value_range<'a>(series: impl IntoIterator<Item = &'a [f64]>) -> Option<(f64, f64)> {
    let finite = series.into_iter().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    (high > low).then_some((low, high))
}

/// Formats a ratio in per cent, with three digits.
fn percent_text(share: f64) -> String {
    format!("{} %", significant_digits(100.0 * share, 3))
}
