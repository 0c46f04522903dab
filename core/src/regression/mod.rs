//! Tall linear least squares with the statistics of its result.
