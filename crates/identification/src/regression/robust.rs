//! Least squares that is insensitive to a few rows: M-estimates (Huber & Ronchetti, *Robust
//! Statistics*, 2nd edition, chapter 7).

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

use super::error::RegressionError;
use super::limits::RegressionLimits;
use super::observations::Observations;
use super::solution::Solution;
use didim_dynamics::numeric::median;

/// Loss that limits the effect of a large residual, with its tuning constant in standard
/// deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RobustLoss {
    /// `ψ(u) = u`, limited to ± the tuning constant (Huber, *Ann. Math. Statist.* 35, 1964).
    Huber {
        /// The tuning constant, in standard deviations of the residuals \[σ\].
        #[serde(default = "RobustLoss::huber_tuning")]
        tuning: f64,
    },
    /// `ψ(u) = u (1 − (u/c)²)²`, and 0 beyond c (Beaton & Tukey, *Technometrics* 16, 1974).
    Bisquare {
        /// The tuning constant, in standard deviations of the residuals \[σ\].
        #[serde(default = "RobustLoss::bisquare_tuning")]
        tuning: f64,
    },
}

/// Median of |u| for a standard normal variable u.
const NORMAL_MAD: f64 = 0.674_489_750_196_081_7;

/// Residuals up to this share of the measurements are rounding errors. None of them is an outlier.
const ROUNDING_SHARE: f64 = 1e-7;

/// Convergence limit. The last step changes the predicted values of each joint by at most this
/// share of the joint's residual scale. Relative to any standard deviation the change is no larger.
const CHANGE_TOLERANCE: f64 = 1e-6;

/// Largest number of steps; about twenty are usual.
const MAX_STEPS: usize = 200;

/// Number of steps in which scales and slopes are updated from the residuals. Afterwards they are
/// constant, because a row that crosses a corner of ψ back and forth may cause a cycle.
const RESCALED_STEPS: usize = 30;

impl RobustLoss {
    fn huber_tuning() -> f64 {
        1.345
    }

    fn bisquare_tuning() -> f64 {
        4.685
    }

    /// Returns Huber's loss with the usual tuning.
    pub fn default_huber() -> Self {
        Self::Huber { tuning: Self::huber_tuning() }
    }

    /// Returns Tukey's bisquare with the usual tuning.
    pub fn default_bisquare() -> Self {
        Self::Bisquare { tuning: Self::bisquare_tuning() }
    }

    fn tuning(self) -> f64 {
        match self {
            Self::Huber { tuning } | Self::Bisquare { tuning } => tuning,
        }
    }

    /// Checks that the tuning constant is positive. An infinite constant gives least squares.
    ///
    /// # Errors
    /// [`Tuning`](RegressionError::Tuning).
    pub fn validate(self) -> Result<(), RegressionError> {
        let tuning = self.tuning();
        if tuning.is_nan() || tuning <= 0.0 {
            return Err(RegressionError::Tuning { tuning });
        }
        Ok(())
    }

    /// Returns true if a residual of u scales has a weight below one half.
    pub fn weighs_down(self, u: f64) -> bool {
        self.weight_and_slope(u).0 < RegressionLimits::DEFAULT.downweighted_share
    }

    /// Returns the share of rows with normal errors that is downweighted.
    pub fn normal_share_weighed_down(self) -> f64 {
        // ψ(u)/u = 1/2, solved for |u|.
        let half = match self {
            Self::Huber { tuning } => tuning / RegressionLimits::DEFAULT.downweighted_share,
            Self::Bisquare { tuning } => {
                tuning * (1.0 - RegressionLimits::DEFAULT.downweighted_share.sqrt()).sqrt()
            }
        };
        2.0 * Normal::standard().sf(half)
    }

    /// Returns ψ(u)/u and ψ′(u).
    fn weight_and_slope(self, u: f64) -> (f64, f64) {
        let share = u.abs() / self.tuning();
        match self {
            Self::Huber { .. } if share <= 1.0 => (1.0, 1.0),
            Self::Huber { .. } => (1.0 / share, 0.0),
            Self::Bisquare { .. } if share <= 1.0 => {
                let distance = 1.0 - share * share;
                (distance * distance, distance * (1.0 - 5.0 * share * share))
            }
            Self::Bisquare { .. } => (0.0, 0.0),
        }
    }
}

/// M-estimate, represented as the least-squares solution of other measurements.
///
/// With residuals ρ, scale s_j and the mean slope m_j of ψ over the rows of a joint, the estimate
/// solves `Σ_j X_jᵀ ψ(ρ_j/s_j) s_j/(m_j σ_j²) = 0`. This is weighted least squares of the
/// **pseudo-values** `y* = Xθ + K s ψ(ρ/s)/m` on X. To first order, y* shifts the estimate as y
/// does. So the covariance of that least squares solution is that of the estimate,
/// `s² E[ψ²]/E[ψ′]² (XᵀX)⁻¹` for independent rows (Huber & Ronchetti, section 7.6, with their
/// `K = 1 + b/N · var(ψ′)/E[ψ′]²`). A correction for the colour of the residuals applies to both.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustSolution {
    /// Equation with the pseudo-values as measurements.
    pub pseudo_equation: Observations,
    /// Weighted solution of `pseudo_equation`.
    pub solution: Solution,
    /// Number of rows of each joint whose residual has a weight below one half; for normal errors
    /// about one in a hundred rows.
    pub downweighted_rows_per_joint: Vec<usize>,
    /// Scaled residual ρ/s of every row.
    pub scaled_residuals: DVector<f64>,
}

impl Observations {
    /// Returns the M-estimate with one noise level σ_j per joint, which weights the joints as in
    /// [`solve_weighted`](Self::solve_weighted). The scale s_j of a joint's residuals is their
    /// median absolute value divided by 0.6745, so a few large residuals do not change it.
    ///
    /// # Errors
    /// Those of [`solve_weighted`](Self::solve_weighted), [`Tuning`](RegressionError::Tuning) and
    /// [`NotSettled`](RegressionError::NotSettled).
    pub fn fit_robust(
        &self,
        loss: RobustLoss,
        noise_levels: &[f64],
    ) -> Result<RobustSolution, RegressionError> {
        loss.validate()?;
        let first = self.solve_weighted(noise_levels)?.parameters;
        match loss {
            RobustLoss::Huber { .. } => self.iterate_to_convergence(loss, noise_levels, first),
            // The bisquare criterion has several minima. The search starts at Huber's estimate,
            // whose criterion has only one.
            RobustLoss::Bisquare { .. } => {
                let near =
                    self.iterate_to_convergence(RobustLoss::default_huber(), noise_levels, first)?;
                self.iterate_to_convergence(loss, noise_levels, near.solution.parameters)
            }
        }
    }

    /// Returns noise levels that a few outliers cannot raise: those of the M-estimate with equal
    /// weights.
    ///
    /// # Errors
    /// Those of [`fit_robust`](Self::fit_robust).
    pub fn robust_noise_levels(&self, loss: RobustLoss) -> Result<Vec<f64>, RegressionError> {
        let fit = self.fit_robust(loss, &vec![1.0; self.joints()])?;
        Ok(fit.pseudo_equation.noise_levels(&fit.solution.residuals))
    }

    /// Alternates pseudo-values and least squares until the parameters converge.
    fn iterate_to_convergence(
        &self,
        loss: RobustLoss,
        noise_levels: &[f64],
        mut parameters: DVector<f64>,
    ) -> Result<RobustSolution, RegressionError> {
        let mut scalings = Vec::new();
        for step in 0..MAX_STEPS {
            let residuals = self.residuals(&parameters);
            if step < RESCALED_STEPS {
                let joints =
                    (0..self.joints()).map(|joint| self.joint_scaling(loss, joint, &residuals));
                scalings = joints.collect::<Result<_, _>>()?;
            }
            let (values, downweighted_rows_per_joint) =
                self.pseudo_values(loss, &residuals, &scalings);
            let pseudo = Self::from_dense(self.matrix().clone(), values)?
                .with_known(self.known_torque().cloned());
            let solution = pseudo.solve_weighted(noise_levels)?;
            let change = self.matrix().times_parameters(&(&solution.parameters - &parameters));
            let still = |(joint, scaling): (usize, &Scaling)| {
                self.joint_of(&change, joint).norm() <= CHANGE_TOLERANCE * scaling.scale
            };
            if scalings.iter().enumerate().all(still) {
                let mut scaled_residuals = residuals;
                for (joint, scaling) in scalings.iter().enumerate() {
                    scaled_residuals
                        .rows_range_mut(self.joint_rows(joint))
                        .unscale_mut(scaling.scale);
                }
                return Ok(RobustSolution {
                    pseudo_equation: pseudo,
                    solution,
                    downweighted_rows_per_joint,
                    scaled_residuals,
                });
            }
            parameters = solution.parameters;
        }
        Err(RegressionError::NotSettled { steps: MAX_STEPS })
    }

    /// Returns the scale s_j and the factor K_j/m_j for the residuals of a joint.
    fn joint_scaling(
        &self,
        loss: RobustLoss,
        joint: usize,
        residuals: &DVector<f64>,
    ) -> Result<Scaling, RegressionError> {
        if !self.matrix().has_equation(joint) {
            return Ok(Scaling { scale: 1.0, factor: 1.0 });
        }
        let own_rows = self.joint_of(residuals, joint);
        let rows = self.rows_per_joint() as f64;
        let measured = self.joint_of(self.measurements(), joint).norm() / rows.sqrt();
        let median = median(own_rows.iter().map(|r| r.abs()).collect()).unwrap_or(0.0);
        let scale = (median / NORMAL_MAD).max(ROUNDING_SHARE * measured);
        let slopes = own_rows.iter().map(|r| loss.weight_and_slope(r / scale).1);
        let mean = slopes.clone().sum::<f64>() / rows;
        if mean < RegressionLimits::DEFAULT.min_slope {
            return Err(RegressionError::NotSettled { steps: 0 });
        }
        let variance = slopes.map(|slope| (slope - mean).powi(2)).sum::<f64>() / rows;
        let parameters = self.parameters_per_joint();
        let correction = 1.0 + parameters / rows * variance / (mean * mean);
        Ok(Scaling { scale, factor: correction / mean })
    }

    /// Returns the pseudo-values y* for these residuals, and the number of downweighted rows of
    /// each joint.
    fn pseudo_values(
        &self,
        loss: RobustLoss,
        residuals: &DVector<f64>,
        scalings: &[Scaling],
    ) -> (DVector<f64>, Vec<usize>) {
        let mut values = self.measurements() - residuals;
        let mut downweighted = vec![0; self.joints()];
        for (joint, Scaling { scale, factor }) in scalings.iter().enumerate() {
            for row in self.joint_rows(joint) {
                let (weight, _) = loss.weight_and_slope(residuals[row] / scale);
                values[row] += factor * weight * residuals[row];
                downweighted[joint] += usize::from(loss.weighs_down(residuals[row] / scale));
            }
        }
        (values, downweighted)
    }
}

/// Scaling from the residuals of a joint to pseudo-values.
struct Scaling {
    /// Scale s_j.
    scale: f64,
    /// Factor K_j/m_j.
    factor: f64,
}
