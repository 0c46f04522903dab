//! Task of a motion design.

use nalgebra::DMatrix;

use super::bounds::Bounds;
use super::information::Information;
use super::objective::Objective;
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::ParameterKind;

/// Objective of a motion design.
#[derive(Clone, Debug, PartialEq)]
pub enum DesignObjective {
    /// Small standard deviations σ of parameters: the mean of ½ ln(σ² + need²) over them. Each
    /// parameter has its index among the parameters of the task, and its `need`: the standard
    /// deviation below which a decrease has no value; 0 if there is none.
    Deviations(Vec<(usize, f64)>),
    /// Small condition number of the base columns of inertia, unweighted and without friction.
    ConditionNumber,
}

/// Noise of the measured torques.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of the noise in a row of each joint \[N·m or N\].
    pub deviations: Vec<f64>,
    /// Number of independent rows of each joint per second.
    pub rows_per_s: f64,
}

/// Task of a motion design.
#[derive(Clone, Debug)]
pub struct Task {
    /// Model of the arm. If friction grows with the load, the model includes the load of its
    /// parameters.
    pub model: Model,
    /// Limits of the motion.
    pub bounds: Bounds,
    /// Duration of the motion \[s\].
    pub duration_s: f64,
    /// First posture of the motion \[rad or m\]; `None` for any posture. Then the search starts in
    /// the middle of the ranges.
    pub first_posture: Option<Vec<f64>>,
    /// True for each joint that moves. The others are at rest in the best position. A joint at rest
    /// contributes no rows, because static friction may balance any torque up to its limit.
    pub moving_joints: Vec<bool>,
    /// Regressor columns of the b identified parameters.
    pub columns: Vec<usize>,
    /// Prior information: the inverse of the covariance of these parameters (b × b), 0 for
    /// parameters without prior information.
    pub prior_information: DMatrix<f64>,
    /// Noise of the measurement.
    pub noise: Noise,
    /// Objective of the design.
    pub objective: DesignObjective,
}

impl Task {
    /// Returns the information of a motion at `rate_hz` samples per second, and the objective for
    /// it.
    pub(super) fn information(&self, model: Model, rate_hz: f64) -> (Information, Objective) {
        match &self.objective {
            DesignObjective::Deviations(wanted) => {
                let root = (self.noise.rows_per_s / rate_hz).sqrt();
                let weights = self.weights(self.noise.deviations.iter().map(|level| root / level));
                let (columns, before) = (self.columns.clone(), self.prior_information.clone());
                let information = Information::new(model, columns, before, weights);
                (information, Objective::Deviations(wanted.clone()))
            }
            DesignObjective::ConditionNumber => {
                let columns: Vec<usize> = self
                    .columns
                    .iter()
                    .filter(|column: &&usize| {
                        let kind = model.parameters().parameters()[**column].kind;
                        ParameterKind::LINK.contains(&kind) || kind == ParameterKind::Ia
                    })
                    .copied()
                    .collect();
                let before = DMatrix::zeros(columns.len(), columns.len());
                let weights = self.weights(core::iter::repeat(1.0));
                let information = Information::new(model, columns, before, weights);
                (information, Objective::ConditionNumber)
            }
        }
    }

    fn weights(&self, of_each: impl Iterator<Item = f64>) -> Vec<f64> {
        let moving = self.moving_joints.iter().zip(of_each);
        moving.map(|(moves, weight)| if *moves { weight } else { 0.0 }).collect()
    }
}
