//! Studies on simulated arms whose parameters are known, and the comparison of all methods on one
//! experiment.
//!
//! | module | content |
//! |---|---|
//! | [`study`] | a grid of noise, model errors, methods and seeds, and its results |
//! | [`comparison`] | all methods on one experiment, checked against published figures and limits |
//! | [`report`] | a comparison as text, Markdown, SVG and HTML |

pub mod comparison;
pub mod report;
pub mod study;
