//! Checks that a minimum is that of the arm's parameters, and that the criterion identifies them.

use nalgebra::DVector;

use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::{Estimate, Output, Reason};
use crate::identification::problem::Context;

/// A minimum that leaves more than the noise is not that of the arm's parameters: the torque
/// errors, in the noise levels of the equation error, √(Σ ‖ρ_j‖²/σ_j² / (r − b)), about 1 where
/// both models are right.
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

/// A criterion that hardly depends on the parameters has not said what they are, although the
/// record tells (section 4.3). Only the parameters that IDIM-LS finds significantly count. Half of
/// them have a large relative uncertainty, and half are much less certain than by IDIM-LS on the
/// same record.
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

/// The upper median; none of none.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
