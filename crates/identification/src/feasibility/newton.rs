//! Damped Newton steps in local coordinates. The weight of the prior falls to the requested one.
//!
//! F is convex. In coordinates that are relative to a block, its curvature is that of a sum of
//! squares, so a Newton step is one linear least-squares problem. With Q = L Lᵀ and a step L Y Lᵀ,
//! the update L ← L chol(1 + aY) keeps Q positive definite.

use nalgebra::{DMatrix, DVector};

use super::block::factor;
use super::error::FeasibilityError;
use super::problem::{LocalProblem, Point, Problem};

/// Half the squared Newton decrement at which a minimum counts as reached, relative to 1 + F.
const DECREMENT_TOLERANCE: f64 = 1e-12;
/// Tolerance at larger weights than the requested one, relative to λ.
const CENTRING_TOLERANCE: f64 = 0.1;
/// Factor by which the weight is reduced in each stage.
pub(super) const WEIGHT_REDUCTION: f64 = 4.0;
/// Largest part of the distance to the boundary that a step may take.
const BOUNDARY_SHARE: f64 = 0.95;
/// Smallest decrease as a part of the expected one that a step has to achieve (Armijo).
const ARMIJO_SHARE: f64 = 1e-4;
/// Largest number of halvings before a step counts as failed.
const MAX_HALVINGS: usize = 40;
/// Largest number of Newton steps; the hardest known cases take 130.
const MAX_STEPS: usize = 400;

/// Minimum of F, and the problem around it.
#[derive(Debug)]
pub(super) struct Minimum {
    pub(super) point: Point,
    pub(super) local_problem: LocalProblem,
    /// Factor R with Rᵀ R equal to F's second derivative in the local coordinates.
    pub(super) hessian_root: DMatrix<f64>,
    /// Number of Newton steps.
    pub(super) steps: usize,
}

/// A Newton step.
struct NewtonStep {
    coordinates: DVector<f64>,
    hessian_root: DMatrix<f64>,
    /// Squared Newton decrement: twice the decrease of the quadratic approximation.
    decrement: f64,
}

impl Problem {
    /// Minimises F with this weight, starting from the prior.
    ///
    /// # Errors
    /// [`FeasibilityError::NotConverged`].
    pub(super) fn minimise(&self, weight: f64) -> Result<Minimum, FeasibilityError> {
        let start = self.start();
        let first = self.cost(&start) / self.barrier_parameter();
        self.minimise_with_weight(weight, first.max(weight), start)
    }

    /// Minimises F with this weight, starting near the minimum with a larger weight.
    ///
    /// # Errors
    /// [`FeasibilityError::NotConverged`].
    pub(super) fn minimise_with_weight(
        &self,
        weight: f64,
        from: f64,
        start: Point,
    ) -> Result<Minimum, FeasibilityError> {
        let (mut at, mut point, mut steps) = (from, start, 0);
        loop {
            let not_converged = FeasibilityError::NotConverged { iterations: steps, weight: at };
            let Some(local) = self.linearise_about(&point) else { return Err(not_converged) };
            let Some(step) = local.step(at) else { return Err(not_converged) };
            let objective = self.objective(&point, at);
            let rounding =
                8.0 * f64::EPSILON * (1.0 + self.target.norm()) * (1.0 + objective).sqrt();
            let remaining = 0.5 * step.decrement;
            if at <= weight && remaining <= DECREMENT_TOLERANCE * (1.0 + objective) + rounding {
                return Ok(Minimum {
                    point,
                    local_problem: local,
                    hessian_root: step.hessian_root,
                    steps,
                });
            }
            if at > weight && remaining <= CENTRING_TOLERANCE * at {
                at = weight.max(at / WEIGHT_REDUCTION);
                continue;
            }
            let bound = objective + rounding;
            match self.descend(&point, &local, &step, at, bound) {
                Some(next) if steps < MAX_STEPS => point = next,
                _ => return Err(not_converged),
            }
            steps += 1;
        }
    }

    /// Takes the longest tried part of a step that decreases F enough.
    fn descend(
        &self,
        point: &Point,
        local: &LocalProblem,
        step: &NewtonStep,
        weight: f64,
        objective: f64,
    ) -> Option<Point> {
        let changes = local.block_changes(&step.coordinates, self);
        let free = step.coordinates.rows(local.prior_gradient.len(), self.free_columns.len());
        let least = |change: &DMatrix<f64>| change.symmetric_eigenvalues().min();
        let inward = changes.iter().map(least).fold(0.0, f64::min);
        let mut part = if inward < 0.0 { (-BOUNDARY_SHARE / inward).min(1.0) } else { 1.0 };
        for _ in 0..MAX_HALVINGS {
            let next_factors = point.factors.iter().zip(&changes).map(|(own, change)| {
                let n = own.nrows();
                Some(own * factor(&(DMatrix::identity(n, n) + change * part))?)
            });
            if let Some(factors) = next_factors.collect::<Option<Vec<_>>>() {
                let next = Point { factors, free_values: &point.free_values + free * part };
                if self.objective(&next, weight) <= objective - ARMIJO_SHARE * part * step.decrement
                {
                    return Some(next);
                }
            }
            part *= 0.5;
        }
        None
    }
}

impl LocalProblem {
    /// Returns the minimum of ‖\[√2 A; √λ 1\] y + \[√2 r; √λ g\]‖, whose square has the second
    /// derivative of F. Free parameters have no rows in the lower part.
    fn step(&self, weight: f64) -> Option<NewtonStep> {
        let (rows, n) = self.jacobian.shape();
        let barrier = self.prior_gradient.len();
        let (data, prior) = (core::f64::consts::SQRT_2, weight.sqrt());
        let mut system = DMatrix::zeros(rows + barrier, n);
        system.rows_mut(0, rows).copy_from(&(&self.jacobian * data));
        for k in 0..barrier {
            system[(rows + k, k)] = prior;
        }
        let mut right = DVector::zeros(rows + barrier);
        right.rows_mut(0, rows).copy_from(&(&self.residual * data));
        right.rows_mut(rows, barrier).copy_from(&(&self.prior_gradient * prior));

        if system.nrows() < n {
            return None;
        }
        let qr = system.qr();
        qr.q_tr_mul(&mut right);
        let projected = right.rows(0, n).into_owned();
        let triangle = qr.r();
        let coordinates = -triangle.solve_upper_triangular(&projected)?;
        let decrement = projected.norm_squared();
        let finite = decrement.is_finite() && coordinates.iter().all(|y| y.is_finite());
        finite.then_some(NewtonStep { coordinates, hessian_root: triangle, decrement })
    }
}
