//! How the closed loop is simulated, and when the iteration ends.

use serde::{Deserialize, Serialize};

use super::error::IdentificationError;
use didim_dynamics::simulation::Integrator;
use didim_dynamics::trajectory::ReferenceInterpolation;

/// How the closed loop is simulated and its parameters found, by every method that simulates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulationOptions {
    /// Whether both sides of the equation pass the decimation filter; true unless stated. Without
    /// it, the paper's strict output error framework (its table 1), every counted sample is a row.
    pub decimated: bool,
    /// What the drive makes of its targets between two of them; cubic unless stated.
    pub reference: ReferenceInterpolation,
    /// How the simulation is integrated; ode3 unless stated.
    pub integrator: Integrator,
    /// Integration steps per period of the controller; 1 unless stated.
    pub substeps: u32,
    /// The parameters of the first simulation.
    pub start: Start,
    /// When the iteration ends. The simulations that differences add to each one do not count
    /// against its limit.
    pub convergence: ConvergenceLimits,
    /// DIDIM iterations before the first sensitivities of CLIE and CLOE, one simulation each: from
    /// a start far away, a step of DIDIM leads near, where the linearised loop does not. 0 unless
    /// stated, and less than the simulations that `convergence` allows.
    pub didim_steps: u32,
    /// Where CLIE and CLOE have their sensitivities from.
    pub sensitivities: SensitivityMethod,
    /// How CLIE and CLOE find the next parameters.
    pub optimiser: Optimiser,
    /// The linear steps of DIDIM, CLIE and CLOE, and their start, are of arms whose bodies can be,
    /// and this says what is known of them besides; any parameters when left out.
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
    /// Whether the iteration can begin and end.
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
    /// leaves a tenth of the difference or less, and a friction law that jumps leaves the
    /// simulation itself some hundredths.
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodiesFrom {
    /// The nominal parameters of the robot's file.
    Nominal,
    /// The mass of all moving links \[kg\], which the robot's geometry shares out.
    TotalMassKg(f64),
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
