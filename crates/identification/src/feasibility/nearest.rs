//! Physically consistent body that agrees best with an estimate of its ten parameters, or of sums
//! of them.

use nalgebra::{DMatrix, DVector, Vector3};

use super::assumptions::PriorAssumptions;
use super::block::Block;
use super::body::Body;
use super::error::FeasibilityError;
use super::problem::{Problem, divergence};

/// Physically consistent body near an estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestBody {
    /// The body, P ≻ 0.
    pub body: Body,
    /// Cost J: the squared distance from the estimate in the metric of its covariance.
    pub cost: f64,
    /// Divergence D from the ball that determines the values which the estimate leaves undetermined
    /// \[nats\].
    pub divergence: f64,
}

/// Returns the body that minimises J + λ D, as [`fit_consistent`](super::fit_consistent) does for
/// all links together. J is the squared distance between `values` (k) and `regrouping` (k × 10)
/// times the body's parameters, in the metric of the covariance (k × k). D is the divergence from a
/// homogeneous ball of 2000 kg/m³ with the given mass \[kg\] at the given centre \[m\]. λ is 2.
/// # Errors
/// [`FeasibilityError::LoadMass`], [`FeasibilityError::Covariance`] and
/// [`FeasibilityError::NotConverged`].
pub fn nearest_body(
    regrouping: &DMatrix<f64>,
    values: &DVector<f64>,
    covariance: &DMatrix<f64>,
    mass_kg: f64,
    centre_m: Vector3<f64>,
) -> Result<NearestBody, FeasibilityError> {
    let radius =
        (0.75 * mass_kg / (core::f64::consts::PI * PriorAssumptions::DEFAULT.density_kg_m3)).cbrt();
    let ball = Body::ball(mass_kg, radius, centre_m);
    let block = Block::link(core::array::from_fn(|k| k), &ball);
    let block = block.ok_or(FeasibilityError::LoadMass { found: mass_kg })?;
    let (whitened, target) =
        Problem::whiten(regrouping, values, covariance).ok_or(FeasibilityError::Covariance)?;
    let problem = Problem {
        blocks: vec![block],
        free_columns: Vec::new(),
        whitened_columns: whitened,
        target,
    };
    let point = problem.minimise(PriorAssumptions::DEFAULT.geometric_weight)?.point;
    let body = problem.parameters(&point);
    Ok(NearestBody {
        body: Body::from_parameters(core::array::from_fn(|k| body[k])),
        cost: problem.cost(&point),
        divergence: point.factors.iter().map(divergence).sum(),
    })
}
