//! One run: an arm, a seed, a method, and the comparison of the result with the truth.

use std::ops::Range;

use didim_identification::identification::{Estimate, Failure};
use serde::{Deserialize, Serialize};

use super::grid::{Grid, GridCell};
use super::plan::MethodPlan;
use super::simulated::{SimulatedError, simulate};
use super::start::with_nominal_error;
use super::torque::ReferenceTorque;
use didim::analysis::identify::identify_measurement;
use didim::cell::Cell;
use didim_formats::Measurement;

/// Record of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Name of the level on each axis.
    pub levels: Vec<String>,
    /// Name of the method in the plan.
    pub method: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Result of the run.
    pub outcome: Outcome,
}

/// Outcome of a run: a result, or the reason why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The method gave a result.
    Result(Box<TruthComparison>),
    /// The run gave no result.
    Failed {
        /// Name of the kind of failure.
        cause: String,
        /// Error message.
        message: String,
    },
}

impl Outcome {
    /// Returns the name of the kind of failure, if there is one. A method that ended in a local
    /// minimum has both a result and a failure.
    pub fn failure(&self) -> Option<&str> {
        match self {
            Self::Result(judged) => judged.failure.as_deref(),
            Self::Failed { cause, .. } => Some(cause),
        }
    }
}

/// Comparison of a result with the true parameters. The deviation z of a parameter is (estimate −
/// truth)/σ, with σ corrected for coloured residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthComparison {
    /// True if the verdict on the result is `applicable`.
    pub applicable: bool,
    /// Name of the failure of a method that nevertheless gave a result: a local minimum.
    pub failure: Option<String>,
    /// First reason of the verdict against the use of the result.
    pub first_reason: Option<String>,
    /// Number of closed-loop simulations.
    pub simulations: u32,
    /// Number of linear least-squares steps.
    pub iterations: u32,
    /// Relative error ‖y − Xθ̂‖ / ‖y‖ of the fit.
    pub relative_error: f64,
    /// Root mean square of z over the parameters.
    pub rms_deviation: f64,
    /// Fraction of the parameters with |z| ≤ 2.
    pub within_2: f64,
    /// Fraction of the parameters with |z| ≤ 3.
    pub within_3: f64,
    /// Name of the parameter with the largest |z|.
    pub largest_deviation_of: String,
    /// Deviation z of this parameter.
    pub largest_deviation: f64,
    /// Root mean square of (estimate − truth)/truth over the parameters that contribute at least 5
    /// % of the torque.
    pub rms_relative_error: f64,
    /// Largest magnitude of the relative errors of these parameters.
    pub largest_relative_error: f64,
    /// Torque deviation ‖X(θ̂ − θ)‖ / ‖Xθ‖ along the planned motion, without noise; θ is the truth.
    pub torque_deviation: f64,
}

impl TruthComparison {
    /// Compares a result with the truth; returns `None` if a figure is not finite.
    fn new(estimate: &Estimate, torque: &ReferenceTorque) -> Option<Self> {
        let (mut square, mut within, mut largest) = (0.0, [0.0, 0.0], (String::new(), 0.0_f64));
        let (mut relative_square, mut relative_largest, mut large) = (0.0, 0.0_f64, 0.0);
        for parameter in &estimate.parameters {
            let truth = torque.true_value(&parameter.name)?;
            let error = parameter.value - truth;
            let z = error / parameter.standard_deviation;
            square += z * z;
            for (count, limit) in within.iter_mut().zip([2.0, 3.0]) {
                *count += f64::from(z.abs() <= limit);
            }
            if z.abs() > largest.1.abs() {
                largest = (parameter.name.clone(), z);
            }
            if torque.is_large(&parameter.name) {
                relative_square += (error / truth).powi(2);
                relative_largest = relative_largest.max((error / truth).abs());
                large += 1.0;
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "parameters are fewer than a hundred")]
        let count = estimate.parameters.len() as f64;
        let judged = Self {
            applicable: estimate.verdict.applicable,
            failure: estimate.verdict.failure.map(|failure| failure.name().to_owned()),
            first_reason: estimate.verdict.reasons.first().map(ToString::to_string),
            simulations: estimate.simulations,
            iterations: estimate.iterations,
            relative_error: estimate.relative_error,
            rms_deviation: f64::sqrt(square / count),
            within_2: within[0] / count,
            within_3: within[1] / count,
            largest_deviation_of: largest.0,
            largest_deviation: largest.1,
            rms_relative_error: f64::sqrt(relative_square / f64::max(large, 1.0)),
            largest_relative_error: relative_largest,
            torque_deviation: torque.relative_deviation(&estimate.parameters),
        };
        let figures = [
            judged.relative_error,
            judged.rms_deviation,
            judged.rms_relative_error,
            judged.torque_deviation,
        ];
        figures.iter().all(|figure| figure.is_finite()).then_some(judged)
    }
}

/// Simulated measurement of the arm of a grid cell with one seed, as the arm's drives log it.
pub(super) struct Simulated {
    measurement: Measurement,
    counted_samples: Range<usize>,
}

/// Simulates the arm of a grid cell with a seed for its noise.
pub(super) fn simulate_cell(cell: &GridCell, seed: u64) -> Result<Simulated, SimulatedError> {
    let scenario = cell.scenario.clone().with_seed(seed);
    simulate(&scenario, &cell.cell)
        .map(|(measurement, counted)| Simulated { measurement, counted_samples: counted })
}

/// Identifies with one of the plan's methods, and compares the result with the truth.
pub(super) fn run(
    grid: &Grid,
    cell: &GridCell,
    method: &MethodPlan,
    seed: u64,
    record: &Result<Simulated, SimulatedError>,
) -> Run {
    let failed =
        |cause: &str, message: String| Outcome::Failed { cause: cause.to_owned(), message };
    let outcome = match record {
        // The simulation of the arm failed.
        Err(error) => failed("no-record", error.to_string()),
        Ok(Simulated { measurement, counted_samples: counted }) => {
            let run_cell = with_options(&cell.cell, method, seed);
            match identify_measurement(&run_cell, method.method, measurement, counted.clone()) {
                Err(error) => {
                    let cause = error.failure().map_or("no-identification", Failure::name);
                    failed(cause, error.to_string())
                }
                Ok(identification) => {
                    let torque = &grid.reference_torques[cell.motion];
                    match TruthComparison::new(&identification.estimate, torque) {
                        Some(judged) => Outcome::Result(Box::new(judged)),
                        None => failed("not-finite", "the result is not finite".to_owned()),
                    }
                }
            }
        }
    };
    let (levels, method) = (grid.level_names(cell), method.name().to_owned());
    Run { levels, method, seed, outcome }
}

/// Returns the cell with the plan's options for a method.
fn with_options(cell: &Cell, method: &MethodPlan, seed: u64) -> Cell {
    let mut cell = cell.clone();
    if let Some(part) = method.nominal_deviation {
        cell.robot = with_nominal_error(cell.robot, part, seed);
    }
    if let Some(filter) = method.position_filter {
        cell.options.position_filter = filter;
    }
    if let Some(decimated) = method.decimated {
        cell.options.simulation.decimated = decimated;
    }
    let simulation = &mut cell.options.simulation;
    simulation.didim_steps = method.didim_steps.unwrap_or(simulation.didim_steps);
    simulation.start = method.start.unwrap_or(simulation.start);
    cell
}
