//! Gains and parameters, as they are shown.

use nalgebra::DVector;
use serde::Serialize;

use super::equation::Equation;
use super::error::GainsError;
use super::load::KnownLoad;
use crate::identification::payload::{MahalanobisDistance, UncertainValue};
use crate::identification::problem::{Context, Experiment, Method, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{JointIndex, Robot, Transmission};

/// The gain of one drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriveGain {
    /// Its joint.
    pub joint: JointIndex,
    /// True torque over the torque by the configured gain; negative if the configured sign is
    /// wrong, `None` if the records do not distinguish it from infinity.
    pub factor: Option<UncertainValue>,
    /// The same by total least squares alone.
    pub total_least_squares: f64,
}

/// A base parameter of the arm without load, by the gains that are found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    #[serde(flatten)]
    pub found: UncertainValue,
}

/// Scale of gains and parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// The mass of a load.
    Load(KnownLoad),
    /// Without a load, the configured gain of the drive of this joint, which is taken as
    /// right.
    Reference(JointIndex),
}

/// Gains and parameters of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// One entry per drive.
    pub gains: Vec<DriveGain>,
    /// Parameters of the arm without load.
    pub parameters: Vec<ArmParameter>,
    /// Source of their scale.
    #[serde(flatten)]
    pub scale: Scale,
    /// Distance of the configured centre from the one in the records; `None` if they do not
    /// identify it.
    pub centre: Option<MahalanobisDistance>,
    /// Unexplained part of each drive's torque, ‖residuals‖ / ‖torque‖.
    pub relative_error_per_joint: Vec<f64>,
}

/// The torque gains of all drives and the base parameters χ, from a record of the arm empty and,
/// where there is one, one with a load of known mass and centre:
///
/// ```text
/// g_k t_k = W_k χ              empty
/// g_k t_k = W_k χ + w_k + J_k  with the load
/// ```
///
/// w is the torque of the load's mass at its centre, J that of its inertia about the centre, which
/// nobody knows, and t what is measured, by the stated gains. Total least squares give the start
/// and the noise in the measured torques alone the estimate. Torques are those of the motors of a
/// transmission, or, without one, of the joints. Uncertainties are of the noise: neither of what
/// the model lacks nor of how well the load is known, to whose mass all gains and parameters are
/// proportional. Without a load the scale is that of one drive.
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
    let load = load_rows.map(|(_, load)| load);
    if let Some(KnownLoad { mass_kg, centre_m }) = load
        && !(mass_kg.is_finite() && mass_kg > 0.0 && centre_m.iter().all(|of| of.is_finite()))
    {
        return Err(GainsError::Load { mass_kg, centre_m });
    }
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
