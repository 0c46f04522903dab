//! Parameters of the first simulation.

use nalgebra::DVector;

use super::consistent_parameters::ConsistentParameters;
use super::inertia::ball_columns;
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::problem::{Context, IdentificationError, Start};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};

/// Returns a value for every selected parameter; the values are physically consistent if the steps
/// are restricted to such parameters.
pub(super) fn start_parameters(
    context: &Context<'_>,
    fit: &EquationErrorFit,
    consistent_parameters: Option<&ConsistentParameters>,
) -> Result<DVector<f64>, IdentificationError> {
    let start = chosen_start(context, fit)?;
    consistent_parameters
        .map_or(Ok(start.clone()), |body_list| Ok(body_list.start_parameters(&start)?.parameters))
}

fn chosen_start(
    context: &Context<'_>,
    fit: &EquationErrorFit,
) -> Result<DVector<f64>, IdentificationError> {
    let Context { robot, base, selection, .. } = context;
    let standard = match context.options.simulation.start {
        Start::IdimLs => return Ok(fit.weighting.solution.parameters.clone()),
        Start::Nominal => match robot.nominal() {
            Some(nominal) => nominal.standard_parameters().to_vec(),
            None => {
                let robot = robot.name().to_owned();
                return Err(IdentificationError::NoNominalParameters { robot });
            }
        },
        Start::UnitDriveInertias => unit_drive_inertias(robot),
    };
    let mut start = selection.of_base(base, &base.to_base(&standard));
    if context.model.feels_loads() && context.options.simulation.start == Start::UnitDriveInertias {
        // Without weight there is no load on which friction could depend.
        let starts = fit.weighting.solution.parameters.iter().zip(selection.kinds());
        for (start, (value, kind)) in start.iter_mut().zip(starts) {
            if matches!(
                kind,
                ParameterKind::Mx | ParameterKind::My | ParameterKind::Mz | ParameterKind::M
            ) {
                *start = *value;
            }
        }
    }
    Ok(start)
}

/// Returns the standard parameters of an arm whose motors have an inertia of 1 kg·m² at their
/// joints. If a joint has no drive inertia in the model, its link has the same inertia about every
/// axis instead; the link of a prismatic joint has a mass of 1 kg.
///
/// If the motor of joint j moves no other joint, the parameter ia_j also includes the inertia of
/// the motors i that move joint j: s_ij² ia_i each. So ia_j = 1 + Σ s_ij². Here s_ij is the
/// rotation of motor i per rotation of joint j, divided by its rotation per rotation of its own
/// joint i.
fn unit_drive_inertias(robot: &Robot) -> Vec<f64> {
    let (table, transmission) = (robot.parameters(), robot.transmission());
    let has_inertia =
        |motor: usize| table.column(ParameterKind::Ia, JointIndex::new(motor)).is_some();
    let value = |joint: usize| {
        let others = (0..robot.joints()).filter(|&motor| {
            motor != joint && has_inertia(motor) && !transmission.is_coupled(joint)
        });
        1.0 + others.map(|motor| transmission.direction(motor)[joint].powi(2)).sum::<f64>()
    };
    let mut standard = vec![0.0; table.parameters().len()];
    for joint in 0..robot.joints() {
        match table.column(ParameterKind::Ia, JointIndex::new(joint)) {
            Some(column) => standard[column] = value(joint),
            None => ball_columns(robot, joint).for_each(|column| standard[column] = 1.0),
        }
    }
    standard
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "ones and zeros")]
mod tests {
    use super::*;

    #[test]
    fn the_tx40_starts_where_the_paper_does() {
        let robot =
            Robot::from_toml(include_str!("../../../../../config/robots/tx40.toml")).unwrap();
        let standard = unit_drive_inertias(&robot);
        for (parameter, value) in robot.parameters().parameters().iter().zip(standard) {
            let expected = match (parameter.kind, parameter.joint.position()) {
                (ParameterKind::Ia, 4) => 2.0,
                (ParameterKind::Ia, _) => 1.0,
                _ => 0.0,
            };
            assert_eq!(value, expected, "{parameter}");
        }
    }
}
