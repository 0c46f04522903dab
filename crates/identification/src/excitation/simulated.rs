//! Simulated recording of a motion.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::series::Course;
use super::task::Task;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};

/// White noise of the torques of a simulated recording.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueNoise {
    /// Standard deviation of a sample, by joint \[N·m or N\].
    pub deviations: Vec<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Seed of [`simulate_record`].
const RECORD_SEED: u64 = 1;

/// Returns positions \[rad or m\] and torques \[N·m or N\] of each joint like [`simulate_motion`].
/// The noise is scaled so that rows have the noise of the task. The random numbers are the same in
/// every call.
pub fn simulate_record(
    task: &Task,
    parameters: &[f64],
    motion: &dyn Course,
    rate_hz: f64,
    rest: usize,
) -> [Vec<Vec<f64>>; 2] {
    // A row is the mean of this number of independent samples.
    let samples_per_row = rate_hz / task.noise.rows_per_s;
    let deviations = task.noise.deviations.iter().map(|of_row| of_row * samples_per_row.sqrt());
    let noise = TorqueNoise { deviations: deviations.collect(), seed: RECORD_SEED };
    simulate_motion((&task.model, parameters), motion, (rate_hz, rest), &noise)
}

/// Returns positions \[rad or m\] and torques \[N·m or N\] of each joint of an arm that follows a
/// motion exactly, at `rate_hz` samples per second. `rest` samples at rest precede and follow the
/// motion. The torques are those of the standard parameters with noise.
pub fn simulate_motion(
    (model, parameters): (&Model, &[f64]),
    motion: &dyn Course,
    (rate_hz, rest): (f64, usize),
    noise: &TorqueNoise,
) -> [Vec<Vec<f64>>; 2] {
    let n = model.joints();
    let mut random = ChaCha8Rng::seed_from_u64(noise.seed);
    let mut workspace = Workspace::new();
    let mut torque = [0.0; MAX_JOINTS];
    let mut history = model.history();
    let [mut positions, mut torques] = [vec![Vec::new(); n], vec![Vec::new(); n]];
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a motion has far fewer samples than 2^52"
    )]
    let samples = (motion.duration_s() * rate_hz) as usize;
    for k in 0..samples + 2 * rest {
        let state = motion.state((k as f64 - rest as f64) / rate_hz);
        let [q, dq, ddq] = [&state.position[..n], &state.velocity[..n], &state.acceleration[..n]];
        workspace.set_hysteresis(history.as_mut().map(|own| own.advance_to(q)));
        model.inverse_dynamics(&mut workspace, parameters, q, dq, ddq, &mut torque[..n]);
        for joint in 0..n {
            let random_number: f64 = StandardNormal.sample(&mut random);
            positions[joint].push(q[joint]);
            torques[joint].push(torque[joint] + noise.deviations[joint] * random_number);
        }
    }
    [positions, torques]
}
