//! Bodies as a constraint on estimates that follow each other, such as those of an iteration.

use nalgebra::{DMatrix, DVector};

use super::block::factor;
use super::error::FeasibilityError;
use super::estimate::{Estimate, Rows};
use super::prior::Prior;
use super::problem::{Point, Problem, divergence};
use super::solve::problem;
use crate::dynamics::BaseParameters;
use crate::robot::Robot;

/// What bodies can have, and what is known of them before any data. The sizes that friction and drive inertias
/// are beside (`consistent`'s s⁰) are those of the first estimate, so that λ (Σ D + Σ d) is one function for all.
#[derive(Debug)]
pub struct Constraint {
    rows: Rows,
    identified: usize,
    problem: Problem,
    weight: f64,
}

/// Parameters that bodies have.
#[derive(Clone, Debug)]
pub struct Possible {
    point: Point,
    /// The identified base parameters (b).
    pub parameters: DVector<f64>,
    /// λ (Σ D + Σ d).
    pub penalty: f64,
}

impl Constraint {
    /// Of these parameters, with λ of [`Prior::default_weight`].
    ///
    /// # Errors
    /// As [`consistent`](super::consistent).
    pub fn new(
        robot: &Robot,
        base: &BaseParameters,
        first: &Estimate<'_>,
        prior: &Prior,
    ) -> Result<Self, FeasibilityError> {
        let rows = Rows::new(base, robot.parameters().parameters(), first)?;
        let problem = problem(robot, &rows, prior)?;
        let (identified, weight) = (first.names.len(), prior.default_weight());
        Ok(Self { rows, identified, problem, weight })
    }

    /// The minimum of ‖R(Bθ − β̂)‖² + λ (Σ D + Σ d) for an estimate of the same parameters (b) and its covariance (b × b).
    ///
    /// # Errors
    /// [`FeasibilityError::Covariance`] and [`FeasibilityError::NotConverged`].
    pub fn nearest(
        &self,
        parameters: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Result<Possible, FeasibilityError> {
        let Rows { regrouping, values, covariance: of_rows, .. } = &self.rows;
        let (mut values, mut of_rows) = (values.clone(), of_rows.clone());
        let own = self.identified;
        if parameters.len() != own || covariance.shape() != (own, own) {
            let (rows, columns) = covariance.shape();
            return Err(FeasibilityError::Shape {
                names: own,
                values: parameters.len(),
                rows,
                columns,
            });
        }
        values.rows_mut(0, own).copy_from(parameters);
        of_rows.view_mut((0, 0), (own, own)).copy_from(covariance);
        let (whitened, target) =
            Problem::whiten(regrouping, &values, &of_rows).ok_or(FeasibilityError::Covariance)?;
        let minimum = Problem { whitened, target, ..self.problem.clone() }.minimise(self.weight)?;
        Ok(self.at(minimum.point))
    }

    /// What lies between two of them, this part of the way from the first to the second: bodies again. None where
    /// rounding makes it none.
    pub fn between(&self, from: &Possible, to: &Possible, part: f64) -> Option<Possible> {
        let square = |one: &DMatrix<f64>| one * one.transpose();
        let factors = from
            .point
            .factors
            .iter()
            .zip(&to.point.factors)
            .map(|(from, to)| factor(&(square(from) * (1.0 - part) + square(to) * part)));
        let factors = factors.collect::<Option<_>>()?;
        let free = &from.point.free * (1.0 - part) + &to.point.free * part;
        Some(self.at(Point { factors, free }))
    }

    fn at(&self, point: Point) -> Possible {
        let standard = self.problem.parameters(&point);
        let parameters = self.rows.regrouping.rows(0, self.identified) * standard;
        let penalty = self.weight * point.factors.iter().map(divergence).sum::<f64>();
        Possible { point, parameters, penalty }
    }
}
