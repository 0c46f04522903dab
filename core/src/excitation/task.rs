//! What is to be designed.

use nalgebra::DMatrix;

use super::bounds::Bounds;
use super::information::Information;
use super::objective::Objective;
use crate::dynamics::Model;
use crate::robot::ParameterKind;

/// What is wanted of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Aim {
    /// Small standard deviations of parameters: the mean of ½ ln(σ² + need²) over them, by their place among those of the
    /// task, with the standard deviation of each below which nothing is gained; 0 where there is none.
    Deviations(Vec<(usize, f64)>),
    /// A small condition number of the base columns of inertia, unweighted and without friction.
    ConditionNumber,
}

/// What is measured of the torques.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of a row of each joint \[N·m or N\].
    pub levels: Vec<f64>,
    /// Independent rows of each joint in a second.
    pub rows_per_s: f64,
}

/// What is to be designed.
#[derive(Clone, Debug)]
pub struct Task {
    /// The arm; where friction grows with the load, with the load of its parameters.
    pub model: Model,
    /// What the motion may do.
    pub bounds: Bounds,
    /// Its length \[s\].
    pub duration_s: f64,
    /// Of each joint whether it moves; the others stand where that is best. What a joint that stands measures is no row:
    /// friction at rest holds any torque below its own.
    pub moving: Vec<bool>,
    /// The regressor's columns of the parameters that are identified, b.
    pub columns: Vec<usize>,
    /// What is known of them already: the inverse of their covariance (b × b), 0 where nothing is.
    pub before: DMatrix<f64>,
    /// What is measured.
    pub noise: Noise,
    /// What is wanted.
    pub aim: Aim,
}

impl Task {
    /// What `rate_hz` samples per second of a motion tell, and what is to be made of it.
    pub(super) fn information(&self, model: Model, rate_hz: f64) -> (Information, Objective) {
        match &self.aim {
            Aim::Deviations(wanted) => {
                let root = (self.noise.rows_per_s / rate_hz).sqrt();
                let weights = self.weights(self.noise.levels.iter().map(|level| root / level));
                let (columns, before) = (self.columns.clone(), self.before.clone());
                let information = Information::new(model, columns, before, weights);
                (information, Objective::Deviations(wanted.clone()))
            }
            Aim::ConditionNumber => {
                let is_inertia = |column: &&usize| {
                    let kind = model.parameters().parameters()[**column].kind;
                    ParameterKind::LINK.contains(&kind) || kind == ParameterKind::Ia
                };
                let columns: Vec<usize> = self.columns.iter().filter(is_inertia).copied().collect();
                let before = DMatrix::zeros(columns.len(), columns.len());
                let weights = self.weights(core::iter::repeat(1.0));
                let information = Information::new(model, columns, before, weights);
                (information, Objective::ConditionNumber)
            }
        }
    }

    fn weights(&self, of_each: impl Iterator<Item = f64>) -> Vec<f64> {
        let moving = self.moving.iter().zip(of_each);
        moving.map(|(moves, weight)| if *moves { weight } else { 0.0 }).collect()
    }
}
