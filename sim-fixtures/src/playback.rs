//! A motion with idle time around it, again and again.

use didim_core::trajectory::Reference;
use serde::{Deserialize, Serialize};

use crate::motion::Motion;

/// How often a motion is played and how long the arm rests before and after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaybackConfig {
    /// Rest before the motion \[s\].
    pub lead_in_s: f64,
    /// Rest after it \[s\].
    pub tail_s: f64,
    /// How often; for ever when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<u32>,
}

/// The reference that results: rest, motion, rest, and from the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Playback {
    trajectory: Motion,
    config: PlaybackConfig,
}

impl Playback {
    /// Plays a motion that ends where it starts, or plays any motion once.
    pub(crate) fn new(trajectory: Motion, config: PlaybackConfig) -> Self {
        Self { trajectory, config }
    }

    /// One cycle \[s\].
    pub fn cycle_s(&self) -> f64 {
        self.config.lead_in_s + self.trajectory.duration_s() + self.config.tail_s
    }

    /// All cycles \[s\]; infinite when it plays for ever.
    pub fn duration_s(&self) -> f64 {
        self.config.cycles.map_or(f64::INFINITY, |cycles| f64::from(cycles) * self.cycle_s())
    }
}

impl Reference for Playback {
    fn joints(&self) -> usize {
        self.trajectory.joints()
    }

    fn at(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        // After the last cycle it stands at the end, not again at the start.
        let in_cycle = if time_s < self.duration_s() {
            time_s.rem_euclid(self.cycle_s())
        } else {
            self.cycle_s()
        };
        let motion_s = in_cycle - self.config.lead_in_s;
        self.trajectory.at(motion_s, position, velocity, acceleration);
    }
}
