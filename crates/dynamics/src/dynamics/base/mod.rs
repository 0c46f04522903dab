//! Base parameters: the smallest set of parameters that determines the dynamics.

mod error;
mod expression;
mod observation;
mod parameters;
mod selection;

pub use error::{BaseParametersError, UnknownBaseParameter};
pub use expression::format_sum;
pub use parameters::BaseParameters;
pub use selection::{ColumnSelection, select_columns};
