//! Minimisation problem of one estimate: its positive definite matrices, its free parameters and
//! its base-parameter rows.

use nalgebra::{DMatrix, DVector};

use super::block::{Block, congruence_map, matrix, symmetric_vector};

/// Minimisation problem. Standard parameters are sums of the contributions of the blocks and of the
/// free parameters. The objective is J + λ Σ D.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    /// Positive definite blocks, those of the links first.
    pub(super) blocks: Vec<Block>,
    /// Columns of the free parameters, which have no constraint.
    pub(super) free_columns: Vec<usize>,
    /// R B, with Rᵀ R the inverse of the covariance (b × p).
    pub(super) whitened_columns: DMatrix<f64>,
    /// Whitened values R β̂.
    pub(super) target: DVector<f64>,
}

/// Current point of the minimisation.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// Factor L of each block, with P = L⁰ L Lᵀ L⁰ᵀ: the block relative to its prior.
    pub(super) factors: Vec<DMatrix<f64>>,
    /// Value of each free parameter.
    pub(super) free_values: DVector<f64>,
}

/// Problem linearised about a point, in local coordinates. The coordinates of a block have unit
/// length relative to the block itself. The coordinates of the free parameters follow.
#[derive(Debug)]
pub(super) struct LocalProblem {
    /// Derivatives of the standard parameters with respect to the coordinates, p × N.
    pub(super) parameters: DMatrix<f64>,
    /// Whitened residual R(Bθ − β̂).
    pub(super) residual: DVector<f64>,
    /// R B times these derivatives, b × N.
    pub(super) jacobian: DMatrix<f64>,
    /// Gradient of Σ D with respect to the coordinates of the blocks.
    pub(super) prior_gradient: DVector<f64>,
    /// Map of each block from its coordinates to svec(Y), δP = M Y Mᵀ.
    tangents: Vec<DMatrix<f64>>,
}

impl Problem {
    /// Returns R B and R β̂ for a covariance; `None` if it is not positive definite.
    pub(super) fn whiten(
        regrouping: &DMatrix<f64>,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        // Scales to correlations, because units differ by orders of magnitude.
        let deviations = covariance.diagonal().map(f64::sqrt);
        let scaled = |i: usize, j: usize| covariance[(i, j)] / (deviations[i] * deviations[j]);
        let correlation = DMatrix::from_fn(values.len(), values.len(), scaled);
        let factor = correlation.cholesky()?.unpack();
        let rows = DMatrix::from_fn(regrouping.nrows(), regrouping.ncols(), |i, j| {
            regrouping[(i, j)] / deviations[i]
        });
        let target = values.component_div(&deviations);
        let (rows, target) =
            (factor.solve_lower_triangular(&rows)?, factor.solve_lower_triangular(&target)?);
        let finite = rows.iter().chain(target.iter()).all(|entry| entry.is_finite());
        finite.then_some((rows, target))
    }

    /// Returns the prior as a point, with free parameters at 0.
    pub(super) fn start(&self) -> Point {
        let identity = |block: &Block| DMatrix::identity(block.size(), block.size());
        Point {
            factors: self.blocks.iter().map(identity).collect(),
            free_values: DVector::zeros(self.free_columns.len()),
        }
    }

    /// Returns the barrier parameter ν: the cost of a barrier relative to its weight.
    pub(super) fn barrier_parameter(&self) -> f64 {
        self.blocks.iter().map(|block| block.size() as f64).sum()
    }

    /// Returns the standard parameters at a point; 0 for parameters without a contribution.
    pub(super) fn parameters(&self, point: &Point) -> DVector<f64> {
        let mut parameters = DVector::zeros(self.whitened_columns.ncols());
        for (block, factor) in self.blocks.iter().zip(&point.factors) {
            let m = &block.prior * factor;
            let added = &block.parameter_map * symmetric_vector(&(&m * m.transpose()));
            for (&column, added) in block.columns.iter().zip(added.iter()) {
                parameters[column] += added;
            }
        }
        for (&column, value) in self.free_columns.iter().zip(point.free_values.iter()) {
            parameters[column] += value;
        }
        parameters
    }

    fn residual(&self, point: &Point) -> DVector<f64> {
        &self.whitened_columns * self.parameters(point) - &self.target
    }

    /// Returns the cost J.
    pub(super) fn cost(&self, point: &Point) -> f64 {
        self.residual(point).norm_squared()
    }

    /// Returns J + λ Σ D.
    pub(super) fn objective(&self, point: &Point, weight: f64) -> f64 {
        self.cost(point) + weight * point.factors.iter().map(divergence).sum::<f64>()
    }

    /// Returns the problem linearised about a point; `None` if the point is too close to the
    /// boundary.
    pub(super) fn linearise_about(&self, point: &Point) -> Option<LocalProblem> {
        let (mut columns, mut pull, mut tangents) = (Vec::new(), Vec::new(), Vec::new());
        for (block, factor) in self.blocks.iter().zip(&point.factors) {
            let m = &block.prior * factor;
            let tangent = block.tangent(&m)?;
            let change = &block.parameter_map * (congruence_map(&m) * &tangent);
            for column in change.column_iter() {
                let mut parameters = DVector::zeros(self.whitened_columns.ncols());
                for (&at, change) in block.columns.iter().zip(column.iter()) {
                    parameters[at] += change;
                }
                columns.push(parameters);
            }
            let deviation = factor.tr_mul(factor) - DMatrix::identity(block.size(), block.size());
            pull.extend(tangent.tr_mul(&symmetric_vector(&deviation)).iter().copied());
            tangents.push(tangent);
        }
        for &at in &self.free_columns {
            let mut parameters = DVector::zeros(self.whitened_columns.ncols());
            parameters[at] = 1.0;
            columns.push(parameters);
        }
        let parameters = DMatrix::from_columns(&columns);
        Some(LocalProblem {
            jacobian: &self.whitened_columns * &parameters,
            parameters,
            residual: self.residual(point),
            prior_gradient: DVector::from_vec(pull),
            tangents,
        })
    }
}

impl LocalProblem {
    /// Returns the change Y = L⁻¹ δQ L⁻ᵀ of each block due to a step of the coordinates.
    pub(super) fn block_changes(
        &self,
        step: &DVector<f64>,
        problem: &Problem,
    ) -> Vec<DMatrix<f64>> {
        let mut offset = 0;
        let changes = problem.blocks.iter().zip(&self.tangents).map(|(block, tangent)| {
            let block_step = step.rows(offset, tangent.ncols());
            offset += tangent.ncols();
            matrix(&(tangent * block_step), block.size())
        });
        changes.collect()
    }
}

/// Returns D = tr(Q) − ln det(Q) − n for Q = L Lᵀ.
pub(super) fn divergence(factor: &DMatrix<f64>) -> f64 {
    let logarithm: f64 = factor.diagonal().iter().map(|entry| entry.ln()).sum();
    factor.norm_squared() - 2.0 * logarithm - factor.nrows() as f64
}
