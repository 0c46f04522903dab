//! Weighted solution of an equation, by least squares or as an M-estimate.

use nalgebra::DVector;

use crate::identification::judgement::{DownweightedRows, TorqueRows};
use crate::regression::{Observations, RegressionError, RobustLoss, Solution};

/// Weighted solution, and the equation that it is the least-squares solution of.
pub(crate) struct Weighting {
    pub(crate) solution: Solution,
    robust: Option<Robust>,
}

struct Robust {
    /// Equation with pseudo-values, without the downweighted rows.
    pseudo_equation: Observations,
    /// Residuals of the measured torques.
    residuals: DVector<f64>,
    downweighted: DownweightedRows,
}

impl Weighting {
    pub(crate) fn new(
        equation: &Observations,
        noise_levels: &[f64],
        loss: Option<RobustLoss>,
    ) -> Result<Self, RegressionError> {
        let Some(loss) = loss else {
            return Ok(Self { solution: equation.solve_weighted(noise_levels)?, robust: None });
        };
        let robust_fit = equation.fit_robust(loss, noise_levels)?;
        let residuals = equation.residuals(&robust_fit.solution.parameters);
        let downweighted = DownweightedRows::new(&robust_fit, loss);
        let (fixed, solution) =
            without_downweighted(&robust_fit.pseudo_equation, &robust_fit.solution, &downweighted)?;
        let robust = Robust { pseudo_equation: fixed, residuals, downweighted };
        Ok(Self { solution, robust: Some(robust) })
    }

    /// Replaces the parameters of the least-squares solution; the covariance stays.
    pub(crate) fn with_parameters(
        mut self,
        equation: &Observations,
        parameters: DVector<f64>,
    ) -> Self {
        self.solution.residuals = self.solved_equation(equation).residuals(&parameters);
        if let Some(robust) = &mut self.robust {
            robust.residuals = equation.residuals(&parameters);
        }
        self.solution.parameters = parameters;
        self
    }

    /// Returns the equation that least squares solved.
    pub(crate) fn solved_equation<'a>(&'a self, equation: &'a Observations) -> &'a Observations {
        self.robust.as_ref().map_or(equation, |robust| &robust.pseudo_equation)
    }

    /// Returns the measured torques if pseudo-values were solved instead of them.
    pub(crate) fn torque_rows<'a>(&'a self, equation: &'a Observations) -> Option<TorqueRows<'a>> {
        let robust = self.robust.as_ref()?;
        Some(TorqueRows { observations: equation, residuals: &robust.residuals, own: None })
    }

    /// Returns the rows whose residual has a weight below one half; `None` without robust weights.
    pub(crate) fn downweighted_rows(&self) -> Option<&DownweightedRows> {
        self.robust.as_ref().map(|robust| &robust.downweighted)
    }
}

/// Returns the equation and its solution with zeros in the downweighted rows, and with the same
/// parameters.
///
/// An encoder glitch makes rows of X that are large but contain no information. If these rows were
/// kept, the covariance would be too small. The checks also add columns to the model, and would
/// have to set them to 0 in these rows. The remaining residuals are projected so that they stay
/// orthogonal to X.
fn without_downweighted(
    pseudo: &Observations,
    solution: &Solution,
    downweighted: &DownweightedRows,
) -> Result<(Observations, Solution), RegressionError> {
    let (mut matrix, mut residuals) = (pseudo.matrix().clone(), solution.residuals.clone());
    let mut known_torque = pseudo.known_torque().cloned();
    for (joint, rows) in downweighted.per_joint().iter().enumerate() {
        for row_of_joint in rows {
            let row = pseudo.joint_rows(joint).start + row_of_joint;
            matrix.zero_row(joint, *row_of_joint);
            residuals[row] = 0.0;
            if let Some(torque_known) = &mut known_torque {
                torque_known[row] = 0.0;
            }
        }
    }
    let predicted = matrix.times_parameters(&solution.parameters);
    let values = &predicted + residuals;
    let remaining = Observations::from_dense(matrix.clone(), values)?;
    let mut solved = remaining.solve_weighted(&solution.noise_levels)?;
    let reduced = Observations::from_dense(matrix, predicted + &solved.residuals)?;
    let reduced = reduced.with_known(known_torque);
    solved.parameters.copy_from(&solution.parameters);
    Ok((reduced, solved))
}
