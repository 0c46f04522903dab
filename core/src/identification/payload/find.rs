//! The load from what a record leaves of the torques.

use core::ops::Range;

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
    BaseColumns, Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::prediction::{KnownModel, PredictionError};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis};
use crate::robot::Robot;

/// Noise of a joint is never taken for less than this share of its torque.
const LEAST_NOISE: f64 = 1e-6;
/// A joint that moves less than this along a record stands \[rad or m\]: gears and filters make no more of a posture that is held.
const STANDS: f64 = 5e-3;
/// What the rows of a joint that stands are multiplied with: beside those of the others they are nothing.
const FAINT: f64 = 1e-6;

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
    /// Joints that stand along the record, counted from 1: friction at rest holds any torque below its own, and theirs counts nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub standing: Vec<usize>,
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
    let sums = LoadSums::of(robot, base, context.selection.names())?;
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    let stands: Vec<bool> =
        (0..robot.joints()).map(|joint| stands(experiment, &motion, joint)).collect();
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
    let mut moving = matrix.clone();
    standing_rows(&stands, &arm).for_each(|rows| moving.rows_mut(rows.start, rows.len()).fill(0.0));
    let sums = sums.told_by(&moving)?;
    drop(moving);
    // Where friction grows with what the arm carries.
    if context.model.feels_loads() {
        context.settle_loads(|context| {
            let arm = equation(context, fitted_matrix(context, &motion)?)?;
            let matrix = arm.matrix().dense();
            let unexplained = arm.residuals(&parameters);
            let found = Equation::new(&sums, &arm, &stands, matrix, unexplained)?.ordinary()?;
            Ok::<_, PayloadError>(sums.loaded(&parameters, &found))
        })?;
        (arm, beside) = with_beside(&context)?;
        matrix = arm.matrix().dense();
    }
    let unexplained = arm.residuals(&parameters);

    let equation = Equation::new(&sums, &arm, &stands, matrix, unexplained)?;
    // A torque gain that is wrong, or a length, does it to the torques of the load too.
    let loaded = sums.loaded(&parameters, &equation.ordinary()?);
    let errors = model
        .uncertainty
        .map_or(Ok(None), |known| known.errors_along(&context, &motion, &beside, &arm, &loaded))?;
    let mut of_arm = &equation.matrix * uncertain_arm(&context, model, &covariance)?;
    if let Some(errors) = &errors {
        let own = of_arm.ncols();
        of_arm = of_arm.resize_horizontally(own + errors.ncols(), 0.0);
        of_arm.columns_mut(own, errors.ncols()).copy_from(errors);
        for rows in standing_rows(&stands, &arm) {
            of_arm.view_mut((rows.start, own), (rows.len(), errors.ncols())).scale_mut(FAINT);
        }
    }
    let torques = arm.rms_per_joint(&arm.measured());
    let floor = |(torque, stands): (&f64, &bool)| torque * if *stands { 1.0 } else { LEAST_NOISE };
    let floors: Vec<f64> = torques.iter().zip(&stands).map(floor).collect();
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
        standing: (1..).zip(&stands).filter(|(_, stands)| **stands).map(|(of, _)| of).collect(),
        with_model_errors: errors.is_some(),
        before,
        after: PredictionError::of(&arm, &after),
    })
}

/// The rows of each joint that stands.
fn standing_rows(stands: &[bool], arm: &Observations) -> impl Iterator<Item = Range<usize>> {
    let standing = (0..stands.len()).filter(|joint| stands[*joint]);
    standing.map(|joint| arm.joint_rows(joint))
}

/// Whether a joint stands along the samples that count.
fn stands(experiment: &Experiment, motion: &Motion, joint: usize) -> bool {
    let places = experiment.counted_samples().map(|k| motion.position[(k, joint)]);
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = places.fold(none, |[low, high], q| [low.min(q), high.max(q)]);
    high - low < STANDS
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
    /// X, with faint rows where a joint stands.
    matrix: DMatrix<f64>,
    system: Observations,
}

impl<'a> Equation<'a> {
    fn new(
        sums: &'a LoadSums,
        arm: &Observations,
        stands: &[bool],
        mut matrix: DMatrix<f64>,
        mut unexplained: DVector<f64>,
    ) -> Result<Self, PayloadError> {
        for rows in standing_rows(stands, arm) {
            matrix.rows_mut(rows.start, rows.len()).scale_mut(FAINT);
            unexplained.rows_mut(rows.start, rows.len()).scale_mut(FAINT);
        }
        let system = Observations::new(sums.along(&matrix), unexplained, arm.joints());
        let system = system.map_err(|error| sums.named(error))?;
        Ok(Self { sums, matrix, system })
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
        let levels: Vec<f64> =
            levels.iter().zip(floors).map(|(of, floor)| of.max(*floor)).collect();
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
