//! A stored result as a physically consistent model, in the formats of other tools.

mod format;
mod model;
mod record;

pub use format::{Exported, Format, NO_FRICTION, WriteError};
pub use model::{ConsistentError, ConsistentModel};
