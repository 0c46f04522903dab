//! Consistent standard parameters from an estimate.

use nalgebra::{DMatrix, DVector};

use super::assumptions::PriorAssumptions;
use super::block::Block;
use super::body::Body;
use super::drives::DriveBlocks;
use super::error::FeasibilityError;
use super::estimate::{Estimate, Rows};
use super::judgement::{FeasibilityLimits, Judgement, Shift, negative_parameters, threshold};
use super::newton::{Minimum, WEIGHT_REDUCTION};
use super::outcome::{Outcome, StandardParameter, ValueSource};
use super::posterior::Posterior;
use super::prior::Prior;
use super::problem::{Point, Problem, divergence};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};

/// Weight λ at which the cost is within λ ν, about one nat, of the smallest cost of any bodies.
const NEGLIGIBLE_WEIGHT: f64 = 0.03;

/// Returns the physically consistent standard parameters of `robot` that agree best with a prior
/// and an estimate of its base parameters. They are the minimum of F = J + λ (Σ D(P‖P⁰) + Σ
/// d(s‖s⁰)).
///
/// J is ‖R(Bθ − β̂)‖² with Rᵀ R the inverse of the covariance. D is tr(P⁰⁻¹P) − ln det(P⁰⁻¹P) − 4
/// of each link's pseudo-inertia. d is the same for drive inertias, viscous and Coulomb friction.
/// Offsets and all other friction terms of a joint are free. `weight` is λ; see
/// [`Prior::default_weight`].
///
/// # Errors
/// [`FeasibilityError`]. A minimum that is not reached is an error, never an outcome.
pub fn fit_consistent(
    robot: &Robot,
    base: &BaseParameters,
    estimate: &Estimate<'_>,
    prior: &Prior,
    weight: f64,
    limits: &FeasibilityLimits,
) -> Result<Outcome, FeasibilityError> {
    if !(weight.is_finite() && weight > 0.0) {
        return Err(FeasibilityError::Weight { found: weight });
    }
    let table = robot.parameters();
    let fits = |(name, &column): (&String, &usize)| table.find(name) == Some(column);
    if base.regrouping().ncols() != table.names().len()
        || !base.names().iter().zip(base.columns()).all(fits)
    {
        return Err(FeasibilityError::OtherBaseParameters { robot: robot.name().to_owned() });
    }
    let (found, expected) = (prior.link_bodies().len(), robot.joints());
    if found != expected {
        return Err(FeasibilityError::OtherPrior { found, expected });
    }
    let rows = Rows::new(base, table.parameters(), estimate)?;
    let problem = build_problem(robot, &rows, prior)?;

    let minimum = problem.minimise(weight)?;
    let threshold = threshold(rows.names.len(), limits);
    let (nearest, further) = nearest_bodies(&problem, &minimum, weight, threshold)?;
    let not_converged = FeasibilityError::NotConverged { iterations: minimum.steps, weight };
    let posterior = Posterior::new(&minimum, weight).ok_or(not_converged)?;

    let values = problem.parameters(&minimum.point);
    let parameters = table.names().iter().enumerate().map(|(column, name)| StandardParameter {
        name: name.clone(),
        value: values[column],
        deviation: posterior.deviations[column],
        class: column_class(&rows, column),
        share_of_data: posterior.data_shares[column],
    });
    let factors = &minimum.point.factors;
    let divergences: Vec<f64> = factors.iter().map(divergence).collect();
    let (of_links, of_drives) = divergences.split_at(robot.joints());
    let eigenvalue =
        |factor: &DMatrix<f64>| (factor * factor.transpose()).symmetric_eigenvalues().min();
    // Near the prior, D is half the squared relative change, and λ = 2/s².
    let prior_distances: Vec<f64> = of_links.iter().map(|own| weight * own).collect();
    let least_cost = problem.cost(&nearest);
    let least_shifts = row_shifts(&rows, &problem.parameters(&nearest));
    Ok(Outcome {
        parameters: parameters.collect(),
        link_bodies: (0..robot.joints()).map(|link| body_of_link(robot, link, &values)).collect(),
        smallest_eigenvalues: factors.iter().take(robot.joints()).map(eigenvalue).collect(),
        prior: prior.source(),
        weight,
        objective: problem.objective(&minimum.point, weight),
        cost: problem.cost(&minimum.point),
        least_cost,
        threshold,
        divergence_per_link: of_links.to_vec(),
        divergence_of_drives: of_drives.iter().sum(),
        effective_parameters: posterior.effective_parameters,
        negative_parameters: negative_parameters(&rows, table.parameters(), limits),
        judgement: Judgement::new((least_cost, threshold), &least_shifts, &prior_distances, limits),
        shifts: row_shifts(&rows, &values),
        steps: minimum.steps + further,
    })
}

/// Returns the shift of each row from the estimate to these standard parameters.
fn row_shifts(rows: &Rows, values: &DVector<f64>) -> Vec<Shift> {
    let predicted = &rows.regrouping * values - &rows.values;
    let shift = |(row, name): (usize, &String)| Shift {
        name: name.clone(),
        deviations: predicted[row] / rows.deviation(row),
    };
    rows.names.iter().enumerate().map(shift).collect()
}

/// Finds the bodies nearest to the estimate by reducing the weight. Returns them and the number of
/// steps. Since J ≤ F, bodies that explain the estimate at a distance D from the prior reduce J at
/// λ below χ² + λ D. If J exceeds this bound for every permitted D, no smaller weight leads to such
/// bodies, and the search ends. At smaller weights the minima for estimates far from any body are
/// hard to reach.
fn nearest_bodies(
    problem: &Problem,
    minimum: &Minimum,
    weight: f64,
    threshold: f64,
) -> Result<(Point, usize), FeasibilityError> {
    let (mut at, mut point, mut steps) = (weight, minimum.point.clone(), 0);
    loop {
        if at <= NEGLIGIBLE_WEIGHT
            || problem.cost(&point) > threshold + PriorAssumptions::DEFAULT.max_divergence * at
        {
            return Ok((point, steps));
        }
        at = NEGLIGIBLE_WEIGHT.max(at / WEIGHT_REDUCTION);
        let next = problem.minimise_with_weight(at, at, point)?;
        steps += next.steps;
        point = next.point;
    }
}

/// Returns the ten columns of a link, which are consecutive.
fn columns(robot: &Robot, link: usize) -> [usize; 10] {
    let first =
        robot.parameters().column(ParameterKind::LINK[0], JointIndex::new(link)).unwrap_or(0);
    core::array::from_fn(|k| first + k)
}

fn body_of_link(robot: &Robot, link: usize, values: &DVector<f64>) -> Body {
    Body::from_parameters(columns(robot, link).map(|column| values[column]))
}

/// Returns the source of a parameter's value. In the columns of the base parameters, the regrouping
/// matrix is the identity. So the data alone decide only parameters that are base parameters by
/// themselves.
pub(super) fn column_class(rows: &Rows, column: usize) -> ValueSource {
    if rows.absent_columns.contains(&column) {
        ValueSource::Absent
    } else if rows.regrouping.column(column).amax() <= 0.0 {
        ValueSource::Prior
    } else if rows.row_of(column).is_some_and(|row| rows.is_alone(row)) {
        ValueSource::Data
    } else {
        ValueSource::Combination
    }
}

pub(super) fn build_problem(
    robot: &Robot,
    rows: &Rows,
    prior: &Prior,
) -> Result<Problem, FeasibilityError> {
    let table = robot.parameters();
    let mut blocks = Vec::new();
    for (link, body) in prior.link_bodies().iter().enumerate() {
        let block = Block::link(columns(robot, link), body);
        blocks.push(block.ok_or(FeasibilityError::NominalIsNoBody { link: link + 1 })?);
    }
    blocks.extend(DriveBlocks { robot, rows, prior }.positive_blocks()?);
    let is_free = |kind: ParameterKind| kind == ParameterKind::Off || kind.is_friction_law();
    let free = (table.parameters().iter().enumerate())
        .filter(|(column, parameter)| is_free(parameter.kind) && rows.row_of(*column).is_some())
        .map(|(column, _)| column)
        .collect();
    let whitened = Problem::whiten(&rows.regrouping, &rows.values, &rows.covariance);
    let (whitened, target) = whitened.ok_or(FeasibilityError::Covariance)?;
    Ok(Problem { blocks, free_columns: free, whitened_columns: whitened, target })
}
