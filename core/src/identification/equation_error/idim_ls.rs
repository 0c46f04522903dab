//! IDIM-LS: the inverse dynamic identification model and least squares (paper, section 3.1).

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::dynamics::{BaseParameters, Model};
use crate::identification::equation_error::weighting::Weighting;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::method::Method;
use crate::identification::given::options::IdimLsOptions;
use crate::identification::given::selection::Selection;
use crate::identification::judgement::assemble::Findings;
use crate::identification::judgement::checks::PositionError;
use crate::identification::judgement::estimate::Identification;
use crate::identification::observation::matrix::{
    BaseColumns, BesideObservation, observation_matrix,
};
use crate::identification::observation::prefilter::{
    Motion, filtered_motion, filtered_torque, row_filter,
};
use crate::regression::{Observations, ResidualAnalysis, RobustLoss, Solution};
use crate::robot::Robot;
use crate::signal::ParallelDecimation;

/// Identifies base parameters by weighted least squares on the filtered inverse dynamic model.
///
/// 1. Positions filtered without phase, differentiated twice (section 3.1.1).
/// 2. Each column of the regressor, and the torque at the instants of the positions, through the
///    parallel filter; every n_d-th counted sample becomes a row of every joint (equations 6 to 8).
/// 3. Ordinary least squares (9) gives each joint's noise level, `σ_j² = ‖ρ_j‖²/(N − b/n)` (12).
/// 4. One weighted pass gives the parameters, their covariance `(XᵀΩ⁻¹X)⁻¹` (10) and the singular
///    values of `Ω^{-1/2} X`.
///
/// The covariance takes the residuals for white. They are not: the parallel filter correlates
/// neighbouring rows (a factor √(1/0.8) with the default cut-off), and a model error more. The
/// standard deviations of the result are corrected for it
/// ([`ResidualAnalysis`](crate::regression::ResidualAnalysis)); the classical ones stand beside.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn idim_ls(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &IdimLsOptions,
) -> Result<Identification, IdentificationError> {
    let decimation = options.decimation(true)?;
    let (fit, beside) =
        EquationErrorFit::with_beside(robot, base, experiment, options, decimation)?;
    let findings = Findings {
        method: Method::IdimLs,
        robot,
        experiment,
        model: &fit.model,
        selection: &fit.selection,
        decimation: &fit.decimation,
        motion: &fit.motion,
        beside: &beside,
        position_error: PositionError::InTheRegressor(options.position_filter),
        observations: fit.weighted.solved(&fit.observations),
        torque: fit.weighted.torque_rows(&fit.observations),
        solution: &fit.weighted.solution,
        downweighted: fit.weighted.downweighted(),
        spoiled: fit.spoiled(experiment, None),
        unweighted: &fit.ordinary,
        iterations: 1,
        simulations: 0,
        convergence: Vec::new(),
        reference: None,
        simulation_errors: None,
        controller_error_per_joint: None,
        limits: &options.limits,
        instrument_correlation: None,
        reasons: Vec::new(),
    };
    findings.assemble()
}

/// Entries of an observation matrix without decimation: 160 MB, and up to twelve times as much while
/// the model is checked, which looks at every column's spectrum.
const MOST_ENTRIES: usize = 20_000_000;

/// What the equation error says before it is judged: the result of IDIM-LS, and where the methods
/// that simulate begin.
pub(crate) struct EquationErrorFit {
    pub(crate) selection: Selection,
    pub(crate) model: Model,
    pub(crate) decimation: ParallelDecimation,
    /// The filtered measured motion.
    pub(crate) motion: Motion,
    pub(crate) observations: Observations,
    pub(crate) ordinary: Solution,
    /// σ_j from the ordinary residuals.
    pub(crate) noise_levels: Vec<f64>,
    pub(crate) weighted: Weighting,
    /// Which rows count less.
    pub(crate) robust: Option<RobustLoss>,
}

impl EquationErrorFit {
    /// The samples that outliers spoil, by the equation error or by another equation's weights.
    pub(crate) fn spoiled(
        &self,
        experiment: &Experiment,
        other: Option<&Weighting>,
    ) -> Vec<Range<usize>> {
        let samples = experiment.fitted_samples(&self.decimation);
        let weightings = [Some(&self.weighted), other].into_iter().flatten();
        let downweighted = weightings.filter_map(Weighting::downweighted);
        downweighted.flat_map(|rows| rows.spoiled(&samples)).collect()
    }

    /// Steps 1 to 4 of [`idim_ls`], with a decimation of the caller's choice.
    pub(crate) fn new(
        robot: &Robot,
        base: &BaseParameters,
        experiment: &Experiment,
        options: &IdimLsOptions,
        decimation: ParallelDecimation,
    ) -> Result<Self, IdentificationError> {
        let along = Along::new(robot, base, experiment, options, decimation)?;
        let Along { model, selection, motion, decimation } = &along;
        let matrix =
            observation_matrix(model, selection, motion, decimation, experiment.counted())?;
        let matrix = experiment.fitted_matrix(decimation, matrix);
        along.solve(matrix, experiment, options)
    }

    /// The same, and what the model is checked with along the measured motion.
    pub(crate) fn with_beside(
        robot: &Robot,
        base: &BaseParameters,
        experiment: &Experiment,
        options: &IdimLsOptions,
        decimation: ParallelDecimation,
    ) -> Result<(Self, BesideObservation), IdentificationError> {
        let along = Along::new(robot, base, experiment, options, decimation)?;
        let Along { model, selection, motion, decimation } = &along;
        let BaseColumns { selected, beside } =
            BaseColumns::new(model, base, selection, motion, decimation, experiment)?;
        Ok((along.solve(selected, experiment, options)?, beside))
    }

    /// Standard deviations of the parameters, corrected for the colour of the residuals.
    pub(crate) fn standard_deviations(&self) -> DVector<f64> {
        let equation = self.weighted.solved(&self.observations);
        let filter = row_filter(&self.decimation, equation.rows_per_joint());
        let analysis = ResidualAnalysis::new(equation, &self.weighted.solution, &filter);
        analysis.covariance().diagonal().map(f64::sqrt)
    }
}

/// The measured motion, and the model that the equation is set up with along it.
struct Along {
    model: Model,
    selection: Selection,
    motion: Motion,
    decimation: ParallelDecimation,
}

impl Along {
    fn new(
        robot: &Robot,
        base: &BaseParameters,
        experiment: &Experiment,
        options: &IdimLsOptions,
        decimation: ParallelDecimation,
    ) -> Result<Self, IdentificationError> {
        if robot.joints() != experiment.joints() {
            return Err(IdentificationError::JointCount {
                robot: robot.name().to_owned(),
                joints: robot.joints(),
                experiment: experiment.joints(),
            });
        }
        options.limits.validate()?;
        let selection = Selection::new(robot, base, options.parameters.as_deref())?;
        let rows = experiment.fitted_samples(&decimation).len() * experiment.joints();
        if rows <= selection.names().len() {
            let parameters = selection.names().len();
            return Err(IdentificationError::TooFewRows { rows, parameters });
        }
        if decimation.is_none() && rows * selection.names().len() > MOST_ENTRIES {
            let parameters = selection.names().len();
            return Err(IdentificationError::TooManyRows { rows, parameters });
        }
        let motion = filtered_motion(experiment, &options.position_filter)?;
        Ok(Self { model: Model::new(robot), selection, motion, decimation })
    }

    /// Steps 3 and 4 of [`idim_ls`], with the observation matrix of this motion.
    fn solve(
        self,
        matrix: DMatrix<f64>,
        experiment: &Experiment,
        options: &IdimLsOptions,
    ) -> Result<EquationErrorFit, IdentificationError> {
        let Self { model, selection, motion, decimation } = self;
        let torque = filtered_torque(experiment, &decimation)?;
        let named = |error| IdentificationError::from_regression(error, &selection);
        let observations = Observations::new(matrix, torque, experiment.joints()).map_err(named)?;
        let ordinary = observations.ordinary().map_err(named)?;
        let noise_levels = match options.robust {
            None => observations.noise_levels(&ordinary.residuals),
            Some(loss) => observations.robust_noise_levels(loss).map_err(named)?,
        };
        let weighted = Weighting::new(&observations, &noise_levels, options.robust);
        let weighted = weighted.map_err(named)?;
        Ok(EquationErrorFit {
            selection,
            model,
            decimation,
            motion,
            observations,
            ordinary,
            noise_levels,
            weighted,
            robust: options.robust,
        })
    }
}
