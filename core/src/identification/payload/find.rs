//! The load from what a record leaves of the torques.

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

use super::equation::LoadSums;
use super::error::PayloadError;
use super::load::{Load, LoadBody, LoadParameter, Uncertain};
use super::presence::{Comparison, Declared, Presence, cost_limit};
use crate::dynamics::BaseParameters;
use crate::feasibility::{Body, nearest_body};
use crate::identification::given::{Context, Experiment, Options};
use crate::identification::judgement::ParameterCovariance;
use crate::identification::observation::{
    BaseColumns, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::prediction::{KnownModel, PredictionError};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis};
use crate::robot::Robot;

/// Noise of a joint is never taken for less than this share of its torque.
const LEAST_NOISE: f64 = 1e-6;

/// An arm without load, as a result has it.
#[derive(Clone, Copy, Debug)]
pub struct KnownArm<'a> {
    /// Its parameters and what is known of the model's errors.
    pub model: KnownModel<'a>,
    /// Covariance of the parameters, in their order. None is refused.
    pub covariance: Option<&'a ParameterCovariance>,
}

/// A load on the last link.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Payload {
    /// Whether it is there.
    pub presence: Presence,
    /// What is told of it.
    pub load: Load,
    /// The sums that this is formed from.
    pub parameters: Vec<LoadParameter>,
    /// Parameters of the ten that no motion of this arm shows.
    pub without_effect: Vec<&'static str>,
    /// Others of the ten that arm or record tell in sums with others alone, or not at all.
    pub not_told: Vec<&'static str>,
    /// A body that can be; none without a mass that is seen or declared.
    pub body: Option<LoadBody>,
    /// What is found against what is declared; none where nothing of it is.
    pub declared: Option<Comparison>,
    /// Whether the uncertainty has what errors of the arm's model do; not where the result does not say.
    pub with_model_errors: bool,
    /// How far the torques are from those of the arm without load.
    pub before: PredictionError,
    /// The same with the load.
    pub after: PredictionError,
}

/// The load on the last link of an arm whose base parameters β̂ and their covariance C are known, from a record of the arm that
/// carries it:
///
/// ```text
/// y − X β̂ = Z φ + X δβ + E u + ε,   δβ ~ N(0, C),   u ~ N(0, 1),   Z = X K
/// ```
///
/// K regroups the ten parameters φ of the load in the frame of the last link as it does those of the link itself (W. Khalil, M. Gautier and
/// P. Lemoine, *Identification of the payload inertial parameters of industrial manipulators*, ICRA 2007). E is what errors of the arm's
/// model make of the torques. What is not known of the arm is solved for with the load. Friction
/// changes with it as the robot's laws have it (`fcl`).
///
/// # Errors
/// [`PayloadError`].
pub fn payload(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    arm: KnownArm<'_>,
    declared: Declared,
) -> Result<Payload, PayloadError> {
    let KnownArm { model, covariance } = arm;
    let covariance = covariance.and_then(|of| of.matrix(model.parameters.len()));
    let covariance = covariance.ok_or(PayloadError::NoCovariance)?;
    let options = model.options(options);
    let (mut context, parameters) = model.context(robot, base, experiment, &options)?;
    let sums = LoadSums::of(robot, base, &context)?;
    let motion = filtered_motion(experiment, &options.position_filter)?;
    let equation = |context: &Context<'_>, matrix| {
        torque_equation(context, matrix, filtered_torque(context)?, &motion)
    };
    let with_beside = |context: &Context<'_>| {
        let BaseColumns { selected, beside } = BaseColumns::new(context, &motion)?;
        Ok::<_, PayloadError>((equation(context, selected)?, beside))
    };
    let (mut arm, mut beside) = with_beside(&context)?;
    let before = PredictionError::of(&arm, &arm.residuals(&parameters));
    let mut matrix = arm.matrix().dense();
    let sums = sums.told_by(&matrix)?;
    // Where friction grows with what the arm carries.
    if context.model.feels_loads() {
        context.settle_loads(|context| {
            let arm = equation(context, fitted_matrix(context, &motion)?)?;
            let matrix = arm.matrix().dense();
            let unexplained = arm.residuals(&parameters);
            let found = Equation::new(&sums, &arm, &matrix, &unexplained)?.ordinary()?;
            Ok::<_, PayloadError>(sums.loaded(&parameters, &found))
        })?;
        (arm, beside) = with_beside(&context)?;
        matrix = arm.matrix().dense();
    }
    let unexplained = arm.residuals(&parameters);

    let equation = Equation::new(&sums, &arm, &matrix, &unexplained)?;
    // A torque gain that is wrong, or a length, does it to the torques of the load too.
    let loaded = sums.loaded(&parameters, &equation.ordinary()?);
    let errors = model
        .uncertainty
        .map_or(Ok(None), |known| known.errors_along(&context, &motion, &beside, &arm, &loaded))?;
    let mut of_arm = &matrix * uncertain_arm(&context, model, &covariance)?;
    if let Some(errors) = &errors {
        let own = of_arm.ncols();
        of_arm = of_arm.resize_horizontally(own + errors.ncols(), 0.0);
        of_arm.columns_mut(own, errors.ncols()).copy_from(errors);
    }
    let floors: Vec<f64> =
        arm.rms_per_joint(&arm.measured()).iter().map(|torque| LEAST_NOISE * torque).collect();
    let (values, covariance) = equation.solved(&context, of_arm, &floors)?;

    let after = arm.residuals(&sums.loaded(&parameters, &values));
    let load = Load::of(&sums, &values, &covariance);
    let found = (0..values.len()).map(|k| Uncertain {
        value: values[k],
        standard_deviation: covariance[(k, k)].max(0.0).sqrt(),
    });
    let [without_effect, not_told] = sums.untold();
    Ok(Payload {
        presence: Presence::of(load.mass_kg, &values, &covariance)?,
        body: body(&sums, &load, &values, &covariance, declared)?,
        declared: Comparison::of(declared, &sums, &values, &covariance)?,
        load,
        parameters: (sums.names().into_iter().zip(sums.units()).zip(found))
            .map(|((name, unit), found)| LoadParameter { name, unit, found })
            .collect(),
        without_effect,
        not_told,
        with_model_errors: errors.is_some(),
        before,
        after: PredictionError::of(&arm, &after),
    })
}

/// L (b × b) of C = L Lᵀ in the order of the equation: δβ = L u with u ~ N(0, 1).
fn uncertain_arm(
    context: &Context<'_>,
    model: KnownModel<'_>,
    covariance: &DMatrix<f64>,
) -> Result<DMatrix<f64>, PayloadError> {
    let ordered = model.ordered(context, covariance);
    Ok(ordered.cholesky().ok_or(PayloadError::Covariance)?.unpack())
}

/// unexplained = Z sums + ….
struct Equation<'a> {
    sums: &'a LoadSums,
    system: Observations,
}

impl<'a> Equation<'a> {
    fn new(
        sums: &'a LoadSums,
        arm: &Observations,
        matrix: &DMatrix<f64>,
        unexplained: &DVector<f64>,
    ) -> Result<Self, PayloadError> {
        let of_load = sums.along(matrix);
        let system = Observations::new(of_load, unexplained.clone(), arm.joints());
        Ok(Self { sums, system: system.map_err(|error| sums.named(error))? })
    }

    /// The sums alone, every row counting the same.
    fn ordinary(&self) -> Result<DVector<f64>, PayloadError> {
        let solution = self.system.ordinary().map_err(|error| self.sums.named(error))?;
        Ok(solution.parameters)
    }

    /// The sums and their covariance, together with what is not known of the arm: `of_arm` (r × m) times independent unknowns of
    /// standard deviation 1. Noise is at least that of the floors.
    fn solved(
        &self,
        context: &Context<'_>,
        of_arm: DMatrix<f64>,
        floors: &[f64],
    ) -> Result<(DVector<f64>, DMatrix<f64>), PayloadError> {
        let named = |error| self.sums.named(error);
        let residuals = self.system.residuals(&self.ordinary()?);
        let levels = self.system.noise_levels(&residuals);
        let solution = self.system.weighted(&levels).map_err(named)?;
        let filter = context.row_filter();
        let analysis = ResidualAnalysis::new(&self.system, &solution, &filter);
        let of_arm = ObservationMatrix::of(of_arm, self.system.joints());
        // Every row counts once.
        let products = analysis.products(&of_arm);
        let joint = analysis.with_prior(&of_arm, &products, floors, 1.0).map_err(named)?;
        Ok((&solution.parameters + &joint.change, joint.coloured_covariance()))
    }
}

/// The estimate where it is a body, else the nearest one, by what is declared where nothing is told; none where no mass is seen
/// or declared.
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
    let is_the_estimate = values.len() == 10 && seen.is_some() && estimate.is_possible();
    let (body, cost) = if is_the_estimate {
        (estimate, 0.0)
    } else {
        // Less than with the result, or the same, is no body.
        let declared_kg = declared.mass_kg.filter(|kg| *kg > 0.0);
        let Some(mass) = seen.or(declared_kg) else { return Ok(None) };
        let told = |k: usize| load.centre_m[k].map(|of| of.value);
        let stated = declared.centre_m.unwrap_or_default();
        let centre = Vector3::from([0, 1, 2].map(|k| told(k).unwrap_or(stated[k])));
        let nearest = nearest_body(&sums.regrouping, values, covariance, mass, centre)?;
        (nearest.body, nearest.cost)
    };
    Ok(body.centre_of_mass_m().zip(body.inertia_about_centre()).map(|(centre, inertia)| LoadBody {
        mass_kg: body.mass_kg,
        centre_m: centre.into(),
        inertia_kg_m2: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at]),
        is_the_estimate,
        cost,
        cost_limit: cost_limit(values.len()),
    }))
}
