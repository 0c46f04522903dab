//! From a solved regression to the record that leaves the library.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Model;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::method::Method;
use crate::identification::given::selection::Selection;
use crate::identification::judgement::checks::{
    Checks, PositionError, Subject, indefinite_posture,
};
use crate::identification::judgement::estimate::{
    ConvergenceStep, Estimate, Fit, Identification, ParameterEstimate, ReferenceSource, SCHEMA,
    SingularValues, Verdict,
};
use crate::identification::judgement::information::Information;
use crate::identification::judgement::outliers::DownweightedRows;
use crate::identification::judgement::simulation_error::SimulationErrors;
use crate::identification::judgement::verdict::VerdictLimits;
use crate::identification::observation::matrix::BesideObservation;
use crate::identification::observation::prefilter::{Motion, row_filter};
use crate::regression::{LjungBox, Observations, ResidualAnalysis, Solution};
use crate::robot::Robot;
use crate::signal::ParallelDecimation;

/// Lags of the residuals' autocorrelation that are worth looking at.
const LAGS: usize = 30;

/// The torques along the motion, where the equation that was solved is another one.
pub(crate) struct TorqueRows<'a> {
    /// Regressor and measured torques of the same rows.
    pub(crate) observations: &'a Observations,
    /// What the estimate leaves of the measured torques.
    pub(crate) residuals: &'a DVector<f64>,
    /// Their own weighted solution, where the solved equation is not one of torques: there the model
    /// is checked.
    pub(crate) own: Option<&'a Solution>,
}

/// What a method hands in.
pub(crate) struct Findings<'a> {
    pub(crate) method: Method,
    pub(crate) robot: &'a Robot,
    pub(crate) experiment: &'a Experiment,
    pub(crate) model: &'a Model,
    pub(crate) selection: &'a Selection,
    pub(crate) decimation: &'a ParallelDecimation,
    /// The motion that the observation matrix was built on.
    pub(crate) motion: &'a Motion,
    /// What there is of it beside the observation matrix.
    pub(crate) beside: &'a BesideObservation,
    /// Where the noise of the positions may do harm.
    pub(crate) position_error: PositionError,
    /// The equation that was solved.
    pub(crate) observations: &'a Observations,
    /// None where it is that of the torques and their regressor.
    pub(crate) torque: Option<TorqueRows<'a>>,
    /// The weighted solution, whose parameters are the result.
    pub(crate) solution: &'a Solution,
    /// Rows that an M-estimate weights down, where it is one.
    pub(crate) downweighted: Option<&'a DownweightedRows>,
    /// Samples that outliers spoil.
    pub(crate) spoiled: Vec<Range<usize>>,
    /// The solution of the same equation without weights.
    pub(crate) unweighted: &'a Solution,
    pub(crate) iterations: u32,
    pub(crate) simulations: u32,
    /// The way there, where there was one.
    pub(crate) convergence: Vec<ConvergenceStep>,
    /// What the simulated loops followed.
    pub(crate) reference: Option<ReferenceSource>,
    /// How far the last simulated loop is from the measurements, where there was one.
    pub(crate) simulation_errors: Option<SimulationErrors>,
    /// How far the described controller is from the recorded one, where that can be told.
    pub(crate) controller_error_per_joint: Option<Vec<f64>>,
    pub(crate) limits: &'a VerdictLimits,
    /// Smallest canonical correlation of instruments, where there are any.
    pub(crate) instrument_correlation: Option<f64>,
    /// What the method itself holds against the use of its result.
    pub(crate) reasons: Vec<String>,
}

impl Findings<'_> {
    /// The estimate with its verdict, and the fit.
    pub(crate) fn assemble(self) -> Result<Identification, IdentificationError> {
        let Self { selection, observations, solution, decimation, .. } = self;
        let rows = observations.rows_per_joint();
        let filter = row_filter(decimation, rows);
        let analysis = ResidualAnalysis::new(observations, solution, &filter);
        let covariance = analysis.covariance();
        let deviations = covariance.diagonal().map(f64::sqrt);
        let standard = self.standard(solution);
        let torque = self.torque.as_ref().map_or(observations, |rows| rows.observations);
        let residuals = self.torque.as_ref().map_or(&solution.residuals, |rows| rows.residuals);
        let mut other = None;
        let checks = match self.torque.as_ref().and_then(|rows| rows.own) {
            None => self.check(torque, &analysis, &standard, &deviations)?,
            Some(own) => {
                let analysis = ResidualAnalysis::new(torque, own, &filter);
                let own_deviations = analysis.covariance().diagonal().map(f64::sqrt);
                other = self.limits.other_parameters(
                    selection.names(),
                    &(&own.parameters - &solution.parameters),
                    &own_deviations.zip_map(&deviations, f64::hypot),
                );
                self.check(torque, &analysis, &self.standard(own), &own_deviations)?
            }
        };

        let statistics = torque.residual_statistics(residuals);
        let ljung_box = analysis.spectrum().ljung_box_per_joint();
        let own_statistics = observations.residual_statistics(&solution.residuals);
        let (position_errors, torque_errors) = match self.simulation_errors {
            Some(errors) => (Some(errors.position_per_joint), errors.torque_per_joint),
            None => (None, None),
        };
        let mut estimate = Estimate {
            schema: SCHEMA,
            method: self.method.name().to_owned(),
            robot: self.robot.name().to_owned(),
            samples: self.experiment.samples(),
            rows: observations.matrix().nrows(),
            parameters: ParameterEstimate::of(selection, solution, &deviations),
            condition_number: solution.condition_number(),
            singular_values: SingularValues::of(solution),
            unweighted_condition_number: self.unweighted.condition_number(),
            unweighted_singular_values: SingularValues::of(self.unweighted),
            relative_error: statistics.relative_error,
            relative_error_per_joint: statistics.relative_error_per_joint,
            rms_error_per_joint_nm: statistics.rms_per_joint,
            relative_prediction_deviation_per_joint: prediction_deviations(torque, &covariance),
            durbin_watson_per_joint: own_statistics.durbin_watson_per_joint,
            durbin_watson_expected: filter.durbin_watson_of_white_noise(),
            whiteness_per_joint: ljung_box.iter().map(LjungBox::probability).collect(),
            ljung_box_per_joint: ljung_box,
            effective_rows_per_joint: analysis.spectrum().effective_rows_per_joint(),
            torque_delay_per_joint: checks.torque_delay_per_joint,
            model_checks: checks.model_checks,
            iterations: self.iterations,
            simulations: self.simulations,
            convergence: self.convergence,
            reference: self.reference,
            downweighted_rows_per_joint: self
                .downweighted
                .map(|rows| rows.per_joint().iter().map(Vec::len).collect()),
            relative_position_error_per_joint: position_errors,
            simulated_torque_error_per_joint: torque_errors,
            controller_error_per_joint: self.controller_error_per_joint,
            smallest_instrument_correlation: self.instrument_correlation,
            verdict: Verdict::default(),
        };
        let indefinite = indefinite_posture(self.robot, self.model, &standard);
        estimate.verdict =
            self.limits.judge(&estimate, selection.kinds(), indefinite.as_deref(), decimation);
        let samples = self.experiment.fitted_samples(decimation);
        let rate_hz = self.experiment.sample_rate_hz();
        let time_s: Vec<f64> = samples.iter().map(|&k| k as f64 / rate_hz).collect();
        estimate.verdict.notes.extend(checks.notes);
        let downweighted = self.downweighted.iter().flat_map(|rows| rows.notes(&time_s));
        estimate.verdict.notes.extend(downweighted);
        let reasons = other.into_iter().chain(self.reasons);
        estimate.verdict.reasons.extend(reasons);
        estimate.verdict.applicable = estimate.verdict.reasons.is_empty();
        let measured = torque.measurements();
        let information = Information::new(
            observations,
            &analysis,
            &solution.noise_levels,
            self.motion,
            &samples,
            rate_hz,
        );
        let fit = Fit {
            information,
            time_s,
            downweighted: self.downweighted.map_or_else(Vec::new, |rows| rows.per_joint().to_vec()),
            measured: per_joint(torque, measured),
            predicted: per_joint(torque, &(measured - residuals)),
            equation_residuals: per_joint(observations, &solution.residuals),
            white_noise: filter.autocorrelation_of_white_noise(rows, LAGS),
        };
        Ok(Identification { estimate, fit })
    }

    /// Standard parameters with those of a solution, 0 for those that are not identified.
    fn standard(&self, solution: &Solution) -> Vec<f64> {
        let mut standard = vec![0.0; self.model.parameter_names().len()];
        for (&column, &value) in self.selection.columns().iter().zip(solution.parameters.iter()) {
            standard[column] = value;
        }
        standard
    }

    /// Checks the model on an equation of torques, its analysis and what follows from it.
    fn check(
        &self,
        torque: &Observations,
        analysis: &ResidualAnalysis<'_>,
        standard: &[f64],
        deviations: &DVector<f64>,
    ) -> Result<Checks, IdentificationError> {
        let subject = Subject {
            robot: self.robot,
            model: self.model,
            selection: self.selection,
            experiment: self.experiment,
            decimation: self.decimation,
            motion: self.motion,
            beside: self.beside,
            position_error: &self.position_error,
            spoiled: &self.spoiled,
            observations: torque,
            analysis,
            standard,
            deviations,
        };
        subject.check()
    }
}

/// `√(tr(X_j Σ X_jᵀ)) / ‖y_j‖` of every joint.
fn prediction_deviations(observations: &Observations, covariance: &DMatrix<f64>) -> Vec<f64> {
    let (x, y) = (observations.matrix(), observations.measurements());
    let deviation = |joint: usize| {
        let range = observations.joint_rows(joint);
        let x = x.rows_range(range.clone());
        (x * covariance).dot(&x).max(0.0).sqrt() / y.rows_range(range).norm()
    };
    (0..observations.joints()).map(deviation).collect()
}

fn per_joint(observations: &Observations, rows: &DVector<f64>) -> Vec<Vec<f64>> {
    rows.as_slice().chunks(observations.rows_per_joint()).map(<[f64]>::to_vec).collect()
}
