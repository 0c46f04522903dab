//! Identification of an experiment by any of the methods.

use super::closed_loop::{clie, cloe, didim, idim_iv};
use super::equation_error::{idim_ls, settle_loads};
use super::judgement::Identification;
use super::problem::{Context, Experiment, IdentificationError, Method, Options};
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Identifies the base parameters of a robot from an experiment.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn identify(
    method: Method,
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
) -> Result<Identification, IdentificationError> {
    let mut context = Context::new(robot, base, experiment, options, method)?;
    settle_loads(&mut context)?;
    match method {
        Method::IdimLs => idim_ls(&context),
        Method::IdimIv => idim_iv(&context),
        Method::Clie => clie(&context),
        Method::Cloe => cloe(&context),
        Method::Didim => didim(&context),
    }
}
