//! IDIM-LS without the checks of a verdict.

use super::fit::EquationErrorFit;
use super::loads::settle_loads;
use crate::identification::problem::{Context, Experiment, IdentificationError, Method, Options};
use crate::regression::ResidualStatistics;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Parameter of an estimate without a verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct UncheckedParameter {
    /// The field's name in lower case.
    pub name: String,
    /// SI value.
    pub value: f64,
    /// Standard deviation, in the unit of the value, corrected for the colour of the residuals. It
    /// does not include model errors.
    pub standard_deviation: f64,
}

/// Parameters without a verdict, for example as the start of a simulation or for a noise study.
///
/// It is not an [`Estimate`](crate::identification::Estimate), so that it cannot be passed to
/// functions that require a checked result.
#[derive(Clone, Debug, PartialEq)]
pub struct UncheckedEstimate {
    /// The parameters, in the model's order.
    pub parameters: Vec<UncheckedParameter>,
    /// Condition number of the weighted, decimated observation matrix.
    pub condition_number: f64,
    /// Residuals of the filtered, decimated torques \[N·m or N\].
    pub residuals: ResidualStatistics,
}

/// Returns the same parameters as IDIM-LS, to the last bit, without the checks of its verdict.
///
/// It does not compute: the whiteness of the residuals, the checks of the model (friction laws,
/// torque delays and gains, parameters left out, position filter), the mass matrix over the
/// workspace, the comparison with the limits of the options, and the fit for plots. Invalid limits
/// are still refused.
///
/// # Errors
/// Those of IDIM-LS.
pub fn idim_ls_unchecked(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
) -> Result<UncheckedEstimate, IdentificationError> {
    let mut context = Context::new(robot, base, experiment, options, Method::IdimLs)?;
    settle_loads(&mut context)?;
    let fit = EquationErrorFit::new(&context)?;
    let EquationErrorFit { observations, weighting: weighted, .. } = &fit;
    let solution = &weighted.solution;
    let robust = weighted.torque_rows(observations);
    let residuals = robust.map_or(&solution.residuals, |rows| rows.residuals);
    let deviations = fit.standard_deviations(&context);
    let names = context.selection.names().iter().zip(solution.parameters.iter());
    let parameters = names.zip(deviations.iter()).map(|((name, value), deviation)| {
        UncheckedParameter { name: name.clone(), value: *value, standard_deviation: *deviation }
    });
    Ok(UncheckedEstimate {
        parameters: parameters.collect(),
        condition_number: solution.condition_number(),
        residuals: observations.residual_statistics(residuals),
    })
}
