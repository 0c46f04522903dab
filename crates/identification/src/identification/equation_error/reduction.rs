//! Reduction of the base parameters to the essential ones.

use serde::Serialize;

use super::fit::EquationErrorFit;
use super::loads::settle_loads;
use crate::identification::problem::{Context, Experiment, IdentificationError, Method, Options};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Test of one parameter for exclusion from the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReductionStep {
    /// Its name.
    pub name: String,
    /// Relative standard deviation in the model before its exclusion, the largest of all
    /// parameters.
    pub relative_standard_deviation: f64,
    /// F statistic of the model without this parameter and all previously excluded ones, against
    /// the full model.
    pub f_statistic: f64,
    /// Probability of an F this large if all these parameters are zero.
    pub probability: f64,
}

/// Base parameters that a motion identifies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reduction {
    /// Significance level: a parameter is kept if its probability is lower.
    pub level: f64,
    /// Steps of the reduction, in their order.
    pub left_out: Vec<ReductionStep>,
    /// First parameter that could not be excluded; `None` if all parameters but one were excluded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(rename = "kept")]
    pub fixed: Option<ReductionStep>,
    /// Essential parameters, in the model's order.
    pub essential: Vec<String>,
}

/// Finds the essential parameters. It repeatedly excludes the base parameter with the largest
/// relative standard deviation, as long as an F-test at this level does not distinguish the reduced
/// model from the full one. The order is that of Pham & Gautier (*Essential parameters of robots*,
/// IEEE Conf. Decision and Control 1991), the test that of Draper & Smith (*Applied Regression
/// Analysis*, chapter 6).
///
/// Every model is solved by weighted least squares with the weights of the full model. Standard
/// deviations and F are corrected for coloured residuals. The list of parameters in the options is
/// ignored. **This motion** does not need the excluded parameters; another motion may.
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
        let matrix = ObservationMatrix::from_dense(matrix, full.joints())
            .without_joints(full.matrix().left_out_joints().iter().copied());
        let reduced = Observations::from_dense(matrix, full.measurements().clone());
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
        // A parameter is also kept if the probability cannot be computed.
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
