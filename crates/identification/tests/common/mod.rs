//! Arms, loops and recordings that several tests use.

pub(crate) mod arm;
pub(crate) mod dataset;
pub(crate) mod looped;
