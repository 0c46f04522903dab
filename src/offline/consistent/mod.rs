//! A stored result as a model that bodies can have, in the formats of other tools.

mod format;
mod model;
mod record;

pub use format::{Exported, Format, WriteError};
pub use model::{Consistent, ConsistentError};
