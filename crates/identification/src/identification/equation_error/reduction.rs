//! From base parameters to essential ones.

use serde::Serialize;

use super::fit::EquationErrorFit;
use super::loads::settle_loads;
use crate::identification::problem::{Context, Experiment, IdentificationError, Method, Options};
use crate::regression::{Observations, ResidualAnalysis};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// A parameter on its way out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReductionStep {
    /// Its name.
    pub name: String,
    /// Its relative standard deviation in the model that still has it, the largest of all.
    pub relative_standard_deviation: f64,
    /// F of the model without it and without those before, against the full model.
    pub f_statistic: f64,
    /// Probability of an F this large if all these parameters are zero.
    pub probability: f64,
}

/// Base parameters that a motion identifies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reduction {
    /// Below this probability a parameter stays.
    pub level: f64,
    /// Steps of the reduction, in their order.
    pub left_out: Vec<ReductionStep>,
    /// The parameter that could not be left out; none when all could but the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(rename = "kept")]
    pub fixed: Option<ReductionStep>,
    /// The parameters that stay, in the model's order.
    pub essential: Vec<String>,
}

/// Finds the essential parameters: of all base parameters, the one with the largest relative
/// standard deviation is left out, again and again, while an F-test does not tell the reduced model
/// from the full one at this level (Pham & Gautier, *Essential parameters of robots*, IEEE Conf.
/// Decision and Control 1991, for the order; Draper & Smith, *Applied Regression Analysis*, chapter
/// 6, for the test).
///
/// Every model is solved by weighted least squares with the weights of the full one; standard
/// deviations and F are corrected for coloured residuals. The options' own list of parameters is
/// not looked at. **This motion** does not need the parameters that are left out; another motion
/// may.
///
/// # Errors
/// [`IdentificationError::Level`], and those of IDIM-LS.
pub fn essential_parameters(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    level: f64,
) -> Result<Reduction, IdentificationError> {
    if !(level > 0.0 && level < 1.0) {
        return Err(IdentificationError::Level { level });
    }
    let options = Options { parameters: None, keep_nominal: None, ..options.clone() };
    let mut context = Context::new(robot, base, experiment, &options, Method::IdimLs)?;
    settle_loads(&mut context)?;
    let fit = EquationErrorFit::new(&context)?;
    let named = |error| context.selection.regression_failure(error);
    let (names, levels) = (context.selection.names(), &fit.noise_levels);
    let full = fit.weighting.solved_equation(&fit.observations);
    let filter = context.row_filter();
    let analysis = ResidualAnalysis::new(full, &fit.weighting.solution, &filter);
    let covariance = analysis.covariance();

    let mut essential: Vec<usize> = (0..names.len()).collect();
    let (mut out, mut left_out, mut fixed_part) = (Vec::new(), Vec::new(), None);
    while essential.len() > 1 {
        let matrix = full.matrix().dense().select_columns(&essential);
        let reduced = Observations::new(matrix, full.measurements().clone(), full.joints());
        let reduced = reduced.map_err(named)?;
        let solution = reduced.solve_weighted(levels).map_err(named)?;
        let deviations = ResidualAnalysis::new(&reduced, &solution, &filter).covariance();
        let deviations = deviations.diagonal().map(f64::sqrt);
        let relative = deviations.component_div(&solution.parameters).abs();
        let candidate = relative.imax();
        out.push(essential[candidate]);
        let test = analysis.test_exclusion(&out, &covariance).map_err(named)?;
        let step = ReductionStep {
            name: names[essential[candidate]].clone(),
            relative_standard_deviation: relative[candidate],
            f_statistic: test.f_statistic,
            probability: test.probability,
        };
        // Neither may it be left out where that is not known.
        if test.probability.is_nan() || test.probability < level {
            fixed_part = Some(step);
            break;
        }
        left_out.push(step);
        essential.remove(candidate);
    }
    let essential = essential.into_iter().map(|index| names[index].clone()).collect();
    Ok(Reduction { level, left_out, fixed: fixed_part, essential })
}
