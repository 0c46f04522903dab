//! Loads that determine the load-dependent friction, from the estimate itself.

use super::fit::EquationErrorFit;
use crate::identification::problem::{Context, IdentificationError};
use didim_dynamics::robot::ParameterKind;

/// Sets the loads of a context's model to those of its own IDIM-LS estimate, if friction depends on
/// them.
///
/// The columns of load-dependent friction require the loads, and the loads require the estimate. So
/// equation and estimate are computed in turn, starting without load-dependent friction.
///
/// # Errors
/// Those of IDIM-LS.
pub(crate) fn settle_loads(context: &mut Context<'_>) -> Result<(), IdentificationError> {
    if !context.model.feels_loads() {
        return Ok(());
    }
    let selection = context.selection.clone();
    context.selection = selection.without_kind(ParameterKind::FcLoad);
    let first = EquationErrorFit::new(context)?;
    context.set_loads(&first.weighting.solution.parameters);
    context.selection = selection;
    context
        .settle_loads(|context| Ok(EquationErrorFit::new(context)?.weighting.solution.parameters))
}
