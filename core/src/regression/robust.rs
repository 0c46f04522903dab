//! Least squares that a few rows cannot mislead: M-estimates (Huber & Ronchetti, *Robust
//! Statistics*, 2nd edition, chapter 7).

use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

use super::error::RegressionError;
use super::observations::Observations;
use super::solution::Solution;
use crate::numeric::median;

/// How much of a large residual counts, with its tuning constant in standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RobustLoss {
    /// `ψ(u) = u`, and no more than ± the tuning constant (Huber, *Ann. Math. Statist.* 35, 1964).
    Huber {
        /// 1.345 unless stated: of normal errors, the estimate has 95 % of the efficiency of least
        /// squares.
        #[serde(default = "RobustLoss::huber_tuning")]
        tuning: f64,
    },
    /// `ψ(u) = u (1 − (u/c)²)²`, and 0 beyond c (Beaton & Tukey, *Technometrics* 16, 1974).
    Bisquare {
        /// 4.685 unless stated, for the same efficiency.
        #[serde(default = "RobustLoss::bisquare_tuning")]
        tuning: f64,
    },
}

/// The median of |u| of a standard normal u.
const NORMAL_MAD: f64 = 0.674_489_750_196_081_7;

/// A row counts as weighted down when less than this share of its residual is left.
const DOWNWEIGHTED: f64 = 0.5;

/// Residuals of this share of the measurements are rounding, and none of them is an outlier.
const ROUNDING: f64 = 1e-7;

/// With a smaller mean slope of ψ the rows that are left say nothing for sure; of normal errors and
/// the usual tuning it is 0.82 (Huber) and 0.76 (bisquare).
const LEAST_SLOPE: f64 = 0.2;

/// Parameters stand still where they change the equation of no joint by more than this share of its
/// scale, which is no more of any standard deviation.
const STANDSTILL: f64 = 1e-6;

/// Steps allowed; some twenty are usual.
const MAX_STEPS: usize = 200;

/// Scales and slopes follow the residuals so many steps, and stay as they are then: one row more or
/// less on the other side of a corner may lead round in circles.
const RESCALED_STEPS: usize = 30;

impl RobustLoss {
    fn huber_tuning() -> f64 {
        1.345
    }

    fn bisquare_tuning() -> f64 {
        4.685
    }

    /// Huber's with the usual tuning.
    pub fn huber() -> Self {
        Self::Huber { tuning: Self::huber_tuning() }
    }

    /// Tukey's bisquare with the usual tuning.
    pub fn bisquare() -> Self {
        Self::Bisquare { tuning: Self::bisquare_tuning() }
    }

    fn tuning(self) -> f64 {
        match self {
            Self::Huber { tuning } | Self::Bisquare { tuning } => tuning,
        }
    }

    /// Whether the tuning constant makes an M-estimate; an infinite one makes least squares.
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

    /// Whether less than a half of a residual of u scales counts.
    pub fn weighs_down(self, u: f64) -> bool {
        self.weight_and_slope(u).0 < DOWNWEIGHTED
    }

    /// The share of normal errors that is weighted down.
    pub fn normal_share_weighed_down(self) -> f64 {
        // ψ(u)/u = 1/2, solved for |u|.
        let half = match self {
            Self::Huber { tuning } => tuning / DOWNWEIGHTED,
            Self::Bisquare { tuning } => tuning * (1.0 - DOWNWEIGHTED.sqrt()).sqrt(),
        };
        2.0 * Normal::standard().sf(half)
    }

    /// ψ(u)/u and ψ′(u).
    fn weight_and_slope(self, u: f64) -> (f64, f64) {
        let share = u.abs() / self.tuning();
        match self {
            Self::Huber { .. } if share <= 1.0 => (1.0, 1.0),
            Self::Huber { .. } => (1.0 / share, 0.0),
            Self::Bisquare { .. } if share <= 1.0 => {
                let left = 1.0 - share * share;
                (left * left, left * (1.0 - 5.0 * share * share))
            }
            Self::Bisquare { .. } => (0.0, 0.0),
        }
    }
}

/// An M-estimate, as the least squares solution that it is of other measurements.
///
/// With residuals ρ, scale s_j and the mean slope m_j of ψ over the rows of a joint, the estimate
/// solves `Σ_j X_jᵀ ψ(ρ_j/s_j) s_j/(m_j σ_j²) = 0`: weighted least squares of the **pseudo-values**
/// `y* = Xθ + K s ψ(ρ/s)/m` on X. To first order, y* moves the estimate as y does. So the covariance
/// of that least squares solution is that of the estimate, `s² E[ψ²]/E[ψ′]² (XᵀX)⁻¹` for independent
/// rows (Huber & Ronchetti, section 7.6, with their `K = 1 + b/N · var(ψ′)/E[ψ′]²`), and what corrects
/// the one for the colour of its residuals corrects the other.
#[derive(Clone, Debug, PartialEq)]
pub struct RobustSolution {
    /// The equation with the pseudo-values for measurements.
    pub pseudo: Observations,
    /// Its weighted solution.
    pub solution: Solution,
    /// Rows of each joint of whose residual less than a half counts; of normal errors one in a
    /// hundred.
    pub downweighted_rows_per_joint: Vec<usize>,
    /// ρ/s of every row.
    pub scaled_residuals: DVector<f64>,
}

impl Observations {
    /// The M-estimate with one noise level σ_j per joint, which weights the joints as in
    /// [`weighted`](Self::weighted). The scale s_j of a joint's residuals is their median absolute
    /// value over 0.6745, which a few large ones do not move.
    ///
    /// # Errors
    /// As [`weighted`](Self::weighted), [`Tuning`](RegressionError::Tuning) and
    /// [`NotSettled`](RegressionError::NotSettled).
    pub fn robust(
        &self,
        loss: RobustLoss,
        noise_levels: &[f64],
    ) -> Result<RobustSolution, RegressionError> {
        loss.validate()?;
        let first = self.weighted(noise_levels)?.parameters;
        match loss {
            RobustLoss::Huber { .. } => self.settled(loss, noise_levels, first),
            // Its criterion has several minima: the one next to Huber's, which has one.
            RobustLoss::Bisquare { .. } => {
                let near = self.settled(RobustLoss::huber(), noise_levels, first)?;
                self.settled(loss, noise_levels, near.solution.parameters)
            }
        }
    }

    /// Noise levels that a few rows cannot raise: those of the M-estimate without weights.
    ///
    /// # Errors
    /// As [`robust`](Self::robust).
    pub fn robust_noise_levels(&self, loss: RobustLoss) -> Result<Vec<f64>, RegressionError> {
        let found = self.robust(loss, &vec![1.0; self.joints()])?;
        Ok(found.pseudo.noise_levels(&found.solution.residuals))
    }

    /// Pseudo-values and least squares in turn, until the parameters stand still.
    fn settled(
        &self,
        loss: RobustLoss,
        noise_levels: &[f64],
        mut parameters: DVector<f64>,
    ) -> Result<RobustSolution, RegressionError> {
        let mut scalings = Vec::new();
        for step in 0..MAX_STEPS {
            let residuals = self.residuals(&parameters);
            if step < RESCALED_STEPS {
                let joints = (0..self.joints()).map(|joint| self.scaling(loss, joint, &residuals));
                scalings = joints.collect::<Result<_, _>>()?;
            }
            let (values, downweighted_rows_per_joint) =
                self.pseudo_values(loss, &residuals, &scalings);
            let pseudo = Self::of(self.matrix().clone(), values)?.with_known(self.known().cloned());
            let solution = pseudo.weighted(noise_levels)?;
            let change = self.matrix().times(&(&solution.parameters - &parameters));
            let still = |(joint, scaling): (usize, &Scaling)| {
                self.joint_of(&change, joint).norm() <= STANDSTILL * scaling.scale
            };
            if scalings.iter().enumerate().all(still) {
                let mut scaled_residuals = residuals;
                for (joint, scaling) in scalings.iter().enumerate() {
                    scaled_residuals
                        .rows_range_mut(self.joint_rows(joint))
                        .unscale_mut(scaling.scale);
                }
                return Ok(RobustSolution {
                    pseudo,
                    solution,
                    downweighted_rows_per_joint,
                    scaled_residuals,
                });
            }
            parameters = solution.parameters;
        }
        Err(RegressionError::NotSettled { steps: MAX_STEPS })
    }

    /// s_j and K_j/m_j of residuals.
    fn scaling(
        &self,
        loss: RobustLoss,
        joint: usize,
        residuals: &DVector<f64>,
    ) -> Result<Scaling, RegressionError> {
        let own = self.joint_of(residuals, joint);
        let rows = self.rows_per_joint() as f64;
        let measured = self.joint_of(self.measurements(), joint).norm() / rows.sqrt();
        let median = median(own.iter().map(|r| r.abs()).collect()).unwrap_or(0.0);
        let scale = (median / NORMAL_MAD).max(ROUNDING * measured);
        let slopes = own.iter().map(|r| loss.weight_and_slope(r / scale).1);
        let mean = slopes.clone().sum::<f64>() / rows;
        if mean < LEAST_SLOPE {
            return Err(RegressionError::NotSettled { steps: 0 });
        }
        let variance = slopes.map(|slope| (slope - mean).powi(2)).sum::<f64>() / rows;
        let parameters = self.matrix().ncols() as f64 / self.joints() as f64;
        let correction = 1.0 + parameters / rows * variance / (mean * mean);
        Ok(Scaling { scale, factor: correction / mean })
    }

    /// y* with these residuals, and the rows of each joint that are weighted down.
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

/// What makes pseudo-values of the residuals of a joint.
struct Scaling {
    /// s_j.
    scale: f64,
    /// K_j/m_j.
    factor: f64,
}
