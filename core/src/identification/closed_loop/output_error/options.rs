//! What a person decides about CLIE and CLOE.

use serde::{Deserialize, Serialize};

use crate::control::SimulatedController;
use crate::identification::closed_loop::simulator::LoopOptions;
use crate::identification::given::options::IdimLsOptions;
use crate::identification::given::simulation::{ConvergenceLimits, DidimOptions, Start};
use crate::simulation::Integrator;
use crate::trajectory::ReferenceInterpolation;

/// Options of [`clie`](crate::identification::clie()) and [`cloe`](crate::identification::cloe()), as a cell file states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputErrorOptions {
    /// Parameters, decimation filter and limits of the result; and the equation error that gives
    /// initial state, weights of the torques, and start and reference where these are taken from it.
    pub regression: IdimLsOptions,
    /// Whether errors and sensitivities pass the decimation filter; true unless stated. Without it,
    /// the paper's strict output error framework (its Table 1), every counted sample is a row.
    #[serde(default = "yes")]
    pub decimated: bool,
    /// What controls the simulated arm. Its gains are fixed through all simulations: those that
    /// follow an inertia take the one of IDIM-LS. No default: it decides how the arm moves.
    pub controller: SimulatedController,
    /// What the drive makes of its targets between two of them; cubic unless stated.
    #[serde(default)]
    pub reference: ReferenceInterpolation,
    /// How the simulation is integrated; ode3 unless stated.
    #[serde(default)]
    pub integrator: Integrator,
    /// Integration steps per period of the controller; 1 unless stated.
    #[serde(default = "one")]
    pub substeps: u32,
    /// The parameters of the first simulation.
    #[serde(default)]
    pub start: Start,
    /// DIDIM iterations before the first sensitivities, one simulation each: from a start far away,
    /// a step of DIDIM leads near, where the linearised loop does not. 0 unless stated, and less than
    /// the simulations that `convergence` allows.
    #[serde(default)]
    pub didim_steps: u32,
    /// Where the sensitivities come from.
    #[serde(default)]
    pub sensitivities: SensitivityMethod,
    /// How the next parameters are found.
    #[serde(default)]
    pub optimiser: Optimiser,
    /// When the iteration ends. The simulations that differences add to each one do not count
    /// against its limit.
    #[serde(default)]
    pub convergence: ConvergenceLimits,
}

/// Where the derivatives of the simulated signals with respect to the parameters come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensitivityMethod {
    /// The variational equation of the loop, integrated along with it: exact for the discrete loop
    /// but for friction that jumps, and part of one simulation.
    #[default]
    Exact,
    /// One-sided differences, the paper's: a further simulation per parameter.
    Differences,
}

/// How the next parameters are found from errors and sensitivities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Optimiser {
    /// Damped by each column's length (Marquardt, *J. SIAM* 11, 1963); more after a step that does
    /// not lower the criterion or cannot be simulated, less after one that does.
    #[default]
    LevenbergMarquardt,
    /// The linear least-squares step (equation 15), halved while it does not lower the criterion or
    /// cannot be simulated.
    GaussNewton,
}

impl OutputErrorOptions {
    /// The same loop, rows, start and limits as DIDIM's, without a step of DIDIM before.
    pub fn of_loop(
        options: DidimOptions,
        sensitivities: SensitivityMethod,
        optimiser: Optimiser,
    ) -> Self {
        let DidimOptions {
            regression,
            decimated,
            controller,
            reference,
            integrator,
            substeps,
            start,
            convergence,
        } = options;
        Self {
            regression,
            decimated,
            controller,
            reference,
            integrator,
            substeps,
            start,
            didim_steps: 0,
            sensitivities,
            optimiser,
            convergence,
        }
    }

    pub(super) fn loop_options(&self) -> LoopOptions<'_> {
        LoopOptions {
            controller: &self.controller,
            reference: self.reference,
            integrator: self.integrator,
            substeps: self.substeps,
        }
    }
}

fn yes() -> bool {
    true
}

fn one() -> u32 {
    1
}
