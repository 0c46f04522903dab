//! The loads that friction grows with: those of the arm that is identified.

use super::fit::EquationErrorFit;
use crate::identification::given::{Context, IdentificationError};
use crate::robot::ParameterKind;

/// Gives a context's model the loads of its own estimate by IDIM-LS, where friction grows with them.
///
/// The columns of this friction need the loads, and the loads the estimate: equation and estimate are made in turn,
/// beginning without such friction.
///
/// # Errors
/// Those of IDIM-LS.
pub(crate) fn settle_loads(context: &mut Context<'_>) -> Result<(), IdentificationError> {
    if !context.model.feels_loads() {
        return Ok(());
    }
    let all = context.selection.clone();
    context.selection = all.without(ParameterKind::FcLoad);
    let first = EquationErrorFit::new(context)?;
    context.set_loads(&first.weighted.solution.parameters);
    context.selection = all;
    context.settle_loads(|context| Ok(EquationErrorFit::new(context)?.weighted.solution.parameters))
}
