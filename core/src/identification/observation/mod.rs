//! What was observed: the motion, and both sides of the equation along it.

pub(crate) mod filtered_positions;
pub(crate) mod matrix;
pub(crate) mod prefilter;
