//! Equation-error fit without a verdict: it is the result of IDIM-LS and the start of the methods
//! that simulate.

use core::ops::Range;

use nalgebra::DVector;

use super::weighting::Weighting;
use crate::identification::judgement::SingularValues;
use crate::identification::observation::{
    AuxiliaryObservation, BaseColumns, Motion, filtered_motion, filtered_torque, fitted_matrix,
    torque_equation,
};
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis};

/// Equation of the measured motion, and its solution.
pub(crate) struct EquationErrorFit {
    /// Filtered measured motion.
    pub(crate) motion: Motion,
    pub(crate) observations: Observations,
    /// Singular values of the observation matrix without weights.
    pub(crate) unweighted_singular_values: SingularValues,
    /// Noise levels σ_j from the ordinary residuals.
    pub(crate) noise_levels: Vec<f64>,
    pub(crate) weighting: Weighting,
}

impl EquationErrorFit {
    /// Performs steps 1 to 4 of [`idim_ls`](super::idim_ls).
    pub(crate) fn new(context: &Context<'_>) -> Result<Self, IdentificationError> {
        let motion = measured_motion(context)?;
        let matrix = fitted_matrix(context, &motion)?;
        Self::solve_equation(context, motion, matrix)
    }

    /// Performs the same steps, and also returns the columns for checking the model along the
    /// measured motion.
    pub(crate) fn with_auxiliary(
        context: &Context<'_>,
    ) -> Result<(Self, AuxiliaryObservation), IdentificationError> {
        let motion = measured_motion(context)?;
        let BaseColumns { selected, auxiliary } = BaseColumns::new(context, &motion)?;
        Ok((Self::solve_equation(context, motion, selected)?, auxiliary))
    }

    /// Performs steps 3 and 4 with the observation matrix of this motion.
    fn solve_equation(
        context: &Context<'_>,
        motion: Motion,
        matrix: ObservationMatrix,
    ) -> Result<Self, IdentificationError> {
        let torque = filtered_torque(context)?;
        let named = |error| context.selection.regression_failure(error);
        let observations = torque_equation(context, matrix, torque, &motion)?;
        let ordinary = observations.solve_ordinary().map_err(named)?;
        let robust = context.options.robust;
        let noise_levels = match robust {
            None => observations.noise_levels(&ordinary.residuals),
            Some(loss) => observations.robust_noise_levels(loss).map_err(named)?,
        };
        let unweighted = SingularValues::new(&ordinary);
        drop(ordinary);
        let weighted = Weighting::new(&observations, &noise_levels, robust).map_err(named)?;
        Ok(Self {
            motion,
            observations,
            unweighted_singular_values: unweighted,
            noise_levels,
            weighting: weighted,
        })
    }

    /// Returns the samples that outliers affect, according to the weights of this fit or of another
    /// equation.
    pub(crate) fn outlier_samples(
        &self,
        context: &Context<'_>,
        other: Option<&Weighting>,
    ) -> Vec<Range<usize>> {
        let weightings = [Some(&self.weighting), other].into_iter().flatten();
        let downweighted = weightings.filter_map(Weighting::downweighted_rows);
        downweighted.flat_map(|rows| rows.outlier_samples(&context.samples)).collect()
    }

    /// Returns the standard deviations of the parameters, corrected for the colour of the
    /// residuals.
    pub(crate) fn standard_deviations(&self, context: &Context<'_>) -> DVector<f64> {
        let equation = self.weighting.solved_equation(&self.observations);
        let filter = context.row_filter();
        let analysis = ResidualAnalysis::new(equation, &self.weighting.solution, &filter);
        analysis.covariance().diagonal().map(f64::sqrt)
    }
}

fn measured_motion(context: &Context<'_>) -> Result<Motion, IdentificationError> {
    filtered_motion(context.robot, context.experiment, &context.options.position_filter)
}
