//! Bodies as a constraint on the linear steps of DIDIM, CLIE and CLOE.

use nalgebra::{DMatrix, DVector};

use crate::feasibility::{Constraint, Estimate, Possible, Prior};
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::given::{BodiesFrom, Context, IdentificationError};
use crate::regression::Solution;

/// Where the linear steps are to end at parameters that bodies can have.
pub(super) struct Bodies {
    constraint: Constraint,
    /// How well IDIM-LS knows the parameters: how near the start stays to what was chosen.
    of_start: DMatrix<f64>,
}

impl Bodies {
    /// None where the options ask for none.
    pub(super) fn of(
        context: &Context<'_>,
        fit: &EquationErrorFit,
    ) -> Result<Option<Self>, IdentificationError> {
        let Context { robot, base, selection, .. } = context;
        let prior = match context.options.simulation.bodies {
            None => return Ok(None),
            Some(BodiesFrom::Nominal) => Prior::nominal(robot),
            Some(BodiesFrom::TotalMassKg(mass)) => Prior::geometric(robot, mass),
        };
        let prior = prior.map_err(IdentificationError::Bodies)?;
        let Solution { parameters, covariance, .. } = &fit.weighted.solution;
        let (names, values) = (selection.names(), parameters.as_slice());
        // What links keep at a value is refused: that value is simulated, and bodies need not have it.
        let first = Estimate { names, values, covariance, held: &[] };
        let constraint = Constraint::new(robot, base, &first, &prior);
        let constraint = constraint.map_err(IdentificationError::Bodies)?;
        Ok(Some(Self { constraint, of_start: covariance.clone() }))
    }

    /// The arm nearest to parameters to start from.
    pub(super) fn start(&self, parameters: &DVector<f64>) -> Result<Possible, IdentificationError> {
        let nearest = self.constraint.nearest(parameters, &self.of_start);
        nearest.map_err(IdentificationError::Bodies)
    }

    /// The arm nearest to a linear step's parameters, by its covariance.
    pub(super) fn nearest(&self, solution: &Solution) -> Result<Possible, IdentificationError> {
        let nearest = self.constraint.nearest(&solution.parameters, &solution.covariance);
        nearest.map_err(IdentificationError::Bodies)
    }

    /// A part of the way from one arm to another.
    pub(super) fn between(&self, from: &Possible, to: &Possible, part: f64) -> Option<Possible> {
        self.constraint.between(from, to, part)
    }
}
