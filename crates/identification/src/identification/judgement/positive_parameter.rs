//! Parameters that cannot be negative.

use crate::identification::problem::Context;
use didim_dynamics::robot::{FrictionLaw, Parameter, ParameterKind};

/// Returns a selected parameter by its number.
pub(super) fn parameter(context: &Context<'_>, index: usize) -> Parameter {
    context.robot.parameters().parameters()[context.selection.columns()[index]]
}

/// Returns the name of a selected parameter, by its number, if the parameter cannot be negative.
pub(super) fn positive_quantity(context: &Context<'_>, index: usize) -> Option<&'static str> {
    use ParameterKind::{FvAsymmetric, FvCubic, FvQuadratic};

    let Parameter { kind, joint } = parameter(context, index);
    // In nonlinear viscous friction, the linear part may have either sign.
    let bends = |law: &FrictionLaw| matches!(law.kind(), FvQuadratic | FvCubic | FvAsymmetric);
    if kind == ParameterKind::Fv && context.robot.own_friction()[joint].laws.iter().any(bends) {
        return None;
    }
    match kind {
        ParameterKind::Ia => Some("drive inertia"),
        ParameterKind::Fv | ParameterKind::FvMotor => Some("viscous friction"),
        ParameterKind::Fc | ParameterKind::FcMotor => Some("Coulomb friction"),
        ParameterKind::FcLoad => Some("friction that grows with the load"),
        ParameterKind::Fs => Some("Stribeck friction"),
        ParameterKind::Fh => Some("friction that lags at reversals"),
        _ => None,
    }
}
