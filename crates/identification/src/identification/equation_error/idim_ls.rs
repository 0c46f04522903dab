//! IDIM-LS: the inverse dynamic identification model and least squares (paper, section 3.1).

use super::fit::EquationErrorFit;
use crate::identification::judgement::{Findings, Identification, Iteration, PositionError};
use crate::identification::problem::{Context, IdentificationError, Method};

/// Identifies base parameters by weighted least squares on the filtered inverse dynamic model.
///
/// 1. Filter the positions with zero phase and differentiate them twice (section 3.1.1).
/// 2. Apply the parallel filter to each column of the regressor, and to the torque at the instants
///    of the positions. Every n_d-th counted sample becomes a row of every joint (equations 6 to
///    8).
/// 3. Ordinary least squares (9) gives each joint's noise level, `σ_j² = ‖ρ_j‖²/(N − b/n)` (12).
/// 4. One weighted pass gives the parameters, their covariance `(XᵀΩ⁻¹X)⁻¹` (10) and the singular
///    values of `Ω^{-1/2} X`.
///
/// The covariance assumes white residuals. They are not white: the parallel filter correlates
/// neighbouring rows (a factor √(1/0.8) with the default cut-off), and a model error correlates
/// them more. So the standard deviations of the result are corrected
/// ([`ResidualAnalysis`](crate::regression::ResidualAnalysis)). The result also contains the
/// classical ones.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub(crate) fn idim_ls(context: &Context<'_>) -> Result<Identification, IdentificationError> {
    let (fit, auxiliary) = EquationErrorFit::with_auxiliary(context)?;
    let findings = Findings {
        method: Method::IdimLs,
        motion: &fit.motion,
        auxiliary_columns: &auxiliary,
        position_error: PositionError::InTheRegressor,
        observations: fit.weighting.solved_equation(&fit.observations),
        torque: fit.weighting.torque_rows(&fit.observations),
        solution: &fit.weighting.solution,
        unweighted: fit.unweighted_singular_values,
        downweighted: fit.weighting.downweighted_rows(),
        outliers: fit.outlier_samples(context, None),
        iteration: Iteration { linear_steps: 1, ..Iteration::default() },
    };
    findings.judged(context)
}
