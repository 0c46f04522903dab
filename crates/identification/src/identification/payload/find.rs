//! Load estimate from the residual torques of a record.

use core::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

use super::equation::LoadSums;
use super::error::PayloadError;
use super::in_frame::{EstimatedLoad, LoadInFrame};
use super::load::{Load, LoadBody, LoadParameter};
use super::presence::{Comparison, DeclaredLoad, Presence, cost_limit};
use crate::feasibility::{Body, nearest_body};
use crate::identification::judgement::ParameterCovariance;
use crate::identification::observation::{
    BaseColumns, Motion, filtered_motion, filtered_torque, fitted_matrix, torque_equation,
};
use crate::identification::prediction::{KnownModel, PredictionError};
use crate::identification::problem::{Context, Experiment, Options, PayloadLimits};
use crate::regression::{ObservationMatrix, Observations, ResidualAnalysis};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointIndex, NamedFrame, Robot};

/// Smallest noise level of a joint, as a share of its torque.
const MIN_NOISE: f64 = 1e-6;
/// Factor on the rows of a joint at rest, which makes them negligible compared with the rows of
/// other joints.
const REST_ROW_FACTOR: f64 = 1e-6;

/// Identified arm without load.
#[derive(Clone, Copy, Debug)]
pub struct KnownArm<'a> {
    /// Parameters of the arm, and the available information on model errors.
    pub model: KnownModel<'a>,
    /// Covariance of the parameters, in their order. [`find_payload`] refuses `None`.
    pub covariance: Option<&'a ParameterCovariance>,
}

/// Load on the last link.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Payload {
    /// Presence of the load.
    pub presence: Presence,
    /// Identifiable values of the load.
    pub load: Load,
    /// The load in the requested frame; `None` if its sums cannot be chosen there.
    #[serde(rename = "centre_of_mass")]
    pub in_frame: Option<LoadInFrame>,
    /// Sums of load parameters from which `load` is computed.
    pub parameters: Vec<LoadParameter>,
    /// Load parameters, of ten, that no motion of this arm makes identifiable.
    pub without_effect: Vec<&'static str>,
    /// Other load parameters that the arm or the record identifies only in sums, or not at all.
    #[serde(rename = "not_told")]
    pub not_identifiable: Vec<&'static str>,
    /// Joints at rest during the record, in JSON counted from 1. Their torques are not used,
    /// because static friction may balance any torque up to its limit.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub standing: Vec<JointIndex>,
    /// Physically consistent body of the load; `None` if the mass is neither detected nor declared.
    pub body: Option<LoadBody>,
    /// Comparison of the estimated and the declared load; `None` if no identifiable value is
    /// declared.
    pub declared: Option<Comparison>,
    /// True if the uncertainty includes the effect of errors in the arm's model, false if the
    /// result does not contain the necessary information.
    pub with_model_errors: bool,
    /// Prediction error of the arm without the load.
    pub before: PredictionError,
    /// Prediction error of the arm with the load.
    pub after: PredictionError,
}

/// Estimates the load on the last link of an arm with known base parameters β̂ and their covariance
/// C. The record is one of the arm with the load:
///
/// ```text
/// y − X β̂ = Z φ + X δβ + E u + ε,   δβ ~ N(0, C),   u ~ N(0, 1),   Z = X K
/// ```
///
/// K regroups the ten parameters φ of the load in the frame of the last link like those of the link
/// itself (W. Khalil, M. Gautier and P. Lemoine, *Identification of the payload inertial parameters
/// of industrial manipulators*, ICRA 2007). E is the effect of errors in the arm's model on the
/// torques. The unknowns of the arm are solved for together with the load. Friction changes with
/// the load by the robot's laws (`fcl`). The load is also described in `frame`.
///
/// # Errors
/// [`PayloadError`].
pub fn find_payload(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    arm: KnownArm<'_>,
    declared: DeclaredLoad,
    frame: &NamedFrame,
) -> Result<Payload, PayloadError> {
    let KnownArm { model, covariance } = arm;
    let covariance = covariance.and_then(|of| of.matrix(model.parameters.len()));
    let covariance = covariance.ok_or(PayloadError::NoCovariance)?;
    let options = model.options(options);
    let limits = &options.payload_limits;
    let (mut context, parameters) = model.context(robot, base, experiment, &options)?;
    let sums = LoadSums::new(robot, base, context.selection.names())?;
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    let stands = resting_joints(experiment, &motion, limits);
    let equation = |context: &Context<'_>, matrix| {
        torque_equation(context, matrix, filtered_torque(context)?, &motion)
    };
    let with_auxiliary = |context: &Context<'_>| {
        let BaseColumns { selected, auxiliary } = BaseColumns::new(context, &motion)?;
        Ok::<_, PayloadError>((equation(context, selected)?, auxiliary))
    };
    let (mut arm, mut auxiliary_columns) = with_auxiliary(&context)?;
    let before = PredictionError::from_residuals(&arm, &arm.residuals(&parameters));
    let mut matrix = arm.matrix().dense();
    let mut moving = matrix.clone();
    standing_rows(&stands, &arm).for_each(|rows| moving.rows_mut(rows.start, rows.len()).fill(0.0));
    let sums = sums.identifiable_by(&moving)?;
    drop(moving);
    // Load-dependent friction grows with the payload.
    if context.model.feels_loads() {
        context.settle_loads(|context| {
            let arm = equation(context, fitted_matrix(context, &motion)?)?;
            let matrix = arm.matrix().dense();
            let unexplained = arm.residuals(&parameters);
            let values_and_deviations =
                Equation::new(&sums, &arm, &stands, matrix, unexplained)?.ordinary_sums()?;
            Ok::<_, PayloadError>(sums.loaded_parameters(&parameters, &values_and_deviations))
        })?;
        (arm, auxiliary_columns) = with_auxiliary(&context)?;
        matrix = arm.matrix().dense();
    }
    let unexplained = arm.residuals(&parameters);

    let equation = Equation::new(&sums, &arm, &stands, matrix, unexplained)?;
    // A wrong torque gain or length also affects the torques of the load.
    let loaded = sums.loaded_parameters(&parameters, &equation.ordinary_sums()?);
    let errors = model.uncertainty.map_or(Ok(None), |arm_context| {
        arm_context.errors_along(&context, &motion, &auxiliary_columns, &arm, &loaded)
    })?;
    let of_arm = &equation.matrix * uncertain_arm(&context, model, &covariance)?;
    let of_arm = with_errors(of_arm, errors.as_ref(), &stands, &arm);
    let floors = noise_floors(&stands, &arm);
    let (values, covariance) = equation.solve_sums(&context, of_arm, &floors)?;

    let after = arm.residuals(&sums.loaded_parameters(&parameters, &values));
    let load = Load::from_sums(&sums, &values, &covariance, limits);
    let body = load_body(&sums, &load, &values, &covariance, declared, limits)?;
    let estimated =
        EstimatedLoad { sums: &sums, values: &values, covariance: &covariance, declared };
    let in_frame = LoadInFrame::new(&estimated, body.as_ref(), frame, limits)?;
    let [without_effect, unidentifiable] = sums.unidentifiable();
    Ok(Payload {
        presence: Presence::from_limit(load.mass_kg, &values, &covariance, limits)?,
        body,
        declared: Comparison::compare(declared, &sums, &values, &covariance, limits)?,
        load,
        in_frame,
        parameters: LoadParameter::list(&sums, &values, &covariance),
        without_effect,
        not_identifiable: unidentifiable,
        standing: (0..stands.len()).filter(|k| stands[*k]).map(JointIndex::new).collect(),
        with_model_errors: errors.is_some(),
        before,
        after: PredictionError::from_residuals(&arm, &after),
    })
}

/// Appends the columns of the model errors. Their rows of joints at rest are scaled to be
/// negligible.
fn with_errors(
    mut of_arm: DMatrix<f64>,
    errors: Option<&DMatrix<f64>>,
    stands: &[bool],
    arm: &Observations,
) -> DMatrix<f64> {
    if let Some(errors) = errors {
        let width = of_arm.ncols();
        of_arm = of_arm.resize_horizontally(width + errors.ncols(), 0.0);
        of_arm.columns_mut(width, errors.ncols()).copy_from(errors);
        for rows in standing_rows(stands, arm) {
            of_arm
                .view_mut((rows.start, width), (rows.len(), errors.ncols()))
                .scale_mut(REST_ROW_FACTOR);
        }
    }
    of_arm
}

/// Returns the smallest noise level of each joint \[N·m or N\], from its measured torque.
fn noise_floors(stands: &[bool], arm: &Observations) -> Vec<f64> {
    let torques = arm.rms_per_joint(&arm.measured_values());
    let floor = |(torque, stands): (&f64, &bool)| torque * if *stands { 1.0 } else { MIN_NOISE };
    torques.iter().zip(stands).map(floor).collect()
}

/// Returns the rows of each joint at rest.
fn standing_rows(stands: &[bool], arm: &Observations) -> impl Iterator<Item = Range<usize>> {
    let standing = (0..stands.len()).filter(|joint| stands[*joint]);
    standing.map(|joint| arm.joint_rows(joint))
}

/// Returns for each joint whether it is at rest during the counted samples.
fn resting_joints(experiment: &Experiment, motion: &Motion, limits: &PayloadLimits) -> Vec<bool> {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let columns = motion.position.column_iter().map(|positions| {
        let counted = experiment.counted_samples().map(|k| positions[k]);
        let [low, high] = counted.fold(none, |[low, high], q| [low.min(q), high.max(q)]);
        high - low < limits.rest_travel
    });
    columns.collect()
}

/// Returns L (b × b) of C = L Lᵀ in the order of the equation: δβ = L u with u ~ N(0, 1).
fn uncertain_arm(
    context: &Context<'_>,
    model: KnownModel<'_>,
    covariance: &DMatrix<f64>,
) -> Result<DMatrix<f64>, PayloadError> {
    let ordered = model.reorder_covariance(&context.selection, covariance);
    Ok(ordered.cholesky().ok_or(PayloadError::Covariance)?.unpack())
}

/// Equation of a load: unexplained torque = Z · sums + effect of the arm's errors + noise. Z has
/// one column per sum.
struct Equation<'a> {
    sums: &'a LoadSums,
    /// X, with scaled-down rows of joints at rest.
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
            matrix.rows_mut(rows.start, rows.len()).scale_mut(REST_ROW_FACTOR);
            unexplained.rows_mut(rows.start, rows.len()).scale_mut(REST_ROW_FACTOR);
        }
        let of_sums = ObservationMatrix::from_dense(sums.sum_torques(&matrix), arm.joints())
            .without_joints(arm.matrix().left_out_joints().iter().copied());
        let system = Observations::from_dense(of_sums, unexplained);
        let system = system.map_err(|error| sums.regression_failure(error))?;
        Ok(Self { sums, matrix, system })
    }

    /// Returns the sums by ordinary least squares, without the unknowns of the arm.
    fn ordinary_sums(&self) -> Result<DVector<f64>, PayloadError> {
        let solution =
            self.system.solve_ordinary().map_err(|error| self.sums.regression_failure(error))?;
        Ok(solution.parameters)
    }

    /// Returns the sums and their covariance, solved together with the unknowns of the arm.
    /// `of_arm` (r × m) has the columns of independent unknowns of standard deviation 1. `floors`
    /// are the smallest noise levels of the joints.
    fn solve_sums(
        &self,
        context: &Context<'_>,
        of_arm: DMatrix<f64>,
        floors: &[f64],
    ) -> Result<(DVector<f64>, DMatrix<f64>), PayloadError> {
        let named = |error| self.sums.regression_failure(error);
        let residuals = self.system.residuals(&self.ordinary_sums()?);
        let levels = self.system.noise_levels(&residuals);
        let levels: Vec<f64> =
            levels.iter().zip(floors).map(|(of, floor)| of.max(*floor)).collect();
        let solution = self.system.solve_weighted(&levels).map_err(named)?;
        let filter = context.row_filter();
        let analysis = ResidualAnalysis::new(&self.system, &solution, &filter);
        let of_arm = ObservationMatrix::from_dense(of_arm, self.system.joints());
        // Repeated motion is not taken into account: every row counts once.
        let products = analysis.products(&of_arm);
        let joint = analysis.with_prior(&of_arm, &products, floors).map_err(named)?;
        Ok((&solution.parameters + &joint.parameter_change, joint.coloured_covariance()))
    }
}

/// Returns the nearest physically consistent body, which is the estimate itself if that is
/// consistent. Declared values replace unidentifiable ones. Returns `None` if no mass is detected
/// or declared.
fn load_body(
    sums: &LoadSums,
    load: &Load,
    values: &DVector<f64>,
    covariance: &DMatrix<f64>,
    declared: DeclaredLoad,
    limits: &PayloadLimits,
) -> Result<Option<LoadBody>, PayloadError> {
    let (ten, _) = sums.load_parameters(values, covariance);
    let estimate = Body::from_parameters(core::array::from_fn(|k| ten[k]));
    let seen = load.mass_kg.filter(|mass| mass.is_seen(limits)).map(|mass| mass.value);
    let is_the_estimate = values.len() == 10 && seen.is_some() && estimate.is_possible();
    let (body, cost) = if is_the_estimate {
        (estimate, 0.0)
    } else {
        // A declared mass that is not positive is not that of a body.
        let declared_kg = declared.mass_kg.filter(|kg| *kg > 0.0);
        let Some(mass) = seen.or(declared_kg) else { return Ok(None) };
        let identified = |k: usize| load.centre_m[k].map(|of| of.value);
        let declared_centre = declared.centre_m.unwrap_or_default();
        let centre = Vector3::from([0, 1, 2].map(|k| identified(k).unwrap_or(declared_centre[k])));
        let nearest = nearest_body(&sums.regrouping, values, covariance, mass, centre)?;
        (nearest.body, nearest.cost)
    };
    Ok(body.centre_of_mass_m().zip(body.inertia_about_centre()).map(|(centre, inertia)| LoadBody {
        mass_kg: body.mass_kg,
        centre_m: centre.into(),
        inertia_kg_m2: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at]),
        is_the_estimate,
        cost,
        cost_limit: cost_limit(values.len(), limits),
    }))
}
