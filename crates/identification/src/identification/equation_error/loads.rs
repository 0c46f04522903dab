//! The loads that friction grows with: those of the arm that is identified.

use super::fit::EquationErrorFit;
use crate::identification::problem::{Context, IdentificationError};
use didim_dynamics::robot::ParameterKind;

/// Gives a context's model the loads of its own estimate by IDIM-LS, where friction grows with
/// them.
///
/// The columns of this friction need the loads, and the loads the estimate: equation and estimate
/// are made in turn, beginning without such friction.
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
