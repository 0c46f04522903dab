//! Simulation of an arm without a bus. The record has the signals that the drives log, in full
//! precision.

use std::ops::Range;

use didim_sim::{Scenario, ScenarioError};

use didim::cell::Cell;
use didim::live::window_options::WindowOptionError;
use didim_formats::{Measurement, Side};

/// Reason why nothing was simulated for a cell.
#[derive(Debug, thiserror::Error)]
pub enum SimulatedError {
    /// Scenario and cell are for different robots. Choose a cell and a scenario of the same robot.
    #[error(
        "the scenario is for the robot `{simulated}`, the cell is one with `{described}`; choose a \
         cell or a scenario of the same robot"
    )]
    OtherRobot {
        /// Name of the scenario's robot.
        simulated: String,
        /// Name of the cell's robot.
        described: String,
    },
    /// The scenario's controller and the cell's bus have different periods. Choose a cell with the
    /// sample rate of the scenario.
    #[error(
        "the scenario's controller has {simulated_hz} samples/s, the cell's bus {cell_hz}; choose \
         a cell of the scenario's rate"
    )]
    OtherRate {
        /// Sample rate of the scenario's controller \[Hz\].
        simulated_hz: f64,
        /// Sample rate of the cell's bus \[Hz\].
        cell_hz: f64,
    },
    /// The window margins of the cell are invalid at this sample rate.
    #[error(transparent)]
    Window(#[from] WindowOptionError),
    /// The arm cannot be simulated.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Simulates a scenario's experiment. Returns the measurement, and the range of the samples that
/// count, which are those of the motion. The arm rests before and after the motion for the margins
/// of the cell's window.
///
/// # Errors
/// [`SimulatedError`], if the scenario does not fit the cell or cannot be simulated.
pub fn simulate(
    scenario: &Scenario,
    cell: &Cell,
) -> Result<(Measurement, Range<usize>), SimulatedError> {
    check_fit(scenario, cell)?;
    let margins = cell.window.plan(cell.sample_rate_hz())?;
    let (before, after) = (margins.margin_before, margins.margin_after);
    let record = scenario.record_with_rests(before, after)?;
    let measurement =
        Measurement { side: Side::Motor, signals: record.motor_signals(), rate_unchecked: false };
    Ok((measurement, before..before + scenario.samples()))
}

/// Checks that the scenario and the cell are for the same robot.
pub fn check_robot(scenario: &Scenario, cell: &Cell) -> Result<(), SimulatedError> {
    let (simulated, described) = (scenario.robot().name(), cell.robot.name());
    if simulated == described {
        return Ok(());
    }
    let (simulated, described) = (simulated.to_owned(), described.to_owned());
    Err(SimulatedError::OtherRobot { simulated, described })
}

/// Checks that the scenario and the cell have the same robot and the same sample rate.
pub(crate) fn check_fit(scenario: &Scenario, cell: &Cell) -> Result<(), SimulatedError> {
    check_robot(scenario, cell)?;
    let simulated_hz = scenario.controller().timing.sample_period_s().recip();
    let cell_hz = cell.sample_rate_hz();
    if (simulated_hz / cell_hz - 1.0).abs() > 1e-9 {
        return Err(SimulatedError::OtherRate { simulated_hz, cell_hz });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use didim::cell::Library;

    fn cell(path: &str) -> Cell {
        Cell::from_library(Library::SHIPPED, Path::new(path)).unwrap()
    }

    #[test]
    fn the_motion_counts_and_the_rests_are_margin() {
        let scenario = didim_sim::tx40_paper().unwrap();
        let cell = cell("config/cells/tx40-packed-fd.toml");
        let (measurement, counted) = simulate(&scenario, &cell).unwrap();
        assert_eq!(measurement.samples(), 1250 + 34_500 + 1250);
        assert_eq!(counted, 1250..1250 + 34_500);
        let reference = &measurement.signals.reference_rad.unwrap()[0];
        assert!(reference[..1250].iter().all(|q| q.to_bits() == reference[0].to_bits()));
        assert!(reference[counted].iter().any(|q| (q - reference[0]).abs() > 1.0));
    }

    #[test]
    fn a_bus_of_another_rate_is_refused() {
        let scenario = didim_sim::tx40_paper().unwrap();
        let error = simulate(&scenario, &cell("config/cells/tx40-cia402.toml")).unwrap_err();
        assert!(error.to_string().contains("5000"), "{error}");
        assert!(error.to_string().contains("bus 500;"), "{error}");
    }
}
