//! Physical consistency as a constraint on the linear steps of DIDIM, CLIE and CLOE.

use nalgebra::{DMatrix, DVector};

use crate::feasibility::{ConsistentPoint, Constraint, Estimate, Prior};
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::problem::{BodiesFrom, Context, IdentificationError};
use crate::regression::Solution;

/// Restriction of the linear steps to physically consistent parameters.
pub(super) struct ConsistentParameters {
    constraint: Constraint,
    /// Covariance of the IDIM-LS parameters, which is the metric for projecting the start.
    start_point: DMatrix<f64>,
}

impl ConsistentParameters {
    /// Creates the restriction; returns `None` if the options do not request it.
    pub(super) fn new(
        context: &Context<'_>,
        fit: &EquationErrorFit,
    ) -> Result<Option<Self>, IdentificationError> {
        let Context { robot, base, selection, .. } = context;
        let prior = match context.options.simulation.consistent_parameters {
            None => return Ok(None),
            Some(BodiesFrom::Nominal) => Prior::nominal(robot),
            Some(BodiesFrom::TotalMassKg(mass)) => Prior::geometric(robot, mass),
        };
        let prior = prior.map_err(IdentificationError::Consistency)?;
        let Solution { parameters, covariance, .. } = &fit.weighting.solution;
        let (names, values) = (selection.names(), parameters.as_slice());
        // Fixed link parameters are refused: their value is simulated, and may be physically
        // inconsistent.
        let first = Estimate { names, values, covariance, fixed: &[] };
        let constraint = Constraint::new(robot, base, &first, &prior);
        let constraint = constraint.map_err(IdentificationError::Consistency)?;
        Ok(Some(Self { constraint, start_point: covariance.clone() }))
    }

    /// Returns the physically consistent parameters nearest to given start parameters.
    pub(super) fn start_parameters(
        &self,
        parameters: &DVector<f64>,
    ) -> Result<ConsistentPoint, IdentificationError> {
        let nearest = self.constraint.nearest_consistent(parameters, &self.start_point);
        nearest.map_err(IdentificationError::Consistency)
    }

    /// Returns the physically consistent parameters nearest to those of a linear step, by its
    /// covariance.
    pub(super) fn nearest_arm(
        &self,
        solution: &Solution,
    ) -> Result<ConsistentPoint, IdentificationError> {
        let nearest =
            self.constraint.nearest_consistent(&solution.parameters, &solution.covariance);
        nearest.map_err(IdentificationError::Consistency)
    }

    /// Interpolates between two consistent points.
    pub(super) fn interpolate(
        &self,
        from: &ConsistentPoint,
        to: &ConsistentPoint,
        part: f64,
    ) -> Option<ConsistentPoint> {
        self.constraint.interpolate(from, to, part)
    }
}
