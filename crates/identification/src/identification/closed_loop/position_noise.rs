//! Effect of position noise on the loop, which a simulation without noise misses.
//!
//! The controller differentiates the noise, the motors follow, and the joints shake. This softens
//! friction where it bends: the torque of the noisy loop has a part that is even in the noise, and
//! does not average out.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::simulator::Simulator;
use crate::identification::observation::filtered_motion;
use crate::identification::problem::{Context, IdentificationError, PositionFilter};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::control::ControlTiming;
use didim_dynamics::simulation::NoiseConfig;

/// Beyond this share of the Nyquist frequency, positions hold nothing but noise.
const MOTION_BAND: f64 = 0.4;

/// Chooses the noise: the same for every experiment, so that the same input gives the same result.
const NOISE_SEED: u64 = 1;

/// Torques of the loop with these parameters under half the noise of the positions and all of it,
/// the same noise otherwise, each samples × joints \[N·m\]. None under a continuous controller,
/// which measures nothing, or where the noisy loop fails.
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

/// Returns the standard deviation of the white noise of each motor's measured angle \[rad\]: the
/// content of the upper part of the band, beyond all motion, scaled up to the whole band. Samples
/// near outliers do not count.
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
