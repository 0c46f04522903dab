//! Simulation of the closed loop, and end of the iteration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::IdentificationError;
use didim_dynamics::simulation::Integrator;
use didim_dynamics::trajectory::ReferenceInterpolation;

/// Options of every method that simulates the closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationOptions {
    /// True if both sides of the equation pass the decimation filter. If false, every counted
    /// sample is a row.
    pub decimated: bool,
    /// Interpolation of the drive between two targets: a cubic, a straight line, or the target
    /// itself until the next.
    pub reference: ReferenceInterpolation,
    /// Integration method of the simulation: Bogacki and Shampine's third order, or the classical
    /// fourth.
    pub integrator: Integrator,
    /// Integration steps in one period of the controller.
    pub substeps: u32,
    /// The parameters of the first simulation: every drive inertia 1 kg·m² and all else 0; the
    /// nominal parameters of the robot file; the result of IDIM-LS.
    pub start: Start,
    /// When the iteration ends.
    ///
    /// If left out: as its defaults say.
    pub convergence: ConvergenceLimits,
    /// Iterations of DIDIM before the first sensitivities of CLIE and CLOE, for starts far away;
    /// less than `convergence.max_simulations`.
    pub didim_steps: u32,
    /// Source of the sensitivities of CLIE and CLOE: the variational equation of the loop, or
    /// one-sided differences.
    pub sensitivities: SensitivityMethod,
    /// Optimiser of CLIE and CLOE.
    pub optimiser: Optimiser,
    /// Restricts the linear steps of DIDIM, CLIE and CLOE to physically consistent parameters.
    /// `"nominal"`: near those of the robot file; `{ total_mass_kg = 27.0 }`: of this mass of all
    /// moving links in kg.
    ///
    /// If left out: any parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(rename = "bodies")]
    pub consistent_parameters: Option<BodiesFrom>,
}

impl Default for SimulationOptions {
    fn default() -> Self {
        Self {
            decimated: true,
            reference: ReferenceInterpolation::default(),
            integrator: Integrator::default(),
            substeps: 1,
            start: Start::default(),
            convergence: ConvergenceLimits::default(),
            didim_steps: 0,
            sensitivities: SensitivityMethod::default(),
            optimiser: Optimiser::default(),
            consistent_parameters: None,
        }
    }
}

impl SimulationOptions {
    /// Checks that the limits of the iteration are valid.
    ///
    /// # Errors
    /// [`IdentificationError::Convergence`] and [`IdentificationError::DidimSteps`].
    pub(crate) fn validate(&self) -> Result<(), IdentificationError> {
        self.convergence.validate()?;
        let (steps, max_simulations) = (self.didim_steps, self.convergence.max_simulations);
        if steps >= max_simulations {
            return Err(IdentificationError::DidimSteps { steps, max_simulations });
        }
        Ok(())
    }
}

/// The parameters of the first simulation. Parameters that are not identified are 0 in it, as in
/// all others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConvergenceLimits {
    /// Largest change of the error ‖y − Xθ‖ from one step to the next, relative to it, or to 0.1 %
    /// of ‖y‖ if the error is smaller \[share\].
    pub relative_error_change: f64,
    /// Largest difference between a parameter and the one that was simulated \[σ\].
    pub parameter_change: f64,
    /// Simulations after which there is no result, failed ones included; 2 at least.
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
    fn validate(&self) -> Result<(), IdentificationError> {
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

/// Prior knowledge of an arm's bodies, besides the data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodiesFrom {
    /// The nominal parameters of the robot's file.
    Nominal,
    /// The mass of all moving links \[kg\], which the robot's geometry shares out.
    TotalMassKg(f64),
}

/// Where the derivatives of the simulated signals with respect to the parameters come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensitivityMethod {
    /// The variational equation of the loop, integrated along with it: exact for the discrete loop
    /// but for friction that jumps, and part of one simulation.
    #[default]
    Exact,
    /// One-sided differences, the paper's: a further simulation per parameter.
    Differences,
}

/// Method of finding the next parameters from errors and sensitivities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_near_nominal_ones_or_of_a_mass() {
        let read = |text: &str| {
            toml::from_str::<SimulationOptions>(text).map(|read| read.consistent_parameters)
        };
        assert_eq!(read("").unwrap(), None);
        assert_eq!(read("bodies = \"nominal\"").unwrap(), Some(BodiesFrom::Nominal));
        let mass = Some(BodiesFrom::TotalMassKg(27.0));
        assert_eq!(read("bodies = { total_mass_kg = 27 }").unwrap(), mass);
        for wrong in ["bodies = \"cad\"", "bodies = 27", "bodies = { mass = 27 }"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
