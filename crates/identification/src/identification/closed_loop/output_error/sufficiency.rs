//! Checks that a minimum belongs to the arm's parameters, and that the criterion identifies them.

use nalgebra::DVector;

use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::{Estimate, Output, Reason};
use crate::identification::problem::Context;

/// Returns a reason against the result if the residual at the minimum exceeds the noise, because
/// the minimum then does not belong to the arm's parameters. The ratio is √(Σ ‖ρ_j‖²/σ_j² / (r −
/// b)) with the torque errors ρ_j and the noise levels σ_j of the equation error. It is about 1 if
/// both models are correct.
pub(super) fn above_noise_reason(
    context: &Context<'_>,
    fit: &EquationErrorFit,
    residuals: &DVector<f64>,
) -> Option<Reason> {
    let rows = residuals.len() / fit.noise_levels.len();
    let joints = residuals.as_slice().chunks(rows).zip(&fit.noise_levels);
    let sum: f64 =
        joints.map(|(rho, level)| rho.iter().map(|r| (r / level).powi(2)).sum::<f64>()).sum();
    let degrees_of_freedom = residuals.len() - fit.weighting.solution.parameters.len();
    let ratio = (sum / degrees_of_freedom as f64).sqrt();
    let noise = ratio <= context.options.closed_loop_limits.noise_ratio;
    (!noise).then_some(Reason::AboveNoise { ratio })
}

/// Returns a reason against the result if the criterion hardly depends on the parameters, although
/// the record contains enough information (section 4.3). Only parameters that IDIM-LS identifies
/// significantly are examined. The criterion is insensitive if the median of their relative
/// standard deviations is large, and the median ratio to their standard deviations by IDIM-LS is
/// large too.
pub(super) fn insensitivity_reason(
    context: &Context<'_>,
    output: Output,
    estimate: &Estimate,
    fit: &EquationErrorFit,
) -> Option<Reason> {
    let limits = &context.options.closed_loop_limits;
    let uncertainties = fit.standard_deviations(context);
    let well_known = (fit.weighting.solution.parameters.iter())
        .zip(uncertainties.iter())
        .zip(&estimate.parameters)
        .filter(|((value, sd), _)| value.abs() > limits.significant_deviations * **sd);
    let (deviations, losses): (Vec<f64>, Vec<f64>) = well_known
        .map(|((value, sd), found)| {
            (found.standard_deviation / value.abs(), found.standard_deviation / sd)
        })
        .unzip();
    let (deviation, loss) = (median(deviations)?, median(losses)?);
    let determined = deviation <= limits.relative_deviation || loss <= limits.deviation_ratio;
    let singular_value = estimate.singular_values.min;
    (!determined).then_some(Reason::Insensitive { output, deviation, loss, singular_value })
}

/// Returns the upper median; `None` for an empty list.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
