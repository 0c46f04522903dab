//! Accuracy of each standard parameter from data and prior together.

use nalgebra::DMatrix;

use super::newton::Minimum;

/// Posterior distribution from the quadratic approximation of F at its minimum. F/2 ≈ ½ δᵀ H δ is
/// taken as the negative logarithm of a probability density.
pub(super) struct Posterior {
    /// Standard deviation √Var(θ; H⁻¹) of each standard parameter.
    pub(super) deviations: Vec<f64>,
    /// Share of the prior's variance that the data remove, 1 − Var(θ; H⁻¹) / Var(θ; prior); 0 for
    /// fixed parameters.
    pub(super) data_shares: Vec<f64>,
    /// Effective number of parameters that the data determine, tr(H⁻¹ ÃᵀÃ).
    pub(super) effective_parameters: f64,
}

impl Posterior {
    /// Computes the posterior at a minimum. Returns `None` if the data do not determine a free
    /// parameter.
    pub(super) fn new(minimum: &Minimum, weight: f64) -> Option<Self> {
        let (local, n) = (&minimum.local_problem, minimum.hessian_root.ncols());
        let barrier = local.prior_gradient.len();
        let inverse = minimum.hessian_root.solve_upper_triangular(&DMatrix::identity(n, n))?;
        // H = ½ RᵀR. The prior contributes ½ λ 1 to H.
        let by_prior = 2.0 / weight;
        let spread = &local.parameters * &inverse;
        let (deviations, shares) = (0..local.parameters.nrows())
            .map(|column: usize| {
                let variance = 2.0 * spread.row(column).norm_squared();
                let before =
                    if local.parameters.row(column).columns(barrier, n - barrier).amax() > 0.0 {
                        f64::INFINITY
                    } else {
                        by_prior * local.parameters.row(column).columns(0, barrier).norm_squared()
                    };
                let share = if before > 0.0 { (1.0 - variance / before).max(0.0) } else { 0.0 };
                (variance.sqrt(), share)
            })
            .unzip();
        let of_prior = weight * inverse.rows(0, barrier).norm_squared();
        Some(Self { deviations, data_shares: shares, effective_parameters: n as f64 - of_prior })
    }
}
