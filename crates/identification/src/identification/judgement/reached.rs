//! Range of the motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::identification::observation::Motion;
use crate::identification::problem::Context;

/// Range of a joint's motion over the counted samples: minimum and maximum of each quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReachedRange {
    /// \[rad or m\].
    pub position: [f64; 2],
    /// \[rad/s or m/s\].
    pub velocity: [f64; 2],
    /// \[rad/s² or m/s²\].
    pub acceleration: [f64; 2],
}

impl ReachedRange {
    /// Returns the reached range of each joint.
    pub(super) fn from_context(context: &Context<'_>, motion: &Motion) -> Vec<Self> {
        let range = |value: &dyn Fn(usize) -> f64| {
            let values = context.experiment.counted_samples().map(value);
            values.fold([f64::MAX, f64::MIN], |[least, most], value| {
                [least.min(value), most.max(value)]
            })
        };
        let reached = |joint: usize| Self {
            position: range(&|k| motion.position[(k, joint)]),
            velocity: range(&|k| motion.velocity(k, joint)),
            acceleration: range(&|k| motion.acceleration(k, joint)),
        };
        (0..context.robot.joints()).map(reached).collect()
    }

    /// Returns the highest speed in either direction \[rad/s or m/s\].
    pub fn highest_speed(&self) -> f64 {
        self.velocity[0].abs().max(self.velocity[1].abs())
    }

    /// Returns the largest acceleration in either direction \[rad/s² or m/s²\].
    pub fn largest_acceleration(&self) -> f64 {
        self.acceleration[0].abs().max(self.acceleration[1].abs())
    }
}
