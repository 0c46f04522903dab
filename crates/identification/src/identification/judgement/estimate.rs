//! Result of an identification.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bias::PositionBias;
use super::chosen_cutoff::ChosenCutoff;
use super::chosen_friction::ChosenFriction;
use super::extrapolation::Extrapolation;
use super::held_out::HeldOut;
use super::information::Information;
use super::model_uncertainty::ModelUncertainty;
use super::nuisance_parameters::{NuisanceEstimate, known_nuisance_parameters};
use super::parameter_covariance::ParameterCovariance;
use super::physical_consistency::PhysicalConsistency;
use super::reached::ReachedRange;
use super::uses::Verdict;
use crate::identification::observation::Motion;
use crate::identification::problem::Selection;
use crate::regression::{LjungBox, NoiseAutocorrelation, Solution};
use crate::stored_value::{self, Unit, number, numbers, optional_numbers};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointFriction, Robot};

/// Version of [`Estimate`]'s layout in JSON.
pub const SCHEMA: u32 = 2;

/// One identified parameter with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterEstimate {
    /// The field's name in lower case: `zz1r`, `ia3`, `fv_m6`.
    pub name: String,
    /// Name of its joint. `None` if the robot has no names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_name: Option<String>,
    /// Its quantity with the name of its joint or link. `None` if the robot has no names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// True if other parameters are regrouped into it. JSON does not have it.
    #[serde(skip)]
    pub regrouped: bool,
    /// Its SI unit: kg·m², kg·m, N·m·s/rad or N·m by the kind of parameter.
    #[serde(default, deserialize_with = "stored_value::unit")]
    pub unit: Unit,
    /// SI value.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Standard deviation, in the unit of the value, corrected for the colour of the residuals.
    #[serde(default = "stored_value::not_stored", deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub standard_deviation: f64,
    /// Combined standard uncertainty, in the unit of the value. It includes model errors and the
    /// tolerances of the configured values.
    #[serde(default = "stored_value::not_stored", deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub combined_standard_deviation: f64,
    /// Classical standard deviation, in the unit of the value, which assumes white residuals
    /// (equation 10).
    #[serde(default = "stored_value::not_stored", deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub classical_standard_deviation: f64,
    /// `standard_deviation / |value|`.
    #[serde(default = "stored_value::not_stored", deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub relative_standard_deviation: f64,
}

impl ParameterEstimate {
    /// Returns every selected parameter, from a solution and its corrected standard deviations.
    pub(crate) fn list(
        robot: &Robot,
        selection: &Selection,
        solution: &Solution,
        deviations: &DVector<f64>,
        combined: &DVector<f64>,
    ) -> Vec<Self> {
        let classical = solution.standard_deviations();
        let names = selection.names().iter().zip(selection.regrouped());
        let parameters = names.enumerate().map(|(k, (name, &regrouped))| Self {
            name: name.clone(),
            joint_name: robot.parameter_joint_name(name).map(str::to_owned),
            description: robot.parameter_description(name),
            regrouped,
            unit: unit(robot, selection.columns()[k]),
            value: solution.parameters[k],
            standard_deviation: deviations[k],
            combined_standard_deviation: combined[k].max(deviations[k]),
            classical_standard_deviation: classical[k],
            relative_standard_deviation: deviations[k] / solution.parameters[k].abs(),
        });
        parameters.collect()
    }
}

/// Parameter that was not identified and has the nominal value of the robot file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KeptParameter {
    /// The field's name in lower case.
    pub name: String,
    /// Its SI unit.
    #[serde(default, deserialize_with = "stored_value::unit")]
    pub unit: Unit,
    /// SI value.
    pub value: f64,
}

impl KeptParameter {
    pub(crate) fn list(robot: &Robot, base: &BaseParameters, selection: &Selection) -> Vec<Self> {
        let of_base = |column: &usize| base.columns().binary_search(column).ok();
        let fixed = selection.fixed().iter().filter_map(|(column, value)| {
            let name = base.names().get(of_base(column)?)?.clone();
            Some(Self { name, unit: unit(robot, *column), value: *value })
        });
        fixed.collect()
    }
}

/// Returns the unit of a regressor column's parameter.
fn unit(robot: &Robot, column: usize) -> &'static str {
    let parameter = robot.parameters().parameters()[column];
    parameter.kind.unit(robot.chain()[parameter.joint].kind)
}
/// Delay of a joint's torque beyond its configured timing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TorqueDelay {
    /// Delay beyond the configured timing \[s\]; negative if the torque acts earlier.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub delay_s: f64,
    /// Its corrected standard deviation \[s\].
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub standard_deviation_s: f64,
}

/// The extreme singular values of an observation matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SingularValues {
    /// Largest.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub max: f64,
    /// Smallest.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub min: f64,
}

impl SingularValues {
    /// Returns the singular values of the solved matrix.
    pub(crate) fn new(solution: &Solution) -> Self {
        let (max, min) = solution.extreme_singular_values();
        Self { max, min }
    }

    /// Returns the ratio of the largest to the smallest singular value.
    pub(crate) fn condition_number(&self) -> f64 {
        self.max / self.min
    }
}

/// Source of the reference of the simulated closed loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceSource {
    /// The reference was recorded.
    Recorded,
    /// The reference was not recorded; the filtered measured position was used instead.
    MeasuredPosition,
}

/// One closed-loop simulation and the least-squares step from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConvergenceStep {
    /// Number of the simulation, from 1; failed simulations count.
    pub simulation: u32,
    /// ‖y − Xθ‖ / ‖y‖ with X from this simulation and θ from the least-squares step that follows
    /// it.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub relative_error: f64,
    /// Change of the relative error since the previous step, divided by the previous relative error
    /// or by 1e-3, whichever is larger.
    pub relative_error_change: Option<f64>,
    /// Largest difference between the parameters of the step and the simulated parameters, in
    /// standard deviations of the step.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub parameter_change: f64,
    /// Number of halvings of the previous step until the simulation succeeded.
    pub halvings: u32,
}

/// Result of one identification. The command line documents its JSON layout, which is stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Estimate {
    /// Version of this record's layout.
    pub schema: u32,
    /// The method's name on the command line: `idim-ls`.
    pub method: String,
    /// The robot's name.
    pub robot: String,
    /// Samples of the experiment.
    pub samples: usize,
    /// Rows of the observation matrix, all joints together.
    pub rows: usize,
    /// Travel, speed and acceleration of each joint.
    pub reached_per_joint: Vec<ReachedRange>,
    /// Cut-off of the position filter, if the data chose it instead of the cell file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_cutoff: Option<ChosenCutoff>,
    /// Friction laws, if the data chose them instead of the robot file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<ChosenFriction>,
    /// Friction laws of each joint that the parameters refer to.
    pub friction_laws: Vec<JointFriction>,
    /// The parameters, in the model's order.
    pub parameters: Vec<ParameterEstimate>,
    /// Further base parameters that kept their nominal values; all others are 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[serde(rename = "kept")]
    pub nominal: Vec<KeptParameter>,
    /// Covariance of the parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<ParameterCovariance>,
    /// Condition number of the weighted, decimated observation matrix.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub condition_number: f64,
    /// Extreme singular values of the weighted, decimated observation matrix.
    pub singular_values: SingularValues,
    /// Condition number of the same matrix without the weights.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub unweighted_condition_number: f64,
    /// Extreme singular values of the unweighted matrix: the μ of the paper's tables 2 and 5.
    pub unweighted_singular_values: SingularValues,
    /// ‖y − Xθ‖ / ‖y‖ over all joints, unweighted.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub relative_error: f64,
    /// ‖y − Xθ‖ / ‖y‖ of each joint, unweighted.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub relative_error_per_joint: Vec<f64>,
    /// ‖y − Xθ‖ / ‖y‖ of each recording over all joints, unweighted; empty for a single recording.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub relative_error_per_recording: Vec<f64>,
    /// Root mean square of the residual per joint \[N·m or N\].
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub rms_error_per_joint_nm: Vec<f64>,
    /// Torque uncertainty of each joint along this motion, caused by the parameters: root mean
    /// square of the standard deviation of X θ, relative to that of the torque.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub relative_prediction_deviation_per_joint: Vec<f64>,
    /// Durbin–Watson statistic of the residual per joint.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub durbin_watson_per_joint: Vec<f64>,
    /// Durbin–Watson statistic that white noise has after the decimation filter.
    #[serde(deserialize_with = "number")]
    #[schemars(with = "Option<f64>")]
    pub durbin_watson_expected: f64,
    /// Probability, for each joint, that white noise after the decimation filter has residuals at
    /// least as correlated as the measured ones.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub whiteness_per_joint: Vec<f64>,
    /// Ljung–Box test of each joint, from which `whiteness_per_joint` is taken.
    pub ljung_box_per_joint: Vec<LjungBox>,
    /// Number of independent rows that carry as much information about a mean as the rows of each
    /// joint.
    #[serde(deserialize_with = "numbers")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub effective_rows_per_joint: Vec<f64>,
    /// Delay of each joint's torque beyond the configured timing; null if it is not identifiable.
    pub torque_delay_per_joint: Vec<Option<TorqueDelay>>,
    /// Estimates of the nuisance parameters, sorted by their torque, the largest first.
    #[serde(rename = "freedoms", deserialize_with = "known_nuisance_parameters")]
    pub nuisance_parameters: Vec<NuisanceEstimate>,
    /// Torque uncertainty outside the recorded motion.
    #[serde(rename = "elsewhere")]
    pub extrapolation: Extrapolation,
    /// Inputs of the predicted error on another motion; none without the decimation filter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model_uncertainty: Option<ModelUncertainty>,
    /// Prediction error on held-out folds of the motion.
    pub held_out: HeldOut,
    /// Effect of the position filter and of the position noise; `None` if it is not known.
    pub position_bias: Option<PositionBias>,
    /// Linear least-squares steps taken.
    pub iterations: u32,
    /// Closed-loop simulations of the iteration, including failed ones; the check for position
    /// noise takes two more.
    pub simulations: u32,
    /// The steps of the iteration, for methods that iterate.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub convergence: Vec<ConvergenceStep>,
    /// The reference of the simulated loops, for methods that simulate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSource>,
    /// Smallest bandwidth of a substitute controller \[Hz\] after a reduction, because the
    /// configured bandwidth is unstable at this sample rate. `None` without a reduction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slower_bandwidth_hz: Option<f64>,
    /// Number of rows of each joint whose residual has a weight below one half, with robust
    /// weights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub downweighted_rows_per_joint: Option<Vec<usize>>,
    /// ‖q − q_s‖ / ‖q‖ over the rows of each joint, with q_s the positions of the last simulation,
    /// for methods that simulate (the paper's table 3).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "optional_numbers")]
    #[schemars(with = "Option<Vec<Option<f64>>>")]
    pub relative_position_error_per_joint: Option<Vec<f64>>,
    /// ‖τ − τ_s‖ / ‖τ‖ over the rows of each joint, with τ_s the torques of the last simulation,
    /// for methods that simulate (the paper's table 3). Absent if the logged torques and the
    /// torques of the simulated controller do not act at the same time.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "optional_numbers")]
    #[schemars(with = "Option<Vec<Option<f64>>>")]
    pub simulated_torque_error_per_joint: Option<Vec<f64>>,
    /// Difference of each joint between the recorded torque and the command that the described
    /// controller computes from the recorded reference and position, relative to the torque and
    /// without the part that noise explains on average. `None` without a described controller, or
    /// if the difference cannot be determined.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "optional_numbers")]
    #[schemars(with = "Option<Vec<Option<f64>>>")]
    pub controller_error_per_joint: Option<Vec<f64>>,
    /// Probability, for each joint, that noise alone explains at least as large a difference.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "optional_numbers")]
    #[schemars(with = "Option<Vec<Option<f64>>>")]
    pub controller_probability_per_joint: Option<Vec<f64>>,
    /// Smallest canonical correlation between instruments and observation matrix, for methods with
    /// instruments: 1 if both span the same space, 0 if a combination of parameters has no
    /// instrument.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smallest_instrument_correlation: Option<f64>,
    /// Cost of physical consistency, if the robot file has nominal values.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(rename = "bodies")]
    pub link_bodies: Option<PhysicalConsistency>,
    /// Verdict for each use.
    pub verdict: Verdict,
}

/// The decimated torques that the parameters were fitted to, for plots: one vector per joint, one
/// entry per row \[N·m or N\]. Empty for a stored result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fit {
    /// Time of each row since the first sample \[s\].
    pub time_s: Vec<f64>,
    /// Filtered measured torque.
    pub measured: Vec<Vec<f64>>,
    /// Torque predicted by the identified model for the same rows, X θ.
    pub predicted: Vec<Vec<f64>>,
    /// Residuals of the solved equation: `measured − predicted`; for CLOE, the residuals of the
    /// positions \[rad or m\].
    pub equation_residuals: Vec<Vec<f64>>,
    /// Autocorrelation that white noise would have in `equation_residuals` after the decimation
    /// filter, from lag 1.
    pub white_noise: Vec<NoiseAutocorrelation>,
    /// Rows of each joint whose residual has a weight below one half, in ascending order; empty
    /// without robust weights.
    pub downweighted: Vec<Vec<usize>>,
    /// Information on each parameter by moves, in the order of the estimate's parameters.
    pub information: Information,
    /// Recorded motion of the fit.
    pub motion: FitMotion,
}

/// Motion for plots: a subset of the rows, as many as a plot can show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitMotion {
    /// Time of each since the first sample \[s\].
    pub time_s: Vec<f64>,
    /// Filtered positions, one vector per joint \[rad or m\].
    pub position: Vec<Vec<f64>>,
    /// Velocities, one vector per joint \[rad/s or m/s\].
    pub velocity: Vec<Vec<f64>>,
}

impl FitMotion {
    /// Largest number of rows that are kept: twice the width of a panel in pixels.
    const MAX_PLOT_ROWS: usize = 1000;

    /// Creates it from a motion; `samples` and `time_s` are the samples and times of its rows.
    pub(super) fn new(motion: &Motion, samples: &[usize], time_s: &[f64]) -> Self {
        let every = samples.len().div_ceil(Self::MAX_PLOT_ROWS).max(1);
        let rows = || samples.iter().copied().step_by(every);
        let joints = 0..motion.position.ncols();
        Self {
            time_s: time_s.iter().copied().step_by(every).collect(),
            position: joints
                .clone()
                .map(|joint| rows().map(|sample| motion.position[(sample, joint)]).collect())
                .collect(),
            velocity: joints
                .map(|joint| rows().map(|sample| motion.velocity(sample, joint)).collect())
                .collect(),
        }
    }
}

/// Estimate with the data to examine it.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The result.
    pub estimate: Estimate,
    /// Measured and predicted torques.
    pub fit: Fit,
}
