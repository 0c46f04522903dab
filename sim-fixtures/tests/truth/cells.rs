//! What is simulated: parameters, noise and its colour.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::simulation::NoiseConfig;
use didim_sim::{Scenario, tx40_paper, tx40_physical};

use crate::common::experiment::listed;

/// Which arm, and which of its parameters are identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Parameters {
    /// The paper's arm, its 28 essential parameters.
    Paper,
    /// The arm with physical links, all 60 base parameters.
    Physical,
}

/// How much noise, as the literature has it for this arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Noise {
    /// The encoders' grid and a disturbance of 0.05 N·m.
    Low,
    /// The encoders' grid, positions with 1e-3 deg and a disturbance of 0.10 N·m.
    High,
}

/// Correlation time of the coloured disturbance \[s\]: 8 Hz, in the middle of what is identified.
const CORRELATION_S: f64 = 0.020;
/// Position noise of the high level, on the joint side.
const POSITION_NOISE_DEG: f64 = 1e-3;

/// One cell of the study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell {
    pub(crate) parameters: Parameters,
    pub(crate) noise: Noise,
    pub(crate) coloured: bool,
}

impl Cell {
    /// Every cell, in the order of the table.
    pub(crate) fn read_all() -> Vec<Self> {
        let mut cells = Vec::new();
        for parameters in [Parameters::Paper, Parameters::Physical] {
            for noise in [Noise::Low, Noise::High] {
                for coloured in [false, true] {
                    cells.push(Self { parameters, noise, coloured });
                }
            }
        }
        cells
    }

    /// Its first three columns.
    pub(crate) fn columns(self) -> [String; 3] {
        let parameters = match self.parameters {
            Parameters::Paper => "28, paper",
            Parameters::Physical => "60, physical",
        };
        let noise = if self.noise == Noise::Low { "low" } else { "high" };
        let colour = if self.coloured { "coloured" } else { "white" };
        [parameters, noise, colour].map(str::to_owned)
    }

    /// The scenario with a seed of its noise.
    pub(crate) fn scenario(self, seed: u64) -> Scenario {
        let scenario = self.parameters.scenario();
        let disturbance_nm = if self.noise == Noise::Low { 0.05 } else { 0.10 };
        // Noise belongs to encoders, which sit on the motors. Joint 6, whose angle is motor 6's
        // less joint 5's, gets both: √2 times the noise of the others.
        let motor_position_rad = (self.noise == Noise::High).then(|| {
            let joint = POSITION_NOISE_DEG.to_radians();
            let transmission = scenario.robot().transmission();
            (0..scenario.robot().joints())
                .map(|motor| joint * transmission.row(motor)[motor].abs())
                .collect()
        });
        let noise = NoiseConfig {
            motor_position_rad,
            disturbance_torque_nm: Some(vec![disturbance_nm; scenario.robot().joints()]),
            disturbance_correlation_s: self.coloured.then_some(CORRELATION_S),
            ..NoiseConfig::with_seed(seed)
        };
        scenario.with_noise(noise).unwrap()
    }
}

impl Parameters {
    /// The scenario as shipped.
    pub(crate) fn scenario(self) -> Scenario {
        match self {
            Self::Paper => tx40_paper().unwrap(),
            Self::Physical => tx40_physical().unwrap(),
        }
    }

    /// Names of those that are identified.
    pub(crate) fn names(self) -> Vec<String> {
        match self {
            Self::Paper => listed(&self.scenario()),
            Self::Physical => self.base().names().to_vec(),
        }
    }

    /// The base parameters of the arm.
    pub(crate) fn base(self) -> BaseParameters {
        BaseParameters::compute(&Model::new(self.scenario().robot())).unwrap()
    }
}
