//! Physical consistency as a constraint on successive estimates, such as those of an iteration.

use nalgebra::{DMatrix, DVector};

use super::block::factor;
use super::error::FeasibilityError;
use super::estimate::{Estimate, Rows};
use super::prior::Prior;
use super::problem::{Point, Problem, divergence};
use super::solve::build_problem;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Physical consistency and prior knowledge of bodies. Friction and drive inertias are relative to
/// their magnitudes in the first estimate (s⁰ in [`fit_consistent`](super::fit_consistent)). So the
/// penalty λ (Σ D + Σ d) is the same function for all estimates.
#[derive(Debug)]
pub struct Constraint {
    rows: Rows,
    identified_count: usize,
    problem: Problem,
    weight: f64,
}

/// Physically consistent parameters.
#[derive(Clone, Debug)]
pub struct ConsistentPoint {
    point: Point,
    /// Identified base parameters (b).
    pub parameters: DVector<f64>,
    /// Penalty λ (Σ D + Σ d).
    pub penalty: f64,
}

impl Constraint {
    /// Creates the constraint for these parameters, with λ of [`Prior::default_weight`].
    ///
    /// # Errors
    /// Those of [`fit_consistent`](super::fit_consistent).
    pub fn new(
        robot: &Robot,
        base: &BaseParameters,
        first: &Estimate<'_>,
        prior: &Prior,
    ) -> Result<Self, FeasibilityError> {
        let rows = Rows::new(base, robot.parameters().parameters(), first)?;
        let problem = build_problem(robot, &rows, prior)?;
        let (identified, weight) = (first.names.len(), prior.default_weight());
        Ok(Self { rows, identified_count: identified, problem, weight })
    }

    /// Minimises ‖R(Bθ − β̂)‖² + λ (Σ D + Σ d) for an estimate of the same parameters (b) and its
    /// covariance (b × b).
    ///
    /// # Errors
    /// [`FeasibilityError::Covariance`] and [`FeasibilityError::NotConverged`].
    pub fn nearest_consistent(
        &self,
        parameters: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Result<ConsistentPoint, FeasibilityError> {
        let Rows { regrouping, values, covariance: of_rows, .. } = &self.rows;
        let (mut values, mut of_rows) = (values.clone(), of_rows.clone());
        let fixed_columns = self.identified_count;
        if parameters.len() != fixed_columns || covariance.shape() != (fixed_columns, fixed_columns)
        {
            let (rows, columns) = covariance.shape();
            return Err(FeasibilityError::Shape {
                names: fixed_columns,
                values: parameters.len(),
                rows,
                columns,
            });
        }
        values.rows_mut(0, fixed_columns).copy_from(parameters);
        of_rows.view_mut((0, 0), (fixed_columns, fixed_columns)).copy_from(covariance);
        let (whitened, target) =
            Problem::whiten(regrouping, &values, &of_rows).ok_or(FeasibilityError::Covariance)?;
        let minimum = Problem { whitened_columns: whitened, target, ..self.problem.clone() }
            .minimise(self.weight)?;
        Ok(self.evaluate(minimum.point))
    }

    /// Interpolates between two sets of parameters; `part` 0 is the first set and 1 the second. The
    /// result is physically consistent again. Returns `None` if rounding makes it inconsistent.
    pub fn interpolate(
        &self,
        from: &ConsistentPoint,
        to: &ConsistentPoint,
        part: f64,
    ) -> Option<ConsistentPoint> {
        let square = |one: &DMatrix<f64>| one * one.transpose();
        let factors = from
            .point
            .factors
            .iter()
            .zip(&to.point.factors)
            .map(|(from, to)| factor(&(square(from) * (1.0 - part) + square(to) * part)));
        let factors = factors.collect::<Option<_>>()?;
        let free = &from.point.free_values * (1.0 - part) + &to.point.free_values * part;
        Some(self.evaluate(Point { factors, free_values: free }))
    }

    fn evaluate(&self, point: Point) -> ConsistentPoint {
        let standard = self.problem.parameters(&point);
        let parameters = self.rows.regrouping.rows(0, self.identified_count) * standard;
        let penalty = self.weight * point.factors.iter().map(divergence).sum::<f64>();
        ConsistentPoint { point, parameters, penalty }
    }
}
