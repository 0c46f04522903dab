//! Results for people: tables, plots in the terminal, and figures.

pub mod comparison;
pub mod convergence;
pub mod estimate;
pub mod figure;
pub mod history;
pub mod html;
mod panel;
pub mod reduction;
pub mod terminal;
mod uses;

use didim_core::identification::Identification;
use didim_core::robot::Robot;

/// One joint's torque, measured and predicted, for a plot.
#[derive(Clone, Copy, Debug)]
pub struct TorquePanel<'a> {
    /// The joint's number, from 1.
    pub joint: usize,
    /// Unit of the torque: N·m, or N of a prismatic joint.
    pub unit: &'static str,
    /// Time of each row \[s\].
    pub time_s: &'a [f64],
    /// Measured torque, filtered as the identification used it.
    pub measured_nm: &'a [f64],
    /// Torque that the identified model predicts.
    pub predicted_nm: &'a [f64],
    /// Rows that robust weights weight down.
    pub downweighted: &'a [usize],
    /// ‖measured − predicted‖ / ‖measured‖.
    pub relative_error: f64,
}

/// One panel per joint of a fit.
pub fn panels<'a>(identification: &'a Identification, robot: &Robot) -> Vec<TorquePanel<'a>> {
    let (estimate, fit) = (&identification.estimate, &identification.fit);
    fit.measured
        .iter()
        .zip(&fit.predicted)
        .zip(&estimate.relative_error_per_joint)
        .zip(robot.chain())
        .zip(1..)
        .map(|((((measured_nm, predicted_nm), relative_error), described), joint)| TorquePanel {
            joint,
            unit: described.kind.torque_unit(),
            time_s: &fit.time_s,
            measured_nm,
            predicted_nm,
            downweighted: fit.downweighted.get(joint - 1).map_or(&[], Vec::as_slice),
            relative_error: *relative_error,
        })
        .collect()
}

/// The extremes of several series together, widened to contain zero; `None` without finite values.
fn value_range<'a>(series: impl IntoIterator<Item = &'a [f64]>) -> Option<(f64, f64)> {
    let finite = series.into_iter().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    (high > low).then_some((low, high))
}
