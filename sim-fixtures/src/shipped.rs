//! The scenarios that come with the program.

use didim_core::robot::Robot;

use crate::{Scenario, ScenarioError};

/// The paper's arm: its 28 essential parameters and nothing else, `scenarios/tx40-paper.toml`.
///
/// # Errors
/// None with the files as shipped; a test reads them.
pub fn tx40_paper() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-paper.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40.toml"))?,
    )
}

/// The same with errors that no model of it has, `scenarios/tx40-paper-errors.toml`.
///
/// # Errors
/// None with the files as shipped; a test reads them.
pub fn tx40_paper_errors() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-paper-errors.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40.toml"))?,
    )
}

/// The arm with physical links, `scenarios/tx40-physical.toml`.
///
/// # Errors
/// None with the files as shipped; a test reads them.
pub fn tx40_physical() -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(
        include_str!("../scenarios/tx40-physical.toml"),
        Robot::from_toml(include_str!("../../config/robots/tx40-physical.toml"))?,
    )
}
