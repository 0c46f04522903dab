//! Repeated motion with idle time around it.

use didim_dynamics::trajectory::Reference;
use serde::{Deserialize, Serialize};

use crate::motion::Motion;

/// Number of repetitions of a motion, and rest times of the arm before and after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaybackConfig {
    /// Rest before the motion \[s\].
    pub lead_in_s: f64,
    /// Rest after the motion \[s\].
    pub tail_s: f64,
    /// Number of repetitions of the motion with its rests; endless by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<u32>,
}

/// Reference that results from a motion and its playback: rest, motion, rest, then again from the
/// start.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    trajectory: Motion,
    config: PlaybackConfig,
}

impl Playback {
    /// Creates the playback of a motion. A motion that is repeated has to end at its starting
    /// point.
    pub(crate) fn new(trajectory: Motion, config: PlaybackConfig) -> Self {
        Self { trajectory, config }
    }

    /// Returns the duration of one repetition: rest, motion, rest \[s\].
    pub fn cycle_s(&self) -> f64 {
        self.config.lead_in_s + self.trajectory.duration_s() + self.config.tail_s
    }

    /// Returns the duration of all repetitions \[s\]; infinite for endless playback.
    pub fn duration_s(&self) -> f64 {
        self.config.cycles.map_or(f64::INFINITY, |cycles| f64::from(cycles) * self.cycle_s())
    }
}

impl Reference for Playback {
    fn joints(&self) -> usize {
        self.trajectory.joints()
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        // After the last repetition the arm stays at the end and does not return to the start.
        let in_cycle = if time_s < self.duration_s() {
            time_s.rem_euclid(self.cycle_s())
        } else {
            self.cycle_s()
        };
        let motion_s = in_cycle - self.config.lead_in_s;
        self.trajectory.evaluate(motion_s, position, velocity, acceleration);
    }
}
