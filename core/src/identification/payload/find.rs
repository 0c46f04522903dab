//! The load from what a record leaves of the torques.

use nalgebra::{DMatrix, DVector, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::equation::LoadSums;
use super::error::PayloadError;
use super::load::{Declared, Load, LoadBody, LoadParameter, Payload, Presence, Uncertain};
use crate::dynamics::BaseParameters;
use crate::feasibility::{Body, nearest_body};
use crate::identification::given::{Context, Experiment, Options};
use crate::identification::judgement::ParameterCovariance;
use crate::identification::observation::{
    filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::prediction::{KnownModel, PredictionError};
use crate::regression::{Observations, ResidualAnalysis};
use crate::robot::{ParameterKind, Robot};

/// The load on the last link of an arm whose base parameters β̂ and their covariance C (of `model.parameters`, in their order) are
/// known, from a record of the arm that carries it:
///
/// ```text
/// y − X β̂ = X δβ + Z φ + ε,   δβ ~ N(0, C),   Z = X K
/// ```
///
/// K regroups the ten parameters φ of the load in the frame of the last link as it does those of the link itself (W. Khalil, M. Gautier and
/// P. Lemoine, *Identification of the payload inertial parameters of industrial manipulators*, ICRA 2007). What is not known of the arm is
/// solved for with the load. Friction is taken not to change with it.
///
/// # Errors
/// [`PayloadError`].
pub fn payload(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    model: KnownModel<'_>,
    covariance: &ParameterCovariance,
    declared: Declared,
) -> Result<Payload, PayloadError> {
    let covariance = covariance.matrix(model.parameters.len());
    let covariance = covariance.ok_or(PayloadError::NoCovariance)?;
    let options = model.options(options);
    let (context, parameters) = model.context(robot, base, experiment, &options)?;
    let sums = LoadSums::of(robot, base, &context)?;
    let motion = filtered_motion(experiment, &options.position_filter)?;
    let matrix = fitted_matrix(&context, &motion)?;
    let arm = torque_equation(&context, matrix, filtered_torque(&context)?, &motion)?;
    let unexplained = arm.residuals(&parameters);
    let of_arm = arm.matrix() * uncertain_arm(&context, model, &covariance)?;
    let of_load = sums.along(arm.matrix());

    let (values, covariance) = solved(&context, &sums, &of_load, &of_arm, &unexplained)?;
    let after = &unexplained - of_load * &values;
    let load = Load::of(&sums, &values, &covariance);
    let found = (0..values.len()).map(|k| Uncertain {
        value: values[k],
        standard_deviation: covariance[(k, k)].max(0.0).sqrt(),
    });
    let symbol = |&parameter: &usize| ParameterKind::LINK[parameter].symbol();
    Ok(Payload {
        presence: presence(&load, &values, &covariance)?,
        body: body(&sums, &load, &values, &covariance, declared)?,
        load,
        parameters: (sums.names.iter().cloned().zip(found))
            .map(|(name, found)| LoadParameter { name, found })
            .collect(),
        without_effect: sums.without_effect.iter().map(symbol).collect(),
        before: PredictionError::of(&arm, &unexplained),
        after: PredictionError::of(&arm, &after),
    })
}

/// L (b × b) of C = L Lᵀ in the order of the equation: δβ = L u with u ~ N(0, 1).
fn uncertain_arm(
    context: &Context<'_>,
    model: KnownModel<'_>,
    covariance: &DMatrix<f64>,
) -> Result<DMatrix<f64>, PayloadError> {
    let place = |name: &String| model.parameters.iter().position(|(own, _)| own == name);
    let order: Vec<usize> = context.selection.names().iter().filter_map(place).collect();
    let ordered = covariance.select_rows(&order).select_columns(&order);
    Ok(ordered.cholesky().ok_or(PayloadError::Covariance)?.unpack())
}

/// The sums and their covariance, from `unexplained` = Z sums + X L u + ε.
fn solved(
    context: &Context<'_>,
    sums: &LoadSums,
    of_load: &DMatrix<f64>,
    of_arm: &DMatrix<f64>,
    unexplained: &DVector<f64>,
) -> Result<(DVector<f64>, DMatrix<f64>), PayloadError> {
    let joints = context.robot.joints();
    let named = |error| sums.named(error);
    let equation = Observations::new(of_load.clone(), unexplained.clone(), joints);
    let equation = equation.map_err(named)?;
    let ordinary = equation.ordinary().map_err(named)?;
    let levels = equation.noise_levels(&ordinary.residuals);
    let solution = equation.weighted(&levels).map_err(named)?;
    let filter = context.row_filter();
    let analysis = ResidualAnalysis::new(&equation, &solution, &filter);
    // What the model leaves of the torque is in the residuals, and every row counts once.
    let joint = analysis.with_prior(of_arm, &vec![0.0; joints], 1.0).map_err(named)?;
    Ok((&solution.parameters + &joint.change, joint.coloured_covariance()))
}

/// Whether a load is there, by its mass and by all that is told of it.
fn presence(
    load: &Load,
    values: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Result<Presence, PayloadError> {
    let factor = covariance.clone().cholesky().ok_or(PayloadError::Covariance)?;
    let (chi_squared, degrees_of_freedom) = (values.dot(&factor.solve(values)), values.len());
    let distribution = ChiSquared::new(degrees_of_freedom as f64);
    Ok(Presence {
        mass_deviations: load.mass_kg.map(|mass| mass.deviations_from(0.0)),
        chi_squared,
        degrees_of_freedom,
        probability: distribution.map_or(1.0, |of| of.sf(chi_squared)),
    })
}

/// The estimate where it is a body, else the nearest one; none where no mass is seen or stated.
fn body(
    sums: &LoadSums,
    load: &Load,
    values: &DVector<f64>,
    covariance: &DMatrix<f64>,
    declared: Declared,
) -> Result<Option<LoadBody>, PayloadError> {
    let (ten, _) = sums.ten(values, covariance);
    let estimate = Body::from_parameters(core::array::from_fn(|k| ten[k]));
    let seen = load.mass_kg.filter(Uncertain::is_seen).map(|mass| mass.value);
    let is_the_estimate = sums.chosen.len() == 10 && seen.is_some() && estimate.is_possible();
    let (body, cost) = if is_the_estimate {
        (estimate, 0.0)
    } else {
        let Some(mass) = declared.mass_kg.or(seen) else { return Ok(None) };
        let told = load.centre_m.map(|of| of.map_or(0.0, |of| of.value));
        let centre = Vector3::from(declared.centre_m.unwrap_or(told));
        let nearest = nearest_body(&sums.regrouping, values, covariance, mass, centre)?;
        (nearest.body, nearest.cost)
    };
    Ok(body.centre_of_mass_m().zip(body.inertia_about_centre()).map(|(centre, inertia)| LoadBody {
        mass_kg: body.mass_kg,
        centre_m: centre.into(),
        inertia_kg_m2: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at]),
        is_the_estimate,
        cost,
    }))
}
