//! From a solved equation to the record that leaves the library.

use core::ops::Range;
use didim_dynamics::dynamics::{BaseParameters, Model};

use nalgebra::{DMatrix, DVector, DVectorView};

use super::alternatives::FoundAlternatives;
use super::checks::{Checks, FittedModel, PositionError};
use super::estimate::{
    ConvergenceStep, Estimate, Fit, FitMotion, Identification, KeptParameter, ParameterEstimate,
    ReferenceSource, SCHEMA, SingularValues,
};
use super::folds::Folds;
use super::held_out::HeldOut;
use super::information::Information;
use super::outliers::DownweightedRows;
use super::parameter_covariance::ParameterCovariance;
use super::physical_consistency::PhysicalConsistency;
use super::reached::ReachedRange;
use super::reasons::{Note, Reason};
use super::signal_findings::SignalFindings;
use super::uncertainty::{Supplements, Uncertainty};
use super::unsigned_torque::unsigned_torques;
use super::uses::Verdict;
use super::verdict::Known;
use super::workspace::{Indefinite, indefinite_posture};
use crate::feasibility::{FixedParameter, Outcome};
use crate::identification::observation::{AuxiliaryObservation, Motion, torque_rates};
use crate::identification::problem::{Context, IdentificationError, Method};
use crate::regression::{LjungBox, Observations, ResidualAnalysis, RowFilter, Solution};

/// Lags of the residuals' autocorrelation that are worth looking at.
const LAGS: usize = 30;

/// The torques along the motion, where the equation that was solved is another one.
pub(crate) struct TorqueRows<'a> {
    /// Regressor and measured torques of the same rows.
    pub(crate) observations: &'a Observations,
    /// What the estimate leaves of the measured torques.
    pub(crate) residuals: &'a DVector<f64>,
    /// Their own weighted solution, where the solved equation is not one of torques: there the
    /// model is checked.
    pub(crate) own: Option<&'a Solution>,
}

/// What a method hands in, beside its context.
pub(crate) struct Findings<'a> {
    pub(crate) method: Method,
    /// The motion that the observation matrix was built on.
    pub(crate) motion: &'a Motion,
    /// What there is of it beside the observation matrix.
    pub(crate) auxiliary_columns: &'a AuxiliaryObservation,
    /// Where the noise of the positions may do harm.
    pub(crate) position_error: PositionError,
    /// The equation that was solved.
    pub(crate) observations: &'a Observations,
    /// None where it is that of the torques and their regressor.
    pub(crate) torque: Option<TorqueRows<'a>>,
    /// The weighted solution, whose parameters are the result.
    pub(crate) solution: &'a Solution,
    /// Of the same equation without weights.
    pub(crate) unweighted: SingularValues,
    /// Rows that an M-estimate weights down, where it is one.
    pub(crate) downweighted: Option<&'a DownweightedRows>,
    /// Samples that outliers reach.
    pub(crate) outliers: Vec<Range<usize>>,
    /// The way to the solution.
    pub(crate) iteration: Iteration,
}

/// The way to a solution.
#[derive(Default)]
pub(crate) struct Iteration {
    pub(crate) linear_steps: u32,
    /// Simulations of the closed loop, those that failed included.
    pub(crate) simulations: u32,
    pub(crate) steps: Vec<ConvergenceStep>,
    /// What the simulated loops followed.
    pub(crate) reference: Option<ReferenceSource>,
    /// The smallest bandwidth of the simulated loops \[Hz\], where it had to be less than stated.
    pub(crate) slower_bandwidth_hz: Option<f64>,
    /// ‖q − q_s‖ / ‖q‖ of the last simulation.
    pub(crate) position_error_per_joint: Option<Vec<f64>>,
    /// ‖τ − τ_s‖ / ‖τ‖ of the last simulation, where the torques can be compared.
    pub(crate) torque_error_per_joint: Option<Vec<f64>>,
    /// Smallest canonical correlation of instruments, where there are any.
    pub(crate) instrument_correlation: Option<f64>,
}

/// The residuals of a solved equation, and what follows from them alone.
struct Analysed<'a> {
    /// Analysis of the solved equation, in which repeated motion counts once.
    analysis: ResidualAnalysis<'a>,
    /// The motion in folds.
    folds: Folds,
    /// Covariance of the parameters.
    covariance: DMatrix<f64>,
    /// The same, in which repeated motion counts once, because model errors repeat with it.
    distinct_covariance: DMatrix<f64>,
    /// Standard deviation of each parameter.
    deviations: DVector<f64>,
    /// The equation of torques.
    torque: &'a Observations,
    /// What the estimate leaves of the measured torques.
    residuals: &'a DVector<f64>,
}

/// The checks of the model, the uncertainty, and parameters of torques that differ from those of
/// the method.
struct Checked {
    checks: Checks,
    uncertainty: Uncertainty,
    other: Option<Reason>,
}

impl<'a> Findings<'a> {
    /// The estimate with its verdict, and the fit.
    pub(crate) fn judged(
        self,
        context: &Context<'_>,
    ) -> Result<Identification, IdentificationError> {
        let limits = &context.options.limits;
        let filter = context.row_filter();
        let analysed = self.analysed(context, &filter);
        let (held_out, disagreement) = self.held_out(context, &analysed)?;
        let rows = self.observations.matrix().equation_rows();
        let unsigned = unsigned_torques(context);
        // Without signs, no reading is right.
        let alternatives = match unsigned.is_empty() && limits.are_rows_enough(context, rows) {
            true => FoundAlternatives::find(context),
            false => FoundAlternatives::default(),
        };
        let beside = Supplements {
            alternative: alternatives.parameter_change.as_ref(),
            fold_deviations: disagreement.as_ref(),
            other: None,
        };
        let Checked { checks, uncertainty, other } =
            self.checked(context, &analysed, &filter, beside)?;
        let torque = uncertainty.rms_torque.clone();
        let mut estimate =
            self.estimate(context, &analysed, &filter, &checks, uncertainty, held_out);
        let bodies = self.nearest_bodies(context, &analysed, &estimate);
        estimate.link_bodies =
            bodies.as_ref().map(|of| PhysicalConsistency::new(of, estimate.parameters.len()));
        let signals = SignalFindings::new(context, unsigned, &estimate.relative_error_per_joint);
        let misread = alternatives.alternatives.into_iter();
        let misread = misread.map(|(found, evidence)| {
            let evidence = Some(evidence);
            Reason::Alternative { found, evidence, setting: None }
        });
        let known = Known {
            context,
            torque,
            largest_torque: largest_torques(context),
            carried: carried(analysed.torque, &self.solution.parameters),
            indefinite: self.indefinite(context, &analysed)?,
            bodies,
            blocking: signals.blocking.into_iter().chain(other).collect(),
            explanations: signals
                .frozen
                .into_iter()
                .chain(misread)
                .chain(signals.clipped)
                .collect(),
        };
        let (uses, explanations) = limits.uses(&known, &estimate);
        let fit = self.fit(context, &analysed, &filter);
        let mut notes = limits.notes(&known, &estimate);
        notes.extend(incomplete_torque(context));
        notes.extend(checks.notes);
        notes.extend(signals.notes);
        notes.extend(self.downweighted.iter().flat_map(|rows| rows.notes(&fit.time_s)));
        estimate.verdict = Verdict::new(uses, &context.options.required_uses, notes, explanations);
        Ok(Identification { estimate, fit })
    }

    fn analysed(&self, context: &Context<'_>, filter: &'a RowFilter) -> Analysed<'a> {
        let analysis = ResidualAnalysis::new(self.observations, self.solution, filter);
        let covariance = analysis.covariance();
        let folds = Folds::from_context(context, self.motion);
        let analysis = analysis.counting_once(folds.mean_repeats);
        let distinct_covariance = match folds.mean_repeats > 1.0 {
            true => analysis.covariance(),
            false => covariance.clone(),
        };
        let deviations = covariance.diagonal().map(f64::sqrt);
        let (torque, residuals) = match &self.torque {
            Some(rows) => (rows.observations, rows.residuals),
            None => (self.observations, &self.solution.residuals),
        };
        Analysed { analysis, folds, covariance, distinct_covariance, deviations, torque, residuals }
    }

    /// The error on folds that are held out, and how much the parameters differ between them.
    fn held_out(
        &self,
        context: &Context<'_>,
        analysed: &Analysed<'_>,
    ) -> Result<(HeldOut, Option<DVector<f64>>), IdentificationError> {
        let (counted, residuals) = match self.downweighted {
            Some(_) => (self.observations, &self.solution.residuals),
            None => (analysed.torque, analysed.residuals),
        };
        let parameters = &self.solution.parameters;
        HeldOut::new(context, self.motion, &analysed.folds, counted, parameters, residuals)
    }

    /// Checks the model on the equation of torques: the solved one, or the own one of a method that
    /// solves another.
    fn checked(
        &self,
        context: &Context<'_>,
        analysed: &Analysed<'_>,
        filter: &RowFilter,
        beside: Supplements<'_>,
    ) -> Result<Checked, IdentificationError> {
        let Analysed { torque, analysis, deviations, .. } = analysed;
        let parameters = &self.solution.parameters;
        let Some(own) = self.torque.as_ref().and_then(|rows| rows.own) else {
            let (checks, uncertainty) =
                self.checks(context, torque, analysis, parameters, deviations, beside)?;
            return Ok(Checked { checks, uncertainty, other: None });
        };
        let analysis = ResidualAnalysis::new(torque, own, filter);
        let own_deviations = analysis.covariance().diagonal().map(f64::sqrt);
        let analysis = analysis.counting_once(analysed.folds.mean_repeats);
        let difference = &own.parameters - parameters;
        let other = match self.method.fits_positions() {
            true => context.options.limits.other_parameters(
                context.selection.names(),
                &difference,
                &own_deviations.zip_map(deviations, f64::hypot),
            ),
            false => None,
        };
        let beside = Supplements { other: Some(&difference), ..beside };
        let (checks, uncertainty) =
            self.checks(context, torque, &analysis, &own.parameters, &own_deviations, beside)?;
        Ok(Checked { checks, uncertainty, other })
    }

    /// The estimate, without its bodies and its verdict.
    fn estimate(
        &self,
        context: &Context<'_>,
        analysed: &Analysed<'_>,
        filter: &RowFilter,
        checks: &Checks,
        uncertainty: Uncertainty,
        held_out: HeldOut,
    ) -> Estimate {
        let Self { observations, solution, iteration, .. } = self;
        let Analysed { analysis, torque, residuals, .. } = analysed;
        let statistics = torque.residual_statistics(residuals);
        let mut ljung_box = analysis.spectrum().ljung_box_per_joint();
        for joint in context.model.missing_torques() {
            ljung_box[*joint] = LjungBox { statistic: f64::NAN, lag_count: 0 };
        }
        let whiteness = ljung_box.iter().map(LjungBox::probability).collect();
        let own_statistics = observations.residual_statistics(&solution.residuals);
        let downweighted = self.downweighted.map(DownweightedRows::per_joint);
        let differences = checks.controller_error_per_joint.as_ref();
        let (sizes, probabilities) = differences
            .map(|found| found.iter().map(|of| (of.size, of.probability)).unzip())
            .unzip();
        Estimate {
            schema: SCHEMA,
            method: self.method.name().to_owned(),
            robot: context.robot.name().to_owned(),
            samples: context.experiment.samples(),
            rows: observations.matrix().equation_rows(),
            reached_per_joint: ReachedRange::from_context(context, self.motion),
            position_cutoff: None,
            friction: None,
            friction_laws: context.robot.own_friction().to_vec(),
            parameters: ParameterEstimate::list(
                context.robot,
                &context.selection,
                solution,
                &analysed.deviations,
                &uncertainty.combined_deviations,
            ),
            nominal: KeptParameter::list(context.robot, context.base, &context.selection),
            covariance: Some(ParameterCovariance::from_symmetric(&analysed.covariance)),
            condition_number: solution.condition_number(),
            singular_values: SingularValues::new(solution),
            unweighted_condition_number: self.unweighted.condition_number(),
            unweighted_singular_values: self.unweighted,
            relative_error: statistics.relative_error,
            relative_error_per_joint: statistics.relative_error_per_joint,
            relative_error_per_recording: per_recording(context, torque, residuals),
            rms_error_per_joint_nm: statistics.rms_per_joint,
            relative_prediction_deviation_per_joint: prediction_deviations(
                torque,
                &analysed.distinct_covariance,
            ),
            durbin_watson_per_joint: own_statistics.durbin_watson_per_joint,
            durbin_watson_expected: filter.durbin_watson_of_white_noise(),
            whiteness_per_joint: observations.figures_per_joint(whiteness),
            ljung_box_per_joint: ljung_box,
            effective_rows_per_joint: observations
                .figures_per_joint(analysis.spectrum().effective_rows_per_joint()),
            torque_delay_per_joint: checks.torque_delay_per_joint.clone(),
            position_bias: checks.position_bias.clone(),
            nuisance_parameters: uncertainty.nuisance_parameters,
            extrapolation: uncertainty.extrapolation,
            model_uncertainty: uncertainty.model,
            held_out,
            iterations: iteration.linear_steps,
            simulations: iteration.simulations,
            convergence: iteration.steps.clone(),
            reference: iteration.reference,
            slower_bandwidth_hz: iteration.slower_bandwidth_hz,
            downweighted_rows_per_joint: downweighted
                .map(|rows| rows.iter().map(Vec::len).collect()),
            relative_position_error_per_joint: iteration.position_error_per_joint.clone(),
            simulated_torque_error_per_joint: iteration.torque_error_per_joint.clone(),
            controller_error_per_joint: sizes,
            controller_probability_per_joint: probabilities,
            smallest_instrument_correlation: iteration.instrument_correlation,
            link_bodies: None,
            verdict: Verdict::default(),
        }
    }

    /// The bodies nearest to the estimate, if the robot file has nominal ones.
    fn nearest_bodies(
        &self,
        context: &Context<'_>,
        analysed: &Analysed<'_>,
        estimate: &Estimate,
    ) -> Option<Outcome> {
        let nominal = estimate.nominal.iter();
        let fixed: Vec<FixedParameter> =
            nominal.map(|kept| FixedParameter::at_nominal(kept.name.clone(), kept.value)).collect();
        PhysicalConsistency::nearest_bodies(
            context,
            self.solution.parameters.as_slice(),
            &analysed.covariance,
            &fixed,
        )
    }

    /// The posture where the mass matrix is furthest from positive definite, if there is one.
    fn indefinite(
        &self,
        context: &Context<'_>,
        analysed: &Analysed<'_>,
    ) -> Result<Option<Indefinite>, IdentificationError> {
        // Without a torque, the inertia of a joint is not known.
        if !context.model.missing_torques().is_empty() {
            return Ok(None);
        }
        indefinite_posture(
            context.robot,
            &context.model,
            &context.selection,
            &self.solution.parameters,
            &analysed.distinct_covariance,
        )
    }

    fn fit(&self, context: &Context<'_>, analysed: &Analysed<'_>, filter: &RowFilter) -> Fit {
        let Self { observations, solution, .. } = self;
        let Analysed { analysis, torque, residuals, .. } = analysed;
        let time_s = context.time_s();
        let measured = torque.measured_values();
        let downweighted = self.downweighted.map(DownweightedRows::per_joint);
        Fit {
            motion: FitMotion::new(self.motion, &context.samples, &time_s),
            information: Information::new(
                observations,
                analysis,
                &solution.noise_levels,
                self.motion,
                &context.samples,
                context.experiment.sample_rate_hz(),
            ),
            time_s,
            downweighted: downweighted.map_or_else(Vec::new, <[_]>::to_vec),
            measured: torque.per_joint(&measured),
            predicted: torque.per_joint(&(&*measured - *residuals)),
            equation_residuals: observations.per_joint(&solution.residuals),
            white_noise: filter.autocorrelation_of_white_noise(observations.rows_per_joint(), LAGS),
        }
    }

    /// Checks the model on an equation of torques and its solution.
    fn checks(
        &self,
        context: &Context<'_>,
        torque: &Observations,
        analysis: &ResidualAnalysis<'_>,
        parameters: &DVector<f64>,
        deviations: &DVector<f64>,
        beside: Supplements<'_>,
    ) -> Result<(Checks, Uncertainty), IdentificationError> {
        let torque_rates = &torque_rates(context, self.motion, parameters)?;
        let fitted = FittedModel {
            context,
            method: self.method,
            motion: self.motion,
            auxiliary_columns: self.auxiliary_columns,
            position_error: &self.position_error,
            outliers: &self.outliers,
            observations: torque,
            analysis,
            parameters,
            deviations,
            torque_rates,
        };
        let checks = fitted.check()?;
        let uncertainty = Uncertainty::new(&fitted, checks.bias.as_ref(), beside)?;
        Ok((checks, uncertainty))
    }
}

/// Returns the note on recorded torques that lack joints or terms, with the base parameters that
/// complete torques would identify.
fn incomplete_torque(context: &Context<'_>) -> Option<Note> {
    let recorded = context.robot.recorded_torque();
    if recorded.is_complete() {
        return None;
    }
    let complete = Model::new(&context.robot.clone().with_complete_torque());
    // A model whose base parameters are not found has been refused before.
    let complete = BaseParameters::compute(&complete).ok();
    let columns = complete.iter().flat_map(|base| base.columns());
    let lost = columns.filter(|column| context.base.columns().binary_search(column).is_err());
    let names = context.robot.parameters().names();
    Some(Note::IncompleteTorque {
        joints: recorded.missing_joints().to_vec(),
        terms: recorded.excluded_terms().to_vec(),
        parameters: lost.map(|column| names[*column].clone()).collect(),
    })
}

/// `√(tr(X_j Σ X_jᵀ)) / ‖y_j‖` of every joint.
fn prediction_deviations(observations: &Observations, covariance: &DMatrix<f64>) -> Vec<f64> {
    let (x, y) = (observations.matrix(), observations.measured_values());
    let deviation = |joint: usize| {
        let acting = x.columns_of(joint);
        let own = covariance.select_rows(&acting).select_columns(&acting);
        let torque = y.rows_range(observations.joint_rows(joint)).norm();
        x.gram_matrix(joint).dot(&own).max(0.0).sqrt() / torque
    };
    observations.figures_per_joint((0..observations.joints()).map(deviation).collect())
}

/// ‖y − Xθ‖ / ‖y‖ of each recording, where there are several.
fn per_recording(
    context: &Context<'_>,
    observations: &Observations,
    residuals: &DVector<f64>,
) -> Vec<f64> {
    let recordings = context.experiment.recordings().len();
    if recordings < 2 {
        return Vec::new();
    }
    let mut sums = vec![[0.0; 2]; recordings];
    let measured = observations.measured_values();
    for joint in 0..observations.joints() {
        for (row, &sample) in observations.joint_rows(joint).zip(&context.samples) {
            let [errors, torques] = &mut sums[context.experiment.recording_of(sample)];
            *errors += residuals[row].powi(2);
            *torques += measured[row].powi(2);
        }
    }
    sums.into_iter().map(|[errors, torques]| (errors / torques).sqrt()).collect()
}

/// The largest torque that was recorded on each joint \[N·m or N\].
fn largest_torques(context: &Context<'_>) -> Vec<f64> {
    let torque = context.experiment.torque_nm().column_iter();
    let largest = |torque: DVectorView<'_, f64>| {
        let samples = context.experiment.counted_samples();
        samples.map(|sample| torque[sample].abs()).fold(0.0, f64::max)
    };
    torque.map(largest).collect()
}

/// The share of a joint's torque that each parameter carries, the largest of all joints.
fn carried(observations: &Observations, parameters: &DVector<f64>) -> Vec<f64> {
    let torque = observations.measured_values();
    let share = |(column, value): (usize, &f64)| {
        let of_joint = |joint: usize| {
            let own = observations.matrix().column_of(joint, column).unwrap_or_default();
            let own = DVectorView::from_slice(own, own.len()).norm();
            own * value.abs() / torque.rows_range(observations.joint_rows(joint)).norm()
        };
        (0..observations.joints()).map(of_joint).fold(0.0, f64::max)
    };
    parameters.iter().enumerate().map(share).collect()
}
