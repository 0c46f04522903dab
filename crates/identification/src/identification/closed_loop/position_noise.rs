//! Effect of position noise on the closed loop, which a simulation without noise does not contain.
//!
//! The controller differentiates the noise, and the motors shake the joints. This smooths friction
//! where it is nonlinear. So the torque of the noisy loop has a component that is even in the noise
//! and does not average out.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::simulator::Simulator;
use crate::identification::observation::filtered_motion;
use crate::identification::problem::{Context, IdentificationError, PositionFilter};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::control::ControlTiming;
use didim_dynamics::simulation::NoiseConfig;

/// Frequency, as a share of the Nyquist frequency, above which positions contain noise only.
const MOTION_BAND: f64 = 0.4;

/// Seed of the noise, the same for every experiment, so that the same input gives the same result.
const NOISE_SEED: u64 = 1;

/// Returns the torques of the loop with these parameters, simulated with half of the position noise
/// and with all of it (the same random sequence), each samples × joints \[N·m\]. Returns `None` for
/// a continuous controller, which has no sampled measurement, or if the noisy loop fails.
pub(super) fn noisy_torques(
    context: &Context<'_>,
    simulator: &Simulator<'_>,
    parameters: &DVector<f64>,
    outliers: &[Range<usize>],
) -> Result<Option<[DMatrix<f64>; 2]>, IdentificationError> {
    if matches!(simulator.timing(), ControlTiming::Continuous { .. }) {
        return Ok(None);
    }
    let level = motor_noise(context, outliers)?;
    let noises = [0.5, 1.0].map(|share| NoiseConfig {
        motor_position_rad: Some(level.iter().map(|level| share * level).collect()),
        ..NoiseConfig::with_seed(NOISE_SEED)
    });
    Ok(simulator.torques_with_noise(parameters, noises)?.ok())
}

/// Returns the standard deviation of the white noise of each motor's measured angle \[rad\]. It is
/// computed from the upper part of the frequency band, above all motion, and scaled to the complete
/// band. Samples near outliers are ignored.
fn motor_noise(
    context: &Context<'_>,
    outliers: &[Range<usize>],
) -> Result<Vec<f64>, IdentificationError> {
    let Context { robot, experiment, options, .. } = context;
    let (joints, filter) = (robot.joints(), options.position_filter);
    let cutoff_hz = MOTION_BAND * 0.5 * experiment.sample_rate_hz();
    let motion = filtered_motion(robot, experiment, &PositionFilter { cutoff_hz, ..filter })?;
    let noise = experiment.position_rad() - motion.position;
    let mut sums = vec![0.0; joints];
    let (mut joint, mut motor) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    let sound = |k: &usize| !outliers.iter().any(|range| range.contains(k));
    let sound: Vec<usize> = experiment.counted_samples().filter(sound).collect();
    for &k in &sound {
        for (value, entry) in joint.iter_mut().zip(noise.row(k).iter()) {
            *value = *entry;
        }
        robot.transmission().motor_position(&joint[..joints], &mut motor[..joints]);
        for (sum, value) in sums.iter_mut().zip(&motor) {
            *sum += value * value;
        }
    }
    let samples = sound.len() as f64;
    Ok(sums.into_iter().map(|sum| (sum / samples / (1.0 - MOTION_BAND)).sqrt()).collect())
}
