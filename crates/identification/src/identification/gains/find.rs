//! Gains of the drives and parameters of the arm.

use nalgebra::DVector;
use serde::Serialize;

use super::equation::Equation;
use super::error::GainsError;
use super::load::KnownLoad;
use crate::identification::payload::{MahalanobisDistance, UncertainValue};
use crate::identification::problem::{Context, Experiment, Method, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointIndex, Robot, Transmission};

/// Correction of one drive's torque gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriveGain {
    /// Joint of the drive.
    pub joint: JointIndex,
    /// True torque divided by the torque with the configured gain; negative if the configured sign
    /// is wrong, `None` if the records do not distinguish it from infinity.
    pub factor: Option<UncertainValue>,
    /// The same factor by total least squares alone.
    pub total_least_squares: f64,
}

/// Base parameter of the arm without load, computed with the corrected gains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmParameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter.
    pub unit: &'static str,
    /// Value with its standard deviation.
    #[serde(flatten)]
    pub found: UncertainValue,
}

/// Quantity that determines the scale of gains and parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// The mass of a load.
    Load(KnownLoad),
    /// Without a load, the configured gain of this joint's drive, which is assumed to be correct.
    Reference(JointIndex),
}

/// Gains and parameters of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// One entry per drive.
    pub gains: Vec<DriveGain>,
    /// Parameters of the arm without load.
    pub parameters: Vec<ArmParameter>,
    /// Quantity that determines their scale.
    #[serde(flatten)]
    pub scale: Scale,
    /// Distance between the configured centre of the load and the centre that the records identify;
    /// `None` if they do not identify it.
    pub centre: Option<MahalanobisDistance>,
    /// Unexplained part of each drive's torque, ‖residuals‖ / ‖torque‖.
    pub relative_error_per_joint: Vec<f64>,
}

/// Checks that the mass and the centre of a known load are possible.
fn check_load(load: Option<KnownLoad>) -> Result<(), GainsError> {
    match load {
        Some(KnownLoad { mass_kg, centre_m })
            if !(mass_kg.is_finite()
                && mass_kg > 0.0
                && centre_m.iter().all(|of| of.is_finite())) =>
        {
            Err(GainsError::Load { mass_kg, centre_m })
        }
        _ => Ok(()),
    }
}

/// Checks that the torque of every joint is used.
fn check_every_torque(robot: &Robot) -> Result<(), GainsError> {
    match robot.recorded_torque().missing_joints() {
        [] => Ok(()),
        missing => Err(GainsError::MissingTorques { joints: missing.to_vec() }),
    }
}

/// Identifies the torque gains of all drives and the base parameters χ. The data are one record of
/// the arm without load and, optionally, one with a load of known mass and centre:
///
/// ```text
/// g_k t_k = W_k χ              empty
/// g_k t_k = W_k χ + w_k + J_k  with the load
/// ```
///
/// w is the torque due to the load's mass at its centre. J is the torque due to its unknown inertia
/// about the centre. t is the measured torque with the configured gains. Total least squares
/// provide the start. The estimate assumes noise in the measured torques alone. Torques are those
/// of the motors if there is a transmission, otherwise those of the joints. The uncertainties
/// include the noise only, neither model errors nor errors of the load's mass, to which all gains
/// and parameters are proportional. Without a load, the configured gain of one drive determines the
/// scale.
///
/// # Errors
/// [`GainsError`].
pub fn find_gains(
    robot: &Robot,
    base: &BaseParameters,
    empty: &Experiment,
    load_rows: Option<(&Experiment, KnownLoad)>,
    transmission: Option<&Transmission>,
    options: &Options,
) -> Result<Gains, GainsError> {
    check_every_torque(robot)?;
    let load = load_rows.map(|(_, load)| load);
    check_load(load)?;
    let both = match load_rows {
        Some((loaded, _)) => &Experiment::join(&[empty.clone(), loaded.clone()])?,
        None => empty,
    };
    let options =
        Options { keep_nominal: None, required_parameters: None, robust: None, ..options.clone() };
    let context = Context::new(robot, base, both, &options, Method::IdimLs)?;
    if context.model.feels_loads() {
        return Err(GainsError::LoadFriction);
    }
    let velocity_matrix = load.map(|load| (load, empty.samples()));
    let equation = Equation::new(&context, velocity_matrix, transmission)?;
    equation.check_identifiable().map_err(|error| context.selection.regression_failure(error))?;
    let filter = context.row_filter();
    let joints = equation.drive_count;
    let unidentifiable =
        || GainsError::NotIdentifiable { joints: (0..joints).map(JointIndex::new).collect() };
    let of_drive = equation.reference.map(|drive| Scale::Reference(JointIndex::new(drive)));
    let scale = load.map(Scale::Load).or(of_drive).ok_or_else(unidentifiable)?;
    let start = equation.total_least_squares().ok_or_else(unidentifiable)?;
    let estimate = equation.most_probable(&start, &filter)?;
    let (values, covariance) = (&estimate.values, &estimate.covariance);
    let uncertain = |k: usize| UncertainValue {
        value: values[k],
        standard_deviation: covariance[(k, k)].max(0.0).sqrt(),
    };
    let gains: Vec<DriveGain> = (0..joints)
        .map(|k| DriveGain {
            joint: JointIndex::new(k),
            factor: Some(uncertain(k))
                .filter(|of| of.differs_from_none(&options.payload_limits))
                .map(|inverse| {
                    let value = 1.0 / inverse.value;
                    let standard_deviation = inverse.standard_deviation * value * value;
                    UncertainValue { value, standard_deviation }
                }),
            total_least_squares: start.gains[k],
        })
        .collect();
    if equation.drives_with_free_gain().into_iter().all(|drive| gains[drive].factor.is_none()) {
        return Err(unidentifiable());
    }
    let selection = &context.selection;
    let unit = |column: usize| {
        let parameter = &robot.parameters().parameters()[column];
        parameter.kind.unit(robot.chain()[parameter.joint].kind)
    };
    let parameters = (selection.names().iter().zip(selection.columns()).enumerate())
        .map(|(k, (name, column))| ArmParameter {
            name: name.clone(),
            unit: unit(*column),
            found: uncertain(joints + k),
        })
        .collect();
    let rows = equation.rows_per_drive();
    let norm = |of: &DVector<f64>, drive: usize| of.rows(drive * rows, rows).norm();
    Ok(Gains {
        gains,
        parameters,
        scale,
        centre: load.and_then(|_| equation.centre_distance(&estimate, &filter)),
        relative_error_per_joint: (0..joints)
            .map(|k| norm(&estimate.residuals, k) / norm(&equation.torque, k))
            .collect(),
    })
}
