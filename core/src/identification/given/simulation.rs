//! What a person decides about DIDIM.

use serde::{Deserialize, Serialize};

use crate::control::SimulatedController;
use crate::identification::closed_loop::simulator::LoopOptions;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::options::IdimLsOptions;
use crate::simulation::Integrator;
use crate::trajectory::ReferenceInterpolation;

/// Options of [`didim`](crate::identification::didim()), as a cell file states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DidimOptions {
    /// Parameters, decimation filter and limits of the result; and the equation error that gives
    /// weights, initial state, and start and reference where these are taken from it.
    pub regression: IdimLsOptions,
    /// Whether regressor and torque pass the decimation filter; true unless stated. Without it,
    /// the paper's strict output error framework (its Table 1), every counted sample is a row.
    #[serde(default = "yes")]
    pub decimated: bool,
    /// What controls the simulated arm. No default: it decides how the arm moves.
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
    /// When the iteration ends.
    #[serde(default)]
    pub convergence: ConvergenceLimits,
}

impl DidimOptions {
    pub(crate) fn loop_options(&self) -> LoopOptions<'_> {
        LoopOptions {
            controller: &self.controller,
            reference: self.reference,
            integrator: self.integrator,
            substeps: self.substeps,
        }
    }
}

/// The parameters of the first simulation. Parameters that are not identified are 0 in it, as in
/// all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Every motor's inertia is 1 kg·m² at its joint and everything else 0: the paper's start. A
    /// motor that also moves another joint adds to what that joint's drive inertia stands for,
    /// which is why the paper has ia_5 = 2.
    UnitDriveInertias,
    /// The nominal parameters of the robot's file.
    Nominal,
    /// The result of IDIM-LS on the same experiment.
    #[default]
    IdimLs,
}

/// The iteration ends when a step changes the estimates by no more than this.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConvergenceLimits {
    /// Largest change of the error ‖y − Xθ‖ from one step to the next, relative to it, or to 0.1 %
    /// of ‖y‖ where it is less; 0.01.
    pub relative_error_change: f64,
    /// Largest difference between any parameter and the one that was simulated, in standard
    /// deviations of the parameter under the weights of IDIM-LS; 0.2. A step
    /// leaves a tenth of the difference or less, and a friction law that jumps leaves the simulation
    /// itself some hundredths.
    pub parameter_change: f64,
    /// Simulations after which there is no result, failed ones included; 30.
    pub max_simulations: u32,
}

impl Default for ConvergenceLimits {
    fn default() -> Self {
        Self { relative_error_change: 0.01, parameter_change: 0.2, max_simulations: 30 }
    }
}

impl ConvergenceLimits {
    /// # Errors
    /// [`IdentificationError::Convergence`]: convergence takes two steps and limits above 0.
    pub(crate) fn validate(&self) -> Result<(), IdentificationError> {
        for (key, value) in [
            ("relative_error_change", self.relative_error_change),
            ("parameter_change", self.parameter_change),
        ] {
            if !(value.is_finite() && value > 0.0) {
                let expected = "finite and greater than 0";
                return Err(IdentificationError::Convergence { key, value, expected });
            }
        }
        if self.max_simulations < 2 {
            let (key, value) = ("max_simulations", f64::from(self.max_simulations));
            return Err(IdentificationError::Convergence { key, value, expected: "at least 2" });
        }
        Ok(())
    }
}

fn yes() -> bool {
    true
}

fn one() -> u32 {
    1
}
