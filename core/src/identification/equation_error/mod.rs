//! Methods whose error is that of the inverse dynamic model along the measured motion.

pub(crate) mod idim_ls;
pub(crate) mod reduction;
pub(crate) mod unchecked;
pub(crate) mod weighting;
