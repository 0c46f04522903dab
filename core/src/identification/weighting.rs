//! The weighted solution of an equation, by least squares or as an M-estimate.

use nalgebra::DVector;

use super::assemble::TorqueRows;
use crate::regression::{Observations, RegressionError, RobustLoss, Solution};

/// Parameters, and the equation whose least squares solution they are.
pub(super) struct Weighting {
    pub(super) solution: Solution,
    robust: Option<Robust>,
}

struct Robust {
    /// The equation with pseudo-values.
    pseudo: Observations,
    /// What the parameters leave of the measurements themselves.
    residuals: DVector<f64>,
    downweighted_rows_per_joint: Vec<usize>,
}

impl Weighting {
    pub(super) fn new(
        equation: &Observations,
        noise_levels: &[f64],
        loss: Option<RobustLoss>,
    ) -> Result<Self, RegressionError> {
        let Some(loss) = loss else {
            return Ok(Self { solution: equation.weighted(noise_levels)?, robust: None });
        };
        let found = equation.robust(loss, noise_levels)?;
        let residuals = equation.residuals(&found.solution.parameters);
        let downweighted_rows_per_joint = found.downweighted_rows_per_joint;
        let robust = Robust { pseudo: found.pseudo, residuals, downweighted_rows_per_joint };
        Ok(Self { solution: found.solution, robust: Some(robust) })
    }

    /// The equation that least squares solved; its matrix is the given one's.
    pub(super) fn solved<'a>(&'a self, equation: &'a Observations) -> &'a Observations {
        self.robust.as_ref().map_or(equation, |robust| &robust.pseudo)
    }

    /// The measured torques, where other values were solved.
    pub(super) fn torque_rows<'a>(&'a self, equation: &'a Observations) -> Option<TorqueRows<'a>> {
        let robust = self.robust.as_ref()?;
        Some(TorqueRows { observations: equation, residuals: &robust.residuals, own: None })
    }

    /// Rows of each joint that count for less than a half, where any may.
    pub(super) fn downweighted_rows_per_joint(&self) -> Option<Vec<usize>> {
        self.robust.as_ref().map(|robust| robust.downweighted_rows_per_joint.clone())
    }
}
