//! Scenarios shipped with the program.

use didim_dynamics::robot::Robot;

use crate::{Scenario, ScenarioError};

/// Names of the shipped scenarios.
pub const SHIPPED_SCENARIOS: [&str; 3] = ["tx40-paper", "tx40-paper-errors", "tx40-physical"];

/// Returns a shipped scenario by its name; `None` if no scenario has this name.
pub fn shipped(name: &str) -> Option<Result<Scenario, ScenarioError>> {
    match name {
        "tx40-paper" => Some(tx40_paper()),
        "tx40-paper-errors" => Some(tx40_paper_errors()),
        "tx40-physical" => Some(tx40_physical()),
        _ => None,
    }
}

/// Returns the scenario of the paper's arm, `scenarios/tx40-paper.toml`. The arm has the 28
/// essential parameters of the paper and no others.
///
/// # Errors
/// No error with the shipped files; a test reads them.
pub fn tx40_paper() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-paper.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40.toml"))?,
    )
}

/// Returns the scenario of the paper's arm with errors that none of its models contains,
/// `scenarios/tx40-paper-errors.toml`.
///
/// # Errors
/// No error with the shipped files; a test reads them.
pub fn tx40_paper_errors() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-paper-errors.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40.toml"))?,
    )
}

/// Returns the scenario of an arm with physically consistent links, `scenarios/tx40-physical.toml`.
///
/// # Errors
/// No error with the shipped files; a test reads them.
pub fn tx40_physical() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-physical.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40-physical.toml"))?,
    )
}
