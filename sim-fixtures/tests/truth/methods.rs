//! What is held against the truth.

use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;
use didim_identification::identification::{self, Estimate, Experiment, Start};
use didim_sim::tx40_paper;

use super::cells::{Cell, Noise};
use super::deviations::Limit;
use crate::common::experiment::{loop_options, regression};

type Identify = dyn Fn(&Robot, &BaseParameters, &Experiment, &[String]) -> Estimate + Sync;

/// A method with its options.
pub(crate) struct Method {
    /// As the tables call it.
    pub(crate) name: &'static str,
    /// The estimate of the named parameters.
    pub(crate) identify: Box<Identify>,
    /// Whether its position filter is known to distort the motion at low noise.
    pub(crate) distorts: bool,
    /// Whether it simulates the closed loop.
    pub(crate) simulates: bool,
    /// Limits that it is known to miss in a cell. The reason stands in the table.
    pub(crate) excused: fn(Cell) -> &'static [Limit],
}

/// Every method of the tables. A further one is a further entry.
pub(crate) fn methods() -> Vec<Method> {
    vec![
        least_squares("IDIM-LS, 200 Hz", 200.0, excused_200_hz),
        least_squares("IDIM-LS, 50 Hz", 50.0, |_| &Limit::ALL),
        simulated("DIDIM", excused_in_the_loop),
    ]
}

fn excused_200_hz(cell: Cell) -> &'static [Limit] {
    match cell {
        // The noise of the measured velocity softens the reversal of friction in the regressor.
        Cell { noise: Noise::High, coloured: false, .. } => &[Limit::Mean],
        _ => &[],
    }
}

fn excused_in_the_loop(cell: Cell) -> &'static [Limit] {
    match cell {
        // The controller differentiates the noise of the positions and shakes the arm, which
        // softens its friction; the simulated loop has no noise.
        Cell { noise: Noise::High, coloured: false, .. } => &[Limit::Mean],
        _ => &[],
    }
}

/// DIDIM with the gains of the simulated arm's controller. Where it starts does not matter to where
/// it ends; IDIM-LS is the fastest start.
pub(crate) fn simulated(name: &'static str, excused: fn(Cell) -> &'static [Limit]) -> Method {
    let identify = |robot: &Robot, base: &BaseParameters, experiment: &_, names: &[_]| {
        let arm = tx40_paper().unwrap();
        let mut options = loop_options(&arm, 200.0, Start::IdimLs);
        options.parameters = Some(names.to_vec());
        identification::identify(identification::Method::Didim, robot, base, experiment, &options)
            .unwrap()
            .estimate
    };
    Method { name, identify: Box::new(identify), distorts: false, simulates: true, excused }
}

/// IDIM-LS with a position filter that cuts at this frequency \[Hz\].
pub(crate) fn least_squares(
    name: &'static str,
    cutoff_hz: f64,
    excused: fn(Cell) -> &'static [Limit],
) -> Method {
    let identify = move |robot: &Robot, base: &BaseParameters, experiment: &_, names: &[_]| {
        identification::identify(
            identification::Method::IdimLs,
            robot,
            base,
            experiment,
            &regression(Some(names.to_vec()), cutoff_hz),
        )
        .unwrap()
        .estimate
    };
    let distorts = cutoff_hz < 100.0;
    Method { name, identify: Box::new(identify), distorts, simulates: false, excused }
}
