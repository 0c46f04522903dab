//! Positions that the encoders report.

use crate::robot::Transmission;

use super::white_noise::WhiteNoise;

/// Encoders on the motors, with noise and quantisation.
#[derive(Clone, Debug)]
pub(super) struct Encoders {
    transmission: Transmission,
    /// Width of a count \[rad\]; empty for ideal encoders.
    resolution_rad: Vec<f64>,
    noise: WhiteNoise,
}

impl Encoders {
    pub(super) fn new(
        transmission: Transmission,
        counts_per_turn: Option<&[u32]>,
        noise: WhiteNoise,
    ) -> Self {
        let resolution = |counts: &u32| core::f64::consts::TAU / f64::from(*counts);
        let resolution_rad = counts_per_turn.unwrap_or_default().iter().map(resolution).collect();
        Self { transmission, resolution_rad, noise }
    }

    /// Converts true joint positions to reported motor positions and the joint positions from them.
    pub(super) fn measure(&mut self, true_rad: &[f64], motor: &mut [f64], joint: &mut [f64]) {
        self.transmission.motor_position(true_rad, motor);
        self.noise.add_to(motor);
        for (angle, resolution) in motor.iter_mut().zip(&self.resolution_rad) {
            *angle = (*angle / resolution).round() * resolution;
        }
        self.transmission.joint_position(motor, joint);
    }

    /// Returns to the noise of the first sample.
    pub(super) fn restart(&mut self) {
        self.noise.restart();
    }

    pub(super) fn transmission(&self) -> &Transmission {
        &self.transmission
    }
}
