//! Motion of a scenario.

use didim_dynamics::trajectory::{Reference, SampledReference, Trajectory};

/// Planned moves, or a motion given point by point.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Moves, planned by [`Trajectory`].
    Moves(Trajectory),
    /// Motion given point by point, in the format of `didim design`.
    Recorded(SampledReference),
}

impl Motion {
    /// Returns the duration from start to end \[s\].
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Moves(moves) => moves.duration_s(),
            Self::Recorded(points) => points.duration_s(),
        }
    }
}

impl Reference for Motion {
    fn joints(&self) -> usize {
        match self {
            Self::Moves(moves) => moves.joints(),
            Self::Recorded(points) => points.joints(),
        }
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        match self {
            Self::Moves(moves) => moves.evaluate(time_s, position, velocity, acceleration),
            Self::Recorded(points) => points.evaluate(time_s, position, velocity, acceleration),
        }
    }
}
