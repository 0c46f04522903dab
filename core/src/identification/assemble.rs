//! From a solved regression to the record that leaves the library.

use nalgebra::DVector;

use super::estimate::{
    Estimate, Fit, Identification, ParameterEstimate, SCHEMA, SingularValues, Verdict,
};
use super::experiment::Experiment;
use super::method::Method;
use super::selection::Selection;
use super::verdict::VerdictLimits;
use crate::regression::{Observations, Solution};
use crate::robot::Robot;

/// What a method hands in.
pub(super) struct Findings<'a> {
    pub(super) method: Method,
    pub(super) robot: &'a Robot,
    pub(super) experiment: &'a Experiment,
    pub(super) selection: &'a Selection,
    pub(super) observations: &'a Observations,
    /// Time of each row of one joint \[s\].
    pub(super) row_times_s: Vec<f64>,
    /// The weighted solution, whose parameters are the result.
    pub(super) solution: &'a Solution,
    /// Condition number of the observation matrix without weights.
    pub(super) unweighted_condition_number: f64,
    pub(super) iterations: u32,
    pub(super) simulations: u32,
    pub(super) limits: &'a VerdictLimits,
}

impl Findings<'_> {
    /// The estimate with its verdict, and the fit.
    pub(super) fn assemble(self) -> Identification {
        let Self { selection, observations, solution, .. } = self;
        let deviations = solution.standard_deviations();
        let values = solution.parameters.iter().zip(deviations.iter());
        let parameters = selection.names().iter().zip(values).map(|(name, (&value, &sigma))| {
            ParameterEstimate {
                name: name.clone(),
                value,
                standard_deviation: sigma,
                relative_standard_deviation: sigma / value.abs(),
            }
        });
        let (max, min) = solution.extreme_singular_values();
        let statistics = observations.residual_statistics(&solution.residuals);
        let mut estimate = Estimate {
            schema: SCHEMA,
            method: self.method.name().to_owned(),
            robot: self.robot.name().to_owned(),
            samples: self.experiment.samples(),
            rows: observations.matrix().nrows(),
            parameters: parameters.collect(),
            condition_number: solution.condition_number(),
            singular_values: SingularValues { max, min },
            unweighted_condition_number: self.unweighted_condition_number,
            relative_error: statistics.relative_error,
            relative_error_per_joint: statistics.relative_error_per_joint,
            rms_error_per_joint_nm: statistics.rms_per_joint,
            durbin_watson_per_joint: statistics.durbin_watson_per_joint,
            iterations: self.iterations,
            simulations: self.simulations,
            convergence: Vec::new(),
            reference: None,
            verdict: Verdict::default(),
        };
        estimate.verdict = self.limits.judge(&estimate, selection.kinds());
        let measured = observations.measurements();
        let fit = Fit {
            time_s: self.row_times_s,
            measured: per_joint(observations, measured),
            predicted: per_joint(observations, &(measured - &solution.residuals)),
        };
        Identification { estimate, fit }
    }
}

fn per_joint(observations: &Observations, rows: &DVector<f64>) -> Vec<Vec<f64>> {
    rows.as_slice().chunks(observations.rows_per_joint()).map(<[f64]>::to_vec).collect()
}
