//! Statistics of the residuals of a fit, for any method.

use nalgebra::DVector;

use super::observations::Observations;

/// Statistics of unweighted residuals `ρ = y − X θ`. A joint without an equation has no figures:
/// they are NaN, which is `null` in JSON.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualStatistics {
    /// ‖ρ‖/‖y‖ over all joints, with the measured values y.
    pub relative_error: f64,
    /// ‖ρ_j‖/‖y_j‖ of every joint.
    pub relative_error_per_joint: Vec<f64>,
    /// ‖ρ_j‖/√N of every joint, in the unit of the measurements.
    pub rms_per_joint: Vec<f64>,
    /// Durbin–Watson statistic of every joint, `Σ (ρ_k − ρ_{k−1})² / Σ ρ_k²`. It is 2 for white
    /// noise and approaches 0 with positive correlation (Durbin & Watson 1950). A parallel filter
    /// with its cut-off below the Nyquist frequency also lowers it for white noise, to about 1.64
    /// for a cut-off ratio of 0.8. It is set to 2 for residuals of exactly zero.
    pub durbin_watson_per_joint: Vec<f64>,
}

impl Observations {
    /// Returns ‖v_j‖/√N of the rows v of every joint.
    pub fn rms_per_joint(&self, rows: &DVector<f64>) -> Vec<f64> {
        let count = self.rows_per_joint() as f64;
        let square = |joint| self.joint_of(rows, joint).norm_squared();
        (0..self.joints()).map(|joint| (square(joint) / count).sqrt()).collect()
    }

    /// Returns a figure of every joint, NaN for joints without an equation.
    pub(crate) fn figures_per_joint(&self, mut figures: Vec<f64>) -> Vec<f64> {
        for joint in self.matrix().left_out_joints() {
            figures[*joint] = f64::NAN;
        }
        figures
    }

    /// Returns the statistics of residuals of this system.
    pub fn residual_statistics(&self, residuals: &DVector<f64>) -> ResidualStatistics {
        let y = &*self.measured_values();
        let per_joint = |figure: &dyn Fn(&[f64], &[f64]) -> f64| -> Vec<f64> {
            let figures = (0..self.joints()).map(|joint| {
                if !self.matrix().has_equation(joint) {
                    return f64::NAN;
                }
                let (rho, y) = (self.joint_of(residuals, joint), self.joint_of(y, joint));
                figure(rho.as_slice(), y.as_slice())
            });
            figures.collect()
        };
        ResidualStatistics {
            relative_error: residuals.norm() / y.norm(),
            relative_error_per_joint: per_joint(&|rho, y| (sum_sq(rho) / sum_sq(y)).sqrt()),
            rms_per_joint: self.figures_per_joint(self.rms_per_joint(residuals)),
            durbin_watson_per_joint: per_joint(&|rho, _| durbin_watson(rho)),
        }
    }
}

/// Returns ‖e‖/‖y‖ over all joints and for each joint, from ‖e_j‖² and ‖y_j‖².
pub(crate) fn relative_errors(squares: &[[f64; 2]]) -> (f64, Vec<f64>) {
    let relative = |[error, complete]: [f64; 2]| (error / complete).sqrt();
    let total = squares.iter().fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    (relative(total), squares.iter().copied().map(relative).collect())
}

fn sum_sq(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum()
}

fn durbin_watson(residuals: &[f64]) -> f64 {
    let steps: f64 = residuals.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0])).sum();
    let total = sum_sq(residuals);
    if total > 0.0 { steps / total } else { 2.0 }
}
