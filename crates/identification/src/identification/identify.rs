//! Identification of an experiment by any of the methods.

use super::closed_loop::{clie, cloe, didim, idim_iv};
use super::equation_error::{UncheckedParameter, idim_ls, idim_ls_unchecked, settle_loads};
use super::judgement::{Identification, ParameterEstimate};
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

/// Returns the same parameters without a verdict. Only IDIM-LS leaves out the checks, which take
/// most of its time; the time of the other methods goes into simulations.
///
/// # Errors
/// Those of [`identify`].
pub fn identify_unchecked(
    method: Method,
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
) -> Result<Vec<UncheckedParameter>, IdentificationError> {
    if method == Method::IdimLs {
        return Ok(idim_ls_unchecked(robot, base, experiment, options)?.parameters);
    }
    let checked = identify(method, robot, base, experiment, options)?.estimate.parameters;
    let unchecked = |parameter: ParameterEstimate| UncheckedParameter {
        name: parameter.name,
        value: parameter.value,
        standard_deviation: parameter.standard_deviation,
    };
    Ok(checked.into_iter().map(unchecked).collect())
}
